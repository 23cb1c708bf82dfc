//! Pictures of scenes.

use crate::{Error, Method, Outcome, Prepared, Renderer, Scene, Session};
use std::time::Instant;
use steradian_render::scenefile::SceneBackground;
use steradian_render::{Backdrop, Background, Develop, Display, Film, Settings, Stage};
use steradian_scene::{Bvh, Camera};

/// A finished picture.
pub struct Picture {
    /// Linear radiance.
    pub film: Film,
    /// Exposure value and tone mapper for displays.
    pub develop: Develop,
    /// The materials, as they were shaded.
    pub materials: Vec<Prepared>,
    /// Where it was computed: "cpu" or "gpu".
    pub backend: &'static str,
    /// Seconds of rendering, without bakes.
    pub seconds: f64,
}

impl Picture {
    /// The largest error of a material.
    pub fn error(&self) -> f64 {
        self.materials.iter().map(Prepared::error).fold(0.0, f64::max)
    }

    /// Exposed and tone-mapped for a display.
    pub fn display(&self) -> Display {
        self.develop.film(&self.film)
    }
}

impl Session {
    /// Bakes what the scene's materials need and renders it. Where the scene asks for an accuracy, the certificates are
    /// held against it.
    pub fn render(&mut self, scene: &Scene) -> Result<Outcome<Picture>, Error> {
        self.render_on(scene, None)
    }

    /// [`Session::render`] by a renderer that is open already.
    pub fn render_on(
        &mut self,
        scene: &Scene,
        renderer: Option<Renderer>,
    ) -> Result<Outcome<Picture>, Error> {
        let camera = scene.camera_or_framed(None)?;
        let bvh = Bvh::build(&scene.mesh);
        let materials = self.prepare_all(scene, &bvh, camera)?;
        let exact = materials.iter().any(|m| matches!(m.method, Method::Reference));
        let renderer = match renderer {
            Some(renderer) => renderer,
            None if exact => Renderer::Cpu,
            None => Renderer::open(self)?,
        };
        let background = background(scene, &camera);
        let surfaces: Vec<_> = materials.iter().map(|m| m.surface.clone()).collect();
        let stage =
            Stage { mesh: &scene.mesh, bvh: &bvh, surfaces: &surfaces, background: &background, camera };
        let mut settings = scene.settings;
        if exact {
            // The reference integrates each point on its own: one in a pixel and surface is enough, coverage gets its
            // samples.
            settings = Settings { inner: 1, share: true, ..settings };
        }
        let start = Instant::now();
        let (film, backend) = renderer.film(&stage, &materials, &settings, self)?;
        let seconds = start.elapsed().as_secs_f64();
        let ev = scene.exposure.unwrap_or_else(|| auto_exposure(&film));
        let develop = Develop { ev, mapper: scene.tone_mapper };
        let picture = Picture { film, develop, materials, backend, seconds };
        let error = picture.error();
        self.note_error(format!("relative error {error:.3e}"));
        Ok(Outcome::new(picture, scene.tolerance, error))
    }
}

/// Automatic exposure: of the surfaces, where there are any.
pub fn auto_exposure(film: &Film) -> f32 {
    let covered = film.alpha.iter().any(|a| *a > 0.0);
    steradian_render::tone::auto_exposure(film, |i| if covered { film.alpha[i] } else { 1.0 })
}

/// What the camera sees beside the mesh.
pub(crate) fn background(scene: &Scene, camera: &Camera) -> Background {
    match scene.background {
        SceneBackground::Colour(c) => Background::Colour(c),
        SceneBackground::Environment(blur) => {
            let blur = footprint(camera, scene.settings.height).max(blur);
            Background::Sky(Backdrop::new(&scene.lights, blur))
        }
    }
}

/// Angle of a pixel at the centre of a picture of `height` rows, radians; 0 for parallel rays.
pub(crate) fn footprint(camera: &Camera, height: usize) -> f64 {
    match camera {
        Camera::Pinhole { fov_y, .. } => 2.0 * f64::from(0.5 * fov_y).tan() / height.max(1) as f64,
        Camera::Orthographic { .. } => 0.0,
    }
}
