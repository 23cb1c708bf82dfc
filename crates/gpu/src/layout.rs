//! Short forms of wgpu's descriptors.

use crate::Gpu;
use wgpu::util::DeviceExt;

/// Kind of a binding.
#[derive(Clone, Copy)]
pub enum Slot {
    /// A uniform buffer.
    Uniform,
    /// A read-only storage buffer.
    Read,
    /// A storage buffer.
    Write,
    /// A texture that `textureLoad` reads.
    Texture,
    /// A multisampled one.
    Multisampled,
    /// A texture of u32.
    Ids,
    /// A texture that a compute shader writes.
    Storage(wgpu::TextureFormat),
}

impl Slot {
    fn ty(self) -> wgpu::BindingType {
        let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
        let texture = |sample_type, multisampled| wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled,
        };
        let float = wgpu::TextureSampleType::Float { filterable: false };
        match self {
            Self::Uniform => buffer(wgpu::BufferBindingType::Uniform),
            Self::Read => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
            Self::Write => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
            Self::Texture => texture(float, false),
            Self::Multisampled => texture(float, true),
            Self::Ids => texture(wgpu::TextureSampleType::Uint, false),
            Self::Storage(format) => wgpu::BindingType::StorageTexture {
                access: wgpu::StorageTextureAccess::WriteOnly,
                format,
                view_dimension: wgpu::TextureViewDimension::D2,
            },
        }
    }
}

/// A layout of `slots` at bindings 0, 1, …
pub fn layout(gpu: &Gpu, stages: wgpu::ShaderStages, slots: &[Slot]) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = (0..)
        .zip(slots)
        .map(|(binding, s)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: stages,
            ty: s.ty(),
            count: None,
        })
        .collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}

/// A group of `resources` at bindings 0, 1, …
pub fn group(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let entries: Vec<_> = (0..)
        .zip(resources)
        .map(|(binding, r)| wgpu::BindGroupEntry { binding, resource: r.clone() })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// A buffer that holds `bytes`.
pub fn filled(gpu: &Gpu, label: &str, usage: wgpu::BufferUsages, bytes: &[u8]) -> wgpu::Buffer {
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(label),
        contents: bytes,
        usage,
    })
}

/// A buffer of `size` bytes.
pub fn empty(gpu: &Gpu, label: &str, usage: wgpu::BufferUsages, size: u64) -> wgpu::Buffer {
    let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
    gpu.device.create_buffer(&descriptor)
}

/// A shader module of WGSL text.
pub fn module(gpu: &Gpu, source: &str) -> wgpu::ShaderModule {
    gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    })
}

/// A compute pipeline of `source`'s entry point `entry`.
pub fn compute(
    gpu: &Gpu,
    source: &str,
    entry: &str,
    groups: &[Option<&wgpu::BindGroupLayout>],
) -> wgpu::ComputePipeline {
    compute_of(gpu, &module(gpu, source), entry, &pipeline_layout(gpu, groups))
}

/// A compute pipeline of the entry point `entry` of a module that several share.
pub fn compute_of(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    entry: &str,
    layout: &wgpu::PipelineLayout,
) -> wgpu::ComputePipeline {
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: Some(layout),
        module,
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    })
}

/// Target of a raster pipeline.
#[derive(Clone, Copy)]
pub struct Drawn {
    pub format: wgpu::TextureFormat,
    pub samples: u32,
    /// Are fragments tested and written by depth? Else they lie at depth 0 and fill only empty pixels.
    pub solid: bool,
}

/// A raster pipeline of `source`'s entry points.
pub fn raster(
    gpu: &Gpu,
    source: &str,
    [vertex, fragment]: [&str; 2],
    groups: &[Option<&wgpu::BindGroupLayout>],
    to: Drawn,
) -> wgpu::RenderPipeline {
    let module = module(gpu, source);
    let compare = if to.solid { wgpu::CompareFunction::Greater } else { wgpu::CompareFunction::GreaterEqual };
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment),
        layout: Some(&pipeline_layout(gpu, groups)),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: wgpu::TextureFormat::Depth32Float,
            depth_write_enabled: Some(to.solid),
            depth_compare: Some(compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState { count: to.samples, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(to.format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// The layout of a pipeline with bind groups of `groups`.
pub fn pipeline_layout(gpu: &Gpu, groups: &[Option<&wgpu::BindGroupLayout>]) -> wgpu::PipelineLayout {
    gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: groups,
        immediate_size: 0,
    })
}
