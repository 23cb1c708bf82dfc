//! A technique that follows changing light.

use super::{Budget, Level, Method, Plan, Refilter, Surroundings};
use crate::{Gpu, GpuError, TechniqueData};
use glam::Mat3;
use steradian_technique::GpuTechnique;
use steradian_technique::gpu::{Kernel, LightTables};

/// The refilters of everything that depends on the light in a technique's data.
pub struct Follower {
    /// Each with the table that it fills; one without a table makes irradiance alone.
    refilters: Vec<(Refilter, Option<&'static str>)>,
    irradiance: Option<[f32; 3]>,
}

impl Follower {
    /// Refilters by convolution for `technique`, whose data are filtered light as `of` says.
    pub fn new(gpu: &Gpu, technique: &GpuTechnique, of: &LightTables) -> Result<Self, GpuError> {
        let of_table = |cube| {
            let plan = Plan::of_table(Method::Convolution, technique, cube)?;
            Ok((Refilter::new(gpu, plan)?, Some(cube.table)))
        };
        let mut refilters = of.cubes.iter().map(of_table).collect::<Result<Vec<_>, GpuError>>()?;
        if refilters.is_empty() {
            // Harmonics come with any chain.
            let level = Level { size: 1, kernel: Kernel::Lambert, gain: 1.0 };
            refilters.push((Refilter::new(gpu, Plan::new(Method::Frequency, &[level])?)?, None));
        }
        Ok(Self { refilters, irradiance: of.irradiance })
    }

    /// The light to follow ([`Refilter::set_light`]).
    pub fn set_light(&mut self, light: &Surroundings) {
        self.refilters.iter_mut().for_each(|(r, _)| r.set_light(light.clone()));
    }

    /// Is there work left?
    pub fn is_busy(&self) -> bool {
        self.refilters.iter().any(|(r, _)| r.is_busy())
    }

    /// Works within `budget`, which is shared equally by the tables that are not done, and hands finished
    /// ones to the technique; `true` where there were any.
    pub fn step(
        &mut self,
        gpu: &Gpu,
        budget: Budget,
        technique: &TechniqueData,
        rotation: Mat3,
    ) -> Result<bool, GpuError> {
        let busy = self.refilters.iter().filter(|(r, _)| r.is_busy()).count().max(1);
        let share = match budget {
            Budget::Milliseconds(ms) => Budget::Milliseconds(ms / busy as f64),
            Budget::Texels(n) => Budget::Texels(n / busy as u64),
            Budget::All => Budget::All,
        };
        let mut delivered = false;
        for (refilter, table) in &mut self.refilters {
            if refilter.step(gpu, share)? {
                table.iter().try_for_each(|name| refilter.deliver(gpu, technique, name))?;
                delivered = true;
            }
        }
        if delivered {
            self.turn(gpu, technique, rotation)?;
        }
        Ok(delivered)
    }

    /// Irradiance of the light that is shown, turned by `rotation`: after a technique's uniforms were written
    /// anew.
    pub fn turn(&self, gpu: &Gpu, technique: &TechniqueData, rotation: Mat3) -> Result<(), GpuError> {
        let ready = self.refilters.first().filter(|(r, _)| r.is_ready());
        match (self.irradiance, ready) {
            (Some(gain), Some((refilter, _))) => {
                refilter.deliver_irradiance(gpu, technique, LightTables::QUADRICS, gain, rotation)
            }
            _ => Ok(()),
        }
    }
}
