//! Directional and point lights, and the assignment of lights to techniques.

use crate::View;
use crate::direct::{Direct, Suns};
use std::sync::Arc;
use steradian_light::{DirectionalLight, LARGEST, Lights, PointLight};

/// The lights that a local technique shades.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LocalLights {
    /// Directional lights.
    pub directionals: Vec<DirectionalLight>,
    /// Point lights.
    pub points: Vec<PointLight>,
}

/// Splits the lights into those that a technique bakes, those that are shaded exactly, and those that a local
/// technique shades. Directional and point lights go to the local technique, whatever `suns` says; disks and
/// the environment are split by [`crate::direct::split`]. Interreflected light of directional lights stays
/// with techniques that compute interreflection ([`Lights::apart`]).
pub fn split(lights: &Lights, suns: Suns) -> (Lights, Direct, LocalLights) {
    let mut distant = lights.clone();
    let local = LocalLights {
        directionals: std::mem::take(&mut distant.directionals),
        points: std::mem::take(&mut distant.points),
    };
    let (mut baked, direct) = crate::direct::split(&distant, suns);
    if !local.directionals.is_empty() {
        let mut apart = baked.apart.take().map_or_else(Lights::default, |a| (*a).clone());
        apart.directionals.extend(&local.directionals);
        baked.apart = Some(Arc::new(apart));
    }
    (baked, direct, local)
}

impl LocalLights {
    /// No lights at all?
    pub fn is_empty(&self) -> bool {
        self.directionals.is_empty() && self.points.is_empty()
    }

    /// These lights as [`Lights`] of a scene.
    pub fn as_lights(&self) -> Lights {
        Lights { directionals: self.directionals.clone(), points: self.points.clone(), ..Lights::default() }
    }

    /// For exact shading, turned with the light of a frame.
    pub fn direct(&self, view: &View) -> Direct {
        let (directionals, points) = (self.directionals.clone(), self.points.clone());
        Direct { directionals, points, ..Direct::default() }.turned(view)
    }

    /// The lights in single precision, rotated with the light of the frame.
    pub fn rows(&self, view: &View) -> Vec<Light> {
        let direct = self.direct(view);
        let single = |v: [f64; 3]| v.map(|x| x as f32);
        let directional = |d: &DirectionalLight| Light {
            place: single(d.direction.normalize_or_zero().to_array()),
            point: false,
            power: single(d.irradiance),
        };
        let point = |p: &PointLight| Light { place: p.position.to_array(), point: true, power: p.intensity };
        direct.directionals.iter().map(directional).chain(direct.points.iter().map(point)).collect()
    }
}

/// A light in single precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Unit direction towards a directional light, position of a point light.
    pub place: [f32; 3],
    /// Is it a point light?
    pub point: bool,
    /// Irradiance of a directional light, radiant intensity of a point light.
    pub power: [f32; 3],
}

impl Light {
    /// The eight numbers that shaders read.
    pub(super) fn row(&self) -> [f32; 8] {
        let ([x, y, z], [r, g, b]) = (self.place, self.power);
        [x, y, z, f32::from(u8::from(self.point)), r, g, b, 0.0]
    }

    /// Direction towards the light, irradiance on a surface that faces it, and distance, at a point; `None`
    /// at a point light itself, and where the point's position is not known. However near the light, the
    /// irradiance is finite.
    #[inline(always)]
    pub fn at(&self, p: Option<[f32; 3]>) -> Option<([f32; 3], [f32; 3], f32)> {
        if !self.point {
            return Some((self.place, self.power, f32::INFINITY));
        }
        let p = p?;
        let to = [self.place[0] - p[0], self.place[1] - p[1], self.place[2] - p[2]];
        let d2 = to[0] * to[0] + to[1] * to[1] + to[2] * to[2];
        // False for NaN too.
        if d2 > 0.0 {
            let d = d2.sqrt();
            // Of a subnormal number the reciprocal would be infinite, and 0 times that no number.
            let (most, one, over) = (LARGEST as f32, d.recip(), d2.recip().min(f32::MAX));
            Some((to.map(|x| x * one), self.power.map(|i| (i * over).clamp(-most, most)), d))
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared::trials::lights;
    use glam::{DVec3, Vec3};
    use steradian_light::DiskLight;

    /// No light is lost, and none is in two places: of each kind the numbers add up, whatever becomes of
    /// suns.
    #[test]
    fn every_light_goes_to_one_place() {
        let disk = |angular_radius| DiskLight { direction: DVec3::Y, angular_radius, radiance: [1.0; 3] };
        let all = Lights {
            disks: vec![disk(0.01), disk(0.6)],
            directionals: vec![DirectionalLight { direction: DVec3::X, irradiance: [1.0; 3] }; 3],
            points: vec![PointLight { position: Vec3::X, intensity: [1.0; 3] }; 2],
            ..lights::smooth()
        };
        for suns in [Suns::Exact, Suns::Fold] {
            let (baked, direct, local) = split(&all, suns);
            assert!(baked.environment.is_some());
            assert_eq!((local.directionals.len(), local.points.len()), (3, 2));
            assert!(baked.directionals.is_empty() && baked.points.is_empty());
            assert!(direct.directionals.is_empty() && direct.points.is_empty());
            assert_eq!(baked.disks.len() + direct.disks.len(), 2, "{suns:?}");
            let apart = baked.apart.expect("what surfaces reflect of them");
            assert_eq!((apart.directionals.len(), apart.disks.len()), (3, direct.disks.len()), "{suns:?}");
        }
    }

    #[test]
    fn irradiance_is_finite_however_near_the_light() {
        let light = Light { place: [1.0, 2.0, 3.0], point: true, power: [1e30, -1.0, 0.0] };
        for d in [0.0f32, 1e-30, 1e-22, 1e-15, 1e-5, 1.0] {
            let Some((w, e, _)) = light.at(Some([1.0, 2.0, 3.0 - d])) else { continue };
            assert!(w.iter().chain(&e).all(|x| x.is_finite()), "{d}: {w:?} {e:?}");
        }
        let here = Light { place: [0.0; 3], ..light };
        for d in [1e-38f32, 1e-22, 1e-18, 1e-10] {
            let e = here.at(Some([0.0, 0.0, d])).map_or([0.0; 3], |a| a.1);
            assert!(e.iter().all(|x| x.is_finite()), "{d}: {e:?}");
        }
        assert_eq!(here.at(Some([0.0; 3])), None);
        assert_eq!(here.at(None), None);
    }
}
