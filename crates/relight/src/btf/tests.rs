use super::*;
use std::f64::consts::PI;

const GO: fn() -> bool = || true;

fn noise(k: usize) -> f64 {
    (local::mixed(k as u64) >> 11) as f64 / (1u64 << 53) as f64 - 0.5
}

fn made(side: usize, v: usize, l: usize, f: impl Fn(usize, usize, usize) -> [f32; 3] + Sync) -> Btf {
    Btf::of((side, side), &spread(v), &spread(l), f).expect("a function")
}

fn small(of: &Btf, method: Method) -> Compressed {
    Compressed::new(of, method, &GO).expect("nobody stops it")
}

/// The error over all texels and pairs by decoding each, relative.
fn decoded(of: &Btf, c: &Compressed) -> f64 {
    let all = c.by_view(of);
    let [off, energy] = [0, 1].map(|k| all.iter().map(|v| v[k]).sum::<f64>());
    (off / energy).sqrt()
}

/// `k` clusters whose texels lie on planes of `c` dimensions.
fn planted(side: usize, v: usize, l: usize, [k, c]: [usize; 2]) -> Btf {
    made(side, v, l, |x, a, b| {
        let cluster = (x * 7919 / 13) % k;
        let table = |j: usize, q: usize| noise(((cluster * 9 + j) * 4096 + a * l + b) * 3 + q);
        let weight = |j: usize| noise(77_777 + x * 16 + j);
        [0, 1, 2].map(|q| (3.0 * table(0, q) + (1..=c).map(|j| weight(j) * table(j, q)).sum::<f64>()) as f32)
    })
}

/// Planted clusters come back to 1e-5, with all texels and numbers in view and from random sums; one
/// component or cluster less do not.
#[test]
fn planted_clusters_are_recovered() {
    for (side, v, l, k, c) in [(16, 5, 7, 4, 2), (16, 13, 11, 6, 3), (24, 13, 11, 5, 2)] {
        let of = planted(side, v, l, [k, c]);
        let good = small(&of, Method::Local { clusters: k, components: c });
        assert!(good.error() < 1e-5, "{}: {:?}", good.error(), good.errors);
        assert!(decoded(&of, &good) < 1e-5);
        assert!(small(&of, Method::Local { clusters: k, components: c - 1 }).error() > 1e-2);
        assert!(small(&of, Method::Local { clusters: k - 1, components: c }).error() > 1e-2);
    }
}

/// A surface of bumps that hide each other, roughly: texels shift with the view, and a highlight moves over
/// them.
fn bumpy(side: usize, v: usize, l: usize) -> Btf {
    let (views, lights) = (spread(v), spread(l));
    made(side, v, l, move |x, a, b| {
        let (v, l) = (views[a], lights[b]);
        let at = |k: usize, s: f64| k as f64 / side as f64 + 0.1 * s / v.z;
        let (i, j) = (at(x % side, v.x), at(x / side, v.y));
        let wave = |f: f64, x: f64, y: f64| (2.0 * PI * f * (x + y)).sin();
        let n = DVec3::new(0.6 * wave(2.0, i, j), 0.5 * wave(3.0, i, -j), 1.0).normalize();
        let h = (v + l).normalize();
        let lit = n.dot(l).max(0.0);
        let shine = 3.0 * n.dot(h).max(0.0).powi(20) * f64::from(u8::from(lit > 0.0));
        [0.7, 0.5, 0.3].map(|c| ((c + 0.2 * wave(1.0, i, 0.3 * j)) * lit + shine) as f32)
    })
}

