//! Meshes of one or two triangles.

use crate::generate::{Entry, entry};

/// glTF as JSON and GLB.
pub fn gltf() -> Vec<Entry> {
    let positions = [0f32, 0., 0., 1., 0., 0., 0., 1., 0.];
    let binary: Vec<u8> =
        positions.iter().flat_map(|v| v.to_le_bytes()).chain([0, 0, 1, 0, 2, 0, 0, 0]).collect();
    let good = glb(&json(r#""byteLength":44"#, 3, 3), &binary);
    let mut wrong_version = good.clone();
    wrong_version[4] = 9;
    vec![
        entry("valid/triangle.glb", &good),
        entry("invalid/empty.glb", ""),
        entry("invalid/wrong_magic.glb", &good[1..]),
        entry("invalid/version.glb", wrong_version),
        entry("invalid/truncated.glb", &good[..good.len() - 5]),
        entry("invalid/count.glb", glb(&json(r#""byteLength":44"#, 4_000_000_000, 3), &binary)),
        entry("invalid/index.glb", glb(&json(r#""byteLength":44"#, 2, 3), &binary)),
        entry("invalid/not_json.gltf", "{ \"asset\": "),
        entry("invalid/outside.gltf", json(r#""byteLength":44,"uri":"../x.bin""#, 3, 3)),
        entry("invalid/url.gltf", json(r#""byteLength":44,"uri":"https://example.org/x.bin""#, 3, 3)),
    ]
}

fn json(buffer: &str, vertices: u64, indices: u64) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":{vertices},"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},{{"bufferView":1,"componentType":5123,"count":{indices},"type":"SCALAR"}}],"bufferViews":[{{"buffer":0,"byteOffset":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":6}}],"buffers":[{{{buffer}}}]}}"#
    )
}

fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let word = |n: usize| (n as u32).to_le_bytes();
    let total = 12 + 8 + json.len() + 8 + binary.len();
    let head = [*b"glTF", word(2), word(total), word(json.len()), *b"JSON"].concat();
    [&head[..], &json, &word(binary.len()), b"BIN\0", binary].concat()
}

/// Wavefront OBJ.
pub fn obj() -> Vec<Entry> {
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    vec![
        entry(
            "valid/square.obj",
            format!("# a square\n{square}vn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3/1/1 4/1/1\n"),
        ),
        entry("valid/negative.obj", format!("o s\r\n{square}f -4 -3 -2\r\nf -4 -2 -1\r\n")),
        entry("invalid/empty.obj", ""),
        entry("invalid/no_faces.obj", square),
        entry("invalid/index.obj", format!("{square}f 1 2 9\n")),
        entry("invalid/zero_index.obj", format!("{square}f 0 1 2\n")),
        entry("invalid/not_a_number.obj", "v 0 0 up\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        entry("invalid/not_finite.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
    ]
}

/// Stanford PLY: text and both byte orders.
pub fn ply() -> Vec<Entry> {
    let head = |format: &str, vertices: u64| {
        format!(
            "ply\nformat {format} 1.0\ncomment c\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
             property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let text = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let p = [0f32, 0., 0., 1., 0., 0., 0., 1., 0.];
    let little: Vec<u8> = p.iter().flat_map(|v| v.to_le_bytes()).collect();
    let big: Vec<u8> = p.iter().flat_map(|v| v.to_be_bytes()).collect();
    let bytes =
        |format: &str, data: &[u8], face: [u8; 13]| [head(format, 3).as_bytes(), data, &face].concat();
    let face_le = [3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0];
    let face_be = [3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2];
    let good = bytes("binary_little_endian", &little, face_le);
    vec![
        entry("valid/text.ply", head("ascii", 3) + text),
        entry("valid/little.ply", &good),
        entry("valid/big.ply", bytes("binary_big_endian", &big, face_be)),
        entry("invalid/empty.ply", ""),
        entry("invalid/wrong_magic.ply", &good[1..]),
        entry("invalid/truncated.ply", &good[..good.len() - 1]),
        entry("invalid/huge.ply", head("binary_little_endian", 1 << 40) + text),
        entry("invalid/format.ply", head("binary_middle_endian", 3) + text),
        entry(
            "invalid/index.ply",
            bytes("binary_little_endian", &little, [3, 0, 0, 0, 0, 1, 0, 0, 0, 9, 0, 0, 0]),
        ),
        entry("invalid/no_header_end.ply", "ply\nformat ascii 1.0\nelement vertex 3\n"),
    ]
}
