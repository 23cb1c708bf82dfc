//! The light's factor: the chain of Gaussian-filtered maps, and E/π. No material is known here.

use super::GaussianLobes;
use super::params::Params;
use crate::gpu::{Kernel, LightCube, LightTables};
use crate::shared::light::distant::DistantLight;
use crate::shared::light::sh_light::ShLight;
use crate::shared::tables::chain::Chain;
use crate::shared::tables::{cube_bytes, load_cube, save_cube};
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Part, Technique};
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_light::Lights;
use steradian_prefilter::edge_cube::spacing;
use steradian_prefilter::{EdgeCube, Lobe, Tree, filter};

/// Highest band of the light's spectrum: a Gaussian of one degree has fallen to 1e-10 there.
const ORDER: usize = 383;
/// Tolerance of the maps where the user gives none.
const TOLERANCE: f64 = 5e-3;
/// A chain ends with the first level of at least this width, radians: lobes of fits are hardly ever wider.
const WIDE: f64 = 1.1;

/// The maps.
pub struct Light {
    /// Level 0 the light itself, then by doubling widths.
    pub(super) chain: Chain,
    /// σ of each level; for level 0 that of a bilinear lookup of texel means.
    pub(super) sigmas: Vec<f64>,
    /// E/π.
    pub(super) irradiance: EdgeCube,
    /// The light's first bands, from which the blocked part of diffuse light is computed; `None` without
    /// visibility.
    pub(super) sh: Option<ShLight>,
    distant: DistantLight,
}

/// 1 − the mean of cos θ under a spherical Gaussian: about σ² where it is narrow, 1 where it is the whole
/// sphere.
pub(super) fn moment(sigma: f64) -> f64 {
    let lambda = (sigma * sigma).recip();
    // coth λ − 1/λ = 1 + 2/(e^(2λ) − 1) − 1/λ.
    sigma * sigma - 2.0 / (2.0 * lambda).exp_m1()
}

impl Light {
    pub(super) fn bake(lights: &Lights, p: &Params, task: &Task) -> Result<Self, BakeError> {
        let slug = GaussianLobes::CARD.slug;
        let distant = DistantLight::bake(slug, lights, ORDER, task)?;
        let own = lights.environment.as_ref().map_or(64, |e| (e.image.height / 2).next_power_of_two());
        let size = p.size.unwrap_or(own.clamp(64, 256));
        let need = 6 * 16 * ((size + 1) * (size + 1)) as u64 * 2;
        if need > task.max_memory() {
            return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
        }
        let first = p.sigma.to_radians();
        let mut sigmas = vec![(0.5 * spacing(size)).min(0.5 * first), first];
        while sigmas.last().is_some_and(|s| *s < WIDE) {
            sigmas.push(2.0 * sigmas[sigmas.len() - 1]);
        }
        let tolerance = task.tolerance().unwrap_or(TOLERANCE).min(0.1);
        let filtered = |lobe: &Lobe, up: usize| {
            let size = filter::Size::UpTo(up);
            filter(distant.source(), &distant.tree, lobe, size, tolerance, task)
        };
        task.begin("prefilter", sigmas.len() as u64);
        let mut levels = vec![distant.mirror(size)];
        for sigma in &sigmas[1..] {
            task.advance(1);
            levels.push(filtered(&Lobe::spherical_gaussian(*sigma), size)?.cube);
        }
        let irradiance = filtered(&Lobe::lambert(), 64)?.cube;
        task.end();
        let chain = Chain::new(levels).ok_or_else(|| BakeError::Light { slug, why: "no levels".into() })?;
        let sh = p.is_shadowed().then(|| ShLight::bake(slug, lights, 0.0)).transpose()?;
        Ok(Self { chain, sigmas, irradiance, sh, distant })
    }

    /// The level of the chain, between two, whose mixture has the second moment of a Gaussian of `sigma`.
    pub(super) fn level(&self, sigma: f64) -> f64 {
        let above = self.sigmas.partition_point(|s| *s <= sigma).clamp(1, self.sigmas.len() - 1);
        let (a, b) = (moment(self.sigmas[above - 1]), moment(self.sigmas[above]));
        (above - 1) as f64 + ((moment(sigma) - a) / (b - a)).clamp(0.0, 1.0)
    }

    /// The data of a GPU that are filtered light: the chain and E/π.
    pub(super) fn tables(&self) -> LightTables {
        let kernel =
            |k: usize| if k == 0 { Kernel::Mirror } else { Kernel::Gaussian { sigma: self.sigmas[k] } };
        let levels = (0..self.sigmas.len()).map(|k| Some((kernel(k), 1.0))).collect();
        let chain = LightCube { table: "chain", levels };
        LightTables {
            cubes: vec![chain, LightTables::cube("irradiance", Kernel::Lambert, 1.0)],
            irradiance: None,
        }
    }

    /// The narrowest and the widest σ that the chain holds.
    pub(super) fn range(&self) -> [f64; 2] {
        [self.sigmas[0], self.sigmas[self.sigmas.len() - 1]]
    }
}

impl Part for Light {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        self.chain.save(to, prefix);
        save_cube(&self.irradiance, to, format!("{prefix}.irradiance_over_pi"));
        put_f64(to, format!("{prefix}.sigma"), vec![self.sigmas.len()], self.sigmas.clone());
        self.sh.iter().for_each(|sh| sh.save(to, prefix));
        self.distant.save(to, prefix);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let chain = Chain::load(from, prefix)?;
        let name = format!("{prefix}.sigma");
        let (_, sigmas) = get_f64(from, &name, 1)?;
        let ascending =
            sigmas.windows(2).all(|w| w[0] < w[1]) && sigmas.iter().all(|s| *s > 0.0 && *s < 2.0 * PI);
        if sigmas.len() != chain.levels().len() || sigmas.len() < 2 || !ascending {
            return Err(PartError::Unexpected(name));
        }
        let irradiance = load_cube(from, &format!("{prefix}.irradiance_over_pi"))?;
        let first = format!("{prefix}.radiance_sh");
        let sh = from.tensors.contains_key(&first).then(|| ShLight::load(from, prefix)).transpose()?;
        Ok(Self { chain, sigmas, irradiance, sh, distant: DistantLight::load(from, prefix)? })
    }

    fn bytes(&self) -> usize {
        self.chain.bytes() + cube_bytes(&self.irradiance)
    }

    fn kept_light(&self) -> Option<&Tree> {
        self.distant.kept_light()
    }
}
