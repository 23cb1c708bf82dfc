//! Non-negative light: the smallest change per band after which a band-limited function is nowhere below zero, proved.
//!
//! Sloan 2008, Stupid Spherical Harmonics Tricks, and 2017, Deringing Spherical Harmonics, take one window of a fixed
//! form, at most to band 2, and look for its width. Here every band has a factor of its own: of all factors 1 − δ_l
//! that make f_δ = Σ (1 − δ_l) f_l non-negative, those with the least ∫(f_δ − f)² = Σ P_l δ_l², P_l = Σ_m f_lm².
//! Constraints Σ δ_l f_l(x) ≤ f(x) are linear, so this is a quadratic program (Hildreth 1957, A quadratic programming
//! procedure) in as many numbers as there are bands; δ = 1 leaves the mean, so it has a solution where the mean is
//! positive. Factors per band turn with the function.
//!
//! The proof. On a great circle band l is a trigonometric polynomial of degree l; with |f_l| ≤ √((2l+1)/4π P_l) (the
//! addition theorem and Cauchy's inequality) and Bernstein's inequality its second derivative is at most l² times
//! that, thus |f″| ≤ S = Σ l² √((2l+1)/4π P_l). In a spherical triangle with edges ≤ e the function is then at least
//! the least of its values at the corners − S e²/4: twice the error S e²/8 of a chord, to the opposite edge and along
//! it. The triangle of the lowest bound is cut into four again and again; what is then still missing, a fraction of a
//! per cent, is made up for by moving all factors towards the mean.

use super::{Basis, ShRgb, count};
use glam::DVec3;
use std::collections::BinaryHeap;
use std::f64::consts::PI;

/// Bands whose factors are found one by one. Those above are bounded by their energy; where that is not enough they
/// are left out, which changes the irradiance of a lone sun by 0.3 % and of other light by less.
const FREE: usize = 32;
/// What need not be known of a minimum, relative to the mean.
const UNSURE: f64 = 1e-5;
/// Work of the last search for a minimum, in terms of sums; the searches between take an eighth.
const WORK: usize = 100_000_000;
/// How often the point of the minimum joins the program's constraints.
const ROUNDS: usize = 3;

/// What [`ShRgb::dering`] did, by channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Dering {
    /// Factor of each band.
    pub factors: [Vec<f64>; 3],
    /// Root mean square of the change of the function over its root mean square.
    pub change: [f64; 3],
    /// A proved lower bound of the function: not below zero, but where its mean is not positive.
    pub minimum: [f64; 3],
}

impl ShRgb {
    /// Multiplies bands by the factors nearest to 1 (see the module) after which Σ k_l c_lm Y_lm is nowhere negative,
    /// channel by channel: with k_l of the clamped cosine ([`super::zonal::cosine`]) the irradiance, with ones the
    /// function itself. Bands where k_l is 0 get the mean of their neighbours' factors. A channel whose mean is not
    /// positive stays.
    pub fn dering(&mut self, k: &[f64]) -> Dering {
        let mut report = Dering {
            factors: std::array::from_fn(|_| vec![1.0; self.order + 1]),
            change: [0.0; 3],
            minimum: [0.0; 3],
        };
        for (channel, c) in self.c.iter_mut().enumerate() {
            let f = Function::new(self.order, c, k);
            let (factors, minimum) = f.factors();
            report.change[channel] = f.change(&factors);
            report.minimum[channel] = minimum;
            for (l, w) in factors.iter().enumerate() {
                c[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|c| *c *= w);
            }
            report.factors[channel] = factors;
        }
        report
    }

    /// A proved lower bound of each channel, close to the minimum up to order 32; bands above are bounded by their
    /// energy.
    pub fn lower_bound(&self) -> [f64; 3] {
        let ones = vec![1.0; self.order + 1];
        self.c.each_ref().map(|c| {
            let f = Function::new(self.order, c, &ones);
            f.minimum(&ones, &f.starts(), WORK).bound
        })
    }
}

