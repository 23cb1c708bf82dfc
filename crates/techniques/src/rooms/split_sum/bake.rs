//! The chain of the light; albedo table and roughness of the material.

use super::{SplitSum, shade};
use crate::certify::{Model, Report, Target};
use crate::shared::chain::Chain;
use crate::shared::distant::{DistantLight, ORDER};
use crate::shared::quadric::Quadric;
use crate::shared::reflectance::Reflectance;
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use crate::{BakeError, Part, Technique};
use std::f64::consts::PI;
use steradian_base::{ParamInfo, Task, params};
use steradian_brdf::{Brdf, Form, dfg};
use steradian_light::{Environment, Lights};
use steradian_prefilter::{Beam, Cosine, EdgeCube, GgxMirror, Source, Tree, Zonal, filter};
use steradian_sphere::{Layout, SphereImage};

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Levels of the chain.
        pub levels: usize = ParamInfo::whole("levels", [2.0, 32.0], 10.0, "levels of the chain, equally spaced in perceptual roughness from 0 to 1"),
        /// Intervals per cube edge of level 0; the environment's own where `None`.
        pub size: Option<usize> = ParamInfo::whole("size", [1.0, 2048.0], 0.0, "intervals per cube edge of level 0; auto: as fine as the environment, at most 256").auto(0.0).unit("texels"),
        /// Fdez-Agüera's compensation?
        pub multiscatter: bool = ParamInfo::switch("multiscatter", false, "give back the energy that single scattering loses (Fdez-Agüera 2019)"),
    }
}

/// Highest band of lights with edges, of which more than [`EDGES`] of the energy is beyond [`ORDER`]: enough for the second
/// level of ten (α = 1/81, k_l about e^(−αl)) to be filtered by bands. Direct sums would take minutes for its 400 000 texels.
const BANDS: usize = 767;
const EDGES: f64 = 1e-3;
/// Tolerance of the chain where the user gives none.
const TOLERANCE: f64 = 0.01;

/// The chain, and E/π of order 2.
pub struct Light {
    pub(super) chain: Chain,
    /// E/π over n: bands 0 to 2.
    pub(super) mean_radiance: Quadric,
    distant: DistantLight,
}

impl Light {
    pub(super) fn bake(lights: &Lights, p: &Params, task: &Task) -> Result<Self, BakeError> {
        let slug = SplitSum::CARD.slug;
        let mut distant = DistantLight::bake(slug, lights, ORDER, task)?;
        if beyond(&distant) > EDGES {
            distant.source = Source::new(lights, BANDS, task)?;
        }
        let height = lights.environment.as_ref().map_or(64, |e| e.image.height);
        let own = (height / 2).next_power_of_two().clamp(64, 256);
        let size = p.size.unwrap_or(own);
        let need = 6 * 16 * ((size + 1) * (size + 1)) as u64 * 2 + 72 * (4 * size * size) as u64;
        if need > task.max_memory() {
            return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
        }
        let tolerance = task.tolerance().unwrap_or(TOLERANCE).min(0.1);
        task.begin("prefilter", p.levels as u64);
        let mut levels = vec![mirror(lights, size)];
        for k in 1..p.levels {
            task.advance(1);
            let kernel = GgxMirror::new((k as f64 / (p.levels - 1) as f64).powi(2));
            let size = filter::Size::UpTo(size);
            levels.push(filter(&distant.source, &distant.tree, &kernel, size, tolerance, task)?.cube);
        }
        task.end();
        let chain = Chain::new(levels).ok_or_else(|| BakeError::Light { slug, why: "no levels".into() })?;
        let k = Cosine.coefficients(2);
        let scale = std::array::from_fn(|l| k[l] / PI);
        let mean_radiance = Quadric::new(&distant.source.coefficients(2), [scale; 3]);
        Ok(Self { chain, mean_radiance, distant })
    }
}

/// The part of the image's energy beyond the bands that are known.
fn beyond(light: &DistantLight) -> f64 {
    let all = light.source.base_energy;
    let known: f64 = light.source.spectrum.c.iter().flatten().map(|x| x * x).sum();
    if all > 0.0 { (all - known) / all } else { 0.0 }
}

/// Level 0: the environment itself, with suns spread over texels (a directional light over those around it).
fn mirror(lights: &Lights, size: usize) -> EdgeCube {
    let mut cube = match &lights.environment {
        Some(e) => EdgeCube::from_image(&e.image, size),
        None => {
            EdgeCube::from_image(&Environment { image: SphereImage::new(Layout::LatLong, 8, 4) }.image, size)
        }
    };
    lights.disks.iter().for_each(|d| cube.add(&Beam::from(d)));
    lights.directionals.iter().for_each(|d| cube.add(&Beam::from(d)));
    cube
}

