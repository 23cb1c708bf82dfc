//! The two maps.

use super::PhongDiffuseMaps;
use super::blend::{Blend, Params};
use crate::certify::{Model, Report, Target, one_by_one};
use crate::shared::light::distant::DistantLight;
use crate::shared::material::reflectance::Reflectance;
use crate::shared::once;
use crate::shared::tables::chain::Chain;
use crate::shared::tables::{cube_bytes, load_cube, save_cube};
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use crate::{BakeError, Part, Technique};
use std::sync::OnceLock;
use steradian_base::Task;
use steradian_brdf::Lobe;
use steradian_prefilter::{Cosine, CubeMethod, EdgeCube, Filtered, Power, Zonal, filter};
use steradian_sphere::frame::reflect;

/// Tolerance where the user gives none.
const TOLERANCE: f64 = 5e-3;

/// ∫ (r·wi)₊^n L and ∫ ⟨n·wi⟩₊ L, and the factors that blend them.
#[derive(Debug, Clone, PartialEq)]
pub struct PhongMaps {
    /// The unweighted Phong map over r.
    pub phong: EdgeCube,
    /// Irradiance over n.
    pub diffuse: EdgeCube,
    /// k_s, with every factor of the model.
    pub k_s: [f32; 3],
    /// k_d/π.
    pub k_d_over_pi: [f32; 3],
    /// f0 and 1 − f0 of Schlick's term; both 0 for the diffuse map alone.
    pub f: [f32; 2],
    /// Exponent.
    pub n: f32,
    /// Normalised maps of several exponents, made for the first point with a lobe of its own.
    lobes: OnceLock<Chain>,
}

/// Levels of the chain for points with lobes of their own.
const LEVELS: usize = 9;
/// Smallest alpha of its levels, unless the material is sharper: an exponent of 800.
const SHARPEST: f32 = 0.025;

impl PhongMaps {
    /// alpha of the material: a lobe (r·wi)^n has the variance 1/n per axis, one of alpha 2 alpha².
    pub fn alpha(&self) -> f32 {
        (0.5 / self.n).sqrt().min(1.0)
    }

    /// Perceptual roughness of the chain's first level; the last one's is 1, and they are equally spaced.
    pub fn first(&self) -> f32 {
        self.alpha().min(SHARPEST).sqrt()
    }

    /// ∫ (n+1)/2π (r·wi)₊^n L at the exponents of the chain.
    pub fn lobes(&self, light: &DistantLight, p: &Params) -> &Chain {
        once::get(&self.lobes, || {
            let map = |k: usize| {
                let pr = self.first() + (1.0 - self.first()) * k as f32 / (LEVELS - 1) as f32;
                let n = f64::from(0.5 / pr.powi(4));
                let size = filter::Size::UpTo(p.size.unwrap_or(256));
                let kernel = Normalised(Power { n });
                filter(light.source(), &light.tree, &kernel, size, TOLERANCE, &Task::quiet()).map(|f| f.cube)
            };
            let count = if self.k_s == [0.0; 3] { 0 } else { LEVELS };
            // A quiet task is never cancelled.
            let levels: Vec<EdgeCube> = (0..count).filter_map(|k| map(k).ok()).collect();
            Chain::new(levels).unwrap_or_else(|| Chain::halved(&self.phong, self.phong.size()))
        })
    }
}

/// Phong's lobe of integral 1.
struct Normalised(Power);

impl Normalised {
    fn scale(&self) -> f64 {
        (self.0.n + 1.0) / (2.0 * std::f64::consts::PI)
    }
}

impl Zonal for Normalised {
    fn value(&self, x: f64) -> f64 {
        self.scale() * self.0.value(x)
    }

    fn width(&self) -> f64 {
        self.0.width()
    }

    fn support(&self) -> f64 {
        self.0.support()
    }

    fn coefficients(&self, order: usize) -> Vec<f64> {
        self.0.coefficients(order).iter().map(|k| k * self.scale()).collect()
    }
}

