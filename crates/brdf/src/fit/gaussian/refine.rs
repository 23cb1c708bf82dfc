//! Means and widths of one elevation: Levenberg and Marquardt on the error that is left when the weights are
//! the best ones.

use super::slice::Slice;
use super::weights::{self, Weights};
use super::{GaussianLobe, MAX_LOBES};
use std::f64::consts::{FRAC_PI_2, PI};
use steradian_simd::{Arch, Kernel, MAX_F64_LANES, Vector};

/// The lobes of one elevation.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub lobes: Vec<GaussianLobe>,
    /// ∫ (T − fit)².
    pub error: f64,
    pub converged: bool,
}

/// Largest σ, radians. Of GGX of alpha 0.4 the mean error is 0.057; with half as much too, with twice as much
/// 0.058.
const MAX_SIGMA: f64 = 1.2;
/// Steps of a search at most. 30 leave one of 15 views unconverged of GGX (alpha 0.4) and of measured chrome;
/// 120 give the same fits.
pub(super) const STEPS: usize = 60;
/// Steps of every start before the worse ones are given up. Three and 12 change the mean errors of GGX,
/// measured chrome and Oren and Nayar's model by 2e-4 at most.
const TRIAL_STEPS: usize = 6;
/// Relative decrease of the error at which a search ends: for round, and for stretched lobes. Half and twice
/// change the mean errors of those fits by 2e-4 at most.
const CONVERGED_DECREASE: [f64; 2] = [1e-5, 1e-4];

/// Largest s, radians. Half as much raises the mean error of GGX of alpha 0.4 from 0.057 to 0.058; twice as
/// much gives the same fits.
const MAX_SWEEP: f64 = 1.0;
/// Polar angle of a mean, away from wo, ln σ and ln s; where lobes are turned also its angle out of the
/// plane, and that of the sweep.
type Place = [f64; 5];
/// Indices of the parameters that are angles of the mean.
const ANGLES: [usize; 2] = [0, 3];

/// Settings of a search.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kind {
    pub lobes: usize,
    /// Is the albedo kept?
    pub keep: bool,
    pub stretched: bool,
    /// Is the reflectance anisotropic, so that means may lie off the plane of incidence and sweeps have
    /// directions of their own?
    pub turned: bool,
}

/// One state of the search.
struct State {
    places: Vec<Place>,
    weights: [Weights; 3],
    error: f64,
    /// ΦᵀΦ of the lobes and their derivatives: with F free numbers of a place, lobe k has rows (1 + F)k
    /// (value), then by the place's.
    gram: Vec<Vec<f64>>,
    /// Φᵀ T per channel.
    onto: [Vec<f64>; 3],
}

/// Σ a b of a column with each of four, which takes each number of it from the memory once.
#[inline(always)]
fn dots<A: Arch>(a: &[f64], b: [&[f64]; 4]) -> [f64; 4] {
    let (n, lanes) = (a.len(), A::F64::LANES);
    let b = [&b[0][..n], &b[1][..n], &b[2][..n], &b[3][..n]];
    // Two registers each, since a sum waits for the one before it.
    let mut sums = [[A::F64::splat(0.0); 4]; 2];
    let mut at = 0;
    while at + 2 * lanes <= n {
        for sums in &mut sums {
            let x = A::F64::load(&a[at..]);
            for (sum, b) in sums.iter_mut().zip(&b) {
                *sum = x.fma(A::F64::load(&b[at..]), *sum);
            }
            at += lanes;
        }
    }
    let mut out = [0.0; 4];
    for k in 0..4 {
        let mut parts = [0.0; MAX_F64_LANES];
        sums[0][k].add(sums[1][k]).store(&mut parts);
        let rest: f64 = a[at..].iter().zip(&b[k][at..]).map(|(a, b)| a * b).sum();
        out[k] = parts.iter().sum::<f64>() + rest;
    }
    out
}

/// Products of all columns with each other, and with the channels.
pub(super) struct Products<'a> {
    pub columns: &'a [Vec<f64>],
    pub t: &'a [Vec<f64>; 3],
    /// Where products of two columns may be left 0.
    pub apart: Option<&'a dyn Fn(usize, usize) -> bool>,
}

