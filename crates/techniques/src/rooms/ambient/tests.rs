use super::*;
use crate::trial::Certified;
use crate::{PointsBuf, Sites, find};
use glam::{Vec2, Vec3};
use std::sync::Arc;
use steradian_base::ParamValues;
use steradian_scene::{Mesh, shapes};

/// On the floor at distance d from a long wall of height h, ao = ½(1 + d/√(d² + h²)); a constant light of
/// radiance 1 gives albedo times that.
#[test]
fn beside_a_wall_it_is_the_closed_form() {
    let wall = shapes::cuboid([0.1, 2.0, 2000.0], 1);
    let point = Vec3::new(1.05, 0.0, 0.0);
    let (p, n): (Arc<[Vec3]>, Arc<[Vec3]>) = ([point].into(), [Vec3::Y].into());
    let geometry = Geometry::new(Arc::new(Mesh::merged(&[wall])), Sites::Points { p, n });
    let material = Material::new(steradian_brdf::parse("lambert:albedo=0.5").unwrap());
    let b = find("ambient")
        .unwrap()
        .draft(
            &lights::furnace(),
            &material,
            Some(&geometry),
            &ParamValues::from_iter([("precision", 5e-4)]),
            &Task::quiet(),
        )
        .unwrap();
    let mut q = PointsBuf::default();
    q.push(Vec3::Y, Vec3::X, Vec3::Y, point);
    q.locate(Vec2::ZERO, [0; 3], [0.0; 2]);
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    let exact = 0.5 * 0.5 * (1.0 + 1.0 / 2f32.sqrt());
    assert!((rgb[0][0] - exact).abs() < 5e-4, "{} {exact}", rgb[0][0]);
    assert!(b.certified().error < 0.01, "{}", b.certified().error);
}
