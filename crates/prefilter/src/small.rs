//! Inputs that fill no register, or just more than one: on every instruction set.

use crate::kernel::legendre::moments;
use crate::kernel::profile;
use crate::light::source::Statistics;
use crate::shrm::{Grid, Plan, Term, global, pairs};
use crate::{Lobe, SmallLight, Zonal, angular};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_sphere::sh::{ColumnsRgb, ShRgb};
use steradian_sphere::{Layout, SphereImage};
use steradian_testkit::on_every_isa;

/// Lengths about those of all registers, and of fours of them.
const LENGTHS: [usize; 16] = [0, 1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 31, 32, 33, 65];

#[test]
fn sums_of_legendre_polynomials() {
    on_every_isa(|| {
        for n in LENGTHS {
            let points: Vec<(f64, f64)> = (0..n).map(|k| ((k as f64).sin(), 1.0 + k as f64)).collect();
            for order in [0, 1, 2, 8] {
                let m = moments(&points, order);
                assert_eq!(m.len(), order + 1);
                let direct = |f: fn(f64) -> f64| points.iter().map(|(x, w)| w * f(*x)).sum::<f64>();
                let first = [direct(|_| 1.0), direct(|x| x), direct(|x| 1.5 * x * x - 0.5)];
                let worst = m.iter().zip(first).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(worst < 1e-10, "{n} {order}: {worst}");
            }
        }
    });
}

#[test]
fn kernels_at_many_angles() {
    on_every_isa(|| {
        for n in LENGTHS {
            let s2: Vec<f32> = (0..n).map(|k| k as f32 / n as f32).collect();
            let mut out = vec![f32::NAN; n];
            profile::rational(&s2, &mut out, 0.25, 0.75, 2.0);
            for (out, s2) in out.iter().zip(&s2) {
                let exact = 2.0 * (1.0 - 2.0 * s2).max(0.0) / (0.25 + 0.75 * s2).powi(2);
                assert!((out - exact).abs() < 1e-5, "{n}");
            }
            profile::beckmann(&s2, &mut out, 3.0, 1.0);
            profile::power(&s2, &mut out, (9.0, 1.0, 1.0), 1.0);
            profile::gaussian(&s2, &mut out, 3.0, 1.0);
            profile::sheen(&s2, &mut out, 3.0, 1.0);
            profile::exponential(&s2, &mut out, 3.0, 1.0);
            let lobe = Lobe::ggx(0.3);
            lobe.fill(&s2, &mut out);
            assert!(out.iter().all(|x| x.is_finite() && *x >= 0.0), "{n}");
        }
    });
}

/// The sizes of small lat-long images.
fn images() -> impl Iterator<Item = SphereImage> {
    let sizes = [(0, 0), (1, 1), (2, 1), (1, 2), (3, 2), (8, 4), (15, 3), (17, 8), (33, 5)];
    sizes.into_iter().map(|(w, h)| SphereImage::from_fn(Layout::LatLong, w, h, |_| [0.5, 1.0, 2.0]))
}

#[test]
fn images_of_few_texels() {
    on_every_isa(|| {
        for image in images() {
            let (w, h) = (image.width, image.height);
            let s = Statistics::of(&image);
            for (flux, radiance) in s.flux.into_iter().zip([0.5, 1.0, 2.0]) {
                let exact = if w > 0 { 4.0 * PI * radiance } else { 0.0 };
                assert!((flux - exact).abs() < 1e-6 * exact.max(1.0), "{w}×{h}: {flux}");
            }
            let wide = Lobe::gaussian(0.9);
            let got = angular::brute_force(&image, &wide, DVec3::new(0.36, 0.48, 0.8));
            assert!(got.iter().all(|x| x.is_finite() && *x >= 0.0), "{w}×{h}: {got:?}");
        }
    });
}

#[test]
fn rows_of_few_texels() {
    let small_lights = [SmallLight { direction: DVec3::Y, radius: 0.0, flux: [1.0; 3], cell: None }];
    on_every_isa(|| {
        for size in [0, 1, 2, 3, 7, 8, 9, 17] {
            for layout in [Layout::Cube, Layout::LatLong] {
                let mut image = SphereImage::new(layout, size, size);
                crate::image::rows::for_rows(&mut image, |row, [r, _, _]| {
                    row.sums(&small_lights, &Lobe::lambert());
                    for i in 0..size {
                        let d = row.direction(i).expect("all texels have one");
                        let exact = Lobe::lambert().value(d.y);
                        assert!((row.sum(0, i) - exact).abs() < 1e-6);
                        r[i] = 1.0;
                    }
                });
                assert!(image.planes[0].iter().all(|x| *x == 1.0), "{layout:?} {size}");
            }
        }
    });
}

/// Constant light: B_00 = k_0 √4π L, whatever the grid, and all else is 0.
#[test]
fn reflection_maps_of_low_order() {
    on_every_isa(|| {
        for (order, p) in [(0, 0), (0, 1), (1, 0), (1, 2), (2, 2), (3, 1)] {
            let mut light = ShRgb::zero(order);
            light.c.iter_mut().for_each(|c| c[0] = (4.0 * PI).sqrt());
            let columns = ColumnsRgb::from_world(&light);
            let k: Vec<f64> = (0..=order).map(|l| 1.0 + l as f64).collect();
            let list = pairs(p);
            let terms: Vec<Term<'_>> = list.iter().map(|&(_, q)| Term { q, k: [&k; 3] }).collect();
            for (rows, width) in [(1, 1), (2, 4), (3, 7), (5, 8), (17, 12), (8, 128), (9, 132)] {
                let grid = Grid::new(rows, width);
                let maps = Plan::new(order, p, grid).maps(&columns, &terms, &Task::quiet()).expect("quiet");
                for (key, planes) in maps.keys.iter().zip(&maps.planes) {
                    let exact = if key.q == 0 { (4.0 * PI).sqrt() } else { 0.0 };
                    for value in planes.iter().flatten() {
                        assert!(
                            (f64::from(*value) - exact).abs() < 1e-5,
                            "{order} {p} {grid:?} {key:?}: {value}"
                        );
                    }
                }
                if let Some(turned) = global::from_local(&maps, p) {
                    let back = global::to_local(&turned);
                    for (a, b) in
                        back.planes.iter().flatten().flatten().zip(maps.planes.iter().flatten().flatten())
                    {
                        assert!((a - b).abs() < 1e-4, "{order} {p} {grid:?}");
                    }
                }
            }
        }
    });
}
