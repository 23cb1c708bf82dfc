//! Lights that are shaded with the exact reflectance, as text and as bytes.

use crate::packed::bytes;
use crate::scene::Object;
use glam::Mat3;
use std::borrow::Cow;
use steradian_technique::View;
use steradian_technique::direct::{DISK_WGSL, Direct, rule};
use steradian_technique::gpu::shadow::is_shadowed;

/// Most lights.
pub const CAPACITY: usize = 64;

const SHADER: &str = include_str!("shaders/direct.wgsl");
const OPEN: &str = include_str!("shaders/direct_open.wgsl");
const SHADOWED: &str = include_str!("shaders/direct_shadowed.wgsl");

/// WGSL that reads a measured reflectance: cells in rows of [`steradian_technique::gpu::ROW`] texels.
const CELLS: &str = include_str!("shaders/cells.wgsl");

/// WGSL of a surface without exactly shaded lights.
pub const NONE: &str = "
fn gpu_direct(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(0.0);
}
";

/// The modules that define `gpu_direct`.
pub fn modules(object: &Object) -> Vec<Cow<'static, str>> {
    match &object.brdf {
        Some(brdf) => {
            let arriving = if is_shadowed(&object.technique) { SHADOWED } else { OPEN };
            let capacity = format!("const GPU_CAPACITY: u32 = {CAPACITY}u;\n");
            let cells = if brdf.cells().is_some() { CELLS } else { "" };
            let rest = [DISK_WGSL.into(), capacity.into(), SHADER.into(), arriving.into(), cells.into()];
            brdf.modules().into_iter().chain(rest).collect()
        }
        None => vec![NONE.into()],
    }
}

/// `struct GpuLights` of all lights, and of the points alone.
pub fn both(direct: &Direct, rotation: Mat3) -> [Vec<u8>; 2] {
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
