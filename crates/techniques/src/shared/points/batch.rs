//! The loop over a batch for techniques that look tables up point by point.

use crate::{Points, Radiance};

/// What a point's shading starts from.
#[derive(Clone, Copy)]
pub struct Point {
    /// Normal.
    pub n: [f32; 3],
    /// Direction to the viewer.
    pub wo: [f32; 3],
    /// Mirror direction of wo, r = 2(n·wo)n − wo.
    pub r: [f32; 3],
    /// n·wo in (0, 1].
    pub cos_o: f32,
    /// Its place in the batch.
    pub index: usize,
}

/// Writes `f` of every point that faces the viewer, and 0 for the others.
#[inline]
pub fn shade(q: &Points<'_>, out: &mut Radiance<'_>, f: impl Fn(Point) -> [f32; 3]) {
    steradian_simd::dispatch(|| run(q, out, f));
}

#[inline(always)]
fn run(q: &Points<'_>, out: &mut Radiance<'_>, f: impl Fn(Point) -> [f32; 3]) {
    let len = out.len();
    let [red, green, blue] = &mut out.rgb;
    let (red, green, blue) = (&mut red[..len], &mut green[..len], &mut blue[..len]);
    let [nx, ny, nz] = q.n.map(|s| &s[..len]);
    let [vx, vy, vz] = q.wo.map(|s| &s[..len]);
    for i in 0..len {
        let (n, v) = ([nx[i], ny[i], nz[i]], [vx[i], vy[i], vz[i]]);
        let d = n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
        // False for NaN too.
        let l = if d > 0.0 {
            let r = std::array::from_fn(|k| 2.0 * d * n[k] - v[k]);
            f(Point { n, wo: v, r, cos_o: d.min(1.0), index: i })
        } else {
            [0.0; 3]
        };
        [red[i], green[i], blue[i]] = l;
    }
}
