//! Radiance of every cluster's matrices at every hat, once a frame.

use super::bake::Compressed;
use crate::View;
use crate::shared::light::sh_light::ShLight;
use steradian_parallel::prelude::*;
use steradian_simd::{Arch, Kernel, Vector, run};

/// Lanes of the widest register.
pub const WIDEST: usize = 16;
/// Coefficients at most (6 bands).
const MAX_COEFFICIENTS: usize = 36;

/// The light of a frame through the matrices of the clusters.
#[derive(Default)]
pub struct Frame {
    /// Cluster after cluster, hat after hat [`of_hat`] numbers: by channel those of the components, filled up
    /// by zeros to [`padded`]; behind them the means of red, green and blue, and 0.
    pub(super) radiance: Vec<f32>,
}

/// Numbers of the components of a hat and channel, whole registers of eight.
pub const fn padded(components: usize) -> usize {
    if components > 8 { components.next_multiple_of(8) } else { 8 }
}

/// Numbers of a hat.
pub const fn of_hat(components: usize) -> usize {
    3 * padded(components) + 4
}

/// Index, among the numbers of a hat, of channel `c` of the mean (k = 0) or of a component (k ≥ 1).
pub const fn place(components: usize, k: usize, c: usize) -> usize {
    if k == 0 { 3 * padded(components) + c } else { c * padded(components) + k - 1 }
}

impl Frame {
    pub(super) fn update(&mut self, light: &ShLight, t: &Compressed, v: &View) {
        let n = t.n;
        if n == 0 || n > MAX_COEFFICIENTS {
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
        let each = hats * of_hat(t.components);
        self.radiance.resize(t.basis.len() / (row * n * n) * each, 0.0);
        let clusters = self.radiance.par_chunks_exact_mut(each);
        clusters.zip(t.basis.par_chunks_exact(row * n * n)).for_each(|(out, basis)| {
            run(Cluster { n, light: &light, columns: &columns, wide, basis, out });
        });
    }

    /// Hat after hat, of the mean and of each component red, green and blue.
    pub(super) fn by_hat(&self, components: usize) -> Vec<f32> {
        let hats = self.radiance.chunks_exact(of_hat(components));
        let of = |l: &[f32], k: usize| [0, 1, 2].map(|c| l[place(components, k, c)]);
        hats.flat_map(|l| (0..=components).flat_map(|k| of(l, k)).collect::<Vec<_>>()).collect()
    }
}

struct Cluster<'a> {
    n: usize,
    light: &'a [[f32; 3]],
    /// Factors of hats, by channel and coefficient, [`Cluster::wide`] hats each.
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
        let each = of_hat(row - 1);
        let hats = self.out.len() / each;
        for (k, matrix) in self.basis.chunks_exact(n * n).enumerate() {
            let mut through = [[0.0f32; 3]; MAX_COEFFICIENTS];
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
                        self.out[(hat + lane) * each + place(row - 1, k, c)] = rgb[c][lane];
                    }
                }
            }
        }
    }
}
