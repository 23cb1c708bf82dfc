//! Power of a reflectance by band and elevation, of its fit, and of the fit's error: from these the error of
//! any choice of orders follows.

use super::scale::ScaleTable;
use crate::Apart;
use crate::shrm::spectral_error::{self, SpectralError};
use steradian_base::Elevation;
use steradian_brdf::central::{Centre, Lpq, Slices};

/// Angle from the normal, degrees, up to which views decide the choice of orders where the user gives no
/// tolerance. Where the user gives one, all views count; then views up to this angle must not get worse than
/// before.
const VIEWS: f64 = 60.0;
/// Degrees by which the limit is widened when elevations are selected, so that the first beyond it counts
/// too.
const MARGIN: f64 = 2.0;

/// Power by band of one elevation.
pub struct Bands {
    /// Weight: solid angle.
    weight: f64,
    /// Among the views up to 60°?
    near: bool,
    /// Counts in the choice?
    counts: bool,
    /// Angle between n (about the tangent: t) and wo, radians.
    theta_v: f64,
    exact: Vec<f64>,
    made: Vec<f64>,
    error: Vec<f64>,
    tail: f64,
    /// Power of the radiance under all light, including light that no map holds; certificates state errors
    /// relative to it.
    total: f64,
}

impl Bands {
    /// Power of the radiance under the light that maps hold; errors in the choice of orders are relative to
    /// it.
    fn whole(&self) -> f64 {
        (self.exact.iter().sum::<f64>() + self.tail).max(Apart::LEAST * self.total)
    }

    /// Squared error of all bands.
    fn square(&self) -> f64 {
        self.error.iter().sum::<f64>() + self.tail
    }

    /// Squared relative error of all bands.
    fn error(&self) -> f64 {
        ratio(self.square(), self.whole())
    }

    /// Squared error that truncation after F adds to that of the fit.
    fn cut(&self, f: usize) -> f64 {
        (f + 1..self.exact.len()).map(|l| self.exact[l] - self.error[l]).sum()
    }

    /// Squared error that interpolation between texels `h` apart adds.
    fn lookups(&self, f: usize, h: f64) -> f64 {
        (0..=f).map(|l| self.made[l] * spectral_error::lookup(l, h)).sum()
    }

    /// Squared error, cut at F and looked up between texels `h` apart, and the power of all light.
    fn at(&self, f: usize, h: f64, scale: f64) -> [f64; 2] {
        let within: f64 = self.error[..=f].iter().sum::<f64>() + self.lookups(f, h);
        let beyond: f64 = self.exact[f + 1..].iter().sum::<f64>() + self.tail;
        [within + beyond + scale * self.made[..=f].iter().sum::<f64>(), self.total]
    }
}

/// Estimated relative errors of an expansion with its truncation and its lookups.
#[derive(Debug, Clone, PartialEq)]
pub struct Errors {
    /// RMS over all views.
    pub all: f64,
    /// RMS over views up to 60° from the normal.
    pub near: f64,
    /// The largest of the elevations up to 60°, relative to the power of the light that maps hold.
    pub beside_suns: f64,
    /// Error by angle of view; empty about the tangent.
    pub elevations: Vec<Elevation>,
}

/// The light in maps, and the mean square of all radiance at every elevation.
pub struct Seen<'a> {
    pub spectral_error: &'a SpectralError,
    pub totals: &'a [f64],
}

/// The powers of a fit at every elevation.
pub struct Powers(Vec<Bands>);

/// Angle between n and wo; between t and wo about the tangent.
fn elevation(s: &Slices, i: usize) -> f64 {
    if s.centre == Centre::Tangent { s.slices[i].theta_o() } else { s.slices[i].theta_v }
}

impl Powers {
    /// Powers of the fit `lpq` to `rest`, which is `all` without its diffuse part. Elevations up to 60°
    /// count, or all where `everywhere`.
    pub fn new(seen: &Seen<'_>, all: &Slices, rest: &Slices, lpq: &Lpq, everywhere: bool) -> Self {
        let spectral_error = seen.spectral_error;
        let one = |i: usize| {
            let bands = all.order + 1;
            let (mut exact, mut made, mut error) = (vec![0.0; bands], vec![0.0; bands], vec![0.0; bands]);
            let series = lpq.slice(all.slices[i].theta_o());
            for q in 0..=all.azimuth {
                let both = if q == 0 { 1.0 } else { 2.0 };
                let (whole, part) = (all.row(i, q), rest.row(i, q));
                for c in 0..3 {
                    for l in q..bands {
                        let w = both * spectral_error.mean(c, l);
                        let k = series.get(q).map_or(0.0, |s| s[c][l]);
                        exact[l] += w * whole[c][l].powi(2);
                        made[l] += w * k * k;
                        error[l] += w * (part[c][l] - k).powi(2);
                    }
                }
            }
            let theta_v = elevation(all, i);
            let near = all.centre == Centre::Tangent || theta_v <= (VIEWS + MARGIN).to_radians();
            let (weight, counts) = (theta_v.sin(), near || everywhere);
            Bands {
                weight,
                near,
                counts,
                theta_v,
                exact,
                made,
                error,
                tail: spectral_error.tail(all, i),
                total: seen.totals[i],
            }
        };
        Self((0..all.slices.len()).map(one).collect())
    }

    /// Mean over elevations that count (or all).
    fn mean(&self, all: bool, of: impl Fn(&Bands) -> f64) -> f64 {
        let used = || self.0.iter().filter(|b| all || b.counts);
        let total: f64 = used().map(|b| b.weight).sum();
        used().map(|b| b.weight * of(b)).sum::<f64>() / total
    }

