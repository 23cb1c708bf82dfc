//! Inner nodes of eight children and the slab test.

use super::LANES;
use super::triangle::Lane;
use glam::Vec3;
use steradian_simd::Lanes;

/// Marks a child as a leaf; the low bits are the index of its block.
pub const LEAF: u32 = 1 << 31;

/// Eight boxes, structure of arrays; absent children are empty boxes that only a ray of NaN hits, and lead to
/// the first block, which holds no triangle.
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

/// A ray as the slab test wants it, in lanes `L`.
#[derive(Clone, Copy)]
pub struct Slabs<L> {
    origin: [L; 3],
    inverse: [L; 3],
    /// Reciprocals of the direction times [`WIDEN`], for the far planes.
    beyond: [L; 3],
    /// Index, of the six planes, of the near one on each axis.
    near: [usize; 3],
}

/// Distances to the far planes are widened by this factor, so that rounding never loses a box (Ize 2013,
/// Robust BVH Ray Traversal: 1 + 2γ₃; a fourth rounding here is that of the widened factor itself).
const WIDEN: f32 = 1.000_000_6;

impl<L: Lanes> Slabs<L> {
    /// The slabs of a ray.
    #[inline(always)]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let (o, d) = (origin.to_array(), direction.to_array());
        let inverse = d.map(|d| 1.0 / d);
        let side = |k: usize| 2 * k + usize::from(d[k].is_sign_negative());
        Self {
            origin: splat(o),
            inverse: splat(inverse),
            beyond: splat(inverse.map(|r| r * WIDEN)),
            near: [side(0), side(1), side(2)],
        }
    }

    /// Entry distance of the ray into each box, and a bit for every box that it meets in [0, `t_max`].
    ///
    /// A ray inside a plane gives 0·∞ = NaN there, and a comparison with NaN keeps its second operand, which
    /// is never NaN at the end: some planes then do not count, so a box may be visited in vain but never
    /// missed.
    #[inline(always)]
    pub fn enter(&self, node: &Node, t_max: f32) -> (L, u32) {
        let [x, y, z] = [
            self.cross(node, self.near[0], 0, &self.inverse),
            self.cross(node, self.near[1], 1, &self.inverse),
            self.cross(node, self.near[2], 2, &self.inverse),
        ];
        let enter = x.max(y).max(z.max(L::splat(0.0)));
        let [x, y, z] = [
            self.cross(node, self.near[0] ^ 1, 0, &self.beyond),
            self.cross(node, self.near[1] ^ 1, 1, &self.beyond),
            self.cross(node, self.near[2] ^ 1, 2, &self.beyond),
        ];
        let leave = x.min(y).min(z.min(L::splat(t_max)));
        (enter, enter.le(leave))
    }

    /// Distances to a plane of each box on axis `k`.
    #[inline(always)]
    fn cross(&self, node: &Node, plane: usize, k: usize, inverse: &[L; 3]) -> L {
        L::load(&node.planes[plane]).sub(self.origin[k]).mul(inverse[k])
    }
}

/// Rays of one origin whose directions lie in a box, as the slab test wants them.
#[derive(Clone, Copy)]
pub struct Cone<L> {
    origin: [L; 3],
    /// Inverses of the least and of the largest component along each axis.
    inverse: [[L; 3]; 2],
    /// These inverses times [`WIDEN`], for the far planes.
    beyond: [[L; 3]; 2],
    /// Index, of the six planes, of the near one on each axis.
    near: [usize; 3],
    /// Are there components of both signs, or 0, along an axis?
    mixed: [bool; 3],
}

impl<L: Lanes> Cone<L> {
    /// Directions from `low` to `high`.
    #[inline(always)]
    pub fn new(origin: Vec3, low: Vec3, high: Vec3) -> Self {
        let (low, high) = (low.to_array(), high.to_array());
        // Nothing below is reached by components of 0 at least, and nothing above by those of 0 at most.
        let inverse = [(low, f32::NEG_INFINITY), (high, f32::INFINITY)]
            .map(|(d, none)| d.map(|d| if d == 0.0 { none } else { 1.0 / d }));
        Self {
            origin: splat(origin.to_array()),
            inverse: [splat(inverse[0]), splat(inverse[1])],
            beyond: inverse.map(|i| splat(i.map(|r| r * WIDEN))),
            near: [0, 1, 2].map(|k| 2 * k + usize::from(high[k] < 0.0)),
            mixed: [0, 1, 2].map(|k| low[k] <= 0.0 && high[k] >= 0.0),
        }
    }

    /// A bit for every box that some of the rays meet by [`Slabs::enter`] in [0, `t_max`], and for some
    /// others: distances are bounded by those of rays of the least and the largest components, since rounding
    /// keeps order.
    #[inline(always)]
    pub fn enter(&self, node: &Node, t_max: f32) -> u32 {
        let (mut enter, mut leave) = (L::splat(0.0), L::splat(t_max));
        for k in 0..3 {
            let along = |plane: usize, inverse: &[L; 3]| {
                L::load(&node.planes[plane]).sub(self.origin[k]).mul(inverse[k])
            };
            if self.mixed[k] {
                // Only positive components reach planes above, and only negative ones those below.
                enter = along(2 * k, &self.inverse[1]).max(enter);
                enter = along(2 * k + 1, &self.inverse[0]).max(enter);
                continue;
            }
            let (near, far) = (self.near[k], self.near[k] ^ 1);
            enter = along(near, &self.inverse[0]).min(along(near, &self.inverse[1])).max(enter);
            leave = along(far, &self.beyond[0]).max(along(far, &self.beyond[1])).min(leave);
        }
        enter.le(leave)
    }
}

/// Broadcasts each number to all lanes. (A closure for `map` might not be inlined into the kernel.)
#[inline(always)]
pub fn splat<L: Lanes>(x: [f32; 3]) -> [L; 3] {
    [L::splat(x[0]), L::splat(x[1]), L::splat(x[2])]
}
