//! Factors on the light, and how well a hypothesis explains the samples with them.

use crate::samples::Samples;
use steradian_brdf::dfg;

/// Factors between the light and the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// None.
    One,
    /// One on all.
    Gain(f64),
    /// One per channel.
    Colour([f64; 3]),
    /// The split sum's reflectance of a surface of this F0 at normal incidence.
    Reflectance([f64; 3]),
    /// One per level.
    PerLevel,
}

/// The forms of [`Scale`], with the number of their free parameters for `levels`.
pub const FORMS: [fn(usize) -> (Form, usize); 5] = [
    |_| (Form::One, 0),
    |_| (Form::Gain, 1),
    |_| (Form::Colour, 3),
    // Counted as two free numbers, not three: F0 is grey more often than not, and where it is not, this form
    // is no less likely than factors without a rule.
    |_| (Form::Reflectance, 2),
    |n| (Form::PerLevel, n),
];

/// Kind of a [`Scale`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    One,
    Gain,
    Colour,
    Reflectance,
    PerLevel,
}

/// Filtered light at the samples of one level.
pub type Column = Vec<[f64; 3]>;

/// Weighted products of values and model: v², x², v x.
#[derive(Debug, Clone, Copy, Default)]
pub struct Moments {
    vv: [f64; 3],
    xx: [f64; 3],
    vx: [[f64; 3]; 3],
}

impl Moments {
    /// Sums over the two halves of a level's samples.
    pub fn halves(s: &Samples, x: &Column) -> [Self; 2] {
        let mut both = [Self::default(); 2];
        for (k, ((v, w), x)) in s.values.iter().zip(&s.weights).zip(x).enumerate() {
            let m = &mut both[k % 2];
            for c in 0..3 {
                m.vv[c] += w * v[c] * v[c];
                m.xx[c] += w * x[c] * x[c];
                (0..3).for_each(|d| m.vx[c][d] += w * v[c] * x[d]);
            }
        }
        both
    }

    fn energy(&self) -> f64 {
        self.vv.iter().sum::<f64>().max(f64::MIN_POSITIVE)
    }

    /// The square of the relative residual where channel c of the file is `s[c]` times channel `p[c]` of the
    /// model.
    pub fn residual2(&self, p: [usize; 3], s: [f64; 3]) -> f64 {
        let left = |c: usize| self.vv[c] - 2.0 * s[c] * self.vx[c][p[c]] + s[c] * s[c] * self.xx[p[c]];
        (0..3).map(left).sum::<f64>().max(0.0) / self.energy()
    }

    /// The factors of least squares, per channel.
    pub fn gains(&self, p: [usize; 3]) -> [f64; 3] {
        std::array::from_fn(|c| ratio(self.vx[c][p[c]], self.xx[p[c]]))
    }

    /// The sum of two.
    pub fn plus(&self, o: &Self) -> Self {
        let add = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|c| a[c] + b[c]);
        Self {
            vv: add(self.vv, o.vv),
            xx: add(self.xx, o.xx),
            vx: std::array::from_fn(|c| add(self.vx[c], o.vx[c])),
        }
    }
}

fn ratio(a: f64, b: f64) -> f64 {
    if b > 0.0 { a / b } else { 1.0 }
}

/// Factors of a form that fit best, per level and channel; `lobes` are the split sum's scale and bias per
/// level.
pub fn fit(
    form: Form,
    levels: &[Moments],
    p: [usize; 3],
    lobes: &[Option<[f64; 2]>],
) -> Option<Vec<[f64; 3]>> {
    let all = |f: &dyn Fn(usize, &Moments) -> (f64, f64), c: usize| {
        let sum = levels.iter().map(|m| {
            let (a, b) = f(c, m);
            (a / m.energy(), b / m.energy())
        });
        sum.fold((0.0, 0.0), |t, s| (t.0 + s.0, t.1 + s.1))
    };
    let plain = |c: usize, m: &Moments| (m.vx[c][p[c]], m.xx[p[c]]);
    Some(match form {
        Form::One => vec![[1.0; 3]; levels.len()],
        Form::Gain => {
            let sums = [0, 1, 2].map(|c| all(&plain, c));
            let g = ratio(sums.iter().map(|s| s.0).sum(), sums.iter().map(|s| s.1).sum());
            vec![[g; 3]; levels.len()]
        }
        Form::Colour => {
            let g = [0, 1, 2].map(|c| all(&plain, c)).map(|(a, b)| ratio(a, b));
            vec![g; levels.len()]
        }
        Form::PerLevel => levels
            .iter()
            .map(|m| {
                let (a, b) = (0..3).map(|c| plain(c, m)).fold((0.0, 0.0), |t, s| (t.0 + s.0, t.1 + s.1));
                [ratio(a, b); 3]
            })
            .collect(),
        Form::Reflectance => {
            let f0 = f0(levels, p, lobes)?;
            let factor = |l: &Option<[f64; 2]>| l.map(|[a, b]| f0.map(|f| f * a + b));
            lobes.iter().map(factor).collect::<Option<_>>()?
        }
    })
}

