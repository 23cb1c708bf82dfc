//! A technique's tables, uniforms and buffers on the device.

use crate::{Gpu, GpuError};
use std::sync::atomic::{AtomicBool, Ordering};
use steradian_technique::GpuTechnique;
use steradian_technique::gpu::{Binding, Buffer, Format, Table, bindings};
use wgpu::util::DeviceExt;

/// A technique's data on the device: group 0 of every pipeline that shades with it.
pub struct TechniqueData {
    pub(crate) layout: wgpu::BindGroupLayout,
    pub(crate) group: wgpu::BindGroup,
    uniforms: Option<wgpu::Buffer>,
    /// Tables by name.
    tables: Vec<(&'static str, wgpu::Texture)>,
    buffers: Vec<wgpu::Buffer>,
    /// Was a table handed out for writing?
    written: AtomicBool,
    /// Uniforms by name, and where each begins.
    places: Vec<(&'static str, u64)>,
    bytes: usize,
}

impl TechniqueData {
    /// Uploads everything that `technique` describes. `visibility` says which stages read it.
    pub fn upload(
        gpu: &Gpu,
        technique: &GpuTechnique,
        visibility: wgpu::ShaderStages,
    ) -> Result<Self, GpuError> {
        check_limits(gpu, technique)?;
        gpu.scoped(&format!("data of {}", technique.slug), || Self::make(gpu, technique, None, visibility))
    }

    /// The data of `new` in place of those of `old`, which these are: only tables and buffers that differ are
    /// uploaded.
    pub fn replaced(
        &self,
        gpu: &Gpu,
        old: &GpuTechnique,
        new: &GpuTechnique,
        visibility: wgpu::ShaderStages,
    ) -> Result<Self, GpuError> {
        check_limits(gpu, new)?;
        let kept = Some((self, old));
        gpu.scoped(&format!("data of {}", new.slug), || Self::make(gpu, new, kept, visibility))
    }

    fn make(
        gpu: &Gpu,
        technique: &GpuTechnique,
        kept: Option<(&Self, &GpuTechnique)>,
        visibility: wgpu::ShaderStages,
    ) -> Self {
        let [zero, _] = bindings(technique);
        let uniforms = (!technique.uniforms.is_empty()).then(|| {
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("technique uniforms"),
                contents: &technique.uniform_bytes(),
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            })
        });
        let kept = kept.filter(|(data, _)| !data.written.load(Ordering::Relaxed));
        let kept_table = |t: &Table| {
            let (data, old) = kept?;
            old.tables.iter().position(|o| o == t).and_then(|i| Some(data.tables.get(i)?.1.clone()))
        };
        let kept_buffer = |b: &Buffer| {
            let (data, old) = kept?;
            old.buffers.iter().position(|o| o == b).and_then(|i| data.buffers.get(i).cloned())
        };
        let table = |t: &Table| (t.name, kept_table(t).unwrap_or_else(|| upload_table(gpu, t)));
        let buffer = |b: &Buffer| kept_buffer(b).unwrap_or_else(|| upload_buffer(gpu, b));
        let tables: Vec<_> = technique.tables.iter().map(table).collect();
        let views: Vec<_> = tables.iter().map(|(_, t)| view(t)).collect();
        let buffers: Vec<_> = technique.buffers.iter().map(buffer).collect();
        let layout = layout(gpu, &zero, technique, visibility);
        let resource = |b: &Binding| match b {
            Binding::Uniforms => uniforms.as_ref().map(wgpu::Buffer::as_entire_binding),
            Binding::Table(i) => views.get(*i).map(wgpu::BindingResource::TextureView),
            Binding::Buffer(i) => buffers.get(*i).map(wgpu::Buffer::as_entire_binding),
            Binding::Points | Binding::Radiance => None,
        };
        let entries: Vec<_> = (0..)
            .zip(&zero)
            .filter_map(|(binding, b)| Some(wgpu::BindGroupEntry { binding, resource: resource(b)? }))
            .collect();
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(technique.slug),
            layout: &layout,
            entries: &entries,
        });
        let bytes = technique.tables.iter().map(|t| t.level.bytes.len()).sum::<usize>()
            + technique.buffers.iter().map(|b| b.data.bytes()).sum::<usize>();
        let places = technique.uniforms.iter().map(|u| u.name).zip(technique.uniform_offsets()).collect();
        Self { layout, group, uniforms, tables, buffers, written: AtomicBool::new(false), places, bytes }
    }

    /// Writes the uniforms of a new frame (rotated light, moved view); tables stay.
    pub fn update_uniforms(&self, gpu: &Gpu, technique: &GpuTechnique) {
        if let Some(u) = &self.uniforms {
            gpu.queue.write_buffer(u, 0, &technique.uniform_bytes());
        }
    }

    /// The texture of the table `name`, which takes copies.
    pub(crate) fn table(&self, name: &str) -> Option<&wgpu::Texture> {
        self.written.store(true, Ordering::Relaxed);
        self.tables.iter().find(|(n, _)| *n == name).map(|(_, t)| t)
    }

    /// The buffer that holds the uniform `name`, which takes copies, and where it begins.
    pub(crate) fn uniform(&self, name: &str) -> Option<(&wgpu::Buffer, u64)> {
        let (_, at) = self.places.iter().find(|(n, _)| *n == name)?;
        Some((self.uniforms.as_ref()?, *at))
    }

    /// Bytes of tables and buffers on the device.
    pub fn bytes(&self) -> usize {
        self.bytes
    }
}

