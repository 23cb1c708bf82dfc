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
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
