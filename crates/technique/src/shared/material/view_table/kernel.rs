//! Shading of batches: sixteen points at a time look up their coefficients, rotate them to world axes, and
//! multiply them with the light's. `wgsl.rs` writes the same functions for GPUs.
//!
//! KSS02 rotates the light into each point's frame. Rotating the reflectance out of it gives the same sum,
//! and for one channel of reflectance under three of light it is a third of the work.

use super::look::{Corners, Look};
use super::vectors::{SIDE, Vectors, read};
use super::{Places, ViewTable};
use crate::{Points, Radiance};
use steradian_simd::{Arch, Kernel, Vector};
use steradian_sphere::sh::{Angle, Exchange, ShRgb, turn};

/// Most coefficients, padded to whole registers.
pub(super) const MOST: usize = 240;

/// The light's coefficients, multiplied by the table's tint, and the constants of their rotation.
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

/// [`shade`] where the reflectance varies over the surface; points without texture coordinates use the
/// reflectance at (0, 0).
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

/// Lookups of sixteen points in the table, and the orientation of their frames.
pub(super) struct Block {
    look: Look,
    /// cos γ, sin γ, cos β, −sin β, cos α, sin α of the frame.
    angles: [[f32; SIDE]; 6],
    /// Number of tables between which each point's coefficients are interpolated.
    tables: usize,
    /// Offsets of these tables, and their weights.
    offsets: [[usize; SIDE]; 4],
    shares: [[f32; SIDE]; 4],
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

    /// Sixteen points with these normals and directions to the viewer; tangents are `along` projected.
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

/// Receives coefficients rotated to world axes.
pub(super) trait Sink {
    /// Takes the coefficients of channel `c` of the points from `lane` on, one point per lane.
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
