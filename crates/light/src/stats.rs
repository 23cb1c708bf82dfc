//! What an environment holds, for `inspect`: range, energy, where the light is, how much of it is sharp.

use steradian_sphere::glam::DVec3;
use steradian_sphere::sh::{ShRgb, project};
use steradian_sphere::{Layout, SphereImage};

/// Highest band of the spectrum.
const ORDER: usize = 8;

/// Statistics of an image on the sphere.
#[derive(Debug, Clone, PartialEq)]
pub struct Stats {
    /// Smallest sample per channel, over texels with a solid angle.
    pub min: [f32; 3],
    /// Largest sample per channel.
    pub max: [f32; 3],
    /// Mean radiance over the sphere per channel: ∫ L dω / 4π.
    pub mean: [f64; 3],
    /// ∫ L dω per channel, W m⁻² of all directions together.
    pub integral: [f64; 3],
    /// Negative samples, over texels with a solid angle.
    pub negative_count: u64,
    /// Direction of the centre of the texel of highest luminance.
    pub brightest: DVec3,
    /// Its radiance.
    pub brightest_radiance: [f32; 3],
    /// (fraction of the sphere, part of ∫ luminance dω in the brightest such fraction).
    pub concentration: Vec<(f64, f64)>,
    /// Luminance-weighted mean direction; its length is 0 for even light and 1 for a point.
    pub mean_direction: DVec3,
    /// Energy of the bands 0 …: Σ_m c_lm², of luminance.
    pub spectrum: Vec<f64>,
    /// Coefficients up to order 2, for the irradiance.
    pub sh: ShRgb,
    /// What to do with such an environment, one line each.
    pub advice: Vec<String>,
}

/// Luminance of linear Rec. 709.
fn luminance(v: [f32; 3]) -> f64 {
    0.2126 * f64::from(v[0]) + 0.7152 * f64::from(v[1]) + 0.0722 * f64::from(v[2])
}

/// One pass over the texels.
struct Scan {
    min: [f32; 3],
    max: [f32; 3],
    negative: u64,
    integral: [f64; 3],
    brightest: (f64, DVec3, [f32; 3]),
    moment: DVec3,
}

/// Edges of logarithmic bins of luminance: 16 per octave over 2⁻⁶⁴ … 2⁶⁴.
const BINS: usize = 2048;

fn bin(l: f64) -> usize {
    if l <= 0.0 { 0 } else { (16.0 * (l.log2() + 64.0)).clamp(0.0, (BINS - 1) as f64) as usize }
}

impl Stats {
    /// The statistics of an image in any layout. Besides the image they take a few megabytes at most.
    pub fn of(image: &SphereImage) -> Self {
        let mut scan = Scan {
            min: [f32::INFINITY; 3],
            max: [f32::NEG_INFINITY; 3],
            negative: 0,
            integral: [0.0; 3],
            brightest: (f64::NEG_INFINITY, DVec3::Y, [0.0; 3]),
            moment: DVec3::ZERO,
        };
        // Solid angle and energy per bin of luminance.
        let mut bins = vec![(0.0f64, 0.0f64); BINS];
        for face in 0..image.layout.faces() {
            for j in 0..image.height {
                scan.row(image, face, j, &mut bins);
            }
        }
        let spectrum_of = project(image, ORDER);
        let spectrum = band_energies(&spectrum_of);
        let mut sh = ShRgb::zero(2);
        for (to, from) in sh.c.iter_mut().zip(&spectrum_of.c) {
            to.copy_from_slice(&from[..9]);
        }
        let energy: f64 = bins.iter().map(|b| b.1).sum();
        let mut out = Self {
            min: scan.min,
            max: scan.max,
            mean: scan.integral.map(|v| v / (4.0 * std::f64::consts::PI)),
            integral: scan.integral,
            negative_count: scan.negative,
            brightest: scan.brightest.1,
            brightest_radiance: scan.brightest.2,
            concentration: [1e-4, 1e-3, 1e-2, 0.1].map(|f| (f, concentration(&bins, f, energy))).to_vec(),
            mean_direction: if energy > 0.0 { scan.moment / energy } else { DVec3::ZERO },
            spectrum,
            sh,
            advice: Vec::new(),
        };
        out.advice = out.advise(image);
        out
    }

