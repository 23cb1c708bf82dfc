//! Shader texts and the pipelines of the two paths.

use super::target::Target;
use crate::direct;
use crate::layout::{self, Slot};
use crate::program::{self, BACKDROP, CAMERA, GEOMETRY, Program, surface, varying};
use crate::scene::{Rate, Settings};
use crate::{Gpu, GpuError};
use std::collections::HashMap;

const BUFFERS: &str = include_str!("../shaders/geometry_buffers.wgsl");
const RASTER: &str = include_str!("../shaders/raster.wgsl");
const RASTER_PIXEL: &str = include_str!("../shaders/raster_pixel.wgsl");
const RASTER_SAMPLE: &str = include_str!("../shaders/raster_sample.wgsl");
const VISIBILITY: &str = include_str!("../shaders/visibility.wgsl");
const MASKS: &str = include_str!("../shaders/shadow_masks.wgsl");
const NO_MASKS: &str = include_str!("../shaders/shadow_masks_none.wgsl");
const HEAD: &str = include_str!("../shaders/head.wgsl");
const LIST: &str = include_str!("../shaders/list.wgsl");
const COMPUTE: &str = include_str!("../shaders/compute.wgsl");
const COMPUTE_OBJECT: &str = include_str!("../shaders/compute_object.wgsl");
const BACKDROP_BUFFERS: &str = include_str!("../shaders/backdrop_buffers.wgsl");
const BACKDROP_RASTER: &str = include_str!("../shaders/backdrop_raster.wgsl");
const BACKDROP_COMPUTE: &str = include_str!("../shaders/backdrop_compute.wgsl");

/// Is a triangle shaded once in a pixel, or at each of its samples?
fn share(rate: Rate) -> String {
    format!("const GPU_SHARE: bool = {};\n", rate == Rate::Pixel)
}

/// WGSL that reads the masks of shadow volumes.
fn masks(program: &Program) -> &'static str {
    if program.volumes { MASKS } else { NO_MASKS }
}

/// The raster path's module.
pub fn raster_source(program: &Program, settings: &Settings) -> String {
    let (place, entry) = match settings.rate {
        Rate::Pixel => ("center", RASTER_PIXEL),
        Rate::Sample => ("sample", RASTER_SAMPLE),
    };
    let share = share(settings.rate);
    let vertex = program::RASTER_VERTEX;
    [&surface(program), BUFFERS, &varying(place), vertex, &share, masks(program), RASTER, entry].concat()
}

/// The compute path's module.
pub fn compute_source(program: &Program, format: wgpu::TextureFormat) -> String {
    [&surface(program), BUFFERS, &compute_io(format), masks(program), COMPUTE_OBJECT].concat()
}

/// The visibility pass.
pub fn visibility_source() -> String {
    [CAMERA, GEOMETRY, BUFFERS, VISIBILITY].concat()
}

/// The backdrop of the raster path.
pub fn backdrop_source() -> String {
    [CAMERA, BACKDROP, BACKDROP_BUFFERS, BACKDROP_RASTER].concat()
}

/// The backdrop of the compute path.
pub fn backdrop_compute_source(format: wgpu::TextureFormat) -> String {
    [CAMERA, BACKDROP, BACKDROP_BUFFERS, &compute_io(format), BACKDROP_COMPUTE].concat()
}

/// The pass that lists the samples to shade.
pub fn list_source(rate: Rate) -> String {
    ["alias GpuCounter = atomic<u32>;\n", HEAD, &share(rate), LIST].concat()
}

fn compute_io(format: wgpu::TextureFormat) -> String {
    let name = if format == wgpu::TextureFormat::Rgba16Float { "rgba16float" } else { "rgba32float" };
    let target = format!("alias GpuTarget = texture_storage_2d<{name}, write>;\n");
    ["alias GpuCounter = u32;\n", HEAD, &target, COMPUTE].concat()
}

/// Pipeline that shades an object.
#[derive(Clone)]
pub enum Pipeline {
    Raster(wgpu::RenderPipeline),
    Compute(wgpu::ComputePipeline),
}

/// Layouts, and pipelines by their programs.
pub struct Passes {
    pub camera: wgpu::BindGroupLayout,
    pub object: wgpu::BindGroupLayout,
    pub io: wgpu::BindGroupLayout,
    made: HashMap<Program, Pipeline>,
}

impl Passes {
    /// Layouts for `target`, with shadow volumes or without.
    pub fn new(gpu: &Gpu, target: &Target, volumes: bool) -> Result<Self, GpuError> {
        let camera: &[Slot] = if volumes { &direct::SHADOWED_SLOTS } else { &direct::SLOTS };
        gpu.scoped("layouts", || Self {
            camera: layout::layout(gpu, super::object::STAGES, camera),
            object: layout::layout(gpu, super::object::STAGES, &super::object::SLOTS),
            io: layout::layout(
                gpu,
                wgpu::ShaderStages::COMPUTE,
                &[Slot::Ids, Slot::Read, Slot::Read, Slot::Storage(target.format)],
            ),
            made: HashMap::new(),
        })
    }

    /// The pipeline of a program.
    pub fn shading(
        &mut self,
        gpu: &Gpu,
        program: &Program,
        technique: &wgpu::BindGroupLayout,
        target: &Target,
    ) -> Result<Pipeline, GpuError> {
        if let Some(p) = self.made.get(program) {
            return Ok(p.clone());
        }
        let groups = [Some(technique), Some(&self.object), Some(&self.camera), Some(&self.io)];
        let made = gpu.scoped("shader of a technique", || match target.ids {
            None => {
                let entries = ["gpu_vertex", "gpu_fragment"];
                let source = raster_source(program, &target.settings);
                Pipeline::Raster(layout::raster(gpu, &source, entries, &groups[..3], target.drawn(true)))
            }
            Some(_) => {
                let source = compute_source(program, target.format);
                Pipeline::Compute(layout::compute(gpu, &source, "gpu_shade", &groups))
            }
        })?;
        self.made.insert(program.clone(), made.clone());
        Ok(made)
    }

    /// The visibility pass.
    pub fn visibility(&self, gpu: &Gpu, target: &Target) -> Result<wgpu::RenderPipeline, GpuError> {
        let groups = [None, Some(&self.object), Some(&self.camera)];
        let entries = ["gpu_seen_vertex", "gpu_seen_fragment"];
        gpu.scoped("visibility", || {
            layout::raster(gpu, &visibility_source(), entries, &groups, target.drawn(true))
        })
    }

    /// The backdrop.
    pub fn backdrop(
        &self,
        gpu: &Gpu,
        behind: &wgpu::BindGroupLayout,
        target: &Target,
    ) -> Result<Pipeline, GpuError> {
        let groups = [Some(behind), None, Some(&self.camera), Some(&self.io)];
        gpu.scoped("backdrop", || match target.ids {
            None => {
                let entries = ["gpu_sky_vertex", "gpu_sky_fragment"];
                let drawn = target.drawn(false);
                Pipeline::Raster(layout::raster(gpu, &backdrop_source(), entries, &groups[..3], drawn))
            }
            Some(_) => {
                let source = backdrop_compute_source(target.format);
                Pipeline::Compute(layout::compute(gpu, &source, "gpu_sky_shade", &groups))
            }
        })
    }
}
