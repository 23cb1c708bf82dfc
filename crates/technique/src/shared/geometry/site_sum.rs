//! Radiance of points between sites, each of which has a function of direction as a few vectors of spherical
//! harmonic coefficients: the sum over the corners of a point's triangle, over the vectors, and over the
//! coefficients times the harmonics at the mirror direction of the viewer.

use crate::shared::geometry::by_group::{SORTED, Share, Sorted};
use crate::shared::geometry::matrices::{MAX_COEFFICIENTS, padded};
use crate::shared::maths::harmonics::{Harmonics, LANES, MAX_TERMS};
use crate::{Points, Radiance};
use steradian_simd::{Arch, Kernel, Vector};

/// Most vectors of a site in addition to the first.
pub const MOST: usize = 16;

/// Weights of a site's vectors, filled up to whole registers. The weight of the first vector is 1, whatever
/// its entry holds.
pub type Weights = [f32; 2 * MOST];

/// The vectors of sites.
pub trait Vectors {
    /// Vectors of a site: each of three channels of [`padded`] coefficients. Writes their weights, from that
    /// of the second on. `None` beyond the end.
    fn at<A: Arch>(&self, site: u32, weights: &mut Weights) -> Option<&[f32]>;

    /// Number of groups of sites that share their vectors, [`MOST_GROUPS`](super::by_group::MOST_GROUPS) at
    /// most; 0 where each site has its own.
    fn groups(&self) -> usize {
        0
    }

    /// The group of a site, where there are groups. `None` beyond the end.
    fn group(&self, _: u32) -> Option<usize> {
        None
    }
}

/// Least number of corners of one group that are summed together in lanes; fewer are summed one by one.
const FEW: usize = 3;

/// Radiance of points: Σ over corners, vectors and coefficients of weight · coefficient · y(r). Points that
/// face away, or have no sites, get 0.
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
        let len = self.out.len();
        self.out.rgb.iter_mut().for_each(|c| c.fill(0.0));
        let (index, weight) = (&self.q.site.index, &self.q.site.weight);
        if !index.iter().all(|s| s.len() == len) || !weight.iter().all(|s| s.len() == len) {
            return;
        }
        match (self.vectors.groups() > 0, padded(self.h.len()), self.h.len()) {
            (false, 16, _) => self.sums::<A, 16>(),
            (false, 32, _) => self.sums::<A, 32>(),
            (false, 48, _) => self.sums::<A, 48>(),
            (false, ..) => self.sums::<A, 64>(),
            (true, 16, 9) => self.grouped::<A, 16, 9>(),
            (true, 16, _) => self.grouped::<A, 16, 16>(),
            (true, 32, _) => self.grouped::<A, 32, 25>(),
            (true, 48, _) => self.grouped::<A, 48, 36>(),
            (true, ..) => self.grouped::<A, 64, 64>(),
        }
    }
}

impl<V: Vectors> AtMirror<'_, '_, '_, V> {
    /// The sums for vectors of P coefficients a channel.
    #[inline(always)]
    fn sums<A: Arch, const P: usize>(self) {
        let Self { h, vectors, q, out } = self;
        let len = out.len();
        if h.len() > P {
            return;
        }
        let mut y = [[0.0f32; LANES]; MAX_TERMS];
        let mut own = [[0.0f32; P]; LANES];
        for first in (0..len).step_by(LANES) {
            let count = (len - first).min(LANES);
            let facing = mirrored::<A>(h, q, first, count, &mut y);
            if !facing.contains(&true) {
                continue;
            }
            by_point::<A, P>(&y, &mut own);
            let mut parts = [[A::F32::splat(0.0); LANES]; 3];
            for i in 0..count {
                if facing[i] {
                    let sums = point::<A, P>(vectors, q, first + i, &own[i]);
                    for c in 0..3 {
                        parts[c][i] = sums[c];
                    }
                }
            }
            for c in 0..3 {
                let mut sums = [0.0f32; LANES];
                for lane in (0..LANES).step_by(A::F32::LANES) {
                    A::F32::lane_sums(&mut parts[c][lane..]).store(&mut sums[lane..]);
                }
                out.rgb[c][first..first + count].copy_from_slice(&sums[..count]);
            }
        }
    }
}

