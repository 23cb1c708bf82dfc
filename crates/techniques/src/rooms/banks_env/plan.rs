//! Number of slices, bands and texels that the tolerance needs.

use super::fibre::Fibre;
use std::f64::consts::FRAC_PI_2;
use steradian_parallel::prelude::*;
use steradian_prefilter::{Source, edge_cube, order};

/// Fewest slices over α = 0 … π/2, where the user gives no number: steps of 22.5°.
const MIN_SLICES: usize = 5;
/// Most slices, where the user gives no number: steps of 0.94°, and 148 MiB of cubes of [`MAX_SIZE`], 16
/// bytes a texel.
const MAX_SLICES: usize = 97;
/// Angles α at which kernels are sampled.
const SAMPLES: usize = 24;
/// Weight of views along the tangent.
const ALONG_TANGENT: f64 = 0.1;
/// Most intervals per cube edge, where the user gives no number.
const MAX_SIZE: usize = 128;
/// Shares of the tolerance: for bands left out, interpolation between slices, and interpolation between
/// texels. Their squares sum to a third, since certificates state more than the measured error.
const PARTS: [f64; 3] = [0.2, 0.35, 0.42];
/// Number of bands beyond the light's whose energy is estimated.
const BEYOND: usize = 64;

/// The size of a stack, and the errors to expect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Slices over α.
    pub slices: usize,
    /// Intervals per cube edge.
    pub size: usize,
    /// Highest band.
    pub order: usize,
    /// Variance of the Gaussian that widens kernels too sharp for the light's bands, radians²; else 0.
    pub blur: f64,
    /// Relative RMS error by the bands left out.
    pub tail: f64,
    /// Relative RMS error of linear interpolation between slices.
    pub between: f64,
    /// Relative RMS error of bilinear interpolation.
    pub bilinear: f64,
}

/// α of slice j.
pub fn alpha(j: usize, slices: usize) -> f64 {
    FRAC_PI_2 * j as f64 / (slices - 1) as f64
}

/// Kernels sampled over α with their second derivatives by α, as energies of each band.
struct Kernels {
    energy: Vec<f64>,
    bend: Vec<f64>,
}

impl Kernels {
    fn new(fibre: &Fibre, order: usize) -> Self {
        // A fifth of the kernel's width: second differences over it are off by about a hundredth.
        let step = (0.2 / fibre.n.max(1.0).sqrt()).min(0.5 * FRAC_PI_2 / SAMPLES as f64);
        let at = |i: usize| {
            let alpha = FRAC_PI_2 * (i as f64 + 0.5) / SAMPLES as f64;
            // Views are uniform over the sphere about the tangent, sin α dα; views along the tangent get a
            // small weight too.
            let w = (alpha.sin() + ALONG_TANGENT) / SAMPLES as f64;
            let [a, m, b] = [-step, 0.0, step].map(|d| fibre.coefficients(alpha + d, order));
            let bend = |l: usize| w * ((a[l] - 2.0 * m[l] + b[l]) / (step * step)).powi(2);
            let energy: Vec<f64> = m.iter().map(|k| w * k * k).collect();
            (energy, (0..=order).map(bend).collect::<Vec<f64>>())
        };
        let all: Vec<_> = (0..SAMPLES).into_par_iter().map(at).collect();
        let sum = |part: &dyn Fn(usize) -> f64| (0..SAMPLES).map(part).sum();
        Self {
            energy: (0..=order).map(|l| sum(&|i| all[i].0[l])).collect(),
            bend: (0..=order).map(|l| sum(&|i| all[i].1[l])).collect(),
        }
    }
}

fn product(kernel: &[f64], bands: &[f64]) -> f64 {
    kernel.iter().zip(bands).map(|(k, b)| k * b).sum()
}

fn relative(part: f64, all: f64) -> f64 {
    if all > 0.0 { (part / all).sqrt() } else { 0.0 }
}

impl Plan {
    /// Plans the stack for a light and a fibre; `slices` or `size` of 0 are chosen.
    pub fn new(source: &Source, fibre: &Fibre, slices: usize, size: usize, tolerance: f64) -> Self {
        let top = source.order();
        let Kernels { energy, bend } = Kernels::new(fibre, top + BEYOND);
        // A line over the spacing h misses ½ x(h − x) G″, mean square h⁴/120 G″².
        let curvature =
            relative(product(&bend, &source.bands), product(&energy, &source.bands)) / 120.0_f64.sqrt();
        let needed = (FRAC_PI_2 * (curvature / (PARTS[1] * tolerance)).sqrt()).ceil() as usize + 1;
        let slices = if slices > 0 { slices } else { needed.clamp(MIN_SLICES, MAX_SLICES) };
        let between = curvature * alpha(1, slices).powi(2);
        let flux2: f64 = source.small_lights.iter().flat_map(|b| b.flux).map(|f| f * f).sum();
        let (order, tail) = order::of_source(source, &energy, flux2, PARTS[0] * tolerance);
        let blur =
            if tail > tolerance { -2.0 * tolerance.ln() / (top * (top + 1)).max(1) as f64 } else { 0.0 };
        let (size, bilinear) = resolution(source, &energy, size, PARTS[2] * tolerance);
        Self { slices, size, order, blur, tail, between, bilinear }
    }

    /// Factor of band l for kernels too sharp for the light's bands.
    pub fn window(&self, l: usize) -> f64 {
        (-0.5 * self.blur * (l * (l + 1)) as f64).exp()
    }
}

/// Intervals per cube edge, and the error of lookups between them.
fn resolution(source: &Source, energy: &[f64], size: usize, limit: f64) -> (usize, f64) {
    let waves: Vec<f64> = energy.iter().zip(&source.bands).map(|(k, b)| k * b).collect();
    let error = |size: usize| edge_cube::lookup_error(&waves, size);
    if size > 0 {
        return (size, error(size));
    }
    let sizes = [4, 6, 8, 12, 16, 24, 32, 48, 64, 96, MAX_SIZE];
    let chosen = sizes.into_iter().find(|s| error(*s) <= limit).unwrap_or(MAX_SIZE);
    (chosen, error(chosen))
}
