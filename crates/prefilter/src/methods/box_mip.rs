//! Box-filtered mip levels of a cube map, each face on its own: what `texCUBEbias` reads.
//!
//! Kautz, course notes (2006), *Dynamic glossy environment maps*: "why not just use an inexpensive box-filter
//! and store a mip-mapped cube map", with Phong's N = 225 beside a bias of 2.25. Levels are means of two by
//! two texels without their solid angles; lookup is trilinear and stays on its face, so that edges show
//! ("cube faces are filtered independently").
//!
//! Matched width: a lookup is a box of side b convolved with the tent of bilinear interpolation, of variance
//! b²/12 + b²/6 = b²/4 along each axis. A Gaussian lobe of standard deviation σ has σ² (Phong's cos^s has
//! 1/s), so b = 2σ and the level is log2(2σ/b_0), b_0 = √(4π/6)/N. For other kernels σ is that of the
//! Gaussian with the same ∫K²/(∫K)² = 1/(4πσ²), which heavy tails do not carry away.

use super::grid::each;
use super::{Card, Cost, Made, Shape};
use crate::kernel::zonal::quadrature;
use crate::{Sampled, Zonal};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_sphere::{Layout, SphereImage};

pub(super) const CARD: Card = Card {
    name: "box-mip",
    source: "Kautz, course notes, 2006",
    equation: "trilinear lookup at level log2(2σ N/√(4π/6)) of 2 × 2 means, face by face",
    exact_when: "never: a box is not the lobe, and faces do not know each other",
};

/// The standard deviation of the Gaussian that is as concentrated as the kernel, radians.
pub fn effective_sigma(kernel: &dyn Zonal) -> f64 {
    let integral =
        |power: i32| quadrature(|x| kernel.value(x).powi(power), kernel.width(), kernel.support(), 0)[0];
    integral(1) / (4.0 * PI * integral(2)).sqrt()
}

/// A cube map and its box-filtered levels.
pub struct BoxMip {
    levels: Vec<SphereImage>,
}

impl BoxMip {
    /// The size that keeps the texels of the light.
    pub fn base(light: &Sampled) -> usize {
        (light.image.height / 2).next_power_of_two().clamp(4, 1024)
    }

    /// The light on a cube of `n` texels a side (a power of two), and its levels down to one texel.
    pub fn new(light: &Sampled, n: usize) -> Self {
        let mut levels = vec![light.mirror(Layout::Cube, n, n)];
        while let Some(next) = levels.last().filter(|l| l.width > 1).map(halved) {
            levels.push(next);
        }
        Self { levels }
    }

    /// The level whose lookup is as wide as a Gaussian of standard deviation `sigma`, radians.
    pub fn level(&self, sigma: f64) -> f64 {
        let texel = (4.0 * PI / 6.0).sqrt() / self.levels[0].width as f64;
        (2.0 * sigma / texel).log2().clamp(0.0, (self.levels.len() - 1) as f64)
    }

    /// Trilinear lookup, each face on its own.
    pub fn lookup(&self, d: DVec3, level: f64) -> [f64; 3] {
        let level = level.clamp(0.0, (self.levels.len() - 1) as f64);
        let (k, t) = (level as usize, level.fract());
        let fine = bilinear(&self.levels[k], d);
        let Some(coarse) = self.levels.get(k + 1).filter(|_| t > 0.0) else { return fine };
        let coarse = bilinear(coarse, d);
        std::array::from_fn(|c| fine[c] + (coarse[c] - fine[c]) * t)
    }

    /// Lookups at one level, scaled by the kernel's integral.
    pub fn filter(
        &self,
        kernel: &dyn Zonal,
        shape: Shape,
        level: f64,
        task: &Task,
    ) -> Result<Made, Cancelled> {
        let k0 = kernel.coefficients(0)[0];
        let mut made = each(shape, "looking levels up", task, |d| {
            (self.lookup(d, level).map(|v| k0 * v), Cost { kernel: 0, taps: 8 })
        })?;
        made.cost.taps += self.levels.iter().map(|l| l.planes[0].len() as u64).sum::<u64>();
        Ok(made)
    }
}

/// Means of two by two.
fn halved(image: &SphereImage) -> SphereImage {
    let n = image.width / 2;
    let mut out = SphereImage::new(Layout::Cube, n, n);
    for (plane, to) in image.planes.iter().zip(&mut out.planes) {
        for (k, v) in to.iter_mut().enumerate() {
            let at = 2 * (k / n) * image.width + 2 * (k % n);
            *v = 0.25 * (plane[at] + plane[at + 1] + plane[at + image.width] + plane[at + image.width + 1]);
        }
    }
    out
}

fn bilinear(image: &SphereImage, d: DVec3) -> [f64; 3] {
    let n = image.width;
    let at = Layout::Cube.position(n, n, d);
    let axis = |x: f64| {
        let x = (x - 0.5).clamp(0.0, (n - 1) as f64);
        let i = x as usize;
        (i, (i + 1).min(n - 1), x - i as f64)
    };
    let ((i, i1, u), (j, j1, v)) = (axis(at.x), axis(at.y));
    let texel = |i, j| image.texel(at.face, i, j).map(f64::from);
    let (a, b, c, e) = (texel(i, j), texel(i1, j), texel(i, j1), texel(i1, j1));
    std::array::from_fn(|k| {
        let (top, bottom) = (a[k] + (b[k] - a[k]) * u, c[k] + (e[k] - c[k]) * u);
        top + (bottom - top) * v
    })
}
