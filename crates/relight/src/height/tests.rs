//! Horizons of closed form, against rays, and on real height maps.

use super::*;
use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

fn go_on() -> bool {
    true
}

fn field(width: usize, height: usize, z: impl Fn(usize, usize) -> f64) -> HeightField {
    let z = (0..width * height).map(|k| z(k % width, k / width) as f32).collect();
    HeightField::new(width, height, z).expect("finite")
}

/// The horizon of a point before an endless wall of slope `t` at x > 0: tan e = t cos φ.
fn wall(t: f64, phi: f64) -> f64 {
    (t * phi.cos()).max(0.0).atan()
}

/// The slope that a line from vertex (i, j) sees, by small steps over bilinear-free triangles.
fn by_steps(f: &HeightField, i: usize, j: usize, phi: f64) -> f64 {
    let z = |x: f64, y: f64| {
        let (a, b) = (x.floor(), y.floor());
        let (u, v) = (x - a, y - b);
        let at = |i: f64, j: f64| f64::from(f.at(i as i64, j as i64));
        let (z00, z11) = (at(a, b), at(a + 1.0, b + 1.0));
        if u > v {
            let z10 = at(a + 1.0, b);
            z00 + u * (z10 - z00) + v * (z11 - z10)
        } else {
            let z01 = at(a, b + 1.0);
            z00 + v * (z01 - z00) + u * (z11 - z01)
        }
    };
    let z0 = f64::from(f.at(i as i64, j as i64));
    let mut best = 0.0_f64;
    for k in 1..8000 {
        let s = 0.01 * f64::from(k);
        best = best.max((z(i as f64 + s * phi.cos(), j as f64 - s * phi.sin()) - z0) / s);
    }
    best
}

#[test]
fn slopes_are_those_of_small_steps() {
    let f = field(16, 12, |i, j| (1.3 * i as f64).sin() + (2.1 * j as f64 + 0.4 * i as f64).cos());
    for (k, phi) in [0.0, 0.3, PI / 4.0, 2.0, PI, 4.4, 5.9].into_iter().enumerate() {
        let slopes = walk::slopes(&f, &[phi], &go_on).expect("not stopped");
        for (i, j) in [(0, 0), (5, 3), (15, 11), (7, (k + 5) % 12)] {
            let (got, want) = (f64::from(slopes[j * 16 + i]), by_steps(&f, i, j, phi));
            assert!((got - want).abs() < 0.02 * (1.0 + want), "{phi} ({i}, {j}): {got}, {want}");
        }
    }
}

/// Groups of crossings are skipped only where they change nothing: the same bits, on fields narrower and
/// wider than a block, flat, steep and rough.
#[test]
fn groups_left_out_change_no_bit() {
    let noise = |i: usize, j: usize| f64::from((i * 7919 + j * 104_729 + i * j * 31) as u32 % 1009) / 1009.0;
    let steep = |i: usize, j: usize| if (i / 9 + j / 13).is_multiple_of(3) { 40.0 } else { noise(i, j) };
    let smooth = |i: usize, j: usize| (0.2 * i as f64).sin() * (0.13 * j as f64).cos() * 9.0 + noise(i, j);
    let phis: Vec<f64> = (0..13).map(|k| 0.37 + TAU * f64::from(k) / 13.0).collect();
    for (w, h) in [(1, 1), (5, 3), (40, 70), (64, 20), (130, 97)] {
        for f in [field(w, h, noise), field(w, h, steep), field(w, h, smooth), field(w, h, |_, _| 2.0)] {
            let all = f.slopes_by_every_crossing(&phis);
            assert_eq!(walk::slopes(&f, &phis, &go_on).expect("not stopped"), all, "{w} x {h}");
        }
    }
}

/// A texel at the foot of an endless wall of slope `t` towards +x; the next wall, 2047 texels to the left,
/// reaches 0.03° t above the horizon.
fn before_a_wall(t: f64) -> HeightField {
    field(2048, 3, |i, _| if i == 1 { t } else { 0.0 })
}

