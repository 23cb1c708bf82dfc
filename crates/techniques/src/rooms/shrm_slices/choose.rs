//! Choice of the part of the light that maps hold, and its error.

use super::components::{Component, Expansion, Limits};
use super::material::{Params, TOLERANCE};
use super::pursue::{pursue, with};
use super::scaled::Scaled;
use crate::BakeError;
use crate::certify::Report;
use crate::shared::light::sunlit_spectrum::SunlitSpectrum;
use crate::shared::material::kernels::Kernels;
use crate::shared::shrm::ANGLES;
use steradian_base::{Elevation, Task};
use steradian_parallel::prelude::*;
use steradian_prefilter::Apart;
use steradian_prefilter::shrm::spectral_error::SpectralError;

/// Candidate numbers of disks that are taken out of the light in addition to suns.
const COUNTS: [usize; 4] = [8, 32, 64, 128];
/// Candidate errors of maps, in tolerances, relative to the radiance of the light without suns alone, the
/// largest first: they are lowered as far as [`AMPLE`] bytes of maps allow.
const RESTS: [f64; 5] = [6.0, 4.0, 2.5, 1.5, 1.1];
/// Bytes of maps up to which errors are lowered: where the user gives no tolerance, and where it is
/// [`ASKED_TOLERANCE`]. For a larger tolerance the number falls like its inverse, as the bytes of maps do.
const AMPLE: [usize; 2] = [8 << 20, 64 << 20];
/// The tolerance of the second of [`AMPLE`]: the default one, for which who asks for it gets eight times the
/// bytes of who asks for none.
const ASKED_TOLERANCE: f64 = 0.01;
/// Smaller errors, in tolerances, that are tried where the error over all views still misses the tolerance
/// because of views that do not count.
const NEARER: [f64; 2] = [0.75, 0.5];
/// Where the tolerance is met with fewer bytes of maps than this, no disks are taken out.
const CHEAP: usize = 4 << 20;
/// Number of disks whose exact shading takes as long as all maps: so many disks must save half of the bytes.
const WORTH: f64 = 64.0;

/// Where no tolerance is given, disks that leave at most this part of the mean square radiance in maps, as
/// seen along the normal, are taken out even if maps of all light err less. Such maps ring around what is
/// so bright, over the dark beside it, which the mean square hardly shows: of a sphere of GGX 0.1 in a
/// studio (`studio_small_03`) a tenth of the points were off by 66 % and more at a certified error of 1.1
/// %; with 31 disks, which leave 4 %, it is 16 % at 2.0 %. In ten other photographs as many disks leave 38
/// % or more.
const FEW_LIGHTS: f64 = 0.1;
/// The largest error of an elevation with such disks. That of `sgd:chrome-steel`, whose lobes are narrower
/// than a disk, would be far above it: 75 to 90 % over all views.
const FEW_LIGHTS_ERROR: f64 = 0.05;

/// A split of the light into maps and exactly shaded disks, and the error of both together.
pub struct Choice {
    pub apart: Apart,
    pub expansion: Expansion,
    pub scale: Vec<[f64; 3]>,
    pub report: Report,
    /// The error over all views.
    error: f64,
    /// Largest squared relative error of an elevation that counts.
    worst: f64,
    /// Mean square radiance of the light in maps, seen along the normal.
    in_maps: f64,
    /// Is the light in maps allowed a larger error than the tolerance of its own radiance?
    lenient: bool,
}

