//! Real meshes of the data folder: counts as its README states them, and bounds.

use steradian_formats::{Limits, MeshData, read_mesh};
use steradian_testkit::data;

fn load(name: &str) -> Option<MeshData> {
    let path = data(&format!("meshes/{name}"))?;
    Some(read_mesh(&path, &Limits::default()).expect("the data folder holds valid meshes"))
}

fn counts(m: &MeshData) -> (usize, usize) {
    m.parts.iter().fold((0, 0), |(v, t), p| (v + p.positions.len(), t + p.triangles.len()))
}

fn extent(m: &MeshData) -> [f32; 3] {
    let all = || m.parts.iter().flat_map(|p| &p.positions);
    [0, 1, 2].map(|k| {
        let (lo, hi) = all().fold((f32::MAX, f32::MIN), |(lo, hi), p| (lo.min(p[k]), hi.max(p[k])));
        hi - lo
    })
}

#[test]
fn every_mesh_has_the_counts_and_the_extent_of_its_description() {
    for (name, vertices, triangles, size) in [
        ("bunny_bun_zipper.ply", 35947, 69451, [0.156, 0.154, 0.121]),
        ("bunny_pedestal.ply", 34838, 69453, [3.2, 1.9825, 3.2]),
        ("dragon_vrip_res2.ply.gz", 100250, 202520, [0.205, 0.144, 0.091]),
        ("dragon_vrip.ply.gz", 437645, 871414, [0.205, 0.144, 0.092]),
        ("happy_vrip_res3.ply", 32328, 67240, [0.081, 0.198, 0.081]),
        ("armadillo.obj", 43243, 86482, [0.839, 1.0, 0.763]),
        ("max_planck_decimated.obj", 5272, 10540, [192.717, 340.137, 244.218]),
        ("nefertiti.obj", 49971, 99938, [238.686, 362.534, 494.605]),
        ("teapot.obj", 3644, 6320, [6.434, 3.15, 4.0]),
        ("spot.obj", 3225, 5856, [0.943, 1.69, 1.718]),
        ("DamagedHelmet.glb", 14556, 15452, [1.89, 1.802, 2.0]),
    ] {
        let Some(m) = load(name) else { return };
        assert_eq!(counts(&m), (vertices, triangles), "{name}");
        let got = extent(&m);
        for k in 0..3 {
            assert!((got[k] - size[k]).abs() <= 6e-4 * size[k].max(1.0), "{name}: {got:?}");
        }
    }
}

#[test]
fn the_helmet_has_five_textures_and_one_material() {
    let Some(m) = load("DamagedHelmet.glb") else { return };
    assert_eq!((m.parts.len(), m.materials.len(), m.textures.len()), (1, 1, 5));
    let material = &m.materials[0];
    for texture in [
        material.base_color_texture,
        material.metallic_roughness_texture,
        material.normal_texture,
        material.occlusion_texture,
        material.emissive_texture,
    ] {
        assert!(!m.textures[texture.unwrap().texture].bytes.is_empty());
    }
    let part = &m.parts[0];
    assert_eq!(part.uvs.len(), part.positions.len());
    for n in &part.normals {
        assert!((n.iter().map(|v| v * v).sum::<f32>() - 1.0).abs() < 1e-3);
    }
    // The node turns the model's +Y to +Z: its longest axis.
    let (lo, hi) =
        part.positions.iter().fold((f32::MAX, f32::MIN), |(lo, hi), p| (lo.min(p[2]), hi.max(p[2])));
    assert!((lo + 1.187_155).abs() < 1e-5 && (hi - 0.812_845).abs() < 1e-5, "{lo} {hi}");
}

#[test]
fn the_cow_has_texture_coordinates_and_says_that_its_material_library_is_missing() {
    let Some(m) = load("spot.obj") else { return };
    let part = &m.parts[0];
    assert_eq!((part.uvs.len(), part.normals.len()), (3225, 3225));
    let (u, v): (Vec<f32>, Vec<f32>) = part.uvs.iter().map(|&[u, v]| (u, v)).unzip();
    let least = |x: &[f32]| x.iter().copied().fold(f32::MAX, f32::min);
    // The file's own ranges are −0.052242 … 0.989055 and … 1.000650, v upwards.
    assert!((least(&u) + 0.052_242).abs() < 1e-6 && (least(&v) - (1.0 - 1.000_650)).abs() < 1e-6);
    assert!(m.notes.iter().any(|n| n.contains("spot.mtl")), "{:?}", m.notes);
}
