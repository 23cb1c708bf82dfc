//! What the files of techniques with data per texel hold in checks of techniques: small textures by formula.

use crate::local::{Content, Plane};
use std::f64::consts::TAU;
use std::sync::Arc;
use steradian_scene::surface::{Planes, Texture};

/// Texels a side.
pub const SIDE: usize = 48;

/// Heights 0 … 1 of column `i` and row `j`: waves of two directions and a flat-topped ridge. They repeat.
pub fn height(i: usize, j: usize) -> f64 {
    let (x, y) = ((i as f64 + 0.5) / SIDE as f64, (j as f64 + 0.5) / SIDE as f64);
    let waves = 0.3 + 0.15 * (TAU * (2.0 * x + y)).sin() + 0.1 * (TAU * (3.0 * y - x)).cos();
    let ridge = (2.5 * (TAU * (x - y)).cos() - 1.8).clamp(0.0, 0.4);
    waves + ridge
}

/// A texture of `f` of the texels' columns and rows.
pub fn texture(f: impl Fn(usize, usize) -> [f64; 3]) -> Arc<Texture> {
    let all: Vec<[f64; 3]> = (0..SIDE * SIDE).map(|k| f(k % SIDE, k / SIDE)).collect();
    let planes = [0, 1, 2].map(|c| all.iter().map(|t| t[c] as f32).collect());
    Arc::new(Texture::new(SIDE, SIDE, &planes).unwrap_or_else(|| Texture::constant([0.0; 3])))
}

/// Planes for what a technique reads: heights, where it reads heights and normals.
pub fn planes(read: &[Plane]) -> Planes {
    let heights = read.iter().any(|p| p.content == Content::Heights);
    let mut out = Planes::default();
    for p in read {
        match p.content {
            Content::Heights => out = out.with(p.name, texture(|i, j| [height(i, j); 3])),
            Content::Normals if heights => {}
            _ => {}
        }
    }
    out
}
