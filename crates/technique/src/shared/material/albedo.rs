//! A and B of GGX over view and width, for points whose width varies.

use crate::gpu::{Format, Level, Shape, Table};
use crate::shared::once;
use crate::shared::tables::texel_bytes;
use std::sync::OnceLock;
use steradian_brdf::dfg;
use steradian_parallel::prelude::*;

/// Samples over √(n·wo), denser towards grazing views, where A and B curve.
const WIDTH: usize = 48;
/// Samples over perceptual roughness √alpha.
const HEIGHT: usize = 33;

/// A, B, 0, 0 in rows of √(n·wo); outer samples on 0 and 1. One table for all materials.
static TABLE: OnceLock<Vec<[f32; 4]>> = OnceLock::new();

fn make() -> Vec<[f32; 4]> {
    let square = |i: usize, n: usize| (i as f64 / (n - 1) as f64).powi(2);
    let texel = |k: usize| {
        let d = dfg::ggx(square(k % WIDTH, WIDTH), square(k / WIDTH, HEIGHT).max(1e-4));
        [d.scale as f32, d.bias as f32, 0.0, 0.0]
    };
    (0..WIDTH * HEIGHT).into_par_iter().map(texel).collect()
}

/// The table; the first call computes it.
pub fn table() -> &'static [[f32; 4]] {
    let texels: &Vec<[f32; 4]> = once::get(&TABLE, make);
    texels
}

/// A and B at n·wo and alpha, both 0 … 1: bilinear in their roots.
#[inline(always)]
pub fn lookup(table: &[[f32; 4]], cos_o: f32, alpha: f32) -> [f32; 2] {
    let at = |x: f32, n: usize| {
        let x = x.clamp(0.0, 1.0).sqrt() * (n - 1) as f32;
        let i = (x as usize).min(n - 2);
        (i, x - i as f32)
    };
    let ((i, u), (j, v)) = (at(cos_o, WIDTH), at(alpha, HEIGHT));
    let k = j * WIDTH + i;
    std::array::from_fn(|c| {
        let row = |k: usize| table[k][c] + (table[k + 1][c] - table[k][c]) * u;
        row(k) + (row(k + WIDTH) - row(k)) * v
    })
}

/// The table for a GPU: `fetch_NAME(vec2(√(n·wo), √alpha))`.
pub fn gpu(name: &'static str) -> Table {
    let level = Level { width: WIDTH, height: HEIGHT, layers: 1, bytes: texel_bytes(table().iter()) };
    Table { name, shape: Shape::Plane, format: Format::Rgba32Float, level }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_its_samples_the_table_is_within_half_a_percent_of_the_albedo() {
        let mut worst = 0.0f64;
        for cos_o in [0.02, 0.05, 0.13, 0.37, 0.61, 0.93] {
            for alpha in [0.001f64, 0.013, 0.07, 0.21, 0.44, 0.83] {
                let want = dfg::ggx(cos_o, alpha);
                let [a, b] = lookup(table(), cos_o as f32, alpha as f32).map(f64::from);
                worst = worst.max((a - want.scale).abs()).max((b - want.bias).abs());
            }
        }
        assert!(worst < 5e-3, "{worst}");
    }
}
