//! Occlusion of lights that are shaded exactly, in addition to a technique's data: `light_arriving(p, n, d,
//! distance)` in WGSL returns the unoccluded part, 0 … 1, of the light in unit direction d, `distance` away
//! (3e38 for distant ones), at a point p of unit normal n.

use super::{Buffer, GpuTechnique, Uniform, Value};
use steradian_scene::shadow::{Flat, LightAt};

/// WGSL without occlusion.
pub const OPEN: &str = include_str!("open.wgsl");
const ROWS: &str = include_str!("row.wgsl");
const RAYS: &str = include_str!("rays.wgsl");
const MAPS: &str = include_str!("maps.wgsl");
const VOLUMES: &str = include_str!("volumes.wgsl");

/// Numbers a row.
const ROW: usize = 4;

/// Does it call `light_arriving` for the lights that it shades itself?
pub fn knows_shadows(local: &GpuTechnique) -> bool {
    local.modules.iter().any(|m| m == OPEN)
}

/// `technique` with the occlusion `by` of its exactly shaded lights; rays start `offset` metres off the
/// surface.
pub fn behind(technique: GpuTechnique, by: &Flat, offset: f32) -> GpuTechnique {
    let mut out = technique;
    out.modules.retain(|m| m != OPEN);
    let (module, mut rows, numbers) = match by {
        Flat::Rays { boxes, triangles } => {
            let mut rows = boxes.as_flattened().to_vec();
            rows.extend(triangles.iter().flat_map(|t| {
                let [ax, ay, az, bx, by, bz, cx, cy, cz] = *t;
                [ax, ay, az, 0.0, bx, by, bz, 0.0, cx, cy, cz, 0.0]
            }));
            (RAYS, rows, vec![("shadow_boxes", boxes.len() as f32)])
        }
        Flat::Maps { lights, depths, taps } => {
            let mut rows = lights.as_flattened().to_vec();
            // Infinite depths stay beyond everything.
            rows.extend(depths.iter().map(|d| d.clamp(f32::MIN, f32::MAX)));
            (MAPS, rows, vec![("shadow_lights", lights.len() as f32), ("shadow_taps", *taps as f32)])
        }
        Flat::Volumes(volumes) => {
            let place = |light: LightAt| match light {
                LightAt::Far(d) => d.extend(0.0).to_array(),
                LightAt::Near(p) => p.extend(1.0).to_array(),
            };
            let rows = volumes.lights.iter().flat_map(|v| place(v.light)).collect();
            (VOLUMES, rows, vec![("shadow_lights", volumes.lights.len() as f32)])
        }
    };
    rows.resize(rows.len().next_multiple_of(ROW).max(ROW), 0.0);
    out.modules.extend([ROWS.into(), module.into()]);
    out.buffers.push(Buffer::new("light_shadows", ROW, rows));
    let numbers = numbers.into_iter().chain([("shadow_offset", offset)]);
    out.uniforms.extend(numbers.map(|(name, x)| Uniform { name, value: Value::F32(x) }));
    out
}

/// Has it been put [`behind`] something?
pub fn is_shadowed(technique: &GpuTechnique) -> bool {
    technique.modules.iter().any(|m| m == RAYS || m == MAPS || m == VOLUMES)
}

/// Is it [`behind`] shadow volumes? Then the caller draws them first, and sets the variables `shadow_blocked`
/// (the samples that each light does not reach) and `shadow_samples` (the samples that a point represents).
pub fn is_behind_volumes(technique: &GpuTechnique) -> bool {
    technique.modules.iter().any(|m| m == VOLUMES)
}
