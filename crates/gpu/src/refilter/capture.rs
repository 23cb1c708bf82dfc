//! The scene around a point, captured into a cube by six renders.

use super::surroundings::{Surroundings, fits};
use crate::layout::empty;
use crate::{Gpu, GpuError, Renderer};
use glam::Vec3;
use steradian_scene::Camera;

/// Directions of the faces +X −X +Y −Y +Z −Z, and the up of the camera that looks along each: the Khronos
/// orientation but for left and right, which a cube seen from inside exchanges and the shader exchanges back.
const FACES: [(Vec3, Vec3); 6] = [
    (Vec3::X, Vec3::Y),
    (Vec3::NEG_X, Vec3::Y),
    (Vec3::Y, Vec3::NEG_Z),
    (Vec3::NEG_Y, Vec3::Z),
    (Vec3::Z, Vec3::Y),
    (Vec3::NEG_Z, Vec3::Y),
];

impl Surroundings {
    /// Captures `renderer`'s scene from the point `from`, at the renderer's resolution (which must be
    /// square); the pictures stay on the device, and the camera is restored. The scene's own surfaces are lit
    /// by their techniques, so that captures alternating with refilters propagate light from one surface to
    /// the next.
    pub fn captured(gpu: &Gpu, renderer: &mut Renderer, from: Vec3) -> Result<Self, GpuError> {
        let (_, [width, height]) = renderer.film();
        if width != height {
            return Err(GpuError::Scene(format!("a capture of {width} x {height} pixels is not square")));
        }
        let face = 16 * (width * width) as u64;
        fits(gpu, 6 * face)?;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let texels = gpu.scoped("capture", || empty(gpu, "capture", usage, 6 * face))?;
        let before = renderer.camera();
        let mut result = Ok(());
        for (k, (forward, up)) in (0..).zip(FACES) {
            let fov_y = std::f32::consts::FRAC_PI_2;
            renderer.set_camera(gpu, Camera::Pinhole { from, at: from + forward, up, fov_y });
            result = result.and_then(|()| renderer.draw(gpu).map(|_| ())).and_then(|()| {
                gpu.scoped("capture", || {
                    let mut encoder = gpu.device.create_command_encoder(&Default::default());
                    encoder.copy_buffer_to_buffer(renderer.film().0, 0, &texels, k * face, face);
                    gpu.queue.submit([encoder.finish()]);
                })
            });
        }
        renderer.set_camera(gpu, before);
        result.map(|()| Self::of_faces(texels, width))
    }
}
