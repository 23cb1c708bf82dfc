//! Shading by a table where each site has light of its own in world axes: sixteen points at a time, with the
//! reflectance rotated to world axes.

use super::ViewTable;
use super::kernel::{Block, Sink, turned};
use super::vectors::SIDE;
use crate::shared::geometry::matrices::{MAX_COEFFICIENTS, padded};
use crate::shared::geometry::site_sum::{MOST as MOST_VECTORS, Vectors};
use crate::{Points, Radiance};
use steradian_simd::{Arch, Kernel, Vector};
use steradian_sphere::sh::Exchange;

/// Radiance of points, Σ_i c_i(wo) L'_i with L' interpolated between the sites around a point, whose vectors
/// have the table's coefficients in the order l² + l + m (times the table's tint). Points that face away, or
/// have no sites, get 0.
pub fn shade_sites(table: &ViewTable, vectors: &impl Vectors, q: &Points<'_>, out: &mut Radiance<'_>) {
    let len = out.len();
    let there = q.site.index.iter().all(|s| s.len() == len) && q.site.weight.iter().all(|s| s.len() == len);
    if !there || table.bands * table.bands > MAX_COEFFICIENTS {
        return out.rgb.iter_mut().for_each(|c| c.fill(0.0));
    }
    let exchange = Exchange::new(if table.bands <= 6 { 0 } else { table.bands });
    steradian_simd::run(AtSites { table, exchange: &exchange, vectors, q, out });
}

struct AtSites<'a, 'q, 'o, V> {
    table: &'a ViewTable,
    exchange: &'a Exchange,
    vectors: &'a V,
    q: &'a Points<'q>,
    out: &'a mut Radiance<'o>,
}

/// Light of sixteen points by channel and coefficient, a point a lane.
type Lanes = [[[f32; SIDE]; MAX_COEFFICIENTS]; 3];

impl<V: Vectors> Kernel for AtSites<'_, '_, '_, V> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let Self { table, exchange, vectors, q, out } = self;
        let (len, stride) = (out.len(), padded(table.bands * table.bands));
        let mut rows = [[0.0f32; 3 * MAX_COEFFICIENTS]; SIDE];
        let mut light: Lanes = [[[0.0; SIDE]; MAX_COEFFICIENTS]; 3];
        let mut first = 0;
        while first < len {
            let count = (len - first).min(SIDE);
            let b = Block::at::<A>(table, q, first);
            for i in 0..count {
                if b.facing()[i] {
                    gathered::<A>(vectors, q, first + i, &mut rows[i][..3 * stride]);
                }
            }
            transposed::<A>(&rows, stride, &mut light);
            let mut sums = [[0.0; SIDE]; 3];
            turned::<A>(table, exchange, &b, &mut Times { table, light: &light, sums: &mut sums });
            for k in 0..3 {
                for i in 0..count {
                    out.rgb[k][first + i] = if b.facing()[i] { sums[k][i] } else { 0.0 };
                }
            }
            first += SIDE;
        }
    }
}

/// The light of one point: its sites' vectors, weighed.
#[inline(always)]
fn gathered<A: Arch>(vectors: &impl Vectors, q: &Points<'_>, i: usize, to: &mut [f32]) {
    to.fill(0.0);
    let (u, v) = (q.site.weight[0][i], q.site.weight[1][i]);
    let corners = [1.0 - u - v, u, v];
    let mut weights = [0.0; 2 * MOST_VECTORS];
    for k in 0..3 {
        if corners[k] == 0.0 {
            continue;
        }
        let Some(all) = vectors.at::<A>(q.site.index[k][i], &mut weights) else { continue };
        let corner = A::F32::splat(corners[k]);
        let (head, rest) = all.split_at(to.len());
        let mut at = 0;
        while at < to.len() {
            let mut l = A::F32::load(&head[at..]);
            for j in 0..rest.len() / to.len() {
                let row = &rest[j * to.len() + at..];
                l = A::F32::load(row).fma(A::F32::splat(weights[j + 1]), l);
            }
            l.fma(corner, A::F32::load(&to[at..])).store(&mut to[at..]);
            at += A::F32::LANES;
        }
    }
}

/// Transposes rows of three channels, one for each point, to lanes of points.
#[inline(always)]
fn transposed<A: Arch>(rows: &[[f32; 3 * MAX_COEFFICIENTS]; SIDE], stride: usize, to: &mut Lanes) {
    let lanes = A::F32::LANES;
    let mut square = [A::F32::splat(0.0); SIDE];
    for c in 0..3 {
        let mut from = 0;
        while from < stride {
            let mut lane = 0;
            while lane < SIDE {
                for k in 0..lanes {
                    square[k] = A::F32::load(&rows[lane + k][c * stride + from..]);
                }
                A::F32::transpose(&mut square[..lanes]);
                for k in 0..lanes {
                    square[k].store(&mut to[c][from + k][lane..]);
                }
                lane += lanes;
            }
            from += lanes;
        }
    }
}

/// Σ_i c_i L'_i of each channel, or of all three where they share one.
struct Times<'a> {
    table: &'a ViewTable,
    light: &'a Lanes,
    sums: &'a mut [[f32; SIDE]; 3],
}

impl Sink for Times<'_> {
    #[inline(always)]
    fn take<V: Vector<T = f32>>(&mut self, c: usize, lane: usize, f: &[V]) {
        for k in 0..3 {
            if self.table.channels == 3 && k != c {
                continue;
            }
            let mut sum = V::splat(0.0);
            for i in 0..f.len() {
                sum = f[i].fma(V::load(&self.light[k][i][lane..]), sum);
            }
            sum.store(&mut self.sums[k][lane..]);
        }
    }
}
