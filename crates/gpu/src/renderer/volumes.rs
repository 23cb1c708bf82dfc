//! Shadow volumes: the visibility of each light at every sample, drawn before surfaces are shaded.
//!
//! Counted behind the visible surface (z-fail: Bilodeau & Songy; Carmack 2000), with boundaries that extend
//! to infinity, as does the projection (Everitt & Kilgard 2002, *Practical and Robust Stenciled Shadow
//! Volumes*), so that neither the near nor the far plane cuts any off. Counts are added up in a float target
//! in place of a stencil (after Röttger, Irion & Ertl 2002, *Shadow Volumes Revisited*): they need no depth
//! format that adapters may lack, do not wrap round at 256, and take sides that bound several prisms at once,
//! as edges of open meshes and of more than two triangles do.

use super::object::Placed;
use super::passes::{self, Passes};
use super::target::Target;
use crate::direct::DirectLights;
use crate::layout::{self, Slot, empty, filled};
use crate::packed::bytes;
use crate::program::CAMERA;
use crate::scene::Scene;
use crate::{Gpu, GpuError};
use steradian_scene::Camera;
use steradian_scene::shadow::{Boundary, LightAt, Volumes as Drawn};
use steradian_technique::gpu::shadow::is_behind_volumes;

const VOLUME: &str = include_str!("../shaders/volumes.wgsl");
const DRAW: &str = include_str!("../shaders/volumes_draw.wgsl");
const KEEP: &str = include_str!("../shaders/volumes_keep.wgsl");
const MULTI: &str = include_str!("../shaders/volumes_multi.wgsl");
const SINGLE: &str = include_str!("../shaders/volumes_single.wgsl");

/// Format of the counts: integers up to 2048 are exact in it, and every adapter can blend it.
const COUNTS: wgpu::TextureFormat = wgpu::TextureFormat::R16Float;
/// Distance, in diagonals of the mesh, at which points at infinity are drawn under parallel rays.
const FAR: f32 = 1000.0;

/// The pass that counts.
pub fn draw_source() -> String {
    [CAMERA, VOLUME, DRAW].concat()
}

/// The pass that stores the counts, of a target with `multi` samples a texel or one.
pub fn keep_source(multi: bool) -> String {
    [if multi { MULTI } else { SINGLE }, VOLUME, KEEP].concat()
}

/// Masks of the lights that do not reach each sample.
pub fn masks(gpu: &Gpu, scene: &Scene, target: &Target) -> Result<Option<wgpu::Buffer>, GpuError> {
    let Some(volumes) = &scene.volumes else {
        if scene.objects.iter().any(|o| is_behind_volumes(&o.technique)) {
            return Err(GpuError::Scene("an object is behind shadow volumes, and there are none".into()));
        }
        return Ok(None);
    };
    let lights = volumes.lights.len();
    if lights == 0 || lights > Drawn::MOST {
        return Err(GpuError::Scene(format!("shadow volumes of {lights} lights; 1 to {}", Drawn::MOST)));
    }
    let s = &target.settings;
    let size = (4 * s.width * s.scale * s.height * s.scale * lights.div_ceil(8)) as u64;
    let pieces = |v: &Boundary| 16 * (v.caps.len() + v.sides.len());
    let places = 12 * volumes.positions.len();
    let largest = volumes.lights.iter().map(pieces).fold(places as u64, |most, n| most.max(n as u64));
    let limits = gpu.device.limits();
    if largest.max(size) > limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) {
        return Err(GpuError::Memory(format!("shadow volumes of {lights} lights")));
    }
    gpu.scoped("shadow masks", || Some(empty(gpu, "shadow masks", wgpu::BufferUsages::STORAGE, size)))
}

/// The volumes of a scene on the device.
pub struct Volumes {
    /// Writes depths alone, where no other pass writes those of all objects before they are shaded.
    depth: Option<wgpu::RenderPipeline>,
    draw: wgpu::RenderPipeline,
    /// The draw pipeline for parallel rays, whose far plane is at a finite distance.
    draw_parallel: Option<wgpu::RenderPipeline>,
    keep: wgpu::ComputePipeline,
    counts: wgpu::TextureView,
    lights: Vec<Light>,
    groups: [u32; 2],
}

