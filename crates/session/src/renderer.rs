//! Where pictures are computed: on the CPU, or with the feature `gpu` on a GPU.

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
    /// What the session's back end asks for. Without the feature there is only the CPU.
    pub fn open(session: &Session) -> Result<Self, Error> {
        #[cfg(feature = "gpu")]
        return gpu::open(session);
        #[cfg(not(feature = "gpu"))]
        {
            let _ = session; // whose construction has refused the GPU
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

    /// The picture of `stage`, whose surfaces are those of `materials`, and where it was made: an automatic
    /// back end leaves to the CPU what the GPU cannot do.
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
