//! The error of a local technique: its f · ⟨n·wi⟩ against what it stands for.

use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use steradian_brdf::Brdf;
use steradian_sphere::sampling::{Pcg32, R2, hemisphere};

/// Pairs of directions.
const PAIRS: u32 = 1 << 13;

/// Relative RMS error √(∫∫|f̂ − f|²/∫∫|f|²) of f · ⟨n·wi⟩ over views and directions of light, both uniform in solid angle over
/// the hemisphere. Half of the directions of light are drawn by the reflectance, so that narrow lobes are seen, and all are
/// weighed by the density of both kinds (Veach & Guibas 1995, the balance heuristic).
pub fn error(
    brdf: &dyn Brdf,
    exact: &(dyn Fn(DVec3, DVec3) -> [f64; 3] + Sync + '_),
    shaded: impl Fn([f32; 3], [f32; 3]) -> [f32; 3],
) -> f64 {
    let (lattice, mut random) = (R2::default(), Pcg32::new(7, 11));
    let (mut squares, mut energy) = (0.0, 0.0);
    for k in 0..PAIRS {
        let wo = hemisphere::sample(lattice.point(k));
        let u = DVec2::new(random.next_f64(), random.next_f64());
        let drawn = if k % 2 == 0 { Some(hemisphere::sample(u)) } else { brdf.sample(wo, u).map(|s| s.wi) };
        let Some(wi) = drawn.filter(|wi| wi.z > 0.0 && wo.z > 0.0) else { continue };
        let weight = 1.0 / (0.5 / (2.0 * PI) + 0.5 * brdf.pdf(wi, wo));
        let single = |d: DVec3| d.as_vec3().to_array();
        let (a, b) = (shaded(single(wi), single(wo)), exact(wi, wo));
        for c in 0..3 {
            squares += weight * (f64::from(a[c]) - b[c]).powi(2);
            energy += weight * b[c] * b[c];
        }
    }
    if energy > 0.0 { (squares / energy).sqrt() } else { squares.sqrt() }
}
