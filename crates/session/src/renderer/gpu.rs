//! Pictures on a GPU.

use super::Renderer;

use crate::gpu_scene::{scene as drawn, unlit};
use crate::{Backend, Error, GpuPath, Notice, Prepared, Session};
use steradian_gpu::scene::{self, Rate};
use steradian_gpu::{Gpu, GpuError, Renderer as Raster};
use steradian_render::{Film, Settings, Stage};

/// An open GPU.
pub struct Device {
    gpu: Gpu,
}

/// The GPU or the CPU, as `--backend` says.
pub fn open(session: &Session) -> Result<Renderer, Error> {
    let automatic = match session.backend {
        Backend::Cpu => return Ok(Renderer::Cpu),
        Backend::Auto => true,
        Backend::Gpu => false,
    };
    match Gpu::open() {
        Ok(gpu) if automatic && gpu.is_software() => {
            session
                .tell(Notice::OnCpu { why: format!("{} is no GPU (`backend` gpu uses it)", gpu.describe()) });
            Ok(Renderer::Cpu)
        }
        Ok(gpu) => Ok(Renderer::Gpu(Box::new(Device { gpu }))),
        Err(e) if automatic => {
            session.tell(Notice::OnCpu { why: e.to_string() });
            Ok(Renderer::Cpu)
        }
        Err(e) => Err(e.into()),
    }
}

impl Device {
    /// The picture; `None` where `--backend auto` leaves it to the CPU.
    pub fn film(
        &self,
        stage: &Stage<'_>,
        baked: &[Prepared],
        settings: &Settings,
        session: &Session,
    ) -> Result<Option<Film>, Error> {
        let automatic = session.backend == Backend::Auto;
        if baked.iter().any(|b| b.bake.is_none()) {
            if automatic {
                return Ok(None);
            }
            return Err(Error::usage(
                "the reference runs on the CPU: choose a technique, or use `backend` cpu",
            ));
        }
        if let Some(why) = unlit(baked) {
            if automatic {
                session.tell(Notice::OnCpu { why });
                return Ok(None);
            }
            return Err(Error::usage(format!("{why}: use `suns` fold or `backend` cpu")));
        }
        match self.draw(stage, baked, settings, session.gpu_path) {
            Ok((film, clipped)) => {
                if clipped > 0 {
                    session.tell(Notice::Clipped { samples: clipped });
                }
                Ok(Some(film))
            }
            Err(e) if automatic => {
                session.tell(Notice::OnCpu { why: e.to_string() });
                Ok(None)
            }
            Err(e) => Err(e.into()),
        }
    }

    fn draw(
        &self,
        stage: &Stage<'_>,
        baked: &[Prepared],
        s: &Settings,
        path: GpuPath,
    ) -> Result<(Film, u32), GpuError> {
        let path = match path {
            GpuPath::Auto => self.gpu.preferred_path(),
            GpuPath::Raster => scene::Path::Raster,
            GpuPath::Compute => scene::Path::Compute,
        };
        let settings = scene::Settings {
            path,
            rate: Rate::Sample,
            scale: s.edge.div_ceil(4).clamp(1, 4),
            ..scene::Settings::new(s.width, s.height)
        };
        let (picture, _) = Raster::new(&self.gpu, drawn(stage, baked), &settings)?.render(&self.gpu)?;
        let mut film = Film::without_background(s.width, s.height, picture.rgb, picture.alpha);
        film.set_background(&stage.camera, stage.background);
        Ok((film, picture.clipped))
    }
}
