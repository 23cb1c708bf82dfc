//! Large dense matrices in single precision, and their products with a few vectors in double precision.
//!
//! Sums go over the entries in their order, whatever the number of threads.

use steradian_parallel::prelude::*;

/// A dense matrix, rows one after the other.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Matrix {
    rows: usize,
    columns: usize,
    data: Vec<f32>,
}

/// Vectors that a product takes at once: eight doubles are one register of AVX-512, or two of AVX2.
const PANEL: usize = 8;
/// Columns of a block of the transposed product: 64 × 8 sums of doubles are 4 kB, which stay in the first
/// cache. 32 and 128 columns take as long for 3000 × 3000, within 11 %.
const BLOCK_COLUMNS: usize = 64;
/// Rows that a task takes. 8 and 32 take as long for 3000 × 3000, within 6 %.
const ROWS_PER_TASK: usize = 16;

type Panel = [f64; PANEL];

/// Vectors of one length side by side, eight at a time.
fn panels(x: &[Vec<f64>]) -> Vec<Vec<Panel>> {
    let panel = |v: &[Vec<f64>]| -> Vec<Panel> {
        let n = v[0].len();
        (0..n).map(|i| std::array::from_fn(|k| v.get(k).map_or(0.0, |v| v[i]))).collect()
    };
    x.chunks(PANEL).map(panel).collect()
}

/// Numbers of panels as `count` vectors.
fn vectors(panels: &[Vec<Panel>], count: usize) -> Vec<Vec<f64>> {
    (0..count).map(|k| panels[k / PANEL].iter().map(|p| p[k % PANEL]).collect()).collect()
}

impl Matrix {
    /// A matrix of `rows` rows; `None` where the numbers do not fill whole rows.
    pub fn new(rows: usize, columns: usize, data: Vec<f32>) -> Option<Self> {
        (data.len() == rows * columns).then_some(Self { rows, columns, data })
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Row `i`.
    pub fn row(&self, i: usize) -> &[f32] {
        &self.data[i * self.columns..(i + 1) * self.columns]
    }

    /// Σ a², row by row.
    pub fn square(&self) -> f64 {
        let of = |i: usize| self.row(i).iter().map(|a| f64::from(*a).powi(2)).sum::<f64>();
        let rows: Vec<f64> = (0..self.rows).into_par_iter().with_min_len(ROWS_PER_TASK).map(of).collect();
        rows.iter().sum()
    }

    /// A x of several vectors, each as long as a row.
    pub fn times(&self, x: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let of = |p: Vec<Panel>| -> Vec<Panel> {
            let row = |i: usize| {
                let mut s = [0.0; PANEL];
                for (a, x) in self.row(i).iter().zip(&p) {
                    let a = f64::from(*a);
                    for k in 0..PANEL {
                        s[k] += a * x[k];
                    }
                }
                s
            };
            (0..self.rows).into_par_iter().with_min_len(ROWS_PER_TASK).map(row).collect()
        };
        vectors(&panels(x).into_iter().map(of).collect::<Vec<_>>(), x.len())
    }

    /// Aᵀ y of several vectors, each as long as a column.
    pub fn transposed_times(&self, y: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let of = |p: Vec<Panel>| -> Vec<Panel> {
            let block = |b: usize| {
                let columns = b * BLOCK_COLUMNS..((b + 1) * BLOCK_COLUMNS).min(self.columns);
                let mut sums = vec![[0.0; PANEL]; columns.len()];
                for (i, y) in p.iter().enumerate() {
                    for (s, a) in sums.iter_mut().zip(&self.row(i)[columns.clone()]) {
                        let a = f64::from(*a);
                        for k in 0..PANEL {
                            s[k] += a * y[k];
                        }
                    }
                }
                sums
            };
            let blocks: Vec<Vec<Panel>> =
                (0..self.columns.div_ceil(BLOCK_COLUMNS)).into_par_iter().map(block).collect();
            blocks.concat()
        };
        vectors(&panels(y).into_iter().map(of).collect::<Vec<_>>(), y.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_sums_over_entries() {
        let (rows, columns) = (5, 131);
        let a = |i: usize, j: usize| ((i * 37 + j * 11) % 17) as f32 - 8.0;
        let data = (0..rows * columns).map(|k| a(k / columns, k % columns)).collect();
        let m = Matrix::new(rows, columns, data).expect("whole rows");
        let x: Vec<Vec<f64>> =
            (0..11).map(|k| (0..columns).map(|j| (j + k) as f64 * 0.5).collect()).collect();
        let y: Vec<Vec<f64>> = (0..3).map(|k| (0..rows).map(|i| (i * k) as f64 - 1.0).collect()).collect();
        let (ax, aty) = (m.times(&x), m.transposed_times(&y));
        assert_eq!((ax.len(), aty.len()), (11, 3));
        for (k, v) in ax.iter().enumerate() {
            for (i, v) in v.iter().enumerate() {
                let want: f64 = (0..columns).map(|j| f64::from(a(i, j)) * x[k][j]).sum();
                assert!((v - want).abs() < 1e-9, "{v} {want}");
            }
        }
        for (k, v) in aty.iter().enumerate() {
            for (j, v) in v.iter().enumerate() {
                let want: f64 = (0..rows).map(|i| f64::from(a(i, j)) * y[k][i]).sum();
                assert!((v - want).abs() < 1e-9, "{v} {want}");
            }
        }
        let square: f64 = (0..rows * columns).map(|k| f64::from(a(k / columns, k % columns)).powi(2)).sum();
        assert_eq!(m.square(), square);
        assert!(Matrix::new(2, 3, vec![0.0; 5]).is_none());
    }
}
