//! Lights that are shaded with the exact reflectance: uniforms and WGSL beside a technique's.
//!
//! Group 2 of every pipeline that shades holds the camera, the lights and the reflectance's parameters; each object
//! has a group of its own. Lights change without touching any pipeline.

use crate::layout::{self, Slot, bytes, filled};
use crate::scene::{Object, Scene};
use crate::{Gpu, GpuError};
use glam::Mat3;
use steradian_techniques::View;
use steradian_techniques::direct::{DISK_WGSL, Direct, rule};

/// Lights at most.
pub const CAPACITY: usize = 64;

/// Group 2: camera, lights, reflectance.
pub const SLOTS: [Slot; 3] = [Slot::Uniform, Slot::Uniform, Slot::Uniform];

const SHADER: &str = include_str!("shaders/direct.wgsl");

/// What a surface without a reflectance of its own adds.
pub const NONE: &str = "
fn gpu_direct(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(0.0);
}
";

/// The text that defines `gpu_direct`.
pub fn source(object: &Object) -> String {
    match &object.brdf {
        Some(brdf) => brdf.wgsl() + DISK_WGSL + &format!("const GPU_CAPACITY: u32 = {CAPACITY}u;\n") + SHADER,
        None => NONE.into(),
    }
}

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

/// `struct GpuLights` of all lights, and of the points alone.
fn both(direct: &Direct, rotation: Mat3) -> [Vec<u8>; 2] {
    let points = Direct { points: direct.points.clone(), ..Direct::default() };
    [contents(direct, rotation), contents(&points, rotation)]
}

/// `struct GpuLights`.
fn contents(direct: &Direct, light_rotation: Mat3) -> Vec<u8> {
    let turned = direct.turned(&View { light_rotation, ..View::default() });
    let single = |v: [f64; 3]| v.map(|x| x as f32);
    let light = |place: [f32; 3], w: f32, [r, g, b]: [f32; 3], point: f32| {
        [place[0], place[1], place[2], w, r, g, b, point]
    };
    let mut lights: Vec<[f32; 8]> = Vec::new();
    for d in &turned.disks {
        let direction = single(d.direction.to_array());
        lights.push(light(direction, d.angular_radius as f32, single(d.radiance), 0.0));
    }
    for d in &turned.directionals {
        lights.push(light(single(d.direction.to_array()), 0.0, single(d.irradiance), 0.0));
    }
    lights.extend(turned.points.iter().map(|p| light(p.position.to_array(), 0.0, p.intensity, 1.0)));
    lights.truncate(CAPACITY);
    let mut out: Vec<u8> = [lights.len() as u32, 0, 0, 0].into_iter().flat_map(u32::to_le_bytes).collect();
    let gauss: Vec<f32> = rule::gauss().flat_map(|(x, w)| [x as f32, w as f32, 0.0, 0.0]).collect();
    out.extend(bytes(&gauss));
    lights.resize(CAPACITY, [0.0; 8]);
    out.extend(bytes(lights.as_flattened()));
    out
}
