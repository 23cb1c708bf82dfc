//! Inputs that fill no register, or just more than one: on every instruction set.

use crate::sh::{
    self, ColumnsRgb, Grid, PointSynthesis, Precision, Rotation, ShRgb, ShTransform, TURNS, Turns,
};
use crate::{Layout, SphereImage};
use glam::{DMat3, DVec3, Mat3};
use std::f64::consts::PI;
use steradian_testkit::on_every_isa;

/// Lengths about those of all registers, and of pairs and fours of them.
const LENGTHS: [usize; 18] = [0, 1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 31, 32, 33, 63, 64, 65];

fn function(order: usize) -> ShRgb {
    let value = |c: usize, i: usize| ((3 * c + 7 * i + 1) as f64).sin();
    ShRgb { order, c: std::array::from_fn(|c| (0..sh::count(order)).map(|i| value(c, i)).collect()) }
}

fn directions(n: usize) -> Vec<DVec3> {
    let d =
        |k: usize| DVec3::new((k as f64).sin(), (2.0 * k as f64 + 1.0).cos(), (0.7 * k as f64).cos() - 0.1);
    (0..n).map(|k| d(k).normalize()).collect()
}

#[test]
fn transforms() {
    on_every_isa(|| {
        for grid in [Grid::Equirectangular, Grid::GaussLegendre, Grid::ClenshawCurtis] {
            for (order, width) in [0, 1, 2].into_iter().flat_map(|o| LENGTHS.map(|w| (o, w))) {
                for height in [0, 1, 2, 3, 8, 17] {
                    for precision in [Precision::Double, Precision::Image] {
                        let plan = ShTransform::with_precision(order, width, height, grid, precision);
                        let sh = function(order);
                        let mut planes: [Vec<f64>; 3] =
                            std::array::from_fn(|_| vec![f64::NAN; width * height]);
                        plan.synthesize(&sh, planes.each_mut().map(Vec::as_mut_slice));
                        let cos = plan.cos_theta();
                        for k in 0..width * height {
                            let (i, y) = (k % width, cos[k / width]);
                            let phi = -PI + 2.0 * PI * (i as f64 + 0.5) / width as f64;
                            let r = (1.0 - y * y).max(0.0).sqrt();
                            let v = sh.value(DVec3::new(r * phi.cos(), y, r * phi.sin()));
                            for c in 0..3 {
                                let error = (planes[c][k] - v[c]).abs();
                                assert!(error < 2e-5, "{grid:?} {order} {width}×{height}: {error}");
                            }
                        }
                        let back = plan.analyze(planes.each_ref().map(Vec::as_slice));
                        for (a, b) in sh.c.iter().flatten().zip(back.c.iter().flatten()) {
                            let close = (a - b).abs() < 2e-5;
                            assert!(
                                b.is_finite() && (close || !plan.is_exact()),
                                "{grid:?} {order} {width}×{height}"
                            );
                        }
                    }
                }
            }
        }
    });
}

#[test]
fn points() {
    on_every_isa(|| {
        for order in [0, 1, 2, 9] {
            let sh = function(order);
            for error in [1e-2, 1e-4, 1e-5, 1e-6, 1e-7, 1e-9, 1e-12] {
                let points = PointSynthesis::new(&ColumnsRgb::from_world(&sh), &[], error);
                for n in LENGTHS {
                    let d = directions(n);
                    let mut planes: [Vec<f64>; 3] = std::array::from_fn(|_| vec![f64::NAN; n]);
                    points.at(&d, planes.each_mut().map(Vec::as_mut_slice));
                    for (k, d) in d.iter().enumerate() {
                        let v = sh.value(*d);
                        let range = 10.0 * (order + 1) as f64;
                        assert!(
                            (0..3).all(|c| (planes[c][k] - v[c]).abs() < range * error.max(1e-12)),
                            "{order} {n}"
                        );
                    }
                }
            }
        }
    });
}

#[test]
fn rotations() {
    on_every_isa(|| {
        let r = DMat3::from_rotation_z(0.4) * DMat3::from_rotation_y(1.1) * DMat3::from_rotation_x(2.2);
        let d = directions(3)[2];
        for order in [0, 1, 2, 3, 4, 7, 8, 9, 15, 16, 17] {
            let sh = function(order);
            let turned = Rotation::new(order, r).apply_rgb(&sh);
            let (a, b) = (turned.value(r * d), sh.value(d));
            assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-11), "{order}");
        }
        for n in [0, 1, 2, TURNS - 1, TURNS, TURNS + 1] {
            let turns = Turns::new(&vec![r.as_mat3(); n]);
            assert_eq!((turns.len(), turns.is_empty()), (n, n == 0));
            for order in [0, 1, 2, 4] {
                let sh = function(order);
                let expected = Rotation::new(order, r.as_mat3().as_dmat3()).apply_rgb(&sh);
                let mut out = vec![[[[f32::NAN; TURNS]; 25]; 3]; turns.blocks()];
                turns.apply(&sh, &mut out);
                for k in 0..n {
                    for (i, e) in expected.c[1].iter().enumerate() {
                        let got = f64::from(out[k / TURNS][1][i][k % TURNS]);
                        assert!((got - e).abs() < 1e-5, "{n} {order}: {got} {e}");
                    }
                }
            }
        }
        assert!(Turns::new(&[] as &[Mat3]).is_empty());
    });
}

#[test]
fn images() {
    on_every_isa(|| {
        for (width, height) in [(1, 1), (2, 1), (1, 3), (3, 2), (7, 5), (17, 9)] {
            let image = SphereImage::from_fn(Layout::LatLong, width, height, |_| [0.5, 1.0, 2.0]);
            for size in [1, 2, 3, 8, 9] {
                let cube = image.cube_means(size);
                for (plane, constant) in cube.planes.iter().zip([0.5, 1.0, 2.0]) {
                    assert!(plane.iter().all(|x| (x - constant).abs() < 1e-5), "{width}×{height} {size}");
                }
            }
        }
    });
}

#[test]
fn factors_that_take_ringing_away() {
    on_every_isa(|| {
        for order in [0, 1, 2, 3, 4, 8] {
            let mut sh = function(order);
            sh.c.iter_mut().for_each(|c| c[0] = 1.0);
            let done = sh.dering(&vec![1.0; order + 1]);
            assert!(done.minimum.iter().all(|m| *m >= 0.0), "{order}: {:?}", done.minimum);
        }
    });
}