/// Linear between azimuths, the horizon of a wall of slope 1 is off by 3.3, 0.95, 0.24 and 0.06 degrees at
/// most with 8 to 64 of them, as the horizons of a field are read.
#[test]
fn azimuths_of_a_wall_err_as_their_step_squared() {
    let f = before_a_wall(1.0);
    for (n, want) in [(8, 3.3), (16, 0.95), (32, 0.24), (64, 0.06)] {
        let h = Horizons::new(&f, n, &go_on).expect("not stopped");
        // The texel in the middle row. Azimuths towards the wall; the others see the one far away.
        let error = |x: f64| (f64::from(h.elevation(2048, x as f32)) - wall(1.0, x)).abs().to_degrees();
        let worst = (-5000..=5000).map(|k| error(PI * f64::from(k) / 10000.0)).fold(0.0, f64::max);
        println!("{n} azimuths: {worst:.3} degrees");
        assert!((worst - want).abs() < 0.06 * want + 0.003, "{n}: {worst}");
    }
}

/// Heights a sin kx: the error of the normals falls as the square of the distance between texels.
#[test]
fn normals_of_a_wave_err_as_the_square_of_the_distance() {
    let worst = |n: usize| {
        // a k = 0.8, two waves in n texels.
        let k = 2.0 * TAU / n as f64;
        let f = field(n, 3, |i, _| 0.8 / k * (k * i as f64).sin());
        let off = |i: usize| {
            let exact = Vec3::new(-0.8 * (k * i as f64).cos() as f32, 0.0, 1.0);
            f64::from((f.normal(i, 1) - exact.normalize()).length())
        };
        (0..n).map(off).fold(0.0, f64::max)
    };
    let errors = [16, 32, 64].map(worst);
    for pair in errors.windows(2) {
        assert!((3.7..4.3).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
}

/// The wall as a field: texels at its foot see the ridge, and their horizons are read back as they were
/// computed.
#[test]
fn a_ridge_is_seen_from_its_foot() {
    let f = field(64, 64, |i, _| if i == 40 { 10.0 } else { 0.0 });
    let h = Horizons::new(&f, 32, &go_on).expect("not stopped");
    let texel = 20 * 64 + 30;
    for k in [0, 3, 5] {
        let phi = TAU * f64::from(k) / 32.0;
        let got = f64::from(h.elevation(texel, phi as f32));
        // The ridge stands ten texels to the right.
        assert!((got - wall(1.0, phi)).abs() < 1e-4, "{k}: {got}, {}", wall(1.0, phi));
    }
    let d = |degrees: f32| Vec3::new(degrees.to_radians().cos(), 0.0, degrees.to_radians().sin());
    assert_eq!((h.visible(texel, d(46.0), 0.0), h.visible(texel, d(44.0), 0.0)), (1.0, 0.0));
    // A disk that the ridge halves.
    assert!((h.visible(texel, d(45.0), 0.1) - 0.5).abs() < 1e-3);
    assert!(h.visible(texel, d(48.0), 0.1) > 0.7 && h.visible(texel, d(42.0), 0.1) < 0.3);
}

/// Area between an ellipse and a horizon, as a part of the disk.
fn missed(ellipse: Ellipse, horizon: impl Fn(f64) -> f64) -> f64 {
    let (mut wrong, mut all) = (0, 0);
    for i in 0..400 {
        for j in 0..400 {
            let (x, y) = (f64::from(i) / 199.5 - 1.0, f64::from(j) / 199.5 - 1.0);
            let r = x.hypot(y);
            if r < 1.0 {
                let d = Vec3::new(x as f32, y as f32, (1.0 - r * r).sqrt() as f32);
                all += 1;
                wrong += usize::from(ellipse.lit(d) != (r <= horizon(y.atan2(x)).cos()));
            }
        }
    }
    wrong as f64 / f64::from(all)
}

/// Where tan e = t |cos φ|, the horizon is the ellipse of semi-axes 1/√(1 + t²) and 1; of a pit it is a
/// circle.
#[test]
fn grooves_and_pits_are_ellipses_and_walls_nearly() {
    let of = |horizon: &dyn Fn(f64) -> f64| {
        let e: Vec<f32> = (0..64).map(|k| horizon(TAU * f64::from(k) / 64.0) as f32).collect();
        Ellipse::new(&e)
    };
    for t in [0.3, 1.0, 3.0] {
        let Ellipse(q) = of(&|phi| (t * phi.cos().abs()).atan());
        let want = [1.0 + t * t, 0.0, 1.0, 0.0, 0.0];
        let worst = q.iter().zip(want).map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-4 * want[0], "{t}: {q:?}");
    }
    let Ellipse(q) = of(&|_| 0.5);
    let circle = 0.5_f64.cos().powi(-2);
    assert!((f64::from(q[0]) - circle).abs() < 1e-4 && (f64::from(q[2]) - circle).abs() < 1e-4, "{q:?}");
}

/// The conic of least squares of A r² + B r = 1 through a texel's horizon, each azimuth with the same weight.
fn by_least_squares(h: &Horizons, texel: usize) -> Ellipse {
    let (mut a, mut b) = (vec![vec![0.0; 5]; 5], vec![0.0; 5]);
    for k in 0..h.azimuths() {
        let phi = TAU * k as f64 / h.azimuths() as f64;
        let r = f64::from(h.sample(texel, k)).cos();
        let (x, y) = (r * phi.cos(), r * phi.sin());
        let row = [x * x, x * y, y * y, x, y];
        for i in 0..5 {
            b[i] += row[i];
            (0..5).for_each(|j| a[i][j] += row[i] * row[j]);
        }
    }
    let q = steradian_numerics::dense::Cholesky::new(&a).expect("five points that differ").solve(b);
    Ellipse(std::array::from_fn(|k| q[k] as f32))
}

/// A one-sided wall is no ellipse: one of plain least squares misses 2.0 % of the disk at slope 1 and 4.2 %
/// at slope 3; the ellipses that the field is given, which minimise what is missed, 0.4 % at most.
#[test]
fn ellipses_before_a_wall_miss_little_of_the_disk() {
    for (t, plain) in [(1.0, 0.020), (3.0, 0.042)] {
        let f = before_a_wall(t);
        let (h, e) = (Horizons::new(&f, 64, &go_on), Ellipses::new(&f, &go_on));
        let (h, e) = h.zip(e).expect("not stopped");
        let [wrong, usual] = [e.0[2048], by_least_squares(&h, 2048)].map(|e| missed(e, |phi| wall(t, phi)));
        println!(
            "a wall of slope {t}: {:.2} % of the disk, by least squares {:.2} %",
            100.0 * wrong,
            100.0 * usual
        );
        assert!((usual / plain - 1.0).abs() < 0.03, "{t}: {usual}");
        assert!(wrong < 0.004, "{t}: {wrong}");
    }
}

#[test]
fn what_is_no_field_is_refused() {
    let size = |w, h, n| HeightField::new(w, h, vec![0.0; n]).expect_err("no field");
    assert!(
        matches!(size(4, 4, 15), HeightError::Size { .. })
            && matches!(size(0, 4, 0), HeightError::Size { .. })
    );
    assert!(matches!(size(usize::MAX, 2, 8), HeightError::Size { .. }));
    let mut z = vec![0.0; 12];
    z[7] = f32::NAN;
    assert_eq!(HeightField::new(4, 3, z), Err(HeightError::Finite(3, 1)));
    // One texel is a plane, and long steps of heights stay finite.
    let one = HeightField::new(1, 1, vec![-7.0]).expect("a plane");
    assert_eq!(Horizons::new(&one, 8, &go_on).expect("not stopped").elevation(0, 1.0), 0.0);
    let high = field(3, 2, |i, _| if i == 1 { 1e30 } else { -1e30 });
    assert!(
        Ellipses::new(&high, &go_on)
            .expect("not stopped")
            .0
            .iter()
            .all(|e| e.0.iter().all(|v| v.is_finite()))
    );
    assert!(Horizons::new(&high, 8, &|| false).is_none());
}

/// The same bits by one thread and by three: horizons, ellipses, and links from texel to texel.
#[test]
fn threads_change_nothing() {
    let f = field(61, 47, |i, j| (0.9 * i as f64).sin() + (0.7 * j as f64 + 0.2 * i as f64).cos());
    let along = |texel: usize, k: usize| {
        let (s, c) = (0.7 * k as f32 + 0.01 * texel as f32).sin_cos();
        Vec3::new(0.8 * c, 0.8 * s, 0.6)
    };
    let made = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let tables = Horizons::new(&f, 12, &go_on).expect("not stopped");
            let all = (0..61 * 47).flat_map(|t| (0..12).map(move |k| (t, k)));
            let horizons: Vec<u32> = all.map(|(t, k)| tables.sample(t, k).to_bits()).collect();
            let ellipses = Ellipses::new(&f, &go_on).expect("not stopped").0;
            let ellipses: Vec<u32> = ellipses.iter().flat_map(|e| e.0.map(f32::to_bits)).collect();
            let links = Scattering::new(&f, 9, &along, &go_on).expect("not stopped");
            (horizons, ellipses, links.links().to_vec())
        })
    };
    let one = made(1);
    assert!(one.2.iter().any(|l| *l != one.2[0]), "links differ");
    assert!(one == made(3));
}

