use super::*;
use crate::shared::trial::{at_vertices, farthest, on_mesh};
use glam::Mat3;
use steradian_scene::{Mesh, shapes};

const SPEC: &str = "phong:n=5";

fn bake(lights: &Lights, mesh: &Mesh, params: &[(&str, f64)]) -> Box<dyn crate::AnyBake> {
    on_mesh("prt_glossy", lights, SPEC, mesh, params)
}

fn ring() -> Mesh {
    shapes::torus(0.7, 0.3, 24)
}

/// Against paths through the mesh: what is lost falls with the bands.
#[test]
fn errors_fall_with_the_bands() {
    let mesh = ring();
    let light = lights::smooth();
    let errors = [2.0, 3.0, 5.0].map(|bands| {
        let b = bake(&light, &mesh, &[("bands", bands)]);
        assert!(b.certificate().metric.contains("points of the mesh"));
        b.certificate().figure("error, mean of the probes").unwrap()
    });
    assert!(errors.windows(2).all(|w| w[1] < 0.8 * w[0]), "{errors:?}");
    // What is left is lost between vertices.
    assert!(errors[2] < 0.08, "{errors:?}");
}

/// Light turned in a frame is the light turned at bake time; the object turned is the light turned back.
#[test]
fn objects_turned_are_lights_turned_back() {
    let r = Mat3::from_rotation_z(0.9) * Mat3::from_rotation_x(0.4);
    let mesh = ring();
    let light = lights::smooth();
    let params = [("precision", 1e-3), ("halves", 0.0)];
    let mut b = bake(&light, &mesh, &params);
    b.frame(&View { light_rotation: r.transpose(), ..View::default() });
    let turned_back = at_vertices(&*b, &mesh);
    let moved = mesh.transformed(&glam::Affine3A::from_mat3(r));
    let turned = at_vertices(&*bake(&light, &moved, &params), &moved);
    let far = farthest(&turned_back, &turned);
    // Rays of their own: each within the precision, times the light.
    assert!(far < 5e-3, "{far}");
}

/// Half precision changes what is shaded by its rounding alone.
#[test]
fn halves_round() {
    let mesh = ring();
    let light = lights::smooth();
    let [singles, halves] = [0.0, 1.0].map(|h| at_vertices(&*bake(&light, &mesh, &[("halves", h)]), &mesh));
    let far = farthest(&singles, &halves);
    assert!(far > 0.0 && far < 3e-3, "{far}");
}

/// A ball seen along its normals in constant light: ∫ (n·w)₊ⁿ dw = 2π/(n + 1), whatever the bands, because the half space
/// turns what the lobe has below the horizon by parity.
#[test]
fn a_furnace_is_the_integral_of_the_lobe() {
    let mesh = shapes::icosphere(2);
    let b = bake(&lights::furnace(), &mesh, &[("precision", 1e-3), ("halves", 0.0), ("bands", 8.0)]);
    let want = 2.0 * std::f32::consts::PI / 6.0;
    for l in at_vertices(&*b, &mesh) {
        assert!((l[0] - want).abs() < 5e-3, "{l:?} {want}");
    }
}

/// Points without sites are black, and none beyond the end is read.
#[test]
fn points_without_sites_are_black() {
    crate::shared::trial::points_without_sites_are_black(&*bake(&lights::furnace(), &ring(), &[]));
}
