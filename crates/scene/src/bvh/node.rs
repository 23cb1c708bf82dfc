//! Inner nodes of eight children and the slab test.

use super::LANES;
use super::triangle::Lane;
use glam::Vec3;

/// A child is a leaf: the rest of the number is its block.
pub const LEAF: u32 = 1 << 31;

/// Eight boxes, structure of arrays; absent children are empty boxes that only a ray of NaN hits, and lead to the
/// first block, which holds no triangle.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub struct Node {
    /// Lower x, upper x, lower y, upper y, lower z, upper z of each child.
    pub planes: [Lane; 6],
    /// Index of the child node, or [`LEAF`] and the index of its block.
    pub children: [u32; LANES],
}

impl Node {
    /// A node without children.
    pub const EMPTY: Self = Self {
        planes: [
            [f32::INFINITY; LANES],
            [f32::NEG_INFINITY; LANES],
            [f32::INFINITY; LANES],
            [f32::NEG_INFINITY; LANES],
            [f32::INFINITY; LANES],
            [f32::NEG_INFINITY; LANES],
        ],
        children: [LEAF; LANES],
    };
}

/// A ray as the slab test wants it.
#[derive(Debug, Clone, Copy)]
pub struct Slabs {
    origin: [f32; 3],
    inverse: [f32; 3],
    /// Which of the six planes is the nearer on each axis.
    near: [usize; 3],
}

/// Distances to the far planes are widened by this factor, so that rounding never loses a box (Ize 2013, Robust
/// BVH Ray Traversal: 1 + 2γ₃).
const WIDEN: f32 = 1.000_000_4;

impl Slabs {
    /// The slabs of a ray.
    #[inline(always)]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let d = direction.to_array();
        let inverse = d.map(|d| 1.0 / d);
        let side = |k: usize| 2 * k + usize::from(d[k].is_sign_negative());
        Self { origin: origin.to_array(), inverse, near: [side(0), side(1), side(2)] }
    }

    /// Where the ray enters each box, and a bit for every box that it meets in [0, `t_max`].
    ///
    /// A ray inside a plane gives 0·∞ = NaN there; every comparison keeps the other operand then, so the plane
    /// does not count.
    #[inline(always)]
    pub fn enter(&self, node: &Node, t_max: f32) -> (Lane, u32) {
        let (mut enter, mut leave) = ([0.0f32; LANES], [t_max; LANES]);
        for k in 0..3 {
            let (near, far) = (&node.planes[self.near[k]], &node.planes[self.near[k] ^ 1]);
            let (o, r) = (self.origin[k], self.inverse[k]);
            for i in 0..LANES {
                let a = (near[i] - o) * r;
                let b = (far[i] - o) * r * WIDEN;
                enter[i] = if a > enter[i] { a } else { enter[i] };
                leave[i] = if b < leave[i] { b } else { leave[i] };
            }
        }
        let mut mask = 0;
        for i in 0..LANES {
            mask |= u32::from(enter[i] <= leave[i]) << i;
        }
        (enter, mask)
    }
}
