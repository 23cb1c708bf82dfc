//! Resampling within each face by a scale and a shift per axis, borders repeated.
//!
//! With [`Kernel::Limited`]: Catmull–Rom where the 4 × 4 texels around differ by less than a factor of two,
//! bilinear where they differ by more than four (beside lights, and where anything is zero or negative), a
//! blend between: negative weights never make negative light of light that is not. A bright texel keeps its
//! energy to the change of pitch: its bilinear weights over a step of s texels sum to 1/s within 1 − s, the
//! step of n texels on n − 1 intervals being 1 − 1/n; so the energy of a single texel is kept to about 2/n,
//! that of wider lights better.

use steradian_parallel::prelude::*;
use steradian_sphere::SphereImage;

/// x_file = shift + scale·(x − n/2), in texel coordinates (centres at half-integers).
#[derive(Debug, Clone, Copy)]
pub struct Affine {
    /// File texels per texel.
    pub scale: f64,
    /// Where the middle of the face lies in the file.
    pub shift: f64,
}

/// How values between texels are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// Catmull–Rom, which undershoots beside lights.
    Cubic,
    /// Nowhere negative where the texels are not.
    Limited,
}

/// Four texels along one axis.
struct Taps {
    index: [usize; 4],
    /// Catmull–Rom.
    cubic: [f64; 4],
    /// Weight of the third; the second has the rest.
    t: f64,
}

impl Affine {
    fn taps(self, n: usize) -> Vec<Taps> {
        (0..n)
            .map(|i| {
                let x = self.shift + self.scale * (i as f64 + 0.5 - 0.5 * n as f64) - 0.5;
                let first = x.floor();
                let t = x - first;
                let (t2, t3) = (t * t, t * t * t);
                let cubic = [
                    0.5 * (2.0 * t2 - t3 - t),
                    0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
                    0.5 * (4.0 * t2 - 3.0 * t3 + t),
                    0.5 * (t3 - t2),
                ];
                let index = |k: usize| (first as isize - 1 + k as isize).clamp(0, n as isize - 1) as usize;
                Taps { index: std::array::from_fn(index), cubic, t }
            })
            .collect()
    }
}

/// The value between 4 × 4 texels of a face of width `w`.
fn between(kernel: Kernel, source: &[f32], w: usize, x: &Taps, y: &Taps) -> f32 {
    let v = y.index.map(|j| x.index.map(|i| source[j * w + i]));
    let (low, high) =
        v.iter().flatten().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
    let mix = |a: f32, b: f32, t: f64| f64::from(a) + (f64::from(b) - f64::from(a)) * t;
    let (upper, lower) = (mix(v[1][1], v[1][2], x.t), mix(v[2][1], v[2][2], x.t));
    let linear = upper + (lower - upper) * y.t;
    // 1 up to a ratio of two, 0 from four on; the cubic's negative weights sum to 0.28 at most.
    let smooth = match kernel {
        Kernel::Cubic => 1.0,
        Kernel::Limited if low > 0.0 => (2.0 - 0.5 * f64::from(high / low)).clamp(0.0, 1.0),
        Kernel::Limited => 0.0,
    };
    if smooth == 0.0 {
        return linear as f32;
    }
    let line = |row: &[f32; 4]| -> f64 { row.iter().zip(x.cubic).map(|(&v, w)| w * f64::from(v)).sum() };
    let cubic: f64 = v.iter().zip(y.cubic).map(|(row, w)| w * line(row)).sum();
    (linear + (cubic - linear) * smooth) as f32
}

/// The image with each face resampled by `map(face)` = (columns, rows).
pub fn warp(image: &SphereImage, kernel: Kernel, map: impl Fn(usize) -> (Affine, Affine)) -> SphereImage {
    let (w, h) = (image.width, image.height);
    let mut out = SphereImage::new(image.layout, w, h);
    for face in 0..image.layout.faces() {
        let (columns, rows) = map(face);
        let (columns, rows) = (columns.taps(w), rows.taps(h));
        let at = face * w * h;
        for (source, target) in image.planes.iter().zip(&mut out.planes) {
            let source = &source[at..at + w * h];
            target[at..at + w * h].par_chunks_mut(w).zip(&rows).for_each(|(row, y)| {
                for (v, x) in row.iter_mut().zip(&columns) {
                    *v = between(kernel, source, w, x, y);
                }
            });
        }
    }
    out
}
