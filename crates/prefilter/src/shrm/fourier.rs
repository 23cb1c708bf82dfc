//! The sum over m: rows of texels from cells.
//!
//! Up to an order of [`DIRECT`], and with columns in fours, by a product with cos mβ and sin mβ over a
//! quarter of the circle, which the parities of m and of the sine unfold; else by a complex FFT of two rows
//! at once.

use super::recursion::RINGS;
use std::f64::consts::PI;
use steradian_simd::{Arch, Kernel, Vector};
use steradian_sphere::fft::{Complex, Fft};

/// Highest order of the direct product.
const DIRECT: usize = 96;
/// Numbers of a quarter come in multiples of this.
const PAD: usize = 32;
/// Rows that are multiplied together.
const ROWS: usize = 4;

/// Storage of a row's sums over m before they are unfolded.
#[derive(Default)]
pub(super) struct Buffers {
    /// Coefficients by row: cosines of even m, of odd m, sines of even m, of odd m.
    rows: Vec<f64>,
    sums: Vec<f64>,
    spectrum: Vec<Complex>,
    scratch: Vec<f64>,
}

pub(super) struct Fourier {
    order: usize,
    columns: usize,
    transform: Transform,
}

enum Transform {
    /// cos mβ of even m, of odd m, sin mβ of even m, of odd m: rows of a padded quarter.
    Direct { quarter: usize, tables: [Vec<f64>; 4] },
    /// The inverse transform and e^{im(π/columns − π)}.
    Fast { fft: Fft, phases: Vec<Complex> },
}

/// One channel of one map over a block of rings: where its texels go, north and south.
pub(super) struct Target<'a> {
    pub(super) north: &'a mut [f32],
    /// Rows from the equator's side on.
    pub(super) south: &'a mut [f32],
}

impl Fourier {
    pub(super) fn new(order: usize, columns: usize) -> Self {
        Self::with_limit(order, columns, DIRECT)
    }

    fn with_limit(order: usize, columns: usize, direct: usize) -> Self {
        let transform = if columns.is_multiple_of(4) && order <= direct {
            let quarter = (columns / 4).next_multiple_of(PAD);
            let table = |sine: bool, odd: usize| {
                let angle = |m: usize, t: usize| 2.0 * PI / columns as f64 * m as f64 * (t as f64 + 0.5);
                let of = |m: usize, t: usize| if sine { angle(m, t).sin() } else { angle(m, t).cos() };
                (odd..=order)
                    .step_by(2)
                    .flat_map(|m| (0..quarter).map(move |t| if t < columns / 4 { of(m, t) } else { 0.0 }))
                    .collect()
            };
            Transform::Direct {
                quarter,
                tables: [table(false, 0), table(false, 1), table(true, 0), table(true, 1)],
            }
        } else {
            let phase = |m: usize| Complex::cis(m as f64 * (PI / columns as f64 - PI));
            Transform::Fast { fft: Fft::new(columns), phases: (0..=order).map(phase).collect() }
        };
        Self { order, columns, transform }
    }

    /// Texels from cells: `cell(m)` are the cosine's north and south, then the sine's, over the block's
    /// rings, each starting where it says.
    pub(super) fn rows<'c>(
        &self,
        cell: impl Fn(usize) -> [&'c [f64]; 4],
        target: Target<'_>,
        buffers: &mut Buffers,
    ) {
        match &self.transform {
            Transform::Direct { quarter, tables } => self.direct(*quarter, tables, cell, target, buffers),
            Transform::Fast { fft, phases } => self.fast(fft, phases, cell, target, buffers),
        }
    }

