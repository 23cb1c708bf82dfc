//! Maps against sums with explicit rotations.

use super::*;
use glam::DVec3;
use steradian_base::Task;
use steradian_sphere::sh::{self, ColumnsRgb, ShRgb};

pub(super) fn noise(order: usize) -> ShRgb {
    let mut seed = 7u64;
    let mut next = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    ShRgb { order, c: std::array::from_fn(|_| (0..sh::count(order)).map(|_| next()).collect()) }
}

/// L'_lq at a frame by quadrature over the sphere.
fn brute(light: &ShRgb, frame: [DVec3; 3], l: usize, q: i32) -> [f64; 3] {
    let rule = steradian_sphere::quadrature::product_sphere(light.order + l);
    let mut y = vec![0.0; sh::count(l)];
    let mut sum = [0.0; 3];
    for (d, w) in rule.directions.iter().zip(&rule.weights) {
        let local = DVec3::from_array(frame.map(|axis| axis.dot(*d)));
        sh::eval(l, local, &mut y);
        let v = light.value(*d);
        (0..3).for_each(|c| sum[c] += w * v[c] * y[sh::index(l, q as isize)]);
    }
    sum
}

pub(super) fn kernel(order: usize, seed: usize) -> [Vec<f64>; 3] {
    std::array::from_fn(|c| (0..=order).map(|l| ((l * 5 + 3 * c + 11 * seed) as f64).cos()).collect())
}

#[test]
fn maps_are_the_sum_over_rotated_harmonics() {
    let order = 6;
    let light = noise(order);
    let columns = ColumnsRgb::from_world(&light);
    let kernels: Vec<[Vec<f64>; 3]> = (0..4).map(|q| kernel(order, q)).collect();
    let terms: Vec<Term> =
        kernels.iter().enumerate().map(|(q, k)| Term { q, k: k.each_ref().map(Vec::as_slice) }).collect();
    for grid in [Grid::new(9, 16), Grid::new(34, 7), Grid::new(2, 4)] {
        for q_max in [0, 3] {
            let maps = Plan::new(order, q_max, grid).maps(&columns, &terms, &Task::quiet()).expect("quiet");
            assert_eq!(maps.planes.len(), 7);
            let last = grid.rows() - 1;
            for (i, j) in
                [(0, 0), (0, grid.columns() - 1), (last, 1), (last / 2, 2), (last / 3, 3), (last - 1, 0)]
            {
                for (map, key) in maps.keys.iter().enumerate() {
                    let mut exact = [0.0; 3];
                    for l in key.q.unsigned_abs() as usize..=order {
                        let b = brute(&light, grid.frame(i, j), l, key.q);
                        (0..3).for_each(|c| exact[c] += kernels[key.term][c][l] * b[c]);
                    }
                    for c in 0..3 {
                        let got = f64::from(maps.planes[map][c][i * grid.columns() + j]);
                        assert!(
                            (got - exact[c]).abs() < 3e-6,
                            "{grid:?} {i} {j} {key:?} {c}: {got} {}",
                            exact[c]
                        );
                    }
                }
            }
        }
    }
}

fn ring_of(order: usize, p: usize) -> (ColumnsRgb, Vec<[Vec<f64>; 3]>) {
    let rows = pairs(p).iter().map(|(p, q)| kernel(order, 10 * p + q)).collect();
    (ColumnsRgb::from_world(&noise(order)), rows)
}

fn terms_of(rows: &[[Vec<f64>; 3]], p: usize) -> Vec<Term<'_>> {
    let both = pairs(p).into_iter().zip(rows);
    both.map(|((_, q), k)| Term { q, k: k.each_ref().map(Vec::as_slice) }).collect()
}

fn complete(order: usize, p: usize, grid: Grid) -> CoefficientMaps {
    let (light, rows) = ring_of(order, p);
    Plan::new(order, p, grid).maps(&light, &terms_of(&rows, p), &Task::quiet()).expect("nobody cancels")
}

/// Σ B_pq y_pq(R⁻¹wo) at a texel.
fn local_value(maps: &CoefficientMaps, p: usize, (i, j): (usize, usize), wo: DVec3) -> [f64; 3] {
    let grid = maps.grid;
    let y = global::harmonics(p, DVec3::from_array(grid.frame(i, j).map(|axis| axis.dot(wo))));
    let pairs = pairs(p);
    std::array::from_fn(|c| {
        let of = |(k, plane): (&Key, &[Vec<f32>; 3])| {
            let v = f64::from(plane[c][i * grid.columns() + j]);
            v * y[sh::index(pairs[k.term].0, k.q as isize)]
        };
        maps.keys.iter().zip(&maps.planes).map(of).sum()
    })
}

