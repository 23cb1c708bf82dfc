//! Orders and resolutions from the light, the reflectance and the tolerance.

mod fit;
mod powers;
mod scale;

pub use powers::{ANGLES, Errors};
pub use scale::ScaleTable;

use super::spectral_error::{self, SpectralError};
use crate::{Apart, SunlitSpectrum};
use fit::{Fit, How};
use powers::{Powers, Seen};
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_brdf::central::{Argument, CentralError, Centre, Lpq, Slices};

/// Tolerance where the user gives none, over views up to 60° from the normal.
pub const TOLERANCE: f64 = 0.05;

/// What is given, and what is to be chosen where it is `None`.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// F.
    pub order: Option<usize>,
    /// P.
    pub p: Option<usize>,
    /// ε of (5.18), the share of energy that orders may miss.
    pub energy_epsilon: Option<f64>,
    /// The paper's projection.
    pub plain: bool,
    /// The direction that y_pq are functions of.
    pub of: Argument,
    /// S: intervals from pole to pole.
    pub size: Option<usize>,
    /// Number of suns that are shaded apart; 0 where nothing can shade them.
    pub lights: Option<usize>,
}

impl Options {
    /// Is the paper's projection asked for, directly or by its energy criterion?
    fn published(&self) -> bool {
        self.plain || self.energy_epsilon.is_some()
    }

    /// Are F or P given, or as published?
    fn given(&self) -> bool {
        self.p.is_some() || self.order.is_some() || self.published()
    }
}

/// Highest P.
#[derive(Debug, Clone, Copy)]
pub struct HighestP {
    /// Where the user gives no tolerance.
    pub usual: usize,
    /// Where the user gives one.
    pub asked: usize,
    /// Where maps have q = 0 alone.
    pub zonal: usize,
}

/// Most intervals from pole to pole, where the tolerance decides.
const MOST_SIZE: usize = 384;

/// Azimuthal terms below this share of the light's power count as rounding errors.
const ROUNDING: f64 = 1e-11;

/// Numbers of suns that are tried as exactly shaded where maps of all light miss the tolerance.
const SUNS: [usize; 3] = [1, 4, 16];
/// A larger number of suns is kept only if it lowers the error to this part of the error before.
const WORTH: f64 = 0.8;
/// Where the user gives no tolerance, suns are taken out unless the error of views up to 60° is below this
/// part of the default tolerance: few views see a sun, and their errors are above the mean.
const MARGIN: f64 = 0.8;

/// Where no P meets the goals, the lowest P is taken whose [`Goals::missed`] is at most so many times the
/// least: it is a fourth power of errors, so that these differ by 5 % at most, while maps grow like (P + 1)².
const ALIKE: f64 = 1.2;

/// The expansion from which maps are made.
pub struct Expansion {
    /// The light that maps hold, and the suns that are shaded exactly.
    pub apart: Apart,
    /// ρ̂_lpq of the reflectance without its diffuse part.
    pub lpq: Lpq,
    /// F.
    pub f: usize,
    /// Q: the highest q with anything in it.
    pub q: usize,
    /// Albedo of the diffuse part, which gets a map of its own about n.
    pub diffuse: [f64; 3],
    /// Angles between n and wo of the scale's knots, and the scale.
    pub scale: ScaleTable,
    /// Intervals from pole to pole, or per cube edge.
    pub size: usize,
    /// Estimated errors.
    pub errors: Errors,
    /// 1 − the captured share of energy (5.18), of the channel where that is smallest.
    pub missing_energy: f64,
}

