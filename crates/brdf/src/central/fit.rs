//! Weighted least squares in elevation, and the diffuse part that is better taken out first.

use super::theta::Polar;
use super::{Argument, CentralError, Lpq, Slices};
use std::f64::consts::PI;
use steradian_numerics::dense::Cholesky;

/// A factor by elevation, usually the albedo, that multiplies a fitted series; linear between its knots,
/// constant beyond them.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// θ_o of the knots, radians, ascending.
    pub theta_o: Vec<f64>,
    /// The factor per channel at each knot.
    pub factor: Vec<[f64; 3]>,
}

impl Scale {
    /// ∫ f_cos dwi of each slice (1 where it is not positive): k_00 √(4π).
    fn albedo(slices: &Slices, sorted: &[usize]) -> Self {
        let of = |i: &usize| {
            let row = slices.row(*i, 0);
            row.map(|k| if k[0] > 0.0 { k[0] * (4.0 * PI).sqrt() } else { 1.0 })
        };
        let theta_o = sorted.iter().map(|&i| slices.slices[i].theta_o()).collect();
        Self { theta_o, factor: sorted.iter().map(of).collect() }
    }

    /// The factor at an elevation.
    pub fn value(&self, theta_o: f64) -> [f64; 3] {
        let above = self.theta_o.partition_point(|t| *t <= theta_o);
        let (Some(first), Some(last)) = (self.factor.first(), self.factor.last()) else { return [1.0; 3] };
        if above == 0 {
            return *first;
        }
        let Some(next) = self.factor.get(above) else { return *last };
        let (a, b) = (self.theta_o[above - 1], self.theta_o[above]);
        let t = (theta_o - a) / (b - a);
        std::array::from_fn(|c| (1.0 - t) * self.factor[above - 1][c] + t * next[c])
    }
}

impl Lpq {
    /// The weighted least-squares fit of k_lq(θ_o) by f_pq(θ), p = q … `p`, for each (l, q), θ the angle
    /// between C and `of`: minimises 2π ∫ w(θ_o) |k − Σ_p ρ̂ f_pq|² sin θ_o dθ_o by the trapezoidal rule over
    /// the slices, which must be seen about their own centre. With w = 1, of the view, and dense slices it
    /// tends to [`Lpq::project`] (about the normal it is better, since it needs no even continuation).
    /// `scaled` divides f_cos by its albedo first; [`Lpq::scale`] gives it back.
    pub fn fit(
        slices: &Slices,
        of: Argument,
        p: usize,
        weight: &dyn Fn(f64) -> f64,
        scaled: bool,
    ) -> Result<Self, CentralError> {
        super::lpq::check_orders(slices.order, p)?;
        let samples = Samples::new(slices, weight)?;
        let scale = scaled.then(|| Scale::albedo(slices, &samples.sorted));
        let divisor = |j: usize| scale.as_ref().map_or([1.0; 3], |s| s.factor[j]);
        let (bands, q_max) = (slices.order + 1, slices.azimuth.min(p));
        let mut rho = vec![0.0; Self::rows(p) * 3 * bands];
        let mut gram = Vec::with_capacity(q_max + 1);
        let rows = samples.rows(slices, of, &Polar::new(p, q_max));
        for q in 0..=q_max {
            let normal = Normal::new(&samples, &rows, p, q)?;
            for c in 0..3 {
                for l in q..bands {
                    let k = |j: usize| slices.row(samples.sorted[j], q)[c][l] / divisor(j)[c];
                    let solved = normal.solve(normal.project(&samples, &rows, q, k));
                    for (p, x) in (q..=p).zip(solved) {
                        rho[((p * (p + 1) / 2 + q) * 3 + c) * bands + l] = x;
                    }
                }
            }
            gram.push(normal.gram);
        }
        let mut energy = [0.0; 3];
        for (j, (&i, w)) in samples.sorted.iter().zip(&samples.weight).enumerate() {
            for c in 0..3 {
                energy[c] += w * slices.energy[i][c] / divisor(j)[c].powi(2);
            }
        }
        let gram = Some(gram);
        let (centre, f, accuracy) = (slices.centre, slices.order, slices.accuracy);
        Ok(Self { centre, of, f, p, rho, energy, scale, gram, accuracy })
    }
}