/// One channel, k_l c_lm.
struct Function {
    /// Of all bands.
    order: usize,
    /// Of the bands that are found one by one.
    free: usize,
    c: Vec<f64>,
    /// P_l.
    power: Vec<f64>,
    mean: f64,
}

struct Minimum {
    /// What is proved.
    bound: f64,
    /// The least value found, and where.
    value: f64,
    at: DVec3,
}

/// √((2l+1)/4π): the most that a band of unit power reaches.
fn peak(l: usize) -> f64 {
    ((2 * l + 1) as f64 / (4.0 * PI)).sqrt()
}

impl Function {
    fn new(order: usize, c: &[f64], k: &[f64]) -> Self {
        let mut c = c.to_vec();
        let mut power = Vec::with_capacity(order + 1);
        for l in 0..=order {
            let k = k.get(l).copied().unwrap_or(0.0);
            let band = &mut c[l * l..(l + 1) * (l + 1)];
            band.iter_mut().for_each(|c| *c *= k);
            power.push(band.iter().map(|c| c * c).sum());
        }
        let mean = c[0] / (4.0 * PI).sqrt();
        Self { order, free: order.min(FREE), c, power, mean }
    }

    /// The most that bands above the free ones may take away.
    fn tail(&self, factors: &[f64]) -> f64 {
        (self.free + 1..=self.order).map(|l| factors[l].abs() * peak(l) * self.power[l].sqrt()).sum()
    }

    /// The factors, and the lower bound that is proved of the result.
    fn factors(&self) -> (Vec<f64>, f64) {
        let mut factors = vec![1.0; self.order + 1];
        let starts = self.starts();
        if self.mean <= 0.0 || self.order == 0 {
            let bound = self.minimum(&factors, &starts, WORK).bound;
            return (factors, bound);
        }
        let mut least = self.is_low(&factors, &starts);
        if least < 0.0 && self.tail(&factors) > 0.0 {
            factors[self.free + 1..].fill(0.0);
            least = self.is_low(&factors, &starts);
        }
        if least < 0.0 {
            let mut program = Program::new(self, &starts);
            for round in 0..ROUNDS {
                let y = program.solve();
                for (l, w) in factors.iter_mut().enumerate().take(self.free + 1).skip(1) {
                    let size = self.power[l].sqrt();
                    *w = if size > 0.0 { 1.0 - y[l - 1] / size } else { 1.0 };
                }
                let found = self.minimum(&factors, &starts, WORK / 8);
                if found.value >= -UNSURE * self.mean || round + 1 == ROUNDS {
                    break;
                }
                program.add(self, found.at);
            }
            least = self.minimum(&factors, &starts, WORK).bound;
        }
        if least < 0.0 {
            // mean + s (f − mean) ≥ mean + s (least − mean) = 0.
            let s = self.mean / (self.mean - least) * (1.0 - 1e-12);
            let seen = self.power.iter().zip(&mut factors).skip(1).filter(|(p, _)| **p > 0.0);
            seen.for_each(|(_, w)| *w *= s);
            least = 0.0;
        }
        // Bands that are not there: like their neighbours.
        for l in (1..=self.order).filter(|l| self.power[*l] == 0.0) {
            let next = factors.get(l + 1).filter(|_| self.power.get(l + 1).is_some_and(|p| *p > 0.0));
            factors[l] = next.map_or(factors[l - 1], |n| 0.5 * (factors[l - 1] + n));
        }
        (factors, least)
    }

    /// The bound, or what is below it where a value below zero is found at once.
    fn is_low(&self, factors: &[f64], starts: &[DVec3]) -> f64 {
        let quick = self.minimum(factors, starts, 0);
        if quick.value < 0.0 { quick.bound } else { self.minimum(factors, starts, WORK).bound }
    }

    fn change(&self, factors: &[f64]) -> f64 {
        let sum: f64 = self.power.iter().zip(factors).map(|(p, w)| p * (1.0 - w) * (1.0 - w)).sum();
        let all: f64 = self.power.iter().sum();
        if all > 0.0 { (sum / all).sqrt() } else { 0.0 }
    }