/// A Lambertian surface of any colours is one cluster of rank 1 about 0, so that one component holds what the
/// mean does not; views, whose pictures under all lights are proportional, have rank 1 too, and a chain one
/// term.
#[test]
fn textured_lambert_has_rank_one() {
    let lights = spread(17);
    let of = made(20, 9, 17, |x, _, l| [0, 1, 2].map(|c| ((0.5 + noise(3 * x + c)) * lights[l].z) as f32));
    // Grey within a texel, so that the numbers of three colours have rank 1.
    let grey = made(20, 9, 17, |x, _, l| [((0.5 + noise(x)) * lights[l].z) as f32; 3]);
    assert!(small(&grey, Method::Local { clusters: 1, components: 1 }).error() < 1e-5);
    assert!(small(&grey, Method::Local { clusters: 1, components: 0 }).error() > 0.1);
    assert!(small(&of, Method::Local { clusters: 1, components: 3 }).error() < 1e-5);
    assert!(small(&of, Method::View { components: 1 }).error() < 1e-5);
    assert!(small(&of, Method::Chained { terms: 1, halves: 1, differences: 1 }).error() < 1e-5);
}

/// One cluster is PCA: the residual is the sum of the remaining eigenvalues of the covariance (Eckart & Young
/// 1936). Without components it is vector quantisation: tables are the means of their texels, and each texel
/// is in the nearest cluster.
#[test]
fn one_cluster_is_pca_and_no_component_is_vector_quantisation() {
    let of = bumpy(16, 9, 11);
    let (n, d) = (of.texels(), of.dimension());
    let rows: Vec<Vec<f64>> =
        (0..n).map(|x| (0..d).map(|i| f64::from(of.value(x, i / 33, i / 3 % 11)[i % 3])).collect()).collect();
    let mean: Vec<f64> = (0..d).map(|i| rows.iter().map(|r| r[i]).sum::<f64>() / n as f64).collect();
    let product =
        |a: &Vec<f64>, b: &Vec<f64>| (0..d).map(|i| (a[i] - mean[i]) * (b[i] - mean[i])).sum::<f64>();
    let gram = rows.iter().map(|a| rows.iter().map(|b| product(a, b)).collect()).collect();
    let values: Vec<f64> = steradian_numerics::eigen::symmetric(gram).into_iter().map(|p| p.0).collect();
    let energy: f64 = rows.iter().flatten().map(|x| x * x).sum();
    for components in [0, 1, 4, 9] {
        let got = small(&of, Method::Local { clusters: 1, components });
        let want = (values[components..].iter().sum::<f64>() / energy).sqrt();
        assert!((got.error() / want - 1.0).abs() < 1e-4, "{components}: {} {want}", got.error());
    }
    let vq = small(&of, Method::Local { clusters: 7, components: 0 });
    let Model::Local(m) = &vq.model else { panic!("clusters") };
    assert!(m.weights.is_empty() && m.len() == 7);
    let table = |k: usize| &m.tables[k * d..][..d];
    for x in 0..n {
        let distance = |k: usize| (0..d).map(|i| (f64::from(table(k)[i]) - rows[x][i]).powi(2)).sum::<f64>();
        let own = distance(m.cluster[x] as usize);
        assert!((0..7).all(|k| own <= distance(k) + 1e-6), "{x}");
    }
    for k in 0..7 {
        let members: Vec<usize> = (0..n).filter(|x| m.cluster[*x] == k as u32).collect();
        for i in [0, d / 2, d - 1] {
            let mean = members.iter().map(|x| rows[*x][i]).sum::<f64>() / members.len() as f64;
            assert!((mean - f64::from(table(k)[i])).abs() < 1e-5);
        }
    }
}

