//! The off-screen renderer: the picture that the CPU renderer makes, by rasterisation.
//!
//! Two paths shade: the raster path in the fragment shader with four coverage samples a pixel, the compute
//! path from a visibility buffer. Samples are kept in a linear float target and become pixels through the CPU
//! renderer's filter, in a compute pass. Tone mapping is the caller's.

mod backdrop;
mod camera;
pub(crate) mod clock;
mod jobs;
mod object;
mod passes;
mod resolve;
mod target;
mod volumes;

#[cfg(test)]
mod tests;

use crate::direct::{self, DirectLights};
use crate::layout::filled;
use crate::scene::{Backdrop, Picture, Scene, Settings, Timings};
use crate::{Gpu, GpuError, TechniqueData};
use backdrop::Behind;
use clock::Clock;
use glam::{Affine3A, Mat3};
use jobs::Jobs;
use object::Placed;
use passes::{Passes, Pipeline};
use resolve::Resolve;
use steradian_scene::Camera;
use steradian_technique::GpuTechnique;
use steradian_technique::direct::Direct;
use steradian_technique::gpu::Uniform;
use target::Target;
use volumes::Volumes;

/// A scene on the device, ready for one frame after another.
pub struct Renderer {
    scene: Scene,
    target: Target,
    passes: Passes,
    objects: Vec<(Placed, Pipeline)>,
    behind: Behind,
    sky: Pipeline,
    visibility: Option<wgpu::RenderPipeline>,
    resolve: Resolve,
    camera: wgpu::Buffer,
    direct: DirectLights,
    volumes: Option<Volumes>,
    jobs: Option<Jobs>,
    clock: Clock,
}

impl Renderer {
    /// Uploads `scene` and makes its pipelines.
    pub fn new(gpu: &Gpu, scene: Scene, settings: &Settings) -> Result<Self, GpuError> {
        let target = Target::new(gpu, settings)?;
        let masks = volumes::masks(gpu, &scene, &target)?;
        let mut passes = Passes::new(gpu, &target, masks.is_some())?;
        let mut objects = Vec::new();
        let mut first = 0;
        for o in &scene.objects {
            let placed = Placed::new(gpu, &passes.object, o, first)?;
            first += placed.vertices / 3;
            let pipeline = passes.shading(gpu, &placed.program, &placed.technique.layout, &target)?;
            objects.push((placed, pipeline));
        }
        let behind = Behind::new(gpu, &scene.backdrop)?;
        let sky = passes.backdrop(gpu, &behind.layout, &target)?;
        let visibility = target.ids.as_ref().map(|_| passes.visibility(gpu, &target)).transpose()?;
        let resolve = Resolve::new(gpu, &passes.camera, &target)?;
        let jobs = target.ids.as_ref().map(|ids| {
            let triangles: Vec<u32> = objects.iter().map(|(o, _)| o.vertices / 3).collect();
            Jobs::new(gpu, &passes.io, &target, ids, &triangles)
        });
        let jobs = jobs.transpose()?;
        let camera = gpu.scoped("camera", || {
            let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
            filled(gpu, "camera", usage, &camera::uniforms(&scene, settings))
        })?;
        let direct = DirectLights::new(gpu, &passes.camera, &camera, masks.as_ref(), &scene)?;
        let volumes = match (&scene.volumes, &masks) {
            (Some(drawn), Some(masks)) => Some(Volumes::new(gpu, &passes, &target, drawn, masks)?),
            _ => None,
        };
        let clock = gpu.scoped("clock", || Clock::new(gpu))?;
        Ok(Self {
            scene,
            target,
            passes,
            objects,
            behind,
            sky,
            visibility,
            resolve,
            camera,
            direct,
            volumes,
            jobs,
            clock,
        })
    }

    /// The data of an object's technique on the device.
    pub fn technique(&self, object: usize) -> Result<&TechniqueData, GpuError> {
        self.objects.get(object).map(|(placed, ..)| &placed.technique).ok_or_else(|| no_object(object))
    }

    /// The camera.
    pub fn camera(&self) -> Camera {
        self.scene.camera
    }

    /// The picture on the device, four f32 a pixel, and its width and height.
    pub(crate) fn film(&self) -> (&wgpu::Buffer, [usize; 2]) {
        (&self.target.film, [self.target.settings.width, self.target.settings.height])
    }

    /// Moves the camera.
    pub fn set_camera(&mut self, gpu: &Gpu, camera: Camera) {
        self.scene.camera = camera;
        self.write_camera(gpu);
    }

