//! The wavelets of the light that a frame sums.

use super::cube::Level;
use super::light::{Light, transform};
use super::params::Params;
use glam::Mat3;
use steradian_parallel::prelude::*;

/// Wavelets of the light: the scaling coefficients, and the chosen ones.
pub(super) struct Chosen {
    pub scaling: [[f32; 3]; 6],
    pub others: Vec<(u32, [f32; 3])>,
}

/// The wavelets of `light` (transformed faces) that a frame sums.
///
/// `norms` are the lengths of the transport's columns.
pub(super) fn choose(light: &[Vec<f32>; 3], norms: &[f32], p: &Params) -> Chosen {
    let side = (norms.len() / 6).isqrt();
    let face = side * side;
    let of = |k: usize| [light[0][k], light[1][k], light[2][k]];
    // A wavelet of level s, in [s, 2s) of rows or columns, covers (side/s)² texels.
    let area = |k: usize| {
        let (i, j) = (k % side, k % face / side);
        let s = 1usize << i.max(j).max(1).ilog2();
        (side / s).pow(2) as f32
    };
    let weight = |k: usize| {
        let squares: f32 = of(k).iter().map(|l| l * l).sum();
        let by = match p.choice {
            0 => norms[k],
            1 => 1.0,
            _ => area(k),
        };
        squares * by * by
    };
    let mut all: Vec<(f32, u32)> = (0..6 * face)
        .filter(|k| !k.is_multiple_of(face))
        .map(|k| (weight(k), k as u32))
        .filter(|(w, _)| *w > 0.0)
        .collect();
    let count = p.wavelets.saturating_sub(6).min(all.len());
    let order = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    if count > 0 && count < all.len() {
        all.select_nth_unstable_by(count - 1, order);
    }
    all.truncate(count);
    // Sorted by column, so that the sums' bits do not depend on the order of choice.
    all.sort_unstable_by_key(|(_, k)| *k);
    Chosen {
        scaling: std::array::from_fn(|f| of(f * face)),
        others: all.into_iter().map(|(_, k)| (k, of(k as usize))).collect(),
    }
}

/// The light, turned, on the faces, transformed.
pub(super) fn on_cube(light: &Light, side: usize, rotation: Mat3) -> [Vec<f32>; 3] {
    let mut planes = light.on_cube(&Level::new(side), rotation);
    planes.par_iter_mut().for_each(|plane| transform(plane, side));
    planes
}

/// Σ |L_k|² |T_k|² over the wavelets that a frame leaves out, with |T_k| the lengths of the columns.
pub(super) fn not_chosen(planes: &[Vec<f32>; 3], norms: &[f32], chosen: &Chosen) -> f64 {
    let square = |k: usize| {
        let l: f64 = planes.iter().map(|p| f64::from(p[k]).powi(2)).sum();
        l * f64::from(norms[k]).powi(2)
    };
    let face = norms.len() / 6;
    let mut left: f64 = (0..norms.len()).filter(|k| !k.is_multiple_of(face)).map(square).sum();
    left -= chosen.others.iter().map(|(k, _)| square(*k as usize)).sum::<f64>();
    left.max(0.0)
}
