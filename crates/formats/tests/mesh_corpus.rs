//! The corpus of mesh files: valid ones have the vertices and triangles that their names state, invalid ones
//! give one line and exit code 3; truncated and damaged copies of both never panic.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use steradian_formats::{Limits, MeshData, decode_mesh, read_mesh};
use steradian_testkit::Mutator;

fn files(verdict: &str) -> Vec<PathBuf> {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let mut out: Vec<PathBuf> = ["gltf", "obj", "ply"]
        .into_iter()
        .flat_map(|kind| std::fs::read_dir(corpus.join(kind).join(verdict)).expect("the corpus is complete"))
        .map(|entry| entry.expect("the corpus can be listed").path())
        .filter(|p| p.is_file() && p.extension().is_none_or(|e| e != "mtl"))
        .collect();
    out.sort();
    assert!(out.len() > 20, "the corpus is missing");
    out
}

fn name(path: &Path) -> &str {
    path.file_name().and_then(|n| n.to_str()).expect("the corpus has plain names")
}

/// "seam.v6.t2.obj": 6 vertices, 2 triangles.
fn stated(name: &str) -> (usize, usize) {
    let field = |letter: char| -> usize {
        name.split('.').find_map(|f| f.strip_prefix(letter)?.parse().ok()).expect("the name states it")
    };
    (field('v'), field('t'))
}

#[test]
fn valid_files_hold_what_their_names_say() {
    for path in files("valid") {
        let m = read_mesh(&path, &Limits::default()).unwrap_or_else(|e| panic!("{e}"));
        let sums = m.parts.iter().fold((0, 0), |(v, t), p| (v + p.positions.len(), t + p.triangles.len()));
        assert_eq!(sums, stated(name(&path)), "{}", name(&path));
        for part in &m.parts {
            assert!(part.triangles.iter().flatten().all(|&i| (i as usize) < part.positions.len()));
            assert!(part.materials.iter().all(|&i| (i as usize) < m.materials.len()));
            // Every file shows the unit square or triangle from +z, however it is cut.
            let cross_z = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|i| part.positions[i as usize]);
                (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            };
            assert!(part.triangles.iter().map(cross_z).all(|z| z > 0.0), "{}", name(&path));
        }
    }
}

#[test]
fn invalid_files_give_one_line_with_their_name_and_exit_code_3() {
    for path in files("invalid") {
        let limits = Limits { max_memory: 1 << 30, max_ratio: 100, ..Limits::default() };
        let error = read_mesh(&path, &limits).err().unwrap_or_else(|| panic!("{} was read", name(&path)));
        let line = error.to_string();
        assert_eq!(error.exit_code(), 3, "{line}");
        assert!(!line.contains('\n') && line.len() < 400, "{line}");
        let referenced = ["missing_buffer.gltf", "folder_as_buffer.gltf"].contains(&name(&path));
        assert!(referenced || line.contains(name(&path)), "{line}");
    }
}

#[test]
fn errors_say_where_and_why() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    for (file, want) in [
        ("obj/invalid/index.obj", "line 5: vertex index 5 after 4 of them"),
        ("obj/invalid/library_escapes.obj", "must stay below"),
        ("obj/invalid/library_url.obj", "URLs"),
        ("ply/invalid/word.ply", "line 11: \"x\" is not a number"),
        ("ply/invalid/count_2_31.ply", "2147483648 elements vertex need more than the"),
        ("ply/invalid/too_many.ply", "line"),
        ("ply/invalid/bomb.ply.gz", "decompresses to more than"),
        ("gltf/invalid/cycle.gltf", "node 0 has two parents or is its own ancestor"),
        ("gltf/invalid/draco.gltf", "KHR_draco_mesh_compression"),
        ("gltf/invalid/index_out_of_range.gltf", "vertex index 4 in a primitive of 4 vertices"),
        ("gltf/invalid/count_2_31_no_view.gltf", "memory limit"),
        ("gltf/invalid/parent_folder_encoded.gltf", "must stay below"),
        ("gltf/invalid/truncated.glb", "truncated"),
    ] {
        let limits = Limits { max_ratio: 100, ..Limits::default() };
        let line = read_mesh(&corpus.join(file), &limits).unwrap_err().to_string();
        assert!(line.contains(want), "{line}");
    }
    let folder = read_mesh(&corpus, &Limits::default()).unwrap_err();
    assert_eq!(folder.exit_code(), 3);
    assert!(read_mesh(&corpus.join("nothing.obj"), &Limits::default()).is_err());
}

#[test]
fn every_truncation_and_many_damages_end_well() {
    let limits = Limits { max_memory: 1 << 24, max_ratio: 100, ..Limits::default() };
    let mut damage = Mutator::new(1);
    let rounds = if steradian_testkit::full() { 30_000 } else { 300 };
    let mut other = Vec::new();
    for path in files("valid").iter().chain(&files("invalid")) {
        let bytes = std::fs::read(path).unwrap();
        let step = 1 + bytes.len() / 200;
        for end in (0..bytes.len()).step_by(step) {
            let _ = decode_mesh(name(path), &bytes[..end], &limits);
        }
        for _ in 0..rounds {
            let damaged = damage.damage(&bytes, &other);
            let start = Instant::now();
            let read = decode_mesh(name(path), &damaged, &limits);
            assert!(start.elapsed() < Duration::from_secs(2), "{}: {damaged:?}", name(path));
            read.iter().for_each(sound);
        }
        other = bytes;
    }
}

/// Everything is finite, and every index means something.
fn sound(m: &MeshData) {
    for p in &m.parts {
        let n = p.positions.len();
        assert!(p.positions.iter().chain(&p.normals).chain(&p.colors).flatten().all(|v| v.is_finite()));
        assert!(p.tangents.iter().flatten().chain(p.uvs.iter().flatten()).all(|v| v.is_finite()));
        assert!(p.triangles.iter().flatten().all(|&i| (i as usize) < n));
        assert!(p.materials.iter().all(|&i| (i as usize) < m.materials.len()));
    }
}
