//! Round trips, exactness, aliasing and agreement with direct sums.

use super::*;
use crate::quadrature::gauss_legendre;
use crate::sh::{count, eval, index, legendre};
use glam::DVec3;

fn noise(order: usize) -> ShRgb {
    let mut seed = 1u64;
    let mut next = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    ShRgb { order, c: std::array::from_fn(|_| (0..count(order)).map(|_| next()).collect()) }
}

fn synthesized(sh: &ShRgb, plan: &ShTransform) -> [Vec<f64>; 3] {
    let n = plan.width * plan.height;
    let mut planes: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; n]);
    plan.synthesize(sh, planes.each_mut().map(Vec::as_mut_slice));
    planes
}

/// Root mean square and greatest change of coefficients within ±½.
fn round_trip(order: usize, width: usize, height: usize, grid: Grid) -> (f64, f64) {
    changes(&ShTransform::new(order, width, height, grid))
}

fn changes(plan: &ShTransform) -> (f64, f64) {
    let order = plan.order;
    let sh = noise(order);
    let planes = synthesized(&sh, plan);
    let back = plan.analyze(planes.each_ref().map(Vec::as_slice));
    let (mut sum, mut worst) = (0.0, 0.0_f64);
    for (a, b) in sh.c.iter().flatten().zip(back.c.iter().flatten()) {
        sum += (a - b).powi(2);
        worst = worst.max((a - b).abs());
    }
    ((sum / (3 * count(order)) as f64).sqrt(), worst)
}

/// The direction of a sample.
fn direction(plan: &ShTransform, i: usize, j: usize) -> DVec3 {
    let (y, phi) = (plan.cos_theta()[j], -PI + 2.0 * PI * (i as f64 + 0.5) / plan.width as f64);
    let r = (1.0 - y * y).sqrt();
    DVec3::new(r * phi.cos(), y, r * phi.sin())
}

#[test]
fn synthesis_is_the_sum_over_the_basis() {
    for (grid, width, height) in
        [(Grid::Equirectangular, 33, 20), (Grid::GaussLegendre, 12, 9), (Grid::ClenshawCurtis, 40, 31)]
    {
        let sh = noise(13);
        let plan = ShTransform::new(13, width, height, grid);
        let planes = synthesized(&sh, &plan);
        for (i, j) in [(0, 0), (width - 1, height - 1), (3, height / 2), (7, 2)] {
            let v = sh.value(direction(&plan, i, j));
            for k in 0..3 {
                assert!((planes[k][j * width + i] - v[k]).abs() < 1e-12, "{grid:?} {i} {j}");
            }
        }
    }
}

#[test]
fn the_round_trip_is_exact_at_band_255() {
    for (grid, width, height) in [
        (Grid::Equirectangular, 1024, 512),
        (Grid::GaussLegendre, 512, 256),
        (Grid::ClenshawCurtis, 511, 511),
        (Grid::Equirectangular, 513, 513),
    ] {
        let (rms, worst) = round_trip(255, width, height, grid);
        assert!(rms < 1e-13 && worst < 1e-11, "{grid:?} rms {rms:e} worst {worst:e}");
        assert!(ShTransform::new(255, width, height, grid).is_exact());
    }
}

#[test]
fn the_round_trip_is_exact_at_band_600() {
    let (rms, worst) = round_trip(600, 1250, 601, Grid::GaussLegendre);
    assert!(rms < 1e-12 && worst < 1e-11, "rms {rms:e} worst {worst:e}");
}

#[test]
fn the_round_trip_is_stable_at_band_2047() {
    if steradian_testkit::full() {
        let (rms, worst) = round_trip(2047, 4096, 2048, Grid::GaussLegendre);
        assert!(rms < 1e-12 && worst < 1e-10, "rms {rms:e} worst {worst:e}");
    }
}

#[test]
fn image_precision_keeps_six_digits() {
    let mut cases = vec![(63, 128, 64), (255, 512, 256), (400, 1001, 401)];
    if steradian_testkit::full() {
        cases.push((2047, 4096, 2048));
    }
    for (order, width, height) in cases {
        let (rms, worst) = changes(&ShTransform::with_precision(
            order,
            width,
            height,
            Grid::GaussLegendre,
            Precision::Image,
        ));
        // Of coefficients whose own rms is 0.29.
        assert!(rms < 0.29 * 2e-6 && worst < 1e-4, "{order}: rms {rms:e} worst {worst:e}");
    }
}