impl Slices {
    /// The albedo per channel whose Lambertian part, taken out by [`Slices::without_diffuse`], leaves the
    /// least energy that terms up to `p` do not hold: the residuals R of the weighted fit give a = ⟨R f_cos,
    /// R (n·wi)₊/π⟩/|R (n·wi)₊/π|². Not negative; zero where the slices are about the normal.
    pub fn best_diffuse(
        &self,
        of: Argument,
        p: usize,
        weight: &dyn Fn(f64) -> f64,
    ) -> Result<[f64; 3], CentralError> {
        let samples = Samples::new(self, weight)?;
        let q_max = self.azimuth;
        let rows = samples.rows(self, of, &Polar::new(p, q_max));
        let diffuse: Vec<_> = samples.sorted.iter().map(|&i| self.diffuse(&self.slices[i])).collect();
        let (mut across, mut square) = ([0.0; 3], 0.0);
        for q in 0..=q_max {
            let both = if q == 0 { 1.0 } else { 2.0 };
            let normal = if q <= p { Some(Normal::new(&samples, &rows, p, q)?) } else { None };
            for l in q..=self.order {
                let d = |j: usize| diffuse[j][q][l];
                // The residual of d is orthogonal to every f_pq, so its product with f_cos needs no second
                // one.
                let rest: Vec<f64> = match &normal {
                    Some(n) => n.residual(&samples, &rows, q, d),
                    None => (0..rows.len()).map(d).collect(),
                };
                for (j, w) in samples.weight.iter().enumerate() {
                    square += both * w * rest[j] * rest[j];
                    let k = self.row(samples.sorted[j], q);
                    (0..3).for_each(|c| across[c] += both * w * rest[j] * k[c][l]);
                }
            }
        }
        let total: f64 = samples.weight.iter().sum();
        // (n·wi)₊/π has energy 2/(3π) per slice.
        let negligible = 1e-9 * total * 2.0 / (3.0 * PI);
        Ok(across.map(|a| if square > negligible { (a / square).max(0.0) } else { 0.0 }))
    }
}

/// The slices by elevation with their weights 2π w sin θ_o Δθ_o.
struct Samples {
    sorted: Vec<usize>,
    weight: Vec<f64>,
}

impl Samples {
    fn new(slices: &Slices, weight: &dyn Fn(f64) -> f64) -> Result<Self, CentralError> {
        for s in &slices.slices {
            let own = slices.centre.slice(s.theta_o());
            if (own.gamma - s.gamma).abs() > 1e-9 {
                let what = "a fit in elevation needs every slice about the same centre";
                return Err(CentralError::Slice { theta_v: s.theta_v, gamma: s.gamma, what });
            }
        }
        let mut sorted: Vec<usize> = (0..slices.slices.len()).collect();
        sorted.sort_by(|a, b| slices.slices[*a].theta_o().total_cmp(&slices.slices[*b].theta_o()));
        let theta: Vec<f64> = sorted.iter().map(|&i| slices.slices[i].theta_o()).collect();
        let reach = slices.centre.reach();
        let edge = |j: usize| match j {
            0 => 0.0,
            j if j == theta.len() => reach,
            j => 0.5 * (theta[j - 1] + theta[j]),
        };
        let width = |j: usize| 2.0 * PI * theta[j].sin().max(0.0) * (edge(j + 1) - edge(j));
        let weight = (0..theta.len()).map(|j| width(j) * weight(theta[j]).max(0.0)).collect();
        Ok(Self { sorted, weight })
    }

    /// f_pq of every slice.
    fn rows(&self, slices: &Slices, of: Argument, polar: &Polar) -> Vec<Vec<Vec<f64>>> {
        self.sorted.iter().map(|&i| polar.rows(slices.slices[i].polar(of))).collect()
    }
}

/// The normal equations of one q: Gram matrix of f_pq and its Cholesky factor.
struct Normal {
    gram: Vec<Vec<f64>>,
    factor: Cholesky,
}

impl Normal {
    fn new(samples: &Samples, rows: &[Vec<Vec<f64>>], p: usize, q: usize) -> Result<Self, CentralError> {
        let n = p + 1 - q;
        let entry = |a: usize, b: usize| {
            let product = |(w, f): (&f64, &Vec<Vec<f64>>)| w * f[q][q + a] * f[q][q + b];
            samples.weight.iter().zip(rows).map(product).sum::<f64>()
        };
        let gram: Vec<Vec<f64>> = (0..n).map(|a| (0..n).map(|b| entry(a, b)).collect()).collect();
        let used = samples.weight.iter().filter(|w| **w > 0.0).count();
        let few = CentralError::TooFew { slices: used, terms: n };
        let factor = Cholesky::new(&gram).filter(|_| used >= n).ok_or(few)?;
        Ok(Self { gram, factor })
    }

    /// ⟨k, f_pq⟩ for each p.
    fn project(
        &self,
        samples: &Samples,
        rows: &[Vec<Vec<f64>>],
        q: usize,
        k: impl Fn(usize) -> f64,
    ) -> Vec<f64> {
        let mut b = vec![0.0; self.gram.len()];
        for (j, (w, f)) in samples.weight.iter().zip(rows).enumerate() {
            let wk = w * k(j);
            b.iter_mut().zip(&f[q][q..]).for_each(|(b, f)| *b += wk * f);
        }
        b
    }

    /// G⁻¹ b.
    fn solve(&self, b: Vec<f64>) -> Vec<f64> {
        self.factor.solve(b)
    }

    /// k less its fit, at each slice.
    fn residual(
        &self,
        samples: &Samples,
        rows: &[Vec<Vec<f64>>],
        q: usize,
        k: impl Fn(usize) -> f64,
    ) -> Vec<f64> {
        let x = self.solve(self.project(samples, rows, q, &k));
        let fitted = |f: &Vec<Vec<f64>>| x.iter().zip(&f[q][q..]).map(|(x, f)| x * f).sum::<f64>();
        rows.iter().enumerate().map(|(j, f)| k(j) - fitted(f)).collect()
    }
}
