//! Light on the faces of a cube, and as Haar wavelets.

use super::HaarTransport;
use super::cube::Level;
use crate::shared::light::distant;
use crate::shared::light::sh_light::ShLight;
use crate::tensors::{PartError, TensorFile};
use crate::{BakeError, Part, Technique};
use glam::{DVec2, DVec3, Mat3};
use steradian_light::Lights;
use steradian_parallel::prelude::*;
use steradian_prefilter::SmallLight;
use steradian_prefilter::source::reduced;
use steradian_sphere::sampling::{R2, cone};
use steradian_sphere::wavelet::haar_forward;
use steradian_sphere::{Frame, Layout, SphereImage};

/// Most rows of the image in which rotated light is looked up.
const ROWS: usize = 512;
/// Lookups a side by which a texel of rotated light is averaged.
const LOOKUPS: usize = 6;
/// Number of points that sample a disk.
const POINTS: u32 = 256;

/// Distant light, as it came; it is put on the cube in each frame, turned.
pub struct Light {
    image: Option<SphereImage>,
    small: Vec<SmallLight>,
    /// The light in spherical harmonics, which surfaces reflect.
    pub(super) sh: ShLight,
}

impl Light {
    pub(super) fn bake(lights: &Lights) -> Result<Self, BakeError> {
        let sh = ShLight::bake(HaarTransport::CARD.slug, lights, 0.0)?;
        let image = lights.environment.as_ref().map(|e| reduced(&e.image, ROWS));
        Ok(Self { image, small: distant::small(lights), sh })
    }

    /// Mean radiance of each texel of `cube`, of light that is turned by `rotation`.
    pub(super) fn on_cube(&self, cube: &Level, rotation: Mat3) -> [Vec<f32>; 3] {
        let n = cube.omega.len();
        let mut planes = match &self.image {
            None => [vec![0.0; n], vec![0.0; n], vec![0.0; n]],
            Some(image) if rotation == Mat3::IDENTITY => {
                image.resample(Layout::Cube, cube.side, cube.side).planes
            }
            Some(image) => turned(image, cube, rotation),
        };
        let turn = rotation.as_dmat3();
        for s in &self.small {
            let axis = Frame::from_normal((turn * s.direction).normalize_or(DVec3::Y));
            let points = if s.radius > 0.0 { POINTS } else { 1 };
            for k in 0..points {
                let u = if points == 1 { DVec2::ZERO } else { R2::default().point(k) };
                let d = axis.to_world(cone::sample(cone::versine(s.radius), u));
                let at = Layout::Cube.position(cube.side, cube.side, d);
                let cell = |v: f64| (v.max(0.0) as usize).min(cube.side - 1);
                let texel = at.face * cube.side * cube.side + cell(at.y) * cube.side + cell(at.x);
                for (plane, flux) in planes.iter_mut().zip(s.flux) {
                    plane[texel] += (flux / f64::from(points) / f64::from(cube.omega[texel])) as f32;
                }
            }
        }
        planes
    }
}

fn turned(image: &SphereImage, cube: &Level, rotation: Mat3) -> [Vec<f32>; 3] {
    let (back, steps) = (rotation.transpose(), cube.steps());
    let texel = |k: usize| {
        let mut sum = [0.0; 3];
        for at in 0..LOOKUPS * LOOKUPS {
            let part = |i: usize| (i as f32 + 0.5) / LOOKUPS as f32;
            let d = back * cube.point(k, &steps, [part(at % LOOKUPS), part(at / LOOKUPS)]);
            let l = image.nearest(d.as_dvec3());
            (0..3).for_each(|c| sum[c] += l[c]);
        }
        sum.map(|x| x / (LOOKUPS * LOOKUPS) as f32)
    };
    let all: Vec<[f32; 3]> = (0..cube.centre.len()).into_par_iter().map(texel).collect();
    std::array::from_fn(|c| all.iter().map(|l| l[c]).collect())
}

/// The Haar transform of each face, in place.
pub fn transform(faces: &mut [f32], side: usize) {
    for face in faces.chunks_exact_mut(side * side) {
        // Sides of parameters are powers of two.
        if haar_forward(face, side).is_err() {
            face.fill(0.0);
        }
    }
}

impl Part for Light {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        distant::save_plain(self.image.as_ref(), &self.small, to, prefix);
        self.sh.save(to, prefix);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let (image, small) = distant::load_plain(from, prefix)?;
        Ok(Self { image, small, sh: ShLight::load(from, prefix)? })
    }

    fn bytes(&self) -> usize {
        self.image.as_ref().map_or(0, |i| 12 * i.width * i.height) + 56 * self.small.len() + self.sh.bytes()
    }
}