    fn direct<'c>(
        &self,
        quarter: usize,
        tables: &[Vec<f64>; 4],
        cell: impl Fn(usize) -> [&'c [f64]; 4],
        target: Target<'_>,
        buffers: &mut Buffers,
    ) {
        let n = self.columns;
        let (north, south) = (target.north.len() / n, target.south.len() / n);
        let rings = north.max(south);
        let (even, odd) = (self.order / 2 + 1, self.order.div_ceil(2));
        let width = 2 * (even + odd);
        buffers.rows.clear();
        buffers.rows.resize((2 * rings).next_multiple_of(ROWS) * width, 0.0);
        for m in 0..=self.order {
            let numbers = cell(m);
            let place = if m % 2 == 0 { m / 2 } else { even + m / 2 };
            for (k, numbers) in numbers.iter().enumerate() {
                let (sine, southern) = (k / 2, k % 2);
                for ring in 0..rings {
                    let row = 2 * ring + southern;
                    buffers.rows[row * width + sine * (even + odd) + place] = numbers[ring];
                }
            }
        }
        buffers.sums.resize(4 * ROWS * quarter, 0.0);
        steradian_simd::run(Direct { n, quarter, tables, width, rings: [north, south], buffers, target });
    }

    fn fast<'c>(
        &self,
        fft: &Fft,
        phases: &[Complex],
        cell: impl Fn(usize) -> [&'c [f64]; 4],
        target: Target<'_>,
        buffers: &mut Buffers,
    ) {
        let n = self.columns;
        let zero = Complex::new(0.0, 0.0);
        let rings = (target.north.len() / n).max(target.south.len() / n).min(RINGS);
        buffers.spectrum.clear();
        buffers.spectrum.resize(rings * n, zero);
        for (m, phase) in phases.iter().enumerate() {
            let [cn, cs, sn, ss] = cell(m);
            let (up, down) = (m % n, (n - m % n) % n);
            for ring in 0..rings {
                let row = &mut buffers.spectrum[ring * n..(ring + 1) * n];
                // Half of (c − is) e^{imβ} and its conjugate, of the north and i times the south.
                let a = Complex::new(cn[ring], -sn[ring]) * *phase * 0.5;
                let b = Complex::new(cs[ring], -ss[ring]) * *phase * 0.5;
                let i = Complex::new(0.0, 1.0);
                row[up] += a + i * b;
                row[down] += a.conj() + i * b.conj();
            }
        }
        fft.inverse(&mut buffers.spectrum, &mut buffers.scratch);
        for ring in 0..rings {
            let row = &buffers.spectrum[ring * n..(ring + 1) * n];
            if let Some(out) = target.north.get_mut(ring * n..(ring + 1) * n) {
                out.iter_mut().zip(row).for_each(|(o, z)| *o = z.re as f32);
            }
            let rows = target.south.len() / n;
            if ring < rows {
                let at = (rows - 1 - ring) * n;
                target.south[at..at + n].iter_mut().zip(row).for_each(|(o, z)| *o = z.im as f32);
            }
        }
    }
}

struct Direct<'a> {
    n: usize,
    quarter: usize,
    tables: &'a [Vec<f64>; 4],
    width: usize,
    rings: [usize; 2],
    buffers: &'a mut Buffers,
    target: Target<'a>,
}

impl Kernel for Direct<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let Buffers { rows, sums, .. } = self.buffers;
        let (n, quarter) = (self.n, self.quarter);
        let count = 2 * self.rings[0].max(self.rings[1]);
        let mut first = 0;
        while first < count {
            let mut from = 0;
            for group in 0..4 {
                let table = &self.tables[group][..];
                let sums = &mut sums[group * ROWS * quarter..(group + 1) * ROWS * quarter];
                let rows = &rows[first * self.width + from..];
                let mut t = 0;
                while t < quarter {
                    if A::F64::REGISTERS >= 32 {
                        product::<A::F64, 4>(rows, self.width, table, (t, quarter), sums);
                        t += 4 * A::F64::LANES;
                    } else {
                        product::<A::F64, 2>(rows, self.width, table, (t, quarter), sums);
                        t += 2 * A::F64::LANES;
                    }
                }
                from += table.len() / quarter;
            }
            for k in 0..ROWS {
                let (ring, southern) = ((first + k) / 2, k % 2);
                if ring >= self.rings[southern] {
                    continue;
                }
                let out = if southern == 0 {
                    &mut self.target.north[ring * n..(ring + 1) * n]
                } else {
                    let at = (self.rings[1] - 1 - ring) * n;
                    &mut self.target.south[at..at + n]
                };
                let part = |group: usize| &sums[(group * ROWS + k) * quarter..][..n / 4];
                unfold([part(0), part(1), part(2), part(3)], out);
            }
            first += ROWS;
        }
    }
}

