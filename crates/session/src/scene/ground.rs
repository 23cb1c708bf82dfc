//! A plane under an object, as far as the horizon.

use crate::picture::footprint;
use glam::{Vec2, Vec3};
use steradian_scene::{Camera, Mesh};
use steradian_sphere::Frame;

/// Number of triangles around the centre.
const SECTORS: usize = 64;
/// Least radius of the plane, in radii of the object.
const LEAST: f32 = 64.0;
/// Gap between the object and the plane, in radii of the object: a plate that belongs to a mesh would lie in
/// the plane, and pixels show either by chance.
const BELOW: f32 = 1e-4;
/// Gap between the plane's edge and the horizon, in pixels.
const GAP: f32 = 0.25;

/// The plane across the camera's up direction just below the lowest point of `mesh`, in rings of doubling
/// radius. It reaches so far that its end lies within a part of a pixel of the horizon of a picture of `rows`
/// rows. Texture coordinates are metres.
pub(crate) fn under(mesh: &Mesh, camera: &Camera, rows: usize) -> Mesh {
    let (Camera::Pinhole { from, up, .. } | Camera::Orthographic { from, up, .. }) = *camera;
    let up = up.normalize_or(Vec3::Y);
    let (low, high) = mesh.bounds().unwrap_or_default();
    let radius = (0.5 * (high - low).length()).max(1e-6);
    let lowest = mesh.positions.iter().map(|p| p.dot(up)).fold(f32::INFINITY, f32::min);
    let lowest = if lowest.is_finite() { lowest - BELOW * radius } else { 0.0 };
    let middle = 0.5 * (low + high);
    let centre = middle + up * (lowest - middle.dot(up));
    let eye = (from.dot(up) - lowest).max(0.0);
    let pixel = footprint(camera, rows) as f32;
    let reach = if pixel > 0.0 { (eye / (GAP * pixel)).max(LEAST * radius) } else { LEAST * radius };
    let frame = Frame::from_normal(up.as_dvec3());
    let (t, b) = (frame.t.as_vec3(), frame.b.as_vec3());
    let mut plane = Mesh::default();
    let vertex = |plane: &mut Mesh, at: Vec2| {
        plane.positions.push(centre + t * at.x + b * at.y);
        plane.normals.push(up);
        plane.uvs.push(at);
        plane.tangents.push(t.extend(1.0));
    };
    vertex(&mut plane, Vec2::ZERO);
    let (mut r, mut rings) = (radius, 0u32);
    loop {
        for k in 0..SECTORS {
            let angle = std::f32::consts::TAU * k as f32 / SECTORS as f32;
            vertex(&mut plane, Vec2::from_angle(angle) * r);
        }
        rings += 1;
        if r >= reach {
            break;
        }
        r = (2.0 * r).min(reach);
    }
    let n = SECTORS as u32;
    for k in 0..n {
        let next = (k + 1) % n;
        plane.triangles.push([0, 1 + k, 1 + next]);
        for ring in 1..rings {
            let (inner, outer) = (1 + (ring - 1) * n, 1 + ring * n);
            plane.triangles.push([inner + k, outer + k, outer + next]);
            plane.triangles.push([inner + k, outer + next, inner + next]);
        }
    }
    plane
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_scene::{Bvh, Ray, shapes};

    #[test]
    fn the_ground_touches_the_object_and_reaches_the_horizon() {
        let mesh = shapes::by_name("torus").expect("a shape");
        for up in [Vec3::Y, Vec3::Z, Vec3::new(0.6, 0.8, 0.0)] {
            let from = up * 0.7 + Frame::from_normal(up.as_dvec3()).t.as_vec3() * 5.0;
            let camera = Camera::Pinhole { from, at: Vec3::ZERO, up, fov_y: 0.6 };
            let plane = under(&mesh, &camera, 256);
            let lowest = mesh.positions.iter().map(|p| p.dot(up)).fold(f32::INFINITY, f32::min);
            let (low, high) = mesh.bounds().expect("a mesh");
            let level = lowest - 0.5 * BELOW * (high - low).length();
            assert!(plane.positions.iter().all(|p| (p.dot(up) - level).abs() < 1e-5 * p.length().max(1.0)));
            for t in &plane.triangles {
                let [a, b, c] = t.map(|i| plane.positions[i as usize]);
                assert!((b - a).cross(c - a).dot(up) > 0.0, "faces up");
            }
            // All around, half a pixel below the horizon is ground, and above it none.
            let bvh = Bvh::build(&plane);
            let frame = Frame::from_normal(up.as_dvec3());
            let pixel = footprint(&camera, 256) as f32;
            for k in 0..97 {
                let level = Vec2::from_angle(k as f32);
                let level = frame.t.as_vec3() * level.x + frame.b.as_vec3() * level.y;
                let seen = |angle: f32| {
                    let ray = Ray { origin: from, direction: (level + up * angle.tan()).normalize() };
                    bvh.closest(&ray, f32::INFINITY).is_some()
                };
                assert!(seen(-0.5 * pixel) && seen(-0.1) && seen(-0.7) && !seen(0.1 * pixel), "{up} {k}");
            }
        }
    }
}