impl Kernel for Products<'_> {
    type Output = (Vec<Vec<f64>>, [Vec<f64>; 3]);

    #[inline(always)]
    fn run<A: Arch>(self) -> Self::Output {
        let n = self.columns.len();
        let mut gram = vec![vec![0.0; n]; n];
        let mut onto: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; n]);
        let mut near = Vec::new();
        for (i, column) in self.columns.iter().enumerate() {
            near.clear();
            near.extend((0..=i).filter(|j| self.apart.is_none_or(|apart| !apart(i, *j))));
            for four in near.chunks(4) {
                let of = |k: usize| self.columns[four[k.min(four.len() - 1)]].as_slice();
                let products = dots::<A>(column, [of(0), of(1), of(2), of(3)]);
                for (j, v) in four.iter().zip(products) {
                    (gram[i][*j], gram[*j][i]) = (v, v);
                }
            }
            let [red, green, blue] = self.t;
            let products = dots::<A>(column, [red, green, blue, blue]);
            for c in 0..3 {
                onto[c][i] = products[c];
            }
        }
        (gram, onto)
    }
}

/// Storage of the Gaussians over the points.
struct Search<'a> {
    slice: &'a Slice,
    kind: Kind,
    /// Free numbers of a place: 2, 3 where lobes are stretched, 5 where they are turned. Seen along the
    /// normal those of isotropic reflectance are round.
    free: usize,
    columns: Vec<Vec<f64>>,
}

/// A search on its way.
struct Run {
    state: State,
    damping: f64,
    converged: bool,
}

impl<'a> Search<'a> {
    fn new(slice: &'a Slice, kind: Kind) -> Self {
        let free = match kind {
            Kind { turned: true, .. } => 5,
            Kind { stretched: true, .. } if slice.theta > 0.0 => 3,
            _ => 2,
        };
        Self { slice, kind, free, columns: Vec::new() }
    }

    fn bounds(&self) -> [[f64; 2]; 5] {
        let narrow = (0.25 * self.slice.narrow).max(1e-4);
        // Seen along the normal, means of isotropic reflectance stay on it.
        let fixed = self.slice.theta == 0.0 && !self.kind.turned;
        let angle = if fixed { [0.0; 2] } else { [-FRAC_PI_2, FRAC_PI_2 + 0.3] };
        // The direction of the sweep is an angle without bounds.
        let turn = [f64::NEG_INFINITY, f64::INFINITY];
        [angle, [narrow.ln(), MAX_SIGMA.ln()], [(0.1 * narrow).ln(), MAX_SWEEP.ln()], [-1.4, 1.4], turn]
    }

    /// s of a place.
    fn sweep(&self, place: &Place) -> f64 {
        if self.free >= 3 { place[2].exp() } else { 0.0 }
    }

    fn state(&mut self, places: Vec<Place>) -> State {
        let (k, rows) = (places.len(), 1 + self.free);
        self.columns.resize(rows * k, Vec::new());
        for (i, place) in places.iter().enumerate() {
            let sweep = self.sweep(place);
            let columns = &mut self.columns[rows * i..rows * (i + 1)];
            let angles = [place[0], place[3], place[4]];
            self.slice.gaussian(angles, place[1].exp(), sweep, columns);
        }
        let (gram, onto) =
            steradian_simd::run(Products { columns: &self.columns, t: &self.slice.t, apart: None });
        let mut small = [[0.0; MAX_LOBES]; MAX_LOBES];
        (0..k).for_each(|i| (0..k).for_each(|j| small[i][j] = gram[rows * i][rows * j]));
        let mut error = self.slice.square[0];
        let weights = std::array::from_fn(|c| {
            let mut b = [0.0; MAX_LOBES];
            (0..k).for_each(|i| b[i] = onto[c][rows * i]);
            let sum = self.kind.keep.then_some(self.slice.albedo[c]);
            let w = weights::best(k, &small, b, sum);
            for i in 0..k {
                let into: f64 = (0..k).map(|j| small[i][j] * w.w[j]).sum();
                error += w.w[i] * (into - 2.0 * b[i]);
            }
            w
        });
        State { places, weights, error: error.max(0.0), gram, onto }
    }

