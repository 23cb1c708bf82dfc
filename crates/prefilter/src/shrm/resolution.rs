//! Resolutions from a tolerance: the error of bilinear interpolation, from the spectra of light and kernel.
//!
//! Linear interpolation of e^{iωx} between samples h apart leaves the mean square, t = ωh,
//!
//! > e(t) = 5/3 + cos t/3 − 4(1 − cos t)/t² ≈ t⁴/120.
//!
//! For light of given band energies in any orientation, L'_lq seen along a meridian has frequency n with the
//! share
//! |d^l_nq(π/2)|² of E_l/(2l+1), since moving along it turns about y'; around a parallel every m has the share
//! 1/(2l+1) of the mean over the sphere. Both errors come together: as waves of all directions, ⟨n²m²⟩ =
//! l⁴/12 beside ⟨n⁴⟩ = 3l⁴/8 and ⟨m⁴⟩ = l⁴/5 makes their correlation 0.25.

use super::error::{mean_square, mean_square_error};
use super::recursion::{Column, Fill, Rings, steps};
use super::{Grid, Term};
use std::f64::consts::{FRAC_PI_2, PI};

/// Correlation of the errors of interpolation along meridians and parallels: (1/12)(1/144)·120/√(3/40).
const CORRELATION: f64 = 0.2536;

/// e(t): mean square error of linear interpolation of a wave of amplitude 1 between samples t radians of it
/// apart.
pub fn linear(t: f64) -> f64 {
    if t < 0.05 {
        return t.powi(4) / 120.0;
    }
    5.0 / 3.0 + t.cos() / 3.0 - 4.0 * (1.0 - t.cos()) / (t * t)
}

/// Mean energies of maps by frequency along meridians and parallels, all channels and maps together.
#[derive(Debug, Clone)]
pub struct Frequencies {
    alpha: Vec<f64>,
    beta: Vec<f64>,
}

