//! Orders and resolutions from the light, the reflectance and the tolerance.

use super::fit::{self, Fit, How};
use super::powers::Powers;
use super::{Orders, ScaleTable, TOLERANCE};
use crate::BakeError;
use crate::shared::harmonics::{self, MAX_TERMS};
use crate::shared::kernels::{Kernels, refused, word};
use crate::shared::meter::{self, Meter};
use crate::shared::spectrum::Spectrum;
use std::f64::consts::PI;
use steradian_base::{Certificate, Task};
use steradian_brdf::central::{Centre, Lpq};

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

/// What is to be made into maps.
pub struct Expansion {
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
    pub certificate: Certificate,
}

/// Chooses orders, the diffuse part and the resolution S; `spacing` gives radians between the texels of a size.
pub fn choose(
    slug: &'static str,
    light: &Spectrum,
    kernels: &Kernels,
    p: &Orders,
    spacing: impl Fn(usize) -> f64,
    highest: HighestP,
    task: &Task,
) -> Result<Expansion, BakeError> {
    let s = &kernels.0;
    let meter = Meter::new(light);
    let tolerance = task.tolerance().unwrap_or(TOLERANCE);
    let everywhere = task.tolerance().is_some();
    let goals = Goals::new(tolerance, everywhere);
    let how = How { of: p.argument(s.centre), plain: p.published(), everywhere, each: goals.each };
    let refused = refused(slug);
    let made = |order: usize, diffuse: bool| -> Result<(Fit, Powers), BakeError> {
        fit::best(&meter, s, order, diffuse, how, |x| goals.near(x) <= 1.0).map_err(&refused)
    };
    let most = match (s.centre, task.tolerance()) {
        (Centre::Tangent, _) => highest.zonal,
        (_, None) => highest.usual,
        _ => highest.asked,
    };
    let (mut best, fixed) = if p.energy_epsilon > 0.0 {
        let all = made(p.p.unwrap_or(most), false)?;
        let (f, order) = all.0.lpq.orders(p.energy_epsilon).unwrap_or((s.order, all.0.lpq.p));
        (made(order, false)?, Some(f))
    } else {
        (search(p, most, goals, made)?, p.order)
    };
    let diffuse = best.0.diffuse;
    let f = fixed.map_or_else(|| best.1.faded(tolerance), |f| f.min(s.order));
    let q = azimuth(&best.0.lpq, &meter, best.1.exact(true));
    best.0.lpq = best.0.lpq.truncated(f, best.0.lpq.p);
    let enough = |size: usize| best.1.lookups(f, spacing(size)) <= (0.25 * tolerance).powi(2);
    let size = if p.size > 0 { p.size } else { meter::size(MOST_SIZE, enough).max(8) };
    let scale = best.0.lpq.scale.as_ref().map_or_else(ScaleTable::one, |scale| {
        let half = if s.centre == Centre::Reflection { 0.5 } else { 1.0 };
        let angles: Vec<f64> = scale.theta_o.iter().map(|t| half * t).collect();
        ScaleTable::new(&angles, &scale.factor)
    });
    let certificate = best
        .1
        .certify(f, spacing(size), &scale)
        .detail("F", f as f64)
        .detail("P", best.0.lpq.p as f64)
        .detail("Q", q as f64)
        .detail("S", size as f64)
        .detail("centre (1 mirror direction, 2 normal, 3 tangent)", word(s.centre))
        .detail("diffuse part", diffuse.iter().sum::<f64>() / 3.0)
        .detail("missing energy of the reflectance", missing(&best.0, f));
    Ok(Expansion { lpq: best.0.lpq, f, q, diffuse, scale, size, certificate })
}

/// 1 − the share of (5.18) of the channel that fares worst.
fn missing(fit: &Fit, f: usize) -> f64 {
    (1.0 - fit.lpq.share(f, fit.lpq.p)).max(0.0)
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
    /// Where nobody asks for a tolerance each elevation that counts is to meet it, not only their mean, and pictures
    /// should not suffer much from the others. Cut and lookups take their part.
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

/// The lowest P that meets the goals, with a diffuse part of its own where that makes P lower (or, where no P does, the
/// miss less).
fn search(
    p: &Orders,
    most: usize,
    goals: Goals,
    made: impl Fn(usize, bool) -> Result<(Fit, Powers), BakeError>,
) -> Result<(Fit, Powers), BakeError> {
    let mut best: Option<(f64, (Fit, Powers))> = None;
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
            // More maps must be worth it.
            if best.as_ref().is_none_or(|b| missed < if diffuse { 0.9 } else { 0.97 } * b.0) {
                best = Some((missed, candidate));
            }
            if best.as_ref().is_some_and(|b| b.0 <= 1.0) {
                break;
            }
        }
        if best.as_ref().is_some_and(|b| b.0 <= 1.0) {
            break;
        }
    }
    match best {
        Some(b) => Ok(b.1),
        None => made(p.p.unwrap_or(0), false),
    }
}

/// The highest q whose terms are more than rounding.
fn azimuth(lpq: &Lpq, meter: &Meter, exact: f64) -> usize {
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