/// Chooses orders, the diffuse part and the resolution S, and how many suns are taken out of the light: none
/// where maps of all of it meet the tolerance; `spacing` gives radians between the texels of a size.
pub fn choose(
    light: &SunlitSpectrum,
    slices: &Slices,
    p: &Options,
    spacing: impl Fn(usize) -> f64,
    highest: HighestP,
    task: &Task,
) -> Result<Expansion, CentralError> {
    let (first, more): (usize, &[usize]) = match p.lights {
        Some(n) => (n, &[]),
        None if !p.given() => (0, &SUNS),
        None => (0, &[]),
    };
    let whole = SpectralError::of(&Apart::suns(light, 0));
    let totals = (0..slices.slices.len()).map(|i| whole.slice(slices, i)).collect();
    let wanted = Wanted { slices, totals, p, highest, spacing };
    let mut best = wanted.expand(Apart::round_suns(light, first), task)?;
    let enough = task.tolerance().unwrap_or(MARGIN * TOLERANCE);
    // After disks in place of suns, the texels' exact outlines are tried: lobes much narrower than those that
    // maps are made for show the difference.
    let texels = more.last().map(|_| Apart::suns(light, usize::MAX));
    for apart in more.iter().map(|count| Apart::round_suns(light, *count)).chain(texels) {
        if best.0 <= enough || apart.suns.is_empty() {
            break;
        }
        let next = wanted.expand(apart, task)?;
        if next.0 < WORTH * best.0 {
            best = next;
        }
    }
    Ok(best.1)
}

/// Inputs of the choice of an expansion.
struct Wanted<'a, S> {
    slices: &'a Slices,
    /// Mean square of all radiance at every elevation.
    totals: Vec<f64>,
    p: &'a Options,
    highest: HighestP,
    spacing: S,
}

impl<S: Fn(usize) -> f64> Wanted<'_, S> {
    /// The expansion for the light that `apart` leaves to maps, and the error that is compared with the
    /// tolerance.
    fn expand(&self, apart: Apart, task: &Task) -> Result<(f64, Expansion), CentralError> {
        task.check()?;
        let spectral_error = SpectralError::of(&apart);
        let Self { slices: s, p, highest, spacing, .. } = self;
        let seen = Seen { spectral_error: &spectral_error, totals: &self.totals };
        let tolerance = task.tolerance().unwrap_or(TOLERANCE);
        let everywhere = task.tolerance().is_some();
        let goals = Goals::new(tolerance, everywhere);
        let how = How { of: p.of, plain: p.published(), everywhere, each: goals.each };
        let made =
            |order: usize, diffuse: bool| fit::best(&seen, s, order, diffuse, how, |x| goals.near(x) <= 1.0);
        let most = match (s.centre, task.tolerance()) {
            (Centre::Tangent, _) => highest.zonal,
            (_, None) => highest.usual,
            _ => highest.asked,
        };
        let ((fit, powers), fixed) = if let Some(epsilon) = p.energy_epsilon {
            let all = made(p.p.unwrap_or(most), false)?;
            let (f, order) = all.0.lpq.orders(epsilon).unwrap_or((s.order, all.0.lpq.p));
            (made(order, false)?, Some(f))
        } else {
            (search(p, most, goals, made)?, p.order)
        };
        // Errors of truncation and lookups need not be smaller than the error that the fit has anyway.
        let reached = if everywhere { powers.error().sqrt() } else { 0.0 };
        let tolerance = tolerance.max(reached);
        let f = fixed.map_or_else(|| powers.faded(tolerance), |f| f.min(s.order));
        let q = azimuth(&fit.lpq, &spectral_error, powers.exact(true));
        let lpq = fit.lpq.truncated(f, fit.lpq.p);
        let enough = |size: usize| powers.lookups(f, spacing(size)) <= (0.25 * tolerance).powi(2);
        let size = p.size.unwrap_or_else(|| spectral_error::size(MOST_SIZE, enough).max(8));
        let scale = lpq.scale.as_ref().map_or_else(ScaleTable::one, |scale| {
            let half = if s.centre == Centre::Reflection { 0.5 } else { 1.0 };
            let angles: Vec<f64> = scale.theta_o.iter().map(|t| half * t).collect();
            ScaleTable::new(&angles, &scale.factor)
        });
        let errors = powers.errors(f, spacing(size), &scale, s.centre != Centre::Tangent);
        let missing_energy = missing(&lpq, f);
        let error = if everywhere { errors.all } else { powers.largest(f, spacing(size), &scale) };
        let diffuse = fit.diffuse;
        Ok((error, Expansion { apart, lpq, f, q, diffuse, scale, size, errors, missing_energy }))
    }
}

