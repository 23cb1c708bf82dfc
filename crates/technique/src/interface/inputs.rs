//! The inputs of a bake and of a frame other than light.

use glam::{Mat3, Vec3};
use std::sync::Arc;
use steradian_brdf::SharedBrdf;
use steradian_relight::btf::Btf;
use steradian_scene::Mesh;
use steradian_scene::surface::Planes;
use steradian_transfer::Saved;

/// Reflectance of a surface. A base-colour texture multiplies the radiance that a technique returns and stays
/// with the renderer.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Material {
    /// The reflectance.
    pub brdf: SharedBrdf,
    /// Parameters of the reflectance that vary over the surface, for techniques that bake from textures;
    /// empty for a homogeneous surface.
    pub textures: Planes,
    /// A bidirectional texture function, the radiance of the surface for every view and light, for techniques
    /// that shade with it.
    pub apparent: Option<Arc<Btf>>,
    /// Does the renderer's normal map tilt shading normals away from those of the mesh?
    pub bumpy: bool,
}

impl Material {
    /// The material of one reflectance.
    pub fn new(brdf: SharedBrdf) -> Self {
        Self { brdf, textures: Planes::default(), apparent: None, bumpy: false }
    }

    /// The material with parameters that vary over the surface.
    #[must_use]
    pub fn with_textures(self, textures: Planes) -> Self {
        Self { textures, ..self }
    }

    /// The material with a bidirectional texture function.
    #[must_use]
    pub fn with_apparent(self, apparent: Arc<Btf>) -> Self {
        Self { apparent: Some(apparent), ..self }
    }

    /// The material with a normal map, or without.
    #[must_use]
    pub fn with_bumps(self, bumpy: bool) -> Self {
        Self { bumpy, ..self }
    }
}

/// Where transfer is baked.
#[derive(Debug, Clone)]
pub struct Geometry {
    /// The mesh that occludes and reflects.
    pub mesh: Arc<Mesh>,
    /// The places that get data.
    pub sites: Sites,
    /// The material of each slot of the mesh ([`Mesh::materials`]), which interreflected light needs; slots
    /// beyond the end have the material that is baked.
    pub materials: Arc<[Material]>,
    /// Precomputed transfer of the mesh's vertices, read from a file. It is used where the sites are
    /// vertices; then no ray is cast, whatever precision a technique asks for.
    pub transfer: Option<Arc<Saved>>,
}

impl Geometry {
    /// A mesh of one material, the one that is baked.
    pub fn new(mesh: Arc<Mesh>, sites: Sites) -> Self {
        Self { mesh, sites, materials: Arc::default(), transfer: None }
    }

    /// Are the sites vertices, between which triangle `i` of the mesh interpolates?
    pub fn spans(&self, i: usize) -> bool {
        match &self.sites {
            Sites::Vertices => true,
            Sites::Slots(slots) => slots.contains(&self.mesh.material(i)),
            Sites::Texels { .. } | Sites::Points { .. } => false,
        }
    }
}

/// The places on a mesh that get transfer data.
#[derive(Debug, Clone)]
pub enum Sites {
    /// Every vertex.
    Vertices,
    /// The vertices of triangles in these slots of the mesh ([`Mesh::materials`]). All other vertices keep
    /// their indices, but their shading is undefined, mostly black.
    Slots(Arc<[u32]>),
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

/// The state that changes from frame to frame.
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
