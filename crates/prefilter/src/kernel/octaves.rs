//! A kernel of any shape in cells of s² = sin²(θ/2) that are equal parts of octaves, a cubic in each.

use steradian_simd::{Arch, Kernel, run};

/// Below this s² (θ = 1e-6) a kernel has its value on the axis.
const AXIS: f32 = 1.0 / (1_u64 << 42) as f32;
/// From here on it is zero: θ = π/2.
const HORIZON: f32 = 0.5;
/// Bits of a mantissa.
const MANTISSA: u32 = f32::MANTISSA_DIGITS - 1;
/// Binary logarithms of the fewest and the most cells of an octave. The table of 41 octaves, 16 bytes a cell,
/// has 20.5 KiB with 32 cells and stays in the nearest cache; with 256 it has 164 KiB, which the second still
/// holds.
const MIN_POWER: u32 = 5;
const MAX_POWER: u32 = 8;
/// Allowed difference of a cubic from its kernel, relative to the value …
const CLOSE: f64 = 4e-7;
/// … plus relative to the peak.
const FINE: f64 = 1e-9;

/// The table.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Octaves {
    /// Exponent of the number of cells of an octave.
    power: u32,
    /// Cubics; not a number where none is close.
    cubics: Vec<[f32; 4]>,
}

impl Octaves {
    /// The table of `f`(s²), 0 ≤ s² < ½, whose largest magnitude is `peak`. An octave is divided until few
    /// cells are left that no cubic fits.
    pub(crate) fn new(f: impl Fn(f64) -> f64, peak: f64) -> Self {
        for power in MIN_POWER.. {
            let cubics = Self::cubics(&f, peak, power);
            let rough = cubics.iter().filter(|c| c[0].is_nan()).count();
            if 64 * rough <= cubics.len() || power == MAX_POWER {
                return Self { power, cubics };
            }
        }
        Self::default()
    }

    fn cubics(f: &impl Fn(f64) -> f64, peak: f64, power: u32) -> Vec<[f32; 4]> {
        let shift = MANTISSA - power;
        let cells = AXIS.to_bits() >> shift..HORIZON.to_bits() >> shift;
        let cell = |k: u32| {
            let (a, b) = (f64::from(f32::from_bits(k << shift)), f64::from(f32::from_bits((k + 1) << shift)));
            cubic(&|t| f(a + (b - a) * t), peak)
        };
        cells.map(cell).collect()
    }

    /// The kernel at many s²: `exact` where no cubic is close.
    pub(crate) fn fill(&self, s2: &[f32], out: &mut [f32], exact: impl Fn(f32) -> f32) {
        run(Lookup { cells: self, s2, out: &mut *out });
        for (k, &s2) in out.iter_mut().zip(s2) {
            if k.is_nan() {
                *k = exact(s2);
            }
        }
    }
}

/// The cubic through four Chebyshev points of 0 … 1; NaN where it does not fit.
fn cubic(f: &dyn Fn(f64) -> f64, peak: f64) -> [f32; 4] {
    let node = |k: usize| 0.5 - 0.5 * (std::f64::consts::PI * (2 * k + 1) as f64 / 8.0).cos();
    let x: [f64; 4] = std::array::from_fn(node);
    let mut d = x.map(f);
    let largest = d.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    // Newton's divided differences, then by powers of t.
    for order in 1..4 {
        for k in (order..4).rev() {
            d[k] = (d[k] - d[k - 1]) / (x[k] - x[k - order]);
        }
    }
    let mut c = [d[3], 0.0, 0.0, 0.0];
    for k in (0..3).rev() {
        for p in (1..4).rev() {
            c[p] = c[p - 1] - x[k] * c[p];
        }
        c[0] = d[k] - x[k] * c[0];
    }
    let c = c.map(|c| c as f32);
    let at = |t: f64| c.iter().rev().fold(0.0, |sum, &c| sum * t + f64::from(c));
    let close = |t: f64| (at(t) - f(t)).abs() <= CLOSE * largest + FINE * peak;
    if [0.0, 0.5, 0.999_999].into_iter().all(close) { c } else { [f32::NAN; 4] }
}

struct Lookup<'a> {
    cells: &'a Octaves,
    s2: &'a [f32],
    out: &'a mut [f32],
}

impl Kernel for Lookup<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let cubics = self.cells.cubics.as_slice();
        let power = self.cells.power;
        let shift = MANTISSA - power;
        let first = (AXIS.to_bits() >> shift) as usize;
        let Some(last) = cubics.len().checked_sub(1) else { return };
        for k in 0..self.out.len().min(self.s2.len()) {
            let s2 = self.s2[k].max(AXIS);
            let bits = s2.to_bits();
            let cell = ((bits >> shift) as usize - first).min(last);
            // The low digits of the mantissa as a number in 0 … 1.
            let one = 1.0_f32.to_bits();
            let t = f32::from_bits(((bits << power) & ((1 << MANTISSA) - 1)) | one) - 1.0;
            let [c0, c1, c2, c3] = cubics[cell];
            let value = ((c3 * t + c2) * t + c1) * t + c0;
            self.out[k] = if s2 < HORIZON { value } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_functions_and_steps_come_back() {
        // Steep, with a step inside a cell, and zero beyond.
        let f = |s2: f64| {
            let smooth = 1e4 / (1.0 + 1e5 * s2).powi(2) + (-40.0 * s2).exp();
            if s2 < 0.2 { smooth } else { 3.0 * (0.5 - s2).max(0.0) }
        };
        let cells = Octaves::new(f, 1e4);
        let s2: Vec<f32> = (0..20_000).map(|k| (k as f32 / 20_000.0).powi(6)).collect();
        let mut out = vec![0.0; s2.len()];
        cells.fill(&s2, &mut out, |s2| f(f64::from(s2)) as f32);
        for (&s2, &got) in s2.iter().zip(&out) {
            let exact = if s2 < HORIZON { f(f64::from(s2)) } else { 0.0 };
            assert!((f64::from(got) - exact).abs() < 1e-6 * exact + 2e-5, "{s2}: {got} {exact}");
        }
        let rough = cells.cubics.iter().filter(|c| c[0].is_nan()).count();
        assert!(rough > 0 && 64 * rough <= cells.cubics.len(), "{rough} of {}", cells.cubics.len());
    }
}
