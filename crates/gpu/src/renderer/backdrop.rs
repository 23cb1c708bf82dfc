//! The backdrop on the device.

use super::object::{STAGES, picture};
use crate::layout::{self, Slot, filled};
use crate::packed::{BORDER, backdrop_uniforms, bordered, bytes, disks};
use crate::scene::{Backdrop, Level};
use crate::{Gpu, GpuError};

/// The backdrop on the device: group 0 of its pipelines.
pub struct Behind {
    pub layout: wgpu::BindGroupLayout,
    pub group: wgpu::BindGroup,
}

impl Behind {
    /// Uploads `backdrop`.
    pub fn new(gpu: &Gpu, backdrop: &Backdrop) -> Result<Self, GpuError> {
        if let Some(image) = &backdrop.image {
            check(gpu, image)?;
        }
        gpu.scoped("backdrop", || Self::make(gpu, backdrop))
    }

    fn make(gpu: &Gpu, backdrop: &Backdrop) -> Self {
        let layout = layout::layout(gpu, STAGES, &[Slot::Uniform, Slot::Texture, Slot::Read]);
        let none = Level { width: 1, height: 1, texels: vec![[0.0; 3]] };
        let image = picture(gpu, &[bordered(backdrop.image.as_ref().unwrap_or(&none))]);
        let uniforms = filled(gpu, "backdrop", wgpu::BufferUsages::UNIFORM, &backdrop_uniforms(backdrop));
        let disks = filled(gpu, "disks", wgpu::BufferUsages::STORAGE, &bytes(disks(backdrop).as_flattened()));
        let group = layout::group(
            gpu,
            &layout,
            &[
                uniforms.as_entire_binding(),
                wgpu::BindingResource::TextureView(&image),
                disks.as_entire_binding(),
            ],
        );
        Self { layout, group }
    }
}

fn check(gpu: &Gpu, image: &Level) -> Result<(), GpuError> {
    let side = image.width.max(image.height).saturating_add(2 * BORDER);
    if image.width == 0 || image.height == 0 || image.texels.len() != image.width * image.height {
        return Err(GpuError::Scene("the backdrop's image has not as many texels as it says".into()));
    }
    if side > gpu.device.limits().max_texture_dimension_2d as usize {
        return Err(GpuError::Memory(format!("a backdrop with {side} texels a side")));
    }
    Ok(())
}