struct Light {
    draw: wgpu::BindGroup,
    keep: wgpu::BindGroup,
    vertices: u32,
}

impl Volumes {
    /// Uploads `drawn` and makes its pipelines.
    pub fn new(
        gpu: &Gpu,
        passes: &Passes,
        target: &Target,
        drawn: &Drawn,
        masks: &wgpu::Buffer,
    ) -> Result<Self, GpuError> {
        gpu.scoped("shadow volumes", || Self::make(gpu, passes, target, drawn, masks))
    }

    fn make(gpu: &Gpu, passes: &Passes, target: &Target, drawn: &Drawn, masks: &wgpu::Buffer) -> Self {
        let samples = target.samples();
        let drawing = layout::layout(gpu, super::object::STAGES, &[Slot::Uniform, Slot::Read, Slot::Read]);
        let source = if samples > 1 { Slot::Multisampled } else { Slot::Texture };
        let keeping = layout::layout(gpu, wgpu::ShaderStages::COMPUTE, &[source, Slot::Write, Slot::Uniform]);
        let counts = target.counts(gpu, COUNTS);
        let corners: Vec<f32> = drawn.positions.iter().flatten().copied().collect();
        let corners = filled(gpu, "corners of shadow volumes", wgpu::BufferUsages::STORAGE, &bytes(&corners));
        let diagonal = diagonal(&drawn.positions);
        let light = |(k, of): (usize, &Boundary)| {
            let uniforms =
                filled(gpu, "shadow volume", wgpu::BufferUsages::UNIFORM, &uniforms(of, k, diagonal));
            let pieces = filled(gpu, "shadow volume", wgpu::BufferUsages::STORAGE, &pieces(of));
            let [uniforms, corners, pieces, masks] =
                [&uniforms, &corners, &pieces, masks].map(wgpu::Buffer::as_entire_binding);
            let counts = wgpu::BindingResource::TextureView(&counts);
            Light {
                draw: layout::group(gpu, &drawing, &[uniforms.clone(), corners, pieces]),
                keep: layout::group(gpu, &keeping, &[counts, masks, uniforms]),
                vertices: (6 * (of.caps.len() + of.sides.len())) as u32,
            }
        };
        let lights = drawn.lights.iter().enumerate().map(light).collect();
        let s = &target.settings;
        let module = layout::module(gpu, &draw_source());
        let groups = [Some(&drawing), None, Some(&passes.camera)];
        let draw = |endless| counting(gpu, &module, &groups, samples, endless);
        let endless = gpu.device.features().contains(wgpu::Features::DEPTH_CLIP_CONTROL);
        Self {
            depth: target.ids.is_none().then(|| depths(gpu, passes, samples)),
            draw: draw(false),
            draw_parallel: endless.then(|| draw(true)),
            keep: layout::compute(gpu, &keep_source(samples > 1), "gpu_keep", &[Some(&keeping)]),
            counts,
            lights,
            groups: [s.width, s.height].map(|n| ((n * s.scale) as u32).div_ceil(8)),
        }
    }

    /// Can they be drawn for `camera`?
    pub fn check(&self, camera: &Camera) -> Result<(), GpuError> {
        match (camera, &self.draw_parallel) {
            (Camera::Orthographic { .. }, None) => {
                Err(GpuError::Device("shadow volumes under parallel rays need depth clip control".into()))
            }
            _ => Ok(()),
        }
    }