/// Sums of ROWS rows over the quarter's columns from t, N registers of them; 0 where the table is empty, as
/// those of odd m are in order 0.
#[inline(always)]
fn product<V: Vector<T = f64>, const N: usize>(
    rows: &[f64],
    width: usize,
    table: &[f64],
    (t, quarter): (usize, usize),
    sums: &mut [f64],
) {
    let mut acc = [[V::splat(0.0); N]; ROWS];
    let mut k = 0;
    while k * quarter < table.len() {
        let mut basis = [acc[0][0]; N];
        for v in 0..N {
            basis[v] = V::load(&table[k * quarter + t + v * V::LANES..]);
        }
        for r in 0..ROWS {
            let x = V::splat(rows[r * width + k]);
            for v in 0..N {
                acc[r][v] = basis[v].fma(x, acc[r][v]);
            }
        }
        k += 1;
    }
    for r in 0..ROWS {
        for v in 0..N {
            acc[r][v].store(&mut sums[r * quarter + t + v * V::LANES..]);
        }
    }
}

/// A whole row from the quarter 0 < β < π/2: cosines are even in β, and m's parity tells π − β from β.
#[inline(always)]
fn unfold([a, b, c, d]: [&[f64]; 4], out: &mut [f32]) {
    let quarter = a.len();
    let (west, east) = out.split_at_mut(2 * quarter);
    // −π … −π/2, −π/2 … 0, 0 … π/2, π/2 … π.
    let (w0, w1) = west.split_at_mut(quarter);
    let (e0, e1) = east.split_at_mut(quarter);
    let (b, c, d) = (&b[..quarter], &c[..quarter], &d[..quarter]);
    for t in 0..quarter {
        let (even, odd) = (a[t] + b[t], a[t] - b[t]);
        let (sum, difference) = (c[t] + d[t], c[t] - d[t]);
        e0[t] = (even + sum) as f32;
        w0[t] = (odd + difference) as f32;
        w1[quarter - 1 - t] = (even - sum) as f32;
        e1[quarter - 1 - t] = (odd - difference) as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_are_the_sum() {
        steradian_testkit::on_every_isa(|| {
            sums();
        });
    }

    fn sums() {
        for (order, n) in [(5, 8), (7, 12), (3, 128), (40, 96), (9, 7), (6, 10), (0, 128), (1, 128), (2, 4)] {
            let value = |m: usize, k: usize, ring: usize| ((3 * m + 7 * k + ring) as f64).sin();
            let cells: Vec<Vec<f64>> =
                (0..4 * (order + 1)).map(|i| (0..RINGS).map(|r| value(i / 4, i % 4, r)).collect()).collect();
            for direct in [0, 1000] {
                let plan = Fourier::with_limit(order, n, direct);
                let (mut north, mut south) = (vec![0.0_f32; 3 * n], vec![0.0_f32; 2 * n]);
                let target = Target { north: &mut north, south: &mut south };
                let cell = |m: usize| std::array::from_fn(|k| &cells[4 * m + k][..]);
                plan.rows(cell, target, &mut Buffers::default());
                for j in 0..n {
                    let beta = 2.0 * PI * (j as f64 + 0.5) / n as f64 - PI;
                    let at = |ring: usize, s: usize| -> f64 {
                        let of = |m: usize| {
                            let (sin, cos) = (m as f64 * beta).sin_cos();
                            value(m, s, ring) * cos + value(m, 2 + s, ring) * sin
                        };
                        (0..=order).map(of).sum()
                    };
                    for ring in 0..3 {
                        let got = f64::from(north[ring * n + j]);
                        assert!((got - at(ring, 0)).abs() < 1e-5, "{order} {n} {direct}");
                        if ring < 2 {
                            let got = f64::from(south[(1 - ring) * n + j]);
                            assert!((got - at(ring, 1)).abs() < 1e-5, "{order} {n} {direct}");
                        }
                    }
                }
            }
        }
    }
}
