//! The meshes of a figure.

use super::say;
use anyhow::Result;
use glam::{Affine3A, Vec3};
use steradian_formats::Limits;
use steradian_scene::{Mesh, shapes};
use steradian_testkit::data_dir;

/// `file` of the data folder's meshes, else a shape.
pub fn of(file: &str, stand_in: impl FnOnce() -> Mesh) -> Result<Mesh> {
    match data_dir().map(|d| d.join("meshes").join(file)).filter(|p| p.exists()) {
        Some(path) => Ok(steradian_scene::load(&path, &Limits::default())?.merged()),
        None => {
            say(&format!("no meshes/{file} (STERADIAN_DATA): a built-in shape stands in"));
            Ok(stand_in())
        }
    }
}

/// A knot, where meshes are missing.
pub fn knot() -> Mesh {
    shapes::knot(2, 3, 1.0, 0.45, 0.28, 160)
}

/// A bust that looks towards the viewer, along +Z (its file's looks along −Z).
pub fn bust() -> Result<Mesh> {
    Ok(of("max_planck_decimated.obj", knot)?.transformed(&Affine3A::from_rotation_y(std::f32::consts::PI)))
}

/// A bunny that stands on a plate.
pub fn bunny() -> Result<Mesh> {
    let knot = || Mesh::merged(&[shapes::knot(2, 3, 0.55, 0.25, 0.18, 160), shapes::plane(3.2, -0.62, 8)]);
    of("bunny_pedestal.ply", knot)
}

/// A mesh brushed along the projection of a constant vector.
pub fn brushed(mut mesh: Mesh, along: Vec3) -> Mesh {
    let tangent =
        |n: &Vec3| (along - *n * n.dot(along)).try_normalize().unwrap_or(n.any_orthonormal_vector());
    mesh.tangents = mesh.normals.iter().map(|n| tangent(n).extend(1.0)).collect();
    mesh.materials.clear();
    mesh
}