/// No step of any method raises the error; the last one equals that of decoding every number alone, in single
/// and in half precision; more components or clusters have smaller errors.
#[test]
fn no_step_raises_the_error_and_random_access_is_full_decoding() {
    let of = bumpy(20, 12, 13);
    let mut half = Btf::new((20, 20), of.views(), of.lights(), true).expect("a function");
    for v in 0..12 {
        for l in 0..13 {
            let plane = |c: usize| (0..of.texels()).map(|x| of.value(x, v, l)[c]).collect::<Vec<f32>>();
            half.set(v, l, [&plane(0), &plane(1), &plane(2)]).expect("a picture");
        }
    }
    let mut last = [f64::INFINITY; 3];
    for k in [1, 2, 4] {
        let methods = [
            Method::View { components: k },
            Method::Local { clusters: 2 * k, components: 2 * k },
            Method::Chained { terms: k, halves: 6 * k, differences: 16 },
        ];
        for (method, last) in methods.into_iter().zip(&mut last) {
            for (of, within) in [(&of, 1e-5), (&half, 1e-5)] {
                let c = small(of, method);
                assert!(!c.errors.is_empty());
                for w in c.errors.windows(2) {
                    // Results of double precision are stored in single: half an ulp of the values.
                    assert!(w[1] <= w[0] * (1.0 + 1e-6) + 6e-8, "{method:?}: {:?}", c.errors);
                }
                let got = decoded(of, &c);
                assert!((got - c.error()).abs() < within, "{method:?}: {got} {:?}", c.errors);
            }
            let error = small(&of, method).error();
            assert!(error < *last, "{method:?}: {error} after {last}");
            *last = error;
        }
    }
    // Every picture on its own: a view has as many components as lights.
    assert!(small(&of, Method::View { components: 13 }).error() < 1e-5);
}

/// A chain cannot represent occlusion that depends on the view: the function without the shift of texels with
/// the view has a far smaller error by it, while clusters represent both.
#[test]
fn a_chain_loses_what_views_hide() {
    let of = bumpy(20, 15, 15);
    let flat = {
        let (views, lights) = (spread(15), spread(15));
        made(20, 15, 15, move |x, v, l| {
            let h = (views[v] + lights[l]).normalize();
            let shine = 2.0 * h.z.powi(20);
            [((0.5 + 0.4 * noise(x)) * lights[l].z + shine * (0.5 + noise(x + 9000))) as f32; 3]
        })
    };
    let chain = Method::Chained { terms: 4, halves: 24, differences: 48 };
    let (bumps, plain) = (small(&of, chain).error(), small(&flat, chain).error());
    assert!(bumps > 2.0 * plain, "{bumps} {plain}");
}

/// Coarser texels are means of finer ones, in one cluster as exactly as the tables allow, and the weights of
/// the texels of a square sum to 1.
#[test]
fn coarser_texels_are_means() {
    let of = bumpy(12, 7, 6);
    for method in [
        Method::View { components: 6 },
        Method::Local { clusters: 1, components: 143 },
        Method::Chained { terms: 2, halves: 8, differences: 8 },
    ] {
        let c = small(&of, method);
        let levels = &c.levels;
        assert_eq!((levels.len(), levels.all()), (4, 144 + 36 + 9 + 1));
        for level in 1..4 {
            for k in 0..levels.texels(level) {
                let (_, _, first) = levels.level(level);
                let mut mean = [0.0f32; 3];
                for (from, w) in levels.covers(level, k) {
                    let v = c.decode(from, 3, 2);
                    (0..3).for_each(|q| mean[q] += w * v[q]);
                }
                let got = c.decode(first + k, 3, 2);
                (0..3).for_each(|q| assert!((got[q] - mean[q]).abs() < 2e-4, "{method:?} {got:?} {mean:?}"));
            }
        }
    }
    let odd = Levels::new(5, 3);
    assert_eq!(odd.level(1), (2, 1, 15));
    let sum = |taps: Vec<Tap>| taps.iter().map(|t| t.1).sum::<f32>();
    assert!((sum(odd.covers(1, 1)) - 1.0).abs() < 1e-6);
    for (uv, footprint) in [([0.1, 0.9], 0.0), ([-3.3, 1.0], 0.37), ([0.0, 0.0], 9.0)] {
        assert!((sum(odd.taps(uv, footprint).to_vec()) - 1.0).abs() < 1e-6);
    }
    // A texel's centre is the texel alone, and the whole patch the last one.
    assert!((odd.taps([0.5, 0.5], 0.0)[0].1 - 1.0).abs() < 1e-6 && odd.taps([0.5, 0.5], 0.0)[0].0 == 7);
    let whole = odd.taps([0.2, 0.7], 1.0);
    assert!(whole.iter().all(|t| t.1 == 0.0 || t.0 >= 15));
}

