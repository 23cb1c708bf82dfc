//! Lights that are shaded with the exact reflectance: uniforms and WGSL in addition to a technique's.
//!
//! Group 2 of every pipeline that shades holds the camera, the lights and the reflectance's parameters; each
//! object has a group of its own. Lights change without touching any pipeline.

use crate::layout::{self, Slot, filled};
use crate::lights::{CAPACITY, both};
use crate::packed::bytes;
use crate::scene::{Object, Scene};
use crate::technique::{check_table, upload_table};
use crate::{Gpu, GpuError};
use glam::Mat3;
use steradian_technique::direct::Direct;
use steradian_technique::gpu::{Table, cells};

/// Group 2: camera, lights, reflectance, measured data of the reflectance.
pub const SLOTS: [Slot; 4] = [Slot::Uniform, Slot::Uniform, Slot::Uniform, Slot::Texture];
/// Group 2 with the masks of shadow volumes.
pub const SHADOWED_SLOTS: [Slot; 5] =
    [Slot::Uniform, Slot::Uniform, Slot::Uniform, Slot::Texture, Slot::Read];

/// The lights on the device, and group 2 of every object.
pub struct DirectLights {
    /// All lights, and the points among them.
    lights: [wgpu::Buffer; 2],
    groups: Vec<wgpu::BindGroup>,
    /// Group 2 of pipelines that shade no object.
    pub group: wgpu::BindGroup,
}

impl DirectLights {
    /// Uploads the lights of `scene` and the reflectances of its objects. `layout` has [`SLOTS`], or, with
    /// `masks`, [`SHADOWED_SLOTS`].
    pub fn new(
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        camera: &wgpu::Buffer,
        masks: Option<&wgpu::Buffer>,
        scene: &Scene,
    ) -> Result<Self, GpuError> {
        check(&scene.direct)?;
        let measured = |o: &Object| o.brdf.as_ref().and_then(|b| b.cells()).map(|c| cells("brdf", c));
        let measured: Vec<Option<Table>> = scene.objects.iter().map(measured).collect();
        for table in measured.iter().flatten() {
            check_table(gpu, "a measured reflectance", table)?;
        }
        let contents = both(&scene.direct, scene.light_rotation);
        gpu.scoped("lights", || {
            let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
            let lights = contents.map(|c| filled(gpu, "lights", usage, &c));
            let none = cells("brdf", &[[0.0; 3]]);
            let group = |parameters: &[f32], lights: &wgpu::Buffer, measured: &Table| {
                let brdf = filled(gpu, "reflectance", wgpu::BufferUsages::UNIFORM, &bytes(parameters));
                let [camera, lights, brdf] = [camera, lights, &brdf].map(wgpu::Buffer::as_entire_binding);
                let cells = upload_table(gpu, measured).create_view(&wgpu::TextureViewDescriptor::default());
                let cells = wgpu::BindingResource::TextureView(&cells);
                let masks = masks.map(wgpu::Buffer::as_entire_binding);
                let all: Vec<_> = [camera, lights, brdf, cells].into_iter().chain(masks).collect();
                layout::group(gpu, layout, &all)
            };
            let of = |(o, measured): (&Object, &Option<Table>)| {
                let parameters = o.brdf.as_ref().map_or(&[0.0; 4][..], |b| b.uniforms().as_flattened());
                group(parameters, &lights[usize::from(o.folds_suns)], measured.as_ref().unwrap_or(&none))
            };
            let groups = scene.objects.iter().zip(&measured).map(of).collect();
            Self { groups, group: group(&[0.0; 4], &lights[0], &none), lights }
        })
    }

    /// Group 2 of an object.
    pub fn group_of(&self, object: usize) -> &wgpu::BindGroup {
        self.groups.get(object).unwrap_or(&self.group)
    }

    /// Writes other lights, or the same lights rotated.
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
