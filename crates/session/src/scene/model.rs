//! Meshes with the materials in their files.

use crate::Error;
use crate::Session;
use crate::inputs::{check_shape, is_shape, shape};
use glam::{Vec2, Vec3};
use std::path::Path;
use steradian_formats::mesh::{MaterialData, TextureRef};
use steradian_render::FileMaterial;
use steradian_scene::{Loaded, Mesh};
use steradian_sphere::Frame;

/// A mesh; its material slots are indices into `materials`, which is empty where the file has none.
pub struct Model {
    /// The geometry.
    pub mesh: Mesh,
    /// Materials in the file, by slot.
    pub materials: Vec<FileMaterial>,
}

impl Model {
    /// A mesh without materials.
    fn bare(mesh: Mesh) -> Self {
        Self { mesh, materials: Vec::new() }
    }
}

impl Session {
    /// Loads a built-in shape or a mesh file with the materials that its triangles use.
    pub fn model(&mut self, spec: &str) -> Result<Model, Error> {
        check_shape(spec)?;
        if is_shape(spec) { Ok(Model::bare(shape(spec)?)) } else { of_file(spec, self) }
    }
}

fn of_file(spec: &str, session: &mut Session) -> Result<Model, Error> {
    let path = Path::new(spec);
    let mut loaded = session.load_mesh(path)?;
    place_textures(&mut loaded);
    if loaded.materials.iter().any(|m| m.normal_texture.is_some() || m.anisotropy.is_some()) {
        make_tangents(&mut loaded.meshes);
    }
    complete(&mut loaded.meshes);
    let mut mesh = loaded.merged();
    let used = compact(&mut mesh);
    if loaded.materials.is_empty() {
        mesh.materials.clear();
        return Ok(Model::bare(mesh));
    }
    let fallback = MaterialData::default();
    let mut materials = Vec::new();
    for slot in used {
        let data = loaded.materials.get(slot as usize).unwrap_or(&fallback);
        materials.push(FileMaterial::read(data, &loaded.textures, &session.limits())?);
    }
    if mesh.uvs.is_empty()
        && materials
            .iter()
            .any(|m| m.base_colour.as_ref().is_some_and(|t| t.size() != (1, 1)) || !m.maps(true).is_empty())
    {
        session.warn(spec, "has textures but no texture coordinates");
    }
    Ok(Model { mesh, materials })
}

/// MikkTSpace's tangents for meshes that have texture coordinates and no tangents.
pub fn make_tangents(meshes: &mut [Mesh]) {
    for m in meshes.iter_mut().filter(|m| m.tangents.is_empty() && !m.uvs.is_empty()) {
        m.make_tangents();
    }
}

/// Moves texture coordinates to where the transform of the material's first texture puts them.
fn place_textures(loaded: &mut Loaded) {
    let plain = |r: &TextureRef| r.offset == [0.0; 2] && r.scale == [1.0; 2] && r.rotation == 0.0;
    let transform = |m: u32| {
        let m = loaded.materials.get(m as usize)?;
        let r = m.base_color_texture.or(m.normal_texture).or(m.metallic_roughness_texture)?;
        (!plain(&r)).then_some(r)
    };
    for mesh in &mut loaded.meshes {
        let mut moved = vec![false; mesh.uvs.len()];
        for (i, triangle) in mesh.triangles.iter().enumerate() {
            let Some(r) = transform(mesh.materials.get(i).copied().unwrap_or(0)) else { continue };
            for v in triangle.map(|v| v as usize) {
                if let (Some(uv), Some(done @ false)) = (mesh.uvs.get_mut(v), moved.get_mut(v)) {
                    *uv = Vec2::from(r.transform((*uv).into()));
                    *done = true;
                }
            }
        }
    }
}

/// Gives every mesh the vertex attributes that any of them has: a merged mesh keeps only those that all have.
pub fn complete(meshes: &mut [Mesh]) {
    let tangents = meshes.iter().any(|m| !m.tangents.is_empty());
    let uvs = meshes.iter().any(|m| !m.uvs.is_empty());
    for m in meshes {
        if tangents && m.tangents.is_empty() {
            let t = |n: &Vec3| Frame::from_normal(n.as_dvec3()).t.as_vec3().extend(1.0);
            m.tangents = m.normals.iter().map(t).collect();
        }
        if uvs && m.uvs.is_empty() {
            m.uvs = vec![Vec2::ZERO; m.positions.len()];
        }
    }
}

/// Renumbers the material slots so that every one is used; returns the old number of each.
fn compact(mesh: &mut Mesh) -> Vec<u32> {
    mesh.materials.resize(mesh.triangles.len(), 0);
    let mut used = mesh.materials.clone();
    used.sort_unstable();
    used.dedup();
    for m in &mut mesh.materials {
        // Every slot is in the list that was made of them.
        *m = used.binary_search(m).unwrap_or(0) as u32;
    }
    used
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_scene::shapes::sphere;

    #[test]
    fn slots_are_renumbered_and_coordinates_moved_once() {
        let mut mesh = Mesh::merged(&[sphere(8).with_material(7), sphere(8).with_material(3)]);
        assert_eq!(compact(&mut mesh), [3, 7]);
        assert_eq!((mesh.material(0), mesh.materials.last()), (1, Some(&0)));
        let texture = TextureRef { offset: [0.5, 0.0], ..TextureRef::new(0) };
        let material = MaterialData { base_color_texture: Some(texture), ..MaterialData::default() };
        let before = sphere(8).uvs;
        let mut loaded = Loaded { meshes: vec![sphere(8)], materials: vec![material], ..Loaded::default() };
        place_textures(&mut loaded);
        for (a, b) in loaded.meshes[0].uvs.iter().zip(before) {
            assert!((*a - b - Vec2::new(0.5, 0.0)).length() < 1e-6);
        }
    }
}
