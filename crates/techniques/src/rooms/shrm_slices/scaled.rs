//! The reflectance's slices divided by their albedo, weighted by the light of the maps.

use std::f64::consts::PI;
use steradian_brdf::central::{Centre, Slices};
use steradian_prefilter::shrm::spectral_error::SpectralError;

/// Views beyond this angle, radians, count little in the choice of orders: lobes degenerate at the horizon.
const VIEWS: f64 = 1.5;
/// Weight of views beyond [`VIEWS`].
const LITTLE: f64 = 0.1;

/// Slices with albedo and kernels κ = k/albedo, and the light that maps are made for.
pub struct Scaled<'a> {
    pub s: &'a Slices,
    /// Mean squares of the light that maps are made for.
    pub rest: &'a SpectralError,
    /// The albedo, or 1.
    pub scale: Vec<[f64; 3]>,
    /// Mean square radiance of each elevation that squared errors are relative to.
    pub total: Vec<f64>,
}

/// Number of orders that q stands for: 1 for q = 0, else 2, for q and −q.
pub fn both(q: usize) -> f64 {
    if q == 0 { 1.0 } else { 2.0 }
}

impl<'a> Scaled<'a> {
    /// Errors of maps for `rest` are relative to the mean square radiance `total` of every elevation.
    pub fn new(s: &'a Slices, rest: &'a SpectralError, total: Vec<f64>) -> Self {
        let albedo = |i: usize| s.row(i, 0).map(|r| r[0] * (4.0 * PI).sqrt());
        let most = (0..s.slices.len()).flat_map(albedo).fold(0.0, f64::max);
        let scale = |i: usize| albedo(i).map(|a| if a > 1e-6 * most { a } else { 1.0 });
        Self { s, rest, scale: (0..s.slices.len()).map(scale).collect(), total }
    }

    /// Mean square radiance of every elevation; 1 without any light, where errors are 0.
    pub fn totals(s: &Slices, light: &SpectralError) -> Vec<f64> {
        let total = |i: usize| Some(light.slice(s, i)).filter(|t| *t > 0.0).unwrap_or(1.0);
        (0..s.slices.len()).map(total).collect()
    }

    /// Number of elevations.
    pub fn len(&self) -> usize {
        self.s.slices.len()
    }

    /// Angle between n (about the tangent: t) and wo.
    pub fn angle(&self, i: usize) -> f64 {
        if self.s.centre == Centre::Tangent { self.s.slices[i].theta_o() } else { self.s.slices[i].theta_v }
    }

    /// Is elevation i to meet a tolerance?
    pub fn counts(&self, i: usize) -> bool {
        self.s.centre == Centre::Tangent || self.angle(i) <= VIEWS
    }

    /// Initial weight of elevation i.
    pub fn emphasis(&self, i: usize) -> f64 {
        if self.counts(i) { 1.0 } else { LITTLE }
    }

    /// κ_lq of elevation i, as a function of channel and band.
    pub fn kappa(&self, i: usize, q: usize) -> impl Fn(usize, usize) -> f64 {
        let (rows, inverse) = (self.s.row(i, q), self.scale[i].map(f64::recip));
        move |c, l| rows[c][l] * inverse[c]
    }

    /// Factor of a squared difference of κ in channel c in the squared relative error of elevation i.
    pub fn share(&self, i: usize, c: usize) -> f64 {
        self.scale[i][c].powi(2) / self.total[i]
    }

    /// Squared relative error of elevation i where rows of q miss `off(c, l)` of κ.
    pub fn miss(&self, i: usize, q: usize, off: impl Fn(usize, usize) -> f64) -> f64 {
        let channel =
            |c: usize| self.share(i, c) * self.rest.row(c, q, (0..=self.s.order).map(|l| off(c, l)));
        (0..3).map(channel).sum()
    }

    /// Squared relative error from the energy beyond the slices' own orders.
    pub fn tail(&self, i: usize) -> f64 {
        self.rest.tail(self.s, i) / self.total[i]
    }

    /// Mean squared relative error of linear interpolation between the elevations around i, of albedo and of
    /// κ each on its own: t(1 − t)/2 times a κ″ + a″ κ in differences, whose mean square over an interval is
    /// 1/120 of it.
    pub fn between(&self, i: usize) -> f64 {
        let last = self.len() - 1;
        if last < 2 {
            return 0.0;
        }
        let i = i.clamp(1, last - 1);
        let [before, here, after] = [i - 1, i, i + 1].map(|i| self.scale[i]);
        let bend: [f64; 3] = std::array::from_fn(|c| (before[c] - 2.0 * here[c] + after[c]) / here[c]);
        let of_q = |q: usize| {
            let [before, here, after] = [i - 1, i, i + 1].map(|i| self.kappa(i, q));
            self.miss(i, q, |c, l| before(c, l) - 2.0 * here(c, l) + after(c, l) + bend[c] * here(c, l))
        };
        (0..=self.s.azimuth).map(of_q).sum::<f64>() / 120.0
    }

    /// Squared relative error of elevation i where the series is truncated at F = 0, 1, …
    pub fn beyond(&self, i: usize) -> Vec<f64> {
        let mut beyond = vec![0.0; self.s.order + 1];
        for q in 0..=self.s.azimuth {
            for (c, row) in self.s.row(i, q).into_iter().enumerate() {
                let shown = beyond.iter_mut().zip(row).enumerate();
                shown.for_each(|(l, (b, k))| *b += both(q) * self.rest.mean(c, l) * k * k);
            }
        }
        let mut above = 0.0;
        for b in beyond.iter_mut().rev() {
            above += std::mem::replace(b, above / self.total[i]);
        }
        beyond
    }
}
