//! An object on the device.

use crate::layout::{self, Slot, filled};
use crate::packed::{Counts, TEXTURES, bytes, stack, textures};
use crate::program::Program;
use crate::scene::{Level, Object};
use crate::{Gpu, GpuError, TechniqueData};
use glam::Affine3A;
use steradian_scene::surface::Texture;
use steradian_technique::GpuTechnique;

/// Stages that read an object and its technique.
pub const STAGES: wgpu::ShaderStages = wgpu::ShaderStages::VERTEX_FRAGMENT.union(wgpu::ShaderStages::COMPUTE);

/// Group 1: uniforms, vertices, indices, vertex colours, then the [`textures`].
pub const SLOTS: [Slot; 4 + TEXTURES] = {
    let mut slots = [Slot::Texture; 4 + TEXTURES];
    slots[0] = Slot::Uniform;
    (slots[1], slots[2], slots[3]) = (Slot::Read, Slot::Read, Slot::Read);
    slots
};

/// An object on the device.
pub struct Placed {
    /// Group 0.
    pub technique: TechniqueData,
    /// Program from which its pipelines are made.
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
        let counts = Counts::of(object, first);
        gpu.scoped("object", || {
            let uniform = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
            let uniforms = filled(gpu, "object", uniform, &counts.uniforms(&object.transform));
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
        gpu.queue.write_buffer(&self.uniforms, 0, &self.counts.uniforms(transform));
    }

    /// Replaces the data of the technique `old` by those of `object`, whose technique has changed; `true`
    /// where pipelines must be made anew.
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

fn upload(gpu: &Gpu, texture: Option<&Texture>) -> wgpu::TextureView {
    picture(gpu, std::slice::from_ref(&stack(texture)))
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
