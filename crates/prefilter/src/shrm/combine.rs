//! Linear combinations of planes: out_o = Σ_i M_oi in_i, texel by texel.

use steradian_numerics::dense;
use steradian_parallel::prelude::*;
use steradian_simd::{Arch, Kernel, Vector};

/// Planes that are made together.
const TOGETHER: usize = 4;

/// RGB planes from RGB planes by a matrix of rows. Sums are f32: a few dozen terms of numbers that are f32
/// themselves.
pub(super) fn combine(matrix: &[Vec<f64>], ins: &[[Vec<f32>; 3]]) -> Vec<[Vec<f32>; 3]> {
    let texels = ins.first().map_or(0, |p| p[0].len());
    let mut outs: Vec<[Vec<f32>; 3]> =
        matrix.iter().map(|_| std::array::from_fn(|_| vec![0.0; texels])).collect();
    let narrow: Vec<f32> = matrix.iter().flatten().map(|x| *x as f32).collect();
    let mut items = Vec::with_capacity(3 * outs.len().div_ceil(TOGETHER));
    let mut by_channel: [Vec<&mut [f32]>; 3] = Default::default();
    for planes in &mut outs {
        for (list, plane) in by_channel.iter_mut().zip(planes) {
            list.push(plane);
        }
    }
    let channels: [Vec<&[f32]>; 3] = std::array::from_fn(|c| ins.iter().map(|p| &p[c][..]).collect());
    for (c, list) in by_channel.iter_mut().enumerate() {
        for (k, outs) in list.chunks_mut(TOGETHER).enumerate() {
            items.push((c, k * TOGETHER, outs));
        }
    }
    items.into_par_iter().for_each(|(c, first, outs)| {
        let matrix = &narrow[first * ins.len()..(first + outs.len()) * ins.len()];
        steradian_simd::run(Combine { matrix, ins: &channels[c], outs, texels });
    });
    outs
}

struct Combine<'a, 'b> {
    matrix: &'a [f32],
    ins: &'a [&'a [f32]],
    outs: &'a mut [&'b mut [f32]],
    texels: usize,
}

impl Kernel for Combine<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let lanes = A::F32::LANES;
        let mut t = 0;
        if self.outs.len() == TOGETHER {
            while t + 2 * lanes <= self.texels {
                block::<A::F32, 2, TOGETHER>(self.matrix, self.ins, self.outs, t);
                t += 2 * lanes;
            }
        }
        for (o, out) in self.outs.iter_mut().enumerate() {
            let row = &self.matrix[o * self.ins.len()..(o + 1) * self.ins.len()];
            let mut t = t;
            while t + lanes <= self.texels {
                block::<A::F32, 1, 1>(row, self.ins, std::slice::from_mut(out), t);
                t += lanes;
            }
            while t < self.texels {
                let mut sum = 0.0;
                for i in 0..row.len() {
                    sum += row[i] * self.ins[i][t];
                }
                out[t] = sum;
                t += 1;
            }
        }
    }
}

/// N registers of texels from t on, of K planes.
#[inline(always)]
fn block<V: Vector<T = f32>, const N: usize, const K: usize>(
    matrix: &[f32],
    ins: &[&[f32]],
    outs: &mut [&mut [f32]],
    t: usize,
) {
    let mut acc = [[V::splat(0.0); N]; K];
    for i in 0..ins.len() {
        let mut x = [acc[0][0]; N];
        for v in 0..N {
            x[v] = V::load(&ins[i][t + v * V::LANES..]);
        }
        for o in 0..K {
            let w = V::splat(matrix[o * ins.len() + i]);
            for v in 0..N {
                acc[o][v] = x[v].fma(w, acc[o][v]);
            }
        }
    }
    for o in 0..K {
        for v in 0..N {
            acc[o][v].store(&mut outs[o][t + v * V::LANES..]);
        }
    }
}

/// (AᵀWA)⁻¹AᵀW: the matrix that fits coefficients to samples by least squares. `None` where it is singular.
pub(super) fn least_squares(a: &[Vec<f64>], weights: Option<&[f64]>) -> Option<Vec<Vec<f64>>> {
    let n = a.first()?.len();
    let w = |k: usize| weights.map_or(Some(1.0), |w| w.get(k).copied());
    let mut normal = vec![vec![0.0; n]; n];
    let mut right: Vec<Vec<f64>> = vec![vec![0.0; a.len()]; n];
    for (s, row) in a.iter().enumerate() {
        let w = w(s)?;
        for i in 0..n {
            right[i][s] = w * row[i];
            (0..n).for_each(|j| normal[i][j] += w * row[i] * row[j]);
        }
    }
    dense::solve(normal, right, 1e-12)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn combinations_are_sums() {
        for (outs, ins, texels) in [(1, 3, 5), (9, 4, 70), (4, 9, 64), (6, 1, 33)] {
            let planes: Vec<[Vec<f32>; 3]> = (0..ins)
                .map(|i| {
                    std::array::from_fn(|c| (0..texels).map(|t| ((i * 7 + c + t) as f32).sin()).collect())
                })
                .collect();
            let matrix: Vec<Vec<f64>> =
                (0..outs).map(|o| (0..ins).map(|i| ((o * 3 + i) as f64).cos()).collect()).collect();
            let got = combine(&matrix, &planes);
            for o in 0..outs {
                for c in 0..3 {
                    for t in 0..texels {
                        let sum: f64 = (0..ins).map(|i| matrix[o][i] * f64::from(planes[i][c][t])).sum();
                        assert!((f64::from(got[o][c][t]) - sum).abs() < 1e-5);
                    }
                }
            }
        }
    }

    #[test]
    fn least_squares_undo_and_refuse() {
        let a: Vec<Vec<f64>> = (0..7).map(|s| (0..3).map(|i| f64::from(s).powi(i)).collect()).collect();
        let fit = least_squares(&a, Some(&[1.0, 2.0, 1.0, 0.5, 1.0, 1.0, 3.0])).expect("three of seven");
        for i in 0..3 {
            for j in 0..3 {
                let sum: f64 = (0..7).map(|s| fit[i][s] * a[s][j]).sum();
                assert!((sum - if i == j { 1.0 } else { 0.0 }).abs() < 1e-10);
            }
        }
        assert!(least_squares(&a[..2], None).is_none());
        assert!(least_squares(&[], None).is_none());
    }
}
