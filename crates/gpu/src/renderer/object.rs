//! An object on the device.

use crate::layout::{self, Slot, bytes, filled};
use crate::scene::{Level, Object, Texture, Wrap};
use crate::{Gpu, GpuError, RoomData};
use glam::{Affine3A, Mat3A};
use steradian_techniques::GpuRoom;

/// Stages that read an object and its room.
pub const STAGES: wgpu::ShaderStages = wgpu::ShaderStages::VERTEX_FRAGMENT.union(wgpu::ShaderStages::COMPUTE);

/// Group 1: uniforms, vertices, indices, base colour, vertex colours, mean normals, their covariance, alpha².
pub const SLOTS: [Slot; 8] = [
    Slot::Uniform,
    Slot::Read,
    Slot::Read,
    Slot::Texture,
    Slot::Read,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
];

const PLAIN: &str = include_str!("../shaders/plain.wgsl");
const MAPS: &str = include_str!("../shaders/maps.wgsl");

/// What the shaders of an object with `room` start with: the room's library and how a point is shaded with it, by
/// maps where it is `mapped`.
pub fn library(room: &GpuRoom, mapped: bool) -> String {
    let library = steradian_techniques::gpu::library(room);
    match (room.varies(), mapped) {
        (true, _) => library + MAPS,
        // `struct Lobe`, which a room that varies has of its own.
        (false, true) => library + steradian_techniques::shared::lobe::WGSL + MAPS,
        (false, false) => library + PLAIN,
    }
}

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
    counts: [u32; 11],
    mapped: bool,
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
        let counts = counts(object, first);
        let mapped = object.is_mapped();
        gpu.scoped("object", || {
            let uniform = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
            let uniforms = filled(gpu, "object", uniform, &uniform_bytes(&object.transform, counts));
            let vertices = filled(
                gpu,
                "vertices",
                wgpu::BufferUsages::STORAGE,
                &bytes(object.triangles.vertices.as_flattened()),
            );
            let t = &object.triangles;
            let indices: Vec<u8> =
                t.indices.as_flattened().iter().chain(&t.sites).flat_map(|i| i.to_le_bytes()).collect();
            let indices = filled(gpu, "indices", wgpu::BufferUsages::STORAGE, &indices);
            let maps = &object.maps;
            let normal = maps.normal.as_ref();
            let textures = [
                object.base_colour.as_ref(),
                normal.map(|n| &n.mean),
                normal.map(|n| &n.spread),
                maps.alpha2.as_ref(),
            ];
            let [texture, mean, spread, alpha2] = textures.map(|t| upload(gpu, t));
            let colors = object.triangles.colors.as_flattened();
            let colors = if colors.is_empty() { &[1.0; 3] } else { colors };
            let colors = filled(gpu, "vertex colours", wgpu::BufferUsages::STORAGE, &bytes(colors));
            let group = layout::group(
                gpu,
                layout,
                &[
                    uniforms.as_entire_binding(),
                    vertices.as_entire_binding(),
                    indices.as_entire_binding(),
                    wgpu::BindingResource::TextureView(&texture),
                    colors.as_entire_binding(),
                    wgpu::BindingResource::TextureView(&mean),
                    wgpu::BindingResource::TextureView(&spread),
                    wgpu::BindingResource::TextureView(&alpha2),
                ],
            );
            let library = library(&object.room, mapped);
            Self { room, library, group, vertices: 3 * triangles, uniforms, counts, mapped }
        })
    }

    /// Moves the object.
    pub fn set_transform(&self, gpu: &Gpu, transform: &Affine3A) {
        gpu.queue.write_buffer(&self.uniforms, 0, &uniform_bytes(transform, self.counts));
    }

    /// Replaces the data of the room `old`; `true` where its text changed too, so that pipelines must be made anew.
    pub fn set_room(&mut self, gpu: &Gpu, old: &GpuRoom, room: &GpuRoom) -> Result<bool, GpuError> {
        self.room = self.room.replaced(gpu, old, room, STAGES)?;
        let library = library(room, self.mapped);
        let changed = library != self.library;
        self.library = library;
        Ok(changed)
    }
}

