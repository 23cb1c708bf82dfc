//! Samples to pixels.

use super::target::Target;
use crate::layout::{self, Slot};
use crate::scene::Filter;
use crate::{Gpu, GpuError};

const SHADER: &str = concat!(include_str!("../shaders/camera.wgsl"), include_str!("../shaders/resolve.wgsl"));

const MULTI: &str = include_str!("../shaders/resolve_multi.wgsl");
const SINGLE: &str = include_str!("../shaders/resolve_single.wgsl");

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
    let numbers = format!("const GPU_LARGEST: f32 = {largest};\nconst GPU_REACH: f32 = {reach};\n");
    [numbers.as_str(), if multi { MULTI } else { SINGLE }, SHADER].concat()
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