#[test]
fn the_thread_count_does_not_change_a_bit() {
    let sh = noise(200);
    for precision in [Precision::Double, Precision::Image] {
        let results: Vec<_> = [1, 2, 5]
            .map(|threads| {
                let pool =
                    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
                pool.install(|| {
                    let plan = ShTransform::with_precision(200, 500, 300, Grid::Equirectangular, precision);
                    let planes = synthesized(&sh, &plan);
                    (plan.analyze(planes.each_ref().map(Vec::as_slice)), planes)
                })
            })
            .into();
        assert!(results.iter().all(|r| r.1 == results[0].1 && r.0.c == results[0].0.c), "{precision:?}");
    }
}

#[test]
fn columns_convolve_and_come_back() {
    let sh = noise(40);
    let plan = ShTransform::new(40, 90, 50, Grid::GaussLegendre);
    let columns = ColumnsRgb::from_sh(&sh);
    assert_eq!((columns.to_sh().c, columns.order()), (sh.c.clone(), 40));
    for (l, energy) in columns.band_energies().iter().enumerate() {
        let direct = |k: usize| sh.c[k][l * l..(l + 1) * (l + 1)].iter().map(|c| c * c).sum::<f64>();
        assert!((0..3).all(|k| (energy[k] - direct(k)).abs() < 1e-13 * direct(k)));
    }
    let factors: Vec<f64> = (0..30).map(|l| 1.0 / (1 + l) as f64).collect();
    let mut planes: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; 90 * 50]);
    plan.synthesize_columns(&columns, &factors, planes.each_mut().map(Vec::as_mut_slice));
    let mut back = ColumnsRgb::default();
    plan.analyze_columns(planes.each_ref().map(Vec::as_slice), &mut back);
    let back = back.to_sh();
    for l in 0..=40 {
        let factor = factors.get(l).copied().unwrap_or(0.0);
        for i in l * l..(l + 1) * (l + 1) {
            assert!((0..3).all(|k| (back.c[k][i] - factor * sh.c[k][i]).abs() < 1e-13), "{l}");
        }
    }
}

/// Σ c · analysis(f) = Σ w f · synthesis(c) for any samples f: the grid's own weighted sum is what band 0 is
/// made of.
#[test]
fn analysis_is_adjoint_to_synthesis() {
    let c = noise(60);
    for grid in [Grid::GaussLegendre, Grid::Equirectangular, Grid::ClenshawCurtis] {
        let plan = ShTransform::new(60, 130, 71, grid);
        let f: Vec<f64> = (0..130 * 71).map(|i| (i as f64 * 0.7).sin().powi(3) + 0.2).collect();
        let g = synthesized(&c, &plan);
        let products: [Vec<f64>; 3] =
            std::array::from_fn(|k| f.iter().zip(&g[k]).map(|(f, g)| f * g).collect());
        let coefficients = plan.analyze([&f[..]; 3]);
        let sums = plan.analyze(products.each_ref().map(Vec::as_slice));
        for k in 0..3 {
            let inner: f64 = coefficients.c[k].iter().zip(&c.c[k]).map(|(a, b)| a * b).sum();
            let sum = sums.c[k][0] * (4.0 * PI).sqrt();
            assert!((inner - sum).abs() < 1e-12 * (1.0 + sum.abs()), "{grid:?}: {inner} {sum}");
        }
    }
}

/// ∫ f² = Σ c².
#[test]
fn parseval() {
    let sh = noise(30);
    let plan = ShTransform::new(30, 64, 64, Grid::GaussLegendre);
    let planes = synthesized(&sh, &plan);
    let squares: [Vec<f64>; 3] = planes.map(|p| p.iter().map(|x| x * x).collect());
    let integral = plan.analyze(squares.each_ref().map(Vec::as_slice));
    for k in 0..3 {
        let energy: f64 = sh.c[k].iter().map(|c| c * c).sum();
        assert!((integral.c[k][0] * (4.0 * PI).sqrt() / energy - 1.0).abs() < 1e-13);
    }
}

