//! Small bright lights apart from the image: suns, directional lights, and the brightest texels.

use super::cell::nodes_for;
use crate::Cell;
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::OnceLock;
use steradian_light::{DirectionalLight, DiskLight};
use steradian_sphere::Frame;
use steradian_sphere::quadrature::gauss_legendre;

type Rule = (Vec<f64>, Vec<f64>);

/// Most nodes of a [`rule`].
pub(crate) const MOST_NODES: usize = 64;

/// Gauss–Legendre rules of 1 … [`MOST_NODES`] nodes, cached.
pub(crate) fn rule(n: usize) -> &'static Rule {
    static RULES: [OnceLock<Rule>; MOST_NODES] = [const { OnceLock::new() }; MOST_NODES];
    let n = n.clamp(1, MOST_NODES);
    RULES[n - 1].get_or_init(|| gauss_legendre(n))
}

/// A disk of constant radiance, a direction where `radius` is 0, or a texel's cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmallLight {
    /// Unit direction towards its centre.
    pub direction: DVec3,
    /// Angular radius, radians; of a cell that of the disk of its solid angle.
    pub radius: f64,
    /// ∫ L dω, W m⁻².
    pub flux: [f64; 3],
    /// The texel whose cell it fills instead of a disk.
    pub cell: Option<Cell>,
}

impl From<&DiskLight> for SmallLight {
    fn from(d: &DiskLight) -> Self {
        let flux = d.radiance.map(|l| l * d.solid_angle());
        Self { direction: d.direction.normalize(), radius: d.angular_radius, flux, cell: None }
    }
}

impl From<&DirectionalLight> for SmallLight {
    fn from(d: &DirectionalLight) -> Self {
        Self { direction: d.direction.normalize(), radius: 0.0, flux: d.irradiance, cell: None }
    }
}

impl SmallLight {
    /// A disk as large as a texel of solid angle `omega`.
    pub fn texel(direction: DVec3, omega: f64, flux: [f64; 3]) -> Self {
        // omega = 2π(1 − cos ρ)
        Self { direction, radius: (1.0 - omega / (2.0 * PI)).clamp(-1.0, 1.0).acos(), flux, cell: None }
    }

    /// A texel.
    pub fn cell(cell: Cell, flux: [f64; 3]) -> Self {
        Self { cell: Some(cell), ..Self::texel(cell.centre(), cell.solid_angle(), flux) }
    }

    /// The mean over the disk or cell of `f`, which varies over angles of about `scale` there.
    pub fn mean<const C: usize>(&self, scale: f64, f: impl Fn(DVec3) -> [f64; C]) -> [f64; C] {
        if let Some(cell) = self.cell {
            // For sizes beyond those tabulated, the number of nodes grows in proportion.
            let ratio = cell.size() / scale;
            let n = nodes_for(ratio).max((3.0 * ratio).min(24.0) as usize);
            let mut sum = [0.0; C];
            cell.nodes(n, &mut |d, w| {
                let v = f(d);
                (0..C).for_each(|c| sum[c] += w * v[c]);
            });
            return sum;
        }
        let ratio = self.radius / scale;
        if ratio < 1.0 / 32.0 {
            return f(self.direction);
        }
        let rings = if ratio < 0.5 { 2 } else { (4.0 + 3.0 * ratio).min(24.0) as usize };
        let around = if ratio < 0.5 { 6 } else { 4 * rings };
        self.product(rings, around, f)
    }

    fn product<const C: usize>(
        &self,
        rings: usize,
        around: usize,
        f: impl Fn(DVec3) -> [f64; C],
    ) -> [f64; C] {
        let mut sum = [0.0; C];
        self.nodes(rings, around, |d, w| {
            let v = f(d);
            (0..C).for_each(|c| sum[c] += w * v[c]);
        });
        sum
    }

    /// Directions and weights (of sum 1) over the disk: Gauss–Legendre in the height 1 − cos θ, in which the
    /// area is uniform, and equal steps around. `rings` ≤ 64. Of a cell, `rings` nodes along each side.
    pub(crate) fn nodes(&self, rings: usize, around: usize, mut put: impl FnMut(DVec3, f64)) {
        if let Some(cell) = self.cell {
            return cell.nodes(rings, &mut put);
        }
        let frame = Frame::from_normal(self.direction);
        let s = (0.5 * self.radius).sin();
        let height = 2.0 * s * s;
        let (x, w) = rule(rings);
        for (k, (x, w)) in x.iter().zip(w).enumerate() {
            let h = 0.5 * (1.0 + x) * height;
            let r = (h * (2.0 - h)).max(0.0).sqrt();
            for i in 0..around {
                let phi = 2.0 * PI * (i as f64 + 0.5 * (k % 2) as f64) / around as f64;
                let (sin, cos) = phi.sin_cos();
                put(frame.to_world(DVec3::new(r * cos, r * sin, 1.0 - h)), 0.5 * w / around as f64);
            }
        }
    }

    /// Coefficients of the disk (not of a cell, which has no such factors) relative to those of its centre:
    /// b_l = (P_{l−1}(cos ρ) − P_{l+1}(cos ρ)) / ((2l+1)(1 − cos ρ)), 1 for a direction. ∫ of P_l over the
    /// cap, divided by the cap's area.
    pub fn spread(&self, order: usize) -> Vec<f64> {
        let s = (0.5 * self.radius).sin();
        let height = 2.0 * s * s;
        // The closed form cancels for small disks; there, with λ = l(l+1), b_l = 1 − λh/4 + λ(λ−2)h²/48 − …
        // (next term λ³h³/1152), from P_l(1−y) = 1 − λy/2 + λ(λ−2)y²/16 − …
        let small = height * (order * (order + 1)) as f64 <= 1e-3;
        let x = 1.0 - height;
        let (mut before, mut p) = (1.0, x);
        let mut b = vec![1.0];
        for l in 1..=order {
            let n = l as f64;
            let after = ((2.0 * n + 1.0) * x * p - n * before) / (n + 1.0);
            b.push(if small {
                let y = n * (n + 1.0) * height;
                1.0 - y / 4.0 + y * (y - 2.0 * height) / 48.0
            } else {
                (before - after) / ((2.0 * n + 1.0) * height)
            });
            (before, p) = (p, after);
        }
        b
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_sphere::sh;

    #[test]
    fn the_mean_over_a_disk_is_exact_for_low_bands() {
        let small_light = SmallLight {
            direction: DVec3::new(0.3, 0.7, -0.2).normalize(),
            radius: 0.4,
            flux: [1.0; 3],
            cell: None,
        };
        let b = small_light.spread(2);
        let mut centre = [0.0; 9];
        sh::eval(2, small_light.direction, &mut centre);
        let mean = small_light.mean(0.3, |d| {
            let mut y = [0.0; 9];
            sh::eval(2, d, &mut y);
            y
        });
        for l in 0..=2 {
            for k in l * l..(l + 1) * (l + 1) {
                assert!((mean[k] - b[l] * centre[k]).abs() < 1e-12, "{l}: {} {}", mean[k], b[l] * centre[k]);
            }
        }
    }

    #[test]
    fn the_spread_of_a_small_disk_joins_its_series() {
        let at =
            |radius| SmallLight { direction: DVec3::Y, radius, flux: [1.0; 3], cell: None }.spread(10)[10];
        // The switch is at radius²/2 · 110 = 1e-3.
        let (a, b) = (at(4.263e-3), at(4.265e-3));
        let slope = 0.25 * 110.0 * 4.264e-3 * 2e-6;
        assert!((a - b - slope).abs() < 1e-10 && a < 1.0, "{a} {b}");
    }
}
