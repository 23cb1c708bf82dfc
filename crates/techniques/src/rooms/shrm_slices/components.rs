//! Few maps for all elevations: principal components of the slices, azimuthal order by azimuthal order.
//!
//! Over all frames the light's rotated coefficients are uncorrelated
//! ([`steradian_prefilter::shrm::spectral_error`]), so that the rows κ_lq(θ_v), weighted by a light, form a
//! matrix with entries κ_lq(θ_v) √(Σ_m L_lm²/(2l + 1)), one row for each elevation, for each q. Its
//! singular vectors are the maps that represent all elevations to a given error with the fewest of them
//! (Eckart & Young 1936): κ_lq(θ_v) ≈ Σ_r u_rq(θ_v) v_lrq, r = 1 … R_q. The largest singular values of all
//! q are taken until the tolerance is met at every elevation that counts; elevations of the largest error
//! are given more weight (Lawson 1961). Each component gets the resolution at which its share of the
//! lookups' error costs the fewest bytes.

use super::scaled::{Scaled, both};
use std::f64::consts::PI;
use steradian_numerics::eigen;
use steradian_parallel::prelude::*;
use steradian_prefilter::shrm::spectral_error;

/// Shares of the squared tolerance for the errors of components, of truncation at F, and of lookups.
const SHARES: [f64; 3] = [0.55, 0.1, 0.15];
/// A truncation error that is small in the mean square shows as rings around bright lights: bands are added
/// until those left out hold this part of the squared tolerance, or to twice as many where a lobe's edge
/// keeps them from fading.
const FADED: f64 = 4e-4;
/// Rounds of weights by elevation.
const ROUNDS: usize = 3;
/// Intervals from pole to pole that components may have.
const SIZES: [usize; 13] = [8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512];
/// Most components.
const MOST: usize = 768;

/// One map (two for q > 0) for all elevations.
#[derive(Debug, Clone, PartialEq)]
pub struct Component {
    /// q.
    pub q: usize,
    /// Weight of the component at every elevation.
    pub u: Vec<f64>,
    /// Coefficients of the component per channel, l = 0 … F.
    pub v: [Vec<f64>; 3],
    /// Intervals from pole to pole.
    pub size: usize,
}

impl Component {
    /// Number of its maps.
    pub fn maps(&self) -> usize {
        if self.q == 0 { 1 } else { 2 }
    }

    /// Bytes of its maps.
    pub fn bytes(&self) -> usize {
        self.maps() * bytes(self.size)
    }
}

/// Bytes of one map.
fn bytes(size: usize) -> usize {
    (size + 1) * 2 * size * 3 * 4
}

/// Limits that a user sets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// F; by tolerance where `None`.
    pub order: Option<usize>,
    /// Intervals from pole to pole of all maps; 0: by tolerance.
    pub size: usize,
    /// Bytes of the maps at most.
    pub bytes: usize,
}

/// The components from which maps are made.
#[derive(Debug, Clone, PartialEq)]
pub struct Expansion {
    /// F.
    pub f: usize,
    /// Ordered by size, then by q.
    pub components: Vec<Component>,
}

/// A component before it is chosen.
struct Candidate {
    q: usize,
    /// Reduction of the weighted squared error by each of its maps.
    gain: f64,
    /// Reduction of the unweighted squared error by elevation, by both maps.
    of: Vec<f64>,
    u: Vec<f64>,
    /// Factors of κ at each elevation in the sum that is v.
    from: Vec<f64>,
}

