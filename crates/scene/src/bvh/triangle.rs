//! The ray–triangle test, eight triangles at a time.
//!
//! Woop, Benthin, Wald 2013, Watertight Ray/Triangle Intersection (JCGT 2(1)): space is sheared so that the
//! ray becomes the z axis; the edge functions of the two triangles at a shared edge are then exact negatives
//! of each other, and no ray slips between them. Edge functions that are zero in f32 are computed again in
//! f64, and so are distances that rounding may have put before or behind the origin: a ray that starts close
//! above a triangle, and far from its corners, does not hit it. Both sides of a triangle are hit.

use super::LANES;
use super::node::splat;
use glam::{DVec3, Vec3};
use steradian_simd::Lanes;

/// One number for each triangle of a block.
pub type Lane = [f32; LANES];

/// Up to eight triangles, structure of arrays; absent ones are NaN and never hit.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub struct Block {
    /// Vertex, axis, triangle.
    pub corners: [[Lane; 3]; 3],
    /// Index of each in the mesh.
    pub ids: [u32; LANES],
}

impl Block {
    /// A block without triangles.
    pub const EMPTY: Self = Self { corners: [[[f32::NAN; LANES]; 3]; 3], ids: [u32::MAX; LANES] };
}

/// A ray in the sheared space of the test, in lanes `L`.
#[derive(Clone, Copy)]
pub struct Shear<L> {
    /// The origin along kx, ky, kz.
    origin: [L; 3],
    /// The axes kx, ky, kz: kz is the direction's largest component; kx and ky keep the winding.
    k: [usize; 3],
    /// Shears in x and y and the scale in z: d_x/d_z, d_y/d_z, 1/d_z.
    s: [L; 3],
}

/// Hits of a ray in a block.
pub struct Met<L> {
    /// A bit for every triangle that is hit.
    pub mask: u32,
    /// Distances.
    pub t: L,
    /// Weights of the second and of the third corner.
    pub uv: [L; 2],
}

impl<L: Lanes> Shear<L> {
    /// The shear of a ray.
    #[inline(always)]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let (o, d) = (origin.to_array(), direction.to_array());
        let a = d.map(f32::abs);
        let kz = if a[0] > a[1] && a[0] > a[2] {
            0
        } else if a[1] > a[2] {
            1
        } else {
            2
        };
        const AFTER: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];
        let [mut kx, mut ky] = AFTER[kz];
        if d[kz] < 0.0 {
            std::mem::swap(&mut kx, &mut ky);
        }
        let z = 1.0 / d[kz];
        Self { origin: splat([o[kx], o[ky], o[kz]]), k: [kx, ky, kz], s: splat([d[kx] * z, d[ky] * z, z]) }
    }

    /// Corner `v` of every triangle of the block in sheared space.
    #[inline(always)]
    fn apply(&self, block: &Block, v: usize) -> [L; 3] {
        let ([kx, ky, kz], corner) = (self.k, &block.corners[v]);
        let z = L::load(&corner[kz]).sub(self.origin[2]);
        let x = L::load(&corner[kx]).sub(self.origin[0]).sub(self.s[0].mul(z));
        let y = L::load(&corner[ky]).sub(self.origin[1]).sub(self.s[1].mul(z));
        [x, y, self.s[2].mul(z)]
    }

    /// The triangles that are hit at a distance in (0, `t_max`); `None` where there is none.
    #[inline(always)]
    pub fn hit(&self, block: &Block, t_max: f32) -> Option<Met<L>> {
        let (a, b, c) = (self.apply(block, 0), self.apply(block, 1), self.apply(block, 2));
        let mut e = [edge(&c, &b), edge(&a, &c), edge(&b, &a)];
        let mut inside = inside(&e);
        if inside == 0 {
            return None;
        }
        let zero = L::splat(0.0);
        if inside & (e[0].eq(zero) | e[1].eq(zero) | e[2].eq(zero)) != 0 {
            e = exact([&a, &b, &c]);
            inside = self::inside(&e);
        }
        // Weights first: the product of an area and a height could leave the range of f32.
        let inverse = L::splat(1.0).div(e[0].add(e[1]).add(e[2]));
        let (u, v, w) = (e[0].mul(inverse), e[1].mul(inverse), e[2].mul(inverse));
        let mut t = u.mul(a[2]).add(v.mul(b[2])).add(w.mul(c[2]));
        let doubtful = inside & magnitude(&[t]).le(rounding(&[a, b, c], inverse));
        if doubtful != 0 {
            t = L::load(&self.distances(block, doubtful, t.store()));
        }
        let mask = inside & zero.lt(t) & t.lt(L::splat(t_max));
        (mask != 0).then_some(Met { mask, t, uv: [v, w] })
    }

    /// The distances `t` with those of some triangles computed without the rounding of f32.
    #[cold]
    #[inline(never)]
    fn distances(&self, block: &Block, which: u32, mut t: Lane) -> Lane {
        let along = |x: [L; 3]| DVec3::from_array(x.map(|x| f64::from(x.store()[0])));
        let (origin, s) = (along(self.origin), along(self.s));
        let direction = DVec3::new(s.x, s.y, 1.0) / s.z;
        for i in (0..LANES).filter(|i| which >> i & 1 != 0) {
            let corner = |v: usize| DVec3::from_array(self.k.map(|k| f64::from(block.corners[v][k][i])));
            let a = corner(0);
            let normal = (corner(1) - a).cross(corner(2) - a);
            t[i] = (normal.dot(a - origin) / normal.dot(direction)) as f32;
        }
        t
    }
}