/// 1 − the captured share of energy (5.18), of the channel where that is smallest.
fn missing(lpq: &Lpq, f: usize) -> f64 {
    (1.0 - lpq.share(f, lpq.p)).max(0.0)
}

/// Target errors of the search for P, relative RMS.
#[derive(Debug, Clone, Copy)]
struct Goals {
    /// Error of the mean over elevations that count.
    mean: f64,
    /// Error of each elevation that counts.
    each: f64,
    /// Error of the mean over all elevations.
    all: f64,
}

impl Goals {
    /// Targets for a tolerance. Where the user gives none (`everywhere` false), not only the mean over views
    /// up to 60° but each of these elevations is to meet it, and the error of the mean over all views is
    /// bounded loosely. The factors leave room for the errors of truncation and lookups.
    fn new(tolerance: f64, everywhere: bool) -> Self {
        let [mean, each, all] =
            if everywhere { [0.85, f64::INFINITY, f64::INFINITY] } else { [0.65, 0.8, 2.5] };
        Self { mean: mean * tolerance, each: each * tolerance, all: all * tolerance }
    }

    /// The error of elevations that count, at most 1 where the goals are met.
    fn near(&self, x: &Powers) -> f64 {
        (x.error().sqrt() / self.mean).max(x.worst().sqrt() / self.each)
    }

    /// Cost of missing the targets, 1 where all are met; elevations that count weigh most.
    fn missed(&self, x: &Powers) -> f64 {
        self.near(x).max(1.0).powi(4) * (x.error_of_all().sqrt() / self.all).max(1.0)
    }
}

/// The fit of lowest P that meets the targets, or misses them hardly more than any other; with a diffuse part
/// of its own where that lowers P or the miss.
fn search(
    p: &Options,
    most: usize,
    goals: Goals,
    made: impl Fn(usize, bool) -> Result<(Fit, Powers), CentralError>,
) -> Result<(Fit, Powers), CentralError> {
    let mut tried: Vec<(f64, (Fit, Powers))> = Vec::new();
    let orders = p.p.map_or(0..=most, |p| p..=p);
    for order in orders {
        for diffuse in [false, true] {
            if diffuse && p.plain {
                continue;
            }
            let candidate = made(order, diffuse)?;
            if diffuse && candidate.0.diffuse == [0.0; 3] {
                continue;
            }
            let missed = goals.missed(&candidate.1);
            if missed <= 1.0 {
                return Ok(candidate);
            }
            // A map more must be worth it.
            let better = tried.iter().all(|t| missed < if diffuse { 0.9 } else { 0.97 } * t.0);
            if better {
                tried.push((missed, candidate));
            }
        }
    }
    let least = tried.last().map_or(0.0, |t| t.0);
    match tried.into_iter().find(|t| t.0 <= ALIKE * least) {
        Some(t) => Ok(t.1),
        None => made(p.p.unwrap_or(0), false),
    }
}

/// The highest q whose terms are more than rounding.
fn azimuth(lpq: &Lpq, spectral_error: &SpectralError, exact: f64) -> usize {
    let power = |q: usize| {
        let rows = (q..=lpq.p).map(|p| {
            let row = lpq.row(p, q);
            (0..3).map(|c| spectral_error.row(c, q, row[c].iter().copied())).sum::<f64>()
        });
        // Mean of y_pq² over the sphere.
        rows.sum::<f64>() / (4.0 * PI)
    };
    (0..=lpq.azimuth()).rev().find(|q| power(*q) > ROUNDING * exact).unwrap_or(0)
}