impl<V: Vectors> AtMirror<'_, '_, '_, V> {
    /// The sums for vectors of P coefficients a channel, N of them not zero, where sites share vectors. The
    /// vectors of a group are some kilobytes: in the order of points, each corner fetched them from the
    /// second level of the cache or further. So corners are sorted by their groups, and each coefficient
    /// loaded serves as many of them as a register has lanes.
    #[inline(always)]
    fn grouped<A: Arch, const P: usize, const N: usize>(self) {
        let Self { h, vectors, q, out } = self;
        if h.len() > N {
            return;
        }
        let mut sorted = Sorted::empty();
        let mut y = [[0.0f32; LANES]; MAX_TERMS];
        let (mut rows, mut weights) = ([[0.0f32; LANES]; LANES], [[0.0f32; LANES]; MOST + 1]);
        for first in (0..out.len()).step_by(SORTED) {
            let q = Share::of(q, first, (out.len() - first).min(SORTED));
            let groups = sorted.sort(vectors.groups(), |site| vectors.group(site), &q);
            let mut from = 0;
            for group in 0..groups {
                let end = usize::from(sorted.ends[group]);
                while from < end {
                    let some = &sorted.order[from..end.min(from + LANES)];
                    from += some.len();
                    if some.len() <= FEW {
                        for corner in some {
                            one::<A, P>(h, vectors, &q, first, usize::from(*corner), out);
                        }
                    } else {
                        let mut r = [[0.0f32; LANES]; 3];
                        let mut all: &[f32] = &[];
                        let mut corners = [0.0; LANES];
                        for (lane, corner) in some.iter().enumerate() {
                            let (i, corner) = (usize::from(corner / 3), usize::from(corner % 3));
                            let (_, mirror) = q.mirror(i);
                            for k in 0..3 {
                                r[k][lane] = mirror[k];
                            }
                            let mut own = [0.0; 2 * MOST];
                            if let Some(found) = vectors.at::<A>(q.index[corner][i], &mut own) {
                                all = found;
                            }
                            corners[lane] = q.weight(i, corner);
                            let w = A::F32::splat(corners[lane]);
                            for k in (0..MOST).step_by(A::F32::LANES) {
                                A::F32::load(&own[k..]).mul(w).store(&mut rows[lane][k..]);
                            }
                            weights[MOST][lane] = corners[lane] * own[MOST];
                        }
                        // Lanes without a corner repeat an earlier one; their results are not read.
                        turned::<A>(&rows, &mut weights[..MOST]);
                        weights[0] = corners;
                        for lane in (0..LANES).step_by(A::F32::LANES) {
                            let r = [
                                A::F32::load(&r[0][lane..]),
                                A::F32::load(&r[1][lane..]),
                                A::F32::load(&r[2][lane..]),
                            ];
                            h.eval_lanes(r, lane, &mut y);
                        }
                        let sums = side_by_side::<A, P, N>(all, &weights, &y);
                        for (lane, corner) in some.iter().enumerate() {
                            let i = first + usize::from(corner / 3);
                            for c in 0..3 {
                                out.rgb[c][i] += sums[c][lane];
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Adds one corner of a point.
#[inline(always)]
fn one<A: Arch, const P: usize>(
    h: &Harmonics,
    vectors: &impl Vectors,
    q: &Share<'_>,
    first: usize,
    corner: usize,
    out: &mut Radiance<'_>,
) {
    let (i, corner) = (corner / 3, corner % 3);
    let (mut all, mut own) = ([0.0; MAX_TERMS], [0.0; P]);
    h.eval(q.mirror(i).1, &mut all);
    own.copy_from_slice(&all[..P]);
    let mut sums = [A::F32::splat(0.0); 3];
    add::<A, P>(vectors, q.index[corner][i], q.weight(i, corner), &own, &mut sums);
    for c in 0..3 {
        let mut parts = [A::F32::splat(0.0); LANES];
        parts[0] = sums[c];
        let mut lanes = [0.0f32; LANES];
        A::F32::lane_sums(&mut parts).store(&mut lanes);
        out.rgb[c][first + i] += lanes[0];
    }
}

/// Rows as columns.
#[inline(always)]
fn turned<A: Arch>(rows: &[[f32; LANES]; LANES], to: &mut [[f32; LANES]]) {
    let lanes = A::F32::LANES;
    let mut square = [A::F32::splat(0.0); LANES];
    for first in (0..LANES).step_by(lanes) {
        for lane in (0..LANES).step_by(lanes) {
            for k in 0..lanes {
                square[k] = A::F32::load(&rows[lane + k][first..]);
            }
            A::F32::transpose(&mut square[..lanes]);
            for k in 0..lanes {
                square[k].store(&mut to[first + k][lane..]);
            }
        }
    }
}

/// Sums, by channel, of as many corners as there are lanes, all of one group. (There are no closures here or
/// in the loops around it: some were compiled as functions of their own, for the narrowest instruction set.)
#[inline(always)]
fn side_by_side<A: Arch, const P: usize, const N: usize>(
    all: &[f32],
    weights: &[[f32; LANES]; MOST + 1],
    y: &[[f32; LANES]; MAX_TERMS],
) -> [[f32; LANES]; 3] {
    let mut out = [[0.0f32; LANES]; 3];
    for lane in (0..LANES).step_by(A::F32::LANES) {
        let mut own = [A::F32::splat(0.0); N];
        for i in 0..N {
            own[i] = A::F32::load(&y[i][lane..]);
        }
        let mut sums = [A::F32::splat(0.0); 3];
        for (vector, weight) in all.chunks_exact(3 * P).zip(weights) {
            // Even and odd coefficients: three sums alone would wait for each other's last products.
            let (mut even, mut odd) = ([A::F32::splat(0.0); 3], [A::F32::splat(0.0); 3]);
            let (vector, mut i) = (&vector[..3 * P], 0);
            while i + 1 < N {
                for c in 0..3 {
                    even[c] = own[i].fma(A::F32::splat(vector[c * P + i]), even[c]);
                    odd[c] = own[i + 1].fma(A::F32::splat(vector[c * P + i + 1]), odd[c]);
                }
                i += 2;
            }
            let weight = A::F32::load(&weight[lane..]);
            for c in 0..3 {
                if i < N {
                    even[c] = own[i].fma(A::F32::splat(vector[c * P + i]), even[c]);
                }
                sums[c] = even[c].add(odd[c]).fma(weight, sums[c]);
            }
        }
        for c in 0..3 {
            sums[c].store(&mut out[c][lane..]);
        }
    }
    out
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
    let [n, wo] = [q.n, q.wo].map(|v| v.map(|v| &v[first..first + count]));
    for lane in 0..count {
        let [n, v] = [n, wo].map(|p| [p[0][lane], p[1][lane], p[2][lane]]);
        let d = n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
        // False for NaN too.
        facing[lane] = d > 0.0;
        for k in 0..3 {
            r[k][lane] = 2.0 * d * n[k] - v[k];
        }
    }
    for lane in (0..LANES).step_by(A::F32::LANES) {
        let (a, b, c) =
            (A::F32::load(&r[0][lane..]), A::F32::load(&r[1][lane..]), A::F32::load(&r[2][lane..]));
        h.eval_lanes([a, b, c], lane, y);
    }
    facing
}

/// Transposes terms, each of which lies for all points, to rows of all terms of a point.
#[inline(always)]
fn by_point<A: Arch, const P: usize>(y: &[[f32; LANES]; MAX_TERMS], to: &mut [[f32; P]; LANES]) {
    let lanes = A::F32::LANES;
    let mut square = [A::F32::splat(0.0); LANES];
    for first in (0..P).step_by(lanes) {
        for lane in (0..LANES).step_by(lanes) {
            for k in 0..lanes {
                square[k] = A::F32::load(&y[first + k][lane..]);
            }
            A::F32::transpose(&mut square[..lanes]);
            for k in 0..lanes {
                square[k].store(&mut to[lane + k][first..]);
            }
        }
    }
}

/// Sums of a point by channel, still in lanes.
#[inline(always)]
fn point<A: Arch, const P: usize>(
    vectors: &impl Vectors,
    q: &Points<'_>,
    i: usize,
    y: &[f32; P],
) -> [A::F32; 3] {
    let mut sums = [A::F32::splat(0.0); 3];
    let (u, v) = (q.site.weight[0][i], q.site.weight[1][i]);
    for (corner, w) in [1.0 - u - v, u, v].into_iter().enumerate() {
        if w != 0.0 {
            add::<A, P>(vectors, q.site.index[corner][i], w, y, &mut sums);
        }
    }
    sums
}

/// Adds one corner to the sums of a point.
#[inline(always)]
fn add<A: Arch, const P: usize>(
    vectors: &impl Vectors,
    site: u32,
    w: f32,
    y: &[f32; P],
    sums: &mut [A::F32; 3],
) {
    let mut weights = [0.0; 2 * MOST];
    let Some(all) = vectors.at::<A>(site, &mut weights) else { return };
    let w = A::F32::splat(w);
    let Some((head, rest)) = all.split_at_checked(3 * P) else { return };
    if rest.is_empty() {
        for k in (0..P).step_by(A::F32::LANES) {
            let y = A::F32::load(&y[k..]).mul(w);
            for c in 0..3 {
                sums[c] = A::F32::load(&head[c * P + k..]).fma(y, sums[c]);
            }
        }
        return;
    }
    for c in 0..3 {
        let mut l = [A::F32::splat(0.0); MAX_COEFFICIENTS / 4];
        let registers = P / A::F32::LANES;
        for k in 0..registers {
            l[k] = A::F32::load(&head[c * P + k * A::F32::LANES..]);
        }
        for (row, weight) in rest.chunks_exact(3 * P).zip(&weights[1..]) {
            let (row, weight) = (&row[c * P..(c + 1) * P], A::F32::splat(*weight));
            for k in 0..registers {
                l[k] = A::F32::load(&row[k * A::F32::LANES..]).fma(weight, l[k]);
            }
        }
        for k in 0..registers {
            let y = A::F32::load(&y[k * A::F32::LANES..]).mul(w);
            sums[c] = l[k].fma(y, sums[c]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PointsBuf;
    use glam::{Vec2, Vec3};
    use steradian_testkit::on_every_isa;

    /// Sites in groups that share their vectors. `used` says whether the sum is told of the groups.
    struct Shared {
        data: Vec<f32>,
        each: usize,
        groups: usize,
        used: bool,
    }

    impl Shared {
        /// Squares modulo the number of groups: some groups get many sites, and some get few or none.
        fn of(&self, site: u32) -> usize {
            (site as usize * site as usize) % self.groups
        }
    }

    impl Vectors for Shared {
        fn at<A: Arch>(&self, site: u32, weights: &mut Weights) -> Option<&[f32]> {
            weights.iter_mut().enumerate().for_each(|(k, w)| *w = ((site as usize + 3 * k) as f32).sin());
            self.data.chunks_exact(self.each).nth(self.of(site))
        }

        fn groups(&self) -> usize {
            if self.used { self.groups } else { 0 }
        }

        fn group(&self, site: u32) -> Option<usize> {
            Some(self.of(site))
        }
    }

    /// Whether corners are summed in the order of their groups or not, their sums are those in f64.
    #[test]
    fn groups_change_nothing() {
        let mut q = PointsBuf::with_capacity(5000);
        for k in 0..5000u32 {
            let n = Vec3::new((k as f32).sin(), (k as f32 * 0.7).cos(), 0.4).normalize();
            let wo = (n + Vec3::new(0.9 * (k as f32 * 1.3).sin(), 0.5, -0.8)).normalize();
            q.push(n, n.any_orthonormal_vector(), wo, n);
            let weight = if k % 3 == 0 { [0.0; 2] } else { [0.2, 0.5] };
            q.locate(Vec2::ZERO, [k, k / 2, 7 * k + 1], weight);
        }
        for (bands, components) in [(1, 0), (2, 1), (3, 4), (4, 16), (5, 8), (6, 3), (7, 2), (8, 8)] {
            let (h, stride) = (Harmonics::new(bands - 1, bands - 1), padded(bands * bands));
            let each = (components + 1) * 3 * stride;
            let number = |i: usize| {
                let inside = i % stride < bands * bands;
                if inside { (i as f32 * 0.37).sin() } else { 0.0 }
            };
            let mut shared =
                Shared { data: (0..40 * each).map(number).collect(), each, groups: 40, used: false };
            let want = |shared: &Shared, i: usize| -> [f64; 3] {
                let points = q.as_points();
                let (n, v) = (points.n.map(|n| n[i]), points.wo.map(|v| v[i]));
                let d = n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
                let mut y = [0.0; MAX_TERMS];
                h.eval([0, 1, 2].map(|k| 2.0 * d * n[k] - v[k]), &mut y);
                let mut out = [0.0; 3];
                let [a, b] = points.site.weight.map(|w| w[i]);
                for (corner, w) in [1.0 - a - b, a, b].into_iter().enumerate().filter(|_| d > 0.0) {
                    let site = points.site.index[corner][i];
                    for j in 0..=components {
                        let own = if j == 0 { 1.0 } else { ((site as usize + 3 * j) as f32).sin() };
                        let vector = &shared.data[shared.of(site) * each + j * 3 * stride..];
                        for c in 0..3 {
                            let sum =
                                (0..h.len()).map(|k| f64::from(vector[c * stride + k]) * f64::from(y[k]));
                            out[c] += f64::from(w) * f64::from(own) * sum.sum::<f64>();
                        }
                    }
                }
                out
            };
            for used in [false, true] {
                shared.used = used;
                on_every_isa(|| {
                    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
                    at_mirror(&h, &shared, &q.as_points(), &mut Radiance::of(&mut rgb));
                    for i in (0..q.len()).step_by(7) {
                        let want = want(&shared, i);
                        for c in 0..3 {
                            let off = (f64::from(rgb[c][i]) - want[c]).abs();
                            assert!(off < 2e-4, "{bands} {components} {used} {i}: {} {}", rgb[c][i], want[c]);
                        }
                    }
                });
            }
        }
    }
}
