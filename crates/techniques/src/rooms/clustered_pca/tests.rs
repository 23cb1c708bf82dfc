use super::*;
use crate::AnyBake;
use crate::trial::{at_vertices, detail, farthest, on_mesh, points_without_sites_are_black};
use steradian_scene::{Mesh, shapes};

const SPEC: &str = "phong:n=5";

fn bake(mesh: &Mesh, params: &[(&str, f64)]) -> Box<dyn AnyBake> {
    on_mesh("clustered_pca", &lights::smooth(), SPEC, mesh, params)
}

fn ring() -> Mesh {
    shapes::torus(0.7, 0.3, 24)
}

fn rms(a: &[[f32; 3]], b: &[[f32; 3]]) -> f32 {
    let square = |v: [f32; 3]| v.iter().map(|x| x * x).sum::<f32>();
    let off: f32 = a.iter().zip(b).map(|(a, b)| square([0, 1, 2].map(|c| a[c] - b[c]))).sum();
    (off / b.iter().map(|b| square(*b)).sum::<f32>()).sqrt()
}

/// With a cluster for every few sites, and as many components, the compression is lossless: shading from
/// clusters equals shading from reconstructed matrices.
#[test]
fn enough_components_are_the_matrices() {
    let mesh = shapes::torus(0.7, 0.3, 10);
    let full = on_mesh("prt_glossy", &lights::smooth(), SPEC, &mesh, &[("halves", 0.0)]);
    let b = bake(&mesh, &[("clusters", 2048.0), ("components", 16.0)]);
    assert!(detail(&*b, "error of the matrices") < 2e-6, "{}", detail(&*b, "error of the matrices"));
    let far = farthest(&at_vertices(&*b, &mesh), &at_vertices(&*full, &mesh));
    assert!(far < 1e-4, "{far}");
}

/// The stated error of the matrices falls with clusters and components, and so does that of shading.
#[test]
fn errors_fall_with_clusters_and_components() {
    let mesh = ring();
    let full =
        at_vertices(&*on_mesh("prt_glossy", &lights::smooth(), SPEC, &mesh, &[("halves", 0.0)]), &mesh);
    let mut last = [f64::INFINITY; 2];
    for (clusters, components) in [(1.0, 0.0), (1.0, 8.0), (16.0, 8.0), (64.0, 12.0)] {
        let b = bake(&mesh, &[("clusters", clusters), ("components", components)]);
        let now = [detail(&*b, "error of the matrices"), f64::from(rms(&at_vertices(&*b, &mesh), &full))];
        assert!(now[0] < last[0] && now[1] < last[1], "{clusters} {components}: {now:?} {last:?}");
        last = now;
    }
    assert!(last[1] < 0.01, "{last:?}");
}

/// One cluster has no seams; many have some, and they are stated.
#[test]
fn seams_are_measured() {
    let mesh = ring();
    let one = bake(&mesh, &[("clusters", 1.0), ("components", 4.0)]);
    assert_eq!(detail(&*one, "seams"), 0.0);
    let coarse = bake(&mesh, &[("clusters", 16.0), ("components", 1.0)]);
    let fine = bake(&mesh, &[("clusters", 16.0), ("components", 12.0)]);
    let [before, after] = [&coarse, &fine].map(|b| detail(&**b, "seams"));
    assert!(after > 0.0 && after < 0.5 * before, "{before} {after}");
}

#[test]
fn points_without_sites_stay_black() {
    points_without_sites_are_black(&*bake(&ring(), &[]));
}
