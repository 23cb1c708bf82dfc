//! Windows: factors per band that trade sharpness for less ringing.

use super::ShRgb;
use std::f64::consts::PI;

/// A window over bands; `width` is the band (not necessarily whole) where it ends or has fallen to its mark.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Window {
    /// No window: all ones.
    Box,
    /// (1 + cos(πl/width))/2 up to `width`, 0 beyond (Hann's window).
    Hanning {
        /// First band that is zero.
        width: f64,
    },
    /// sin(πl/width)/(πl/width) up to `width`, 0 beyond.
    Lanczos {
        /// First band that is zero.
        width: f64,
    },
    /// exp(−(l/width)²/2).
    Gauss {
        /// Standard deviation in bands.
        width: f64,
    },
}

impl Window {
    /// The factor of band l: 1 at l = 0.
    pub fn factor(self, l: usize) -> f64 {
        let l = l as f64;
        match self {
            Self::Box => 1.0,
            _ if l == 0.0 => 1.0,
            Self::Hanning { width } | Self::Lanczos { width } if l >= width => 0.0,
            Self::Hanning { width } => 0.5 * (1.0 + (PI * l / width).cos()),
            Self::Lanczos { width } => (PI * l / width).sin() / (PI * l / width),
            Self::Gauss { width } => (-0.5 * (l / width) * (l / width)).exp(),
        }
    }

    /// The factors of bands 0…order.
    pub fn factors(self, order: usize) -> Vec<f64> {
        (0..=order).map(|l| self.factor(l)).collect()
    }
}

impl ShRgb {
    /// Multiplies each band by its window factor.
    pub fn window(&mut self, window: Window) {
        let factors = window.factors(self.order);
        self.convolve(&factors);
    }

    /// Σ over bands of l²(l+1)² |c_lm|²: ∫ (Δf)², the curvature that ringing adds (Sloan 2008, "Stupid
    /// spherical harmonics tricks", "Windowing"), per channel.
    pub fn curvature(&self) -> [f64; 3] {
        self.c.each_ref().map(|c| {
            (0..=self.order)
                .map(|l| {
                    let k = (l * (l + 1)) as f64;
                    k * k * c[l * l..(l + 1) * (l + 1)].iter().map(|c| c * c).sum::<f64>()
                })
                .sum()
        })
    }

    /// Damps bands by 1/(1 + λ l²(l+1)²), the minimiser of ∫(f − f₀)² + λ∫(Δf)² (Sloan 2008, "Stupid
    /// spherical harmonics tricks"), with the smallest λ whose result is nowhere below −`floor` times its
    /// mean on 1000 evenly spread directions, channel by channel. Returns the λ used (0 where nothing was
    /// to do). A function whose mean is not positive stays as it is.
    pub fn dering(&mut self, floor: f64) -> [f64; 3] {
        let rule = crate::quadrature::fibonacci(1000.max(8 * super::count(self.order)));
        let basis = super::Basis::new(self.order);
        let bands = self.order + 1;
        // Value of each band at each direction.
        let mut values = self.c.each_ref().map(|_| Vec::with_capacity(rule.len() * bands));
        let mut y = vec![0.0; super::count(self.order)];
        for d in &rule.directions {
            basis.eval(self.order, *d, &mut y);
            for (values, c) in values.iter_mut().zip(&self.c) {
                values.extend((0..bands).map(|l| {
                    let band = l * l..(l + 1) * (l + 1);
                    c[band.clone()].iter().zip(&y[band]).map(|(a, b)| a * b).sum::<f64>()
                }));
            }
        }
        let mut used = [0.0; 3];
        for ((c, used), values) in self.c.iter_mut().zip(&mut used).zip(&values) {
            let mean = c[0] / (4.0 * PI).sqrt();
            let bad = |lambda: f64| lowest(values, bands, lambda) < -floor * mean - 1e-12 * mean.abs();
            if mean <= 0.0 || !bad(0.0) {
                continue;
            }
            // Bisection over log λ; at λ = 1e6 only the mean is left.
            let (mut low, mut high) = (1e-12_f64.ln(), 1e6_f64.ln());
            for _ in 0..30 {
                let middle = 0.5 * (low + high);
                if bad(middle.exp()) { low = middle } else { high = middle }
            }
            *used = high.exp();
            for l in 1..=self.order {
                let k = damping(l, *used);
                c[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|c| *c *= k);
            }
        }
        used
    }
}

/// The smallest Σ_l damping·band over directions; `values` holds `bands` per direction.
fn lowest(values: &[f64], bands: usize, lambda: f64) -> f64 {
    let factors: Vec<f64> = (0..bands).map(|l| damping(l, lambda)).collect();
    let sums = values.chunks_exact(bands).map(|v| v.iter().zip(&factors).map(|(v, k)| v * k).sum::<f64>());
    sums.fold(f64::INFINITY, f64::min)
}

/// 1/(1 + λ l²(l+1)²).
fn damping(l: usize, lambda: f64) -> f64 {
    let k = (l * (l + 1)) as f64;
    1.0 / (1.0 + lambda * k * k)
}

#[cfg(test)]
mod tests {
    use super::super::zonal;
    use super::*;
    use glam::DVec3;

    #[test]
    fn windows_start_at_one_and_end_where_they_say() {
        for w in [Window::Hanning { width: 5.0 }, Window::Lanczos { width: 5.0 }] {
            let f = w.factors(6);
            assert_eq!((f[0], f[5], f[6]), (1.0, 0.0, 0.0));
            assert!(f.is_sorted_by(|a, b| a >= b));
        }
        assert!((Window::Hanning { width: 4.0 }.factor(2) - 0.5).abs() < 1e-15);
        assert!((Window::Lanczos { width: 4.0 }.factor(2) - 2.0 / PI).abs() < 1e-15);
        assert!((Window::Gauss { width: 2.0 }.factor(2) - (-0.5_f64).exp()).abs() < 1e-15);
        assert_eq!(Window::Box.factor(100), 1.0);
    }

    #[test]
    fn dering_makes_a_lone_sun_non_negative() {
        let mut sh = ShRgb::zero(4);
        sh.add_lobe(&zonal::disk(4, 0.05), DVec3::new(0.3, 0.8, 0.1).normalize(), [1.0, 2.0, 0.0]);
        let before = sh.clone();
        let lambda = sh.dering(0.0);
        assert!(lambda[0] > 0.0 && (lambda[0] / lambda[1] - 1.0).abs() < 1e-6 && lambda[2] == 0.0);
        for d in crate::quadrature::fibonacci(500).directions {
            assert!(sh.value(d)[0] > -1e-4 * before.value(d)[0].abs().max(1e-3));
        }
        assert_eq!(sh.c[0][0], before.c[0][0]);
        assert!(sh.curvature()[0] < before.curvature()[0]);
        assert_eq!(sh.clone().dering(0.0), [0.0; 3]);
    }
}