impl Expansion {
    /// The components that hold every elevation that counts to `tolerance`, within `limits`.
    pub fn new(scaled: &Scaled<'_>, tolerance: f64, limits: Limits) -> Self {
        let square = tolerance * tolerance;
        let all = 0..scaled.len();
        let order = scaled.s.order;
        let counted = all.clone().filter(|i| scaled.counts(*i));
        let beyond: Vec<Vec<f64>> = counted.map(|i| scaled.beyond(i)).collect();
        let fits = |f: usize, most: f64| beyond.iter().all(|b| b[f] <= most * square);
        let f = match limits.order {
            Some(f) => f.min(order),
            None => {
                let little = lowest(order, |f| fits(f, SHARES[1]));
                lowest(order, |f| fits(f, FADED)).min(2 * little)
            }
        };
        let mut emphasis: Vec<f64> = all.clone().map(|i| scaled.emphasis(i)).collect();
        let most = SHARES[0] * square;
        let rows: Vec<WeightedRows> =
            (0..=scaled.s.azimuth).into_par_iter().map(|q| WeightedRows::new(scaled, q, f, most)).collect();
        let mut best: Option<Vec<Candidate>> = None;
        for _ in 0..ROUNDS {
            let (chosen, left) = choose(scaled, &rows, &emphasis, most);
            if best.as_ref().is_none_or(|b| maps(&chosen) < maps(b)) {
                best = Some(chosen);
            }
            even_out(scaled, &mut emphasis, &left);
        }
        let mut components: Vec<Component> =
            best.unwrap_or_default().into_iter().map(|c| component(scaled, f, c)).collect();
        sizes(scaled, &mut components, SHARES[2] * square, limits);
        components.sort_by_key(|c| (c.size, c.q));
        Self { f, components }
    }

    /// Bytes of all maps.
    pub fn bytes(&self) -> usize {
        self.components.iter().map(Component::bytes).sum()
    }

    /// Squared relative error of each elevation.
    pub fn errors(&self, scaled: &Scaled<'_>) -> Vec<f64> {
        let lost: Vec<[f64; 3]> =
            self.components.par_iter().map(|x| lost(scaled, x, &blur(x.size, self.f))).collect();
        let one = |i: usize| {
            let mut sum = scaled.tail(i) + scaled.between(i);
            for q in 0..=scaled.s.azimuth {
                let of_q: Vec<&Component> = self.components.iter().filter(|c| c.q == q).collect();
                let made = |c: usize, l: usize| {
                    of_q.iter().map(|x| x.u[i] * x.v[c].get(l).copied().unwrap_or(0.0)).sum::<f64>()
                };
                let kappa = scaled.kappa(i, q);
                sum += scaled.miss(i, q, |c, l| kappa(c, l) - made(c, l));
            }
            let blurred = |(x, lost): (&Component, &[f64; 3])| {
                x.u[i].powi(2) * (0..3).map(|c| scaled.share(i, c) * lost[c]).sum::<f64>()
            };
            sum + self.components.iter().zip(&lost).map(blurred).sum::<f64>()
        };
        (0..scaled.len()).into_par_iter().with_max_len(1).map(one).collect()
    }
}

/// The lowest F that `fits`, which holds for all above it too.
fn lowest(order: usize, fits: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, order);
    while low < high {
        let middle = (low + high) / 2;
        if fits(middle) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    high
}

fn maps(chosen: &[Candidate]) -> usize {
    chosen.iter().map(|c| if c.q == 0 { 1 } else { 2 }).sum()
}

/// Takes candidates until no elevation that counts has a squared error above `most`; returns them, and the
/// remaining squared error of each elevation.
fn choose(
    scaled: &Scaled<'_>,
    rows: &[WeightedRows],
    emphasis: &[f64],
    most: f64,
) -> (Vec<Candidate>, Vec<f64>) {
    let decomposed: Vec<Vec<Candidate>> = rows.par_iter().map(|r| r.decompose(emphasis)).collect();
    let mut left = vec![0.0; scaled.len()];
    for r in rows {
        left.iter_mut().zip(&r.whole).for_each(|(l, w)| *l += w);
    }
    let mut candidates: Vec<Candidate> = decomposed.into_iter().flatten().collect();
    candidates.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let mut taken = Vec::new();
    for candidate in candidates {
        let worst = (0..scaled.len()).filter(|i| scaled.counts(*i)).map(|i| left[i]).fold(0.0, f64::max);
        if worst <= most || taken.len() >= MOST {
            break;
        }
        left.iter_mut().zip(&candidate.of).for_each(|(l, o)| *l -= o);
        taken.push(candidate);
    }
    (taken, left)
}

/// The rows κ_lq of one q at all elevations, weighted by the light.
struct WeightedRows {
    q: usize,
    /// Weight of κ in each elevation's row.
    weight: Vec<f64>,
    /// Squared relative error of every elevation without any component.
    whole: Vec<f64>,
    /// Scalar products of the rows of elevations i ≤ j; empty where all rows are negligible.
    gram: Vec<Vec<f64>>,
}

