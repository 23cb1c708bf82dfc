//! The chain of the light; albedo table and roughness of the material.

use super::SplitSum;
use super::stretched::Stretched;
use crate::certify::Report;
use crate::shared::light::distant::{DistantLight, ORDER};
use crate::shared::material::reflectance::Reflectance;
use crate::shared::maths::quadric::Quadric;
use crate::shared::tables::chain::Chain;
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use crate::{BakeError, Part, Technique};
use std::f64::consts::PI;
use steradian_base::{ParamInfo, Task, params};
use steradian_brdf::{Form, dfg};
use steradian_light::{Environment, Lights};
use steradian_prefilter::{Cosine, EdgeCube, GgxMirror, SmallLight, Source, Tree, Zonal, filter};
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
        /// Lookups along the long axis of an anisotropic lobe.
        pub taps: usize = ParamInfo::whole("taps", [1.0, 64.0], 16.0, "lookups along the long axis of an anisotropic lobe"),
    }
}

/// Highest band at most for lights with edges: enough for the second level of ten (α = 1/81, k_l about
/// e^(−αl)) to be filtered by bands. Direct sums would take minutes for its 400 000 texels.
const BANDS: usize = 767;
/// Lights have edges where more than this part of the energy is beyond [`ORDER`]: 3 % of the RMS radiance.
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
        let tolerance = task.tolerance().unwrap_or(TOLERANCE).min(0.1);
        let kernel = |k: usize| GgxMirror::new((k as f64 / (p.levels - 1) as f64).powi(2));
        if beyond(&distant) > EDGES {
            let bands = filter::bands(distant.source(), &kernel(1), tolerance, BANDS);
            if bands > ORDER {
                distant.set_source(Source::new(lights, bands, task)?);
            }
        }
        let height = lights.environment.as_ref().map_or(64, |e| e.image.height);
        let own = (height / 2).next_power_of_two().clamp(64, 256);
        let size = p.size.unwrap_or(own);
        let need = 6 * 16 * ((size + 1) * (size + 1)) as u64 * 2 + 72 * (4 * size * size) as u64;
        if need > task.max_memory() {
            return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
        }
        task.begin("prefilter", p.levels as u64);
        let mut levels = vec![mirror(lights, size)];
        for k in 1..p.levels {
            task.advance(1);
            let size = filter::Size::UpTo(size);
            levels.push(filter(distant.source(), &distant.tree, &kernel(k), size, tolerance, task)?.cube);
        }
        task.end();
        let chain = Chain::new(levels).ok_or_else(|| BakeError::Light { slug, why: "no levels".into() })?;
        let k = Cosine.coefficients(2);
        let scale = std::array::from_fn(|l| k[l] / PI);
        let mean_radiance = Quadric::new(&distant.source().coefficients(2), [scale; 3]);
        Ok(Self { chain, mean_radiance, distant })
    }
}

/// The part of the image's energy beyond its computed bands.
fn beyond(light: &DistantLight) -> f64 {
    let all = light.source().base_energy;
    let known: f64 = light.source().spectrum.c.iter().flatten().map(|x| x * x).sum();
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
    lights.disks.iter().for_each(|d| cube.add(&SmallLight::from(d)));
    lights.directionals.iter().for_each(|d| cube.add(&SmallLight::from(d)));
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

/// Samples of A and B over √(n·wo), denser towards grazing views, where they curve.
const ALBEDO: usize = 128;

/// Numbers of a material in addition to its albedo.
const FACTORS: usize = 11;

/// The material: A and B, f0, level of the chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Specular {
    /// A, B, 0, 0 at √(n·wo) = i/(ALBEDO − 1).
    pub albedo: Vec<[f32; 4]>,
    /// f0.
    pub f0: [f32; 3],
    /// Albedo of the diffuse base.
    pub base: [f32; 3],
    /// Factor of the model.
    pub scale: [f32; 3],
    /// Level of the chain.
    pub level: f32,
    /// 1 with multiple scattering, else 0.
    pub multiscatter: f32,
    /// The lobe of a model with two widths.
    pub stretched: Option<Stretched>,
}

/// Width, f0, albedo of the diffuse base and factor of a material; the width is 1 where the lobe is not
/// isotropic.
fn numbers(form: &Form) -> (f64, [f64; 3], [f64; 3], [f64; 3]) {
    match *form {
        Form::Ggx { alpha: [ax, ay], f0, scale } => (if ax == ay { ax } else { 1.0 }, f0, [0.0; 3], scale),
        Form::Dielectric { alpha, f0, albedo, scale } => (alpha, f0, albedo, scale),
        Form::Ward { rs, rd, .. } => (1.0, rs, rd, [1.0; 3]),
        _ => (1.0, [1.0; 3], [0.0; 3], [1.0; 3]),
    }
}

/// Joins chain and material.
pub fn link(light: &Light, m: &Reflectance, p: &Params) -> (Specular, Report) {
    let form = m.form();
    let (alpha, f0, base, scale) = numbers(&form);
    let at = |i: usize| (i as f64 / (ALBEDO - 1) as f64).powi(2);
    let texel = |i: usize| {
        let d = dfg::ggx(at(i), alpha);
        [d.scale as f32, d.bias as f32, 0.0, 0.0]
    };
    let specular = Specular {
        albedo: (0..ALBEDO).map(texel).collect(),
        f0: f0.map(|x| x as f32),
        base: base.map(|x| x as f32),
        scale: scale.map(|x| x as f32),
        level: (alpha.sqrt() * (p.levels - 1) as f64) as f32,
        multiscatter: if p.multiscatter { 1.0 } else { 0.0 },
        stretched: Stretched::of(&form, p.taps),
    };
    let report = Report::default()
        .detail("level", f64::from(specular.level))
        .detail("size", light.chain.levels()[0].size() as f64);
    (specular, report)
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
        let factors = [&self.f0[..], &self.scale, &[self.level, self.multiscatter], &self.base].concat();
        put_f32(to, format!("{prefix}.factors"), vec![FACTORS], factors);
        self.stretched.iter().for_each(|s| s.save(to, prefix));
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
        // Bakes that were saved before there was a diffuse base end with `multiscatter`.
        let (own, base): (Option<[f32; FACTORS - 3]>, _) = match v[..] {
            [ref v @ .., x, y, z] if v.len() == FACTORS - 3 => (v.try_into().ok(), [x, y, z]),
            ref v => (v.try_into().ok(), [0.0; 3]),
        };
        let [a, b, c, d, e, f, level, multiscatter] = own.ok_or(PartError::Unexpected(name))?;
        let stretched = Stretched::load(from, prefix)?;
        Ok(Self { albedo, f0: [a, b, c], base, scale: [d, e, f], level, multiscatter, stretched })
    }

    fn bytes(&self) -> usize {
        16 * self.albedo.len() + 4 * FACTORS + self.stretched.as_ref().map_or(0, Stretched::bytes)
    }
}
