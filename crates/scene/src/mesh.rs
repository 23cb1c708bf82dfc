//! Indexed triangle meshes.

use glam::{Vec2, Vec3, Vec4};

/// An indexed triangle mesh with normals and tangents at every vertex.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, metres.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals.
    pub normals: Vec<Vec3>,
    /// Unit tangents; w is the sign of the bitangent: b = w · (n × t). Empty until made.
    pub tangents: Vec<Vec4>,
    /// Texture coordinates, v downwards (glTF). Empty where the mesh has none.
    pub uvs: Vec<Vec2>,
    /// Three vertex indices a triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Material slot of each triangle; empty where there is one material.
    pub materials: Vec<u32>,
}