/// Directions are found at themselves, linear functions of the projection between them, and values stay from
/// the last ring to the horizon.
#[test]
fn nets_interpolate_between_directions() {
    for all in [bonn(), spread(40), spread(3), spread(1)] {
        let net = Net::new(&all);
        let single = |d: DVec3| d.as_vec3().to_array();
        for (k, d) in all.iter().enumerate() {
            let (corners, w) = net.around(single(*d));
            let own: f32 = (0..3).filter(|i| corners[*i] == k as u32).map(|i| w[i]).sum();
            assert!((own - 1.0).abs() < 1e-4, "{k}: {corners:?} {w:?}");
        }
        let mut before: Option<f32> = None;
        for k in 0..4000 {
            let d = around(89.9f64.to_radians() * f64::from(k) / 4000.0, 0.003 * f64::from(k));
            let (corners, w) = net.around(single(d));
            assert!((w.iter().sum::<f32>() - 1.0).abs() < 1e-5 && w.iter().all(|w| *w >= 0.0));
            let value = |i: u32| (all[i as usize].x * 3.0 + all[i as usize].y) as f32;
            let v: f32 = (0..3).map(|i| w[i] * value(corners[i])).sum();
            // With few directions the horizon passes from one to the next within a step of its ring.
            let most = if all.len() < 40 { 0.2 } else { 0.06 };
            assert!(before.is_none_or(|b| (b - v).abs() < most), "{k}: {before:?} {v}");
            before = Some(v);
            if all.len() == 81 && d.z > 75f64.to_radians().cos() + 0.01 {
                let project = |d: DVec3| d.truncate() / (1.0 + d.z);
                let p: glam::DVec2 =
                    (0..3).map(|i| f64::from(w[i]) * project(all[corners[i] as usize])).sum();
                // Between the outer ring's chord and its circle corners of the horizon take part.
                let inner = d.z > 72f64.to_radians().cos();
                assert!(!inner || (p - project(d)).length() < 1e-5, "{k}: {p} {}", project(d));
            }
        }
    }
}

#[test]
fn pictures_are_sorted_into_views_and_lights() {
    let all = spread(5);
    let pairs: Vec<(DVec3, DVec3)> =
        (0..20).map(|k| (all[k / 4], all[k % 4])).map(|(l, v)| (2.0 * l, v)).collect();
    let p = Pairing::new(&pairs).expect("complete");
    assert_eq!((p.views.len(), p.lights.len(), p.pictures[2 * 5 + 3]), (4, 5, 14));
    let e = Pairing::new(&pairs[..19]).expect_err("one is missing").to_string();
    assert!(e.contains("each view must have each light (1 of 20") && e.contains("theta 75.00"), "{e}");
    let twice = [&pairs[..], &pairs[3..4]].concat();
    assert_eq!(Pairing::new(&twice), Err(BtfError::Twice(3, 20)));
    let below = [(DVec3::NEG_Z, DVec3::Z)];
    assert!(matches!(Pairing::new(&below), Err(BtfError::Below("a light", ..))));
    // A thousand views of one light each: a million pictures would be needed, and none is allocated.
    let sparse: Vec<_> = spread(1000).into_iter().map(|d| (d, d)).collect();
    assert!(matches!(Pairing::new(&sparse), Err(BtfError::Missing { missing: 999_000, .. })));
    assert!(Pairing::new(&[]).is_err());
}