    /// Replaces the lights that are shaded with the exact reflectance.
    pub fn set_direct(&mut self, gpu: &Gpu, direct: Direct) -> Result<(), GpuError> {
        direct::check(&direct)?;
        self.direct.write(gpu, &direct, self.scene.light_rotation);
        self.scene.direct = direct;
        gpu.settled()
    }

    /// Turns the backdrop and distant direct lights; the techniques' light turns with
    /// [`Renderer::update_technique`].
    pub fn set_light_rotation(&mut self, gpu: &Gpu, rotation: Mat3) {
        self.scene.light_rotation = rotation;
        self.direct.write(gpu, &self.scene.direct, rotation);
        self.write_camera(gpu);
    }

    fn write_camera(&self, gpu: &Gpu) {
        gpu.queue.write_buffer(&self.camera, 0, &camera::uniforms(&self.scene, &self.target.settings));
    }

    /// Replaces the backdrop.
    pub fn set_backdrop(&mut self, gpu: &Gpu, backdrop: Backdrop) -> Result<(), GpuError> {
        self.behind = Behind::new(gpu, &backdrop)?;
        self.scene.backdrop = backdrop;
        Ok(())
    }

    /// Moves an object.
    pub fn set_transform(&mut self, gpu: &Gpu, object: usize, transform: Affine3A) -> Result<(), GpuError> {
        let (placed, _) = self.objects.get(object).ok_or_else(|| no_object(object))?;
        placed.set_transform(gpu, &transform);
        self.scene.objects[object].transform = transform;
        self.write_camera(gpu);
        Ok(())
    }

    /// Writes the uniforms of `technique` (turned light, moved view); its tables stay.
    pub fn update_technique(
        &mut self,
        gpu: &Gpu,
        object: usize,
        technique: &GpuTechnique,
    ) -> Result<(), GpuError> {
        self.update_uniforms(gpu, object, &technique.uniforms)
    }

    /// Replaces uniforms of a technique by those of the same names, from
    /// [`steradian_technique::AnyBake::gpu_frame`] for a rotated light or a moved view.
    pub fn update_uniforms(&mut self, gpu: &Gpu, object: usize, new: &[Uniform]) -> Result<(), GpuError> {
        let (placed, _) = self.objects.get(object).ok_or_else(|| no_object(object))?;
        let technique = &mut self.scene.objects[object].technique;
        technique.set_uniforms(new);
        placed.technique.update_uniforms(gpu, technique);
        gpu.settled()
    }

    /// Replaces an object's technique, after its light, its material or its technique has changed. Pipelines
    /// stay where the technique's text does.
    pub fn set_technique(
        &mut self,
        gpu: &Gpu,
        object: usize,
        technique: GpuTechnique,
    ) -> Result<(), GpuError> {
        let (placed, pipeline) = self.objects.get_mut(object).ok_or_else(|| no_object(object))?;
        let o = &mut self.scene.objects[object];
        let old = std::mem::replace(&mut o.technique, technique);
        if placed.set_technique(gpu, &old, o)? {
            *pipeline = self.passes.shading(gpu, &placed.program, &placed.technique.layout, &self.target)?;
        }
        Ok(())
    }

    /// Draws a frame, waits for it, and reads it back.
    pub fn render(&mut self, gpu: &Gpu) -> Result<(Picture, Timings), GpuError> {
        let timings = self.frame(gpu, true)?;
        let size = target::pixels(&self.target.settings);
        let bytes = gpu.read(&self.target.copy, size + 4)?;
        Ok((self.picture(&bytes), timings))
    }

    /// Draws a frame, waits for it, and leaves it on the device.
    pub fn draw(&mut self, gpu: &Gpu) -> Result<Timings, GpuError> {
        self.frame(gpu, false)
    }

    fn frame(&mut self, gpu: &Gpu, read: bool) -> Result<Timings, GpuError> {
        if let Some(volumes) = &self.volumes {
            volumes.check(&self.scene.camera)?;
        }
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let commands = gpu.scoped("frame", || {
            self.clock.restart();
            encoder.clear_buffer(&self.target.clipped, 0, None);
            // Volumes need the depths of all that is shaded after them.
            if self.visibility.is_some() {
                self.raster(&mut encoder);
                self.shadow(&mut encoder);
            } else {
                self.shadow(&mut encoder);
                self.raster(&mut encoder);
            }
            self.compute(&mut encoder);
            if read {
                let size = target::pixels(&self.target.settings);
                encoder.copy_buffer_to_buffer(&self.target.film, 0, &self.target.copy, 0, size);
                encoder.copy_buffer_to_buffer(&self.target.clipped, 0, &self.target.copy, size, 4);
            }
            self.clock.collect(&mut encoder);
            gpu.queue.submit([encoder.finish()]);
        });
        commands?;
        gpu.wait()?;
        self.clock.read(gpu)
    }

