//! Meshes from files.

use crate::{Mesh, MeshReport, Repairs};
use std::path::{Path, PathBuf};
use steradian_formats::mesh::{MaterialData, TextureSource};
use steradian_formats::{FormatError, Limits, MeshData, read_mesh};

/// A mesh loaded from a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Loaded {
    /// The parts in file order; their material slots count through [`Loaded::materials`].
    pub meshes: Vec<Mesh>,
    /// Names of the parts; may be empty strings.
    pub names: Vec<String>,
    /// Repairs of each part.
    pub reports: Vec<MeshReport>,
    /// Materials as the file describes them.
    pub materials: Vec<MaterialData>,
    /// Images that the materials refer to, not decoded.
    pub textures: Vec<TextureSource>,
    /// Other files that were read: images, buffers, libraries of materials.
    pub files: Vec<PathBuf>,
    /// Ignored, repaired or missing data, one line each.
    pub notes: Vec<String>,
}

impl Loaded {
    /// All parts as one mesh.
    pub fn merged(&self) -> Mesh {
        Mesh::merged(&self.meshes)
    }
}

/// Reads glTF, GLB, OBJ or PLY and repairs it where needed: see [`Mesh::from_part`].
pub fn load(path: &Path, limits: &Limits) -> Result<Loaded, FormatError> {
    load_with(path, limits, Repairs::default())
}

/// [`load`] with a choice of repairs.
pub fn load_with(path: &Path, limits: &Limits, repairs: Repairs) -> Result<Loaded, FormatError> {
    let loaded = from_data(read_mesh(path, limits)?, repairs);
    if loaded.meshes.iter().all(|m| m.triangles.is_empty()) {
        return Err(FormatError::invalid(path, "all triangles are without area"));
    }
    Ok(loaded)
}

/// The meshes of data that were read already.
pub fn from_data(data: MeshData, repairs: Repairs) -> Loaded {
    let mut out = Loaded {
        materials: data.materials,
        textures: data.textures,
        files: data.files,
        notes: data.notes,
        ..Loaded::default()
    };
    for part in data.parts {
        let (mesh, report) = Mesh::from_part(&part, repairs);
        out.notes.extend(report.notes());
        out.meshes.push(mesh);
        out.reports.push(report);
        out.names.push(part.name);
    }
    out
}
