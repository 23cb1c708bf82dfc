//! An object on the device.

use crate::layout::{self, Slot, bytes, filled};
use crate::scene::{Level, Object, Texture};
use crate::{Gpu, GpuError, RoomData};
use glam::{Affine3A, Mat3A};
use steradian_techniques::GpuRoom;

/// Stages that read an object and its room.
pub const STAGES: wgpu::ShaderStages = wgpu::ShaderStages::VERTEX_FRAGMENT.union(wgpu::ShaderStages::COMPUTE);

/// Group 1: uniforms, vertices, indices, base colour.
pub const SLOTS: [Slot; 4] = [Slot::Uniform, Slot::Read, Slot::Read, Slot::Texture];

/// An object on the device.
pub struct Placed {
    /// Group 0.
    pub room: RoomData,
    /// The room's library: the text that pipelines are made of.
    pub library: String,
    /// Group 1.
    pub group: wgpu::BindGroup,
    /// Three per triangle.
    pub vertices: u32,
    uniforms: wgpu::Buffer,
    counts: [u32; 3],
}

impl Placed {
    /// Uploads `object`, whose triangles get ids from `first`.
    pub fn new(
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        object: &Object,
        first: u32,
    ) -> Result<Self, GpuError> {
        check(gpu, object)?;
        let room = RoomData::upload(gpu, &object.room, STAGES)?;
        let triangles = object.triangles.indices.len() as u32;
        let levels = object.base_colour.as_ref().map_or(0, |t| t.levels.len() as u32);
        let counts = [first, triangles, levels];
        gpu.scoped("object", || {
            let uniform = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
            let uniforms = filled(gpu, "object", uniform, &uniform_bytes(&object.transform, counts));
            let vertices = filled(
                gpu,
                "vertices",
                wgpu::BufferUsages::STORAGE,
                &bytes(object.triangles.vertices.as_flattened()),
            );
            let indices: Vec<u8> =
                object.triangles.indices.as_flattened().iter().flat_map(|i| i.to_le_bytes()).collect();
            let indices = filled(gpu, "indices", wgpu::BufferUsages::STORAGE, &indices);
            let texture = upload(gpu, object.base_colour.as_ref());
            let group = layout::group(
                gpu,
                layout,
                &[
                    uniforms.as_entire_binding(),
                    vertices.as_entire_binding(),
                    indices.as_entire_binding(),
                    wgpu::BindingResource::TextureView(&texture),
                ],
            );
            let library = steradian_techniques::gpu::library(&object.room);
            Self { room, library, group, vertices: 3 * triangles, uniforms, counts }
        })
    }

    /// Moves the object.
    pub fn set_transform(&self, gpu: &Gpu, transform: &Affine3A) {
        gpu.queue.write_buffer(&self.uniforms, 0, &uniform_bytes(transform, self.counts));
    }

    /// Replaces the room's data; `true` where its text changed too, so that pipelines must be made anew.
    pub fn set_room(&mut self, gpu: &Gpu, room: &GpuRoom) -> Result<bool, GpuError> {
        self.room = RoomData::upload(gpu, room, STAGES)?;
        let library = steradian_techniques::gpu::library(room);
        let changed = library != self.library;
        self.library = library;
        Ok(changed)
    }
}

/// `struct GpuObject`.
fn uniform_bytes(transform: &Affine3A, counts: [u32; 3]) -> Vec<u8> {
    let m = transform.matrix3;
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    let normals =
        Mat3A::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis)) * sign;
    let mut floats = glam::Mat4::from(*transform).to_cols_array().to_vec();
    for c in [normals.x_axis, normals.y_axis, normals.z_axis] {
        floats.extend([c.x, c.y, c.z, 0.0]);
    }
    let mut out = bytes(&floats);
    out.extend(counts.into_iter().chain([u32::from(sign < 0.0)]).flat_map(u32::to_le_bytes));
    out
}

fn check(gpu: &Gpu, object: &Object) -> Result<(), GpuError> {
    let (vertices, triangles) = (object.triangles.vertices.len(), object.triangles.indices.len());
    let limits = gpu.device.limits();
    let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if triangles == 0 || object.triangles.indices.as_flattened().iter().any(|i| *i as usize >= vertices) {
        return Err(GpuError::Scene("an object has no triangles, or one without its vertices".into()));
    }
    if 48 * vertices as u64 > most || 12 * triangles as u64 > most {
        return Err(GpuError::Memory(format!("a mesh of {triangles} triangles")));
    }
    let Some(texture) = &object.base_colour else { return Ok(()) };
    let whole = |l: &Level| l.width > 0 && l.height > 0 && l.texels.len() == l.width * l.height;
    let halves = texture
        .levels
        .windows(2)
        .all(|l| l[1].width == (l[0].width / 2).max(1) && l[1].height == (l[0].height / 2).max(1));
    if texture.levels.is_empty() || !halves || !texture.levels.iter().all(whole) {
        return Err(GpuError::Scene("a texture's levels do not halve".into()));
    }
    let side = texture.levels[0].width.max(texture.levels[0].height);
    if side > limits.max_texture_dimension_2d as usize {
        return Err(GpuError::Memory(format!("a texture with {side} texels a side")));
    }
    Ok(())
}

/// The texture with its levels; a black texel where there is none.
fn upload(gpu: &Gpu, texture: Option<&Texture>) -> wgpu::TextureView {
    let none = Level { width: 1, height: 1, texels: vec![[0.0; 3]] };
    let levels = texture.map_or(std::slice::from_ref(&none), |t| &t.levels);
    picture(gpu, levels)
}

/// Levels as an Rgba32Float texture.
pub fn picture(gpu: &Gpu, levels: &[Level]) -> wgpu::TextureView {
    use wgpu::util::DeviceExt;
    let texels = levels.iter().flat_map(|l| &l.texels).flat_map(|t| [t[0], t[1], t[2], 1.0]);
    let data: Vec<u8> = texels.flat_map(f32::to_le_bytes).collect();
    let texture = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d {
                width: levels[0].width as u32,
                height: levels[0].height as u32,
                depth_or_array_layers: 1,
            },
            mip_level_count: levels.len() as u32,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        &data,
    );
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
