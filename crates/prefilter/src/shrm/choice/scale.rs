//! The factor by elevation that a fit leaves to shading: the albedo.

/// Knots for each elevation of a slice.
const FINER: usize = 4;

/// Four numbers by the angle between n and wo: evenly spaced knots, linear between them, constant beyond.
#[derive(Debug, Clone)]
pub struct ScaleTable {
    first: f32,
    /// Intervals per radian.
    density: f32,
    knots: Vec<[f32; 4]>,
    /// Angles of the slices with the estimated squared relative error there.
    error: Vec<[f64; 2]>,
}

impl PartialEq for ScaleTable {
    fn eq(&self, other: &Self) -> bool {
        (self.first, self.density) == (other.first, other.density) && self.knots == other.knots
    }
}

impl ScaleTable {
    /// 1 everywhere.
    pub fn one() -> Self {
        Self { first: 0.0, density: 1.0, knots: vec![[1.0; 4]; 2], error: Vec::new() }
    }

    /// Interpolates the factors cubically. `angles` are the midpoints of equal parts of 0 … 90°, and the
    /// factor is even about 0. With fewer than five angles the scale is 1 everywhere.
    pub fn new(angles: &[f64], factors: &[[f64; 3]]) -> Self {
        let n = angles.len();
        if n < 5 || factors.len() != n {
            return Self::one();
        }
        let step = angles[1] - angles[0];
        // Knots from 0 to the last angle, which is an odd number of half steps.
        let last = FINER * (2 * n - 1) / 2;
        let knot = |k: usize| {
            let [r, g, b] = cubic(factors, k as f64 / FINER as f64 - 0.5).map(|f| f as f32);
            [r, g, b, 1.0]
        };
        let error = (0..n).map(|i| [angles[i], square_error(factors, i)]).collect();
        let density = (FINER as f64 / step) as f32;
        Self { first: 0.0, density, knots: (0..=last).map(knot).collect(), error }
    }

    /// Squared relative error between the knots about an angle, estimated.
    pub fn square_error(&self, angle: f64) -> f64 {
        let off = |e: &&[f64; 2]| (e[0] - angle).abs();
        self.error.iter().min_by(|a, b| off(a).total_cmp(&off(b))).map_or(0.0, |e| e[1])
    }

    /// The factor of each channel at n·wo in (0, 1].
    #[inline(always)]
    pub fn at(&self, cos_o: f32) -> [f32; 3] {
        let last = self.knots.len() - 1;
        let x = ((cos_o.acos() - self.first) * self.density).clamp(0.0, last as f32);
        let i = (x as usize).min(last - 1);
        let t = x - i as f32;
        let (a, b) = (self.knots[i], self.knots[i + 1]);
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
    }

    /// The first angle, and the range's inverse: `fetch_NAME((angle − x)·y)`.
    pub fn range(&self) -> [f32; 2] {
        [self.first, self.density / (self.knots.len() - 1) as f32]
    }

    /// The first angle, the intervals per radian and the knots: what shading and files hold.
    pub fn parts(&self) -> ([f32; 2], &[[f32; 4]]) {
        ([self.first, self.density], &self.knots)
    }

    /// The table of [`ScaleTable::parts`]; `None` where they are none. Its errors are not known.
    pub fn from_parts([first, density]: [f32; 2], knots: Vec<[f32; 4]>) -> Option<Self> {
        let sound = first.is_finite() && density.is_finite() && knots.len() >= 2;
        sound.then_some(Self { first, density, knots, error: Vec::new() })
    }
}

/// The factor of slice `i`; before the first the mirrored ones.
fn at(factors: &[[f64; 3]], i: isize) -> [f64; 3] {
    let i = if i < 0 { -1 - i } else { i };
    factors[(i as usize).min(factors.len() - 1)]
}

/// The cubic through the four slices around place `x`, a slice being 1, its first at 0; through the last four
/// at the end.
fn cubic(factors: &[[f64; 3]], x: f64) -> [f64; 3] {
    let first = (x.floor() as isize - 1).min(factors.len() as isize - 4);
    lagrange(factors, [first, first + 1, first + 2, first + 3], x)
}

/// The polynomial through four slices.
fn lagrange(factors: &[[f64; 3]], nodes: [isize; 4], x: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for a in nodes {
        let others = nodes.into_iter().filter(|b| *b != a);
        let weight: f64 = others.map(|b| (x - b as f64) / (a - b) as f64).product();
        let value = at(factors, a);
        (0..3).for_each(|c| sum[c] += weight * value[c]);
    }
    sum
}

/// Squared relative error at slice `i`: that of the cubic, estimated by leaving slice i out and interpolating
/// its four neighbours (which errs 7 times as much as the cubic half way between slices; a quarter is taken),
/// and that of the lines between knots, whose mean square is 1/120 of their second differences'.
fn square_error(factors: &[[f64; 3]], i: usize) -> f64 {
    let (n, i) = (factors.len() as isize, i as isize);
    let shift = (i + 2 - (n - 1)).max(0);
    let nodes = [-2, -1, 0, 1, 2].map(|k| i + k - shift);
    let mut others = nodes.into_iter().filter(|k| *k != i);
    let four = std::array::from_fn(|_| others.next().unwrap_or(i));
    let cubic = lagrange(factors, four, i as f64);
    let j = i.min(n - 2);
    let [a, here, b] = [j - 1, j, j + 1].map(|k| at(factors, k));
    let value = at(factors, i);
    let one = |c: usize| {
        let bend = (a[c] - 2.0 * here[c] + b[c]) / (FINER * FINER) as f64;
        let square = (0.25 * (cubic[c] - value[c])).powi(2) + bend * bend / 120.0;
        if value[c] > 0.0 { square / (value[c] * value[c]) } else { 0.0 }
    };
    (0..3).map(one).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table follows a function with a steep end, and says by how much it does not.
    #[test]
    fn between_slices_it_is_as_good_as_it_says() {
        let n = 45;
        let step = std::f64::consts::FRAC_PI_2 / n as f64;
        let f = |t: f64| 0.3 + 0.7 * (1.0 - t.cos()).powi(5);
        let angles: Vec<f64> = (0..n).map(|i| (f64::from(i) + 0.5) * step).collect();
        let factors: Vec<[f64; 3]> = angles.iter().map(|t| [f(*t); 3]).collect();
        let table = ScaleTable::new(&angles, &factors);
        let (mut square, mut said) = (0.0, 0.0);
        let many = 4000;
        for k in 0..many {
            let t = angles[n as usize - 1] * (f64::from(k) + 0.5) / f64::from(many);
            let got = f64::from(table.at(t.cos() as f32)[0]);
            square += (got / f(t) - 1.0).powi(2);
            said += table.square_error(t);
        }
        let [square, said] = [square, said].map(|x| (x / f64::from(many)).sqrt());
        assert!(square < 2e-4 && (0.7..4.0).contains(&(said / square)), "{square} {said}");
        assert_eq!(ScaleTable::one().square_error(1.0), 0.0);
    }
}