#[test]
fn local_and_global_agree_at_every_texel() {
    let (p, grid) = (3, Grid::new(13, 20));
    let maps = complete(7, p, grid);
    let global = global::from_local(&maps, p).expect("complete");
    let wo = DVec3::new(0.3, -0.5, 0.8).normalize();
    let frame = global.frame(wo);
    for (i, j) in [(0, 0), (0, 13), (12, 4), (12, 19), (6, 6), (3, 17), (11, 0)] {
        let exact = local_value(&maps, p, (i, j), wo);
        for c in 0..3 {
            assert!((f64::from(frame[c][i * 20 + j]) - exact[c]).abs() < 1e-5, "{i} {j}");
        }
    }
    let back = global::to_local(&global);
    assert_eq!(back.keys, maps.keys);
    for (a, b) in back.planes.iter().flatten().flatten().zip(maps.planes.iter().flatten().flatten()) {
        assert!((a - b).abs() < 1e-5);
    }
    assert!(global::from_local(&maps, 2).is_none());
}

#[test]
fn global_maps_are_functions_of_the_sphere() {
    let (order, p) = (9, 2);
    let (light, rows) = ring_of(order, p);
    let terms = terms_of(&rows, p);
    let coefficients =
        global::coefficients(&light, order, &terms, p, &Task::quiet()).expect("nobody cancels");
    assert_eq!(coefficients.len(), 9);
    let grid = Grid::new(11, 16);
    let maps = complete(order, p, grid);
    let global = global::from_local(&maps, p).expect("complete");
    for (columns, planes) in coefficients.iter().zip(&global.planes) {
        assert_eq!(columns.order(), order + p);
        let texels = [(0, 3), (10, 1), (5, 5), (2, 9), (9, 0)];
        let directions = texels.map(|(i, j)| grid.direction(i, j));
        let mut got: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; texels.len()]);
        let synthesis = sh::PointSynthesis::new(columns, &[], 1e-9);
        synthesis.at(&directions, got.each_mut().map(Vec::as_mut_slice));
        for (k, (i, j)) in texels.iter().enumerate() {
            for c in 0..3 {
                let exact = f64::from(planes[c][i * 16 + j]);
                assert!((got[c][k] - exact).abs() < 1e-5, "{i} {j}: {} {exact}", got[c][k]);
            }
        }
        // Axes are the middles of an even cube's faces.
        let cube = global::cube(columns, 6);
        let image = global::image(columns, (steradian_sphere::Layout::Cube, 5, 5));
        for (face, d) in [(0, DVec3::X), (3, -DVec3::Y), (4, DVec3::Z)] {
            let at = cube.sample(d.as_vec3().to_array());
            synthesis.at(&[d], got.each_mut().map(Vec::as_mut_slice));
            for c in 0..3 {
                assert!((f64::from(at[c]) - got[c][0]).abs() < 1e-4);
                assert!((f64::from(image.texel(face, 2, 2)[c]) - got[c][0]).abs() < 1e-4);
            }
        }
    }
}

#[test]
fn explicit_forms_come_back() {
    for p in [0, 1, 2] {
        let grid = Grid::new(8, 12);
        let maps = complete(5, p, grid);
        let global = global::from_local(&maps, p).expect("complete");
        let twelve = explicit::icosahedron();
        let views = explicit::views(&global, &twelve);
        for (k, wo) in twelve.iter().enumerate() {
            let exact = local_value(&maps, p, (2, 5), *wo);
            assert!((f64::from(views[k][1][2 * 12 + 5]) - exact[1]).abs() < 1e-5);
        }
        let back = explicit::from_views(grid, &views, &twelve, p).expect("twelve are enough");
        close(&back.planes, &global.planes);
        let set = explicit::set(6);
        let planes = explicit::local(&maps, p, &set).expect("complete");
        let back = explicit::from_local(grid, &planes, &set, None, p).expect("36 are enough");
        assert_eq!(back.keys, maps.keys);
        close(&back.planes, &maps.planes);
        let elevations: Vec<f64> = (0..7).map(|k| f64::from(k) * 0.4).collect();
        let texture = explicit::texture_3d(&maps, p, &elevations).expect("zonal terms come first");
        let back = explicit::from_texture_3d(grid, &texture, &elevations, None, p).expect("7 are enough");
        close(&back.planes, &maps.planes[..=p]);
        assert!(explicit::from_views(grid, &views[..3], &twelve, p).is_none());
        assert!(explicit::from_texture_3d(grid, &texture[..1], &elevations[..1], None, 1).is_none());
    }
}

fn close(a: &[[Vec<f32>; 3]], b: &[[Vec<f32>; 3]]) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().flatten().flatten().zip(b.iter().flatten().flatten()) {
        assert!((a - b).abs() < 2e-5, "{a} {b}");
    }
}

