use super::*;
use crate::AnyBake;
use crate::trial::Certified;
use crate::trial::{at_vertices, detail, farthest, on_mesh, points_without_sites_are_black};
use glam::Mat3;
use steradian_scene::{Mesh, shapes};

fn bake(spec: &str, mesh: &Mesh, params: &[(&str, f64)]) -> Box<dyn AnyBake> {
    on_mesh("matrix_radiance_transfer", &lights::smooth(), spec, mesh, params)
}

/// Lambert's radiance is one number for all views: that of diffuse transfer, up to the bands of the cosine.
#[test]
fn lambert_s_rows_are_diffuse_transfer() {
    let mesh = shapes::torus(0.7, 0.3, 12);
    let b = bake("lambert:albedo=0.5", &mesh, &[("components", 16.0)]);
    assert!(detail(&*b, "error of the matrices") < 2e-3, "{}", detail(&*b, "error of the matrices"));
    let got = at_vertices(&*b, &mesh);
    let want =
        at_vertices(&*on_mesh("prt_diffuse", &lights::smooth(), "lambert:albedo=0.5", &mesh, &[]), &mesh);
    let most = want.iter().flatten().fold(0.0f32, |m, x| m.max(*x));
    let far = farthest(&got, &want);
    assert!(far < 0.03 * most, "{far} of {most}");
}

/// Against paths through the mesh, with a rough glossy reflectance.
#[test]
fn certificates_hold_paths_against_it() {
    let mesh = shapes::torus(0.7, 0.3, 24);
    let b = bake("ggx:alpha=0.5,f0=0.9", &mesh, &[]);
    assert!(b.certified().error < 0.15, "{}", b.certified().error);
}

#[test]
fn errors_fall_with_components_and_turned_lights_are_turned_objects() {
    let mesh = shapes::torus(0.7, 0.3, 12);
    let errors = [(1.0, 4.0), (1.0, 16.0), (32.0, 16.0)].map(|(clusters, components)| {
        let b = bake("ggx:alpha=0.5,f0=0.9", &mesh, &[("clusters", clusters), ("components", components)]);
        detail(&*b, "error of the matrices")
    });
    assert!(errors.windows(2).all(|w| w[1] < w[0]), "{errors:?}");
    let r = Mat3::from_rotation_z(0.9) * Mat3::from_rotation_x(0.4);
    let params = [("clusters", 2048.0), ("precision", 2e-3)];
    let mut b = bake("lambert:albedo=0.5", &mesh, &params);
    b.frame(&View { light_rotation: r.transpose(), ..View::default() });
    let back = at_vertices(&*b, &mesh);
    let moved = mesh.transformed(&glam::Affine3A::from_mat3(r));
    let far = farthest(&back, &at_vertices(&*bake("lambert:albedo=0.5", &moved, &params), &moved));
    assert!(far < 5e-3, "{far}");
}

#[test]
fn points_without_sites_stay_black() {
    points_without_sites_are_black(&*bake("lambert:albedo=0.5", &shapes::torus(0.7, 0.3, 8), &[]));
}
