//! Shading of batches: sixteen points at a time look their coefficients up, turn them to the world, and multiply them with
//! the light's. `wgsl.rs` writes the same functions.
//!
//! KSS02 turns the light into each point's frame. Turning the reflectance out of it gives the same sum, and for one channel
//! of reflectance under three of light it is a third of the work.

use super::{ViewTable, lattice};
use crate::{Points, Radiance};
use steradian_simd::{Arch, Kernel, Vector};
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

/// Radiance of all points under a light; points that face away get 0. Where a batch has no tangents, or none at a point,
/// the frame is that of a surface without tangents.
pub fn shade(table: &ViewTable, light: &LightLanes, q: &Points<'_>, out: &mut Radiance<'_>) {
    steradian_simd::run(Batch { table, light, q, out });
}

struct Batch<'a, 'b, 'c> {
    table: &'a ViewTable,
    light: &'a LightLanes,
    q: &'a Points<'b>,
    out: &'a mut Radiance<'c>,
}

impl Kernel for Batch<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let Self { table, light, q, out } = self;
        let mut first = 0;
        while first < q.len() {
            let b = Block::at(table, q, first);
            let mut sums = [[0.0; SIDE]; 3];
            turned::<A>(table, &light.exchange, &b, &mut Multiply { table, light, sums: &mut sums });
            for (plane, sum) in out.rgb.iter_mut().zip(&sums) {
                for (i, o) in plane[first..].iter_mut().take(SIDE).enumerate() {
                    *o = if b.facing[i] { sum[i] } else { 0.0 };
                }
            }
            first += SIDE;
        }
    }
}

/// Where sixteen points look, and how their frames lie.
pub(super) struct Block {
    /// First number of the texel at (⌊s⌋, ⌊t⌋).
    at: [usize; SIDE],
    /// Weights of the four texels.
    weights: [[f32; SIDE]; 4],
    /// cos γ, sin γ, cos β, −sin β, cos α, sin α of the frame.
    angles: [[f32; SIDE]; 6],
    facing: [bool; SIDE],
}

/// x, y and z of vectors.
pub(super) type Vectors = [[f32; SIDE]; 3];

#[inline(always)]
fn dot(a: &Vectors, b: &Vectors) -> [f32; SIDE] {
    let mut out = [0.0; SIDE];
    for i in 0..SIDE {
        out[i] = a[0][i] * b[0][i] + a[1][i] * b[1][i] + a[2][i] * b[2][i];
    }
    out
}

/// Unit tangents perpendicular to the normals.
#[inline(always)]
fn tangents(n: &Vectors, along: &Vectors) -> Vectors {
    let d = dot(n, along);
    let mut t: Vectors = [[0.0; SIDE]; 3];
    for i in 0..SIDE {
        let own: [f32; 3] = [0, 1, 2].map(|k| along[k][i] - n[k][i] * d[i]);
        let own2 = own[0] * own[0] + own[1] * own[1] + own[2] * own[2];
        // a × n with a = +Y if |n·y| < 0.99 else +X.
        let level = n[1][i].abs() < 0.99;
        let usual = [
            if level { n[2][i] } else { 0.0 },
            if level { 0.0 } else { -n[2][i] },
            if level { -n[0][i] } else { n[1][i] },
        ];
        let usual2 = usual[0] * usual[0] + usual[1] * usual[1] + usual[2] * usual[2];
        let good = own2 > 1e-12;
        let scale = 1.0 / (if good { own2 } else { usual2.max(1e-20) }).sqrt();
        for k in 0..3 {
            t[k][i] = scale * if good { own[k] } else { usual[k] };
        }
    }
    t
}

/// n × t.
#[inline(always)]
fn bitangents(n: &Vectors, t: &Vectors) -> Vectors {
    let mut b: Vectors = [[0.0; SIDE]; 3];
    for i in 0..SIDE {
        b[0][i] = n[1][i] * t[2][i] - n[2][i] * t[1][i];
        b[1][i] = n[2][i] * t[0][i] - n[0][i] * t[2][i];
        b[2][i] = n[0][i] * t[1][i] - n[1][i] * t[0][i];
    }
    b
}

/// cos γ, sin γ, cos β, −sin β, cos α, sin α of the frames (t, b, n).
#[inline(always)]
fn angles(n: &Vectors, t: &Vectors, b: &Vectors) -> [[f32; SIDE]; 6] {
    let mut a = [[0.0; SIDE]; 6];
    for i in 0..SIDE {
        let h = (n[0][i] * n[0][i] + n[1][i] * n[1][i]).sqrt();
        let inverse = 1.0 / h.max(1e-30);
        let (cos, sin) = if h > 1e-30 { (n[0][i] * inverse, n[1][i] * inverse) } else { (1.0, 0.0) };
        a[0][i] = cos * b[1][i] - sin * b[0][i];
        a[1][i] = cos * t[1][i] - sin * t[0][i];
        a[2][i] = n[2][i];
        a[3][i] = -h;
        a[4][i] = cos;
        a[5][i] = sin;
    }
    a
}