    /// Draws the volumes against the depth of `target`, which earlier passes wrote, or which this pass writes
    /// from `objects`.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        clock: &mut super::Clock,
        target: &Target,
        direct: &DirectLights,
        camera: &Camera,
        objects: &[(Placed, passes::Pipeline)],
    ) {
        let attachment = |load| wgpu::RenderPassDepthStencilAttachment {
            view: &target.depth,
            depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        };
        if let Some(depth) = &self.depth {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("depth"),
                depth_stencil_attachment: Some(attachment(wgpu::LoadOp::Clear(0.0))),
                timestamp_writes: clock.raster("depth"),
                ..Default::default()
            });
            pass.set_pipeline(depth);
            for (k, (placed, _)) in objects.iter().enumerate() {
                pass.set_bind_group(1, &placed.group, &[]);
                pass.set_bind_group(2, direct.group_of(k), &[]);
                pass.draw(0..placed.vertices, 0..1);
            }
        }
        let draw = match (camera, &self.draw_parallel) {
            (Camera::Orthographic { .. }, Some(endless)) => endless,
            _ => &self.draw,
        };
        for light in &self.lights {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("shadow volume"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &self.counts,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(attachment(wgpu::LoadOp::Load)),
                timestamp_writes: clock.raster("shadow volume"),
                ..Default::default()
            });
            pass.set_pipeline(draw);
            pass.set_bind_group(0, &light.draw, &[]);
            pass.set_bind_group(2, &direct.group, &[]);
            pass.draw(0..light.vertices, 0..1);
            drop(pass);
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("shadow mask"),
                timestamp_writes: clock.compute("shadow mask"),
            });
            pass.set_pipeline(&self.keep);
            pass.set_bind_group(0, &light.keep, &[]);
            pass.dispatch_workgroups(self.groups[0], self.groups[1], 1);
        }
    }
}

fn diagonal(positions: &[[f32; 3]]) -> f32 {
    let mut all = positions.iter().map(|p| glam::Vec3::from_array(*p));
    let first = all.next().unwrap_or_default();
    let (low, high) = all.fold((first, first), |(low, high), p| (low.min(p), high.max(p)));
    (high - low).length().max(1e-3)
}

/// `struct GpuVolume`.
fn uniforms(of: &Boundary, k: usize, diagonal: f32) -> Vec<u8> {
    let place = match of.light {
        LightAt::Far(d) => d.extend(0.0),
        LightAt::Near(p) => p.extend(1.0),
    };
    let mut out = bytes(&place.to_array());
    out.extend(
        [of.caps.len() as u32, of.sides.len() as u32, k as u32, 0].into_iter().flat_map(u32::to_le_bytes),
    );
    out.extend(bytes(&[1.0 / (FAR * diagonal), 0.0, 0.0, 0.0]));
    out
}

fn pieces(of: &Boundary) -> Vec<u8> {
    let caps = of.caps.iter().map(|([a, b, c], n)| [*a as i32, *b as i32, *c as i32, *n]);
    let sides = of.sides.iter().map(|([p, q], n)| [*p as i32, *q as i32, 0, *n]);
    let mut out: Vec<u8> = caps.chain(sides).flatten().flat_map(i32::to_le_bytes).collect();
    if out.is_empty() {
        out.resize(16, 0);
    }
    out
}

fn depth(compare: wgpu::CompareFunction, write: bool) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: wgpu::TextureFormat::Depth32Float,
        depth_write_enabled: Some(write),
        depth_compare: Some(compare),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}

fn depths(gpu: &Gpu, passes: &Passes, samples: u32) -> wgpu::RenderPipeline {
    let groups = [None, Some(&passes.object), Some(&passes.camera)];
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("depth"),
        layout: Some(&layout::pipeline_layout(gpu, &groups)),
        vertex: wgpu::VertexState {
            module: &layout::module(gpu, &passes::visibility_source()),
            entry_point: Some("gpu_seen_vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(depth(wgpu::CompareFunction::Greater, true)),
        multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
        fragment: None,
        multiview_mask: None,
        cache: None,
    })
}

/// Counts boundaries at the visible depth or behind it; depth is reversed.
fn counting(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    groups: &[Option<&wgpu::BindGroupLayout>],
    samples: u32,
    endless: bool,
) -> wgpu::RenderPipeline {
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("shadow volume"),
        layout: Some(&layout::pipeline_layout(gpu, groups)),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("gpu_side_vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState { unclipped_depth: endless, ..Default::default() },
        depth_stencil: Some(depth(wgpu::CompareFunction::LessEqual, false)),
        multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("gpu_side_fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: COUNTS,
                blend: Some(wgpu::BlendState { color: add, alpha: add }),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
