//! Small textures by formula, in place of the files of techniques with data per texel, for checks.

use crate::Material;
use crate::local::{Content, Plane};
use glam::DVec3;
use std::f64::consts::TAU;
use std::sync::Arc;
use steradian_brdf::SharedBrdf;
use steradian_relight::btf::{Btf, spread};
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

/// Coefficients of u², v², uv, u, v and 1 in red, green and blue: tilted Lambertian facets of several
/// colours, roughly; and ten more, with which they are some of spherical harmonics.
pub fn polynomial(i: usize, j: usize) -> [[f64; 3]; 16] {
    let (x, y) = ((i as f64 + 0.5) / SIDE as f64, (j as f64 + 0.5) / SIDE as f64);
    let (a, b) = (0.6 * (TAU * x).sin(), 0.4 * (TAU * (x + 2.0 * y)).cos());
    let six = [-0.9 + 0.2 * a, -0.8 - 0.1 * b, 0.2 * a * b, a, b, 1.0 - 0.2 * a * a];
    let shape: [f64; 16] =
        std::array::from_fn(|k| six.get(k).copied().unwrap_or(0.3 * (a + 0.2 * k as f64) * b));
    let colour = [0.8, 0.4 + 0.3 * (TAU * y).sin(), 0.3];
    shape.map(|s| colour.map(|c| c * s))
}

/// A bidirectional texture function of 24 texels a side from 21 views under 21 lights: coloured bumps that
/// shift with the view, with a highlight.
pub fn apparent() -> Arc<Btf> {
    const TEXELS: usize = SIDE / 2;
    let all = spread(21);
    let of = |x: usize, v: usize, l: usize| {
        let (v, l) = (all[v], all[l]);
        let place = |k: usize, d: f64| (2 * k + SIDE) as isize + (4.0 * d / v.z).round() as isize;
        let side = SIDE as isize;
        let (i, j) = (place(x % TEXELS, v.x).rem_euclid(side), place(x / TEXELS, -v.y).rem_euclid(side));
        let (i, j) = (i as usize, j as usize);
        let z = |a: usize, b: usize| 6.0 * height((i + a) % SIDE, (j + b) % SIDE);
        let n = DVec3::new(z(SIDE - 1, 0) - z(1, 0), z(0, 1) - z(0, SIDE - 1), 2.0).normalize();
        let lit = n.dot(l).max(0.0);
        let shine = lit * n.dot((v + l).normalize()).max(0.0).powi(16);
        colour(i, j).map(|c| (c * lit + 0.5 * shine) as f32)
    };
    let made = Btf::of((TEXELS, TEXELS), &all, &all, of);
    Arc::new(made.unwrap_or_else(|e| unreachable!("texels and directions above the surface: {e}")))
}

/// The material of a reflectance with the textures that a technique reads.
pub fn material(brdf: SharedBrdf, read: &[Plane]) -> Material {
    let m = Material::new(brdf).with_textures(planes(read));
    if is_bidirectional(read) { m.with_apparent(apparent()) } else { m }
}

/// Does a technique read a bidirectional texture function?
pub fn is_bidirectional(read: &[Plane]) -> bool {
    read.iter().any(|p| p.content == Content::Bidirectional)
}

/// Colours between 0.1 and 0.5.
fn colour(i: usize, j: usize) -> [f64; 3] {
    let wave = |a: usize, b: usize| 0.3 + 0.2 * (TAU * (a * i + b * j) as f64 / SIDE as f64).sin();
    [wave(1, 0), wave(1, 1), wave(0, 2)]
}

/// Numbers that a parameter of this name may have: products C of lobes, exponents, widths and angles.
fn numbers(name: &str, i: usize, j: usize) -> [f64; 3] {
    let wave = |a: usize, b: usize| (TAU * (a * i + b * j) as f64 / SIDE as f64).sin();
    match name.as_bytes()[0] {
        b'c' | b'l' => [-0.9 + 0.1 * wave(1, 0), -0.8 + 0.1 * wave(0, 1), 0.9 + 0.1 * wave(1, 2)],
        b'n' => [12.0 + 8.0 * wave(2, 1); 3],
        b'w' => [0.3 + 0.1 * wave(1, 1), 0.4 + 0.2 * wave(2, 0), 0.0],
        _ => [0.5 + 0.4 * wave(1, 0); 3],
    }
}

/// Textures for the planes that a technique reads; where it reads heights, none for normals, which it can
/// derive from them.
pub fn planes(read: &[Plane]) -> Planes {
    let heights = read.iter().any(|p| p.content == Content::Heights);
    let mut out = Planes::default();
    for p in read {
        match p.content {
            Content::Heights => out = out.with(p.name, texture(|i, j| [height(i, j); 3])),
            Content::Polynomials => {
                for k in 0..16 {
                    out = out.with(&format!("{}.{k}", p.name), texture(|i, j| polynomial(i, j)[k]));
                }
            }
            Content::Colours => out = out.with(p.name, texture(|i, j| colour(i + 7 * p.name.len(), j))),
            Content::Numbers => out = out.with(p.name, texture(|i, j| numbers(p.name, i, j))),
            Content::Normals if heights => {}
            _ => {}
        }
    }
    out
}