    /// The larger of two squared relative errors: of the mean over elevations that count, and the largest up
    /// to 60°.
    fn larger(&self, of: impl Fn(&Bands) -> f64) -> f64 {
        let mean = ratio(self.mean(false, &of), self.exact(false));
        let near = self.0.iter().filter(|b| b.near);
        near.map(|b| ratio(of(b), b.whole())).fold(mean, f64::max)
    }

    /// Mean power.
    pub fn exact(&self, all: bool) -> f64 {
        self.mean(all, Bands::whole)
    }

    /// Squared relative error of all bands.
    pub fn error(&self) -> f64 {
        ratio(self.mean(false, Bands::square), self.exact(false))
    }

    /// Squared relative error over all elevations.
    pub fn error_of_all(&self) -> f64 {
        ratio(self.mean(true, Bands::square), self.exact(true))
    }

    /// Squared relative error of the worst elevation that counts.
    pub fn worst(&self) -> f64 {
        self.0.iter().filter(|b| b.counts).map(Bands::error).fold(0.0, f64::max)
    }

    /// Raises the weight of elevations that count whose squared error is above `goal`, or above half the mean
    /// if that is larger, and lowers it below (Lawson's iteration). The bound by the mean keeps elevations
    /// that cannot meet the goal from taking all weight.
    pub fn even_out(&self, goal: f64, emphases: &mut [f64]) {
        let level = goal.max(0.5 * self.mean(false, Bands::error));
        for (e, b) in emphases.iter_mut().zip(&self.0).filter(|(_, b)| b.counts && level > 0.0) {
            *e *= (b.error() / level).clamp(0.2, 5.0).powf(0.6);
        }
    }

    /// The lowest F whose cut adds at most `most` to the squared relative error.
    fn order(&self, most: f64) -> usize {
        let bands = self.0.first().map_or(1, |b| b.exact.len());
        (0..bands).find(|f| self.larger(|b| b.cut(*f)) <= most).unwrap_or(bands - 1)
    }

    /// F for a tolerance: truncation adds little to the mean square, and is hardly visible. A truncation
    /// error that is small relative to a sun's lobe shows as rings around it, so bands are added until these
    /// have faded, or to twice as many where a lobe's edge keeps them from fading.
    pub fn faded(&self, tolerance: f64) -> usize {
        let little = self.order((0.25 * tolerance).powi(2));
        self.order((0.02 * tolerance).powi(2)).min(2 * little)
    }

    /// Squared relative error that lookups between texels `h` apart add.
    pub fn lookups(&self, f: usize, h: f64) -> f64 {
        self.larger(|b| b.lookups(f, h))
    }

    /// The largest relative error of the elevations up to 60°, as certificates state it.
    pub fn largest(&self, f: usize, h: f64, scale: &ScaleTable) -> f64 {
        self.largest_of(f, h, scale, |b| b.total)
    }

    /// See [`Errors::beside_suns`].
    fn beside_suns(&self, f: usize, h: f64, scale: &ScaleTable) -> f64 {
        self.largest_of(f, h, scale, Bands::whole)
    }

    fn largest_of(&self, f: usize, h: f64, scale: &ScaleTable, power: impl Fn(&Bands) -> f64) -> f64 {
        let error = |b: &Bands| ratio(b.at(f, h, scale.square_error(b.theta_v))[0], power(b));
        self.0.iter().filter(|b| b.near).map(error).fold(0.0, f64::max).sqrt()
    }

    /// The error of every elevation and of their mean.
    pub fn errors(&self, f: usize, h: f64, scale: &ScaleTable, about_normal: bool) -> Errors {
        let at = |b: &Bands| b.at(f, h, scale.square_error(b.theta_v));
        let (mut error, mut exact) = (0.0, 0.0);
        let mut near = (0.0, 0.0);
        for b in &self.0 {
            let [e, x] = at(b);
            (error, exact) = (error + b.weight * e, exact + b.weight * x);
            if b.theta_v <= VIEWS.to_radians() {
                near = (near.0 + b.weight * e, near.1 + b.weight * x);
            }
        }
        let elevation = |degrees: f64| {
            let theta_o = degrees.to_radians();
            let [e, x, rest] = self.between(theta_o, |b| {
                let [e, x] = at(b);
                [e, x, b.whole()]
            });
            let beside_suns = Some(ratio(e, rest).sqrt());
            Elevation { beside_suns, ..Elevation::computed(theta_o, ratio(e, x).sqrt()) }
        };
        let elevations = if about_normal { ANGLES.map(elevation).to_vec() } else { Vec::new() };
        Errors {
            all: ratio(error, exact).sqrt(),
            near: ratio(near.0, near.1).sqrt(),
            beside_suns: self.beside_suns(f, h, scale),
            elevations,
        }
    }

    /// Linear between the elevations around an angle.
    fn between(&self, theta_v: f64, at: impl Fn(&Bands) -> [f64; 3]) -> [f64; 3] {
        let above = self.0.partition_point(|b| b.theta_v < theta_v).clamp(1, self.0.len().max(2) - 1);
        let (Some(a), Some(b)) = (self.0.get(above - 1), self.0.get(above)) else { return [0.0; 3] };
        let t = ((theta_v - a.theta_v) / (b.theta_v - a.theta_v)).clamp(0.0, 1.0);
        let (a, b) = (at(a), at(b));
        std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
    }
}

/// A squared relative error.
pub fn ratio(error: f64, exact: f64) -> f64 {
    if exact > 0.0 { (error / exact).max(0.0) } else { 0.0 }
}

/// Angles between view and normal, degrees, at which certificates state errors.
pub const ANGLES: [f64; 13] = [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 65.0, 70.0, 75.0, 80.0, 85.0, 88.0];
