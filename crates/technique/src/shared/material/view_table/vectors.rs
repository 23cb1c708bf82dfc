//! Vectors of sixteen points side by side, and frames on them.

use steradian_simd::{Arch, Single, Vector};

/// Number of points that are shaded together.
pub const SIDE: usize = 16;

/// x, y and z of vectors.
pub(super) type Vectors = [[f32; SIDE]; 3];

/// x, y and z of as many vectors as a register has lanes. (Compilers do not vectorise loops over arrays that
/// contain branches; measured: 55 of 66 ns a point went into frames.)
#[derive(Clone, Copy)]
pub(super) struct Xyz<V>(pub(super) [V; 3]);

impl<V: Single> Xyz<V> {
    #[inline(always)]
    pub(super) fn load(v: &Vectors, lane: usize) -> Self {
        Self([V::load(&v[0][lane..]), V::load(&v[1][lane..]), V::load(&v[2][lane..])])
    }

    /// From number `first` of three planes on.
    ///
    /// # Panics
    /// If a plane ends before.
    #[inline(always)]
    pub(super) fn at(v: [&[f32]; 3], first: usize) -> Self {
        Self([V::load(&v[0][first..]), V::load(&v[1][first..]), V::load(&v[2][first..])])
    }

    #[inline(always)]
    pub(super) fn minus(self, b: Self) -> Self {
        Self([self.0[0].sub(b.0[0]), self.0[1].sub(b.0[1]), self.0[2].sub(b.0[2])])
    }

    #[inline(always)]
    pub(super) fn store(self, to: &mut Vectors, lane: usize) {
        for k in 0..3 {
            self.0[k].store(&mut to[k][lane..]);
        }
    }

    #[inline(always)]
    pub(super) fn dot(self, b: Self) -> V {
        self.0[2].fma(b.0[2], self.0[1].fma(b.0[1], self.0[0].mul(b.0[0])))
    }

    /// self + s · b.
    #[inline(always)]
    pub(super) fn plus(self, s: V, b: Self) -> Self {
        Self([b.0[0].fma(s, self.0[0]), b.0[1].fma(s, self.0[1]), b.0[2].fma(s, self.0[2])])
    }

    #[inline(always)]
    pub(super) fn cross(self, b: Self) -> Self {
        let ([x, y, z], [u, v, w]) = (self.0, b.0);
        Self([z.fnma(v, y.mul(w)), x.fnma(w, z.mul(u)), y.fnma(u, x.mul(v))])
    }

    /// Unit tangents along `along` perpendicular to the normals `self`; where that is none, n × a turned
    /// likewise, with a = +Y if |n·y| < 0.99, else +X.
    #[inline(always)]
    pub(super) fn tangents(self, along: Self) -> Self {
        let zero = V::splat(0.0);
        let own = along.plus(zero.sub(self.dot(along)), self);
        let [x, y, z] = self.0;
        let level = V::splat(0.99 * 0.99).sub(y.mul(y));
        let usual = Self([
            level.if_positive(z, zero),
            level.if_positive(zero, zero.sub(z)),
            level.if_positive(zero.sub(x), y),
        ]);
        let good = own.dot(own).sub(V::splat(1e-12));
        let t = Self([
            good.if_positive(own.0[0], usual.0[0]),
            good.if_positive(own.0[1], usual.0[1]),
            good.if_positive(own.0[2], usual.0[2]),
        ]);
        let size = t.dot(t);
        let size = size.sub(V::splat(1e-20)).if_positive(size, V::splat(1e-20));
        let scale = V::splat(1.0).div(size.sqrt());
        Self([t.0[0].mul(scale), t.0[1].mul(scale), t.0[2].mul(scale)])
    }

    /// cos γ, sin γ, cos β, −sin β, cos α, sin α of the frames (t, b, n) with n = `self`.
    #[inline(always)]
    pub(super) fn angles(self, t: Self, b: Self) -> [V; 6] {
        let [x, y, z] = self.0;
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let h = y.fma(y, x.mul(x)).sqrt();
        let leans = h.sub(V::splat(1e-18));
        let inverse = one.div(leans.if_positive(h, one));
        let cos = leans.if_positive(x.mul(inverse), one);
        let sin = leans.if_positive(y.mul(inverse), zero);
        [sin.fnma(b.0[0], cos.mul(b.0[1])), sin.fnma(t.0[0], cos.mul(t.0[1])), z, zero.sub(h), cos, sin]
    }
}

/// [`Xyz::tangents`] of sixteen points.
#[inline(always)]
pub(super) fn tangents<A: Arch>(n: &Vectors, along: &Vectors) -> Vectors {
    let mut out = [[0.0; SIDE]; 3];
    let mut lane = 0;
    while lane < SIDE {
        Xyz::<A::F32>::load(n, lane).tangents(Xyz::load(along, lane)).store(&mut out, lane);
        lane += A::F32::LANES;
    }
    out
}

/// [`Xyz::angles`] of sixteen frames with tangents along `along`.
#[inline(always)]
pub(super) fn frame_angles<A: Arch>(n: &Vectors, along: &Vectors) -> [[f32; SIDE]; 6] {
    let mut out = [[0.0; SIDE]; 6];
    let mut lane = 0;
    while lane < SIDE {
        let n = Xyz::<A::F32>::load(n, lane);
        let t = n.tangents(Xyz::load(along, lane));
        let a = n.angles(t, n.cross(t));
        for k in 0..6 {
            a[k].store(&mut out[k][lane..]);
        }
        lane += A::F32::LANES;
    }
    out
}

/// The vectors of sixteen points from the first; beyond the end the last point is repeated. Zeros where there
/// are none. (Copied by whole registers: a wide load from memory just written by narrower stores has to wait
/// until these have reached the cache, and sixteen points took twice as long.)
#[inline(always)]
pub(super) fn read<A: Arch>(v: [&[f32]; 3], first: usize, len: usize) -> Vectors {
    let mut out = [[0.0; SIDE]; 3];
    for k in 0..3 {
        if v[k].len() >= len && len > 0 {
            if let Some(x) = v[k].get(first..first + SIDE) {
                copy::<A>(x, &mut out[k]);
            } else {
                for i in 0..SIDE {
                    out[k][i] = v[k][(first + i).min(len - 1)];
                }
            }
        }
    }
    out
}

/// Copies sixteen numbers by registers.
#[inline(always)]
pub(super) fn copy<A: Arch>(from: &[f32], to: &mut [f32; SIDE]) {
    let mut lane = 0;
    while lane < SIDE {
        A::F32::load(&from[lane..]).store(&mut to[lane..]);
        lane += A::F32::LANES;
    }
}
