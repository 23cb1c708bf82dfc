//! A room's tables, uniforms and buffers on the device.

use crate::{Gpu, GpuError};
use steradian_techniques::GpuRoom;
use steradian_techniques::gpu::{Binding, Format, Table, bindings};
use wgpu::util::DeviceExt;

/// A room's data on the device: group 0 of every pipeline that shades with it.
pub struct RoomData {
    pub(crate) layout: wgpu::BindGroupLayout,
    pub(crate) group: wgpu::BindGroup,
    uniforms: Option<wgpu::Buffer>,
    bytes: usize,
}

impl RoomData {
    /// Uploads everything that `room` describes. `visibility` says which stages read it.
    pub fn upload(gpu: &Gpu, room: &GpuRoom, visibility: wgpu::ShaderStages) -> Result<Self, GpuError> {
        check_limits(gpu, room)?;
        gpu.scoped(&format!("data of {}", room.slug), || Self::make(gpu, room, visibility))
    }

    fn make(gpu: &Gpu, room: &GpuRoom, visibility: wgpu::ShaderStages) -> Self {
        let [zero, _] = bindings(room);
        let uniforms = (!room.uniforms.is_empty()).then(|| {
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("room uniforms"),
                contents: &room.uniform_bytes(),
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            })
        });
        let views: Vec<_> = room.tables.iter().map(|t| upload_table(gpu, t)).collect();
        let buffers: Vec<_> = room.buffers.iter().map(|b| upload_buffer(gpu, &b.data)).collect();
        let layout = layout(gpu, &zero, room, visibility);
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
            label: Some(room.slug),
            layout: &layout,
            entries: &entries,
        });
        let bytes = room.tables.iter().map(|t| t.level.bytes.len()).sum::<usize>()
            + room.buffers.iter().map(|b| 4 * b.data.len()).sum::<usize>();
        Self { layout, group, uniforms, bytes }
    }

    /// Writes the uniforms of a new frame (rotated light, moved view); tables stay.
    pub fn update_uniforms(&self, gpu: &Gpu, room: &GpuRoom) {
        if let Some(u) = &self.uniforms {
            gpu.queue.write_buffer(u, 0, &room.uniform_bytes());
        }
    }

    /// Bytes of tables and buffers on the device.
    pub fn bytes(&self) -> usize {
        self.bytes
    }
}

fn check_limits(gpu: &Gpu, room: &GpuRoom) -> Result<(), GpuError> {
    let limits = gpu.device.limits();
    let beyond = |what: String| Err(GpuError::Memory(format!("{} of {}", what, room.slug)));
    for t in &room.tables {
        let side = t.level.width.max(t.level.height);
        if side > limits.max_texture_dimension_2d as usize {
            return beyond(format!("table '{}' with {side} texels a side", t.name));
        }
    }
    for b in &room.buffers {
        if 4 * b.data.len() as u64 > limits.max_storage_buffer_binding_size {
            return beyond(format!("buffer '{}' with {} numbers", b.name, b.data.len()));
        }
    }
    Ok(())
}

fn layout(
    gpu: &Gpu,
    zero: &[Binding],
    room: &GpuRoom,
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
        label: Some(room.slug),
        entries: &entries,
    })
}

pub(crate) fn buffer_type(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

fn upload_table(gpu: &Gpu, table: &Table) -> wgpu::TextureView {
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
        },
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    };
    let texture = gpu.device.create_texture_with_data(
        &gpu.queue,
        &descriptor,
        wgpu::util::TextureDataOrder::LayerMajor,
        &table.level.bytes,
    );
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    })
}

fn upload_buffer(gpu: &Gpu, data: &[f32]) -> wgpu::Buffer {
    let bytes: Vec<u8> = data.iter().flat_map(|x| x.to_le_bytes()).collect();
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("room buffer"),
        contents: &bytes,
        usage: wgpu::BufferUsages::STORAGE,
    })
}
