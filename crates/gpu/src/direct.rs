//! Lights that are shaded with the exact reflectance: uniforms and WGSL beside a technique's.
//!
//! Group 2 of every pipeline that shades holds the camera, the lights and the reflectance's parameters; each object
//! has a group of its own. Lights change without touching any pipeline.

use crate::layout::{self, Slot, filled};
use crate::lights::{CAPACITY, both};
use crate::packed::bytes;
use crate::scene::{Object, Scene};
use crate::{Gpu, GpuError};
use glam::Mat3;
use steradian_techniques::direct::Direct;

/// Group 2: camera, lights, reflectance.
pub const SLOTS: [Slot; 3] = [Slot::Uniform, Slot::Uniform, Slot::Uniform];

/// The lights on the device, and group 2 of every object.
pub struct DirectLights {
    /// All lights, and the points among them.
    lights: [wgpu::Buffer; 2],
    groups: Vec<wgpu::BindGroup>,
    /// Group 2 of pipelines that shade no object.
    pub group: wgpu::BindGroup,
}

impl DirectLights {
    /// Uploads the lights of `scene` and the reflectances of its objects. `layout` has [`SLOTS`].
    pub fn new(
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        camera: &wgpu::Buffer,
        scene: &Scene,
    ) -> Result<Self, GpuError> {
        check(&scene.direct)?;
        let contents = both(&scene.direct, scene.light_rotation);
        gpu.scoped("lights", || {
            let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
            let lights = contents.map(|c| filled(gpu, "lights", usage, &c));
            let group = |parameters: &[f32], lights: &wgpu::Buffer| {
                let brdf = filled(gpu, "reflectance", wgpu::BufferUsages::UNIFORM, &bytes(parameters));
                let all = [camera, lights, &brdf].map(wgpu::Buffer::as_entire_binding);
                layout::group(gpu, layout, &all)
            };
            let of = |o: &Object| {
                let parameters = o.brdf.as_ref().map_or(&[0.0; 4][..], |b| b.uniforms().as_flattened());
                group(parameters, &lights[usize::from(o.folds_suns)])
            };
            let groups = scene.objects.iter().map(of).collect();
            Self { groups, group: group(&[0.0; 4], &lights[0]), lights }
        })
    }

    /// Group 2 of an object.
    pub fn group_of(&self, object: usize) -> &wgpu::BindGroup {
        self.groups.get(object).unwrap_or(&self.group)
    }

    /// Other lights, or the same ones turned.
    pub fn write(&self, gpu: &Gpu, direct: &Direct, rotation: Mat3) {
        for (buffer, contents) in self.lights.iter().zip(both(direct, rotation)) {
            gpu.queue.write_buffer(buffer, 0, &contents);
        }
    }
}

/// Are the lights few enough?
pub fn check(direct: &Direct) -> Result<(), GpuError> {
    let count = direct.disks.len() + direct.directionals.len() + direct.points.len();
    if count > CAPACITY {
        return Err(GpuError::Memory(format!("{count} direct lights; {CAPACITY} at most")));
    }
    Ok(())
}
