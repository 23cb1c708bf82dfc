//! Precomputed transfer for engines: a binary glTF whose vertices carry transfer vectors, and the sum over
//! coefficients as WGSL.
//!
//! Attributes are named as glTF asks of those that it does not know: `_TRANSFER_0`, `_TRANSFER_1` … are VEC4
//! with coefficients 4k … 4k + 3 of the vertex's vectors, channel after channel, zeros at the end; `_AO` is
//! ambient occlusion. `extras.steradian_transfer` of the primitive says bands, channels, scattering events
//! and, for whole numbers, the scale of each coefficient: a normalised number times its scale is the
//! coefficient.

use serde_json::{Value, json};
use steradian_scene::Mesh;
use steradian_transfer::Transfer;

/// Numbers that vertices carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum VertexNumbers {
    /// 32-bit floats.
    #[default]
    Float,
    /// Normalised 16-bit whole numbers.
    Short,
    /// Normalised 8-bit whole numbers.
    Byte,
}

impl VertexNumbers {
    /// By their bits: 32, 16 or 8.
    pub fn of_bits(bits: u32) -> Option<Self> {
        [(32, Self::Float), (16, Self::Short), (8, Self::Byte)].into_iter().find(|b| b.0 == bits).map(|b| b.1)
    }

    /// glTF's component type.
    fn component(self) -> u32 {
        match self {
            Self::Float => 5126,
            Self::Short => 5122,
            Self::Byte => 5120,
        }
    }

    fn put(self, x: f32, to: &mut Vec<u8>) {
        match self {
            Self::Float => to.extend(x.to_le_bytes()),
            Self::Short => to.extend(((x * 32767.0).round() as i16).to_le_bytes()),
            Self::Byte => to.extend(((x * 127.0).round() as i8).to_le_bytes()),
        }
    }
}

/// What the transfer of a file cannot be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("glTF carries transfer of its {vertices} vertices, not of {sites} other sites")]
pub struct OtherSites {
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Sites of the transfer.
    pub sites: usize,
}

/// The parts of a binary file.
#[derive(Default)]
struct Binary {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Binary {
    /// Adds an accessor over `bytes` and tells its number. `target` is glTF's: 34962 for vertices, 34963 for
    /// indices.
    fn add(&mut self, bytes: &[u8], target: u32, accessor: Value) -> usize {
        self.views.push(json!({
            "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len(), "target": target,
        }));
        self.bytes.extend_from_slice(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut accessor = accessor;
        accessor["bufferView"] = json!(self.views.len() - 1);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, rows: &[[f32; N]], bounds: bool) -> usize {
        const KINDS: [&str; 5] = ["", "SCALAR", "VEC2", "VEC3", "VEC4"];
        let bytes: Vec<u8> = rows.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        let mut accessor = json!({"componentType": 5126, "count": rows.len(), "type": KINDS[N]});
        if bounds {
            let of = |f: fn(f32, f32) -> f32| -> Vec<f32> {
                (0..N).map(|i| rows.iter().map(|r| r[i]).reduce(f).unwrap_or(0.0)).collect()
            };
            accessor["min"] = json!(of(f32::min));
            accessor["max"] = json!(of(f32::max));
        }
        self.add(&bytes, 34962, accessor)
    }
}

/// `mesh` as binary glTF with the transfer of its vertices.
///
/// # Errors
/// If the transfer is that of other sites.
pub fn glb(mesh: &Mesh, t: &Transfer, numbers: VertexNumbers) -> Result<Vec<u8>, OtherSites> {
    let sites = t.len();
    if sites != mesh.positions.len() {
        return Err(OtherSites { vertices: mesh.positions.len(), sites });
    }
    let mut binary = Binary::default();
    let rows = |v: &[glam::Vec3]| -> Vec<[f32; 3]> { v.iter().map(|p| p.to_array()).collect() };
    let mut attributes = json!({"POSITION": binary.floats(&rows(&mesh.positions), true)});
    attributes["NORMAL"] = json!(binary.floats(&rows(&mesh.normals), false));
    if !mesh.uvs.is_empty() {
        let uvs: Vec<[f32; 2]> = mesh.uvs.iter().map(|uv| uv.to_array()).collect();
        attributes["TEXCOORD_0"] = json!(binary.floats(&uvs, false));
    }
    let ao: Vec<[f32; 1]> = t.ao.iter().map(|a| [*a]).collect();
    attributes["_AO"] = json!(binary.floats(&ao, false));
    let width = t.channels * t.bands * t.bands;
    // Of floats 1.
    let scale = |i: usize| match numbers {
        VertexNumbers::Float => 1.0,
        _ => t.t.iter().skip(i).step_by(width).fold(0.0f32, |m, x| m.max(x.abs())).max(f32::MIN_POSITIVE),
    };
    let scales: Vec<f32> = (0..width).map(scale).collect();
    for k in 0..width.div_ceil(4) {
        let mut bytes = Vec::new();
        for site in 0..sites {
            for i in 4 * k..4 * k + 4 {
                let value = if i < width { t.t[site * width + i] / scales[i] } else { 0.0 };
                numbers.put(value, &mut bytes);
            }
        }
        let normalised = numbers != VertexNumbers::Float;
        let accessor = json!({
            "componentType": numbers.component(), "normalized": normalised, "count": sites, "type": "VEC4",
        });
        attributes[format!("_TRANSFER_{k}")] = json!(binary.add(&bytes, 34962, accessor));
    }
    let corners: Vec<u8> = mesh.triangles.as_flattened().iter().flat_map(|i| i.to_le_bytes()).collect();
    let count = 3 * mesh.triangles.len();
    let indices =
        binary.add(&corners, 34963, json!({"componentType": 5125, "count": count, "type": "SCALAR"}));
    let document = json!({
        "asset": {"version": "2.0", "generator": concat!("Steradian ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{
            "attributes": attributes,
            "indices": indices,
            "extras": {"steradian_transfer": {
                "bands": t.bands,
                "channels": t.channels,
                "bounces": t.bounces,
                "scale": scales,
                "basis": "real orthonormal SH over the mesh's axes, index l*l+l+m, Y(1,-1) = 0.488603 y; integral of V (n.w) Y, without albedo or 1/pi",
            }},
        }]}],
        "buffers": [{"byteLength": binary.bytes.len()}],
        "bufferViews": binary.views,
        "accessors": binary.accessors,
    });
    Ok(container(&document, binary.bytes))
}

