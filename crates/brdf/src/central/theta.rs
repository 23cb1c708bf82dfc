//! f_lq(θ), the polar part of the harmonics, for all l ≤ F and q ≤ Q at once.

/// f_lq(θ), where Y_lq = f_lq(θ) a_q(φ), by the recursion x f_l = ε_{l+1} f_{l+1} + ε_l f_{l−1}, x = cos θ,
/// ε_lq = √((l² − q²)/(4l² − 1)), which is stable upwards. Up to [`super::MAX_ORDER`] no scaling is needed:
/// where sin^q θ underflows, f_lq is below 1e-100.
#[derive(Debug, Clone)]
pub struct Polar {
    f: usize,
    /// Per q ≤ Q: √((2q + 1)/(2q)) of the sectoral step, then (1/ε_l, ε_{l−1}/ε_l) for l = q + 1 … F.
    columns: Vec<(f64, Vec<[f64; 2]>)>,
}

impl Polar {
    /// For l ≤ `f` and q ≤ `q`.
    pub fn new(f: usize, q: usize) -> Self {
        let epsilon = |l: usize, q: usize| ((l * l - q * q) as f64 / ((4 * l * l) as f64 - 1.0)).sqrt();
        let column = |q: usize| {
            let step = if q == 0 { 1.0 } else { ((2 * q + 1) as f64 / (2 * q) as f64).sqrt() };
            let pair = |l: usize| {
                let e = epsilon(l, q).recip();
                [e, if l == q + 1 { 0.0 } else { epsilon(l - 1, q) * e }]
            };
            (step, (q + 1..=f).map(pair).collect())
        };
        Self { f, columns: (0..=q).map(column).collect() }
    }

    /// √((2q + 1)/(2q)), by which sin θ takes f_{q−1,q−1} to f_qq; 1 for q = 0.
    pub(super) fn sectoral(&self, q: usize) -> f64 {
        self.columns[q].0
    }

    /// a and b of f_lq = a cos θ f_{l−1,q} − b f_{l−2,q}, l > q.
    pub(super) fn step(&self, q: usize, l: usize) -> [f64; 2] {
        self.columns[q].1[l - q - 1]
    }

    /// Calls `take` with (q, f_lq for l = 0 … F) for each q; zero below l = q.
    pub fn for_each(&self, sine: f64, cosine: f64, row: &mut Vec<f64>, mut take: impl FnMut(usize, &[f64])) {
        row.clear();
        row.resize(self.f + 1, 0.0);
        let mut seed = (0.25 / std::f64::consts::PI).sqrt();
        for (q, (step, ab)) in self.columns.iter().enumerate() {
            if q > 0 {
                seed *= step * sine;
                if let Some(below) = row.get_mut(q - 1) {
                    *below = 0.0;
                }
            }
            if q > self.f {
                take(q, row);
                continue;
            }
            let (mut before, mut now) = (0.0, seed);
            row[q] = now;
            for (value, [a, b]) in row[q + 1..].iter_mut().zip(ab) {
                (before, now) = (now, a * cosine * now - b * before);
                *value = now;
            }
            take(q, row);
        }
    }

    /// f_lq at one angle, l-major per q: `out[q][l]`.
    pub fn rows(&self, theta: f64) -> Vec<Vec<f64>> {
        let (mut out, (s, c)) = (Vec::with_capacity(self.columns.len()), theta.sin_cos());
        self.for_each(s, c, &mut Vec::new(), |_, row| out.push(row.to_vec()));
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_sphere::sh::legendre;

    #[test]
    fn agrees_with_the_basis_at_every_order() {
        let polar = Polar::new(255, 255);
        for theta in [1e-3f64, 0.02, 0.4, 1.57, 3.0] {
            let rows = polar.rows(theta);
            for q in [0, 1, 2, 7, 40, 200, 255] {
                let want = legendre(q, 255, theta.cos(), theta.sin());
                for (l, want) in (q..).zip(want) {
                    assert!((rows[q][l] - want).abs() < 1e-10, "{theta} {l} {q}: {} {want}", rows[q][l]);
                }
            }
        }
    }
}