impl WeightedRows {
    fn new(scaled: &Scaled<'_>, q: usize, f: usize, most: f64) -> Self {
        let n = scaled.len();
        let bands = f + 1;
        let grey = |i: usize| (0..3).map(|c| scaled.share(i, c)).sum::<f64>() / 3.0;
        // Channels have the mean of their weights over elevations: exact where the ratio of the channels is
        // constant.
        let channel = |c: usize| {
            (0..n).map(|i| scaled.share(i, c) / grey(i).max(f64::MIN_POSITIVE)).sum::<f64>() / n as f64
        };
        let channels: [f64; 3] = std::array::from_fn(channel);
        let weight: Vec<f64> = (0..n).map(|i| (both(q) * grey(i)).sqrt()).collect();
        let column = |k: usize| (channels[k / bands] * scaled.rest.mean(k / bands, k % bands)).sqrt();
        let columns: Vec<f64> = (0..3 * bands).map(column).collect();
        let row = |i: usize| -> Vec<f64> {
            let kappa = scaled.kappa(i, q);
            (0..3 * bands).map(|k| weight[i] * columns[k] * kappa(k / bands, k % bands)).collect()
        };
        let rows: Vec<Vec<f64>> = (0..n).map(row).collect();
        let whole: Vec<f64> = rows.iter().map(|r| dot(r, r)).collect();
        let little = 0.02 * most / (scaled.s.azimuth + 1) as f64;
        if (0..n).all(|i| whole[i] <= if scaled.counts(i) { little } else { 10.0 * little }) {
            return Self { q, weight, whole, gram: Vec::new() };
        }
        let gram = |i: usize| (0..n).map(|j| if j < i { 0.0 } else { dot(&rows[i], &rows[j]) }).collect();
        let gram = (0..n).map(gram).collect();
        Self { q, weight, whole, gram }
    }

    /// The components, with elevations emphasised.
    fn decompose(&self, emphasis: &[f64]) -> Vec<Candidate> {
        let Self { q, weight, gram, .. } = self;
        let n = gram.len();
        let emphasised = |(i, row): (usize, &Vec<f64>)| {
            row.iter().zip(emphasis).map(|(g, e)| emphasis[i] * e * g).collect::<Vec<f64>>()
        };
        let candidate = |(lambda, v): (f64, Vec<f64>)| Candidate {
            q: *q,
            gain: lambda / both(*q),
            of: (0..n).map(|i| lambda * (v[i] / emphasis[i]).powi(2)).collect(),
            u: (0..n).map(|i| v[i] / (emphasis[i] * weight[i])).collect(),
            from: (0..n).map(|i| v[i] * emphasis[i] * weight[i]).collect(),
        };
        let all = eigen::symmetric(gram.iter().enumerate().map(emphasised).collect());
        all.into_iter().filter(|(lambda, _)| *lambda > 0.0).map(candidate).collect()
    }
}

/// Σ a b, four sums side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sums = [0.0; 4];
    a.0.iter().zip(b.0).for_each(|(a, b)| (0..4).for_each(|k| sums[k] += a[k] * b[k]));
    let rest: f64 = a.1.iter().zip(b.1).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// Gives elevations that miss more than others more weight.
fn even_out(scaled: &Scaled<'_>, emphasis: &mut [f64], left: &[f64]) {
    let counted: Vec<usize> = (0..scaled.len()).filter(|i| scaled.counts(*i)).collect();
    let mean = counted.iter().map(|i| left[*i]).sum::<f64>() / counted.len().max(1) as f64;
    for i in counted.into_iter().filter(|_| mean > 0.0) {
        emphasis[i] *= (left[i] / mean).clamp(0.3, 3.0).powf(0.3);
    }
}