/// Transfer that the vertices of a binary glTF carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Carried {
    /// Bands of its vectors.
    pub bands: usize,
    /// Vectors of a vertex.
    pub channels: usize,
    /// Scattering events.
    pub bounces: u32,
    /// Bits of a number.
    pub bits: u32,
}

/// The transfer that the first primitive with any carries in the bytes of a binary glTF.
pub fn carried(glb: &[u8]) -> Option<Carried> {
    let length = glb.get(12..16)?.first_chunk().map(|n| u32::from_le_bytes(*n) as usize)?;
    let document: Value = serde_json::from_slice(glb.get(20..)?.get(..length)?).ok()?;
    let primitives =
        document["meshes"].as_array()?.iter().filter_map(|m| m["primitives"].as_array()).flatten();
    let of = |p: &Value| {
        let (extras, at) = (&p["extras"]["steradian_transfer"], p["attributes"]["_TRANSFER_0"].as_u64()?);
        let number = |key: &str| usize::try_from(extras[key].as_u64()?).ok();
        let bits = match document["accessors"][usize::try_from(at).ok()?]["componentType"].as_u64()? {
            5120 => 8,
            5122 => 16,
            _ => 32,
        };
        let bounces = u32::try_from(number("bounces")?).ok()?;
        Some(Carried { bands: number("bands")?, channels: number("channels")?, bounces, bits })
    };
    primitives.into_iter().find_map(of)
}

/// glTF's binary container: a chunk of JSON and one of bytes, both of whole words.
fn container(document: &Value, mut binary: Vec<u8>) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let mut out = Vec::with_capacity(28 + text.len() + binary.len());
    let word = |out: &mut Vec<u8>, x: u32| out.extend(x.to_le_bytes());
    out.extend(b"glTF");
    word(&mut out, 2);
    word(&mut out, (28 + text.len() + binary.len()) as u32);
    for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &binary)] {
        word(&mut out, chunk.len() as u32);
        out.extend(kind);
        out.extend_from_slice(chunk);
    }
    out
}

