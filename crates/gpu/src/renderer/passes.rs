//! Shader texts and the pipelines of the two paths.

use super::target::Target;
use crate::direct;
use crate::layout::{self, Slot};
use crate::scene::{Rate, Settings};
use crate::{Gpu, GpuError};
use std::collections::HashMap;

const CAMERA: &str = include_str!("../shaders/camera.wgsl");
const GEOMETRY: &str = include_str!("../shaders/geometry.wgsl");
const SURFACE: &str = include_str!("../shaders/surface.wgsl");
const RASTER: &str = include_str!("../shaders/raster.wgsl");
const VISIBILITY: &str = include_str!("../shaders/visibility.wgsl");
const HEAD: &str = include_str!("../shaders/head.wgsl");
const LIST: &str = include_str!("../shaders/list.wgsl");
const COMPUTE: &str = include_str!("../shaders/compute.wgsl");
const COMPUTE_OBJECT: &str = include_str!("../shaders/compute_object.wgsl");
const BACKDROP: &str = include_str!("../shaders/backdrop.wgsl");
const BACKDROP_RASTER: &str = include_str!("../shaders/backdrop_raster.wgsl");
const BACKDROP_COMPUTE: &str = include_str!("../shaders/backdrop_compute.wgsl");

/// Shading of a room that reads sites.
const SHADE_SITE: &str = "shade_site(look.n, look.t, wo, s.p, Site(vec3<u32>(gpu_site(s.corners.x), \
                          gpu_site(s.corners.y), gpu_site(s.corners.z)), s.weights, s.uv))";

/// The raster path's module for a room's library.
pub fn raster_source(library: &str, settings: &Settings) -> String {
    let (place, share) = match settings.rate {
        Rate::Pixel => ("center", "= true"),
        Rate::Sample => ("sample", "= false"),
    };
    let raster = RASTER.replace("PLACE", place).replace("= SHARE", share);
    [library, CAMERA, GEOMETRY, &surface(library), &lines(&raster, library)].concat()
}

/// The compute path's module for a room's library.
pub fn compute_source(library: &str, format: wgpu::TextureFormat) -> String {
    [library, CAMERA, GEOMETRY, &surface(library), &compute_io(format), &lines(COMPUTE_OBJECT, library)]
        .concat()
}

/// `text` without the lines that are marked as belonging to sites or maps where the room or the object has none.
fn lines(text: &str, library: &str) -> String {
    let mapped = library.contains("const GPU_MAPPED: bool = true;");
    let kept = |l: &&str| (sited(library) || !l.ends_with("// sites")) && (mapped || !l.ends_with("// maps"));
    text.lines().filter(kept).flat_map(|l| [l, "\n"]).collect()
}

/// Does the room read data per site?
fn sited(library: &str) -> bool {
    library.contains("fn shade_site(")
}

/// From surface to radiance, by the room's own function.
fn surface(library: &str) -> String {
    let call = if sited(library) {
        SHADE_SITE
    } else if library.contains("fn shade_lobe(") {
        "shade_lobe(look.n, look.t, wo, s.p, look.lobe)"
    } else {
        "shade(look.n, look.t, wo, s.p)"
    };
    let direct = if library.contains("fn gpu_direct(") { "" } else { direct::NONE };
    let lit = format!("= {call} + gpu_direct(look.n, look.t, wo, s.p);");
    SURFACE.replace("= SHADE;", &lit) + direct
}

/// The visibility pass.
pub fn visibility_source() -> String {
    [CAMERA, GEOMETRY, VISIBILITY].concat()
}

/// The backdrop of the raster path.
pub fn backdrop_source() -> String {
    [CAMERA, BACKDROP, BACKDROP_RASTER].concat()
}

/// The backdrop of the compute path.
pub fn backdrop_compute_source(format: wgpu::TextureFormat) -> String {
    [CAMERA, BACKDROP, &compute_io(format), BACKDROP_COMPUTE].concat()
}

/// The pass that lists what there is to shade.
pub fn list_source(rate: Rate) -> String {
    let list = LIST.replace("= SHARE", &format!("= {}", rate == Rate::Pixel));
    HEAD.replace("COUNTER", "atomic<u32>") + &list
}

fn compute_io(format: wgpu::TextureFormat) -> String {
    let name = if format == wgpu::TextureFormat::Rgba16Float { "rgba16float" } else { "rgba32float" };
    HEAD.replace("COUNTER", "u32") + &COMPUTE.replace("FORMAT", name)
}

/// What shades an object.
#[derive(Clone)]
pub enum Pipeline {
    Raster(wgpu::RenderPipeline),
    Compute(wgpu::ComputePipeline),
}

/// Layouts, and pipelines by the text of the room they shade.
pub struct Passes {
    pub camera: wgpu::BindGroupLayout,
    pub object: wgpu::BindGroupLayout,
    pub io: wgpu::BindGroupLayout,
    made: HashMap<String, Pipeline>,
}

impl Passes {
    /// Layouts for `target`.
    pub fn new(gpu: &Gpu, target: &Target) -> Result<Self, GpuError> {
        gpu.scoped("layouts", || Self {
            camera: layout::layout(gpu, super::object::STAGES, &direct::SLOTS),
            object: layout::layout(gpu, super::object::STAGES, &super::object::SLOTS),
            io: layout::layout(
                gpu,
                wgpu::ShaderStages::COMPUTE,
                &[Slot::Ids, Slot::Read, Slot::Read, Slot::Storage(target.format)],
            ),
            made: HashMap::new(),
        })
    }

    /// The pipeline of a room's library.
    pub fn shading(
        &mut self,
        gpu: &Gpu,
        library: &str,
        room: &wgpu::BindGroupLayout,
        target: &Target,
    ) -> Result<Pipeline, GpuError> {
        if let Some(p) = self.made.get(library) {
            return Ok(p.clone());
        }
        let groups = [Some(room), Some(&self.object), Some(&self.camera), Some(&self.io)];
        let made = gpu.scoped("shader of a room", || match target.ids {
            None => {
                let entries = ["gpu_vertex", "gpu_fragment"];
                let source = raster_source(library, &target.settings);
                Pipeline::Raster(layout::raster(gpu, &source, entries, &groups[..3], target.drawn(true)))
            }
            Some(_) => {
                let source = compute_source(library, target.format);
                Pipeline::Compute(layout::compute(gpu, &source, "gpu_shade", &groups))
            }
        })?;
        self.made.insert(library.to_owned(), made.clone());
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
