//! Samples to pixels.

use super::target::Target;
use crate::layout::{self, Slot};
use crate::scene::Filter;
use crate::{Gpu, GpuError};

const SHADER: &str = concat!(include_str!("../shaders/camera.wgsl"), include_str!("../shaders/resolve.wgsl"));

/// The standard positions of four samples (the same in Vulkan, Direct3D and Metal).
const STANDARD: &str =
    "vec2<f32>(0.375, 0.125), vec2<f32>(0.875, 0.375), vec2<f32>(0.125, 0.625), vec2<f32>(0.625, 0.875)";

/// The pass that makes pixels of samples.
pub struct Resolve {
    pub pipeline: wgpu::ComputePipeline,
    pub group: wgpu::BindGroup,
}

/// The shader for a target with `multi` samples a texel or one, in `format`.
pub fn source(multi: bool, format: wgpu::TextureFormat, filter: Filter) -> String {
    let reach = match filter {
        Filter::Spline => "1.25",
        Filter::Mean => "0.5",
    };
    let largest = if format == wgpu::TextureFormat::Rgba16Float { "65504.0" } else { "3.4028234e38" };
    let [kind, load, samples, positions] = if multi {
        ["texture_multisampled_2d<f32>", "textureLoad(gpu_source, vec2<i32>(x, y), k)", "4", STANDARD]
    } else {
        ["texture_2d<f32>", "textureLoad(gpu_source, vec2<i32>(x, y), 0)", "1", "vec2<f32>(0.5, 0.5)"]
    };
    let code: String =
        SHADER.lines().filter(|l| !l.trim_start().starts_with("//")).map(|l| l.to_owned() + "\n").collect();
    code.replace("SOURCE", kind)
        .replace("LOAD", load)
        .replace("SAMPLES", samples)
        .replace("POSITIONS", positions)
        .replace("= REACH", &format!("= {reach}"))
        .replace("= LARGEST", &format!("= {largest}"))
}

impl Resolve {
    /// The pass for `target`.
    pub fn new(gpu: &Gpu, camera: &wgpu::BindGroupLayout, target: &Target) -> Result<Self, GpuError> {
        let multi = target.samples() > 1;
        gpu.scoped("resolve", || {
            let first = if multi { Slot::Multisampled } else { Slot::Texture };
            let layout = layout::layout(gpu, wgpu::ShaderStages::COMPUTE, &[first, Slot::Write, Slot::Write]);
            let group = layout::group(
                gpu,
                &layout,
                &[
                    wgpu::BindingResource::TextureView(&target.colour),
                    target.film.as_entire_binding(),
                    target.clipped.as_entire_binding(),
                ],
            );
            let text = source(multi, target.format, target.settings.filter);
            let pipeline = layout::compute(gpu, &text, "gpu_resolve", &[Some(&layout), None, Some(camera)]);
            Self { pipeline, group }
        })
    }
}