/// [`angles`] of frames with tangents along `along`.
#[inline(always)]
pub(super) fn frame_angles(n: &Vectors, along: &Vectors) -> [[f32; SIDE]; 6] {
    let t = tangents(n, along);
    angles(n, &t, &bitangents(n, &t))
}

/// The vectors of sixteen points from the first; the last point fills up. Zeros where there are none.
#[inline(always)]
pub(super) fn read(v: [&[f32]; 3], first: usize, len: usize) -> Vectors {
    v.map(|s| {
        let mut out = [0.0; SIDE];
        if s.len() >= len && len > 0 {
            if let Some(x) = s.get(first..first + SIDE) {
                out.copy_from_slice(x);
            } else {
                (0..SIDE).for_each(|i| out[i] = s[(first + i).min(len - 1)]);
            }
        }
        out
    })
}

impl Block {
    /// Sixteen points of a batch.
    #[inline(always)]
    pub(super) fn at(table: &ViewTable, q: &Points<'_>, first: usize) -> Self {
        let [n, t, wo] = [q.n, q.t, q.wo].map(|v| read(v, first, q.len()));
        Self::new(table, &n, &t, &wo)
    }

    /// Points of these normals and directions to the viewer, with tangents along `along`.
    #[inline(always)]
    pub(super) fn new(table: &ViewTable, n: &Vectors, along: &Vectors, wo: &Vectors) -> Self {
        let t = tangents(n, along);
        let b = bitangents(n, &t);
        let mut out = Self {
            at: [0; SIDE],
            weights: [[0.0; SIDE]; 4],
            angles: angles(n, &t, &b),
            facing: [false; SIDE],
        };
        out.place(table, &[dot(wo, &t), dot(wo, &b), dot(wo, n)]);
        out
    }

    /// Does the viewer see each point's front?
    #[inline(always)]
    pub(super) fn facing(&self) -> &[bool; SIDE] {
        &self.facing
    }

    /// The texels and weights of local views.
    #[inline(always)]
    fn place(&mut self, table: &ViewTable, local: &Vectors) {
        let [reach, h] = lattice(table.size);
        let (reach, inverse) = (reach as f32, (1.0 / h) as f32);
        let (most, last) = ((table.size - 1) as f32, (table.size - 2) as f32);
        let texel = table.channels * table.stride;
        let mut cells = [[0.0f32; SIDE]; 2];
        for i in 0..SIDE {
            let facing = local[2][i] > 0.0;
            self.facing[i] = facing;
            let scale = 1.0 / (1.0 + if facing { local[2][i] } else { 0.0 });
            let mut w = [0.0; 2];
            for k in 0..2 {
                // False for NaN too: the first texel.
                let p = (local[k][i] * scale + reach) * inverse;
                let p = if p > 0.0 { p.min(most) } else { 0.0 };
                let c = (p as u16 as f32).min(last);
                cells[k][i] = c;
                w[k] = p - c;
            }
            let [u, v] = w;
            self.weights[0][i] = (1.0 - u) * (1.0 - v);
            self.weights[1][i] = u * (1.0 - v);
            self.weights[2][i] = (1.0 - u) * v;
            self.weights[3][i] = u * v;
        }
        for i in 0..SIDE {
            self.at[i] = (cells[1][i] as usize * table.size + cells[0][i] as usize) * texel;
        }
    }
}

/// The coefficients of channel `c` at one point, P numbers.
#[inline(always)]
pub(super) fn gather<A: Arch>(table: &ViewTable, b: &Block, i: usize, c: usize, to: &mut [f32]) {
    let texel = table.channels * table.stride;
    let (len, from) = (to.len(), b.at[i] + c * table.stride);
    let row = |k: usize| &table.data[from + k..from + k + len];
    let rows = [row(0), row(texel), row(table.size * texel), row((table.size + 1) * texel)];
    let w = [
        A::F32::splat(b.weights[0][i]),
        A::F32::splat(b.weights[1][i]),
        A::F32::splat(b.weights[2][i]),
        A::F32::splat(b.weights[3][i]),
    ];
    let mut at = 0;
    while at < len {
        let mut sum = A::F32::load(&rows[0][at..]).mul(w[0]);
        for k in 1..4 {
            sum = A::F32::load(&rows[k][at..]).fma(w[k], sum);
        }
        sum.store(&mut to[at..]);
        at += A::F32::LANES;
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
        for (i, row) in rows.iter_mut().enumerate() {
            gather::<A>(table, b, i, c, row);
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
        for (i, row) in rows.iter_mut().enumerate() {
            gather::<A>(table, b, i, c, &mut row[..table.stride]);
        }
        let mut lane = 0;
        while lane < SIDE {
            let mut column = [0.0; SIDE];
            for (k, f) in f[..n].iter_mut().enumerate() {
                (0..A::F32::LANES).for_each(|i| column[i] = rows[lane + i][k]);
                *f = A::F32::load(&column);
            }
            let load = |k: usize| A::F32::load(&b.angles[k][lane..]);
            let angles = [0, 2, 4].map(|k| [load(k), load(k + 1)]);
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
