//! The map, and its error as an approximation of the model.

use super::MirrorMap;
use crate::certify::{Model, Report, Target};
use crate::shared::light::distant::DistantLight;
use crate::shared::material::reflectance::Reflectance;
use crate::shared::once;
use crate::shared::tables::chain::Chain;
use crate::shared::tables::{load_cube, save_cube};
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use crate::{BakeError, Part, Technique};
use std::sync::OnceLock;
use steradian_base::{ParamInfo, Task, params};
use steradian_brdf::Form;
use steradian_light::{Environment, Lights};
use steradian_prefilter::{EdgeCube, SmallLight, Tree};
use steradian_sphere::{Layout, SphereImage, frame};

params! {
    /// Size of the map.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Size {
        /// Intervals per cube edge; the environment's own resolution where `None`.
        pub size: Option<usize> = ParamInfo::whole("size", [1.0, 4096.0], 0.0, "intervals per cube edge; auto: as fine as the environment, at most 1024").auto(0.0).unit("texels"),
    }
}

/// Sharpest microfacet width for which the hierarchy still resolves the lobe.
const SHARPEST: f64 = 0.01;

/// The environment on a cube.
pub struct Light {
    pub(super) cube: EdgeCube,
    /// The map and its successive halvings, made for the first point with normals of its own.
    halves: OnceLock<Chain>,
    /// The light in the form that the certificate evaluates.
    distant: DistantLight,
}

impl Light {
    pub(super) fn bake(lights: &Lights, p: &Size, task: &Task) -> Result<Self, BakeError> {
        let slug = MirrorMap::CARD.slug;
        if !lights.directionals.is_empty() {
            let why = "a mirror shows a directional light infinitely bright: use a disk light".into();
            return Err(BakeError::Light { slug, why });
        }
        let distant = DistantLight::bake(slug, lights, 0, task)?;
        let black = || std::sync::Arc::new(Environment { image: SphereImage::new(Layout::LatLong, 8, 4) });
        let environment = lights.environment.clone().unwrap_or_else(black);
        // A lat-long row is π/height, a cube interval about (π/2)/size.
        let own = (environment.image.height / 2).next_power_of_two().clamp(64, 1024);
        let size = p.size.unwrap_or(own);
        let need = 6 * 16 * ((size + 1) * (size + 1)) as u64 + 72 * (4 * size * size) as u64;
        if need > task.max_memory() {
            return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
        }
        let mut cube = EdgeCube::from_image(&environment.image, size);
        lights.disks.iter().for_each(|d| cube.add(&SmallLight::from(d)));
        Ok(Self { cube, halves: OnceLock::new(), distant })
    }

    /// The map with its halves.
    pub(super) fn halves(&self) -> &Chain {
        once::get(&self.halves, || Chain::halved(&self.cube, 8))
    }
}

impl Part for Light {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        save_cube(&self.cube, to, format!("{prefix}.map"));
        self.distant.save(to, prefix);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let cube = load_cube(from, &format!("{prefix}.map"))?;
        Ok(Self { cube, halves: OnceLock::new(), distant: DistantLight::load(from, prefix)? })
    }

    fn bytes(&self) -> usize {
        crate::shared::tables::cube_bytes(&self.cube)
    }

    fn kept_light(&self) -> Option<&Tree> {
        self.distant.kept_light()
    }
}

/// The mirror: f0 of Schlick's Fresnel term, and the factor before it.
#[derive(Debug, Clone, PartialEq)]
pub struct Mirror {
    pub(super) f0: [f32; 3],
    pub(super) scale: [f32; 3],
}

pub(super) fn link(light: &Light, m: &Reflectance) -> (Mirror, Report) {
    let (_, f0, scale) = numbers(m);
    let mirror = Mirror { f0: f0.map(|x| x as f32), scale: scale.map(|x| x as f32) };
    (mirror, Report::default().detail("size", light.cube.size() as f64))
}

/// Width of the lobe, infinite where it has two; reflectance at normal incidence; factor.
fn numbers(m: &Reflectance) -> (f64, [f64; 3], [f64; 3]) {
    match m.form() {
        Form::Ggx { alpha: [ax, ay], f0, scale } => (if ax == ay { ax } else { f64::INFINITY }, f0, scale),
        Form::CookTorrance { m, f0, scale, .. } => (m, f0, scale),
        _ => (0.0, [1.0; 3], [1.0; 3]),
    }
}

/// The model itself, or its mirror limit where its lobe is too sharp to integrate.
pub(super) fn target<'a>(light: &'a Light, m: &'a Reflectance) -> Target<'a> {
    let (width, f0, scale) = numbers(m);
    if width >= SHARPEST {
        return Target::Integral(Model::of(&*m.brdf));
    }
    Target::Limit(Box::new(move |fr, wo| {
        let r = frame::reflect(fr.to_world(wo), fr.n);
        let l = light.distant.radiance(r);
        let u = (1.0 - wo.z).powi(5);
        std::array::from_fn(|c| scale[c] * (f0[c] + (1.0 - f0[c]) * u) * l[c])
    }))
}

impl Part for Mirror {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        put_f32(to, format!("{prefix}.f0"), vec![3], self.f0.to_vec());
        put_f32(to, format!("{prefix}.scale"), vec![3], self.scale.to_vec());
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let get = |name: String| -> Result<[f32; 3], PartError> {
            get_f32(from, &name, 1)?.1.try_into().map_err(|_| PartError::Unexpected(name))
        };
        Ok(Self { f0: get(format!("{prefix}.f0"))?, scale: get(format!("{prefix}.scale"))? })
    }

    fn bytes(&self) -> usize {
        24
    }
}