    /// Points spread evenly, denser than the free bands vary.
    fn starts(&self) -> Vec<DVec3> {
        crate::quadrature::fibonacci((16 * count(self.free)).max(2000)).directions
    }

    /// The free bands' values at a point.
    fn bands(&self, basis: &Basis, y: &mut [f64], d: DVec3) -> Vec<f64> {
        basis.eval(self.free, d, y);
        let band = |l: usize| l * l..(l + 1) * (l + 1);
        (0..=self.free).map(|l| self.c[band(l)].iter().zip(&y[band(l)]).map(|(a, b)| a * b).sum()).collect()
    }

    /// The minimum with these factors.
    fn minimum(&self, factors: &[f64], starts: &[DVec3], work: usize) -> Minimum {
        let mut c = self.c[..count(self.free)].to_vec();
        for (l, w) in factors.iter().enumerate().take(self.free + 1) {
            c[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|c| *c *= w);
        }
        let bend =
            (1..=self.free).map(|l| (l * l) as f64 * peak(l) * factors[l].abs() * self.power[l].sqrt()).sum();
        let mut search = Search {
            basis: Basis::new(self.free),
            y: vec![0.0; c.len()],
            order: self.free,
            c: &c,
            bend,
            least: (f64::INFINITY, DVec3::Y),
        };
        starts.iter().for_each(|d| {
            search.value(*d);
        });
        let bound = search.run(UNSURE * self.mean.abs(), (work / (3 * c.len())).min(300_000));
        let (value, at) = search.least;
        Minimum { bound: bound - self.tail(factors), value, at }
    }
}

/// The search for a minimum.
struct Search<'a> {
    basis: Basis,
    y: Vec<f64>,
    order: usize,
    c: &'a [f64],
    /// S of the module's proof.
    bend: f64,
    least: (f64, DVec3),
}

/// Corners, the values there, and the bound; the heap gives the lowest first.
struct Triangle {
    corners: [(DVec3, f64); 3],
    bound: f64,
}

impl Ord for Triangle {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        other.bound.total_cmp(&self.bound)
    }
}

impl PartialOrd for Triangle {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Triangle {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Triangle {}

impl Search<'_> {
    fn value(&mut self, d: DVec3) -> f64 {
        self.basis.eval(self.order, d, &mut self.y);
        let v = self.c.iter().zip(&self.y).map(|(a, b)| a * b).sum();
        if v < self.least.0 {
            self.least = (v, d);
        }
        v
    }

    fn triangle(&self, corners: [(DVec3, f64); 3]) -> Triangle {
        let chord = (0..3).map(|i| corners[i].0.distance(corners[(i + 1) % 3].0)).fold(0.0, f64::max);
        let edge = 2.0 * (0.5 * chord).min(1.0).asin();
        let low = corners.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
        Triangle { corners, bound: low - 0.25 * self.bend * edge * edge }
    }

    /// A lower bound: cuts until it is within `unsure` of the least value, at most `cuts` times.
    fn run(&mut self, unsure: f64, cuts: usize) -> f64 {
        let mut heap = BinaryHeap::new();
        for octant in 0..8 {
            let sign = |bit: i32| if octant >> bit & 1 == 0 { 1.0 } else { -1.0 };
            let corners = [DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2)];
            let corners = corners.map(|d| (d, self.value(d)));
            heap.push(self.triangle(corners));
        }
        let mut bound = f64::NEG_INFINITY;
        for _ in 0..cuts {
            let Some(Triangle { corners: t, bound: b }) = heap.pop() else { break };
            bound = b;
            if b >= self.least.0 - unsure {
                return b;
            }
            let middle: [(DVec3, f64); 3] = std::array::from_fn(|i| {
                let d = (t[i].0 + t[(i + 1) % 3].0).normalize();
                (d, self.value(d))
            });
            for corners in [
                [t[0], middle[0], middle[2]],
                [t[1], middle[1], middle[0]],
                [t[2], middle[2], middle[1]],
                middle,
            ] {
                let cut = self.triangle(corners);
                heap.push(cut);
            }
        }
        heap.peek().map_or(bound, |t| t.bound)
    }
}