/// Gauss–Legendre quadrature over every cell, fine enough for the order.
fn integrated(order: usize, width: usize, height: usize, plane: &[f64]) -> Vec<f64> {
    let (x, w) = gauss_legendre(12 + order * 3 / height.min(width));
    let (mut sum, mut y) = (vec![0.0; count(order)], vec![0.0; count(order)]);
    let (dt, dp) = (PI / height as f64, 2.0 * PI / width as f64);
    for (k, value) in plane.iter().enumerate() {
        for (xt, wt) in x.iter().zip(&w) {
            let (sin, cos) = (dt * ((k / width) as f64 + 0.5 + 0.5 * xt)).sin_cos();
            for (xp, wp) in x.iter().zip(&w) {
                let (s, c) = (dp * ((k % width) as f64 + 0.5 + 0.5 * xp) - PI).sin_cos();
                eval(order, DVec3::new(sin * c, cos, sin * s), &mut y);
                let w = 0.25 * dt * dp * wt * wp * sin * value;
                sum.iter_mut().zip(&y).for_each(|(sum, y)| *sum += w * y);
            }
        }
    }
    sum
}

/// Every order on every image, up to bands that repeat several times between the texels.
#[test]
fn cells_are_integrals_over_texels() {
    let cases =
        [(5, 12, 7), (9, 12, 7), (23, 8, 4), (23, 5, 3), (11, 1, 1), (11, 3, 2), (20, 2, 1), (2, 9, 40)];
    for (order, width, height) in cases {
        let planes: [Vec<f64>; 3] =
            std::array::from_fn(|k| (0..width * height).map(|i| ((i * (k + 2)) as f64).sin()).collect());
        let views = planes.each_ref().map(Vec::as_slice);
        let double = ShTransform::new(order, width, height, Grid::Cells).analyze(views);
        let image = ShTransform::with_precision(order, width, height, Grid::Cells, Precision::Image);
        let image = image.analyze(views);
        for c in 0..3 {
            let exact = integrated(order, width, height, &planes[c]);
            for (k, exact) in exact.iter().enumerate() {
                let (a, b) = (double.c[c][k], image.c[c][k]);
                assert!((a - exact).abs() < 1e-12, "{order} {width} {height} {k}: {a} {exact}");
                assert!((b - exact).abs() < 2e-6, "{order} {width} {height} {k}: {b} {exact}");
            }
        }
    }
}

#[test]
fn high_sectoral_bands_meet_their_closed_form() {
    let m = 700;
    let plan = ShTransform::new(m, 1500, 3, Grid::Equirectangular);
    // Y_{m,m}(x, z, y): all its energy is in the sectoral term about y.
    let mut sh = ShRgb::zero(m);
    sh.c[0][index(m, m as isize)] = 1.0;
    exchange_yz(m, sh.c.each_mut().map(Vec::as_mut_slice));
    let planes = synthesized(&sh, &plan);
    let p = legendre(m, m, 0.0, 1.0)[0];
    let phi = -PI + PI / 1500.0;
    assert!((planes[0][1500] / (p * 2f64.sqrt() * (m as f64 * phi).cos()) - 1.0).abs() < 1e-10);
    assert!(planes[0][0].abs() < 1e-14);
}

#[test]
fn empty_and_tiny_grids_are_harmless() {
    for (width, height) in [(0, 0), (0, 4), (4, 0), (1, 1), (2, 1), (1, 2)] {
        for grid in [Grid::Equirectangular, Grid::GaussLegendre, Grid::ClenshawCurtis, Grid::Cells] {
            let plan = ShTransform::new(3, width, height, grid);
            let plane = vec![1.0_f32; width * height];
            let sh = plan.analyze([&plane, &plane, &plane]);
            assert!(sh.c.iter().flatten().all(|c| c.is_finite()), "{width} {height} {grid:?}");
            let mean = if width * height > 0 { (4.0 * PI).sqrt() } else { 0.0 };
            assert!((sh.c[0][0] - mean).abs() < 1e-9, "{width} {height} {grid:?} {}", sh.c[0][0]);
        }
    }
}