/// Real height maps with relief of 8 % of their side: texels that a light 60 and 75 degrees off the normal
/// reaches or does not, over all azimuths.
#[test]
fn real_height_maps_are_lit_where_rays_light_them() {
    let Some(dir) = steradian_testkit::data("meshes/textures") else { return };
    let names = ["rocks_NM_height.tga", "stones_NM_height.tga"];
    for name in names.into_iter().take(if steradian_testkit::full() { 2 } else { 1 }) {
        let file: PathBuf = dir.join(name);
        let limits = steradian_formats::Limits::default();
        let raster = steradian_formats::read_image(&file, &limits).expect("an image");
        let z = raster.channel("A").expect("height in alpha").iter().map(|v| 0.08 * 256.0 * v).collect();
        let f = HeightField::new(raster.width, raster.height, z).expect("finite");
        let tables = [16, 32].map(|n| Horizons::new(&f, n, &go_on).expect("not stopped"));
        let ellipses = Ellipses::new(&f, &go_on).expect("not stopped");
        // At eight places between two azimuths of the tables, each in another direction.
        let phi = |k: u32| TAU / 16.0 * (f64::from(5 * k % 16) + (f64::from(k) + 0.5) / 8.0);
        let phis: Vec<f64> = (0..8).map(phi).collect();
        let truth = walk::slopes(&f, &phis, &go_on).expect("not stopped");
        for (theta, most) in [(60.0_f64, [0.02, 0.007, 0.07]), (75.0, [0.03, 0.012, 0.12])] {
            let e = (90.0 - theta).to_radians();
            let mut by_azimuth = vec![[0.0; 3]; phis.len()];
            for ((k, phi), wrong) in phis.iter().enumerate().zip(&mut by_azimuth) {
                let d = Vec3::new((e.cos() * phi.cos()) as f32, (e.cos() * phi.sin()) as f32, e.sin() as f32);
                for texel in 0..f.heights().len() {
                    let lit = f64::from(truth[k * f.heights().len() + texel]).atan() < e;
                    let said = [
                        tables[0].visible(texel, d, 0.0) > 0.5,
                        tables[1].visible(texel, d, 0.0) > 0.5,
                        ellipses.0[texel].lit(d),
                    ];
                    let one = 1.0 / f.heights().len() as f64;
                    (0..3).for_each(|m| wrong[m] += one * f64::from(u8::from(said[m] != lit)));
                }
            }
            let wrong = [0, 1, 2]
                .map(|m| by_azimuth.iter().map(|w: &[f64; 3]| w[m]).sum::<f64>() / phis.len() as f64);
            for (m, way) in ["16 azimuths", "32 azimuths", "ellipses"].into_iter().enumerate() {
                let worst = (0..phis.len()).max_by(|a, b| by_azimuth[*a][m].total_cmp(&by_azimuth[*b][m]));
                let worst = worst.expect("azimuths");
                println!(
                    "{name}, {theta}°: {way} {:.2} %, {:.2} % with the light at azimuth {:.0}°",
                    100.0 * wrong[m],
                    100.0 * by_azimuth[worst][m],
                    phis[worst].to_degrees()
                );
            }
            (0..3).for_each(|m| assert!(wrong[m] <= most[m], "{name}, {theta}: {wrong:?}"));
        }
    }
}

/// Patterns repeat, stay between 0 and 1 and reach both, nearly.
#[test]
fn patterns_repeat() {
    for p in Pattern::ALL {
        assert_eq!(Pattern::of_name(p.name()), Some(p));
        let z = p.heights(96);
        let (low, high) = z.iter().fold((1.0f32, 0.0f32), |(a, b), z| (a.min(*z), b.max(*z)));
        assert!((0.0..0.1).contains(&low) && high <= 1.0 + 1e-6 && high > 0.9, "{p:?}: {low} {high}");
        for k in 0..200u32 {
            let (x, y) = ((f64::from(k) * 0.7549).fract(), (f64::from(k) * 0.5698).fract());
            assert!((p.height(x, y) - p.height(x + 1.0, y - 2.0)).abs() < 1e-9, "{p:?}");
        }
    }
    assert_eq!(Pattern::of_name("waves"), None);
}
