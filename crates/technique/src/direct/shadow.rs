//! Shadows of lights that are shaded with the exact reflectance, by rays, shadow maps or shadow volumes.
//!
//! Of a disk or a texel some directions are tried, V each (maps and volumes know the middle alone): ∫ V f_cos
//! over the light is ∫ f_cos times Σ V f_cos / Σ f_cos over them, so that a light that is seen whole is
//! exact, and a narrow lobe counts what it sees of the light.

use glam::DVec3;
use steradian_scene::Ray;
use steradian_scene::shadow::Blocker;

/// What blocks light.
#[derive(Debug, Clone, Copy)]
pub struct Shadows<'a> {
    /// The geometry; both sides of a triangle block.
    pub by: &'a dyn Blocker,
    /// How far off the surface, along the normal, rays start, metres.
    pub offset: f64,
    /// Are they those of a reference? Then more directions of a light are tried, none of them those of other
    /// shadows.
    pub reference: bool,
}

impl Shadows<'_> {
    /// The part of light from world direction `d`, from `distance` at most, that reaches a point of unit
    /// normal `normal`.
    pub fn arriving(self, position: DVec3, normal: DVec3, d: DVec3, distance: f64) -> f64 {
        Place { shadows: self, position, normal }.arriving(d, distance)
    }
}

/// Directions of a light that are tried at first, and where these disagree.
const RAYS: [usize; 2] = [8, 64];
/// The same under a reference, and the first of them in their sequence.
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

    /// The part of a light that arrives, where `f` is what a direction of it gives. `at` are its directions,
    /// evenly spread over its solid angle for points that are so over the unit square.
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