impl Choice {
    fn new(
        totals: &[f64],
        material: &Kernels,
        apart: Apart,
        rest: f64,
        tolerance: f64,
        limits: Limits,
    ) -> Self {
        let s = &material.slices;
        let spectral_error = SpectralError::of(&apart);
        // Where suns dominate the radiance, errors relative to it would bound those of the maps' own light
        // poorly.
        let parts = Scaled::totals(s, &spectral_error);
        let least = |(part, total): (&f64, &f64)| part.max(Apart::LEAST * total).min(*total);
        let own: Vec<f64> = parts.iter().zip(totals).map(least).collect();
        let goal = |(part, total): (&f64, &f64)| (rest * rest * part).max(Apart::LEAST * total).min(*total);
        let goals: Vec<f64> = parts.iter().zip(totals).map(goal).collect();
        let lenient = goals.iter().zip(&parts).any(|(goal, part)| *goal > 1.001 * part);
        let scaled = Scaled::new(s, &spectral_error, goals);
        let expansion = Expansion::new(&scaled, tolerance, limits);
        let errors = expansion.errors(&scaled).into_iter().zip(&scaled.total);
        let errors: Vec<f64> = errors.map(|(error, total)| error * total).collect();
        let relative = |to: &[f64]| errors.iter().zip(to).map(|(e, x)| e / x).collect::<Vec<f64>>();
        let worst = |squares: &[f64]| {
            let counted = (0..scaled.len()).filter(|i| scaled.counts(*i));
            counted.map(|i| squares[i]).fold(0.0, f64::max)
        };
        let (squares, beside) = (relative(totals), relative(&own));
        let error = mean(&scaled, totals, &squares);
        let elevations = elevations(&scaled, &squares, &beside);
        let report = figures(Report::estimated(error, elevations), &expansion.components)
            .detail("lights", apart.suns.len() as f64)
            .detail("error beside the suns", worst(&beside).sqrt());
        let worst = worst(&squares);
        let in_maps = parts[0];
        Self { apart, expansion, scale: scaled.scale, report, error, worst, in_maps, lenient }
    }

    /// Cost of a choice: how far the tolerance is missed, in steps of 5 %; then bytes, with the shading
    /// time of disks counted as bytes. `in_maps` is of the light without suns, where no tolerance is given:
    /// where its disks are few lights that outshine the rest, it counts as missing nothing.
    fn cost(&self, tolerance: f64, in_maps: Option<f64>) -> (u64, f64) {
        let miss = (self.worst.sqrt() / tolerance).max(1.0);
        let few = in_maps.is_some_and(|all| self.in_maps <= FEW_LIGHTS * all);
        let miss = if few && self.worst.sqrt() <= FEW_LIGHTS_ERROR { 0.0 } else { miss };
        let time = 1.0 + self.apart.suns.len() as f64 / WORTH;
        ((20.0 * miss).ceil() as u64, self.expansion.bytes() as f64 * time)
    }
}

/// The cheapest choice that meets the tolerance, or the one that misses it least. Suns are always taken out:
/// truncated at F they ring, which the mean square hardly shows.
pub fn choose(
    light: &SunlitSpectrum,
    material: &Kernels,
    p: &Params,
    task: &Task,
) -> Result<Choice, BakeError> {
    let tolerance = task.tolerance().unwrap_or(TOLERANCE);
    let limits = Limits { order: p.order, size: p.size.unwrap_or(0), bytes: p.budget(task) };
    let asked = |t: f64| (AMPLE[1] as f64 * (ASKED_TOLERANCE / t).min(1.0)) as usize;
    let ample = task.tolerance().map_or(AMPLE[0], asked).min(limits.bytes);
    let s = &material.slices;
    let whole = SpectralError::of(&Apart::suns(light, 0));
    let totals = Scaled::totals(s, &whole);
    let made = |apart: Apart, rest: f64| Choice::new(&totals, material, apart, rest, tolerance, limits);
    let most = if material.brdf.is_some() { p.lights.unwrap_or(usize::MAX) } else { 0 };
    let suns = Apart::suns(light, most);
    let more = most.min(COUNTS[COUNTS.len() - 1]).saturating_sub(suns.suns.len());
    let scaled = Scaled::new(s, &whole, totals.clone());
    if p.lights.is_some() {
        let found = pursue(&suns, &scaled, more, task)?;
        return Ok(finer(made(with(&suns, &found, more), RESTS[0]), tolerance, ample, &made));
    }
    let mut best = made(suns.clone(), RESTS[0]);
    if more == 0 || (best.worst.sqrt() <= tolerance && best.expansion.bytes() <= CHEAP) {
        return Ok(finer(best, tolerance, ample, &made));
    }
    let found = pursue(&suns, &scaled, more, task)?;
    let counts: Vec<usize> = COUNTS.into_iter().filter(|c| *c <= found.len()).collect();
    task.check()?;
    let tried: Vec<Choice> =
        counts.into_par_iter().map(|count| made(with(&suns, &found, count), RESTS[0])).collect();
    let in_maps = task.tolerance().is_none().then_some(best.in_maps);
    for next in tried {
        if next.cost(tolerance, in_maps) < best.cost(tolerance, in_maps) {
            best = next;
        }
    }
    Ok(finer(best, tolerance, ample, &made))
}