/// WGSL that shades a vertex of [`glb`] with `bands` and one or three `channels`:
/// `transfer_radiance(t, light, scale, albedo)`.
pub fn transfer_source(bands: usize, channels: usize) -> String {
    let (n, width) = (bands * bands, channels * bands * bands);
    let rows = width.div_ceil(4);
    let mut sum = String::new();
    for i in 0..n {
        let part = |c: usize| {
            let k = c * n + i;
            format!("t[{}].{x} * scale[{}].{x}", k / 4, k / 4, x = ["x", "y", "z", "w"][k % 4])
        };
        let value = match channels {
            1 => part(0),
            _ => format!("vec3<f32>({}, {}, {})", part(0), part(1), part(2)),
        };
        sum += &format!("    l += light[{i}] * ({value});\n");
    }
    format!(
        "// Radiance, W sr^-1 m^-2, that leaves a diffuse vertex: albedo/pi times the sum of L_i t_i (Sloan, Kautz & Snyder 2002).\n\
         // t: the attributes _TRANSFER_0 ... of the vertex; scale: of the file's extras, four by four, ones for floats.\n\
         // light: {n} coefficients of the light, real orthonormal spherical harmonics over the mesh's axes, index l*l+l+m,\n\
         // Y(1,-1) = 0.488603 y: for a turned mesh those of the light turned back.\n\
         fn transfer_radiance(\n    t: array<vec4<f32>, {rows}>,\n    light: array<vec3<f32>, {n}>,\n    \
         scale: array<vec4<f32>, {rows}>,\n    albedo: vec3<f32>,\n) -> vec3<f32> {{\n    \
         var l = vec3<f32>(0.0);\n{sum}    return max(l, vec3<f32>(0.0)) * albedo * {:?};\n}}\n",
        std::f32::consts::FRAC_1_PI
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_base::Task;
    use steradian_scene::shapes;
    use steradian_transfer::{Scene, Settings, Site, transfer};

    fn ring(bounces: u32, albedo: [f64; 3]) -> (Mesh, Transfer) {
        let mesh = shapes::torus(0.7, 0.3, 12);
        let settings =
            Settings { bands: 4, tolerance: 0.02, bounces, albedo: vec![albedo], ..Settings::default() };
        let scene = Scene::new(&mesh).unwrap();
        let t = transfer(&scene, &Site::vertices(&mesh), &settings, None, &Task::quiet()).unwrap();
        (mesh, t)
    }

    fn chunks(glb: &[u8]) -> (Value, &[u8]) {
        let word = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&glb[..4], word(8)), (&b"glTF"[..], glb.len()));
        let json = word(12);
        (serde_json::from_slice(&glb[20..20 + json]).unwrap(), &glb[28 + json..])
    }

    /// What is read back by the document's own words is the transfer, as well as the numbers are.
    #[test]
    fn vertices_carry_their_transfer() {
        for (bounces, albedo, channels) in [(1, [0.5; 3], 1), (2, [0.8, 0.5, 0.2], 3)] {
            let (mesh, t) = ring(bounces, albedo);
            assert_eq!(t.channels, channels);
            for (numbers, within) in
                [(VertexNumbers::Float, 0.0), (VertexNumbers::Short, 1e-4), (VertexNumbers::Byte, 0.02)]
            {
                let file = glb(&mesh, &t, numbers).unwrap();
                let (document, binary) = chunks(&file);
                let bits = match numbers {
                    VertexNumbers::Float => 32,
                    VertexNumbers::Short => 16,
                    VertexNumbers::Byte => 8,
                };
                assert_eq!(carried(&file), Some(Carried { bands: 4, channels, bounces, bits }));
                assert_eq!(carried(&file[..40]), None);
                let primitive = &document["meshes"][0]["primitives"][0];
                let scale = &primitive["extras"]["steradian_transfer"]["scale"];
                let width = channels * 16;
                for site in [0, 7, t.len() - 1] {
                    for i in 0..width {
                        let name = format!("_TRANSFER_{}", i / 4);
                        let at = primitive["attributes"][name].as_u64().unwrap() as usize;
                        let accessor = &document["accessors"][at];
                        let view =
                            &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
                        let start = view["byteOffset"].as_u64().unwrap() as usize;
                        let k = 4 * site + i % 4;
                        let value = match numbers {
                            VertexNumbers::Float => {
                                f32::from_le_bytes(binary[start + 4 * k..][..4].try_into().unwrap())
                            }
                            VertexNumbers::Short => {
                                let v = i16::from_le_bytes(binary[start + 2 * k..][..2].try_into().unwrap());
                                f32::from(v) / 32767.0
                            }
                            VertexNumbers::Byte => f32::from(binary[start + k] as i8) / 127.0,
                        };
                        let value = value * scale[i].as_f64().unwrap() as f32;
                        let expected = t.t[site * width + i];
                        assert!(
                            (value - expected).abs() <= within,
                            "{numbers:?} {site} {i}: {value} {expected}"
                        );
                    }
                }
            }
        }
    }

    /// Another reader finds the same mesh.
    #[test]
    fn it_is_a_mesh_file() {
        let (mesh, t) = ring(1, [0.5; 3]);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("ring.glb");
        std::fs::write(&path, glb(&mesh, &t, VertexNumbers::Byte).unwrap()).unwrap();
        let read = steradian_scene::load(&path, &steradian_formats::Limits::default()).unwrap().merged();
        assert_eq!(read.positions, mesh.positions);
        assert_eq!(read.triangles, mesh.triangles);
        let other = shapes::torus(0.7, 0.3, 8);
        assert!(glb(&other, &t, VertexNumbers::Float).is_err());
    }

    #[test]
    fn the_shader_is_valid() {
        for (bands, channels) in [(1, 1), (3, 3), (5, 1), (6, 3)] {
            let text = transfer_source(bands, channels);
            let module =
                naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
            let flags = naga::valid::ValidationFlags::all();
            naga::valid::Validator::new(flags, naga::valid::Capabilities::empty()).validate(&module).unwrap();
        }
    }
}
