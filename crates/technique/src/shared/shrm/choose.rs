//! Orders and resolutions from the light, the reflectance and the tolerance.

use super::fit::{self, Fit, How};
use super::powers::{Powers, Seen};
use super::{Orders, ScaleTable, TOLERANCE};
use crate::BakeError;
use crate::certify::Report;
use crate::shared::light::apart::Apart;
use crate::shared::light::spectral_error::{self, SpectralError};
use crate::shared::light::sunlit_spectrum::SunlitSpectrum;
use crate::shared::material::kernels::{Kernels, refused, word};
use crate::shared::maths::harmonics::{self, MAX_TERMS};
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_brdf::central::{Centre, Lpq, Slices};

/// P at most.
#[derive(Debug, Clone, Copy)]
pub struct HighestP {
    /// Where the user asks for no tolerance.
    pub usual: usize,
    /// Where the user does.
    pub asked: usize,
    /// With q = 0 alone.
    pub zonal: usize,
}

/// Intervals from pole to pole at most where the tolerance decides.
const MOST_SIZE: usize = 384;

/// Share of a light's power below which azimuthal terms are rounding.
const ROUNDING: f64 = 1e-11;

/// Numbers of suns that are taken apart where maps of all light miss the tolerance.
const SUNS: [usize; 3] = [1, 4, 16];
/// More of them must lower the error to this part of it.
const WORTH: f64 = 0.8;
/// Where nobody asks for a tolerance, errors up to 60° stay below this part of the usual one, or suns go: few
/// views see a sun, and those err by more than the mean.
const MARGIN: f64 = 0.8;

/// Where no P meets the goals, the lowest whose miss is at most so many times the least is taken: misses are
/// fourth powers, so that errors differ by 5 % at most, and maps grow like (P + 1)².
const ALIKE: f64 = 1.2;

/// What is to be made into maps.
pub struct Expansion {
    /// The light that maps hold, and the suns that they do not.
    pub apart: Apart,
    /// ρ̂_lpq of what is left without the diffuse part.
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
    /// What is known of the error.
    pub report: Report,
}

/// Chooses orders, the diffuse part and the resolution S, and how many suns are taken out of the light: none
/// where maps of all of it meet the tolerance; `spacing` gives radians between the texels of a size.
pub fn choose(
    slug: &'static str,
    light: &SunlitSpectrum,
    kernels: &Kernels,
    p: &Orders,
    spacing: impl Fn(usize) -> f64,
    highest: HighestP,
    task: &Task,
) -> Result<Expansion, BakeError> {
    let (first, more): (usize, &[usize]) = match p.lights {
        Some(n) if kernels.brdf.is_some() => (n, &[]),
        None if kernels.brdf.is_some() && !p.given() => (0, &SUNS),
        _ => (0, &[]),
    };
    let whole = Apart::suns(light, 0).meter();
    let slices = &kernels.slices;
    let totals = (0..slices.slices.len()).map(|i| whole.slice(slices, i)).collect();
    let wanted = Wanted { slug, slices, totals, p, highest, spacing };
    let mut best = wanted.expand(Apart::round_suns(light, first), task)?;
    let enough = task.tolerance().unwrap_or(MARGIN * TOLERANCE);
    // What round suns miss of the outlines is more than lobes much narrower than those here are for can do
    // with.
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

/// What maps are chosen for.
struct Wanted<'a, S> {
    slug: &'static str,
    slices: &'a Slices,
    /// Mean square of all radiance at every elevation.
    totals: Vec<f64>,
    p: &'a Orders,
    highest: HighestP,
    spacing: S,
}

