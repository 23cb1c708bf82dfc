//! The error of a local technique: its f · ⟨n·wi⟩ against the exact one.

use super::Place;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use steradian_brdf::Brdf;
use steradian_sphere::sampling::{Pcg32, R2, hemisphere};

/// Number of pairs of directions that are drawn.
const PAIRS: u32 = 1 << 13;

/// Relative RMS error √(∫∫|f̂ − f|²/∫∫|f|²) of f · ⟨n·wi⟩ over views and directions of light, both uniform in
/// solid angle over the hemisphere. Half of the directions of light are drawn by the reflectance, so that
/// narrow lobes are seen, and all are weighed by the density of both kinds (Veach & Guibas 1995, the balance
/// heuristic).
pub fn error(
    brdf: &dyn Brdf,
    exact: &(dyn Fn(DVec3, DVec3) -> [f64; 3] + Sync + '_),
    shaded: impl Fn([f32; 3], [f32; 3]) -> [f32; 3],
) -> f64 {
    error_at(brdf, |_| Place::default(), |_, wi, wo| exact(wi, wo), |_, wi, wo| shaded(wi, wo))
}

/// Directions of light and view in the frame of the surface, both above it, and the weight that errors have
/// there.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// To the light.
    pub wi: DVec3,
    /// To the viewer.
    pub wo: DVec3,
    /// One over the density of wi, sr.
    pub weight: f64,
}

/// The pairs of directions at which errors are measured, with their indices: those of `count` drawn that lie
/// above the surface. The same at every call.
pub fn pairs(brdf: &dyn Brdf, count: u32) -> impl Iterator<Item = (u32, Pair)> {
    let (lattice, mut random) = (R2::default(), Pcg32::new(7, 11));
    (0..count).filter_map(move |k| {
        let wo = hemisphere::sample(lattice.point(k));
        let u = DVec2::new(random.next_f64(), random.next_f64());
        let drawn = if k % 2 == 0 { Some(hemisphere::sample(u)) } else { brdf.sample(wo, u).map(|s| s.wi) };
        let wi = drawn.filter(|wi| wi.z > 0.0 && wo.z > 0.0)?;
        let weight = 1.0 / (0.5 / (2.0 * PI) + 0.5 * brdf.pdf(wi, wo));
        Some((k, Pair { wi, wo, weight }))
    })
}

/// The error as in [`error`], of a reflectance that varies: pair `k` is evaluated at `place(k)` of the
/// textures. Directions are drawn about the surface's own normal.
pub fn error_at(
    brdf: &dyn Brdf,
    place: impl Fn(u32) -> Place,
    exact: impl Fn(Place, DVec3, DVec3) -> [f64; 3],
    shaded: impl Fn(Place, [f32; 3], [f32; 3]) -> [f32; 3],
) -> f64 {
    error_of(pairs(brdf, PAIRS), place, exact, shaded)
}

/// The error as in [`error_at`], at the given pairs.
pub fn error_of(
    pairs: impl Iterator<Item = (u32, Pair)>,
    place: impl Fn(u32) -> Place,
    exact: impl Fn(Place, DVec3, DVec3) -> [f64; 3],
    shaded: impl Fn(Place, [f32; 3], [f32; 3]) -> [f32; 3],
) -> f64 {
    let (mut squares, mut energy) = (0.0, 0.0);
    for (k, Pair { wi, wo, weight }) in pairs {
        let single = |d: DVec3| d.as_vec3().to_array();
        let at = place(k);
        let (a, b) = (shaded(at, single(wi), single(wo)), exact(at, wi, wo));
        for c in 0..3 {
            squares += weight * (f64::from(a[c]) - b[c]).powi(2);
            energy += weight * b[c] * b[c];
        }
    }
    if energy > 0.0 { (squares / energy).sqrt() } else { squares.sqrt() }
}

/// Centres of the texels of a texture, spread over it: place `k` of [`error_at`], and the texel's column and
/// row.
pub fn texel(k: u32, (width, height): (usize, usize)) -> (Place, [usize; 2]) {
    let p = R2::default().point(k.wrapping_add(17));
    let cell = |u: f64, n: usize| ((u * n as f64) as usize).min(n - 1);
    let (i, j) = (cell(p.x, width), cell(p.y, height));
    let uv = [(i as f32 + 0.5) / width as f32, (j as f32 + 0.5) / height as f32];
    (Place { uv, footprint: 0.0 }, [i, j])
}

/// Column and row of the texel that a place is the centre of.
pub fn texel_at(at: Place, (width, height): (usize, usize)) -> [usize; 2] {
    [at.uv[0] * width as f32, at.uv[1] * height as f32].map(|x| x as usize)
}
