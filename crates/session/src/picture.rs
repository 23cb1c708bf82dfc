//! Pictures of scenes.

use crate::{Backend, Error, Method, Outcome, Prepared, Renderer, Scene, Session, Shadows};
use glam::{Quat, Vec3};
use std::sync::Arc;
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
    /// By paths: the estimated variance of each pixel's radiance, per channel.
    pub variance: Option<[Vec<f32>; 3]>,
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
    /// Bakes the scene's materials and renders it. Where the scene has a tolerance, the certificates are
    /// compared with it.
    pub fn render(&mut self, scene: &Scene) -> Result<Outcome<Picture>, Error> {
        self.render_on(scene, None)
    }

    /// [`Session::render`] by a renderer that is open already.
    pub fn render_on(
        &mut self,
        scene: &Scene,
        renderer: Option<Renderer>,
    ) -> Result<Outcome<Picture>, Error> {
        let stands = self.stands(scene, renderer.as_ref());
        let camera = scene.camera_or_framed()?;
        let scene = &*scene.staged(&camera, &scene.sited(), &self.task)?;
        let mean = self.in_mean_light(scene)?;
        if by_paths(scene)? {
            let picture = self.traced(scene, camera)?;
            let error = picture.error();
            self.note_error(format!("relative noise {error:.3e}"));
            return Ok(Outcome::new(picture, Some(self.paths.noise), error));
        }
        let bvh = Arc::new(Bvh::build(&scene.mesh));
        let mut materials = self.in_field(scene, self.prepare_all(&mean, &bvh, camera)?)?;
        if let Some(ground) = materials.last_mut().filter(|_| stands) {
            self.shadow(ground, &scene.lights, &bvh);
        }
        let renderer = match scene.probes {
            Some(_) => Renderer::Cpu,
            None => self.renderer_for(&materials, renderer)?,
        };
        let picture = self.shoot(scene, &bvh, camera, materials, &renderer)?;
        let error = picture.error();
        self.note_error(format!("relative error {error:.3e}"));
        Ok(Outcome::new(picture, scene.tolerance, error))
    }

    /// `frames` pictures on a circle around the camera's target, about the camera's up axis, the first one
    /// from the camera's own position; all have the exposure of the first. `each` is called with each picture
    /// and its number from 0.
    pub fn orbit(
        &mut self,
        scene: &Scene,
        frames: usize,
        renderer: Option<Renderer>,
        mut each: impl FnMut(&mut Self, usize, &mut Picture) -> Result<(), Error>,
    ) -> Result<Outcome<Option<Picture>>, Error> {
        let stands = self.stands(scene, renderer.as_ref());
        if scene.probes.is_some() {
            return Err(Error::usage("light fields are shaded one picture at a time: leave `orbit` out"));
        }
        let camera = scene.camera_or_framed()?;
        let mut scene = scene.staged(&camera, &scene.sited(), &self.task)?.into_owned();
        let bvh = Arc::new(Bvh::build(&scene.mesh));
        let mut materials = self.prepare_all(&scene, &bvh, camera)?;
        let renderer = self.renderer_for(&materials, renderer)?;
        let mut last = None;
        for k in 0..frames {
            let camera = turned(camera, std::f32::consts::TAU * k as f32 / frames as f32);
            if k > 0 {
                materials = self.seen_by(&scene, materials, camera)?;
            }
            if let Some(ground) = materials.last_mut().filter(|_| stands) {
                self.shadow(ground, &scene.lights, &bvh);
            }
            let mut picture = self.shoot(&scene, &bvh, camera, materials.clone(), &renderer)?;
            scene.exposure = Some(picture.develop.ev);
            self.note_error(format!("relative error {:.3e}", picture.error()));
            each(self, k, &mut picture)?;
            last = Some(picture);
        }
        let error = last.as_ref().map_or(0.0, Picture::error);
        Ok(Outcome::new(last, scene.tolerance, error))
    }

    /// Does the picture show an object on a ground that gets its shadow? Not in light that varies over space,
    /// nor where a GPU is to render it, which has no rays over the lobe.
    fn stands(&self, scene: &Scene, renderer: Option<&Renderer>) -> bool {
        let by_cpu =
            self.backend != Backend::Gpu && renderer.is_none_or(|r| r.name() == Renderer::Cpu.name());
        scene.ground.is_some() && scene.probes.is_none() && by_cpu && self.shadows == Shadows::Auto
    }

    fn renderer_for(&self, materials: &[Prepared], given: Option<Renderer>) -> Result<Renderer, Error> {
        match given {
            Some(renderer) => Ok(renderer),
            None if exact(materials) => Ok(Renderer::Cpu),
            None => Renderer::open(self),
        }
    }

    fn shoot(
        &self,
        scene: &Scene,
        bvh: &Bvh,
        camera: Camera,
        materials: Vec<Prepared>,
        renderer: &Renderer,
    ) -> Result<Picture, Error> {
        let background = background(scene, &camera);
        let surfaces: Vec<_> = materials.iter().map(|m| m.surface.clone()).collect();
        let stage = Stage { mesh: &scene.mesh, bvh, surfaces: &surfaces, background: &background, camera };
        let mut settings = scene.settings;
        if exact(&materials) {
            // The reference integrates each point on its own: one in a pixel and surface is enough, coverage
            // gets its samples.
            settings = Settings { inner: 1, share: true, ..settings };
        }
        let start = Instant::now();
        let (film, backend) = renderer.film(&stage, &materials, &settings, self)?;
        let seconds = start.elapsed().as_secs_f64();
        let ev = scene.exposure.unwrap_or_else(|| auto_exposure(&film));
        let develop = Develop { ev, mapper: scene.tone_mapper };
        Ok(Picture { film, develop, materials, backend, seconds, variance: None })
    }

    /// The picture by paths.
    fn traced(&self, scene: &Scene, camera: Camera) -> Result<Picture, Error> {
        let start = Instant::now();
        let background = background(scene, &camera);
        let traced = self.trace(scene, camera, &background, scene.settings, self.paths)?;
        let ev = scene.exposure.unwrap_or_else(|| auto_exposure(&traced.film));
        let materials = scene.materials.iter().map(|m| Prepared::by_paths(m, traced.certificate())).collect();
        Ok(Picture {
            develop: Develop { ev, mapper: scene.tone_mapper },
            materials,
            backend: Renderer::Cpu.name(),
            seconds: start.elapsed().as_secs_f64(),
            variance: Some(traced.variance),
            film: traced.film,
        })
    }
}

