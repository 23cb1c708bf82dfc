//! Orders and resolutions from the light, the reflectance and the tolerance.

use super::{Orders, ScaleTable, TOLERANCE};
use crate::BakeError;
use crate::shared::harmonics::{self, MAX_TERMS};
use crate::shared::kernels::{Kernels, refused, word};
use crate::shared::meter::{self, Meter};
use crate::shared::spectrum::Spectrum;
use std::f64::consts::{FRAC_PI_2, PI};
use steradian_base::{Certificate, Known, Task};
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

/// Rounds of reweighting that even the error out over the elevations that count.
const ROUNDS: usize = 3;
/// Share of a light's power below which azimuthal terms are rounding.
const ROUNDING: f64 = 1e-11;
/// Views that count where a user asks for no tolerance.
const VIEWS: f64 = 60.0;

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

/// Power by band of one elevation.
struct Bands {
    /// Weight: solid angle.
    weight: f64,
    /// Counts in the choice?
    counts: bool,
    /// Angle between n (about the tangent: t) and wo, radians.
    theta_v: f64,
    exact: Vec<f64>,
    made: Vec<f64>,
    error: Vec<f64>,
    tail: f64,
}

impl Bands {
    /// Squared relative error of all bands.
    fn error(&self) -> f64 {
        ratio(self.error.iter().sum::<f64>() + self.tail, self.exact.iter().sum::<f64>() + self.tail)
    }
}

/// The powers of a fit at every elevation.
struct Powers(Vec<Bands>);

/// Angle between n and wo; between t and wo about the tangent.
fn elevation(s: &Slices, i: usize) -> f64 {
    if s.centre == Centre::Tangent { s.slices[i].theta_o() } else { s.slices[i].theta_v }
}

impl Powers {
    fn new(meter: &Meter, all: &Slices, rest: &Slices, lpq: &Lpq, views: f64) -> Self {
        let one = |i: usize| {
            let bands = all.order + 1;
            let (mut exact, mut made, mut error) = (vec![0.0; bands], vec![0.0; bands], vec![0.0; bands]);
            let series = lpq.slice(all.slices[i].theta_o());
            for q in 0..=all.azimuth {
                let both = if q == 0 { 1.0 } else { 2.0 };
                let (whole, part) = (all.row(i, q), rest.row(i, q));
                for c in 0..3 {
                    for l in q..bands {
                        let w = both * meter.mean(c, l);
                        let k = series.get(q).map_or(0.0, |s| s[c][l]);
                        exact[l] += w * whole[c][l].powi(2);
                        made[l] += w * k * k;
                        error[l] += w * (part[c][l] - k).powi(2);
                    }
                }
            }
            let theta_v = elevation(all, i);
            let counts = all.centre == Centre::Tangent || theta_v <= views;
            let weight = elevation(all, i).sin();
            Bands { weight, counts, theta_v, exact, made, error, tail: meter.tail(all, i) }
        };
        Self((0..all.slices.len()).map(one).collect())
    }

    /// Mean over elevations that count (or all).
    fn mean(&self, all: bool, of: impl Fn(&Bands) -> f64) -> f64 {
        let used = || self.0.iter().filter(|b| all || b.counts);
        let total: f64 = used().map(|b| b.weight).sum();
        used().map(|b| b.weight * of(b)).sum::<f64>() / total
    }

    fn exact(&self, all: bool) -> f64 {
        self.mean(all, |b| b.exact.iter().sum::<f64>() + b.tail)
    }

    /// Squared relative error of all bands.
    fn error(&self) -> f64 {
        ratio(self.mean(false, |b| b.error.iter().sum::<f64>() + b.tail), self.exact(false))
    }

    /// Squared relative error of the worst elevation that counts.
    fn worst(&self) -> f64 {
        self.0.iter().filter(|b| b.counts).map(Bands::error).fold(0.0, f64::max)
    }

    /// Gives elevations that count more weight where their error is larger than the mean (Lawson's iteration).
    fn even_out(&self, emphases: &mut [f64]) {
        let mean = self.mean(false, Bands::error);
        for (e, b) in emphases.iter_mut().zip(&self.0).filter(|(_, b)| b.counts && mean > 0.0) {
            *e *= (b.error() / mean).clamp(0.2, 5.0).powf(0.6);
        }
    }

    /// The lowest F whose cut adds at most `most` to the squared relative error.
    fn order(&self, most: f64) -> usize {
        let bands = self.0.first().map_or(1, |b| b.exact.len());
        let exact = self.exact(false);
        let cut =
            |f: usize| self.mean(false, |b| (f + 1..bands).map(|l| b.exact[l] - b.error[l]).sum::<f64>());
        (0..bands).find(|f| ratio(cut(*f), exact) <= most).unwrap_or(bands - 1)
    }

