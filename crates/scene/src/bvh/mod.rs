//! Ray casting.

mod triangle;

use crate::{Mesh, Ray};
use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use triangle::Shear;

/// Where a ray meets a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the (unit) direction.
    pub t: f32,
    /// Index of the triangle in [`Mesh::triangles`].
    pub triangle: u32,
    /// Weight of the triangle's second vertex.
    pub u: f32,
    /// Weight of the triangle's third vertex; the first has 1 − u − v.
    pub v: f32,
}

/// A bounding volume hierarchy over the triangles of a mesh. Both sides of a triangle block.
#[derive(Clone)]
pub struct Bvh {
    tree: Bvh2,
    triangles: Vec<[[f32; 3]; 3]>,
}

impl Bvh {
    /// The hierarchy of `mesh`. Triangles with an index out of range are left out.
    pub fn build(mesh: &Mesh) -> Self {
        let corner = |i: u32| mesh.positions.get(i as usize).copied().unwrap_or(Vec3::NAN);
        let corners: Vec<[Vec3; 3]> = mesh.triangles.iter().map(|t| t.map(corner)).collect();
        let boxes: Vec<Aabb> = corners.iter().map(|t| Aabb::from_points(&t.map(Vec3A::from))).collect();
        let tree = build_bvh2(&boxes, obvhs::BvhBuildParams::medium_build(), &mut Default::default());
        Self { tree, triangles: corners.into_iter().map(|t| t.map(|p| p.to_array())).collect() }
    }

    /// The nearest hit at a distance in (0, `t_max`).
    pub fn closest(&self, ray: &Ray, t_max: f32) -> Option<Hit> {
        let shear = Shear::new(ray.origin, ray.direction);
        let mut best: Option<Hit> = None;
        let r = ObvhsRay::new(ray.origin.into(), ray.direction.into(), 0.0, t_max);
        self.tree.ray_traverse(r, &mut RayHit::none(), |r, id| {
            let triangle = self.tree.primitive_indices[id];
            match shear.hit(self.triangles[triangle as usize], r.tmax) {
                Some([t, u, v]) => {
                    best = Some(Hit { t, triangle, u, v });
                    t
                }
                None => f32::INFINITY,
            }
        });
        best
    }

    /// Is there any hit at a distance in (0, `t_max`)?
    pub fn occluded(&self, ray: &Ray, t_max: f32) -> bool {
        let shear = Shear::new(ray.origin, ray.direction);
        let r = ObvhsRay::new(ray.origin.into(), ray.direction.into(), 0.0, t_max);
        !self.tree.ray_traverse_miss(r, |r, id| {
            let triangle = self.tree.primitive_indices[id] as usize;
            shear.hit(self.triangles[triangle], r.tmax).map_or(f32::INFINITY, |h| h[0])
        })
    }
}
