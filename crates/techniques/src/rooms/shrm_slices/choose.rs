//! How much of the light becomes maps, and what is known of the error.

use super::components::{Component, Expansion, Limits};
use super::material::{Params, TOLERANCE};
use super::pursue::{pursue, with};
use super::scaled::Scaled;
use crate::BakeError;
use crate::certify::Report;
use crate::shared::light::apart::{Apart, LEAST};
use crate::shared::light::sunlit_spectrum::SunlitSpectrum;
use crate::shared::material::kernels::Kernels;
use crate::shared::shrm::ANGLES;
use steradian_base::{Elevation, Task};

/// Numbers of disks that are tried.
const COUNTS: [usize; 4] = [8, 32, 64, 128];
/// Maps hold the light without suns to so many times the tolerance, relative to its own radiance: as few
/// times as …
const RESTS: [f64; 5] = [6.0, 4.0, 2.5, 1.5, 1.1];
/// … so many bytes of maps allow, where the user asks for no tolerance, and for this one: bytes grow about
/// like its inverse.
const AMPLE: [usize; 2] = [8 << 20, 64 << 20];
const ASKED: f64 = 0.01;
/// To these where views beyond those that count need it.
const NEARER: [f64; 2] = [0.75, 0.5];
/// Bytes of maps below which no more disks are looked for, where the tolerance is met.
const CHEAP: usize = 4 << 20;
/// As many disks take as much time as all maps: they must save half of the bytes.
const WORTH: f64 = 64.0;

/// What is made into maps, what is not, and the error of both together.
pub struct Choice {
    pub apart: Apart,
    pub expansion: Expansion,
    pub scale: Vec<[f64; 3]>,
    pub report: Report,
    /// The error over all views.
    error: f64,
    /// Largest squared relative error of an elevation that counts.
    worst: f64,
    /// Does the rest have more than the tolerance of its own radiance?
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
        let meter = apart.meter();
        // Radiance that suns dominate tells little of the rest, which maps hold on its own.
        let parts = Scaled::totals(s, &meter);
        let least = |(part, total): (&f64, &f64)| part.max(LEAST * total).min(*total);
        let own: Vec<f64> = parts.iter().zip(totals).map(least).collect();
        let goal = |(part, total): (&f64, &f64)| (rest * rest * part).max(LEAST * total).min(*total);
        let goals: Vec<f64> = parts.iter().zip(totals).map(goal).collect();
        let lenient = goals.iter().zip(&parts).any(|(goal, part)| *goal > 1.001 * part);
        let scaled = Scaled::new(s, &meter, goals);
        let expansion = Expansion::new(&scaled, tolerance, limits);
        let errors: Vec<f64> =
            (0..scaled.len()).map(|i| expansion.error(&scaled, i) * scaled.total[i]).collect();
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
        Self { apart, expansion, scale: scaled.scale, report, error, worst, lenient }
    }

    /// By how much the tolerance is missed, in steps of some per cent; then bytes, and time as bytes.
    fn cost(&self, tolerance: f64) -> (u64, f64) {
        let miss = (self.worst.sqrt() / tolerance).max(1.0);
        let time = 1.0 + self.apart.suns.len() as f64 / WORTH;
        ((20.0 * miss).ceil() as u64, self.expansion.bytes() as f64 * time)
    }
}

/// The cheapest choice that meets the tolerance, or the one that misses it least. Suns are always taken out:
/// cut off at F they ring, which little of the mean square tells.
pub fn choose(
    light: &SunlitSpectrum,
    material: &Kernels,
    p: &Params,
    task: &Task,
) -> Result<Choice, BakeError> {
    let tolerance = task.tolerance().unwrap_or(TOLERANCE);
    let limits = Limits { order: p.order, size: p.size.unwrap_or(0), bytes: p.budget(task) };
    let asked = |t: f64| (AMPLE[1] as f64 * (ASKED / t).min(1.0)) as usize;
    let ample = task.tolerance().map_or(AMPLE[0], asked).min(limits.bytes);
    let s = &material.slices;
    let whole = Apart::suns(light, 0).meter();
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
    for count in COUNTS.into_iter().filter(|c| *c <= found.len()) {
        task.check()?;
        let next = made(with(&suns, &found, count), RESTS[0]);
        if next.cost(tolerance) < best.cost(tolerance) {
            best = next;
        }
    }
    Ok(finer(best, tolerance, ample, &made))
}

/// The same disks with the rest as near to the tolerance of its own radiance as is `ample`; nearer still
/// where views beyond those that count spoil the mean of all.
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