    /// Half the gradient of the error by the parameters, and half of the Gauss–Newton matrix: the derivatives
    /// of the Gaussians less the part that new weights compensate for (Kaufman 1975).
    fn normal(&self, state: &State) -> (Vec<f64>, Vec<Vec<f64>>) {
        let (k, free, rows) = (state.places.len(), self.free, 1 + self.free);
        let n = free * k;
        let row = |p: usize| rows * (p / free) + 1 + p % free;
        let (mut gradient, mut matrix) = (vec![0.0; n], vec![vec![0.0; n]; n]);
        for (weights, onto) in state.weights.iter().zip(&state.onto) {
            let w = &weights.w;
            for p in 0..n {
                let d = &state.gram[row(p)];
                let fitted: f64 = (0..k).map(|j| w[j] * d[rows * j]).sum();
                gradient[p] -= w[p / free] * (onto[row(p)] - fitted);
                let mut made_up = [0.0; MAX_LOBES];
                for (j, m) in made_up.iter_mut().enumerate().take(k) {
                    *m = (0..k).map(|i| d[rows * i] * weights.follow[i][j]).sum();
                }
                for q in 0..=p {
                    let e = &state.gram[row(q)];
                    let v = d[row(q)] - (0..k).map(|j| made_up[j] * e[rows * j]).sum::<f64>();
                    matrix[p][q] += w[p / free] * w[q / free] * v;
                }
            }
        }
        for p in 0..n {
            for q in 0..p {
                matrix[q][p] = matrix[p][q];
            }
        }
        (gradient, matrix)
    }

    fn inside(&self, mut p: Vec<Place>) -> Vec<Place> {
        let bounds = self.bounds();
        p.iter_mut().for_each(|p| p.iter_mut().zip(bounds).for_each(|(v, b)| *v = v.clamp(b[0], b[1])));
        p
    }

    fn begin(&mut self, start: Vec<Place>) -> Run {
        let start = self.inside(start);
        Run { state: self.state(start), damping: 1e-2, converged: false }
    }

    /// Up to `steps` steps.
    fn advance(&mut self, run: &mut Run, steps: usize) {
        let enough = CONVERGED_DECREASE[usize::from(self.kind.stretched)];
        for _ in 0..steps {
            if run.converged {
                return;
            }
            let state = &run.state;
            let (gradient, matrix) = self.normal(state);
            let largest = (0..gradient.len()).map(|i| matrix[i][i]).fold(0.0, f64::max);
            let mut better = None;
            while largest > 0.0 && run.damping < 1e8 {
                let Some(step) = step(&gradient, &matrix, run.damping, largest) else { break };
                let mut places = state.places.clone();
                for (p, s) in places.iter_mut().zip(step.chunks_exact(self.free)) {
                    // No further than a width sideways and a factor of two in widths at once.
                    let most = p[1].exp().max(self.sweep(p)).max(0.01);
                    for (i, (p, s)) in p.iter_mut().zip(s).enumerate() {
                        let most = if ANGLES.contains(&i) { most } else { 0.7 };
                        *p += s.clamp(-most, most);
                    }
                }
                let places = self.inside(places);
                let next = self.state(places);
                if next.error < state.error {
                    better = Some(next);
                    break;
                }
                run.damping *= 6.0;
            }
            let Some(next) = better else {
                run.converged = true;
                return;
            };
            run.damping = (run.damping * 0.2).max(1e-9);
            run.converged = run.state.error - next.error <= enough * run.state.error;
            run.state = next;
        }
    }

    /// Searches from each of the starts, `steps` long at most.
    fn best_of(&mut self, starts: Vec<Vec<Place>>, steps: usize) -> Vec<Fitted> {
        let count = starts.len();
        let mut runs: Vec<Run> = starts.into_iter().map(|s| self.begin(s)).collect();
        if self.kind.stretched {
            // Searches that are behind after some steps seldom win.
            runs.iter_mut().for_each(|run| self.advance(run, TRIAL_STEPS));
            runs.sort_by(|a, b| a.state.error.total_cmp(&b.state.error));
            runs.truncate(1 + count / 2);
        }
        runs.iter_mut().for_each(|run| self.advance(run, steps));
        runs.into_iter().map(|r| self.end(r)).collect()
    }