/// min ½|y|² with a_i·y ≤ b_i, y_l = √P_l δ_l.
struct Program {
    rows: Vec<Row>,
    n: usize,
    scale: f64,
}

struct Row {
    a: Vec<f64>,
    b: f64,
    /// |a|².
    size: f64,
    multiplier: f64,
    active: bool,
}

impl Program {
    fn new(f: &Function, points: &[DVec3]) -> Self {
        let mut program = Self { rows: Vec::with_capacity(points.len()), n: f.free, scale: f.mean };
        let (basis, mut y) = (Basis::new(f.free), vec![0.0; count(f.free)]);
        program.rows = points.iter().map(|d| program.row(f, &basis, &mut y, *d)).collect();
        program
    }

    fn row(&self, f: &Function, basis: &Basis, y: &mut [f64], d: DVec3) -> Row {
        let values = f.bands(basis, y, d);
        let unit = |l: usize| if f.power[l] > 0.0 { values[l] / f.power[l].sqrt() } else { 0.0 };
        let a: Vec<f64> = (1..=f.free).map(unit).collect();
        let b = values.iter().sum();
        let size = a.iter().map(|a| a * a).sum();
        Row { a, b, size, multiplier: 0.0, active: false }
    }

    fn add(&mut self, f: &Function, d: DVec3) {
        let row = self.row(f, &Basis::new(f.free), &mut vec![0.0; count(f.free)], d);
        self.rows.push(row);
    }

    /// Hildreth's method on the constraints that were violated at some time.
    fn solve(&mut self) -> Vec<f64> {
        let mut y = vec![0.0; self.n];
        for r in &self.rows {
            y.iter_mut().zip(&r.a).for_each(|(y, a)| *y -= r.multiplier * a);
        }
        for _ in 0..16 {
            let mut grew = false;
            for r in &mut self.rows {
                if !r.active && r.size > 0.0 && r.violation(&y) > 1e-9 * self.scale {
                    (r.active, grew) = (true, true);
                }
            }
            for _ in 0..200 {
                let mut worst = 0.0f64;
                for r in self.rows.iter_mut().filter(|r| r.active) {
                    let v = r.violation(&y);
                    let step = (v / r.size).max(-r.multiplier);
                    if step != 0.0 {
                        r.multiplier += step;
                        y.iter_mut().zip(&r.a).for_each(|(y, a)| *y -= step * a);
                    }
                    worst = worst.max(v);
                }
                if worst < 1e-8 * self.scale {
                    break;
                }
            }
            if !grew {
                break;
            }
        }
        y
    }
}

impl Row {
    fn violation(&self, y: &[f64]) -> f64 {
        self.a.iter().zip(y).map(|(a, y)| a * y).sum::<f64>() - self.b
    }
}

#[cfg(test)]
mod tests {
    use super::super::zonal;
    use super::*;

    fn sun(order: usize) -> ShRgb {
        let mut sh = ShRgb::zero(order);
        sh.add_lobe(&zonal::disk(order, 0.005), DVec3::new(0.3, 0.8, 0.1).normalize(), [1.0, 1.0, 0.0]);
        // A second one in green, and a grey sky.
        sh.add_lobe(&zonal::disk(order, 0.02), DVec3::new(-0.9, 0.2, 0.3).normalize(), [0.0, 0.03, 0.0]);
        sh.c[2][0] = 1.0;
        sh
    }

    fn least(sh: &ShRgb, n: usize) -> [f64; 3] {
        let mut m = [f64::INFINITY; 3];
        for d in crate::quadrature::fibonacci(n).directions {
            let v = sh.value(d);
            (0..3).for_each(|c| m[c] = m[c].min(v[c]));
        }
        m
    }

