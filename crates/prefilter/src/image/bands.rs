//! Number of bands that a filtered image needs: kernel tail × measured spectrum of the light.

use crate::Sampled;
use crate::light::sampled::MAX_ORDER;
use crate::order::{Energies, smallest_order};
use std::f64::consts::PI;

/// [`smallest_order`] of `light`. Errors are relative to the result of the kernel `whole`, of which `k` may
/// be a part, without the brightest texels: they fill little of the map.
pub(crate) fn order(light: &Sampled, k: &[f64], whole: &[f64], limit: f64) -> (usize, f64) {
    let bands = &light.base_bands()[..=light.order()];
    let result: f64 = whole.iter().zip(light.base_bands()).map(|(k, b)| k * k * b).sum();
    let kernel: Vec<f64> = k.iter().map(|k| k * k).collect();
    let whole = light.base_energy();
    smallest_order(&Energies { kernel: &kernel, bands, whole, flux2: 0.0, result }, limit)
}

/// Part of the tolerance allowed to the bright texels' bands that are left out.
pub(crate) const BRIGHT_TEXELS: f64 = 0.01;

/// Decides whether the bright texels go through the series of `k` as well: returns the order that this takes
/// and true where it costs less than summing them directly, else `f` and false. Errors are relative to the
/// result of the kernel `whole`.
pub(crate) fn with_bright_texels(
    light: &Sampled,
    k: &[f64],
    whole: &[f64],
    f: usize,
    texels: usize,
    tolerance: f64,
) -> (usize, bool) {
    let mut flux2 = 0.0;
    for c in 0..3 {
        flux2 += light.bright_texels().iter().map(|b| b.flux[c].abs()).sum::<f64>().powi(2);
    }
    if flux2 == 0.0 {
        return (f, true);
    }
    let result: f64 = light.base_bands().iter().zip(whole).map(|(b, k)| b * k * k).sum();
    // All bright texels in one place is the worst that they can be: flux² Σ_{l>F} (2l+1)/4π k_l².
    let allowed = (BRIGHT_TEXELS * tolerance).powi(2) * result;
    let mut left = 0.0;
    let mut needed = k.len();
    for l in (0..k.len()).rev() {
        left += flux2 * (2 * l + 1) as f64 / (4.0 * PI) * k[l] * k[l];
        if left > allowed {
            break;
        }
        needed = l;
    }
    let needed = needed.max(f);
    let more = cost::series(needed, texels) - cost::series(f, texels)
        + cost::coefficients(needed, light.bright_texels().len());
    if needed <= MAX_ORDER && more <= cost::values(light.bright_texels().len(), texels) {
        (needed, true)
    } else {
        (f, false)
    }
}

/// Rough costs in nanoseconds of one core, for choosing between ways; only their ratios count.
pub(crate) mod cost {
    use crate::SmallLight;
    use crate::kernel::split::Split;
    use crate::light::cell::nodes_for;
    use steradian_sphere::SphereImage;

    /// A synthesis up to `order` at so many texels: Legendre sums over a grid of 2F rows, its Fourier
    /// transforms, and the interpolation.
    pub(crate) fn series(order: usize, texels: usize) -> f64 {
        let n = order as f64 + 16.0;
        0.25 * n.powi(3) + 80.0 * n * n + 30.0 * texels as f64
    }

    /// The harmonics of so many directions.
    pub(crate) fn coefficients(order: usize, small_lights: usize) -> f64 {
        3.0 * small_lights as f64 * (order as f64).powi(2)
    }

    /// One kernel evaluation for each small light and texel.
    pub(crate) fn values(small_lights: usize, texels: usize) -> f64 {
        12.0 * (small_lights * texels) as f64
    }

    /// Kernel evaluations for the far part of the kernel at the nodes of each small light, for each texel.
    /// (When this term was missing, the sharpest sheen of a chain was filtered by near sums under 256 bright
    /// texels: a forest's Khronos files took 107 processor seconds, and take 9.)
    pub(crate) fn far_values(small_lights: &[SmallLight], split: &Split<'_>, texels: usize) -> f64 {
        let size = |b: &SmallLight| b.cell.map_or(0.0, |c| c.size());
        let widest = small_lights.iter().map(size).fold(0.0, f64::max);
        let nodes = nodes_for(widest / (0.25 * split.reach())) as f64;
        40.0 * nodes * nodes * (small_lights.len() * texels) as f64
    }

    /// Kernel evaluations of the direct sum over near texels, for `texels` texels of a map; texels of the
    /// image are `ratio` times as wide as the kernel.
    pub(crate) fn near(image: &SphereImage, split: &Split<'_>, ratio: f64, texels: usize) -> f64 {
        let rows = split.reach() / std::f64::consts::PI * image.height as f64;
        let near = 0.25 * split.reach2() * image.planes[0].len() as f64;
        let (nodes, core) = if ratio > 1.0 { (4.0, 8000.0) } else { (nodes_for(ratio) as f64, 0.0) };
        texels as f64 * (300.0 + core + nodes * nodes * (50.0 * 2.0 * rows + 2.2 * near))
    }
}