    /// F for a tolerance: what the cut adds to the mean square is little, and so is what is seen of it. A cut that is
    /// small beside a sun's lobe is a row of rings around it, so bands go on until these have faded, or to twice as
    /// many where a lobe's edge keeps them from fading.
    fn faded(&self, tolerance: f64) -> usize {
        let little = self.order((0.25 * tolerance).powi(2));
        self.order((0.02 * tolerance).powi(2)).min(2 * little)
    }

    /// Squared relative error of one elevation, cut at F and looked up between texels `h` apart.
    fn at(b: &Bands, f: usize, h: f64) -> [f64; 2] {
        let within: f64 = (0..=f).map(|l| b.error[l] + b.made[l] * meter::lookup(l, h)).sum();
        let beyond: f64 = b.exact[f + 1..].iter().sum::<f64>() + b.tail;
        [within + beyond, b.exact.iter().sum::<f64>() + b.tail]
    }
}

fn ratio(error: f64, exact: f64) -> f64 {
    if exact > 0.0 { (error / exact).max(0.0) } else { 0.0 }
}

/// How much an elevation counts in the fit, in θ_v: all alike up to 65°, then less and less, next to nothing beyond
/// 80°: what lobes are at grazing would else spoil the rest.
fn emphasis(theta_v: f64) -> f64 {
    let x = ((80f64.to_radians() - theta_v) / 15f64.to_radians()).clamp(0.0, 1.0);
    x * x + 0.002
}

/// One fit with what it was made of.
struct Fit {
    rest: Slices,
    lpq: Lpq,
    diffuse: [f64; 3],
}

fn fit(
    s: &Slices,
    p: usize,
    plain: bool,
    diffuse: bool,
    emphases: &[f64],
) -> Result<Fit, steradian_brdf::central::CentralError> {
    // The fit's own measure is sin θ_o dθ_o; views are spread evenly over the hemisphere.
    let view = |theta_o: f64| match s.centre {
        Centre::Reflection => 0.5 * theta_o,
        _ => theta_o,
    };
    // Slices are evenly spaced.
    let count = s.slices.len();
    let index = |theta_o: f64| ((theta_o / s.centre.reach() * count as f64) as usize).min(count - 1);
    let weight = |theta_o: f64| match s.centre {
        _ if plain => 1.0,
        Centre::Tangent => emphases[index(theta_o)],
        _ => emphases[index(theta_o)] * view(theta_o).sin() / theta_o.sin().max(1e-3),
    };
    let albedo = if diffuse { s.best_diffuse(p, &weight)? } else { [0.0; 3] };
    let rest = if diffuse { s.without_diffuse(albedo) } else { s.clone() };
    let scaled = !plain && s.centre != Centre::Tangent && scalable(&rest);
    Ok(Fit { lpq: Lpq::fit(&rest, p, &weight, scaled)?, rest, diffuse: albedo })
}

