//! The loops over a batch for techniques that look tables up: point by point, or side by side so that
//! compilers make vectors of what lies between lookups.

use crate::{Points, Radiance};

/// A point to be shaded.
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
    /// Index of the point in the batch.
    pub index: usize,
}

/// Writes `f` of every point that faces the viewer, and 0 for all other points.
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

/// Points of a [`Block`].
pub const WIDTH: usize = 16;

/// One number of each point of a block.
pub type Lanes = [f32; WIDTH];

/// One number of each point, by a function of its place in the block.
#[inline(always)]
pub fn lanes(f: impl Fn(usize) -> f32) -> Lanes {
    std::array::from_fn(f)
}

/// Points side by side. Those that do not face the viewer are shaded as if seen from above, and their results
/// dropped.
pub struct Block {
    /// Normals.
    pub n: [Lanes; 3],
    /// Mirror directions of wo.
    pub r: [Lanes; 3],
    /// n·wo in (0, 1].
    pub cos_o: Lanes,
    /// Places in the batch; behind its end the last point's.
    pub index: [usize; WIDTH],
}

/// Shades a block of points. Mark the function and all that it calls `#[inline(always)]`, so that it is
/// compiled for the dispatched instruction set (a closure of this size would not be).
pub trait BlockShader {
    /// Radiance of each point, 0.
    fn shade(&self, p: &Block) -> [[f32; 4]; WIDTH];
}

/// Writes the radiance of every point that faces the viewer, and 0 for all other points.
#[inline]
pub fn shade_blocks(q: &Points<'_>, out: &mut Radiance<'_>, shader: &impl BlockShader) {
    struct Blocks<'a, 'b, 'c, S>(&'a Points<'a>, &'a mut Radiance<'b>, &'c S);
    impl<S: BlockShader> steradian_simd::Kernel for Blocks<'_, '_, '_, S> {
        type Output = ();
        #[inline(always)]
        fn run<A: steradian_simd::Arch>(self) {
            run_blocks(self.0, self.1, self.2);
        }
    }
    steradian_simd::run(Blocks(q, out, shader));
}

#[inline(always)]
fn run_blocks(q: &Points<'_>, out: &mut Radiance<'_>, shader: &impl BlockShader) {
    let len = out.len();
    for first in (0..len).step_by(WIDTH) {
        let index: [usize; WIDTH] = std::array::from_fn(|k| (first + k).min(len - 1));
        let [nx, ny, nz] = q.n.map(|s| lanes(|k| s[index[k]]));
        let [vx, vy, vz] = q.wo.map(|s| lanes(|k| s[index[k]]));
        let d = lanes(|k| nx[k] * vx[k] + ny[k] * vy[k] + nz[k] * vz[k]);
        // False for NaN too.
        let faces: [bool; WIDTH] = std::array::from_fn(|k| d[k] > 0.0);
        if !faces.contains(&true) {
            out.rgb.iter_mut().for_each(|c| c[first..len.min(first + WIDTH)].fill(0.0));
            continue;
        }
        let mirrored = |n: Lanes, v: Lanes, above: f32| {
            lanes(|k| if faces[k] { 2.0 * d[k] * n[k] - v[k] } else { above })
        };
        let normal = |n: Lanes, above: f32| lanes(|k| if faces[k] { n[k] } else { above });
        let block = Block {
            r: [mirrored(nx, vx, 0.0), mirrored(ny, vy, 0.0), mirrored(nz, vz, 1.0)],
            n: [normal(nx, 0.0), normal(ny, 0.0), normal(nz, 1.0)],
            cos_o: lanes(|k| if faces[k] { d[k].min(1.0) } else { 1.0 }),
            index,
        };
        let l = shader.shade(&block);
        for (c, channel) in out.rgb.iter_mut().enumerate() {
            let part = &mut channel[first..len.min(first + WIDTH)];
            part.iter_mut().enumerate().for_each(|(k, x)| *x = if faces[k] { l[k][c] } else { 0.0 });
        }
    }
}
