//! Meshes.

use crate::{Bomb, harmless, refused};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

/// One after another, so that only one lies in memory.
pub fn bombs() -> Vec<fn() -> Bomb> {
    vec![
        obj_one_position,
        obj_continued,
        obj_spirals,
        obj_gzipped,
        obj_faces,
        obj_materials,
        obj_libraries,
        obj_textures,
        gltf_notes,
        gltf_parts,
        gltf_nodes,
        gltf_materials,
        gltf_zeros,
        gltf_deep,
        ply_list,
    ]
}

/// What the meshes refer to.
pub fn beside(folder: &Path) {
    let many: String = (0..20_000).fold(String::new(), |mut t, i| {
        let _ = writeln!(t, "map_Kd none{i}.png");
        t
    });
    let library = |name: &str, text: String| std::fs::write(folder.join(name), text).expect("written");
    library("many.mtl", format!("newmtl a\n{many}"));
    std::fs::write(folder.join("big.png"), vec![0; 1 << 20]).expect("written");
    let spelt: String = (0..200).map(|i| format!("map_Kd {}big.png\n", "./".repeat(i))).collect();
    library("spelt.mtl", format!("newmtl a\n{spelt}"));
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

/// Every corner of the same position with other texture coordinates.
fn obj_one_position() -> Bomb {
    let mut text = SQUARE.to_string();
    (0..90_000).for_each(|i| writeln!(text, "vt 0.{i}").expect("text"));
    (0..30_000).for_each(|i| {
        let k = 3 * i + 1;
        writeln!(text, "f 1/{k} 1/{} 1/{}", k + 1, k + 2).expect("text");
    });
    harmless("position.obj", text.into_bytes())
}

/// One face of 60 000 lines.
fn obj_continued() -> Bomb {
    let text = format!("{SQUARE}f {}1\n", "1 2 3 \\\n".repeat(60_000));
    harmless("continued.obj", text.into_bytes())
}

/// Polygons that cross themselves everywhere, where hardly a corner is an ear.
fn obj_spirals() -> Bomb {
    let mut text = String::new();
    for i in 0..512 {
        let a = f64::from(i) * 2.4;
        writeln!(text, "v {} {} 0", a.cos() * f64::from(i), a.sin() * f64::from(i)).expect("text");
    }
    let face: String = (1..=512).map(|i| format!(" {i}")).collect();
    (0..300).for_each(|_| writeln!(text, "f{face}").expect("text"));
    harmless("spirals.obj", text.into_bytes())
}

fn gzipped(head: &str, line: &str, times: usize) -> Vec<u8> {
    let mut out = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::new(6));
    out.write_all(head.as_bytes()).expect("memory");
    (0..times).for_each(|_| out.write_all(line.as_bytes()).expect("memory"));
    out.finish().expect("memory")
}

fn obj_gzipped() -> Bomb {
    refused("long.obj.gz", gzipped(SQUARE, &"f 1 2 3\n".repeat(1000), 10_000), "decompresses to more than")
}

/// Eight bytes that become a hundred.
fn obj_faces() -> Bomb {
    refused(
        "faces.obj",
        [SQUARE, &"f 1 1 1\n".repeat(1_000_000)].concat().into_bytes(),
        "exceed the memory limit",
    )
}

fn obj_materials() -> Bomb {
    let mut text = SQUARE.to_string();
    (0..400_000).for_each(|i| writeln!(text, "usemtl {i}").expect("text"));
    refused("materials.obj", (text + "f 1 2 3\n").into_bytes(), "exceed the memory limit")
}

/// The same library again and again.
fn obj_libraries() -> Bomb {
    let text = ["mtllib many.mtl\n".repeat(20_000).as_str(), SQUARE, "f 1 2 3\n"].concat();
    harmless("libraries.obj", text.into_bytes())
}

/// The same image under 200 names.
fn obj_textures() -> Bomb {
    let text = ["mtllib spelt.mtl\n", SQUARE, "usemtl a\nf 1 2 3\n"].concat();
    refused("textures.obj", text.into_bytes(), "exceed the memory limit")
}

/// A glTF file of `nodes`, `primitives` of the one mesh, and what stands beside.
fn gltf(nodes: &str, primitives: &str, beside: &str) -> Vec<u8> {
    let buffer = "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],"meshes":[{{"primitives":[{primitives}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"uri":"{buffer}","byteLength":36}}]{beside}}}"#
    )
    .into_bytes()
}

/// `count` copies of `one`, which `{}` numbers, with commas.
fn list(count: usize, one: &str) -> String {
    (0..count).map(|i| one.replace("{}", &i.to_string())).collect::<Vec<_>>().join(",")
}

const TRIANGLE: &str = r#"{"attributes":{"POSITION":0}}"#;

/// A note for each pair of node and primitive, and one for each material.
fn gltf_notes() -> Bomb {
    let points = list(400, r#"{"attributes":{"POSITION":0},"mode":0}"#);
    let textured = r#"{"name":"{}","normalTexture":{"index":0},"emissiveTexture":{"index":0,"texCoord":1}}"#;
    let materials = list(5_000, textured);
    let beside =
        format!(r#","materials":[{materials}],"textures":[{{"source":0}}],"images":[{{"uri":"none.png"}}]"#);
    harmless("notes.gltf", gltf(&list(400, r#"{"mesh":0}"#), &format!("{points},{TRIANGLE}"), &beside))
}

fn gltf_parts() -> Bomb {
    let bytes = gltf(&list(5000, r#"{"mesh":0}"#), &list(5000, TRIANGLE), "");
    refused("parts.gltf", bytes, "exceed the memory limit")
}

fn gltf_nodes() -> Bomb {
    refused(
        "nodes.gltf",
        gltf(&list(1_000_000, "{}").replace(char::is_numeric, "{}"), TRIANGLE, ""),
        "exceed the memory",
    )
}

/// Primitives without material beside many materials.
fn gltf_materials() -> Bomb {
    let beside = format!(r#","materials":[{}]"#, list(20_000, r#"{"name":""}"#));
    let beside = beside.replace(r#""name":"""#, r#""doubleSided":true"#);
    harmless("materials.gltf", gltf(r#"{"mesh":0}"#, &list(20_000, TRIANGLE), &beside))
}

/// An accessor without a view is zeros.
fn gltf_zeros() -> Bomb {
    let text = String::from_utf8(gltf(r#"{"mesh":0}"#, TRIANGLE, "")).expect("text");
    let text = text.replace(
        r#"{"bufferView":0,"componentType":5126,"count":3"#,
        r#"{"componentType":5126,"count":4000000000"#,
    );
    refused("zeros.gltf", text.into_bytes(), "exceed the memory limit")
}

/// Nodes in nodes.
fn gltf_deep() -> Bomb {
    let nodes: Vec<String> = (1..50_000).map(|i| format!(r#"{{"children":[{i}]}}"#)).collect();
    harmless(
        "deep.gltf",
        gltf(&format!(r#"{},{{"mesh":0}}"#, nodes.join(",")), TRIANGLE, r#","scenes":[{"nodes":[0]}]"#),
    )
}

/// A face of eight million corners of one byte each.
fn ply_list() -> Bomb {
    let head = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
                property float z\nelement face 1\nproperty list uint uchar vertex_indices\nend_header\n";
    let count = 8_000_000u32;
    let mut bytes = [head.as_bytes(), &[0; 12], &count.to_le_bytes()].concat();
    bytes.resize(bytes.len() + count as usize, 0);
    refused("list.ply", bytes, "its lists exceed the memory limit")
}