/// F0 such that each level is scaled by F0 A + B.
fn f0(levels: &[Moments], p: [usize; 3], lobes: &[Option<[f64; 2]>]) -> Option<[f64; 3]> {
    if levels.len() < 3 {
        return None;
    }
    let mut f0 = [0.0; 3];
    for (c, f) in f0.iter_mut().enumerate() {
        let (mut top, mut bottom) = (0.0, 0.0);
        for (m, l) in levels.iter().zip(lobes) {
            let [a, b] = (*l)?;
            top += a * (m.vx[c][p[c]] - b * m.xx[p[c]]) / m.energy();
            bottom += a * a * m.xx[p[c]] / m.energy();
        }
        *f = ratio(top, bottom);
    }
    f0.iter().all(|f| (0.0..=1.02).contains(f)).then_some(f0)
}

/// The split sum's scale and bias at normal incidence; of a mirror 1 and 0.
pub fn lobe(roughness: Option<f64>) -> Option<[f64; 2]> {
    let alpha = roughness?.powi(2);
    if alpha < 1e-3 {
        return Some([1.0, 0.0]);
    }
    let d = dfg::ggx(1.0, alpha);
    Some([d.scale, d.bias])
}

/// Quality of a hypothesis.
#[derive(Debug, Clone)]
pub struct Score {
    /// Relative residual of each level by cross-validation: the factors are fitted to one half of the samples
    /// and tested on the other.
    pub levels: Vec<f64>,
    /// RMS over the levels.
    pub residual: f64,
    /// Factors fitted to all samples, per level and channel.
    pub factors: Vec<[f64; 3]>,
}

impl Score {
    /// How well factors of one form explain the samples; `None` where the form does not apply.
    pub fn new(
        form: Form,
        halves: &[[Moments; 2]],
        p: [usize; 3],
        lobes: &[Option<[f64; 2]>],
    ) -> Option<Self> {
        let side = |h: usize| halves.iter().map(|m| m[h]).collect::<Vec<_>>();
        let mut squares = vec![0.0; halves.len()];
        for (train, test) in [(0, 1), (1, 0)] {
            let factors = fit(form, &side(train), p, lobes)?;
            for (m, sum) in squares.iter_mut().enumerate() {
                *sum += 0.5 * halves[m][test].residual2(p, factors[m]);
            }
        }
        let whole: Vec<Moments> = halves.iter().map(|[a, b]| a.plus(b)).collect();
        let factors = fit(form, &whole, p, lobes)?;
        let residual = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
        Some(Self { levels: squares.into_iter().map(f64::sqrt).collect(), residual, factors })
    }

    /// Interpretation of the factors.
    pub fn scale(&self, form: Form, lobes: &[Option<[f64; 2]>]) -> Scale {
        let first = self.factors.first().copied().unwrap_or([1.0; 3]);
        match form {
            Form::One => Scale::One,
            Form::Gain => Scale::Gain(first[0]),
            Form::Colour => Scale::Colour(first),
            Form::PerLevel => Scale::PerLevel,
            Form::Reflectance => {
                let [a, b] = lobes.first().copied().flatten().unwrap_or([1.0, 0.0]);
                Scale::Reflectance(first.map(|f| (f - b) / a))
            }
        }
    }
}
