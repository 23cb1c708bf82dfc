//! Where pictures are computed: on the CPU, or with the feature `gpu` on a GPU.

use crate::context::Context;
use crate::failure::Failure;
use crate::studio::Baked;
use steradian_render::{Film, Settings, Stage};

#[cfg(feature = "gpu")]
mod device;

/// A place where pictures are computed.
pub enum Engine {
    /// The CPU renderer.
    Cpu,
    /// A GPU.
    #[cfg(feature = "gpu")]
    Gpu(Box<device::Device>),
}

impl Engine {
    /// What `--backend` asks for; `both` counts as `gpu`. Without the feature there is only the CPU.
    pub fn open(context: &Context) -> Result<Self, Failure> {
        #[cfg(feature = "gpu")]
        return device::open(context);
        #[cfg(not(feature = "gpu"))]
        {
            let _ = context; // whose construction has refused the GPU
            Ok(Self::Cpu)
        }
    }

    /// Its name in reports.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            #[cfg(feature = "gpu")]
            Self::Gpu(_) => "gpu",
        }
    }

    /// The picture of `stage`, whose surfaces are those of `baked`, and the engine that made it: `--backend auto` leaves
    /// to the CPU what the GPU cannot do.
    pub fn film(
        &self,
        stage: &Stage<'_>,
        baked: &[&Baked],
        settings: &Settings,
        context: &Context,
    ) -> Result<(Film, &'static str), Failure> {
        #[cfg(feature = "gpu")]
        if let Self::Gpu(device) = self
            && let Some(film) = device.film(stage, baked, settings, context)?
        {
            return Ok((film, self.name()));
        }
        #[cfg(not(feature = "gpu"))]
        let _ = baked;
        Ok((steradian_render::render(stage, settings, &context.task)?, Self::Cpu.name()))
    }
}