    fn advise(&self, image: &SphereImage) -> Vec<String> {
        let mut out = Vec::new();
        let sun = self.concentration[0].1;
        if sun > 0.2 {
            out.push(format!(
                "{:.0} % of the energy comes from 0.01 % of the sphere: low orders ring and samples are noisy; take the sun out as a disk light",
                100.0 * sun
            ));
        }
        let energy: f64 = self.spectrum.iter().sum();
        let low: f64 = self.spectrum[..3].iter().sum();
        if energy > 0.0 && low > 0.99 * energy {
            out.push("nearly all energy lies in bands 0 to 2: nine coefficients describe this light".into());
        }
        if self.negative_count > 0 {
            out.push(format!("{} negative samples: `negative` zero removes them", self.negative_count));
        }
        let peak = self.max.iter().copied().fold(0.0f32, f32::max);
        if peak > 65504.0 {
            out.push("the peak is beyond 65504: half floats clip it, keep 32 bits".into());
        } else if peak <= 1.0 {
            out.push("no sample is above 1: probably clipped, lights will look flat".into());
        }
        if image.layout == Layout::LatLong && image.width != 2 * image.height {
            out.push("the image is not 2:1: its texels are not square on the sphere".into());
        }
        out
    }
}

impl Scan {
    fn row(&mut self, image: &SphereImage, face: usize, j: usize, bins: &mut [(f64, f64)]) {
        let omega = image.row_solid_angles(face, j);
        for (i, &omega) in omega.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            let v = image.texel(face, i, j);
            for c in 0..3 {
                self.min[c] = self.min[c].min(v[c]);
                self.max[c] = self.max[c].max(v[c]);
                self.negative += u64::from(v[c] < 0.0);
                self.integral[c] += omega * f64::from(v[c]);
            }
            let l = luminance(v);
            let d = image.layout.texel_direction(image.width, image.height, face, i, j).unwrap_or(DVec3::Y);
            if l > self.brightest.0 {
                self.brightest = (l, d, v);
            }
            let energy = omega * l.max(0.0);
            self.moment += d * energy;
            let b = &mut bins[bin(l)];
            *b = (b.0 + omega, b.1 + energy);
        }
    }
}

/// Part of the energy in the brightest `fraction` of the sphere; a bin's energy is shared evenly over its
/// solid angle (within 4 %, the width of a bin).
fn concentration(bins: &[(f64, f64)], fraction: f64, energy: f64) -> f64 {
    let mut left = fraction * 4.0 * std::f64::consts::PI;
    let mut sum = 0.0;
    for &(omega, e) in bins.iter().rev().filter(|b| b.0 > 0.0) {
        let share = (left / omega).clamp(0.0, 1.0);
        sum += share * e;
        left -= share * omega;
    }
    if energy > 0.0 { sum / energy } else { 0.0 }
}

/// Σ_m c_lm² of luminance per band.
fn band_energies(sh: &ShRgb) -> Vec<f64> {
    let y = |k: usize| 0.2126 * sh.c[0][k] + 0.7152 * sh.c[1][k] + 0.0722 * sh.c[2][k];
    (0..=sh.order).map(|l| (l * l..(l + 1) * (l + 1)).map(|k| y(k).powi(2)).sum()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn even_light() {
        for layout in Layout::ALL {
            let s = Stats::of(&SphereImage::from_fn(layout, 64, 32, |_| [2.0; 3]));
            assert!((s.mean[1] - 2.0).abs() < 1e-9 && (s.integral[0] - 8.0 * PI).abs() < 1e-8, "{layout:?}");
            assert!((s.concentration[2].1 - 0.01).abs() < 1e-6, "{layout:?} {:?}", s.concentration);
            assert!(s.mean_direction.length() < 1e-2, "{layout:?} {}", s.mean_direction);
            assert!((s.spectrum[0] / (16.0 * PI) - 1.0).abs() < 1e-6, "{layout:?} {:?}", s.spectrum);
            assert_eq!((s.min, s.max, s.negative_count), ([2.0; 3], [2.0; 3], 0));
        }
    }

    #[test]
    fn a_sun_is_found() {
        let mut image = SphereImage::from_fn(Layout::LatLong, 128, 64, |_| [1.0, 1.0, -1.0]);
        let d = DVec3::new(0.6, 0.64, 0.48);
        let (face, i, j) = image.texel_of(d);
        let k = image.index(face, i, j);
        image.planes.iter_mut().for_each(|p| p[k] = 1e6);
        let s = Stats::of(&image);
        assert!(s.brightest.dot(d) > 0.998 && s.brightest_radiance == [1e6; 3]);
        assert!(s.concentration[1].1 > 0.99 && s.mean_direction.normalize().dot(d) > 0.99);
        assert_eq!(s.negative_count, 128 * 64 - 1);
        assert!(s.advice.iter().any(|a| a.contains("sun")) && s.advice.iter().any(|a| a.contains("65504")));
    }
}