/// q = 0 and p = 0 is a convolution: k_l0 = √(4π/(2l+1))-scaled factors of each band.
#[test]
fn a_radial_kernel_is_a_convolution_and_order_zero_is_the_mean() {
    for order in [0, 12] {
        let light = noise(order);
        let k = kernel(order, 3);
        let term = Term { q: 0, k: k.each_ref().map(Vec::as_slice) };
        let grid = Grid::new(17, 24);
        let maps = Plan::new(order, 0, grid)
            .maps(&ColumnsRgb::from_world(&light), &[term], &Task::quiet())
            .expect("nobody cancels");
        for c in 0..3 {
            let mut convolved = light.clone();
            let factor = |l: usize| k[c][l] * (4.0 * std::f64::consts::PI / (2 * l + 1) as f64).sqrt();
            convolved.convolve(&(0..=order).map(factor).collect::<Vec<_>>());
            for (i, j) in [(0, 5), (16, 2), (8, 8), (3, 20)] {
                let exact = convolved.value(grid.direction(i, j))[c];
                assert!((f64::from(maps.planes[0][c][i * 24 + j]) - exact).abs() < 3e-6);
            }
        }
    }
}

#[test]
fn light_of_one_harmonic_gives_one_harmonic() {
    // L = Y_lm: B_00 = k y_lm(C) √(4π/(2l+1)) at any band, here a high one.
    for (l, m) in [(5, -3), (60, 17), (200, 200)] {
        let mut light = ShRgb::zero(l);
        light.c[0][sh::index(l, m)] = 1.0;
        let mut k = vec![0.0; l + 1];
        k[l] = 1.0;
        let grid = Grid::new(33, 8);
        let maps = Plan::new(l, 0, grid)
            .maps(&ColumnsRgb::from_world(&light), &[Term { q: 0, k: [&k; 3] }], &Task::quiet())
            .expect("nobody cancels");
        let mut y = vec![0.0; sh::count(l)];
        for (i, j) in [(0, 1), (9, 3), (16, 7), (31, 0), (32, 4)] {
            sh::eval(l, grid.direction(i, j), &mut y);
            let exact = y[sh::index(l, m)] * (4.0 * std::f64::consts::PI / (2 * l + 1) as f64).sqrt();
            let got = f64::from(maps.planes[0][0][i * 8 + j]);
            assert!((got - exact).abs() < 1e-6, "{l} {m} at {i} {j}: {got} {exact}");
        }
    }
}

#[test]
fn the_thread_count_does_not_change_a_bit() {
    let made: Vec<CoefficientMaps> = [1, 2, 5]
        .map(|n| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("threads start");
            pool.install(|| complete(30, 2, Grid::new(40, 64)))
        })
        .into();
    assert!(made.iter().all(|m| m.planes == made[0].planes));
}

#[test]
fn whoever_cancels_is_heard_and_odd_requests_are_harmless() {
    let (light, rows) = ring_of(4, 1);
    let plan = Plan::new(2, 0, Grid::new(0, 0));
    let flag = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(true));
    assert!(plan.maps(&light, &terms_of(&rows, 1), &Task::quiet().with_cancel(flag)).is_err());
    // A term above the order, none at all, kernels shorter than the light.
    let maps = plan.maps(&light, &[Term { q: 5, k: [&[1.0]; 3] }], &Task::quiet()).expect("nobody cancels");
    assert!(maps.planes.iter().flatten().flatten().all(|x| *x == 0.0));
    assert!(plan.maps(&light, &[], &Task::quiet()).expect("nobody cancels").planes.is_empty());
    let short = plan.maps(&light, &[Term { q: 1, k: [&[], &[1.0], &[0.0, 2.0]] }], &Task::quiet());
    assert!(short.expect("nobody cancels").planes[0][0].iter().all(|x| *x == 0.0));
}

/// (u⁺)² + (u⁻)² over m is orthogonal at any order; a wrong seed or an unstable step would break it.
#[test]
fn rotations_stay_orthogonal_to_order_1023() {
    let order = 1023;
    for q in [0, 1, 5] {
        let alpha = [1e-9, 0.003, 0.1, 0.7, 1.2, std::f64::consts::FRAC_PI_2];
        let rings = recursion::Rings::new(&alpha);
        let mut sums = vec![[0.0; 6]; order + 1];
        for m in 0..=order {
            let mut column = recursion::Column::default();
            let steps = recursion::steps(m, q, order);
            steradian_simd::run(recursion::Fill { m, q, steps: &steps, rings: &rings, column: &mut column });
            let parts = if q > 0 { 2 } else { 1 };
            for (k, row) in column.rows.chunks_exact(parts * recursion::RINGS).enumerate() {
                for i in 0..6 {
                    sums[column.first + k][i] += row[i].powi(2);
                    if q > 0 {
                        sums[column.first + k][i] += row[recursion::RINGS + i].powi(2);
                    }
                }
            }
        }
        // Each of y_lq and y_l,−q is of length one.
        let exact = if q > 0 { 2.0 } else { 1.0 };
        for l in [q, q + 1, 60, 500, 1023] {
            for i in 0..6 {
                assert!((sums[l][i] - exact).abs() < 2e-10, "{q} {l} {i}: {}", sums[l][i] - exact);
            }
        }
    }
}
