//! Targets of samples, from which pixels are made.

use crate::layout::empty;
use crate::scene::{Depth, Path, Settings};
use crate::{Gpu, GpuError};

/// Samples of a texel in the raster path.
const MULTISAMPLES: u32 = 4;

/// Textures and buffers of one size of picture.
pub struct Target {
    pub settings: Settings,
    /// Format of the colour.
    pub format: wgpu::TextureFormat,
    /// Linear colour and coverage.
    pub colour: wgpu::TextureView,
    /// Depth, with as many samples as the target of the raster pass.
    pub depth: wgpu::TextureView,
    /// Triangles of the compute path.
    pub ids: Option<wgpu::TextureView>,
    /// Pixels: vec4 each.
    pub film: wgpu::Buffer,
    /// Number of clipped samples.
    pub clipped: wgpu::Buffer,
    /// Read-back of both.
    pub copy: wgpu::Buffer,
}

impl Target {
    /// Everything for `settings`.
    pub fn new(gpu: &Gpu, settings: &Settings) -> Result<Self, GpuError> {
        check(gpu, settings)?;
        gpu.scoped("picture", || Self::make(gpu, settings))
    }

    fn make(gpu: &Gpu, settings: &Settings) -> Self {
        let raster = settings.path == Path::Raster;
        let format = match settings.depth {
            Depth::Best if !raster || gpu.multisamples_floats() => wgpu::TextureFormat::Rgba32Float,
            _ => wgpu::TextureFormat::Rgba16Float,
        };
        let samples = if raster { MULTISAMPLES } else { 1 };
        let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let read = wgpu::TextureUsages::TEXTURE_BINDING;
        let drawn = if raster { attachment | read } else { wgpu::TextureUsages::STORAGE_BINDING | read };
        let size = pixels(settings);
        Self {
            settings: *settings,
            format,
            colour: texture(gpu, settings, format, samples, drawn),
            depth: texture(gpu, settings, wgpu::TextureFormat::Depth32Float, samples, attachment),
            ids: (!raster)
                .then(|| texture(gpu, settings, wgpu::TextureFormat::R32Uint, 1, attachment | read)),
            film: empty(gpu, "film", wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC, size),
            clipped: empty(
                gpu,
                "clipped",
                wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
                4,
            ),
            copy: empty(
                gpu,
                "read-back",
                wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                size + 4,
            ),
        }
    }

    /// A texture of as many samples as the depth has, to draw to and to read.
    pub fn counts(&self, gpu: &Gpu, format: wgpu::TextureFormat) -> wgpu::TextureView {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
        texture(gpu, &self.settings, format, self.samples(), usage)
    }

    /// Samples of a texel.
    pub fn samples(&self) -> u32 {
        if self.ids.is_some() { 1 } else { MULTISAMPLES }
    }

    /// Format, samples and depth test of objects (`solid`) or the backdrop in the raster pass.
    pub fn drawn(&self, solid: bool) -> crate::layout::Drawn {
        let format = if self.ids.is_some() { wgpu::TextureFormat::R32Uint } else { self.format };
        crate::layout::Drawn { format, samples: self.samples(), solid }
    }
}

/// Bytes of the film.
pub fn pixels(settings: &Settings) -> u64 {
    16 * settings.width as u64 * settings.height as u64
}

fn texture(
    gpu: &Gpu,
    settings: &Settings,
    format: wgpu::TextureFormat,
    sample_count: u32,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureView {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("target"),
        size: wgpu::Extent3d {
            width: (settings.width * settings.grid()) as u32,
            height: (settings.height * settings.grid()) as u32,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn check(gpu: &Gpu, settings: &Settings) -> Result<(), GpuError> {
    let (w, h) = (settings.width, settings.height);
    let limits = gpu.device.limits();
    let beyond = |what: String| Err(GpuError::Memory(what));
    if w == 0 || h == 0 || !(1..=4).contains(&settings.scale) {
        return beyond(format!("a picture of {w} x {h} pixels at scale {}", settings.scale));
    }
    let side = w.max(h).saturating_mul(settings.grid());
    if side > limits.max_texture_dimension_2d as usize {
        return beyond(format!("a target with {side} texels a side"));
    }
    if pixels(settings) + 4 > limits.max_buffer_size.min(limits.max_storage_buffer_binding_size) {
        return beyond(format!("a picture of {w} x {h} pixels"));
    }
    Ok(())
}