/// Textures that pipelines bind in addition to a technique's.
const TEXTURES: usize = 9;
/// Storage buffers that pipelines bind in addition to a technique's.
const BUFFERS: usize = 5;

/// Checks that the device has room for a table of `whose`.
pub(crate) fn check_table(gpu: &Gpu, whose: &str, t: &Table) -> Result<(), GpuError> {
    let limits = gpu.device.limits();
    let (name, side) = (t.name, t.level.width.max(t.level.height));
    let what = if side > limits.max_texture_dimension_2d as usize {
        format!("table '{name}' with {side} texels a side")
    } else if t.level.layers > limits.max_texture_array_layers as usize {
        format!("table '{name}' with {} layers", t.level.layers)
    } else {
        return Ok(());
    };
    Err(GpuError::Memory(format!("{what} of {whose}")))
}

fn check_limits(gpu: &Gpu, technique: &GpuTechnique) -> Result<(), GpuError> {
    let limits = gpu.device.limits();
    let beyond = |what: String| Err(GpuError::Memory(format!("{} of {}", what, technique.slug)));
    if technique.tables.len() > limits.max_sampled_textures_per_shader_stage as usize - TEXTURES {
        return beyond(format!("{} tables", technique.tables.len()));
    }
    if technique.buffers.len() > limits.max_storage_buffers_per_shader_stage as usize - BUFFERS {
        return beyond(format!("{} buffers", technique.buffers.len()));
    }
    technique.tables.iter().try_for_each(|t| check_table(gpu, technique.slug, t))?;
    for b in &technique.buffers {
        if b.data.bytes() as u64 > limits.max_storage_buffer_binding_size {
            return beyond(format!("buffer '{}' with {} numbers", b.name, b.data.len()));
        }
    }
    Ok(())
}

fn layout(
    gpu: &Gpu,
    zero: &[Binding],
    technique: &GpuTechnique,
    visibility: wgpu::ShaderStages,
) -> wgpu::BindGroupLayout {
    let ty = |b: &Binding| match b {
        Binding::Uniforms => buffer_type(wgpu::BufferBindingType::Uniform),
        Binding::Table(_) => wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2Array,
            multisampled: false,
        },
        Binding::Buffer(_) | Binding::Points => {
            buffer_type(wgpu::BufferBindingType::Storage { read_only: true })
        }
        Binding::Radiance => buffer_type(wgpu::BufferBindingType::Storage { read_only: false }),
    };
    let entries: Vec<_> = (0..)
        .zip(zero)
        .map(|(binding, b)| wgpu::BindGroupLayoutEntry { binding, visibility, ty: ty(b), count: None })
        .collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(technique.slug),
        entries: &entries,
    })
}

pub(crate) fn buffer_type(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

pub(crate) fn upload_table(gpu: &Gpu, table: &Table) -> wgpu::Texture {
    let descriptor = wgpu::TextureDescriptor {
        label: Some(table.name),
        size: wgpu::Extent3d {
            width: table.level.width as u32,
            height: table.level.height as u32,
            depth_or_array_layers: table.level.layers as u32,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: match table.format {
            Format::Rg32Float => wgpu::TextureFormat::Rg32Float,
            Format::Rgba32Float => wgpu::TextureFormat::Rgba32Float,
            Format::Rgba8Unorm => wgpu::TextureFormat::Rgba8Unorm,
        },
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    };
    gpu.device.create_texture_with_data(
        &gpu.queue,
        &descriptor,
        wgpu::util::TextureDataOrder::LayerMajor,
        &table.level.bytes,
    )
}

fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    })
}

fn upload_buffer(gpu: &Gpu, buffer: &Buffer) -> wgpu::Buffer {
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(buffer.name),
        contents: &buffer.data.to_bytes(),
        usage: wgpu::BufferUsages::STORAGE,
    })
}
