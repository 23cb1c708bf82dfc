//! Shading of batches: sixteen points at a time look their coefficients up, turn them to the world, and
//! multiply them with the light's. `wgsl.rs` writes the same functions.
//!
//! KSS02 turns the light into each point's frame. Turning the reflectance out of it gives the same sum, and
//! for one channel of reflectance under three of light it is a third of the work.

use super::{Places, ViewTable, lattice};
use crate::{Points, Radiance};
use steradian_simd::{Arch, Kernel, Single, Vector};
use steradian_sphere::sh::{Angle, Exchange, ShRgb, turn};

/// Points that are shaded together.
pub const SIDE: usize = 16;
/// Coefficients at most, filled up to whole registers.
pub(super) const MOST: usize = 240;

/// The light's coefficients, times the table's tint, and what turns them.
#[derive(Debug, Clone)]
pub struct LightLanes {
    c: Vec<[f32; 3]>,
    exchange: Exchange,
}

impl LightLanes {
    /// The first bands of `sh` for a table.
    pub fn new(table: &ViewTable, sh: &ShRgb) -> Self {
        let at = |i: usize| {
            [0, 1, 2].map(|c| sh.c[c].get(i).map_or(0.0, |x| (f64::from(table.tint[c]) * x) as f32))
        };
        let written = table.bands <= 6;
        Self {
            c: (0..table.bands * table.bands).map(at).collect(),
            exchange: Exchange::new(if written { 0 } else { table.bands }),
        }
    }

    /// L_i.
    pub fn coefficients(&self) -> &[[f32; 3]] {
        &self.c
    }
}

/// Radiance of all points under a light; points that face away get 0. Where a batch has no tangents, or none
/// at a point, the frame is that of a surface without tangents.
pub fn shade(table: &ViewTable, light: &LightLanes, q: &Points<'_>, out: &mut Radiance<'_>) {
    steradian_simd::run(Batch { table, places: None, light, q, out });
}

/// [`shade`] where each point has a reflectance of its own; points without texture coordinates have that at
/// (0, 0).
pub fn shade_places(
    table: &ViewTable,
    places: &Places,
    light: &LightLanes,
    q: &Points<'_>,
    out: &mut Radiance<'_>,
) {
    steradian_simd::run(Batch { table, places: Some(places), light, q, out });
}

struct Batch<'a, 'b, 'c> {
    table: &'a ViewTable,
    places: Option<&'a Places>,
    light: &'a LightLanes,
    q: &'a Points<'b>,
    out: &'a mut Radiance<'c>,
}

impl Kernel for Batch<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let Self { table, places, light, q, out } = self;
        let mut first = 0;
        while first < q.len() {
            let mut b = Block::at::<A>(table, q, first);
            if let Some(places) = places {
                b.place(table, places, q, first);
            }
            let mut sums = [[0.0; SIDE]; 3];
            turned::<A>(table, &light.exchange, &b, &mut Multiply { table, light, sums: &mut sums });
            for (plane, sum) in out.rgb.iter_mut().zip(&sums) {
                for (i, o) in plane[first..].iter_mut().take(SIDE).enumerate() {
                    *o = if b.facing()[i] { sum[i] } else { 0.0 };
                }
            }
            first += SIDE;
        }
    }
}

/// Where sixteen points look.
#[derive(Clone, Copy)]
pub(super) struct Look {
    /// Number of the texel at (⌊s⌋, ⌊t⌋).
    pub(super) texel: [u32; SIDE],
    /// Weights of the four texels, times the power of n·wo.
    pub(super) weights: [[f32; SIDE]; 4],
    facing: [bool; SIDE],
}

/// Where sixteen points look, and how their frames lie.
pub(super) struct Block {
    look: Look,
    /// cos γ, sin γ, cos β, −sin β, cos α, sin α of the frame.
    angles: [[f32; SIDE]; 6],
    /// How many tables each point's coefficients are weighed between.
    tables: usize,
    /// First numbers of these tables, and their weights.
    offsets: [[usize; SIDE]; 4],
    shares: [[f32; SIDE]; 4],
}

/// x, y and z of vectors.
pub(super) type Vectors = [[f32; SIDE]; 3];

/// x, y and z of as many vectors as a register has lanes. (Loops over arrays are not made vectors of by
/// themselves where they branch; measured: 55 of 66 ns a point went into frames.)
#[derive(Clone, Copy)]
pub(super) struct Xyz<V>(pub(super) [V; 3]);

