//! Radiance of every cluster's matrices at every hat, once a frame.

use super::bake::Compressed;
use crate::View;
use crate::shared::light::sh_light::ShLight;
use steradian_parallel::prelude::*;
use steradian_simd::{Arch, Kernel, Vector, run};

/// Lanes of the widest register.
pub const WIDEST: usize = 16;
/// Coefficients at most (6 bands).
const MOST: usize = 36;

/// The light of a frame through the matrices of the clusters.
#[derive(Default)]
pub struct Frame {
    /// Cluster after cluster, hat after hat, channel after channel: of the mean and of each component, filled up by zeros to
    /// [`padded`] numbers.
    pub(super) radiance: Vec<f32>,
}

/// Numbers of a hat and channel where each site has `row`.
pub const fn padded(row: usize) -> usize {
    row.next_multiple_of(WIDEST)
}

impl Frame {
    pub(super) fn update(&mut self, light: &ShLight, t: &Compressed, v: &View) {
        let n = t.n;
        if n == 0 || n > MOST {
            self.radiance.clear();
            return;
        }
        let light = light.turned(n.isqrt(), v.light_rotation, [1.0; 3]);
        let (hats, row) = (t.rows.len() / (3 * n), t.components + 1);
        let wide = hats.next_multiple_of(WIDEST);
        let mut columns = vec![0.0; 3 * n * wide];
        for (k, r) in t.rows.chunks_exact(n).enumerate() {
            let (c, hat) = (k / hats, k % hats);
            r.iter().enumerate().for_each(|(i, x)| columns[(c * n + i) * wide + hat] = *x);
        }
        let each = hats * 3 * padded(row);
        self.radiance.resize(t.basis.len() / (row * n * n) * each, 0.0);
        let clusters = self.radiance.par_chunks_exact_mut(each);
        clusters.zip(t.basis.par_chunks_exact(row * n * n)).for_each(|(out, basis)| {
            run(Cluster { n, light: &light, columns: &columns, wide, basis, out });
        });
    }

    /// Hat after hat, of the mean and of each component red, green and blue.
    pub(super) fn by_hat(&self, row: usize) -> Vec<f32> {
        let hats = self.radiance.chunks_exact(3 * padded(row));
        hats.flat_map(|l| (0..row).flat_map(|k| [0, 1, 2].map(|c| l[c * padded(row) + k]))).collect()
    }
}

struct Cluster<'a> {
    n: usize,
    light: &'a [[f32; 3]],
    /// What hats reflect, by channel and coefficient, [`Cluster::wide`] hats each.
    columns: &'a [f32],
    wide: usize,
    basis: &'a [f32],
    out: &'a mut [f32],
}

impl Kernel for Cluster<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let (n, lanes) = (self.n, A::F32::LANES);
        let row = self.basis.len() / (n * n);
        let hats = self.out.len() / (3 * padded(row));
        for (k, matrix) in self.basis.chunks_exact(n * n).enumerate() {
            let mut through = [[0.0f32; 4]; MOST];
            for (to, m) in through[..n].iter_mut().zip(matrix.chunks_exact(n)) {
                for (m, l) in m.iter().zip(self.light) {
                    for c in 0..3 {
                        to[c] += m * l[c];
                    }
                }
            }
            for hat in (0..hats).step_by(lanes) {
                let mut sums = [A::F32::splat(0.0); 3];
                for (i, l) in through[..n].iter().enumerate() {
                    for c in 0..3 {
                        let r = A::F32::load(&self.columns[(c * n + i) * self.wide + hat..]);
                        sums[c] = r.fma(A::F32::splat(l[c]), sums[c]);
                    }
                }
                let mut rgb = [[0.0f32; WIDEST]; 3];
                for c in 0..3 {
                    sums[c].store(&mut rgb[c]);
                }
                for lane in 0..lanes.min(hats - hat) {
                    for c in 0..3 {
                        self.out[(3 * (hat + lane) + c) * padded(row) + k] = rgb[c][lane];
                    }
                }
            }
        }
    }
}
