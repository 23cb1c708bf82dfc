//! Choice of the hypothesis that explains the levels, or else a description of the unexplained error.

use super::Search;
use super::bench::SMALL;
use crate::measure;
use crate::model::{Hypothesis, Kinds};
use crate::orientation::Orientation;
use crate::report::{Fault, Nearest, Report};
use crate::texture;
use glam::DMat3;
use steradian_base::{Cancelled, Task};
use steradian_light::load::{PROFILES, Profile};

/// ln of the factor by which a hypothesis must explain more than those of other kinds. Of 48 hypotheses for
/// files with one planted fault, under two lights, the right ones are ahead by 1.5 and more, and the only
/// wrong one by 0, where two kernels are the same (Lambert's and GGX of roughness 1): half and twice give the
/// same decisions.
const MIN_LEAD_LN: f64 = 0.3;
/// A hypothesis counts as an explanation only if its residual is below this, or below [`EXPLAINED_PART`] of
/// the file's error. Of planted faults with an error below 0.27, where this bound decides, right hypotheses
/// leave 0.011 at most: half and twice give the same decisions.
const EXPLAINED_RESIDUAL: f64 = 0.04;
/// Part of the file's error that an explanation may leave: planted faults of larger errors leave 0.016 of
/// them at most, so that half and twice give the same decisions.
const EXPLAINED_PART: f64 = 0.15;
/// Largest residual of an explanation, however large the error is. Right hypotheses leave up to 0.037 (box
/// filters), so that half as much decides alike; twice as much would also accept the right one of a studio
/// that was turned by 36.6°, of which interpolation leaves 0.19.
const MAX_EXPLAINED_RESIDUAL: f64 = 0.12;

impl Search<'_, '_> {
    pub(super) fn best(&self) -> &Hypothesis {
        let cost = |h: &&Hypothesis| h.cost(self.floor);
        self.tried.iter().min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(&self.tried[0])
    }

    /// The best of each kind, the cheapest first.
    fn ranked(&self) -> Vec<&Hypothesis> {
        let mut all: Vec<&Hypothesis> = self.tried.iter().collect();
        all.sort_by(|a, b| a.cost(self.floor).total_cmp(&b.cost(self.floor)));
        let mut kinds: Vec<Kinds> = Vec::new();
        all.retain(|h| {
            let new = !kinds.contains(&h.kinds());
            kinds.push(h.kinds());
            new
        });
        all
    }

    pub(super) fn decide(&self, task: &Task) -> Result<Report, Cancelled> {
        let bench = self.bench;
        let ranked = self.ranked();
        let best = ranked[0];
        let none = best.faults(bench.input.expected, Vec::new()).is_empty();
        let as_it_is = self.tried.iter().filter(|h| h.faults(bench.input.expected, Vec::new()).is_empty());
        let as_it_is = as_it_is.min_by(|a, b| a.score.residual.total_cmp(&b.score.residual)).unwrap_or(best);
        let mut faults = bench.marks.clone();
        let level_off = |m: usize, r: f64| r > SMALL.max(1.2 * self.open[m]).hypot(1.3 * bench.rounding[m]);
        let off = |h: &Hypothesis| h.score.levels.iter().enumerate().any(|(m, r)| level_off(m, *r));
        if !none && self.clear(best, as_it_is.score.residual, &ranked) {
            faults
                .extend(best.faults(bench.input.expected, conventions(&best.orientation, bench.input.read)));
            if off(best) {
                faults.push(Fault::Remains(best.score.residual));
            }
            task.begin("filtering what was found", bench.input.levels.len() as u64);
            let lights = best.light.of(bench.input.lights);
            let exact = measure::filtered(&lights, &best.kernels, bench.input.levels, task)?;
            task.end();
            return Ok(bench.report(Some((best, &exact)), faults, None));
        }
        if off(as_it_is) {
            faults.push(self.texture(as_it_is, &ranked));
        }
        Ok(bench.report(None, faults, self.reading))
    }

    /// Does a hypothesis explain clearly more than those of other kinds, and enough?
    fn clear(&self, best: &Hypothesis, all: f64, ranked: &[&Hypothesis]) -> bool {
        let kinds = best.kinds();
        let rival = ranked.iter().find(|h| !kinds.within(h.kinds()));
        let ahead = rival.is_none_or(|r| r.cost(self.floor) - best.cost(self.floor) > MIN_LEAD_LN);
        ahead
            && best.score.residual
                < EXPLAINED_RESIDUAL.max((EXPLAINED_PART * all).min(MAX_EXPLAINED_RESIDUAL))
    }

    /// Describes an error that no hypothesis explains.
    fn texture(&self, as_it_is: &Hypothesis, ranked: &[&Hypothesis]) -> Fault {
        let bench = self.bench;
        let residual = as_it_is.score.residual;
        let off = (0..bench.input.levels.len()).filter(|&m| bench.straight[m] > SMALL);
        let mut noisy =
            off.map(|m| texture::is_noise(&bench.input.levels[m], &bench.references[m], &bench.sound[m]));
        // Small levels hold too few texels to tell.
        if residual < 0.5 && noisy.next() == Some(true) {
            return Fault::Noise(residual);
        }
        let expected = bench.input.expected;
        let near = ranked.iter().filter(|h| !h.faults(expected, Vec::new()).is_empty()).take(3);
        let near =
            near.map(|h| Nearest { faults: h.faults(expected, Vec::new()), residual: h.score.residual });
        Fault::Unexplained(residual, near.collect())
    }
}

/// Conventions by which the light would have to be read to undo a turn.
fn conventions(orientation: &Orientation, read: &Profile) -> Vec<&'static str> {
    let Orientation::Axes(g) = orientation else { return Vec::new() };
    // World w of another tool is our direction p w, and found at w = pᵀ d.
    let same = |p: &&Profile| (p.latlong().transpose() * read.latlong() - *g).abs_diff_eq(DMat3::ZERO, 1e-9);
    PROFILES.iter().filter(same).map(|p| p.name).collect()
}
