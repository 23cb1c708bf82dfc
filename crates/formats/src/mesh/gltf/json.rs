//! The parts of glTF's JSON that meshes need (Khronos, glTF 2.0 specification, 2021), names as there.
#![expect(non_snake_case, reason = "the specification's own names")]

use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;
use std::collections::BTreeMap;

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct Root {
    pub asset: Asset,
    pub extensionsRequired: Vec<String>,
    pub scene: Option<usize>,
    pub scenes: Vec<Scene>,
    pub nodes: Vec<Node>,
    pub meshes: Vec<Mesh>,
    pub accessors: Vec<Accessor>,
    pub bufferViews: Vec<View>,
    pub buffers: Vec<Buffer>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub images: Vec<Image>,
    pub samplers: Vec<Sampler>,
    pub animations: Vec<IgnoredAny>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct Asset {
    pub version: String,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct Scene {
    pub nodes: Vec<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct Node {
    pub children: Vec<usize>,
    pub mesh: Option<usize>,
    pub skin: Option<usize>,
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct Mesh {
    pub name: String,
    pub primitives: Vec<Primitive>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct Primitive {
    pub attributes: BTreeMap<String, usize>,
    pub indices: Option<usize>,
    pub material: Option<usize>,
    pub mode: Option<u32>,
    pub targets: Vec<Value>,
}

#[derive(Deserialize)]
pub struct Accessor {
    pub bufferView: Option<usize>,
    #[serde(default)]
    pub byteOffset: u64,
    pub componentType: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: u64,
    pub r#type: String,
    pub sparse: Option<Sparse>,
}

#[derive(Deserialize)]
pub struct Sparse {
    pub count: u64,
    pub indices: SparsePart,
    pub values: SparsePart,
}

#[derive(Deserialize)]
pub struct SparsePart {
    pub bufferView: usize,
    #[serde(default)]
    pub byteOffset: u64,
    #[serde(default)]
    pub componentType: u32,
}

#[derive(Deserialize)]
pub struct View {
    pub buffer: usize,
    #[serde(default)]
    pub byteOffset: u64,
    pub byteLength: u64,
    pub byteStride: Option<u64>,
}

#[derive(Deserialize)]
pub struct Buffer {
    pub uri: Option<String>,
    pub byteLength: u64,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct Texture {
    pub sampler: Option<usize>,
    pub source: Option<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct Image {
    pub name: String,
    pub uri: Option<String>,
    pub bufferView: Option<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct Sampler {
    pub magFilter: Option<u32>,
    pub wrapS: Option<u32>,
    pub wrapT: Option<u32>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct Material {
    pub name: String,
    pub pbrMetallicRoughness: Metallic,
    pub normalTexture: Option<TextureInfo>,
    pub occlusionTexture: Option<TextureInfo>,
    pub emissiveTexture: Option<TextureInfo>,
    pub emissiveFactor: Option<[f32; 3]>,
    pub alphaMode: Option<String>,
    pub alphaCutoff: Option<f32>,
    pub doubleSided: bool,
    pub extensions: Value,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct Metallic {
    pub baseColorFactor: Option<[f32; 4]>,
    pub baseColorTexture: Option<TextureInfo>,
    pub metallicFactor: Option<f32>,
    pub roughnessFactor: Option<f32>,
    pub metallicRoughnessTexture: Option<TextureInfo>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct TextureInfo {
    pub index: usize,
    pub texCoord: u32,
    pub scale: Option<f32>,
    pub strength: Option<f32>,
    pub extensions: Value,
}