impl<V: Single> Xyz<V> {
    #[inline(always)]
    pub(super) fn load(v: &Vectors, lane: usize) -> Self {
        Self([V::load(&v[0][lane..]), V::load(&v[1][lane..]), V::load(&v[2][lane..])])
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
    fn cross(self, b: Self) -> Self {
        let ([x, y, z], [u, v, w]) = (self.0, b.0);
        Self([z.fnma(v, y.mul(w)), x.fnma(w, z.mul(u)), y.fnma(u, x.mul(v))])
    }

    /// Unit tangents along `along` perpendicular to the normals `self`; where that is none, n × a turned
    /// likewise, with a = +Y if |n·y| < 0.99, else +X.
    #[inline(always)]
    fn tangents(self, along: Self) -> Self {
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
    fn angles(self, t: Self, b: Self) -> [V; 6] {
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

/// The vectors of sixteen points from the first; the last point fills up. Zeros where there are none. (By
/// registers: what is copied by smaller ones can't be read by a whole one before it has reached the cache,
/// and sixteen points took twice as long.)
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

impl Look {
    /// Nowhere.
    pub(super) const NONE: Self = Self { texel: [0; SIDE], weights: [[0.0; SIDE]; 4], facing: [false; SIDE] };

    /// Looks from points of these normals in these directions to the viewer, with tangents along `along`; and
    /// finds the angles of their frames, if they are asked for.
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
        let texels = Texels::<A::F32>::new(table);
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

    /// Looks from points of frames with these normals and tangents, unit and perpendicular.
    #[inline(always)]
    pub(super) fn set_in_frames<A: Arch>(
        &mut self,
        table: &ViewTable,
        n: &Vectors,
        t: &Vectors,
        wo: &Vectors,
    ) {
        let mut up = [0.0; SIDE];
        let texels = Texels::<A::F32>::new(table);
        let mut lane = 0;
        while lane < SIDE {
            let [n, t, wo] = [Xyz::<A::F32>::load(n, lane), Xyz::load(t, lane), Xyz::load(wo, lane)];
            self.texels(&texels, lane, [n, t, n.cross(t)], wo, &mut up);
            lane += A::F32::LANES;
        }
        self.weigh(table, &up);
    }

    /// The texels and weights of local views, and the cosines of these. Whether a view is in front is decided
    /// by products that are rounded each, as everywhere else.
    #[inline(always)]
    fn texels<V: Single>(
        &mut self,
        of: &Texels<V>,
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
    fn weigh(&mut self, table: &ViewTable, up: &[f32; SIDE]) {
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

/// How the texels of a table lie on the paraboloid.
struct Texels<V> {
    reach: V,
    inverse: V,
    /// The last place, and the last texel with one behind it.
    most: V,
    last: V,
    row: V,
}

impl<V: Single> Texels<V> {
    #[inline(always)]
    fn new(table: &ViewTable) -> Self {
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

impl Block {
    /// Sixteen points of a batch.
    #[inline(always)]
    pub(super) fn at<A: Arch>(table: &ViewTable, q: &Points<'_>, first: usize) -> Self {
        let len = q.len();
        Self::new::<A>(
            table,
            &read::<A>(q.n, first, len),
            &read::<A>(q.t, first, len),
            &read::<A>(q.wo, first, len),
        )
    }

    /// Points of these normals and directions to the viewer, with tangents along `along`.
    #[inline(always)]
    pub(super) fn new<A: Arch>(table: &ViewTable, n: &Vectors, along: &Vectors, wo: &Vectors) -> Self {
        let mut angles = [[0.0; SIDE]; 6];
        let mut look = Look::NONE;
        look.set::<A>(table, n, along, wo, Some(&mut angles));
        Self { look, angles, tables: 1, offsets: [[0; SIDE]; 4], shares: [[1.0; SIDE]; 4] }
    }

    /// Gives each point its own tables.
    #[inline(always)]
    fn place(&mut self, table: &ViewTable, places: &Places, q: &Points<'_>, first: usize) {
        self.tables = places.around_each();
        let numbers = table.size * table.size * table.channels * table.stride;
        for i in 0..SIDE {
            let p = (first + i).min(q.len() - 1);
            let of = |v: &[f32]| v.get(p).copied().unwrap_or(0.0);
            // Charts end with the footprint.
            let footprint = q.chart.last().map_or(0.0, |v| of(v));
            let at = places.at(q.uv.map(of), footprint);
            for k in 0..self.tables {
                self.offsets[k][i] = at.nodes[k] * numbers;
                self.shares[k][i] = at.weights[k];
            }
        }
    }

    /// Does the viewer see each point's front?
    #[inline(always)]
    pub(super) fn facing(&self) -> &[bool; SIDE] {
        &self.look.facing
    }
}

/// The four texels around one point's view: P numbers of each.
pub(super) struct Corners<'a, V, const P: usize> {
    rows: [&'a [f32; P]; 4],
    weights: [V; 4],
}

impl<'a, V: Single, const P: usize> Corners<'a, V, P> {
    /// Of point `i`, from number `from` of `texels`, a table's of `size` texels a row, `texel` numbers each.
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

/// P numbers of point `i`, from number `first` of a texel, in the mean over its tables. (Closures and `map`
/// over arrays of registers are compiled as functions of the narrowest instruction set, which call one for
/// each instruction.)
#[inline(always)]
fn gather<A: Arch, const P: usize>(table: &ViewTable, b: &Block, i: usize, first: usize, to: &mut [f32]) {
    let shape = [table.size, table.channels * table.stride];
    let from = b.look.texel[i] as usize * shape[1] + first;
    for k in 0..b.tables {
        let corners = Corners::<A::F32, P>::at(&table.data, shape, &b.look, i, from + b.offsets[k][i]);
        let share = A::F32::splat(b.shares[k][i]);
        let mut at = 0;
        while at < P {
            let v = corners.load(at);
            let v = if b.tables == 1 {
                v
            } else if k == 0 {
                v.mul(share)
            } else {
                v.fma(share, A::F32::load(&to[at..]))
            };
            v.store(&mut to[at..]);
            at += A::F32::LANES;
        }
    }
}

/// What becomes of coefficients that were turned to the world.
pub(super) trait Sink {
    /// Those of channel `c` of the points from `lane` on, a point a lane.
    fn take<V: Vector<T = f32>>(&mut self, c: usize, lane: usize, f: &[V]);
}

/// The coefficients of sixteen points, turned to the world.
#[inline(always)]
pub(super) fn turned<A: Arch>(table: &ViewTable, exchange: &Exchange, b: &Block, to: &mut impl Sink) {
    match table.bands {
        3 => few::<A, 9, 16>(table, b, to),
        4 => few::<A, 16, 16>(table, b, to),
        5 => few::<A, 25, 32>(table, b, to),
        6 => few::<A, 36, 48>(table, b, to),
        _ => many::<A>(table, exchange, b, to),
    }
}

/// Three to six bands: N coefficients in P numbers.
#[inline(always)]
fn few<A: Arch, const N: usize, const P: usize>(table: &ViewTable, b: &Block, to: &mut impl Sink) {
    let mut rows = [[0.0f32; P]; SIDE];
    for c in 0..table.channels {
        for i in 0..SIDE {
            gather::<A, P>(table, b, i, c * table.stride, &mut rows[i]);
        }
        let mut lane = 0;
        while lane < SIDE {
            let mut f = [A::F32::splat(0.0); N];
            let mut from = 0;
            while from < P {
                let mut tile = [A::F32::splat(0.0); SIDE];
                for k in 0..A::F32::LANES {
                    tile[k] = A::F32::load(&rows[lane + k][from..]);
                }
                A::F32::transpose(&mut tile[..A::F32::LANES]);
                for k in 0..A::F32::LANES {
                    if from + k < N {
                        f[from + k] = tile[k];
                    }
                }
                from += A::F32::LANES;
            }
            let a = &b.angles;
            let angles = [
                Angle::new(A::F32::load(&a[0][lane..]), A::F32::load(&a[1][lane..])),
                Angle::new(A::F32::load(&a[2][lane..]), A::F32::load(&a[3][lane..])),
                Angle::new(A::F32::load(&a[4][lane..]), A::F32::load(&a[5][lane..])),
            ];
            turn(&angles, &mut f);
            to.take(c, lane, &f);
            lane += A::F32::LANES;
        }
    }
}

/// Any number of bands.
#[inline(always)]
fn many<A: Arch>(table: &ViewTable, exchange: &Exchange, b: &Block, to: &mut impl Sink) {
    let n = table.bands * table.bands;
    let mut rows = [[0.0f32; MOST]; SIDE];
    let (mut f, mut scratch) = ([A::F32::splat(0.0); MOST], [A::F32::splat(0.0); MOST]);
    for c in 0..table.channels {
        for i in 0..SIDE {
            // Rows of the table are filled up to multiples of sixteen.
            for first in (0..table.stride).step_by(16) {
                gather::<A, 16>(table, b, i, c * table.stride + first, &mut rows[i][first..]);
            }
        }
        let mut lane = 0;
        while lane < SIDE {
            let mut column = [0.0; SIDE];
            for (k, f) in f[..n].iter_mut().enumerate() {
                (0..A::F32::LANES).for_each(|i| column[i] = rows[lane + i][k]);
                *f = A::F32::load(&column);
            }
            let mut angles = [[A::F32::splat(0.0); 2]; 3];
            for k in 0..6 {
                angles[k / 2][k % 2] = A::F32::load(&b.angles[k][lane..]);
            }
            exchange.turn(&angles, &mut f[..n], &mut scratch[..n]);
            to.take(c, lane, &f[..n]);
            lane += A::F32::LANES;
        }
    }
}

/// Σ_i L_i c_i of each channel, or of all three where they share one.
struct Multiply<'a> {
    table: &'a ViewTable,
    light: &'a LightLanes,
    sums: &'a mut [[f32; SIDE]; 3],
}

impl Sink for Multiply<'_> {
    #[inline(always)]
    fn take<V: Vector<T = f32>>(&mut self, c: usize, lane: usize, f: &[V]) {
        let l = &self.light.c[..f.len()];
        if self.table.channels == 1 {
            let mut sum = [V::splat(0.0); 3];
            for (f, l) in f.iter().zip(l) {
                for k in 0..3 {
                    sum[k] = f.fma(V::splat(l[k]), sum[k]);
                }
            }
            for k in 0..3 {
                sum[k].store(&mut self.sums[k][lane..]);
            }
        } else {
            let mut sum = V::splat(0.0);
            for (f, l) in f.iter().zip(l) {
                sum = f.fma(V::splat(l[c]), sum);
            }
            sum.store(&mut self.sums[c][lane..]);
        }
    }
}
