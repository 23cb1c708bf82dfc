//! The parameters, and the links of vertices.

use glam::{DVec3, Vec3};
use steradian_base::{ParamInfo, params};
use steradian_brdf::SharedBrdf;
use steradian_scene::Bvh;
use steradian_sphere::Frame;
use steradian_transfer::Link;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Reflections between surfaces.
        pub bounces: usize = ParamInfo::whole("bounces", [0.0, 8.0], 1.0, "reflections from surface to surface that light takes before the last one, beside direct light"),
        /// Directions of the sphere.
        pub directions: usize = ParamInfo::whole("directions", [8.0, 512.0], 128.0, "directions of the sphere along which vertices see the mesh, half of them above any of them"),
        /// Where links end.
        pub hits: usize = ParamInfo::choice("hits", &["barycentric", "vertex"], "where links end: in triangles, between whose corners light is interpolated, or at the nearest corner").numbered(0.0),
        /// Shadowing of the lights by the mesh, an index of the choices.
        pub shadow: usize = ParamInfo::choice("shadow", &["vertex", "none"], "what the mesh hides of the lights: tried by a ray at each vertex, or nothing").numbered(0.0),
    }
}

impl Params {
    /// Is each point shaded on its own, without the mesh?
    pub(super) fn alone(&self) -> bool {
        self.bounces == 0 && !self.shadowed()
    }

    pub(super) fn shadowed(&self) -> bool {
        self.shadow == 0
    }
}

/// A reflectance, and the links of a mesh.
pub struct Tables {
    pub brdf: SharedBrdf,
    pub seen: Option<Seen>,
    /// The error as stated, its mean at the points, and the noise of the paths.
    pub(super) measured: Option<[f64; 3]>,
}

/// A vertex as part of the triangles of one material.
#[derive(Debug, Clone, Copy)]
pub struct Emitter {
    pub vertex: u32,
    pub(super) slot: u32,
}

/// The surfaces that vertices see.
pub struct Seen {
    pub bvh: Bvh,
    /// Where the rays of each vertex start.
    pub origins: Vec<Vec3>,
    pub frames: Vec<Frame>,
    /// w of each vertex: π over the sum of the cosines of the directions above it.
    pub weights: Vec<f64>,
    pub directions: Vec<DVec3>,
    /// Vertex by vertex, direction by direction.
    pub links: Vec<Link>,
    pub emitters: Vec<Emitter>,
    /// The emitters at the corners of each triangle.
    pub corners: Vec<[u32; 3]>,
    pub(super) slots: Vec<SharedBrdf>,
    pub(super) own: SharedBrdf,
}

impl Seen {
    /// The reflectance of an emitter.
    pub fn brdf(&self, e: Emitter) -> &SharedBrdf {
        self.slots.get(e.slot as usize).unwrap_or(&self.own)
    }

    pub(super) fn bytes(&self) -> usize {
        size_of::<Link>() * self.links.len() + self.bvh.bytes()
    }
}
