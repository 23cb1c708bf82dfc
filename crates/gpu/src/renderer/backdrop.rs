//! The backdrop on the device.

use super::object::{STAGES, picture};
use crate::layout::{self, Slot, bytes, filled};
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
        let [r, g, b] = backdrop.colour;
        let mut uniforms = bytes(&[r, g, b, 0.0]);
        let counts = [backdrop.disks.len() as u32, u32::from(backdrop.image.is_some()), 0, 0];
        uniforms.extend(counts.into_iter().flat_map(u32::to_le_bytes));
        let uniforms = filled(gpu, "backdrop", wgpu::BufferUsages::UNIFORM, &uniforms);
        let mut disks: Vec<f32> = Vec::new();
        for d in &backdrop.disks {
            disks.extend(d.direction.extend(d.angular_radius).to_array());
            disks.extend([d.radiance[0], d.radiance[1], d.radiance[2], 0.0]);
        }
        disks.resize(disks.len().max(8), 0.0);
        let disks = filled(gpu, "disks", wgpu::BufferUsages::STORAGE, &bytes(&disks));
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

/// Texels beyond each side that the bicubic lookup reads.
const BORDER: usize = 2;

/// The image with its border: columns go on around the seam, a row beyond a pole is the row reflected and turned by
/// half a turn (for odd widths the mean of two columns).
fn bordered(image: &Level) -> Level {
    let (w, h) = (image.width as isize, image.height as isize);
    let row = |j: isize, i: isize| image.texels[(j * w + i.rem_euclid(w)) as usize];
    let texel = |j: isize, i: isize| {
        if (0..h).contains(&j) {
            return row(j, i);
        }
        let beyond = if j < 0 { -1 - j } else { 2 * h - 1 - j }.clamp(0, h - 1);
        let (a, b) = (row(beyond, i + w / 2), row(beyond, i + (w + 1) / 2));
        std::array::from_fn(|c| 0.5 * (a[c] + b[c]))
    };
    let border = BORDER as isize;
    let texels = (-border..h + border).flat_map(|j| (-border..w + border).map(move |i| (j, i)));
    Level {
        width: image.width + 2 * BORDER,
        height: image.height + 2 * BORDER,
        texels: texels.map(|(j, i)| texel(j, i)).collect(),
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
