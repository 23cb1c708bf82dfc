//! Radiance of points among sites, each of which has a function of the direction as a few vectors of coefficients: the sum
//! over the corners of a point's triangle, over the vectors, and over the coefficients times harmonics at the mirror
//! direction of the viewer.

use crate::shared::geometry::matrices::padded;
use crate::shared::maths::harmonics::{Harmonics, LANES, MAX_TERMS};
use crate::{Points, Radiance};
use steradian_simd::{Arch, Kernel, Vector};

/// Vectors of a site that have weights, at most.
pub const MOST: usize = 16;

/// Weights of a site's vectors but the first, whose weight is 1.
pub type Weights = [f32; MOST];

/// The vectors of sites.
pub trait Vectors {
    /// Vectors of a site: each of three channels of [`padded`] coefficients. Writes their weights, from that of the second
    /// on. `None` beyond the end.
    fn at(&self, site: u32, weights: &mut Weights) -> Option<&[f32]>;
}

/// Radiance of points: Σ over corners, vectors and coefficients of weight · coefficient · y(r). Points that face away, or
/// have no sites, get 0.
pub fn at_mirror(h: &Harmonics, vectors: &impl Vectors, q: &Points<'_>, out: &mut Radiance<'_>) {
    steradian_simd::run(AtMirror { h, vectors, q, out });
}

struct AtMirror<'a, 'q, 'o, V> {
    h: &'a Harmonics,
    vectors: &'a V,
    q: &'a Points<'q>,
    out: &'a mut Radiance<'o>,
}

impl<V: Vectors> Kernel for AtMirror<'_, '_, '_, V> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let Self { h, vectors, q, out } = self;
        let len = out.len();
        out.rgb.iter_mut().for_each(|c| c.fill(0.0));
        let there =
            q.site.index.iter().all(|s| s.len() == len) && q.site.weight.iter().all(|s| s.len() == len);
        if !there {
            return;
        }
        let mut y = [[0.0f32; LANES]; MAX_TERMS];
        let mut first = 0;
        while first < len {
            let count = (len - first).min(LANES);
            let facing = mirrored::<A>(h, q, first, count, &mut y);
            // Four points of three channels fill what is summed over lanes at once.
            let mut four = Four::<A>::new();
            for (lane, _) in facing.iter().enumerate().take(count).filter(|f| *f.1) {
                let sums = point::<A>(h.len(), vectors, q, first + lane, lane, &y);
                four.push(first + lane, sums, out);
            }
            four.flush(out);
            first += LANES;
        }
    }
}

/// Harmonics at the mirror directions of some points, and which of them face the viewer.
#[inline(always)]
fn mirrored<A: Arch>(
    h: &Harmonics,
    q: &Points<'_>,
    first: usize,
    count: usize,
    y: &mut [[f32; LANES]; MAX_TERMS],
) -> [bool; LANES] {
    let (mut facing, mut r) = ([false; LANES], [[0.0f32; LANES]; 3]);
    for lane in 0..count {
        let i = first + lane;
        let [n, v] = [q.n, q.wo].map(|p| [p[0][i], p[1][i], p[2][i]]);
        let d = n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
        // False for NaN too.
        facing[lane] = d > 0.0;
        (0..3).for_each(|k| r[k][lane] = 2.0 * d * n[k] - v[k]);
    }
    let mut lane = 0;
    while lane < LANES {
        h.eval_lanes([0, 1, 2].map(|k| A::F32::load(&r[k][lane..])), lane, y);
        lane += A::F32::LANES;
    }
    facing
}

/// Sums of a point by channel, still in lanes.
#[inline(always)]
fn point<A: Arch>(
    n: usize,
    vectors: &impl Vectors,
    q: &Points<'_>,
    i: usize,
    lane: usize,
    y: &[[f32; LANES]; MAX_TERMS],
) -> [A::F32; 3] {
    let stride = padded(n);
    let mut own = [0.0f32; MAX_TERMS];
    (0..n).for_each(|k| own[k] = y[k][lane]);
    let mut sums = [A::F32::splat(0.0); 3];
    let [u, v] = q.site.weight.map(|w| w[i]);
    let mut weights = [0.0; MOST];
    for (s, w) in q.site.index.iter().zip([1.0 - u - v, u, v]) {
        if w == 0.0 {
            continue;
        }
        let Some(all) = vectors.at(s[i], &mut weights) else { continue };
        let w = A::F32::splat(w);
        let (head, rest) = all.split_at(3 * stride);
        let mut k = 0;
        while k < stride {
            let y = A::F32::load(&own[k..]).mul(w);
            for c in 0..3 {
                let at = c * stride + k;
                let mut l = A::F32::load(&head[at..]);
                for (row, weight) in rest.chunks_exact(3 * stride).zip(&weights) {
                    l = A::F32::load(&row[at..]).fma(A::F32::splat(*weight), l);
                }
                sums[c] = l.fma(y, sums[c]);
            }
            k += A::F32::LANES;
        }
    }
    sums
}

/// Sums of up to four points that wait to be summed over lanes.
struct Four<A: Arch> {
    sums: [A::F32; 12],
    points: [usize; 4],
    count: usize,
}

impl<A: Arch> Four<A> {
    #[inline(always)]
    fn new() -> Self {
        Self { sums: [A::F32::splat(0.0); 12], points: [0; 4], count: 0 }
    }

    #[inline(always)]
    fn push(&mut self, point: usize, sums: [A::F32; 3], out: &mut Radiance<'_>) {
        self.points[self.count] = point;
        (0..3).for_each(|c| self.sums[3 * self.count + c] = sums[c]);
        self.count += 1;
        if self.count == 4 {
            self.flush(out);
        }
    }

    #[inline(always)]
    fn flush(&mut self, out: &mut Radiance<'_>) {
        let mut sums = [0.0; 16];
        A::F32::add_sums(&self.sums, &mut sums);
        for (k, point) in self.points.iter().enumerate().take(self.count) {
            (0..3).for_each(|c| out.rgb[c][*point] = sums[3 * k + c] as f32);
        }
        self.count = 0;
    }
}
