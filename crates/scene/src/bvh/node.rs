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
        let [x, y, z] = self.near;
        let near = [self.relative(node, x), self.relative(node, y), self.relative(node, z)];
        let far = [self.relative(node, x ^ 1), self.relative(node, y ^ 1), self.relative(node, z ^ 1)];
        self.between(near, far, t_max)
    }

    /// [`Slabs::enter`] of boxes whose six planes are given by [`Slabs::relative`] of a ray of the same
    /// origin.
    #[inline(always)]
    pub fn enter_relative(&self, planes: &[L; 6], t_max: f32) -> u32 {
        let [x, y, z] = self.near;
        let (near, far) = ([planes[x], planes[y], planes[z]], [planes[x ^ 1], planes[y ^ 1], planes[z ^ 1]]);
        self.between(near, far, t_max).1
    }

    /// One of the six planes of each box, seen from the origin.
    #[inline(always)]
    pub fn relative(&self, node: &Node, plane: usize) -> L {
        L::load(&node.planes[plane]).sub(self.origin[plane / 2])
    }

    #[inline(always)]
    fn between(&self, near: [L; 3], far: [L; 3], t_max: f32) -> (L, u32) {
        let (i, b) = (&self.inverse, &self.beyond);
        let [x, y, z] = [near[0].mul(i[0]), near[1].mul(i[1]), near[2].mul(i[2])];
        let enter = x.max(y).max(z.max(L::splat(0.0)));
        let [x, y, z] = [far[0].mul(b[0]), far[1].mul(b[1]), far[2].mul(b[2])];
        let leave = x.min(y).min(z.min(L::splat(t_max)));
        (enter, enter.le(leave))
    }
}

/// Broadcasts each number to all lanes. (A closure for `map` might not be inlined into the kernel.)
#[inline(always)]
pub fn splat<L: Lanes>(x: [f32; 3]) -> [L; 3] {
    [L::splat(x[0]), L::splat(x[1]), L::splat(x[2])]
}
