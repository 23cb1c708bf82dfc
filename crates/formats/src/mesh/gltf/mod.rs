//! glTF 2.0 and GLB (Khronos, glTF 2.0 specification, 2021), read by ourselves: every index, offset and count
//! is checked where it is used, and nothing outside the file's folder is opened.
//!
//! Node transforms are applied; a mesh that several nodes show comes several times. Extensions understood:
//! KHR_mesh_quantization, KHR_texture_transform, KHR_materials_emissive_strength, _ior, _specular,
//! _anisotropy and _sheen; other extensions of materials are named in
//! [`MaterialData::unread`](super::MaterialData::unread), those of lights are ignored, compressed geometry is
//! refused.

mod accessor;
mod buffers;
mod json;
mod materials;
mod scene;
mod transform;

use super::{MeshData, source::Source};
use crate::FormatError;
use buffers::Buffers;
use json::Root;

/// Extensions that a file may require; beside these all KHR_materials_ and KHR_lights_.
const KNOWN: [&str; 2] = ["KHR_mesh_quantization", "KHR_texture_transform"];

/// Reads a GLB: a header, the JSON chunk and a binary chunk.
pub fn read_glb(bytes: &[u8], source: &mut Source) -> Result<MeshData, FormatError> {
    let (json, chunk) = split_glb(bytes).map_err(|why| source.fault(why))?;
    read_json(json, chunk, source)
}

fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    let (version, length) = word(4).zip(word(8)).ok_or("truncated GLB header")?;
    if version != 2 {
        return Err(format!("GLB version {version}: only 2 is read"));
    }
    if (length as usize) > bytes.len() {
        return Err(format!("GLB of {length} bytes ends after {} (truncated)", bytes.len()));
    }
    let (mut at, mut json, mut bin) = (12usize, None, None);
    while at + 8 <= length as usize {
        let (size, kind) = word(at).zip(word(at + 4)).ok_or("truncated GLB chunk")?;
        let end = (at + 8).checked_add(size as usize).filter(|&e| e <= length as usize);
        let end =
            end.ok_or_else(|| format!("GLB chunk of {size} bytes at byte {at} reaches beyond the file"))?;
        let chunk = &bytes[at + 8..end];
        match kind {
            0x4E4F_534A if json.is_none() => json = Some(chunk),
            0x004E_4942 if bin.is_none() => bin = Some(chunk),
            _ => {}
        }
        at = end;
    }
    Ok((json.ok_or("GLB without a JSON chunk")?, bin))
}

