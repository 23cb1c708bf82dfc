//! The error at texels and over footprints, against the equation.

use super::bake::Bumped;
use super::shade;
use crate::Material;
use crate::local::{Place, error_at, texel, texel_at};
use glam::DVec3;
use steradian_brdf::Brdf;

fn shaded(t: &Bumped, at: Place, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    shade::f_cos(t, &shade::texel(t, at), wi, wo)
}

/// Against the equation at the texels themselves.
pub(super) fn error(t: &Bumped, m: &Material) -> f64 {
    let brdf: &dyn Brdf = &*m.brdf;
    let size = t.texels.size();
    let exact = |at: Place, wi, wo| t.exact(t.normal(texel_at(at, size)), wi, wo);
    error_at(brdf, |k| texel(k, size).0, exact, |at, wi, wo| shaded(t, at, wi, wo))
}

/// Side, in texels, of the blocks whose means are compared.
const BLOCK: usize = 4;

/// Relative RMS error of filtering: samples that cover 4 × 4 texels against the mean of these texels.
pub(super) fn details(t: &Bumped) -> Vec<(&'static str, f64)> {
    let size = t.texels.size();
    if t.bumps.is_none() || size.0 < BLOCK || size.1 < BLOCK {
        return Vec::new();
    }
    let (mut squares, mut energy) = (0.0, 0.0);
    for k in 0..1024u32 {
        let (_, [i, j]) = texel(k, size);
        let [i, j] = [i / BLOCK * BLOCK, j / BLOCK * BLOCK];
        if i + BLOCK > size.0 || j + BLOCK > size.1 {
            continue;
        }
        // Light and view up to 60 degrees off the normal.
        let direction = |a: f64, b: f64| {
            let (z, phi) = (0.5 + 0.5 * (f64::from(k) * a).fract(), f64::from(k) * b);
            let s = (1.0f64 - z * z).sqrt();
            DVec3::new(s * phi.cos(), s * phi.sin(), z)
        };
        let (wi, wo) = (direction(0.618_034, 2.4), direction(0.754_878, 3.7));
        let all = (0..BLOCK * BLOCK).map(|m| t.exact(t.normal([i + m % BLOCK, j + m / BLOCK]), wi, wo));
        let mut mean = [0.0; 3];
        all.for_each(|x| (0..3).for_each(|c| mean[c] += x[c] / (BLOCK * BLOCK) as f64));
        let half = 0.5 * BLOCK as f32;
        let uv = [(i as f32 + half) / size.0 as f32, (j as f32 + half) / size.1 as f32];
        let footprint = BLOCK as f32 / size.0.max(size.1) as f32;
        let got = shaded(t, Place { uv, footprint }, wi.as_vec3().to_array(), wo.as_vec3().to_array());
        for c in 0..3 {
            squares += (f64::from(got[c]) - mean[c]).powi(2);
            energy += mean[c] * mean[c];
        }
    }
    if energy > 0.0 { vec![("error over 4 x 4 texels", (squares / energy).sqrt())] } else { Vec::new() }
}
