//! How a measured reflectance is concentrated, found by evaluating it: what its samplers, hints and peak are made of.

use crate::draw::Draw;
use crate::math::{largest, spherical};
use crate::{Brdf, Lobe, Peak, hint};
use glam::DVec3;
use std::f64::consts::PI;

/// Half vectors are tried from this angle on, radians: finer than the finest cell of MERL's tables, 0.2 milliradians.
const FINEST: f64 = 1e-4;
const STEPS: usize = 160;
/// Tilts beyond this tell of the diffuse part only.
const WIDEST: f64 = 0.75;
/// Tilts from here on tell what the diffuse part is.
const FAR: f64 = 0.45;
/// Angle of the view, which keeps retro-reflection out of the profile.
const VIEW: f64 = 0.5;

/// A distribution of half vectors like the measured one: a GGX of the highlight's core, one of its reach, and the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shape {
    /// Width α of a GGX with the profile's width at a quarter of its height; `None` where there is no highlight.
    core: Option<f64>,
    /// Width α of a GGX of which as much lies within as of the profile: four fifths.
    reach: f64,
    /// Share of what is sent back evenly.
    diffuse: f64,
}

impl Shape {
    /// Of the function f(wi, wo): its profile over the angle of the half vector, across the plane of incidence.
    pub fn measure(f: &dyn Fn(DVec3, DVec3) -> [f64; 3]) -> Self {
        let wo = spherical(VIEW, 0.0);
        let ratio = (WIDEST / FINEST).powf(1.0 / (STEPS - 1) as f64);
        let angles: Vec<f64> = (0..STEPS).map(|i| FINEST * ratio.powi(i as i32)).collect();
        let profile: Vec<f64> = angles
            .iter()
            .map(|t| {
                let h = DVec3::new(0.0, t.sin(), t.cos());
                largest(f(2.0 * wo.dot(h) * h - wo, wo))
            })
            .collect();
        // Far from the mirror direction: what is even there, or nearly so, is the diffuse part.
        let far = angles.iter().zip(&profile).filter(|(t, _)| **t > FAR);
        let base = far.map(|(_, v)| *v).fold(0.0, f64::max);
        let peak = profile.iter().copied().fold(0.0, f64::max);
        if peak <= 1.3 * base || peak <= 0.0 {
            return Self { core: None, reach: 1.0, diffuse: 1.0 };
        }
        let above: Vec<f64> = profile.iter().map(|v| (v - base).max(0.0)).collect();
        let top = above.iter().position(|v| *v >= 0.999 * (peak - base)).unwrap_or(0);
        let fallen = (top..STEPS).find(|i| above[*i] <= 0.25 * (peak - base)).unwrap_or(STEPS - 1);
        let core = angles[fallen].tan();
        // ∫ 4 cos θ_h sin θ_h dθ_h dφ with dθ_h = θ_h d ln θ_h: the solid angle of wi near the mirror direction.
        let part = |i: usize| above[i] * 4.0 * angles[i].cos() * angles[i].sin() * angles[i];
        let total: f64 = (0..STEPS).map(part).sum();
        let mut sum = 0.0;
        let four_fifths = (0..STEPS).find(|i| {
            sum += part(*i);
            sum >= 0.8 * total
        });
        // A GGX holds t²/(α² + t²) of itself within tan θ_h = t: four fifths at t = 2α.
        let reach = 0.5 * angles[four_fifths.unwrap_or(STEPS - 1)].tan();
        let specular = 2.0 * PI * ratio.ln() * total * VIEW.cos();
        let diffuse = (PI * base / (PI * base + specular)).clamp(0.15, 0.9);
        Self { core: Some(core), reach: reach.clamp(core, 1.0), diffuse }
    }

    /// The densities to draw from, with their weights.
    pub fn draw(&self) -> [(f64, Draw); 3] {
        let Some(core) = self.core else {
            return [(1.0, Draw::Cosine), (0.0, Draw::Cosine), (0.0, Draw::Cosine)];
        };
        let rest = 1.0 - self.diffuse;
        [
            (self.diffuse, Draw::Cosine),
            (0.6 * rest, Draw::Visible { ax: self.reach, ay: self.reach }),
            (0.4 * rest, Draw::Visible { ax: core, ay: core }),
        ]
    }

    /// Where integrators refine.
    pub fn lobes(&self, brdf: &dyn Brdf, wo: DVec3) -> Vec<Lobe> {
        let Some(core) = self.core else { return Vec::new() };
        let mut lobes = hint::half_vector(brdf, wo, core, core);
        if self.reach > 2.0 * core {
            lobes.extend(hint::half_vector(brdf, wo, 0.5 * self.reach, 0.5 * self.reach));
        }
        lobes
    }

    pub fn peak(&self) -> Peak {
        self.core.map_or(Peak::Smooth, |core| Peak::Mirror { narrow: core, wide: core })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse;

    #[test]
    fn widths_of_what_is_known() {
        for alpha in [0.003, 0.05, 0.2] {
            let brdf = parse(&format!("ggx:alpha={alpha}")).expect("spec");
            let shape = Shape::measure(&|i, o| brdf.eval(i, o));
            let core = shape.core.expect("a highlight");
            // A GGX falls to a quarter at tan θ_h = α.
            assert!((core / alpha - 1.0).abs() < 0.1, "{alpha}: {shape:?}");
            assert!((shape.reach / alpha - 1.0).abs() < 0.25, "{alpha}: {shape:?}");
        }
        let lambert = parse("lambert").expect("spec");
        assert_eq!(Shape::measure(&|i, o| lambert.eval(i, o)).peak(), Peak::Smooth);
        let both = parse("ashikhmin-shirley:nu=5000,nv=5000,rs=0.04,rd=0.5").expect("spec");
        let shape = Shape::measure(&|i, o| both.eval(i, o));
        assert!(shape.diffuse > 0.8 && shape.core.expect("a highlight") < 0.03, "{shape:?}");
    }
}