/// Reads glTF's JSON with the binary chunk of a GLB, if any.
pub fn read_json(json: &[u8], chunk: Option<&[u8]>, source: &mut Source) -> Result<MeshData, FormatError> {
    // What the shortest text becomes: `{}` a material, `0,` a child of a node.
    let count = |ends: &[u8]| json.iter().filter(|b| ends.contains(b)).count() as u64;
    source.spend(count(b"{"), size_of::<json::Material>().max(size_of::<json::Node>()))?;
    source.spend(count(b",["), 2 * size_of::<serde_json::Value>())?;
    let root: Root =
        serde_json::from_slice(json).map_err(|e| source.fault(format_args!("glTF JSON: {e}")))?;
    if !root.asset.version.starts_with("2.") {
        return Err(source.fault(format_args!("glTF version {:?}: only 2 is read", root.asset.version)));
    }
    let known =
        |e: &str| KNOWN.contains(&e) || e.starts_with("KHR_materials_") || e.starts_with("KHR_lights_");
    if let Some(extension) = root.extensionsRequired.iter().find(|e| !known(e)) {
        return Err(source.fault(format_args!("requires the extension {extension}, which is not supported")));
    }
    let buffers = Buffers::read(&root, chunk, source)?;
    let textures = materials::images(&root, &buffers, source)?;
    let mut data = MeshData { textures, ..MeshData::default() };
    let mut sets = Vec::with_capacity(root.materials.len());
    for (i, m) in root.materials.iter().enumerate() {
        let (material, set) = materials::material(&root, m, source)
            .map_err(|why| source.fault(format_args!("material {i}: {why}")))?;
        data.materials.push(material);
        sets.push(set);
    }
    scene::parts(&root, &buffers, &sets, &mut data, source)?;
    Ok(data)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Limits;
    use std::path::Path;

    /// One triangle, with `node` in the node that shows it and `root` beside it.
    fn notes(node: &str, root: &str) -> Vec<String> {
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0{node}}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
            "bufferViews":[{{"buffer":0,"byteLength":36}}],
            "buffers":[{{"uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA","byteLength":36}}]
            {root}}}"#
        );
        let mut source = Source::new(Path::new("a.gltf"), None, json.len(), &Limits::default());
        let data = read_json(json.as_bytes(), None, &mut source).unwrap();
        assert_eq!(data.parts[0].triangles, [[0, 1, 2]]);
        source.notes()
    }

    fn material(extensions: &str) -> crate::mesh::MaterialData {
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"materials":[{{"name":"m","extensions":{{{extensions}}}}}]}}"#
        );
        let mut source = Source::new(Path::new("a.gltf"), None, json.len(), &Limits::default());
        let root: Root = serde_json::from_str(&json).unwrap();
        materials::material(&root, &root.materials[0], &mut source).unwrap().0
    }

    #[test]
    fn extensions_of_materials_are_read_or_named() {
        let m = material("");
        assert_eq!((m.dielectric_f0, m.anisotropy, m.sheen), ([0.04; 3], None, None));
        assert!(m.unread.is_empty());
        // Diamond.
        let m = material(r#""KHR_materials_ior":{"ior":2.42}"#);
        assert!((m.dielectric_f0[0] - 0.1724).abs() < 1e-4, "{:?}", m.dielectric_f0);
        assert_eq!(material(r#""KHR_materials_ior":{"ior":0}"#).dielectric_f0, [1.0; 3]);
        let m = material(
            r#""KHR_materials_specular":{"specularFactor":0.5,"specularColorFactor":[1,2,50],
            "specularTexture":{"index":0}}"#,
        );
        let want = [0.02, 0.04, 0.5];
        assert!(m.dielectric_f0.iter().zip(want).all(|(a, b): (&f32, f32)| (a - b).abs() < 1e-6), "{m:?}");
        assert_eq!(
            m.unread,
            ["the textures of KHR_materials_specular", "KHR_materials_specular at grazing angles"]
        );
        let m = material(
            r#""KHR_materials_anisotropy":{"anisotropyStrength":0.6,"anisotropyRotation":1.57},
            "KHR_materials_sheen":{"sheenColorFactor":[0.9,0.5,0.1],"sheenRoughnessFactor":0.4},
            "KHR_materials_clearcoat":{"clearcoatFactor":1}"#,
        );
        assert_eq!(m.anisotropy.map(|a| (a.strength, a.rotation)), Some((0.6, 1.57)));
        assert_eq!(m.sheen.map(|s| (s.color, s.perceptual_roughness)), Some(([0.9, 0.5, 0.1], 0.4)));
        assert_eq!(m.unread, ["KHR_materials_clearcoat"]);
        // What is no number, or none that can be, is what the specification has by default.
        let m = material(r#""KHR_materials_ior":{"ior":"x"},"KHR_materials_sheen":7"#);
        assert_eq!((m.dielectric_f0, m.sheen), ([0.04; 3], None));
    }

    #[test]
    fn what_is_left_out_is_noted() {
        assert!(notes("", "").is_empty());
        assert!(notes(r#","skin":0"#, r#","skins":[{"joints":[0]}]"#)[0].starts_with("skins"));
        assert_eq!(
            notes("", r#","animations":[{"channels":[],"samplers":[]}]"#),
            ["animations were left out"]
        );
    }
}
