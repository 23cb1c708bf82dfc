//! Blockers as rows of numbers.

use super::LightAt;
use std::sync::Arc;

/// Occluders as rows of single-precision numbers; rows and triangles are numbered within them.
#[derive(Debug, Clone, PartialEq)]
pub enum Flat {
    /// A hierarchy of boxes in the order of a traversal that needs no stack.
    Rays {
        /// Lower corner, a number, upper corner, a number. Where the first number is positive, a ray that
        /// misses the box goes on at that row, else at the next one; where it is −n, the box holds n
        /// triangles from that of the second number on.
        boxes: Vec<[f32; 8]>,
        /// Three corners.
        triangles: Vec<[f32; 9]>,
    },
    /// Depth maps ([`super::ShadowMaps`]).
    Maps {
        /// For each light: direction or position, and 1 for a position; columns of the axes (x and y of the
        /// map and towards the light), each followed by x and y of the centre and half a side; texels of a
        /// side, the index of the first texel (a cube's six faces follow each other), and 1 where the next
        /// row is a wider map of the same light.
        lights: Vec<[f32; 20]>,
        /// Depths, row after row.
        depths: Vec<f32>,
        /// Texels of a side of the square whose comparisons are averaged.
        taps: usize,
    },
    /// Shadow volumes of the lights ([`super::ShadowVolumes`]), for devices that draw.
    Volumes(Arc<Volumes>),
}

/// Shadow volumes as they are drawn: caps at the occluders, sides from there to infinity away from the light,
/// and the caps again at infinity.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Volumes {
    /// Corners.
    pub positions: Vec<[f32; 3]>,
    /// One a light.
    pub lights: Vec<Boundary>,
}

/// The shadow volume of a light. A number behind corners says how many prisms the piece bounds, positive
/// where its normal leads out of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Boundary {
    /// The light.
    pub light: LightAt,
    /// Occluding triangles, in the mesh's own order of corners, so that they are drawn to the same depths:
    /// three corners, number.
    pub caps: Vec<([u32; 3], i32)>,
    /// Quads from an edge p, q to its two ends projected to infinity.
    pub sides: Vec<([u32; 2], i32)>,
}

impl Volumes {
    /// Lights at most.
    pub const MOST: usize = 64;

    /// These volumes and those of `other`, of the same mesh, for lights that are not among these.
    pub fn joined(self: Arc<Self>, other: &Self) -> Arc<Self> {
        let unknown = |b: &&Boundary| self.lights.iter().all(|l| l.light != b.light);
        let new: Vec<_> = other.lights.iter().filter(unknown).cloned().collect();
        if new.is_empty() {
            return self;
        }
        let mut all = Arc::unwrap_or_clone(self);
        all.lights.extend(new);
        Arc::new(all)
    }
}

impl Flat {
    /// Rows that single precision can number.
    pub(crate) const MOST: usize = 1 << 24;
}