/// v = Σ_i from_i κ(i), by channel and band.
fn component(scaled: &Scaled<'_>, f: usize, c: Candidate) -> Component {
    let mut v: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; f + 1]);
    for (i, from) in c.from.iter().enumerate() {
        for (channel, v) in v.iter_mut().enumerate() {
            let row = &scaled.s.row(i, c.q)[channel][..=f];
            let from = from / scaled.scale[i][channel];
            v.iter_mut().zip(row).for_each(|(v, k)| *v += from * k);
        }
    }
    Component { q: c.q, u: c.u, v, size: 0 }
}

/// RMS error of lookups between the texels of maps of a size, by band up to `f`, of waves of amplitude 1.
fn blur(size: usize, f: usize) -> Vec<f64> {
    (0..=f).map(|l| spectral_error::lookup(l, PI / size as f64).sqrt()).collect()
}

/// Mean squared error per channel of lookups of a component of weight 1, by the [`blur`] of its size.
fn lost(scaled: &Scaled<'_>, x: &Component, blur: &[f64]) -> [f64; 3] {
    std::array::from_fn(|c| scaled.rest.row(c, x.q, x.v[c].iter().zip(blur).map(|(v, b)| v * b)))
}

/// Gives each component its size: the cheapest sizes whose lookups together have a squared error of at most
/// `most` at every elevation that counts, or the best that the limit of bytes allows.
fn sizes(scaled: &Scaled<'_>, components: &mut [Component], most: f64, limits: Limits) {
    if limits.size > 0 {
        components.iter_mut().for_each(|c| c.size = limits.size.max(4));
    } else {
        // `lost` is the squared error of lookups by component, size and channel; elevations that count are
        // weighted alike in the mean, and the worst of them decides.
        let counted: Vec<usize> = (0..scaled.len()).filter(|i| scaled.counts(*i)).collect();
        let bands = components.iter().map(|x| x.v[0].len()).max().unwrap_or(0);
        let blurs = SIZES.map(|size| blur(size, bands.saturating_sub(1)));
        let by_size = |x: &Component| blurs.each_ref().map(|blur| lost(scaled, x, blur));
        let lost: Vec<[[f64; 3]; SIZES.len()]> = components.par_iter().map(by_size).collect();
        let at = |i: usize, k: usize, size: usize| {
            let e = lost[k][size];
            components[k].u[i].powi(2) * (0..3).map(|c| scaled.share(i, c) * e[c]).sum::<f64>()
        };
        let mean = |k: usize, size: usize| {
            counted.iter().map(|i| at(*i, k, size)).sum::<f64>() / counted.len() as f64
        };
        let means: Vec<[f64; SIZES.len()]> =
            (0..components.len()).map(|k| std::array::from_fn(|size| mean(k, size))).collect();
        let pick = |price: f64| -> Vec<usize> {
            let cost = |k: usize, size: usize| {
                means[k][size] + price * (components[k].maps() * bytes(SIZES[size])) as f64
            };
            let best = |k: usize| (0..SIZES.len()).min_by(|a, b| cost(k, *a).total_cmp(&cost(k, *b)));
            (0..components.len()).map(|k| best(k).unwrap_or(0)).collect()
        };
        let worst = |picked: &[usize]| {
            let sum = |i: &usize| picked.iter().enumerate().map(|(k, size)| at(*i, k, *size)).sum::<f64>();
            counted.iter().map(sum).fold(0.0, f64::max)
        };
        let taken = |picked: &[usize]| -> usize {
            picked.iter().enumerate().map(|(k, size)| components[k].maps() * bytes(SIZES[*size])).sum()
        };
        // The price of a byte, by bisection: dear enough for the allowed bytes, else cheap enough for the
        // error.
        let (mut cheap, mut dear) = (1e-18 * most, most);
        for _ in 0..40 {
            let middle = (cheap * dear).sqrt();
            let picked = pick(middle);
            if worst(&picked) > most && taken(&picked) <= limits.bytes {
                dear = middle;
            } else {
                cheap = middle;
            }
        }
        let mut picked = pick(cheap);
        while taken(&picked) > limits.bytes {
            let Some(largest) = picked.iter().copied().max().filter(|l| *l > 0) else { break };
            picked.iter_mut().filter(|p| **p == largest).for_each(|p| *p -= 1);
        }
        components.iter_mut().zip(&picked).for_each(|(c, p)| c.size = SIZES[*p]);
    }
}
