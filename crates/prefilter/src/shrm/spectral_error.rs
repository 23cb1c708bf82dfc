//! Mean square of the radiance of a kernel's rows k_lq under a light, and so the error of approximate rows.
//!
//! Over all frames about a centre C, L'_lq has the mean square Σ_m L_lm²/(2l + 1) whatever q (Schur
//! orthogonality of the rotations D^l), and different (l, q) do not correlate. With B = Σ_q a_q(φ_o) Σ_l
//! k_l|q| L'_lq and the mean of a_q² over φ_o equal to 1,
//!
//! mean |B|² = Σ_l (Σ_m L_lm²)/(2l + 1) Σ_q k_l|q|², q and −q both counted,
//!
//! exactly; and the mean square error of other rows is the same sum of the rows' difference. Ramamoorthi &
//! Hanrahan (2002) bound the error by one band (5.19); the sum above corrects that bound: energies are
//! weighted with Λ_l² = 4π/(2l + 1), truncation in p or q counts, and it is a mean over directions, not a
//! bound at each.

use super::resolution::linear;
use crate::Apart;
use std::f64::consts::PI;
use steradian_brdf::central::Slices;
use steradian_sphere::sh::ShRgb;

/// The light as the mean squares of its turned coefficients.
#[derive(Debug, Clone)]
pub struct SpectralError {
    mean: [Vec<f64>; 3],
    /// Largest mean square at or beyond each band, over the bands of the spectrum.
    beyond: [Vec<f64>; 3],
    /// Mean square at every band beyond the spectrum.
    far: [f64; 3],
}

impl SpectralError {
    /// The errors of rows under a light with the mean square `far` of L'_lq per channel at every band beyond
    /// the spectrum's.
    pub fn new(light: &ShRgb, far: [f64; 3]) -> Self {
        let mean = light.mean_squares();
        let beyond = mean.each_ref().map(|m| {
            let mut sup = m.clone();
            for l in (1..sup.len()).rev() {
                sup[l - 1] = sup[l - 1].max(sup[l]);
            }
            sup
        });
        Self { mean, beyond, far }
    }

    /// The errors of rows under the light that is left when suns are apart.
    pub fn of(light: &Apart) -> Self {
        Self::new(&light.rest, light.beyond)
    }

    /// Mean square of L'_lq in channel `c`.
    #[inline]
    pub fn mean(&self, c: usize, l: usize) -> f64 {
        self.mean[c].get(l).copied().unwrap_or(self.far[c])
    }

    /// Mean square of Σ_l k_l L'_lq a_q of ±q together.
    pub fn row(&self, c: usize, q: usize, k: impl Iterator<Item = f64>) -> f64 {
        let both = if q == 0 { 1.0 } else { 2.0 };
        both * k.enumerate().map(|(l, k)| self.mean(c, l) * k * k).sum::<f64>()
    }

    /// Estimated squared error of a slice from the energy beyond its orders F and Q: that energy times the
    /// light's largest mean square there. The energy beyond Q is estimated ([`Slices::beyond_azimuth`]), and
    /// so is that beyond the light's own bands.
    pub fn tail(&self, s: &Slices, slice: usize) -> f64 {
        let captured = s.captured(slice, s.order, s.azimuth);
        let known = self.mean[0].len().saturating_sub(1).max(1);
        // The band as far below F, as a ratio, as the light's last band is above it.
        let before = s.captured(slice, s.order * s.order / known, s.azimuth);
        let channel = |c: usize| {
            // Energy below the accuracy of the quadrature counts as 0.
            let noise = s.energy[slice][c] * (4.0 * s.accuracy * s.accuracy).max(1e-9);
            let rest = (s.energy[slice][c] - captured[c] - noise).max(0.0);
            let turns = s.beyond_azimuth(slice, c).min(rest);
            let rest = rest - turns;
            let sup = self.beyond[c].get(s.order + 1).copied();
            let beyond = match sup {
                None => rest * self.far[c],
                Some(sup) => {
                    // Energy beyond the light's bands: exact if energies follow a power law, too large for
                    // lobes that end sooner.
                    let far = rest * rest / (rest + captured[c] - before[c]).max(f64::MIN_POSITIVE);
                    (rest - far) * sup + far * self.far[c].max(sup)
                }
            };
            turns * self.around(c, s, slice) + beyond
        };
        (0..3).map(channel).sum()
    }

    /// The light's mean square, weighted by the energy of the row of Q in each band. Rows beyond Q have their
    /// energy at higher bands still.
    fn around(&self, c: usize, s: &Slices, slice: usize) -> f64 {
        let row = s.row(slice, s.azimuth)[c];
        let (mut energy, mut seen) = (f64::MIN_POSITIVE, 0.0);
        for (l, k) in row.iter().enumerate() {
            energy += k * k;
            seen += k * k * self.mean(c, l);
        }
        seen / energy
    }

    /// Mean square of the radiance of a slice, all channels, with its tail.
    pub fn slice(&self, s: &Slices, slice: usize) -> f64 {
        let rows = (0..=s.azimuth).map(|q| {
            let row = s.row(slice, q);
            (0..3).map(|c| self.row(c, q, row[c].iter().copied())).sum::<f64>()
        });
        rows.sum::<f64>() + self.tail(s, slice)
    }
}

/// Mean square error of linear interpolation between samples `h` apart of a wave of band l and amplitude 1,
/// whose frequency is √(l(l + 1)); at most 1, the error of no lookup at all.
pub fn lookup(l: usize, h: f64) -> f64 {
    let x = h * ((l * (l + 1)) as f64).sqrt();
    if x > PI { 1.0 } else { linear(x).clamp(0.0, 1.0) }
}

/// The first size of 4, 6, 8, 12, 16, … 2^k, 3·2^(k−1) up to `most` for which `enough` holds, else the
/// largest.
pub fn size(most: usize, enough: impl Fn(usize) -> bool) -> usize {
    let sizes = (2..).flat_map(|k| [1usize << k, 3 << (k - 1)]).take_while(|s| *s <= most.max(4));
    let mut last = 4;
    for s in sizes {
        last = s;
        if enough(s) {
            break;
        }
    }
    last
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_lost_grows_with_the_band_up_to_all() {
        assert_eq!(lookup(0, 0.1), 0.0);
        let rise = (1..200).map(|l| lookup(l, 0.05));
        assert!(rise.clone().zip(rise.skip(1)).all(|(a, b)| a <= b));
        assert_eq!(lookup(200, 0.05), 1.0);
    }

    #[test]
    fn sizes_grow_by_halves() {
        assert_eq!(size(100, |s| s >= 20), 24);
        assert_eq!(size(100, |_| false), 96);
        assert_eq!(size(1, |_| true), 4);
    }
}
