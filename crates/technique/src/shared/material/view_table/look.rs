//! Lookups of points in a table: the four texels around each view, and their weights.

use super::ViewTable;
use super::vectors::{SIDE, Vectors, Xyz};
use steradian_brdf::views::paraboloid::lattice;
use steradian_simd::{Arch, Single, Vector};

/// Lookups of sixteen points.
#[derive(Clone, Copy)]
pub(super) struct Look {
    /// Number of the texel at (⌊s⌋, ⌊t⌋).
    pub(super) texel: [u32; SIDE],
    /// Weights of the four texels, times the power of n·wo.
    pub(super) weights: [[f32; SIDE]; 4],
    /// Does the point face the viewer?
    pub(super) facing: [bool; SIDE],
}

impl Look {
    /// No texels.
    pub(super) const NONE: Self = Self { texel: [0; SIDE], weights: [[0.0; SIDE]; 4], facing: [false; SIDE] };

    /// Finds texels for points with these normals and directions to the viewer, with tangents along `along`;
    /// and the angles of their frames, if `angles` is given.
    #[inline(always)]
    pub(super) fn set<A: Arch>(
        &mut self,
        table: &ViewTable,
        n: &Vectors,
        along: &Vectors,
        wo: &Vectors,
        mut angles: Option<&mut [[f32; SIDE]; 6]>,
    ) {
        let mut up = [0.0; SIDE];
        let texels = ParaboloidGrid::<A::F32>::new(table);
        let mut lane = 0;
        while lane < SIDE {
            let [n, along, wo] = [Xyz::<A::F32>::load(n, lane), Xyz::load(along, lane), Xyz::load(wo, lane)];
            let t = n.tangents(along);
            let b = n.cross(t);
            if let Some(angles) = &mut angles {
                let a = n.angles(t, b);
                for k in 0..6 {
                    a[k].store(&mut angles[k][lane..]);
                }
            }
            self.texels(&texels, lane, [n, t, b], wo, &mut up);
            lane += A::F32::LANES;
        }
        self.weigh(table, &up);
    }

    /// Finds texels for points whose normals and tangents are unit and perpendicular.
    #[inline(always)]
    pub(super) fn set_in_frames<A: Arch>(
        &mut self,
        table: &ViewTable,
        n: &Vectors,
        t: &Vectors,
        wo: &Vectors,
    ) {
        let mut up = [0.0; SIDE];
        let texels = ParaboloidGrid::<A::F32>::new(table);
        let mut lane = 0;
        while lane < SIDE {
            let [n, t, wo] = [Xyz::<A::F32>::load(n, lane), Xyz::load(t, lane), Xyz::load(wo, lane)];
            self.texels(&texels, lane, [n, t, n.cross(t)], wo, &mut up);
            lane += A::F32::LANES;
        }
        self.weigh(table, &up);
    }

    /// The texels, weights and cosines of local views. Whether a view is in front of the surface is decided
    /// by products that are each rounded (no fused multiply-add), as in the other loops.
    #[inline(always)]
    pub(super) fn texels<V: Single>(
        &mut self,
        of: &ParaboloidGrid<V>,
        lane: usize,
        frame: [Xyz<V>; 3],
        wo: Xyz<V>,
        up: &mut [f32; SIDE],
    ) {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let [n, t, b] = frame;
        let [x, y, z] = n.0;
        let z = wo.0[0].mul(x).add(wo.0[1].mul(y)).add(wo.0[2].mul(z));
        z.store(&mut up[lane..]);
        let scale = one.div(one.add(z.if_positive(z, zero)));
        let (mut w, mut cells, local) = ([zero; 2], [zero; 2], [wo.dot(t), wo.dot(b)]);
        for k in 0..2 {
            // NaN: the first texel.
            let p = local[k].fma(scale, of.reach).mul(of.inverse);
            let p = p.if_positive(p.min(of.most), zero);
            let c = p.truncate().min(of.last);
            cells[k] = c;
            w[k] = p.sub(c);
        }
        // Whole numbers below 2^24, which f32 has exactly.
        cells[1].fma(of.row, cells[0]).store_whole(&mut self.texel[lane..]);
        let [u, v] = w;
        let both = u.mul(v);
        one.sub(u).sub(v).add(both).store(&mut self.weights[0][lane..]);
        u.sub(both).store(&mut self.weights[1][lane..]);
        v.sub(both).store(&mut self.weights[2][lane..]);
        both.store(&mut self.weights[3][lane..]);
    }

    /// Takes the power of the cosines into the weights.
    #[inline(always)]
    pub(super) fn weigh(&mut self, table: &ViewTable, up: &[f32; SIDE]) {
        for i in 0..SIDE {
            self.facing[i] = up[i] > 0.0;
        }
        if table.pole != 0.0 {
            for i in 0..SIDE {
                let power = table.power(up[i]);
                self.weights.iter_mut().for_each(|w| w[i] *= power);
            }
        }
    }
}

/// The mapping of a table's texels onto the paraboloid.
pub(super) struct ParaboloidGrid<V> {
    reach: V,
    inverse: V,
    /// The last place, and the last texel with one behind it.
    most: V,
    last: V,
    row: V,
}

impl<V: Single> ParaboloidGrid<V> {
    #[inline(always)]
    pub(super) fn new(table: &ViewTable) -> Self {
        let ([reach, h], size) = (lattice(table.size), table.size);
        Self {
            reach: V::splat(reach as f32),
            inverse: V::splat((1.0 / h) as f32),
            most: V::splat((size - 1) as f32),
            last: V::splat((size - 2) as f32),
            row: V::splat(size as f32),
        }
    }
}

/// The four texels around one point's view: P numbers of each.
pub(super) struct Corners<'a, V, const P: usize> {
    rows: [&'a [f32; P]; 4],
    weights: [V; 4],
}

impl<'a, V: Single, const P: usize> Corners<'a, V, P> {
    /// Reads the texel's numbers of point `i`, from number `from` of `texels`, a table of `size` texels a row
    /// and `texel` numbers each.
    ///
    /// # Panics
    /// If the table ends before.
    #[inline(always)]
    pub(super) fn at(
        texels: &'a [f32],
        [size, texel]: [usize; 2],
        look: &Look,
        i: usize,
        from: usize,
    ) -> Self {
        let (near, far) = (&texels[from..], &texels[from + size * texel..]);
        let row = |r: &'a [f32]| r.first_chunk::<P>().expect("rows are of this length");
        Self {
            rows: [row(near), row(&near[texel..]), row(far), row(&far[texel..])],
            weights: [
                V::splat(look.weights[0][i]),
                V::splat(look.weights[1][i]),
                V::splat(look.weights[2][i]),
                V::splat(look.weights[3][i]),
            ],
        }
    }

    /// A register of coefficients from the `j`-th.
    #[inline(always)]
    pub(super) fn load(&self, j: usize) -> V {
        let mut sum = V::load(&self.rows[0][j..]).mul(self.weights[0]);
        for k in 1..4 {
            sum = V::load(&self.rows[k][j..]).fma(self.weights[k], sum);
        }
        sum
    }
}