#[test]
fn views_that_no_picture_is_of_are_found_where_light_is() {
    let unseen = |views: usize, lights: usize| {
        let all = spread(81);
        let pairs: Vec<_> =
            all[..views].iter().flat_map(|v| all[..lights].iter().map(move |l| (*l, *v))).collect();
        Pairing::new(&pairs).expect("complete").unseen()
    };
    assert_eq!(unseen(80, 81), bonn()[80..]);
    assert!(unseen(81, 81).is_empty() && unseen(81, 80).is_empty());
    // Few views under many lights count as intended.
    assert!(unseen(7, 81).is_empty());
}

#[test]
fn what_does_not_fit_is_refused() {
    let up = [DVec3::Z];
    let new = |w, h, v: &[DVec3], l: &[DVec3]| Btf::new((w, h), v, l, true);
    assert!(matches!(new(0, 1, &up, &up), Err(BtfError::Size(..))));
    assert!(matches!(new(1, 1, &up, &[]), Err(BtfError::Size(..))));
    assert!(matches!(new(1, 1, &[DVec3::X], &up), Err(BtfError::Below("a view", ..))));
    let mut b = new(2, 1, &up, &up).expect("a function");
    let good = [0.5f32, 0.25];
    assert_eq!(b.set(0, 0, [&good, &good, &good[..1]]), Err(BtfError::Texels { got: 1, want: 2 }));
    assert_eq!(b.set(0, 0, [&good, &good, &[0.0, f32::NAN]]), Err(BtfError::Finite(1, 0)));
    assert!(matches!(b.set(0, 0, [&good, &good, &[1e6, 0.0]]), Err(BtfError::Large(0, 0, _))));
    b.set(0, 0, [&good, &good, &good]).expect("a picture");
    assert_eq!((b.value(1, 0, 0), b.largest()), ([0.25; 3], 0.5));
    assert!(Compressed::new(&b, Method::Local { clusters: 4, components: 2 }, &|| false).is_none());
    for method in [
        Method::View { components: 9 },
        Method::Local { clusters: 9, components: 9 },
        Method::Chained { terms: 3, halves: 2, differences: 2 },
    ] {
        let c = small(&b, method);
        assert!(c.error() < 1e-5 && (c.decode(0, 0, 0)[0] - 0.5).abs() < 1e-5, "{method:?}");
    }
}

/// The bits do not depend on the number of threads.
#[test]
fn threads_change_nothing() {
    let of = bumpy(24, 12, 12);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    for method in [
        Method::View { components: 3 },
        Method::Local { clusters: 5, components: 3 },
        Method::Chained { terms: 3, halves: 12, differences: 12 },
    ] {
        assert!(one.install(|| small(&of, method)) == small(&of, method), "{method:?}");
    }
}

/// On a plane a chain follows a highlight by 21 half vectors: with tables that are constant within cells of
/// equal solid angle it erred by 37 % of this one.
#[test]
fn a_chain_follows_a_highlight_on_a_plane() {
    let all = bonn();
    for (alpha, f0, most) in [(0.4, 0.3, 0.08), (0.2, 0.3, 0.11), (0.6, 0.04, 0.04)] {
        let ggx = |v: DVec3, l: DVec3| {
            let (a2, h) = (alpha * alpha, (v + l).normalize());
            let d = a2 / (PI * (h.z * h.z * (a2 - 1.0) + 1.0_f64).powi(2));
            let g = |z: f64| 2.0 / (z + (a2 + (1.0 - a2) * z * z).sqrt());
            let f = f0 + (1.0 - f0) * (1.0 - v.dot(h)).powi(5);
            [(0.25 * PI * d * f * g(v.z) * g(l.z) * l.z) as f32; 3]
        };
        let of = Btf::of((1, 1), &all, &all, |_, v, l| ggx(all[v], all[l])).expect("a function");
        let error = small(&of, Method::Chained { terms: 3, halves: 21, differences: 128 }).error();
        assert!(error < most, "{alpha}: {error}");
    }
}
