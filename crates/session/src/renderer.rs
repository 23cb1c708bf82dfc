//! Device on which pictures are computed: the CPU, or with the feature `gpu` a GPU.

use crate::{Error, Prepared, Session};
use steradian_render::{Film, Settings, Stage};

#[cfg(feature = "gpu")]
mod gpu;

/// A place where pictures are computed.
pub enum Renderer {
    /// The CPU renderer.
    Cpu,
    /// A GPU.
    #[cfg(feature = "gpu")]
    Gpu(Box<gpu::Device>),
}

impl Renderer {
    /// Opens the session's back end. Without the feature `gpu` there is only the CPU.
    pub fn open(session: &Session) -> Result<Self, Error> {
        #[cfg(feature = "gpu")]
        return gpu::open(session);
        #[cfg(not(feature = "gpu"))]
        {
            let _ = session; // whose construction has refused the GPU
            Ok(Self::Cpu)
        }
    }

    /// Name of the back end in reports.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            #[cfg(feature = "gpu")]
            Self::Gpu(_) => "gpu",
        }
    }

    /// The picture of `stage`, whose surfaces are those of `materials`, and the back end that rendered it: an
    /// automatic back end falls back to the CPU for pictures that the GPU cannot render.
    pub fn film(
        &self,
        stage: &Stage<'_>,
        materials: &[Prepared],
        settings: &Settings,
        session: &Session,
    ) -> Result<(Film, &'static str), Error> {
        #[cfg(feature = "gpu")]
        if let Self::Gpu(device) = self
            && let Some(film) = device.film(stage, materials, settings, session)?
        {
            return Ok((film, self.name()));
        }
        let any = |is: fn(&Prepared) -> bool| materials.iter().any(is);
        let settings = if any(|m| m.lobe) {
            // Rays over a lobe are many.
            Settings { share: true, interpolate: true, ..*settings }
        } else if any(|m| m.shadowed) {
            // Shadows have edges inside surfaces.
            Settings { inner: settings.inner.max(2), share: false, interpolate: false, ..*settings }
        } else {
            *settings
        };
        Ok((steradian_render::render(stage, &settings, &session.task)?, Self::Cpu.name()))
    }
}