    #[test]
    fn irradiance_of_suns_is_not_negative_at_any_band() {
        let high: &[usize] = if steradian_testkit::full() { &[14, 29] } else { &[] };
        for &order in [2, 3, 5, 9].iter().chain(high) {
            let k = zonal::cosine(order);
            let mut sh = sun(order);
            let before = sh.clone();
            let report = sh.dering(&k);
            let mut e = sh.clone();
            e.convolve(&k);
            let low = least(&e, 20_000);
            for c in 0..3 {
                let mean = e.c[c][0] / (4.0 * PI).sqrt();
                assert!(low[c] >= 0.0 && report.minimum[c] >= 0.0, "{order} {c}: {:e}", low[c]);
                assert!(low[c] <= 0.01 * mean || report.change[c] == 0.0, "{order} {c}: {:e}", low[c] / mean);
                assert_eq!(sh.c[c][0], before.c[c][0]);
            }
            // Order 3 sees no more than order 2; nothing is to do for a grey sky.
            assert!(report.change[0] > 0.0 && report.change[0] < 0.12, "{order}: {:?}", report.change);
            assert_eq!(report.change[2], 0.0);
        }
    }

    /// At order 2 the irradiance of a lone sun is −4 % of its peak at cos θ = −8/15. Two factors can be searched.
    #[test]
    fn no_factors_change_less() {
        let mut sh = ShRgb::zero(2);
        sh.add_lobe(&[1.0; 3], DVec3::Z, [1.0; 3]);
        let k = zonal::cosine(2);
        let report = sh.dering(&k);
        let [p1, p2] = [1, 2].map(|l: usize| (2 * l + 1) as f64 / (4.0 * PI) * k[l] * k[l]);
        let change = |w1: f64, w2: f64| p1 * (1.0 - w1).powi(2) + p2 * (1.0 - w2).powi(2);
        let mut best = (f64::INFINITY, 0.0, 0.0);
        for i in 0..=1000 {
            let w1 = 0.7 + 0.0003 * f64::from(i);
            // The largest w₂ ≤ 1 for which 1/4 + w₁ x/2 + 5/32 w₂ (3x² − 1) is not negative: by its discriminant,
            // where the vertex lies on the sphere.
            let bad = |w2: f64| {
                let (q, c) = (15.0 / 32.0 * w2, 0.25 - 5.0 / 32.0 * w2);
                0.25 * w1 * w1 > 4.0 * q * c && w1 / (4.0 * q) < 1.0
            };
            let good = (0..=2000).map(|j| 1.0 - f64::from(j) / 2000.0).find(|w2| !bad(*w2));
            if let Some(w2) = good
                && change(w1, w2) < best.0
            {
                best = (change(w1, w2), w1, w2);
            }
        }
        let w = &report.factors[0];
        assert!((change(w[1], w[2]) - best.0).abs() < 0.02 * best.0, "{w:?} {best:?}");
    }

    #[test]
    fn bounds_are_bounds() {
        let mut sh = ShRgb::zero(7);
        sh.c.iter_mut().flatten().enumerate().for_each(|(i, c)| *c = (i as f64 * 1.7).sin());
        let (bound, low) = (sh.lower_bound(), least(&sh, 50_000));
        for c in 0..3 {
            assert!(bound[c] <= low[c] && bound[c] > low[c] - 0.1, "{} {}", bound[c], low[c]);
        }
        // Channels without light or with a negative mean stay.
        let mut dark = ShRgb::zero(3);
        dark.c[0][0] = -1.0;
        dark.c[0][2] = 0.5;
        let same = dark.clone();
        assert_eq!(dark.dering(&[1.0; 4]).change, [0.0; 3]);
        assert_eq!(dark, same);
    }

    #[test]
    fn high_orders_are_bounded_as_well() {
        let mut sh = sun(90);
        let k = zonal::cosine(90);
        let report = sh.dering(&k);
        sh.convolve(&k);
        let low = least(&sh, 4000);
        assert!((0..3).all(|c| low[c] >= 0.0 && report.minimum[c] >= 0.0), "{low:?}");
        assert!(report.change[0] < 0.05, "{:?}", report.change);
    }
}