impl Frequencies {
    /// Errors for the maps of terms, each of which is a map of its own (or two), from E_l.
    pub fn new(bands: &[[f64; 3]], terms: &[Term<'_>]) -> Self {
        let order = bands.len().saturating_sub(1);
        let (mut alpha, mut beta) = (vec![0.0; order + 1], vec![0.0; order + 1]);
        let mut qs: Vec<usize> = terms.iter().map(|t| t.q).filter(|q| *q <= order).collect();
        qs.sort_unstable();
        qs.dedup();
        for q in qs {
            let energies: Vec<f64> = (0..=order).map(|l| energy(bands, terms, q, l)).collect();
            for n in 0..=order {
                for l in n.max(q)..=order {
                    // ±n; only the sum of their shares counts.
                    let both = if n == 0 { 1.0 } else { 2.0 };
                    beta[n] += both * energies[l] / (2 * l + 1) as f64;
                }
                alpha[n] += along_meridian(n, q, order, &energies);
            }
        }
        Self { alpha, beta }
    }

    /// Relative RMS error that bilinear interpolation on a grid adds, mean over the sphere.
    pub fn error(&self, grid: Grid) -> f64 {
        let (a, b) = (self.rows_error(grid.rows()), self.columns_error(grid.columns()));
        (a * a + b * b + 2.0 * CORRELATION * a * b).sqrt()
    }

    /// Error of interpolation between rows alone.
    pub fn rows_error(&self, rows: usize) -> f64 {
        relative(&self.alpha, PI / (rows.max(2) - 1) as f64)
    }

    /// Error of interpolation between columns alone.
    pub fn columns_error(&self, columns: usize) -> f64 {
        relative(&self.beta, 2.0 * PI / columns.max(1) as f64)
    }

    /// The smallest grid (about) whose error is within `tolerance`: rows and columns share it. Columns are a
    /// multiple of 4; none of the two exceeds 16384.
    pub fn grid(&self, tolerance: f64) -> Grid {
        let each = tolerance / (2.0 + 2.0 * CORRELATION).sqrt();
        let rows = least(|n| self.rows_error(n) <= each);
        let columns = least(|n| self.columns_error(4 * n) <= each);
        Grid::new(rows.max(2), 4 * columns)
    }
}

/// The least n ≤ 16384 that will do.
fn least(does: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (1, 16384);
    while low < high {
        let middle = (low + high) / 2;
        if does(middle) { high = middle } else { low = middle + 1 }
    }
    low
}

fn relative(spectrum: &[f64], step: f64) -> f64 {
    let total: f64 = spectrum.iter().sum();
    let error: f64 = spectrum.iter().enumerate().map(|(n, e)| e * linear(n as f64 * step)).sum();
    if total > 0.0 { (error / total).sqrt() } else { 0.0 }
}

/// Mean energy of band l in all maps of q: E_l/(2l+1) Σ k², channels together.
fn energy(bands: &[[f64; 3]], terms: &[Term<'_>], q: usize, l: usize) -> f64 {
    let signs = if q == 0 { 1.0 } else { 2.0 };
    let square =
        |t: &Term<'_>| (0..3).map(|c| bands[l][c] * t.k[c].get(l).map_or(0.0, |k| k * k)).sum::<f64>();
    signs / (2 * l + 1) as f64 * terms.iter().filter(|t| t.q == q).map(square).sum::<f64>()
}

/// Σ_l energies[l] (|d^l_nq|² + |d^l_−n,q|²) at π/2, the second for n > 0.
fn along_meridian(n: usize, q: usize, order: usize, energies: &[f64]) -> f64 {
    let mut column = Column::default();
    let (steps, rings) = (steps(n, q, order), Rings::new(&[FRAC_PI_2]));
    steradian_simd::run(Fill { m: n, q, steps: &steps, rings: &rings, column: &mut column });
    let lanes = super::recursion::RINGS;
    // (u⁺)² + (u⁻)² are twice the sum for q > 0, the sum for q = 0.
    let (parts, share) = if q > 0 { (2, 0.5) } else { (1, 1.0) };
    let rows = column.rows.chunks_exact(parts * lanes);
    let square = |row: &[f64]| (0..parts).map(|k| row[k * lanes].powi(2)).sum::<f64>();
    rows.zip(energies.iter().skip(column.first)).map(|(row, e)| share * e * square(row)).sum()
}

/// Relative RMS error of linear interpolation over elevations when of a fine table of kernels only every
/// `step`-th is kept, the last one always: mean over the elevations of the table.
pub fn elevations_error(bands: &[[f64; 3]], table: &[Vec<Term<'_>>], step: usize) -> f64 {
    let (step, last) = (step.max(1), table.len().saturating_sub(1));
    let (mut error, mut signal) = (0.0, 0.0);
    for (k, exact) in table.iter().enumerate() {
        signal += mean_square(bands, exact).iter().sum::<f64>();
        let (from, to) = (k / step * step, (k / step * step + step).min(last));
        if k == from || k == to {
            continue;
        }
        let w = (k - from) as f64 / (to - from) as f64;
        let (a, b) = (scaled(&table[from], 1.0 - w), scaled(&table[to], w));
        let both: Vec<Term<'_>> = a.iter().chain(&b).map(super::error::Row::term).collect();
        error += mean_square_error(bands, exact, &both).iter().sum::<f64>();
    }
    if error > 0.0 { (error / signal).sqrt() } else { 0.0 }
}

fn scaled(terms: &[Term<'_>], factor: f64) -> Vec<super::error::Row> {
    let scale = |k: &[f64]| k.iter().map(|x| factor * x).collect();
    terms.iter().map(|t| super::error::Row { q: t.q, k: t.k.map(scale) }).collect()
}

/// T: how many evenly spaced elevations of a fine table must be kept for linear interpolation between them to
/// stay within `tolerance`; the whole table where it never does.
pub fn elevations(bands: &[[f64; 3]], table: &[Vec<Term<'_>>], tolerance: f64) -> usize {
    let last = table.len().saturating_sub(1);
    let divides = |step: &usize| last.is_multiple_of(*step);
    let wide = (1..=last).rev().filter(divides).find(|s| elevations_error(bands, table, *s) <= tolerance);
    last / wide.unwrap_or(1).max(1) + usize::from(!table.is_empty())
}

/// T: how many azimuths φ_o linear interpolation about the whole circle needs, from the terms of an
/// elevation.
pub fn azimuths(bands: &[[f64; 3]], terms: &[Term<'_>], tolerance: f64) -> usize {
    let last = terms.iter().map(|t| t.q).max().unwrap_or(0);
    let of = |q: usize| {
        let same: Vec<Term<'_>> = terms.iter().filter(|t| t.q == q).copied().collect();
        mean_square(bands, &same).iter().sum()
    };
    let spectrum: Vec<f64> = (0..=last).map(of).collect();
    least(|n| relative(&spectrum, 2.0 * PI / n as f64) <= tolerance)
}

#[cfg(test)]
mod tests {
    use super::super::tests::noise;
    use super::super::{CoefficientMaps, Plan};
    use super::*;
    use glam::DVec3;
    use steradian_base::Task;
    use steradian_sphere::sh::ColumnsRgb;

    #[test]
    fn interpolation_of_a_wave() {
        for t in [0.01_f64, 0.049, 0.051, 0.3, 1.0, 3.0] {
            let n = 2000;
            let error = |k: usize| {
                let s = (k as f64 + 0.5) / n as f64;
                let re = 1.0 - s + s * t.cos() - (s * t).cos();
                let im = s * t.sin() - (s * t).sin();
                re * re + im * im
            };
            let mean: f64 = (0..n).map(error).sum::<f64>() / n as f64;
            assert!((linear(t) / mean - 1.0).abs() < 1e-3, "{t}: {} {mean}", linear(t));
        }
        let exact = (1.0 / 12.0 / 144.0) * 120.0 / (3.0_f64 / 40.0).sqrt();
        assert!((CORRELATION - exact).abs() < 1e-3, "{exact}");
    }

    /// Relative RMS error of bilinear lookup, over directions.
    fn measured(coarse: &CoefficientMaps, fine: &CoefficientMaps) -> f64 {
        let (mut error, mut signal) = (0.0, 0.0);
        for k in 0..6000 {
            let c: DVec3 = crate::probe::direction(k, 6000);
            for map in 0..coarse.planes.len() {
                let (a, b) = (coarse.sample(map, c), fine.sample(map, c));
                for c in 0..3 {
                    error += (a[c] - b[c]).powi(2);
                    signal += b[c] * b[c];
                }
            }
        }
        (error / signal).sqrt()
    }

    /// A Phong-like kernel of order F and one with azimuth: measured errors are the predicted ones, and S =
    /// 10 F leaves about one per cent.
    #[test]
    fn predictions_are_met() {
        let f = 12;
        let light = ColumnsRgb::from_world(&noise(f));
        // White light of equal power per coefficient, kernel to the orders where it has fallen to e^-3.
        let k: Vec<f64> =
            (0..=f).map(|l| ((2 * l + 1) as f64).sqrt() * (-((l * l) as f64) / 48.0).exp()).collect();
        for q in [0, 2] {
            let terms = [Term { q, k: [&k; 3] }];
            let frequencies = Frequencies::new(&light.band_energies(), &terms);
            let make =
                |grid| Plan::new(f, 2, grid).maps(&light, &terms, &Task::quiet()).expect("nobody cancels");
            let fine = make(Grid::new(1025, 2048));
            for grid in [Grid::new(32, 64), Grid::new(120, 120), Grid::new(64, 256)] {
                let (predicted, got) = (frequencies.error(grid), measured(&make(grid), &fine));
                assert!((got / predicted - 1.0).abs() < 0.15, "{q} {grid:?}: {got} {predicted}");
            }
            let square = frequencies.error(Grid::new(10 * f, 10 * f));
            assert!((0.004..0.02).contains(&square), "{q}: {square}");
            for tolerance in [0.1, 0.01, 0.003] {
                let grid = frequencies.grid(tolerance);
                let error = frequencies.error(grid);
                assert!(error <= tolerance && error > 0.7 * tolerance, "{tolerance}: {grid:?} {error}");
            }
        }
    }

    #[test]
    fn tables_of_elevations_thin_out() {
        let bands = vec![[1.0; 3]; 3];
        let rows: Vec<[f64; 3]> =
            (0..=64).map(|k| [1.0, (f64::from(k) / 20.0).sin(), (f64::from(k) / 8.0).cos()]).collect();
        let table: Vec<Vec<Term<'_>>> = rows.iter().map(|k| vec![Term { q: 0, k: [k; 3] }]).collect();
        assert_eq!(elevations_error(&bands, &table, 1), 0.0);
        let n = elevations(&bands, &table, 0.02);
        assert!((9..=33).contains(&n), "{n}");
        assert!(elevations_error(&bands, &table, 64 / (n - 1)) <= 0.02);
        assert_eq!(elevations(&bands, &[], 0.1), 0);
        let one = [Term { q: 0, k: [&rows[0]; 3] }];
        assert_eq!(azimuths(&bands, &one, 0.01), 1);
        let two = [one[0], Term { q: 2, k: [&[0.0, 0.0, 1.0]; 3] }];
        let n = azimuths(&bands, &two, 0.01);
        assert!((20..60).contains(&n), "{n}");
    }
}
