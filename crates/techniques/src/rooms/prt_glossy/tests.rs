use super::*;
use crate::trial::Certified;
use crate::trial::{at_vertices, farthest, on_mesh};
use glam::Mat3;
use steradian_scene::{Mesh, shapes};

const SPEC: &str = "phong:n=5";

fn bake(lights: &Lights, mesh: &Mesh, params: &[(&str, f64)]) -> Box<dyn crate::AnyBake> {
    on_mesh("prt_glossy", lights, SPEC, mesh, params)
}

fn ring() -> Mesh {
    shapes::torus(0.7, 0.3, 24)
}

/// Against paths through the mesh the error falls with the bands.
#[test]
fn errors_fall_with_the_bands() {
    let mesh = ring();
    let light = lights::smooth();
    let errors = [2.0, 3.0, 5.0].map(|bands| {
        let b = bake(&light, &mesh, &[("bands", bands)]);
        assert!(b.certified().metric.contains("points of the mesh"));
        b.certified().figure("error, mean of the probes").unwrap()
    });
    assert!(errors.windows(2).all(|w| w[1] < 0.8 * w[0]), "{errors:?}");
    // The remaining error is that of interpolation between vertices.
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
    // The two bakes cast different rays: each is within the precision, times the light.
    assert!(far < 5e-3, "{far}");
}

/// Half precision changes radiance by its rounding alone.
#[test]
fn halves_round() {
    let mesh = ring();
    let light = lights::smooth();
    let [singles, halves] = [0.0, 1.0].map(|h| at_vertices(&*bake(&light, &mesh, &[("halves", h)]), &mesh));
    let far = farthest(&singles, &halves);
    assert!(far > 0.0 && far < 3e-3, "{far}");
}

/// A ball seen along its normals in constant light: ∫ (n·w)₊ⁿ dw = 2π/(n + 1), whatever the number of bands:
/// by parity, the half space folds the part of the lobe's series below the horizon onto the upper one.
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
    crate::trial::points_without_sites_are_black(&*bake(&lights::furnace(), &ring(), &[]));
}

/// A reflectance other than phong, by a table, gives at the vertices what `prt_brdf` gives, whose matrices
/// include the rotation into the sites' frames; for one channel and for three.
#[test]
fn tables_shade_what_turned_matrices_do() {
    let mesh = ring();
    for spec in ["ggx:alpha=0.4,f0=0.9", "ggx:alpha=0.3,f0=0.9/0.6/0.3", "lambert:albedo=0.8/0.5/0.2"] {
        let params = [("precision", 0.02), ("size", 64.0)];
        let with = |slug: &str, more: &[(&str, f64)]| {
            let all: Vec<(&str, f64)> = params.iter().chain(more).copied().collect();
            at_vertices(&*on_mesh(slug, &lights::smooth(), spec, &mesh, &all), &mesh)
        };
        let want = with("prt_brdf", &[]);
        let largest = want.iter().flatten().fold(0.0f32, |m, x| m.max(x.abs()));
        let far = farthest(&with("prt_glossy", &[("halves", 0.0)]), &want);
        assert!(far < 2e-4 * largest, "{spec}: {far} of {largest}");
        let far = farthest(&with("clustered_pca", &[("clusters", 2048.0), ("components", 16.0)]), &want);
        assert!(far < 2e-3 * largest, "{spec}, clustered: {far} of {largest}");
    }
}

/// On a ball nothing is blocked, and every band count of a table shades as `sh_brdf` does.
#[test]
fn a_ball_is_shaded_as_in_the_open() {
    let mesh = shapes::icosphere(2);
    for bands in [3.0, 6.0, 8.0] {
        let spec = "ggx:alpha=0.5,f0=0.9/0.6/0.3";
        let glossy = [("bands", bands), ("precision", 1e-3), ("halves", 0.0), ("size", 64.0)];
        let open = [("bands", bands), ("size", 64.0), ("lights", 0.0)];
        let got = at_vertices(&*on_mesh("prt_glossy", &lights::smooth(), spec, &mesh, &glossy), &mesh);
        let want = at_vertices(&*on_mesh("sh_brdf", &lights::smooth(), spec, &mesh, &open), &mesh);
        let largest = want.iter().flatten().fold(0.0f32, |m, x| m.max(x.abs()));
        let far = farthest(&got, &want);
        assert!(far < 0.02 * largest, "{bands}: {far} of {largest}");
    }
}

/// Only `phong` accepts few bands, and the message of refusal says so.
#[test]
fn tables_want_three_bands() {
    let m = Material::new(steradian_brdf::parse("ggx:alpha=0.4").unwrap());
    let said = Glossy::bake("prt_glossy", &m, 2, 64, &Task::quiet()).err().unwrap().to_string();
    assert!(said.contains("3 bands at least") && said.contains("not 2"), "{said}");
}