/// Does the path tracer shade the scene?
fn by_paths(scene: &Scene) -> Result<bool, Error> {
    let path = |m: &crate::Material| matches!(m.method, Some(Method::Path));
    match scene.materials.iter().filter(|m| path(m)).count() {
        0 => Ok(false),
        n if n == scene.materials.len() => Ok(true),
        _ => Err(Error::usage("path shades all materials of a scene, or none")),
    }
}

/// Does the reference shade any of them?
fn exact(materials: &[Prepared]) -> bool {
    materials.iter().any(|m| matches!(m.method, Method::Reference))
}

/// A camera moved by `angle` around its target, about its up axis.
fn turned(camera: Camera, angle: f32) -> Camera {
    let around =
        |from: Vec3, at: Vec3, up: Vec3| at + Quat::from_axis_angle(up.normalize(), angle) * (from - at);
    match camera {
        Camera::Pinhole { from, at, up, fov_y } => {
            Camera::Pinhole { from: around(from, at, up), at, up, fov_y }
        }
        Camera::Orthographic { from, at, up, height } => {
            Camera::Orthographic { from: around(from, at, up), at, up, height }
        }
    }
}

/// Automatic exposure: of the surfaces, where there are any.
pub fn auto_exposure(film: &Film) -> f32 {
    let covered = film.alpha.iter().any(|a| *a > 0.0);
    steradian_render::tone::auto_exposure(film, |i| if covered { film.alpha[i] } else { 1.0 })
}

/// Background of the picture, where the camera sees no surface.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Adjust, Material};

    #[test]
    fn cameras_turn_about_what_they_look_at() {
        let (from, at) = (Vec3::new(1.0, 1.0, 3.0), Vec3::new(1.0, 0.0, 1.0));
        let camera = Camera::Pinhole { from, at, up: Vec3::Y, fov_y: 0.5 };
        let Camera::Pinhole { from, .. } = turned(camera, std::f32::consts::FRAC_PI_2) else {
            panic!("a pinhole")
        };
        assert!(from.distance(Vec3::new(3.0, 1.0, 1.0)) < 1e-5, "{from}");
    }

    /// Without a word about shadows it is dark under an object, which stays as bright as in the open; a
    /// technique that knows shadows keeps its own.
    #[test]
    fn an_object_shadows_its_ground() {
        let mut session = Session::new();
        let material = |session: &mut Session, slug: &str| {
            let brdf = session.brdf("lambert:albedo=0.5").expect("a spec");
            Material { method: Some(Method::find(slug).expect("a technique")), ..Material::new(brdf) }
        };
        let mut picture = |shadows: Shadows, slugs: [&str; 2], grounded: bool| {
            session.shadows = shadows;
            let [object, ground] = slugs.map(|slug| material(&mut session, slug));
            let lights = session.light("overcast", &Adjust::default()).expect("a sky");
            let mesh = session.mesh("icosphere").expect("a shape");
            let scene = Scene {
                settings: Settings::new(24, 24),
                ground: grounded.then_some(ground),
                ..Scene::new(mesh, vec![object], lights)
            };
            session.render(&scene).expect("a picture").even_if_missed().0
        };
        let plain = ["diffuse_map"; 2];
        let (with, without) = (picture(Shadows::Auto, plain, true), picture(Shadows::Off, plain, true));
        let share = |a: &Picture, k: usize| a.film.rgb[1][k] / without.film.rgb[1][k];
        let least = (0..24 * 24).map(|k| share(&with, k)).fold(1.0, f32::min);
        assert!(least < 0.2 && share(&with, 23 * 24) > 0.8, "{least} {}", share(&with, 23 * 24));
        let lobes = |p: &Picture| p.materials.iter().map(|m| m.lobe).collect::<Vec<_>>();
        assert_eq!(lobes(&with), [false, true]);
        // In the open, and what knows shadows.
        assert!(!picture(Shadows::Auto, plain, false).materials[0].lobe);
        assert_eq!(lobes(&picture(Shadows::Auto, ["diffuse_map", "ambient"], true)), [false, false]);
        // The reference is as dark, with other directions.
        let exact = picture(Shadows::Auto, ["reference"; 2], true);
        let off = (0..24 * 24).map(|k| (share(&exact, k) - share(&with, k)).abs()).fold(0.0, f32::max);
        assert!(off < 0.15, "{off}");
    }
}
