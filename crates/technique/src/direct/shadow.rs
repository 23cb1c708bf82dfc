//! Shadows of lights that are shaded with the exact reflectance, by rays, shadow maps or shadow volumes.
//!
//! Of a disk or a texel, V is evaluated in several directions (by maps and volumes at the middle alone), and
//! ∫ V f_cos over the light is approximated by ∫ f_cos times Σ V f_cos / Σ f_cos over these directions. So an
//! unoccluded light is exact, and a narrow lobe is shadowed by the part of the light that it reflects.

use glam::DVec3;
use steradian_scene::Ray;
use steradian_scene::shadow::Blocker;

/// The occluders of a light.
#[derive(Debug, Clone, Copy)]
pub struct Shadows<'a> {
    /// The geometry; both sides of a triangle block.
    pub by: &'a dyn Blocker,
    /// Distance that rays start off the surface, along the normal, metres.
    pub offset: f64,
    /// Are these the shadows of a reference? Then more directions of a light are tried, different from those
    /// of other shadows.
    pub reference: bool,
}

impl Shadows<'_> {
    /// The part of light from world direction `d`, from `distance` at most, that reaches a point of unit
    /// normal `normal`.
    pub fn arriving(self, position: DVec3, normal: DVec3, d: DVec3, distance: f64) -> f64 {
        Place { shadows: self, position, normal }.arriving(d, distance)
    }
}

/// Shadow rays per light: the first number, and the second where the first rays disagree.
const RAYS: [usize; 2] = [8, 64];
/// Shadow rays per light of a reference picture, in the same order, and the index in the sequence of the
/// first: its rays share none with those of techniques.
const REFERENCE_RAYS: [usize; 2] = [32, 256];
const REFERENCE_FIRST: usize = 1 << 16;

/// A point that is lit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place<'a> {
    pub shadows: Shadows<'a>,
    pub position: DVec3,
    pub normal: DVec3,
}

impl Place<'_> {
    /// The part of the light from world direction `d` that arrives, from `distance` at most.
    pub fn arriving(&self, d: DVec3, distance: f64) -> f64 {
        let side = if d.dot(self.normal) < 0.0 { -self.normal } else { self.normal };
        let origin = (self.position + side * self.shadows.offset).as_vec3();
        let ray = Ray { origin, direction: d.as_vec3().normalize() };
        let distance = (distance - self.shadows.offset) as f32;
        f64::from(self.shadows.by.arriving(&ray, side.as_vec3(), distance))
    }

    /// Does most of it arrive?
    pub fn sees(&self, d: DVec3, distance: f64) -> bool {
        self.arriving(d, distance) > 0.5
    }

    /// The unoccluded part of an extended light, weighted by `f`, the integrand at a direction of it. `at`
    /// maps the unit square to the light's directions, evenly in solid angle.
    pub fn seen(&self, at: impl Fn(f64, f64) -> DVec3, f: impl Fn(DVec3) -> f64) -> f64 {
        let mut share = 1.0;
        let (rays, first) = match self.shadows.reference {
            true => (REFERENCE_RAYS, REFERENCE_FIRST),
            false => (RAYS, 1),
        };
        for n in rays {
            let (mut all, mut open, mut blocked) = (0.0, 0.0, false);
            for k in 0..n {
                // The R2 sequence (Roberts 2018): the plastic number's powers.
                let [x, y] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_3]
                    .map(|a: f64| (0.5 + a * (first + k) as f64).fract());
                let d = at(x, y);
                let value = f(d).abs();
                all += value;
                let part = self.arriving(d, f64::INFINITY);
                open += part * value;
                blocked |= part < 1.0;
            }
            share = if !blocked {
                1.0
            } else if all > 0.0 {
                open / all
            } else {
                0.0
            };
            // All seen, or nothing.
            if share == 1.0 || open == 0.0 {
                break;
            }
        }
        share
    }
}