    /// Draws the shadow volumes, if there are any.
    fn shadow(&mut self, encoder: &mut wgpu::CommandEncoder) {
        if let Some(volumes) = &self.volumes {
            let (target, camera) = (&self.target, &self.scene.camera);
            volumes.encode(encoder, &mut self.clock, target, &self.direct, camera, &self.objects);
        }
    }

    /// The raster pass: shaded objects and the backdrop, or triangle ids.
    fn raster(&mut self, encoder: &mut wgpu::CommandEncoder) {
        let name = if self.visibility.is_some() { "visibility" } else { "raster" };
        let ops = wgpu::Operations {
            load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
            store: wgpu::StoreOp::Store,
        };
        let keep = self.visibility.is_some() && self.volumes.is_some();
        let store = if keep { wgpu::StoreOp::Store } else { wgpu::StoreOp::Discard };
        let depth = wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store };
        let view = self.target.ids.as_ref().unwrap_or(&self.target.colour);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(name),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops,
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.target.depth,
                depth_ops: Some(depth),
                stencil_ops: None,
            }),
            timestamp_writes: self.clock.raster(name),
            ..Default::default()
        });
        for (k, (placed, pipeline)) in self.objects.iter().enumerate() {
            pass.set_bind_group(2, self.direct.group_of(k), &[]);
            match (pipeline, &self.visibility) {
                (_, Some(visibility)) => pass.set_pipeline(visibility),
                (Pipeline::Raster(shading), None) => {
                    pass.set_pipeline(shading);
                    pass.set_bind_group(0, &placed.technique.group, &[]);
                }
                (Pipeline::Compute(_), None) => continue,
            }
            pass.set_bind_group(1, &placed.group, &[]);
            pass.draw(0..placed.vertices, 0..1);
        }
        if let Pipeline::Raster(sky) = &self.sky {
            pass.set_pipeline(sky);
            pass.set_bind_group(2, &self.direct.group, &[]);
            pass.set_bind_group(0, &self.behind.group, &[]);
            pass.draw(0..3, 0..1);
        }
    }

    /// Compute shading, where that is the path, and the resolve.
    fn compute(&mut self, encoder: &mut wgpu::CommandEncoder) {
        let s = &self.target.settings;
        let groups = [s.width, s.height].map(|n| (n as u32).div_ceil(8));
        if let Some(jobs) = &self.jobs {
            jobs.clear(encoder);
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("shading"),
                timestamp_writes: self.clock.compute("shading"),
            });
            pass.set_bind_group(2, &self.direct.group, &[]);
            for (k, (placed, pipeline)) in self.objects.iter().enumerate() {
                if let Pipeline::Compute(shading) = pipeline {
                    let groups =
                        [(0, &placed.technique.group), (1, &placed.group), (2, self.direct.group_of(k))];
                    jobs.shade(&mut pass, k, shading, groups);
                }
            }
            if let Pipeline::Compute(sky) = &self.sky {
                let groups = [(0, &self.behind.group), (2, &self.direct.group)];
                jobs.shade(&mut pass, self.objects.len(), sky, groups);
            }
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("resolve"),
            timestamp_writes: self.clock.compute("resolve"),
        });
        pass.set_pipeline(&self.resolve.pipeline);
        pass.set_bind_group(0, &self.resolve.group, &[]);
        pass.set_bind_group(2, &self.direct.group, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], 1);
    }

    fn picture(&self, bytes: &[u8]) -> Picture {
        let s = &self.target.settings;
        let n = s.width * s.height;
        let words: Vec<[u8; 4]> = bytes.as_chunks::<4>().0.to_vec();
        let plane =
            |c: usize| words.iter().take(4 * n).skip(c).step_by(4).map(|b| f32::from_le_bytes(*b)).collect();
        Picture {
            width: s.width,
            height: s.height,
            rgb: [plane(0), plane(1), plane(2)],
            alpha: plane(3),
            clipped: words.get(4 * n).map_or(0, |b| u32::from_le_bytes(*b)),
        }
    }
}

fn no_object(object: usize) -> GpuError {
    GpuError::Scene(format!("there is no object {object}"))
}
