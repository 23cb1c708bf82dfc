//! Products of long vectors: sums of single precision over runs, added up in double precision, always in the
//! same order.

use steradian_numerics::eigen;
use steradian_parallel::prelude::*;

/// Sums at a time.
const LANES: usize = 16;
/// Length of a run.
const RUN: usize = 512;
/// Columns that a thread takes at once.
pub const BLOCK: usize = 1024;
/// Least squared length of a vector after orthogonalisation against those before it, relative to the largest;
/// shorter ones count as dependent.
const RANK: f64 = 1e-13;

/// Σ a b of a run.
#[inline(always)]
fn run(a: &[f32], b: &[f32]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut sums = [0.0f32; LANES];
    for (a, b) in a.iter().zip(b) {
        for k in 0..LANES {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().map(|s| f64::from(*s)).sum::<f64>() + f64::from(rest)
}

/// Σ a b.
pub fn dot(a: &[f32], b: &[f32]) -> f64 {
    steradian_simd::dispatch(
        #[inline(always)]
        || a.chunks(RUN).zip(b.chunks(RUN)).map(|(a, b)| run(a, b)).sum(),
    )
}

/// to += w x.
pub fn add(to: &mut [f32], w: f32, x: &[f32]) {
    steradian_simd::dispatch(
        #[inline(always)]
        || to.iter_mut().zip(x).for_each(|(t, x)| *t += w * x),
    );
}

/// The scalar product of each row of `a` with each of `b`, rows of `n` numbers: `[row of a][row of b]`. Runs
/// of both are kept in the cache.
pub fn products(a: &[f32], b: &[f32], n: usize) -> Vec<f64> {
    let (rows, columns) = (a.len() / n.max(1), b.len() / n.max(1));
    let mut out = vec![0.0; rows * columns];
    let mut at = 0;
    while at < n {
        let to = (at + RUN).min(n);
        steradian_simd::dispatch(
            #[inline(always)]
            || {
                for i in 0..rows {
                    let x = &a[i * n + at..i * n + to];
                    for j in 0..columns {
                        out[i * columns + j] += run(x, &b[j * n + at..j * n + to]);
                    }
                }
            },
        );
        at = to;
    }
    out
}

/// Scalar products of the rows of `a` with each other, as a square matrix; on all cores.
pub fn gram(a: &[f32], n: usize) -> Vec<Vec<f64>> {
    let rows = a.len() / n.max(1);
    let row = |i: usize| (0..=i).map(|j| dot(&a[i * n..][..n], &a[j * n..][..n])).collect::<Vec<f64>>();
    let lower: Vec<Vec<f64>> = (0..rows).into_par_iter().with_max_len(4).map(row).collect();
    (0..rows).map(|i| (0..rows).map(|j| lower[i.max(j)][i.min(j)]).collect()).collect()
}

/// An orthonormal basis of the span of the rows of `a`, the strongest vector first; as many vectors as rows,
/// dependent ones 0. By the eigenvectors of their scalar products, twice: after the first time weak vectors
/// have rounding errors.
pub fn orthonormal(a: &[f32], n: usize) -> Vec<f32> {
    let mut out = a.to_vec();
    for _ in 0..2 {
        let pairs = eigen::symmetric(gram(&out, n));
        let largest = pairs.first().map_or(0.0, |p| p.0);
        let from = std::mem::replace(&mut out, vec![0.0; a.len()]);
        let combine = |(to, (value, u)): (&mut [f32], &(f64, Vec<f64>))| {
            if *value > RANK * largest && *value > 0.0 {
                let scale = value.sqrt().recip();
                for (row, u) in from.chunks_exact(n).zip(u) {
                    add(to, (u * scale) as f32, row);
                }
            }
        };
        out.par_chunks_exact_mut(n).zip(&pairs).with_max_len(1).for_each(combine);
    }
    out
}