/// The numbers of `struct GpuObject`: first id, triangles, levels of the base colour; levels of the normal map and of
/// the roughness map, wraps (four bits a texture: base colour, normals, roughness), filtering and 4 with vertex colours;
/// rows of the finest levels.
fn counts(object: &Object, first: u32) -> [u32; 11] {
    let levels = |t: Option<&Texture>| t.map_or(0, |t| t.levels.len() as u32);
    let maps = &object.maps;
    let mean = maps.normal.as_ref().map(|n| &n.mean);
    let textures = [object.base_colour.as_ref(), mean, maps.alpha2.as_ref()];
    let wraps = (0..).zip(textures).map(|(k, t)| {
        let [u, v] = t.map_or([Wrap::Repeat; 2], |t| t.wrap).map(|w| w as u32);
        (u | v << 2) << (4 * k)
    });
    let filtering = maps.filtering as u32 + if object.triangles.colors.is_empty() { 0 } else { 4 };
    let triangles = object.triangles.indices.len() as u32;
    let [colour, normal, alpha2] = textures.map(levels);
    let rows = textures.map(|t| t.and_then(|t| t.levels.first()).map_or(1, |l| l.height as u32));
    let [base, normals, widths] = rows;
    [first, triangles, colour, normal, alpha2, wraps.sum(), filtering, base, normals, widths, 0]
}

/// `struct GpuObject`.
fn uniform_bytes(transform: &Affine3A, counts: [u32; 11]) -> Vec<u8> {
    let m = transform.matrix3;
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    let normals =
        Mat3A::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis)) * sign;
    let mut floats = glam::Mat4::from(*transform).to_cols_array().to_vec();
    for c in [normals.x_axis, normals.y_axis, normals.z_axis] {
        floats.extend([c.x, c.y, c.z, 0.0]);
    }
    let mut out = bytes(&floats);
    let [a, b, c, maps @ ..] = counts;
    let words = [a, b, c, u32::from(sign < 0.0)].into_iter().chain(maps);
    out.extend(words.flat_map(u32::to_le_bytes));
    out
}

fn check(gpu: &Gpu, object: &Object) -> Result<(), GpuError> {
    let (vertices, triangles) = (object.triangles.vertices.len(), object.triangles.indices.len());
    let limits = gpu.device.limits();
    let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if triangles == 0 || object.triangles.indices.as_flattened().iter().any(|i| *i as usize >= vertices) {
        return Err(GpuError::Scene("an object has no triangles, or one without its vertices".into()));
    }
    let sites = object.triangles.sites.len();
    if object.room.sited() && sites != vertices {
        return Err(GpuError::Scene(format!("{} needs a site for every vertex", object.room.slug)));
    }
    if 48 * vertices as u64 > most || (12 * triangles + 4 * sites) as u64 > most {
        return Err(GpuError::Memory(format!("a mesh of {triangles} triangles")));
    }
    let colors = object.triangles.colors.len();
    if colors != 0 && colors != vertices {
        return Err(GpuError::Scene(format!("a mesh of {vertices} vertices has {colors} vertex colours")));
    }
    let maps = &object.maps;
    let normal = maps.normal.iter().flat_map(|n| [&n.mean, &n.spread]);
    let sizes = |t: &Texture| t.levels.iter().map(|l| (l.width, l.height)).collect::<Vec<_>>();
    if maps.normal.as_ref().is_some_and(|n| sizes(&n.mean) != sizes(&n.spread)) {
        return Err(GpuError::Scene("a normal map's means and covariances differ in size".into()));
    }
    object.base_colour.iter().chain(normal).chain(&maps.alpha2).try_for_each(|t| check_texture(gpu, t))
}

fn check_texture(gpu: &Gpu, texture: &Texture) -> Result<(), GpuError> {
    let whole = |l: &Level| l.width > 0 && l.height > 0 && l.texels.len() == l.width * l.height;
    let halves = texture
        .levels
        .windows(2)
        .all(|l| l[1].width == (l[0].width / 2).max(1) && l[1].height == (l[0].height / 2).max(1));
    if texture.levels.is_empty() || !halves || !texture.levels.iter().all(whole) {
        return Err(GpuError::Scene("a texture's levels do not halve".into()));
    }
    let rows = texture.levels.iter().map(|l| l.height).sum();
    let side = texture.levels[0].width.max(rows);
    if side > gpu.device.limits().max_texture_dimension_2d as usize {
        return Err(GpuError::Memory(format!("a texture whose levels need {side} texels a side")));
    }
    Ok(())
}

/// The texture with its levels one below the other, each from the left: software adapters read one level for all
/// threads of a group, whatever each asks for. A black texel where there is no texture.
fn upload(gpu: &Gpu, texture: Option<&Texture>) -> wgpu::TextureView {
    let none = || Level { width: 1, height: 1, texels: vec![[0.0; 3]] };
    let stack = texture.map_or_else(none, |t| {
        let width = t.levels.first().map_or(1, |l| l.width);
        let mut out = Level { width, height: 0, texels: Vec::new() };
        for level in &t.levels {
            for row in level.texels.chunks_exact(level.width) {
                out.texels.extend_from_slice(row);
                out.height += 1;
                out.texels.resize(out.height * width, [0.0; 3]);
            }
        }
        out
    });
    picture(gpu, std::slice::from_ref(&stack))
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