fn black() -> Filtered {
    let cube = EdgeCube::from_fn(1, |_| [0.0; 3]);
    Filtered { cube, way: CubeMethod::Frequency { order: 0 }, tail: 0.0, interpolation: 0.0, clipped: 0.0 }
}

/// Joins light and lobe.
pub fn link(
    light: &DistantLight,
    m: &Reflectance,
    p: &Params,
    task: &Task,
) -> Result<(PhongMaps, Report), BakeError> {
    let blend = Blend::new(m, p);
    let tolerance = task.tolerance().unwrap_or(TOLERANCE).min(0.1);
    let size = p.size.map_or(filter::Size::UpTo(256), filter::Size::Fixed);
    let need = p.size.map_or(0, |size| 6 * 32 * ((size + 1) * (size + 1)) as u64);
    if need > task.max_memory() {
        return Err(BakeError::Memory {
            slug: PhongDiffuseMaps::CARD.slug,
            need,
            allowed: task.max_memory(),
        });
    }
    let map = |k: &dyn Zonal, size, used: bool| {
        if used { filter(light.source(), &light.tree, k, size, tolerance, task) } else { Ok(black()) }
    };
    let phong = map(&Power { n: blend.n }, size, blend.f0.is_some() && blend.k_s != [0.0; 3])?;
    let diffuse_used = blend.k_d != [0.0; 3] && blend.f0 != Some(1.0);
    let diffuse = map(&Cosine, filter::Size::UpTo(64), diffuse_used)?;
    let maps = PhongMaps {
        phong: phong.cube,
        diffuse: diffuse.cube,
        k_s: blend.k_s.map(|k| k as f32),
        k_d_over_pi: blend.k_d.map(|k| (k / std::f64::consts::PI) as f32),
        f: blend.f0.map_or([0.0; 2], |f0| [f0 as f32, (1.0 - f0) as f32]),
        n: blend.n as f32,
        lobes: OnceLock::new(),
    };
    let order = if let CubeMethod::Frequency { order } = phong.way { order as f64 } else { -1.0 };
    let report = Report::default()
        .detail("order", order)
        .detail("size", maps.phong.size() as f64)
        .detail("diffuse size", maps.diffuse.size() as f64)
        .detail("clipped", phong.clipped.max(diffuse.clipped));
    Ok((maps, report))
}

/// The blend as a reflectance, which has the Phong lobe over the whole sphere.
pub fn target(m: &Reflectance, p: &Params) -> Target<'static> {
    let blend = Blend::new(m, p);
    let width = Power { n: blend.n }.width();
    Target::Integral(Model {
        whole: true,
        lobes: Box::new(move |wo| vec![Lobe::Axis { axis: reflect(wo, glam::DVec3::Z), width }]),
        f_cos: one_by_one(move |wi, wo| blend.f_cos(wi, wo)),
    })
}

impl Part for PhongMaps {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        save_cube(&self.phong, to, format!("{prefix}.phong"));
        save_cube(&self.diffuse, to, format!("{prefix}.irradiance"));
        let factors = [&self.k_s[..], &self.k_d_over_pi, &self.f, &[self.n]].concat();
        put_f32(to, format!("{prefix}.factors"), vec![9], factors);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.factors");
        let (_, v) = get_f32(from, &name, 1)?;
        let [a, b, c, d, e, f, g, h, n] = v[..] else { return Err(PartError::Unexpected(name)) };
        Ok(Self {
            phong: load_cube(from, &format!("{prefix}.phong"))?,
            diffuse: load_cube(from, &format!("{prefix}.irradiance"))?,
            k_s: [a, b, c],
            k_d_over_pi: [d, e, f],
            f: [g, h],
            n,
            lobes: OnceLock::new(),
        })
    }

    fn bytes(&self) -> usize {
        cube_bytes(&self.phong) + cube_bytes(&self.diffuse)
    }
}