/// Keeps the disks of `best` and lowers the error of the maps, in the steps of [`RESTS`], as far as `ample`
/// bytes allow; further, by [`NEARER`], where views that do not count keep the mean over all views above the
/// tolerance.
fn finer(mut best: Choice, tolerance: f64, ample: usize, made: &dyn Fn(Apart, f64) -> Choice) -> Choice {
    for rest in RESTS.into_iter().skip(1) {
        if !best.lenient || best.expansion.bytes() > ample / 2 {
            break;
        }
        let next = made(best.apart.clone(), rest);
        if next.expansion.bytes() > ample || next.worst > best.worst.max(tolerance * tolerance) {
            break;
        }
        best = next;
    }
    for rest in NEARER {
        if best.error <= tolerance || best.worst > tolerance * tolerance {
            break;
        }
        let next = made(best.apart.clone(), rest);
        if next.expansion.bytes() <= ample && next.error < best.error {
            best = next;
        }
    }
    best
}

/// The error of all views, uniform in solid angle.
fn mean(scaled: &Scaled<'_>, totals: &[f64], squares: &[f64]) -> f64 {
    let last = scaled.len() - 1;
    let cosine = |i: usize| scaled.angle(i).cos();
    let (mut error, mut exact) = (0.0, 0.0);
    for i in 0..=last {
        let weight = 0.5 * (cosine(i.saturating_sub(1)) - cosine((i + 1).min(last))) * totals[i];
        (error, exact) = (error + weight * squares[i], exact + weight);
    }
    if exact > 0.0 { (error / exact).sqrt() } else { 0.0 }
}

/// The error of the elevation nearest to each angle that is stated.
fn elevations(scaled: &Scaled<'_>, squares: &[f64], beside: &[f64]) -> Vec<Elevation> {
    let at = |degrees: &f64| {
        let theta_o = degrees.to_radians();
        let off = |i: &usize| (scaled.angle(*i) - theta_o).abs();
        let i = (0..scaled.len()).min_by(|a, b| off(a).total_cmp(&off(b)))?;
        let beside_suns = Some(beside[i].sqrt());
        Some(Elevation { beside_suns, ..Elevation::computed(theta_o, squares[i].sqrt()) })
    };
    ANGLES.iter().filter_map(at).collect()
}

fn figures(report: Report, components: &[Component]) -> Report {
    let most = |of: &dyn Fn(&Component) -> usize| components.iter().map(of).max().unwrap_or(0) as f64;
    let heard =
        |c: &Component| c.v.iter().filter_map(|v| v.iter().rposition(|x| *x != 0.0)).max().unwrap_or(0);
    report
        .detail("components", components.len() as f64)
        .detail("maps", components.iter().map(Component::maps).sum::<usize>() as f64)
        .detail("highest F", most(&|c| heard(c).min(c.size)))
        .detail("highest Q", most(&|c| c.q))
        .detail("largest size", most(&|c| c.size))
        .detail("bytes", components.iter().map(Component::bytes).sum::<usize>() as f64)
}
