//! Means and widths of one elevation: Levenberg and Marquardt on the error that is left when the weights are the best ones.

use super::slice::Slice;
use super::weights::{self, Weights};
use super::{GaussianLobe, MAX_LOBES};
use std::f64::consts::FRAC_PI_2;

/// The lobes of one elevation.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub lobes: Vec<GaussianLobe>,
    /// ∫ (T − fit)².
    pub error: f64,
    pub converged: bool,
}

/// σ at most.
const WIDEST: f64 = 1.2;
const STEPS: usize = 60;
/// Relative decrease of the error below which a minimum is reached.
const ENOUGH: f64 = 1e-5;

/// Polar angle of a mean, away from wo, and ln σ.
type Place = [f64; 2];

/// One state of the search.
struct State {
    places: Vec<Place>,
    weights: [Weights; 3],
    error: f64,
    /// ΦᵀΦ of the lobes and their derivatives: lobe k has rows 3k (value), 3k + 1 (by γ) and 3k + 2 (by ln σ).
    gram: Vec<Vec<f64>>,
    /// Φᵀ T per channel.
    onto: [Vec<f64>; 3],
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums, which the compiler keeps in one register each or in a vector.
    let (mut s, n) = ([0.0; 4], a.len() / 4 * 4);
    for (a, b) in a[..n].chunks_exact(4).zip(b[..n].chunks_exact(4)) {
        (0..4).for_each(|i| s[i] += a[i] * b[i]);
    }
    let rest: f64 = a[n..].iter().zip(&b[n..]).map(|(a, b)| a * b).sum();
    s[0] + s[1] + s[2] + s[3] + rest
}

/// Storage of the Gaussians over the points.
struct Search<'a> {
    slice: &'a Slice,
    keep: bool,
    columns: Vec<Vec<f64>>,
}

