//! Real meshes: repairs while loading, and comparison with shapes.

use glam::Vec3;
use steradian_formats::Limits;
use steradian_scene::{Loaded, Mesh, load, shapes};
use steradian_testkit::data;

fn mesh(name: &str) -> Option<Loaded> {
    Some(
        load(&data(&format!("meshes/{name}"))?, &Limits::default())
            .expect("the data folder holds valid meshes"),
    )
}

fn sane(m: &Mesh) {
    assert_eq!(m.normals.len(), m.positions.len());
    assert!(m.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
    assert!(m.tangents.is_empty() || m.tangents.len() == m.positions.len());
}

#[test]
fn the_bunny_keeps_its_1113_loose_vertices_and_says_so() {
    let Some(loaded) = mesh("bunny_bun_zipper.ply") else { return };
    let (mut m, report) = (loaded.meshes[0].clone(), &loaded.reports[0]);
    assert_eq!((report.unreferenced, report.degenerate, report.made_normals), (1113, 0, true));
    assert_eq!(m.positions.len(), 35947);
    sane(&m);
    let map = m.compact();
    assert_eq!((m.positions.len(), map.len()), (35947 - 1113, 35947));
}

#[test]
fn every_mesh_gets_unit_normals_and_tangents() {
    for name in [
        "happy_vrip_res3.ply",
        "spot.obj",
        "teapot.obj",
        "bunny_pedestal.ply",
        "DamagedHelmet.glb",
        "armadillo.obj",
        "nefertiti.obj",
        "max_planck_decimated.obj",
        "dragon_vrip_res2.ply.gz",
    ] {
        let Some(loaded) = mesh(name) else { return };
        let mut m = loaded.merged();
        sane(&m);
        m.make_tangents();
        sane(&m);
        for (n, t) in m.normals.iter().zip(&m.tangents) {
            assert!(n.dot(t.truncate()).abs() < 1e-4 && (t.truncate().length() - 1.0).abs() < 1e-4, "{name}");
        }
    }
}

/// The classic tessellation with ten segments a patch has the vertices of ours.
#[test]
fn our_teapot_is_the_teapot() {
    let Some(loaded) = mesh("teapot.obj") else { return };
    let classic = &loaded.meshes[0];
    let ours = shapes::teapot(10, false);
    assert_eq!(ours.triangles.len(), classic.triangles.len());
    let fitted = |m: &Mesh| -> Vec<Vec3> {
        let (lo, hi) = m.bounds().unwrap();
        m.positions.iter().map(|p| (*p - 0.5 * (lo + hi)) * (2.0 / (hi - lo).length())).collect()
    };
    let ours = fitted(&ours);
    let far = |p: &Vec3| ours.iter().map(|q| p.distance_squared(*q)).fold(f32::MAX, f32::min).sqrt();
    let worst = fitted(classic).iter().map(far).fold(0.0, f32::max);
    assert!(worst < 1e-5, "{worst}");
}
