//! The camera's uniforms.

use crate::scene::{Path, Rate, Scene, Settings};
use glam::{Mat4, Vec3, Vec4};
use steradian_scene::Camera;

/// Nearest visible distance relative to the scene's extent, too near to matter in pictures.
const NEAR: f32 = 1e-5;

/// `struct GpuCamera` for `scene` as `settings` show it.
pub fn uniforms(scene: &Scene, settings: &Settings) -> Vec<u8> {
    let (w, h) = (settings.width as f32, settings.height as f32);
    let [right, up, forward] = scene.camera.axes();
    let (from, parallel, unit, spacing, pixel) = match scene.camera {
        Camera::Pinhole { from, fov_y, .. } => {
            let unit = 2.0 * (0.5 * fov_y).tan();
            (from, 0.0, unit, unit / h, unit / h)
        }
        Camera::Orthographic { from, height, .. } => (from, 1.0, height, height / h, 0.0),
    };
    let projection = projection(&scene.camera, [right, up, forward], farthest(scene, from, forward), w / h);
    let turn = scene.light_rotation.transpose();
    let mut floats = projection.to_cols_array().to_vec();
    for v in [from.extend(parallel), right.extend(unit), up.extend(spacing), forward.extend(pixel)] {
        floats.extend(v.to_array());
    }
    floats.extend([w, h, settings.grid() as f32, footprint(settings)]);
    for column in [turn.x_axis, turn.y_axis, turn.z_axis] {
        floats.extend(column.extend(0.0).to_array());
    }
    floats.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// Side, in pixels, of the square that one shaded point covers.
fn footprint(settings: &Settings) -> f32 {
    let texel = 1.0 / settings.scale as f32;
    match (settings.rate, settings.path) {
        (Rate::Sample, _) => 0.5 * texel,
        (Rate::Pixel, Path::Raster) => texel,
        (Rate::Pixel, Path::Compute) => 1.0,
    }
}

/// Largest distance of any object along `forward`.
fn farthest(scene: &Scene, from: Vec3, forward: Vec3) -> f32 {
    let corners =
        scene.objects.iter().filter_map(|o| Some((o, o.triangles.bounds()?))).flat_map(|(o, (lo, hi))| {
            (0..8).map(move |i| {
                let pick = glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0);
                o.transform.transform_point3(Vec3::select(pick, lo, hi))
            })
        });
    corners.map(|p| (p - from).dot(forward)).fold(1e-6, f32::max)
}

/// World → clip. Depth is reversed: 1 near, 0 infinitely far (perspective) or behind the last object.
fn projection(camera: &Camera, [right, up, forward]: [Vec3; 3], far: f32, aspect: f32) -> Mat4 {
    let row = |axis: Vec3, from: Vec3, scale: f32| (axis * scale).extend(-axis.dot(from) * scale);
    let rows = match *camera {
        Camera::Pinhole { from, fov_y, .. } => {
            let s = 1.0 / (0.5 * fov_y).tan();
            let along = row(forward, from, 1.0);
            [row(right, from, s / aspect), row(up, from, s), Vec4::W * (far * NEAR), along]
        }
        Camera::Orthographic { from, height, .. } => {
            let s = 2.0 / height;
            let depth = Vec4::W - row(forward, from, 1.0 / (1.01 * far));
            [row(right, from, s / aspect), row(up, from, s), depth, Vec4::W]
        }
    };
    Mat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_under_a_pixel_s_ray_projects_to_that_pixel() {
        let (from, at, up) = (Vec3::new(1.0, 2.0, 5.0), Vec3::new(0.2, 0.0, -0.3), Vec3::Y);
        for camera in
            [Camera::Pinhole { from, at, up, fov_y: 0.7 }, Camera::Orthographic { from, at, up, height: 3.0 }]
        {
            let m = projection(&camera, camera.axes(), 20.0, 2.0);
            for (x, y) in [(0.0, 0.0), (137.5, 20.25), (200.0, 100.0)] {
                let ray = camera.ray(x, y, 200, 100);
                let c = m * (ray.origin + ray.direction * 4.0).extend(1.0);
                let seen = (100.0 * (1.0 + c.x / c.w), 50.0 * (1.0 - c.y / c.w));
                assert!((seen.0 - x).abs() < 1e-3 && (seen.1 - y).abs() < 1e-3, "{seen:?}");
                assert!((0.0..1.0).contains(&(c.z / c.w)));
            }
        }
    }
}