impl Search<'_> {
    fn bounds(&self) -> [[f64; 2]; 2] {
        let narrow = (0.25 * self.slice.narrow).max(1e-4);
        // Seen along the normal, means stay on it: isotropic reflectance is round there.
        let angle = if self.slice.theta == 0.0 { [0.0; 2] } else { [-FRAC_PI_2, FRAC_PI_2 + 0.3] };
        [angle, [narrow.ln(), WIDEST.ln()]]
    }

    fn state(&mut self, places: Vec<Place>) -> State {
        let k = places.len();
        self.columns.resize(3 * k, Vec::new());
        for (place, columns) in places.iter().zip(self.columns.chunks_exact_mut(3)) {
            let [g, a, s] = columns else { continue };
            self.slice.gaussian(place[0], place[1].exp(), [g, a, s]);
        }
        let mut gram = vec![vec![0.0; 3 * k]; 3 * k];
        for i in 0..3 * k {
            for j in 0..=i {
                let v = dot(&self.columns[i], &self.columns[j]);
                (gram[i][j], gram[j][i]) = (v, v);
            }
        }
        let onto =
            self.slice.t.each_ref().map(|t| self.columns.iter().map(|c| dot(c, t)).collect::<Vec<_>>());
        let mut small = [[0.0; MAX_LOBES]; MAX_LOBES];
        (0..k).for_each(|i| (0..k).for_each(|j| small[i][j] = gram[3 * i][3 * j]));
        let mut error = self.slice.square[0];
        let weights = std::array::from_fn(|c| {
            let mut b = [0.0; MAX_LOBES];
            (0..k).for_each(|i| b[i] = onto[c][3 * i]);
            let sum = self.keep.then_some(self.slice.albedo[c]);
            let w = weights::best(k, &small, b, sum);
            for i in 0..k {
                let into: f64 = (0..k).map(|j| small[i][j] * w.w[j]).sum();
                error += w.w[i] * (into - 2.0 * b[i]);
            }
            w
        });
        State { places, weights, error: error.max(0.0), gram, onto }
    }

    /// Half the gradient of the error by the places, and half of Gauss and Newton's matrix: the derivatives of the
    /// Gaussians less what of them new weights make up for (Kaufman 1975).
    fn normal(state: &State) -> (Vec<f64>, Vec<Vec<f64>>) {
        let k = state.places.len();
        let n = 2 * k;
        let row = |p: usize| 3 * (p / 2) + 1 + p % 2;
        let (mut gradient, mut matrix) = (vec![0.0; n], vec![vec![0.0; n]; n]);
        for (weights, onto) in state.weights.iter().zip(&state.onto) {
            let w = &weights.w;
            for p in 0..n {
                let d = &state.gram[row(p)];
                let fitted: f64 = (0..k).map(|j| w[j] * d[3 * j]).sum();
                gradient[p] -= w[p / 2] * (onto[row(p)] - fitted);
                for q in 0..=p {
                    let e = &state.gram[row(q)];
                    let mut v = d[row(q)];
                    for i in 0..k {
                        for j in 0..k {
                            v -= d[3 * i] * weights.follow[i][j] * e[3 * j];
                        }
                    }
                    matrix[p][q] += w[p / 2] * w[q / 2] * v;
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

    fn run(&mut self, start: Vec<Place>) -> Fitted {
        let bounds = self.bounds();
        let inside = |mut p: Vec<Place>| {
            p.iter_mut().for_each(|p| (0..2).for_each(|i| p[i] = p[i].clamp(bounds[i][0], bounds[i][1])));
            p
        };
        let mut state = self.state(inside(start));
        let (mut damping, mut converged) = (1e-2, false);
        for _ in 0..STEPS {
            let (gradient, matrix) = Self::normal(&state);
            let largest = (0..gradient.len()).map(|i| matrix[i][i]).fold(0.0, f64::max);
            if largest <= 0.0 {
                converged = true;
                break;
            }
            let mut better = None;
            while damping < 1e8 {
                let Some(step) = step(&gradient, &matrix, damping, largest) else { break };
                let mut places = state.places.clone();
                for (p, s) in places.iter_mut().zip(step.chunks_exact(2)) {
                    // No further than half a width sideways and a factor of two in width at once.
                    let most = p[1].exp().max(0.01);
                    p[0] += s[0].clamp(-most, most);
                    p[1] += s[1].clamp(-0.7, 0.7);
                }
                let next = self.state(inside(places));
                if next.error < state.error {
                    better = Some(next);
                    break;
                }
                damping *= 6.0;
            }
            let Some(next) = better else {
                converged = true;
                break;
            };
            damping = (damping * 0.2).max(1e-9);
            let decrease = state.error - next.error;
            state = next;
            if decrease <= ENOUGH * state.error {
                converged = true;
                break;
            }
        }
        let lobe = |(k, p): (usize, &Place)| GaussianLobe {
            angle: p[0] - self.slice.theta,
            sigma: p[1].exp(),
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

/// Searches that start from the moments of the slice: widths in two ladders, and a row of lobes along the plane; the first
/// `starts` of them.
pub(super) fn search(slice: &Slice, lobes: usize, keep: bool, starts: usize) -> Vec<Fitted> {
    let mut search = Search { slice, keep, columns: Vec::new() };
    let m = slice.moments();
    let count = lobes as f64;
    let spread = m.spread.max(1.5 * m.core).min(1.0);
    let ladder = |from: f64, to: f64| -> Vec<Place> {
        let place = |k: usize| {
            let t = if lobes > 1 { k as f64 / (count - 1.0) } else { 0.5 };
            [m.peak + t * (m.mean - m.peak), from.ln() + t * (to / from).ln()]
        };
        (0..lobes).map(place).collect()
    };
    let along = |k: usize| {
        let t = (k as f64 + 0.5) / count - 0.5;
        [m.peak + 2.0 * t * (m.mean - m.peak).abs().max(m.core), (1.2 * m.core).ln()]
    };
    let all =
        [ladder(0.7 * m.core, spread), ladder(0.5 * m.core, 2.5 * m.core), (0..lobes).map(along).collect()];
    all.into_iter().take(starts).map(|s| search.run(s)).collect()
}

/// The search that starts from the lobes of a neighbouring elevation.
pub(super) fn follow(slice: &Slice, neighbour: &Fitted, keep: bool) -> Fitted {
    let mut search = Search { slice, keep, columns: Vec::new() };
    search.run(neighbour.lobes.iter().map(|l| [slice.theta + l.angle, l.sigma.ln()]).collect())
}