impl<S: Fn(usize) -> f64> Wanted<'_, S> {
    /// The expansion for what `apart` leaves to maps, and the error that the tolerance bounds.
    fn expand(&self, apart: Apart, task: &Task) -> Result<(f64, Expansion), BakeError> {
        task.check()?;
        let meter = apart.meter();
        let Self { slices: s, p, highest, spacing, .. } = self;
        let seen = Seen { meter: &meter, totals: &self.totals };
        let tolerance = task.tolerance().unwrap_or(TOLERANCE);
        let everywhere = task.tolerance().is_some();
        let goals = Goals::new(tolerance, everywhere);
        let how = How { of: p.argument(s.centre), plain: p.published(), everywhere, each: goals.each };
        let refused = refused(self.slug);
        let made = |order: usize, diffuse: bool| -> Result<(Fit, Powers), BakeError> {
            fit::best(&seen, s, order, diffuse, how, |x| goals.near(x) <= 1.0).map_err(&refused)
        };
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
        // Nobody sees cut and lookups below the error that is reached.
        let reached = if everywhere { powers.error().sqrt() } else { 0.0 };
        let tolerance = tolerance.max(reached);
        let f = fixed.map_or_else(|| powers.faded(tolerance), |f| f.min(s.order));
        let q = azimuth(&fit.lpq, &meter, powers.exact(true));
        let lpq = fit.lpq.truncated(f, fit.lpq.p);
        let enough = |size: usize| powers.lookups(f, spacing(size)) <= (0.25 * tolerance).powi(2);
        let size = p.size.unwrap_or_else(|| spectral_error::size(MOST_SIZE, enough).max(8));
        let scale = lpq.scale.as_ref().map_or_else(ScaleTable::one, |scale| {
            let half = if s.centre == Centre::Reflection { 0.5 } else { 1.0 };
            let angles: Vec<f64> = scale.theta_o.iter().map(|t| half * t).collect();
            ScaleTable::new(&angles, &scale.factor)
        });
        let mut report = powers
            .report(f, spacing(size), &scale, s.centre != Centre::Tangent)
            .detail("F", f as f64)
            .detail("P", lpq.p as f64)
            .detail("Q", q as f64)
            .detail("S", size as f64)
            .detail("lights", apart.suns.len() as f64)
            .detail("centre (1 mirror direction, 2 normal, 3 tangent)", word(s.centre))
            .detail("diffuse part", fit.diffuse.iter().sum::<f64>() / 3.0)
            .detail("error up to 60 degrees beside the suns", powers.beside_suns(f, spacing(size), &scale));
        report.missing_energy = Some(missing(&lpq, f));
        let error = match &report.estimate {
            Some(e) if everywhere => e.error,
            _ => powers.largest(f, spacing(size), &scale),
        };
        Ok((error, Expansion { apart, lpq, f, q, diffuse: fit.diffuse, scale, size, report }))
    }
}

/// 1 − the share of (5.18) of the channel that fares worst.
fn missing(lpq: &Lpq, f: usize) -> f64 {
    (1.0 - lpq.share(f, lpq.p)).max(0.0)
}

/// What the search for P is after, as relative RMS errors.
#[derive(Debug, Clone, Copy)]
struct Goals {
    /// Mean over elevations that count.
    mean: f64,
    /// Each of them.
    each: f64,
    /// Mean over all elevations.
    all: f64,
}

impl Goals {
    /// Where nobody asks for a tolerance each elevation that counts is to meet it, not only their mean, and
    /// pictures should not suffer much from the others. Cut and lookups take their part.
    fn new(tolerance: f64, everywhere: bool) -> Self {
        let [mean, each, all] =
            if everywhere { [0.85, f64::INFINITY, f64::INFINITY] } else { [0.65, 0.8, 2.5] };
        Self { mean: mean * tolerance, each: each * tolerance, all: all * tolerance }
    }

    /// The error of elevations that count, at most 1 where the goals are met.
    fn near(&self, x: &Powers) -> f64 {
        (x.error().sqrt() / self.mean).max(x.worst().sqrt() / self.each)
    }

    /// How far the goals are missed, 1 where all are met: elevations that count come first.
    fn missed(&self, x: &Powers) -> f64 {
        self.near(x).max(1.0).powi(4) * (x.error_of_all().sqrt() / self.all).max(1.0)
    }
}

/// The lowest P that meets the goals, or that misses them by hardly more than any; with a diffuse part of its
/// own where that makes P lower or the miss less.
fn search(
    p: &Orders,
    most: usize,
    goals: Goals,
    made: impl Fn(usize, bool) -> Result<(Fit, Powers), BakeError>,
) -> Result<(Fit, Powers), BakeError> {
    let mut tried: Vec<(f64, (Fit, Powers))> = Vec::new();
    let orders = p.p.map_or(0..=most, |p| p..=p);
    for order in orders.filter(|o| harmonics::count(*o, 0) <= MAX_TERMS) {
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
fn azimuth(lpq: &Lpq, meter: &SpectralError, exact: f64) -> usize {
    let power = |q: usize| {
        let rows = (q..=lpq.p).map(|p| {
            let row = lpq.row(p, q);
            (0..3).map(|c| meter.row(c, q, row[c].iter().copied())).sum::<f64>()
        });
        // Mean of y_pq² over the sphere.
        rows.sum::<f64>() / (4.0 * PI)
    };
    (0..=lpq.azimuth()).rev().find(|q| power(*q) > ROUNDING * exact).unwrap_or(0)
}