/// Has every elevation an albedo to divide by?
fn scalable(s: &Slices) -> bool {
    (0..3).all(|c| {
        let albedo = (0..s.slices.len()).map(|i| s.row(i, 0)[c][0]);
        let most = albedo.clone().fold(0.0, f64::max);
        albedo.fold(f64::INFINITY, f64::min) >= 0.02 * most
    })
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
    let views = if task.tolerance().is_some() { PI } else { VIEWS.to_radians() };
    let refused = refused(slug);
    let made = |order: usize, diffuse: bool| -> Result<(Fit, Powers), BakeError> {
        let plain = p.plain || p.energy_epsilon > 0.0;
        let mut emphases: Vec<f64> = match s.centre {
            Centre::Tangent => vec![1.0; s.slices.len()],
            _ => s.slices.iter().map(|s| emphasis(s.theta_v)).collect(),
        };
        let one = |emphases: &[f64]| {
            let fit = fit(s, order, plain, diffuse, emphases).map_err(&refused)?;
            let powers = Powers::new(&meter, s, &fit.rest, &fit.lpq, views);
            Ok::<_, BakeError>((fit, powers))
        };
        let mut best = one(&emphases)?;
        best.1.even_out(&mut emphases);
        for _ in 1..if plain || views > FRAC_PI_2 { 1 } else { ROUNDS } {
            let next = one(&emphases)?;
            next.1.even_out(&mut emphases);
            if next.1.worst() < best.1.worst() {
                best = next;
            }
        }
        Ok(best)
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
        // Where nobody asks for a tolerance each elevation that counts is to meet it, not only their mean, and a light
        // may fall worse than in the mean over all frames.
        let shares = if task.tolerance().is_none() { [0.65, 1.0] } else { [0.85, f64::INFINITY] };
        let [mean, each] = shares.map(|x| x * tolerance);
        let met = |x: &Powers| x.error().sqrt() <= mean && x.worst().sqrt() <= each;
        (search(p, most, met, made)?, p.order)
    };
    let diffuse = best.0.diffuse;
    let f = fixed.map_or_else(|| best.1.faded(tolerance), |f| f.min(s.order));
    let q = azimuth(&best.0.lpq, &meter, best.1.exact(true));
    best.0.lpq = best.0.lpq.truncated(f, best.0.lpq.p);
    let lookups = |size: usize| {
        let h = spacing(size);
        let blur = |b: &Bands| (0..=f).map(|l| b.made[l] * meter::lookup(l, h)).sum::<f64>();
        ratio(best.1.mean(false, blur), best.1.exact(false))
    };
    let enough = |size: usize| lookups(size) <= (0.25 * tolerance).powi(2);
    let size = if p.size > 0 { p.size } else { meter::size(MOST_SIZE, enough).max(8) };
    let certificate = certify(&best.1, f, spacing(size))
        .detail("F", f as f64)
        .detail("P", best.0.lpq.p as f64)
        .detail("Q", q as f64)
        .detail("S", size as f64)
        .detail("centre (1 mirror direction, 2 normal, 3 tangent)", word(s.centre))
        .detail("diffuse part", diffuse.iter().sum::<f64>() / 3.0)
        .detail("missing energy of the reflectance", missing(&best.0, f));
    let scale = best.0.lpq.scale.as_ref().map_or_else(ScaleTable::one, |scale| {
        let half = if s.centre == Centre::Reflection { 0.5 } else { 1.0 };
        let angles: Vec<f64> = scale.theta_o.iter().map(|t| half * t).collect();
        ScaleTable::new(&angles, |i| scale.factor[i])
    });
    Ok(Expansion { lpq: best.0.lpq, f, q, diffuse, scale, size, certificate })
}

/// 1 − the share of (5.18) of the channel that fares worst.
fn missing(fit: &Fit, f: usize) -> f64 {
    (1.0 - fit.lpq.share(f, fit.lpq.p)).max(0.0)
}

/// The lowest P that meets the tolerance, with a diffuse part of its own where that makes P lower (or, where no P does,
/// the error less).
fn search(
    p: &Orders,
    most: usize,
    met: impl Fn(&Powers) -> bool,
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
            let error = candidate.1.error().sqrt();
            // More maps must be worth it.
            if best.as_ref().is_none_or(|b| error < if diffuse { 0.9 } else { 0.97 } * b.0) {
                best = Some((error, candidate));
            }
            if best.as_ref().is_some_and(|b| met(&b.1.1)) {
                break;
            }
        }
        if best.as_ref().is_some_and(|b| met(&b.1.1)) {
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
        // Mean of y_pq² over views.
        rows.sum::<f64>() / (4.0 * PI)
    };
    (0..=lpq.azimuth()).rev().find(|q| power(*q) > ROUNDING * exact).unwrap_or(0)
}

/// The error of every elevation and of their mean.
fn certify(powers: &Powers, f: usize, h: f64) -> Certificate {
    let (mut error, mut exact) = (0.0, 0.0);
    let mut near = (0.0, 0.0);
    for b in &powers.0 {
        let [e, x] = Powers::at(b, f, h);
        (error, exact) = (error + b.weight * e, exact + b.weight * x);
        if b.theta_v <= VIEWS.to_radians() {
            near = (near.0 + b.weight * e, near.1 + b.weight * x);
        }
    }
    let mut certificate = Certificate::new(ratio(error, exact).sqrt(), Known::Estimated)
        .metric(METRIC)
        .detail("error of views up to 60 degrees", ratio(near.0, near.1).sqrt());
    for degrees in [0, 10, 20, 30, 40, 50, 60, 65, 70, 75, 80, 85, 88] {
        let angle = |b: &&Bands| (b.theta_v - f64::from(degrees).to_radians()).abs();
        if let Some(b) = powers.0.iter().min_by(|a, b| angle(a).total_cmp(&angle(b))) {
            let [e, x] = Powers::at(b, f, h);
            certificate = certificate.detail(format!("error at {degrees} degrees"), ratio(e, x).sqrt());
        }
    }
    certificate
}

/// What the error is, in a certificate's words.
pub const METRIC: &str = "relative RMS error of outgoing radiance, normals and azimuths uniform (computed from the \
                          spectra of light and reflectance, and of lookups), views uniform in solid angle";