    fn end(&self, run: Run) -> Fitted {
        let Run { state, converged, .. } = run;
        let lobe = |(k, p): (usize, &Place)| GaussianLobe {
            angle: p[0] - self.slice.theta,
            aside: p[3],
            sigma: p[1].exp(),
            sweep: self.sweep(p),
            // Half a turn changes nothing.
            turn: p[4] - PI * (p[4] / PI).round(),
            weight: std::array::from_fn(|c| state.weights[c].w[k]),
        };
        Fitted { lobes: state.places.iter().enumerate().map(lobe).collect(), error: state.error, converged }
    }
}

/// (H + damping · diag H) step = −gradient.
fn step(gradient: &[f64], matrix: &[Vec<f64>], damping: f64, largest: f64) -> Option<Vec<f64>> {
    let mut a = matrix.to_vec();
    for (i, row) in a.iter_mut().enumerate() {
        row[i] += damping * row[i].max(1e-9 * largest) + 1e-14 * largest;
    }
    let factor = steradian_numerics::dense::Cholesky::new(&a)?;
    Some(factor.solve(gradient.iter().map(|g| -g).collect()))
}

/// Searches that start from the moments of the slice: widths in two ladders, and a row of lobes along the
/// plane; the first `starts` of them, `steps` long at most.
pub(super) fn search(slice: &Slice, kind: Kind, starts: usize, steps: usize) -> Vec<Fitted> {
    let mut search = Search::new(slice, kind);
    if kind.turned {
        let places = |start: Vec<GaussianLobe>| start.iter().map(|l| place(slice.theta, l)).collect();
        let starts = slice.turned_starts(kind.lobes).into_iter().take(starts).map(places).collect();
        return search.best_of(starts, steps);
    }
    let (m, lobes) = (slice.moments(), kind.lobes);
    let count = lobes as f64;
    let spread = m.spread.max(1.5 * m.core).min(1.0);
    // The image of a round lobe of half vectors is 1/cos θ times as long as it is wide.
    let thin = if search.free == 3 { slice.theta.cos().max(0.02).sqrt() } else { 1.0 };
    let place = |angle: f64, sigma: f64| {
        let (across, along) = (sigma * thin, (sigma / thin).min(0.7));
        let sweep = (along * along - across * across).max(0.01 * across * across).sqrt();
        [angle, across.ln(), sweep.ln(), 0.0, 0.0]
    };
    let ladder = |from: f64, to: f64| -> Vec<Place> {
        let place = |k: usize| {
            let t = if lobes > 1 { k as f64 / (count - 1.0) } else { 0.5 };
            place(m.peak + t * (m.mean - m.peak), from * (to / from).powf(t))
        };
        (0..lobes).map(place).collect()
    };
    let along = |k: usize| {
        let t = (k as f64 + 0.5) / count - 0.5;
        place(m.peak + 2.0 * t * (m.mean - m.peak).abs().max(m.core), 1.2 * m.core)
    };
    let all =
        [ladder(0.7 * m.core, spread), ladder(0.5 * m.core, 2.5 * m.core), (0..lobes).map(along).collect()];
    search.best_of(all.into_iter().take(starts).collect(), steps)
}

/// The place of a lobe that is seen from polar angle `theta`.
fn place(theta: f64, l: &GaussianLobe) -> Place {
    [theta + l.angle, l.sigma.ln(), l.sweep.max(0.3 * l.sigma).ln(), l.aside, l.turn]
}

/// The search that starts from the lobes of a neighbouring view.
pub(super) fn follow(slice: &Slice, neighbour: &Fitted, kind: Kind) -> Fitted {
    let mut search = Search::new(slice, kind);
    let mut run = search.begin(neighbour.lobes.iter().map(|l| place(slice.theta, l)).collect());
    search.advance(&mut run, STEPS);
    search.end(run)
}
