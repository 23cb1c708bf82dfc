//! Resampling within each face by a scale and a shift per axis: Catmull–Rom, borders repeated.

use rayon::prelude::*;
use steradian_sphere::SphereImage;

/// x_file = shift + scale·(x − n/2), in texel coordinates (centres at half-integers).
#[derive(Debug, Clone, Copy)]
pub struct Affine {
    /// File texels per texel.
    pub scale: f64,
    /// Where the middle of the face lies in the file.
    pub shift: f64,
}

/// Four taps along one axis.
type Taps = [(usize, f64); 4];

impl Affine {
    fn taps(self, n: usize) -> Vec<Taps> {
        (0..n)
            .map(|i| {
                let x = self.shift + self.scale * (i as f64 + 0.5 - 0.5 * n as f64) - 0.5;
                let first = x.floor();
                let t = x - first;
                let (t2, t3) = (t * t, t * t * t);
                let w = [
                    0.5 * (2.0 * t2 - t3 - t),
                    0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
                    0.5 * (4.0 * t2 - 3.0 * t3 + t),
                    0.5 * (t3 - t2),
                ];
                std::array::from_fn(|k| {
                    let index = (first as isize - 1 + k as isize).clamp(0, n as isize - 1);
                    (index as usize, w[k])
                })
            })
            .collect()
    }
}

/// The image with each face resampled by `map(face)` = (columns, rows).
pub fn warp(image: &SphereImage, map: impl Fn(usize) -> (Affine, Affine)) -> SphereImage {
    let (w, h) = (image.width, image.height);
    let mut out = SphereImage::new(image.layout, w, h);
    for face in 0..image.layout.faces() {
        let (columns, rows) = map(face);
        let (columns, rows) = (columns.taps(w), rows.taps(h));
        let at = face * w * h;
        for (source, target) in image.planes.iter().zip(&mut out.planes) {
            let source = &source[at..at + w * h];
            target[at..at + w * h].par_chunks_mut(w).zip(&rows).for_each(|(row, taps)| {
                for (v, across) in row.iter_mut().zip(&columns) {
                    let line = |j: usize| -> f64 {
                        across.iter().map(|&(i, wx)| wx * f64::from(source[j * w + i])).sum()
                    };
                    *v = taps.iter().map(|&(j, wy)| wy * line(j)).sum::<f64>() as f32;
                }
            });
        }
    }
    out
}
