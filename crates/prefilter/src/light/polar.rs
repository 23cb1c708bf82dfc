//! Coefficients about the image's pole, y: those of Y(x, z, y). Products per band do not care for the pole,
//! and the transforms of lat-long grids save the change of basis.

use super::{SmallLight, source};
use glam::{DMat3, DVec3, Vec3Swizzles};
use steradian_parallel::prelude::*;
use steradian_sphere::sh::{self, Basis, ShRgb};

/// Small lights that are summed together.
const BLOCK: usize = 16;

/// Adds flux · b_l · Y_lm(x, z, y) of every disk, with b_l its spread, and exact integrals over cells.
pub(crate) fn add_small_lights(to: &mut ShRgb, small_lights: &[SmallLight]) {
    for (size, planes) in source::cells(small_lights) {
        let more = source::cells_plan(to.order, size).analyze_polar(planes.each_ref().map(Vec::as_slice));
        to.c.iter_mut().zip(&more.c).for_each(|(to, c)| to.iter_mut().zip(c).for_each(|(to, c)| *to += c));
    }
    let small_lights: Vec<SmallLight> = small_lights.iter().filter(|b| b.cell.is_none()).copied().collect();
    if small_lights.is_empty() {
        return;
    }
    let (order, basis) = (to.order, Basis::new(to.order));
    let sums: Vec<ShRgb> = small_lights
        .par_chunks(BLOCK)
        .map(|block| {
            let mut sum = ShRgb::zero(order);
            let mut y = vec![0.0; sh::count(order)];
            for small_light in block {
                basis.eval(order, small_light.direction.xzy(), &mut y);
                if small_light.radius > 0.0 {
                    let spread = small_light.spread(order);
                    (0..=order)
                        .for_each(|l| y[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|y| *y *= spread[l]));
                }
                for (c, flux) in sum.c.iter_mut().zip(small_light.flux) {
                    c.iter_mut().zip(&y).for_each(|(c, y)| *c += flux * y);
                }
            }
            sum
        })
        .collect();
    for (c, to) in to.c.iter_mut().enumerate() {
        for s in &sums {
            to.iter_mut().zip(&s.c[c]).for_each(|(t, s)| *t += s);
        }
    }
}

/// The function's coefficients in the usual basis.
///
/// The exchange of y and z is a rotation followed by d → −d, which multiplies band l by (−1)^l.
pub(crate) fn to_world(sh: &ShRgb) -> ShRgb {
    let exchange = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y);
    let mut out = sh::Rotation::new(sh.order, -exchange).apply_rgb(sh);
    let signs: Vec<f64> = (0..=sh.order).map(|l| if l % 2 == 0 { 1.0 } else { -1.0 }).collect();
    out.convolve(&signs);
    out
}

/// The first bands.
pub(crate) fn truncated(sh: &ShRgb, order: usize) -> ShRgb {
    let known = sh::count(order.min(sh.order));
    let mut out = ShRgb::zero(order);
    out.c.iter_mut().zip(&sh.c).for_each(|(out, c)| out[..known].copy_from_slice(&c[..known]));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_bases_hold_the_same_function() {
        let small_lights = [
            SmallLight {
                direction: DVec3::new(0.2, 0.7, -0.5).normalize(),
                radius: 0.0,
                flux: [1.0, 0.5, -0.2],
                cell: None,
            },
            SmallLight::cell(crate::Cell::texel(3, 1, 7, 5), [0.3, -1.0, 0.2]),
            SmallLight {
                direction: DVec3::new(-0.9, 0.1, 0.3).normalize(),
                radius: 0.3,
                flux: [0.3, 2.0, 1.0],
                cell: None,
            },
        ];
        let mut polar = ShRgb::zero(9);
        add_small_lights(&mut polar, &small_lights);
        let mut world = ShRgb::zero(9);
        source::add_small_lights(&mut world, &small_lights);
        let back = to_world(&polar);
        for (a, b) in world.c.iter().flatten().zip(back.c.iter().flatten()) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }
}
