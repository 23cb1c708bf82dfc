//! The other inputs of a bake and of a frame.

use glam::{Mat3, Vec3};
use std::sync::Arc;
use steradian_brdf::SharedBrdf;
use steradian_scene::Mesh;

/// The reflectance of a surface. A base-colour texture multiplies the radiance that a room returns and stays
/// with the renderer.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Material {
    /// The reflectance.
    pub brdf: SharedBrdf,
}

impl Material {
    /// The material of one reflectance.
    pub fn new(brdf: SharedBrdf) -> Self {
        Self { brdf }
    }
}

/// Where transfer is baked.
#[derive(Debug, Clone)]
pub struct Geometry {
    /// The mesh that occludes and reflects.
    pub mesh: Arc<Mesh>,
    /// The places that get data.
    pub sites: Sites,
}

/// The places on a mesh that get transfer data.
#[derive(Debug, Clone)]
pub enum Sites {
    /// Every vertex.
    Vertices,
    /// Every texel of a texture atlas.
    Texels {
        /// Width of the atlas.
        width: usize,
        /// Height of the atlas.
        height: usize,
    },
    /// Given points with unit normals.
    Points {
        /// Positions, metres.
        p: Arc<[Vec3]>,
        /// Unit normals.
        n: Arc<[Vec3]>,
    },
}

/// What changes from frame to frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// The viewer's position, metres.
    pub eye: Vec3,
    /// Unit direction of view, from the viewer.
    pub forward: Vec3,
    /// Rotation of the distant light: light that came from d at bake time comes from `light_rotation · d`.
    pub light_rotation: Mat3,
}

impl Default for View {
    fn default() -> Self {
        Self { eye: Vec3::ZERO, forward: Vec3::NEG_Z, light_rotation: Mat3::IDENTITY }
    }
}
