//! A sky that moves: a GPU filters it anew while the picture is drawn, until a bake takes over.

use super::Live;
use crate::gpu_scene::{backdrop, has_suns, technique};
use crate::picture::background;
use crate::{Error, Scene};
use glam::Mat3;
use steradian_gpu::refilter::{Budget, Follower, Surroundings};
use steradian_gpu::{Gpu, GpuError, Renderer};
use steradian_light::Lights;
use steradian_render::Settings;
use steradian_scene::Camera;
use steradian_techniques::gpu::LightTables;

/// Size of the image of a moving sky; its sun is a separate disk.
const SKY_SIZE: (usize, usize) = (256, 128);

/// A moving sky as a GPU has it.
#[derive(Clone)]
pub struct MovingSky {
    lights: Lights,
    surroundings: Surroundings,
}

impl MovingSky {
    /// The sky of a spec ([`steradian_light::sky`]).
    pub fn new(gpu: &Gpu, spec: &str) -> Result<Self, Error> {
        let lights = Lights::of_sky(spec, SKY_SIZE).map_err(Error::usage)?;
        let surroundings = Surroundings::from_lights(gpu, &lights)?;
        Ok(Self { lights, surroundings })
    }
}

/// Filters by which the objects of a [`Live`]'s renderer follow a [`MovingSky`].
pub struct Following(Vec<Follower>);

impl Following {
    /// Makes the refilters of all objects of `live`, as its renderer has them; fails where
    /// [`Live::light_tables`] does.
    pub fn new(gpu: &Gpu, live: &Live) -> Result<Self, Error> {
        let tables = live.light_tables().map_err(Error::usage)?;
        let of = |(object, tables): (usize, LightTables)| {
            let prepared = &live.materials[object];
            let technique = technique(prepared).ok_or_else(|| Error::failed("a material without a bake"))?;
            Ok(Follower::new(gpu, &technique, &tables)?)
        };
        live.used().into_iter().zip(tables).map(of).collect::<Result<_, _>>().map(Self)
    }

    /// Shows `sky` behind the objects, and lets them follow it.
    pub fn set_sky(
        &mut self,
        gpu: &Gpu,
        renderer: &mut Renderer,
        live: &Live,
        sky: &MovingSky,
        (camera, height): (Camera, usize),
    ) -> Result<(), GpuError> {
        renderer.set_backdrop(gpu, live.backdrop_of(&sky.lights, camera, height))?;
        self.0.iter_mut().for_each(|f| f.set_light(&sky.surroundings));
        Ok(())
    }

    /// Is there work left?
    pub fn is_busy(&self) -> bool {
        self.0.iter().any(Follower::is_busy)
    }

    /// Filters for about so many milliseconds of the device; `true` where an object got new light. `rotation`
    /// turns the light.
    pub fn step(
        &mut self,
        gpu: &Gpu,
        renderer: &Renderer,
        milliseconds: f64,
        rotation: Mat3,
    ) -> Result<bool, GpuError> {
        let busy = self.0.iter().filter(|f| f.is_busy()).count().max(1);
        let budget = Budget::Milliseconds(milliseconds / busy as f64);
        let mut new = false;
        for (object, follower) in self.0.iter_mut().enumerate() {
            new |= follower.step(gpu, budget, renderer.technique(object)?, rotation)?;
        }
        Ok(new)
    }

    /// Rotates the filtered light in the objects' uniforms; to be called after these were written for another
    /// view.
    pub fn turn(&self, gpu: &Gpu, renderer: &Renderer, rotation: Mat3) -> Result<(), GpuError> {
        let mut all = self.0.iter().enumerate();
        all.try_for_each(|(object, f)| f.turn(gpu, renderer.technique(object)?, rotation))
    }
}

impl Live {
    /// Data of each object of [`Live::gpu`] that are filtered light; fails with a message where other data
    /// depend on the light too.
    pub fn light_tables(&self) -> Result<Vec<LightTables>, String> {
        let of = |k: usize| {
            let p = &self.materials[k];
            match p.light_tables() {
                Some(t) if !has_suns(&p.direct.1) => Ok(t),
                _ => Err(format!("{} is not refiltered", p.method.slug())),
            }
        };
        self.used().into_iter().map(of).collect()
    }

    /// The name that its lights have.
    pub fn light_name(&self) -> &str {
        &self.names.light
    }

    /// Background of the objects under other lights.
    fn backdrop_of(&self, lights: &Lights, camera: Camera, height: usize) -> steradian_gpu::scene::Backdrop {
        let settings = Settings { height, ..self.scene.settings };
        let scene = Scene { settings, lights: lights.clone(), ..self.without_mesh() };
        backdrop(&background(&scene, &camera))
    }
}