/// Bound of the rounding error in the distances of triangles with these corners in sheared space and the
/// inverse of the sum of their edge functions: an error of some ε z in x and y, multiplied by x or y, is that
/// of an edge function, by which z is weighted.
#[inline(always)]
fn rounding<L: Lanes>([a, b, c]: &[[L; 3]; 3], inverse: L) -> L {
    let across = magnitude(&[a[0], a[1], b[0], b[1], c[0], c[1]]);
    let along = magnitude(&[a[2], b[2], c[2]]);
    along.mul(along).mul(across.mul(magnitude(&[inverse]))).mul(L::splat(12.0 * f32::EPSILON))
}

/// The largest magnitude.
#[inline(always)]
fn magnitude<L: Lanes>(of: &[L]) -> L {
    let zero = L::splat(0.0);
    of.iter().fold(zero, |m, x| m.max(x.max(zero.sub(*x))))
}

/// A bit for every triangle whose edge functions have no two different signs.
#[inline(always)]
fn inside<L: Lanes>(e: &[L; 3]) -> u32 {
    let zero = L::splat(0.0);
    let (least, most) = (e[0].min(e[1]).min(e[2]), e[0].max(e[1]).max(e[2]));
    zero.le(least) | most.le(zero)
}

/// The edge function of two corners: x_p y_q − y_p x_q.
#[inline(always)]
fn edge<L: Lanes>(p: &[L; 3], q: &[L; 3]) -> L {
    p[0].mul(q[1]).sub(p[1].mul(q[0]))
}

/// The three edge functions with exact signs.
#[inline(always)]
fn exact<L: Lanes>([a, b, c]: [&[L; 3]; 3]) -> [L; 3] {
    let [a, b, c] =
        [[a[0].store(), a[1].store()], [b[0].store(), b[1].store()], [c[0].store(), c[1].store()]];
    let (u, v, w) = (edge_f64(&c, &b), edge_f64(&a, &c), edge_f64(&b, &a));
    [L::load(&u), L::load(&v), L::load(&w)]
}

/// [`edge`] without the rounding of f32.
#[cold]
#[inline(never)]
fn edge_f64(p: &[Lane; 2], q: &[Lane; 2]) -> Lane {
    let product = |a: f32, b: f32| f64::from(a) * f64::from(b);
    std::array::from_fn(|i| (product(p[0][i], q[1][i]) - product(p[1][i], q[0][i])) as f32)
}
