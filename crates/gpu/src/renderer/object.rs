//! An object on the device.

use crate::layout::{self, Slot, bytes, filled};
use crate::scene::{Level, Object};
use crate::{Gpu, GpuError, TechniqueData, direct};
use glam::{Affine3A, Mat3A};
use steradian_scene::surface::{NormalFiltering, Texture, Wrap};
use steradian_techniques::GpuTechnique;
use steradian_techniques::gpu::Entry;

/// Stages that read an object and its technique.
pub const STAGES: wgpu::ShaderStages = wgpu::ShaderStages::VERTEX_FRAGMENT.union(wgpu::ShaderStages::COMPUTE);

/// Group 1: uniforms, vertices, indices, vertex colours, then the [`textures`].
pub const SLOTS: [Slot; 4 + TEXTURES] = {
    let mut slots = [Slot::Texture; 4 + TEXTURES];
    slots[0] = Slot::Uniform;
    (slots[1], slots[2], slots[3]) = (Slot::Read, Slot::Read, Slot::Read);
    slots
};

/// Textures of an object.
const TEXTURES: usize = 7;

/// What multiplies the radiance, mean normals, their covariance, alpha², albedo, f0, emission.
fn textures(object: &Object) -> [Option<&Texture>; TEXTURES] {
    let maps = &object.maps;
    let normal = maps.normal.as_deref();
    let colours = maps.colours.as_ref();
    [
        object.base_colour.as_deref(),
        normal.map(|n| n.mean()),
        normal.map(|n| n.spread()),
        maps.alpha2.as_deref(),
        colours.map(|c| &*c.albedo),
        colours.map(|c| &*c.f0),
        maps.emission.as_deref(),
    ]
}

/// What the pipelines of an object are made of.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Program {
    /// The technique's library.
    pub library: String,
    /// The function that shades.
    pub entry: Entry,
    /// Are there maps or vertex colours?
    pub mapped: bool,
    /// The text that defines `gpu_direct`.
    pub direct: String,
}

impl Program {
    /// The program of `object`.
    pub fn of(object: &Object) -> Self {
        Self {
            library: steradian_techniques::gpu::library(&object.technique),
            entry: object.technique.entry,
            mapped: object.is_mapped(),
            direct: direct::source(object),
        }
    }
}

/// An object on the device.
pub struct Placed {
    /// Group 0.
    pub technique: TechniqueData,
    /// What its pipelines are made of.
    pub program: Program,
    /// Group 1.
    pub group: wgpu::BindGroup,
    /// Three per triangle.
    pub vertices: u32,
    uniforms: wgpu::Buffer,
    counts: Counts,
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
        let technique = TechniqueData::upload(gpu, &object.technique, STAGES)?;
        let triangles = object.triangles.indices.len() as u32;
        let counts = counts(object, first);
        gpu.scoped("object", || {
            let uniform = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
            let uniforms = filled(gpu, "object", uniform, &uniform_bytes(&object.transform, &counts));
            let t = &object.triangles;
            let read = |label: &str, bytes: &[u8]| filled(gpu, label, wgpu::BufferUsages::STORAGE, bytes);
            let vertices = read("vertices", &bytes(t.vertices.as_flattened()));
            let indices: Vec<u8> =
                t.indices.as_flattened().iter().chain(&t.sites).flat_map(|i| i.to_le_bytes()).collect();
            let indices = read("indices", &indices);
            let colors = t.colors.as_flattened();
            let colors = read("vertex colours", &bytes(if colors.is_empty() { &[1.0; 3] } else { colors }));
            let views = textures(object).map(|t| upload(gpu, t));
            let buffers = [&uniforms, &vertices, &indices, &colors].map(|b| b.as_entire_binding());
            let all: Vec<_> =
                buffers.into_iter().chain(views.iter().map(wgpu::BindingResource::TextureView)).collect();
            let group = layout::group(gpu, layout, &all);
            Self { technique, program: Program::of(object), group, vertices: 3 * triangles, uniforms, counts }
        })
    }

    /// Moves the object.
    pub fn set_transform(&self, gpu: &Gpu, transform: &Affine3A) {
        gpu.queue.write_buffer(&self.uniforms, 0, &uniform_bytes(transform, &self.counts));
    }

    /// Replaces the data of the technique `old` by those of `object`, whose technique has changed; `true` where pipelines
    /// must be made anew.
    pub fn set_technique(
        &mut self,
        gpu: &Gpu,
        old: &GpuTechnique,
        object: &Object,
    ) -> Result<bool, GpuError> {
        self.technique = self.technique.replaced(gpu, old, &object.technique, STAGES)?;
        let program = Program::of(object);
        let changed = program != self.program;
        self.program = program;
        Ok(changed)
    }
}

/// The numbers of `struct GpuObject`: first id, triangles, filtering and 4 with vertex colours; levels, rows and wrap of
/// each texture.
#[derive(Debug, Clone, Copy)]
struct Counts {
    object: [u32; 3],
    images: [[u32; 4]; TEXTURES],
}

fn counts(object: &Object, first: u32) -> Counts {
    let image = |t: &Texture| {
        let [u, v] = t.wrap().map(wrap_word);
        [t.levels().count() as u32, t.size().1 as u32, u | v << 2, 0]
    };
    let filtering = match object.maps.filtering {
        NormalFiltering::None => 0,
        NormalFiltering::Isotropic => 1,
        NormalFiltering::Covariance => 2,
    } + if object.triangles.colors.is_empty() { 0 } else { 4 };
    Counts {
        object: [first, object.triangles.indices.len() as u32, filtering],
        images: textures(object).map(|t| t.map_or([0, 1, 0, 0], image)),
    }
}

/// What `gpu_columns` takes for what lies beyond the unit square.
fn wrap_word(w: Wrap) -> u32 {
    match w {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    }
}

/// `struct GpuObject`.
fn uniform_bytes(transform: &Affine3A, counts: &Counts) -> Vec<u8> {
    let m = transform.matrix3;
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    let normals =
        Mat3A::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis)) * sign;
    let mut floats = glam::Mat4::from(*transform).to_cols_array().to_vec();
    for c in [normals.x_axis, normals.y_axis, normals.z_axis] {
        floats.extend([c.x, c.y, c.z, 0.0]);
    }
    let mut out = bytes(&floats);
    let words = counts.object.iter().copied().chain([u32::from(sign < 0.0)]);
    let words = words.chain(counts.images.iter().flatten().copied());
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
    if object.technique.entry.site && sites != vertices {
        return Err(GpuError::Scene(format!("{} needs a site for every vertex", object.technique.slug)));
    }
    if 48 * vertices as u64 > most || (12 * triangles + 4 * sites) as u64 > most {
        return Err(GpuError::Memory(format!("a mesh of {triangles} triangles")));
    }
    let colors = object.triangles.colors.len();
    if colors != 0 && colors != vertices {
        return Err(GpuError::Scene(format!("a mesh of {vertices} vertices has {colors} vertex colours")));
    }
    textures(object).into_iter().flatten().try_for_each(|t| check_texture(gpu, t))
}

fn check_texture(gpu: &Gpu, texture: &Texture) -> Result<(), GpuError> {
    let rows = texture.levels().map(|(_, height, _)| height).sum();
    let side = texture.size().0.max(rows);
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
        let width = t.size().0;
        let mut out = Level { width, height: 0, texels: Vec::new() };
        for (columns, _, texels) in t.levels() {
            for row in texels.chunks_exact(columns) {
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
