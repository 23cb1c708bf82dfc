//! Closed forms of the factors, found before they are fitted: the growth of p at the horizon, and the width
//! of q.

use glam::DVec3;
use std::f64::consts::PI;
use steradian_brdf::Brdf;

/// Closed forms that multiply or stretch the tables: p(w) = (n·w)^−grazing e^P(w), and Q as a function of the
/// stretched half vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Form {
    /// The power of 1/(n·v) and 1/(n·l) with which f grows at the horizon, where a table could not represent
    /// it.
    pub grazing: f64,
    /// Tangents of the angles at which the highlight has about 1/e of its height, along tangent and
    /// bitangent: units of the half vector's slopes.
    pub widths: [f64; 2],
}

/// Cosines with the normal between which the power is measured: so near the horizon that a power of ½ is 50
/// to 100 times what it is at the normal.
const GRAZING: [f64; 2] = [1e-4, 4e-4];
/// The view's cosine where only the light's varies: low, so that the half vector stays near the normal, and
/// 25 times as high as the light.
const STILL_VIEW: f64 = 1e-2;
/// Powers smaller than this count as 0: between the cosines measured they change f by 1.4 %.
const MIN_GRAZING_POWER: f64 = 1e-2;
/// The largest power allowed: from there on the mean over views, ∫ z⁻² z dz, has no bound.
const MAX_GRAZING_POWER: f64 = 2.0;
/// If the power found with both directions grazing differs from twice that of one by more, f is no such
/// product.
const ALIKE: f64 = 0.1;
/// Number of azimuths at which the power is measured.
const AZIMUTHS: usize = 8;
/// Least width: with a narrower one, the tails of the highlight, which are wide in any case, would have too
/// few rows.
const MIN_WIDTH: f64 = 0.05;
/// Ratio of a Gaussian's width to its half width at half height, both in slopes.
const OVER_HALF: f64 = 1.2;

fn sum(f: [f64; 3]) -> f64 {
    f.iter().sum()
}

impl Form {
    /// Measures the form on values of the reflectance; where `isotropic`, both widths are that along the
    /// tangent.
    pub fn of(brdf: &dyn Brdf, isotropic: bool) -> Self {
        let grazing = grazing(brdf);
        let mut widths = [0.0, 0.5 * PI].map(|phi| width(brdf, phi, grazing));
        if isotropic {
            widths[1] = widths[0];
        }
        Self { grazing, widths }
    }

    /// A half vector's direction stretched, not of unit length.
    pub fn stretched(&self, h: DVec3) -> DVec3 {
        DVec3::new(h.x / self.widths[0], h.y / self.widths[1], h.z)
    }

    /// The unit half vector of a stretched one.
    pub fn half(&self, stretched: DVec3) -> DVec3 {
        let [x, y] = self.widths;
        DVec3::new(stretched.x * x, stretched.y * y, stretched.z).normalize()
    }
}

/// The power by which f grows where the light sinks and the view stands still across from it, near the
/// horizon, so that the half vector stays near the normal; 0 unless f has twice that power where the view
/// sinks too.
fn grazing(brdf: &dyn Brdf) -> f64 {
    let steps = (GRAZING[1] / GRAZING[0]).ln();
    let power = |view: &dyn Fn(f64) -> f64| {
        let of = |k: usize| {
            let phi = 2.0 * PI * k as f64 / AZIMUTHS as f64;
            let at = |z: f64, turn: f64| {
                let s = (1.0 - z * z).sqrt();
                DVec3::new(s * (phi + turn).cos(), s * (phi + turn).sin(), z)
            };
            let [low, high] = GRAZING.map(|z| sum(brdf.eval(at(z, 0.0), at(view(z), PI))));
            (low / high).ln() / steps
        };
        let mut all: Vec<f64> = (0..AZIMUTHS).map(of).filter(|p| p.is_finite()).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied()
    };
    let (one, both) = (power(&|_| STILL_VIEW), power(&|z| z));
    let found = one.zip(both).filter(|(one, both)| (one - 0.5 * both).abs() < ALIKE);
    let power = found.map_or(0.0, |(one, _)| one);
    if power.abs() < MIN_GRAZING_POWER { 0.0 } else { power.clamp(-MAX_GRAZING_POWER, MAX_GRAZING_POWER) }
}

/// Width of the highlight: the tangent of the angle of h at which f, freed of its power at the horizon and
/// seen from the light, has fallen half as far as it falls to 60°, converted from half width to width; 1
/// where it does not fall.
fn width(brdf: &dyn Brdf, phi: f64, grazing: f64) -> f64 {
    let at = |t: f64| {
        let h = DVec3::new(t * phi.cos(), t * phi.sin(), 1.0).normalize();
        sum(brdf.eval(h, h)) * h.z.powf(2.0 * grazing)
    };
    let (first, last) = (at(0.0), at(3f64.sqrt()));
    let half = 0.5 * (first + last);
    let (mut low, mut high) = (0.0, 0.0);
    let below = (0..60).map(|k| 0.01 * 1.1f64.powi(k)).find(|t| {
        (low, high) = (high, *t);
        at(*t) < half
    });
    // False for NaN too.
    let falls = first > last * (1.0 + 1e-6);
    if !falls || below.is_none() {
        return 1.0;
    }
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if at(middle) < half {
            high = middle;
        } else {
            low = middle;
        }
    }
    (OVER_HALF * high).clamp(MIN_WIDTH, 1.0)
}