impl Part for Light {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        self.chain.save(to, prefix);
        self.mean_radiance.save(to, prefix);
        self.distant.save(to, prefix);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        Ok(Self {
            chain: Chain::load(from, prefix)?,
            mean_radiance: Quadric::load(from, prefix)?,
            distant: DistantLight::load(from, prefix)?,
        })
    }

    fn bytes(&self) -> usize {
        self.chain.bytes()
    }

    fn kept_light(&self) -> Option<&Tree> {
        self.distant.kept_light()
    }
}

/// Samples of A and B over √(n·wo): denser towards grazing, where they bend.
const ALBEDO: usize = 128;

/// The material: A and B, f0, level of the chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Specular {
    /// A, B, 0, 0 at √(n·wo) = i/(ALBEDO − 1).
    pub albedo: Vec<[f32; 4]>,
    /// f0.
    pub f0: [f32; 3],
    /// Factor of the model.
    pub scale: [f32; 3],
    /// Level of the chain.
    pub level: f32,
    /// 1 with multiple scattering, else 0.
    pub multiscatter: f32,
}

/// Joins chain and material.
pub fn link(light: &Light, m: &Reflectance, p: &Params) -> (Specular, Report) {
    let (alpha, f0, scale) = match m.form() {
        Form::Ggx { alpha: [alpha, _], f0, scale } => (alpha, f0, scale),
        _ => (1.0, [1.0; 3], [1.0; 3]),
    };
    let at = |i: usize| (i as f64 / (ALBEDO - 1) as f64).powi(2);
    let texel = |i: usize| {
        let d = dfg::ggx(at(i), alpha);
        [d.scale as f32, d.bias as f32, 0.0, 0.0]
    };
    let specular = Specular {
        albedo: (0..ALBEDO).map(texel).collect(),
        f0: f0.map(|x| x as f32),
        scale: scale.map(|x| x as f32),
        level: (alpha.sqrt() * (p.levels - 1) as f64) as f32,
        multiscatter: if p.multiscatter { 1.0 } else { 0.0 },
    };
    let report = Report::default()
        .detail("level", f64::from(specular.level))
        .detail("size", light.chain.levels()[0].size() as f64);
    (specular, report)
}

/// With `multiscatter` the model plus the diffuse term as Fdez-Agüera defines it.
pub fn target<'a>(specular: &'a Specular, brdf: &'a dyn Brdf) -> Target<'a> {
    let mut model = Model::of(brdf);
    if specular.multiscatter > 0.0 {
        model.f_cos = Box::new(move |wi, wo| {
            let mut f = brdf.f_cos(wi, wo);
            let ms = shade::multiscatter(specular, specular.albedo_at(wo.z as f32));
            (0..3).for_each(|c| f[c] += f64::from(specular.scale[c] * ms[c]) / PI * wi.z.max(0.0));
            f
        });
    }
    Target::Integral(model)
}

impl Specular {
    /// A and B at n·wo.
    #[inline(always)]
    pub fn albedo_at(&self, cos_o: f32) -> [f32; 2] {
        let last = self.albedo.len() - 1;
        let x = cos_o.clamp(0.0, 1.0).sqrt() * last as f32;
        let i = (x as usize).min(last - 1);
        let (a, b, w) = (self.albedo[i], self.albedo[i + 1], x - i as f32);
        [a[0] + (b[0] - a[0]) * w, a[1] + (b[1] - a[1]) * w]
    }
}

impl Part for Specular {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        put_f32(to, format!("{prefix}.albedo"), vec![self.albedo.len(), 4], self.albedo.concat());
        let factors = [&self.f0[..], &self.scale, &[self.level, self.multiscatter]].concat();
        put_f32(to, format!("{prefix}.factors"), vec![8], factors);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.albedo");
        let (shape, v) = get_f32(from, &name, 2)?;
        if shape[0] < 2 || shape[1] != 4 {
            return Err(PartError::Unexpected(name));
        }
        let albedo = v.as_chunks().0.to_vec();
        let name = format!("{prefix}.factors");
        let (_, v) = get_f32(from, &name, 1)?;
        let [a, b, c, d, e, f, level, multiscatter] = v[..] else { return Err(PartError::Unexpected(name)) };
        Ok(Self { albedo, f0: [a, b, c], scale: [d, e, f], level, multiscatter })
    }

    fn bytes(&self) -> usize {
        16 * self.albedo.len() + 32
    }
}
