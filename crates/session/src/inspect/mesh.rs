//! Facts of a mesh.

use crate::{Error, Session, is_shape};
use glam::Vec3;
use std::collections::HashMap;
use std::path::Path;
use steradian_engines::{Carried, carried};
use steradian_formats::mesh::{MaterialData, TextureRef, TextureSource};
use steradian_formats::{Limits, read_file};
use steradian_render::FileMaterial;
use steradian_scene::Mesh;

/// Facts of a mesh: sizes, attributes of its vertices, and how closed it is.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshFacts {
    /// Meshes of the file.
    pub parts: usize,
    /// Vertices of all parts.
    pub vertices: usize,
    /// Triangles of all parts.
    pub triangles: usize,
    /// Vertices with a normal.
    pub normals: usize,
    /// Has it texture coordinates?
    pub has_uvs: bool,
    /// Has it tangents?
    pub has_tangents: bool,
    /// Smallest and largest coordinates, metres; `None` without triangles.
    pub bounds: Option<(Vec3, Vec3)>,
    /// The diagonal of the bounds, metres.
    pub diagonal: f32,
    /// Area of all triangles, m².
    pub area: f64,
    /// Edges of one triangle only.
    pub open_edges: usize,
    /// Edges of more than two triangles.
    pub shared_edges: usize,
    /// Transfer that its vertices carry, as `steradian transfer` writes it to a .glb.
    pub transfer: Option<Carried>,
    /// The file's materials.
    pub materials: Vec<MaterialFacts>,
    /// What was found while loading.
    pub notes: Vec<String>,
}

/// What a material of a mesh file is.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialFacts {
    /// The file's name for it; may be empty.
    pub name: String,
    /// The spec of the reflectance that it is taken as.
    pub brdf: String,
    /// What its textures are, and the file's names for their images.
    pub textures: Vec<(&'static str, String)>,
    /// What of it is not shown, in words.
    pub left_out: Vec<String>,
    /// All of that in one line.
    pub text: String,
}

impl MaterialFacts {
    fn new(m: &MaterialData, images: &[TextureSource], limits: &Limits) -> Result<Self, Error> {
        let taken = FileMaterial::read(m, images, limits)?;
        let used = [
            ("base colour", m.base_color_texture),
            ("metalness and roughness", m.metallic_roughness_texture),
            ("normal", m.normal_texture),
            ("occlusion", m.occlusion_texture),
            ("emission", m.emissive_texture),
        ];
        let name = |t: TextureRef| images.get(t.texture).map(|i| i.name.clone());
        let textures = used.into_iter().filter_map(|(what, t)| Some((what, name(t?)?))).collect();
        let text = taken.assumed();
        Ok(Self { name: taken.name, brdf: taken.spec, textures, left_out: taken.left_out, text })
    }
}

/// Is this the name of a mesh file or of a built-in shape?
pub fn is_mesh(what: &str) -> bool {
    let lower = what.to_lowercase();
    let file = lower.strip_suffix(".gz").unwrap_or(&lower);
    is_shape(what) || [".obj", ".ply", ".glb", ".gltf"].iter().any(|e| file.ends_with(e))
}

impl Session {
    /// Facts of a mesh file or a built-in shape.
    pub fn inspect_mesh(&mut self, what: &str) -> Result<MeshFacts, Error> {
        if is_shape(what) {
            let mesh = self.mesh(what)?;
            return Ok(facts(&mesh, 1, Vec::new(), Vec::new()));
        }
        let loaded = steradian_scene::load(Path::new(what), &self.limits())?;
        self.note_input(Path::new(what));
        let limits = self.limits();
        let of = |m| MaterialFacts::new(m, &loaded.textures, &limits);
        let materials = loaded.materials.iter().map(of).collect::<Result<_, _>>()?;
        let found = facts(&loaded.merged(), loaded.meshes.len(), materials, loaded.notes.clone());
        let glb = Path::new(what).extension().is_some_and(|e| e.eq_ignore_ascii_case("glb"));
        let bytes = glb.then(|| read_file(Path::new(what), limits.max_memory, "a mesh")).transpose()?;
        Ok(MeshFacts { transfer: bytes.as_deref().and_then(carried), ..found })
    }
}

fn facts(mesh: &Mesh, parts: usize, materials: Vec<MaterialFacts>, notes: Vec<String>) -> MeshFacts {
    let (open_edges, shared_edges) = edges(mesh);
    MeshFacts {
        parts,
        vertices: mesh.positions.len(),
        triangles: mesh.triangles.len(),
        normals: mesh.normals.len(),
        has_uvs: !mesh.uvs.is_empty(),
        has_tangents: !mesh.tangents.is_empty(),
        bounds: mesh.bounds(),
        diagonal: mesh.diagonal(),
        area: mesh.area(),
        open_edges,
        shared_edges,
        transfer: None,
        materials,
        notes,
    }
}

/// Number of edges of one triangle only, and of more than two; vertices with equal positions count as one.
fn edges(mesh: &Mesh) -> (usize, usize) {
    let mut of_position = HashMap::new();
    let same: Vec<u32> = mesh
        .positions
        .iter()
        .enumerate()
        // −0 and 0 are one place.
        .map(|(i, p)| *of_position.entry((*p + Vec3::ZERO).to_array().map(f32::to_bits)).or_insert(i as u32))
        .collect();
    let mut count: HashMap<(u32, u32), u32> = HashMap::new();
    for t in &mesh.triangles {
        for k in 0..3 {
            let (a, b) = (same[t[k] as usize], same[t[(k + 1) % 3] as usize]);
            *count.entry((a.min(b), a.max(b))).or_default() += 1;
        }
    }
    let open = count.values().filter(|n| **n == 1).count();
    (open, count.values().filter(|n| **n > 2).count())
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_scene::shapes;

    #[test]
    fn closed_and_open_shapes() {
        assert_eq!(edges(&shapes::by_name("torus").unwrap()), (0, 0));
        assert_eq!(edges(&shapes::by_name("plane").unwrap()).0, 4);
        assert!(is_mesh("a/b.PLY.gz") && is_mesh("teapot") && !is_mesh("a.hdr"));
    }
}
