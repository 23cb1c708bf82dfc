//! Triangle meshes as plain data: glTF, GLB, OBJ with MTL, PLY, each of them gzipped or not.
//!
//! What comes out is indexed triangles in the file's own units, with every index in range and every number
//! finite. Files that a mesh refers to (buffers, images, materials) must lie below its own folder; there are
//! no URLs. Skins, morph targets, animations, points and lines are left out, and a note says so.

mod data;
mod gltf;
mod obj;
mod ply;
mod source;
mod triangulate;

pub use data::{
    Anisotropy, DIELECTRIC_F0, MaterialData, MeshData, Part, Sheen, TextureRef, TextureSource, Wrap,
};

use crate::image::read_bytes;
use crate::{FormatError, Limits};
use source::{Source, inflate};
use std::path::Path;

/// Reads a mesh file: glTF, GLB, OBJ or PLY, recognised by content (OBJ: by its name), gzipped or not.
pub fn read_mesh(path: &Path, limits: &Limits) -> Result<MeshData, FormatError> {
    let bytes = read_bytes(path, limits)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    decode(&bytes, path, Some(folder), limits)
}

/// Decodes a mesh in memory; `name` tells the format where the content does not, and appears in errors. It
/// cannot refer to other files (a missing material library is only noted).
pub fn decode_mesh(name: &str, bytes: &[u8], limits: &Limits) -> Result<MeshData, FormatError> {
    decode(bytes, Path::new(name), None, limits)
}

fn decode(
    bytes: &[u8],
    path: &Path,
    folder: Option<&Path>,
    limits: &Limits,
) -> Result<MeshData, FormatError> {
    let inflated;
    let (bytes, name) = if bytes.starts_with(&[0x1f, 0x8b]) {
        inflated = inflate(bytes, path, limits)?;
        (inflated.as_slice(), path.file_stem().unwrap_or_default())
    } else {
        (bytes, path.file_name().unwrap_or_default())
    };
    let extension = Path::new(name).extension().unwrap_or_default().to_ascii_lowercase();
    let mut source = Source::new(path, folder, bytes.len(), limits);
    let mut data = if bytes.starts_with(b"glTF") {
        gltf::read_glb(bytes, &mut source)
    } else if bytes.starts_with(b"ply") {
        ply::read(bytes, &mut source)
    } else if extension == "gltf" || bytes.trim_ascii_start().starts_with(b"{") {
        gltf::read_json(bytes, None, &mut source)
    } else if extension == "obj" {
        obj::read(bytes, &mut source)
    } else if extension == "ply" || extension == "glb" {
        Err(source
            .fault(format!("wrong magic: not a {} file", extension.display().to_string().to_uppercase())))
    } else {
        Err(source.fault("not a mesh that can be read here (glTF, GLB, OBJ, PLY)"))
    }?;
    if data.parts.iter().all(|p| p.triangles.is_empty()) {
        return Err(source.fault("contains no triangles"));
    }
    data.files = source.files();
    data.notes = source.notes();
    Ok(data)
}
