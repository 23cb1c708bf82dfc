//! Polynomial texture maps (Malzbender, Gelb & Wolters 2001, *Polynomial Texture Maps*) from photographs
//! under known lights.
//!
//! A texel's luminance under a light of unit direction l is,
//!
//! > L(u, v) = a₀u² + a₁v² + a₂uv + a₃u + a₄v + a₅,  (u, v) = (l·t, l·b),
//!
//! x to the right of the photograph, y up, z to the camera. The coefficients are those of least squares; the
//! rule that takes the values under all lights to them is the same for every texel, so that photographs are
//! taken one by one.
//!
//! In place of the six there may be the 9 or 16 real spherical harmonics up to order 2 or 3 ([`Basis`]): as
//! z² = 1 − u² − v², the six are among the nine, which add z, uz and vz.

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4};
use steradian_numerics::eigen;
use steradian_parallel::prelude::*;

/// Numbers of the polynomial of Malzbender, Gelb & Wolters.
const TERMS: usize = 6;
/// Numbers of spherical harmonics up to order 2 and 3.
const HARMONICS: [usize; 2] = [9, 16];
/// Largest ratio of singular values of the lights' polynomials: beyond it the coefficients are mostly
/// rounding of 8-bit photographs.
const MAX_CONDITION: f64 = 1e5;
/// Weights of linear Rec. 709 red, green and blue in luminance.
pub const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];
/// What white is in the files of the usual fitters.
const WHITE: f64 = 255.0;

/// Why photographs give no polynomials.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Too few lights.
    #[error("{got} lights: a polynomial of {} coefficients needs {} at least", word(*.want), word(*.want))]
    Few {
        /// Lights.
        got: usize,
        /// Coefficients.
        want: usize,
    },
    /// A light that does not light the surface.
    #[error("light {0} has the direction ({1}, {2}, {3}): it must be finite and above the surface, z > 0")]
    Below(usize, f64, f64, f64),
    /// Lights that leave a polynomial undetermined.
    #[error(
        "the lights lie on one conic, or nearly so (condition number {0:.1e}): add some at another elevation"
    )]
    Conic(f64),
    /// A photograph of another size.
    #[error("photograph {photograph} has {got} texels where the first has {want}")]
    Size {
        /// Which, from 0.
        photograph: usize,
        /// Its texels.
        got: usize,
        /// Those of the first.
        want: usize,
    },
    /// A photograph with values that are not finite.
    #[error("photograph {0} has values that are not finite")]
    Finite(usize),
}

fn word(count: usize) -> String {
    if count == TERMS { "six".into() } else { count.to_string() }
}

/// What a texel's values are a sum of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Basis {
    /// u², v², uv, u, v and 1 (Malzbender, Gelb & Wolters 2001).
    #[default]
    Biquadratic,
    /// The nine real spherical harmonics up to order 2.
    Harmonics9,
    /// The sixteen up to order 3.
    Harmonics16,
}

impl Basis {
    /// Names of all, in order.
    pub const NAMES: [&str; 3] = ["biquadratic", "sh9", "sh16"];
    /// All.
    pub const ALL: [Self; 3] = [Self::Biquadratic, Self::Harmonics9, Self::Harmonics16];

    /// Numbers of a texel and channel.
    pub fn terms(self) -> usize {
        match self {
            Self::Biquadratic => TERMS,
            Self::Harmonics9 => HARMONICS[0],
            Self::Harmonics16 => HARMONICS[1],
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

/// Real spherical harmonics up to order 3 at a unit direction, order l² + l + m.
#[inline]
pub fn harmonics([x, y, z]: [f64; 3]) -> [f64; 16] {
    let (xx, yy, zz) = (x * x, y * y, z * z);
    [
        0.282_094_791_773_878_14,
        0.488_602_511_902_919_9 * y,
        0.488_602_511_902_919_9 * z,
        0.488_602_511_902_919_9 * x,
        1.092_548_430_592_079_2 * x * y,
        1.092_548_430_592_079_2 * y * z,
        0.315_391_565_252_520_05 * (3.0 * zz - 1.0),
        1.092_548_430_592_079_2 * x * z,
        0.546_274_215_296_039_6 * (xx - yy),
        0.590_043_589_926_643_5 * y * (3.0 * xx - yy),
        2.890_611_442_640_554 * x * y * z,
        0.457_045_799_464_465_77 * y * (5.0 * zz - 1.0),
        0.373_176_332_590_115_4 * z * (5.0 * zz - 3.0),
        0.457_045_799_464_465_77 * x * (5.0 * zz - 1.0),
        1.445_305_721_320_277 * z * (xx - yy),
        0.590_043_589_926_643_5 * x * (xx - 3.0 * yy),
    ]
}

/// u², v², uv, u, v, 1 of six numbers, spherical harmonics of more.
fn terms<const N: usize>(l: DVec3) -> [f64; N] {
    let (u, v) = (l.x, l.y);
    if N == TERMS {
        let all = [u * u, v * v, u * v, u, v, 1.0];
        return std::array::from_fn(|k| all[k]);
    }
    let all = harmonics(l.to_array());
    std::array::from_fn(|k| all[k])
}

/// The rule of least squares for a set of lights: of `N` coefficients a texel, those of a [`Basis`].
#[derive(Debug, Clone)]
pub struct Fit<const N: usize = TERMS> {
    /// What a value under each light adds to the coefficients.
    rule: Vec<[f64; N]>,
    condition: f64,
}

impl<const N: usize> Fit<N> {
    /// The rule for lights in these directions, of any length.
    pub fn new(lights: &[DVec3]) -> Result<Self, FitError> {
        if lights.len() < N {
            return Err(FitError::Few { got: lights.len(), want: N });
        }
        let mut rows = Vec::with_capacity(lights.len());
        for (k, l) in lights.iter().enumerate() {
            match l.try_normalize() {
                Some(d) if d.z > 0.0 => rows.push(terms::<N>(d)),
                _ => return Err(FitError::Below(k, l.x, l.y, l.z)),
            }
        }
        let gram = |i: usize, j: usize| rows.iter().map(|r| r[i] * r[j]).sum::<f64>();
        let pairs = eigen::symmetric((0..N).map(|i| (0..N).map(|j| gram(i, j)).collect()).collect());
        let (most, least) = (pairs[0].0, pairs[N - 1].0.max(0.0));
        let condition = (most / least).sqrt();
        // Squares of singular values are known to rounding of the largest: far beyond the bound they are
        // noise.
        if condition.is_nan() || condition > MAX_CONDITION {
            return Err(FitError::Conic(condition));
        }
        // (Σ φφᵀ)⁻¹ φ of each light.
        let rule = rows.iter().map(|row| {
            let mut out = [0.0; N];
            for (value, vector) in &pairs {
                let along = row.iter().zip(vector).map(|(a, b)| a * b).sum::<f64>() / value;
                out.iter_mut().zip(vector).for_each(|(o, v)| *o += along * v);
            }
            out
        });
        Ok(Self { rule: rule.collect(), condition })
    }

    /// Lights.
    pub fn lights(&self) -> usize {
        self.rule.len()
    }

    /// Ratio of the largest singular value of the lights' polynomials to the smallest.
    pub fn condition(&self) -> f64 {
        self.condition
    }

    /// The coefficients of one texel from its value under every light.
    pub fn coefficients(&self, values: impl IntoIterator<Item = f64>) -> [f64; N] {
        let mut out = [0.0; N];
        for (rule, value) in self.rule.iter().zip(values) {
            out.iter_mut().zip(rule).for_each(|(o, r)| *o += r * value);
        }
        out
    }
}

/// Polynomials of luminance and the colour that they scale.
pub type Luminance<const N: usize> = (Vec<[f32; N]>, Vec<[u8; 3]>);

/// Texels of a block of [`Photographs`], which is given back as soon as it is finished.
const BLOCK: usize = 1 << 16;

/// Sums of a block of texels.
struct Sums<const N: usize> {
    luminance: Vec<[f64; N]>,
    color: Vec<[f32; 3]>,
}

/// Polynomials of luminance and the colour that they scale, photograph by photograph: 60 bytes a texel of six
/// coefficients, whatever the number of photographs.
pub struct Photographs<'a, const N: usize = TERMS> {
    fit: &'a Fit<N>,
    blocks: Vec<Sums<N>>,
    texels: usize,
    taken: usize,
}

impl<'a, const N: usize> Photographs<'a, N> {
    /// Photographs of `texels` texels each under the lights of `fit`.
    pub fn new(fit: &'a Fit<N>, texels: usize) -> Self {
        let block = |from: usize| {
            let n = BLOCK.min(texels - from);
            Sums { luminance: vec![[0.0; N]; n], color: vec![[0.0; 3]; n] }
        };
        Self { fit, blocks: (0..texels).step_by(BLOCK).map(block).collect(), texels, taken: 0 }
    }

    /// Bytes that so many texels take.
    pub fn bytes(texels: usize) -> u64 {
        (size_of::<[f64; N]>() + size_of::<[f32; 3]>()) as u64 * texels as u64
    }

    /// Adds the photograph under the next light: linear red, green and blue planes.
    ///
    /// # Panics
    /// If there is no further light.
    pub fn add(&mut self, planes: [&[f32]; 3]) -> Result<(), FitError> {
        let (photograph, want) = (self.taken, self.texels);
        if let Some(plane) = planes.iter().find(|p| p.len() != want) {
            return Err(FitError::Size { photograph, got: plane.len(), want });
        }
        if planes.iter().any(|p| p.par_iter().map(|v| usize::from(!v.is_finite())).sum::<usize>() > 0) {
            return Err(FitError::Finite(photograph));
        }
        let rule = &self.fit.rule[photograph];
        self.blocks.par_iter_mut().enumerate().for_each(|(b, block)| {
            let sums = block.luminance.iter_mut().zip(&mut block.color);
            for (k, (luminance, color)) in (b * BLOCK..).zip(sums) {
                let mut l = 0.0;
                for c in 0..3 {
                    color[c] += planes[c][k].max(0.0);
                    l += LUMINANCE[c] * f64::from(planes[c][k]);
                }
                luminance.iter_mut().zip(rule).for_each(|(a, r)| *a += l * r);
            }
        });
        self.taken += 1;
        Ok(())
    }

    /// The texels, once every light has its photograph. A colour is the sum over all photographs, its largest
    /// channel 255; polynomials are in units of which white is 255, such that polynomial · colour / 255 is
    /// the radiance.
    ///
    /// # Panics
    /// If photographs are missing.
    pub fn finish(self) -> Luminance<N> {
        assert_eq!(self.taken, self.fit.lights(), "a photograph for each light");
        let texel = |(a, sum): (&[f64; N], &[f32; 3])| -> ([f32; N], [u8; 3]) {
            let sum = sum.map(f64::from);
            let largest = sum.iter().fold(0.0f64, |m, x| m.max(*x));
            let total: f64 = sum.iter().zip(LUMINANCE).map(|(s, w)| s * w).sum();
            if total <= 0.0 {
                return (a.map(|a| (WHITE * a) as f32), [255; 3]);
            }
            let scale = WHITE * largest / total;
            (a.map(|a| (scale * a) as f32), sum.map(|s| (255.0 * s / largest).round() as u8))
        };
        let mut out = (Vec::with_capacity(self.texels), Vec::with_capacity(self.texels));
        for block in self.blocks {
            let all: Vec<_> = block.luminance.par_iter().zip(block.color.par_iter()).map(texel).collect();
            out.extend(all);
        }
        out
    }
}

/// The value under a light of unit direction `l`.
pub fn evaluate<const N: usize>(a: &[f64; N], l: DVec3) -> f64 {
    a.iter().zip(terms::<N>(l)).map(|(a, t)| a * t).sum()
}

/// The direction of the light above the surface under which a texel is brightest, by any basis; `None` for a
/// constant. Of the biquadratic it is [`normal`]; of harmonics, which may have several maxima, the best of
/// three searches in halved steps from the brightest of 97 directions that lie apart.
pub fn brightest<const N: usize>(a: &[f64; N]) -> Option<DVec3> {
    if let Ok(six) = <&[f64; TERMS]>::try_from(a.as_slice()) {
        return normal(six);
    }
    let size = a[1..].iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if size == 0.0 || !size.is_finite() {
        return None;
    }
    // Seen in the disk of the sine of half the angle, where the rim is the horizon.
    let direction = |p: DVec2| {
        let z = 1.0 - 2.0 * p.length_squared();
        (2.0 * (1.0 - p.length_squared()).max(0.0).sqrt() * p).extend(z)
    };
    let value = |p: DVec2| evaluate(a, direction(p));
    let start = |k: usize| {
        let r = FRAC_1_SQRT_2 * (k as f64 / 96.0).sqrt();
        r * DVec2::from_angle(2.399_963_229_728_653 * k as f64)
    };
    let mut starts: Vec<(f64, DVec2)> = (0..97).map(start).map(|p| (value(p), p)).collect();
    starts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut tried: Vec<DVec2> = Vec::new();
    let mut found = (f64::MIN, DVec2::ZERO);
    for (mut best, mut at) in starts {
        if tried.len() == 3 || tried.iter().any(|p| p.distance(at) < 0.2) {
            continue;
        }
        tried.push(at);
        let mut step = 0.08;
        while step > 1e-5 {
            let turn = |k: i32| DVec2::from_angle(FRAC_PI_4 * f64::from(k));
            let around = (0..8).map(|k| (at + step * turn(k)).clamp_length_max(FRAC_1_SQRT_2));
            let next = around.map(|p| (value(p), p)).max_by(|a, b| a.0.total_cmp(&b.0));
            match next {
                Some((v, p)) if v > best => (best, at) = (v, p),
                _ => step *= 0.5,
            }
        }
        if best > found.0 {
            found = (best, at);
        }
    }
    let at = found.1;
    Some(direction(at))
}

/// The direction of the light under which a texel is brightest, which Malzbender, Gelb & Wolters take for its
/// normal, or `None` for a constant. Where the polynomial has no maximum within the unit disk, the brightest
/// point of its rim: found among 64 and refined by Newton's steps.
pub fn normal(a: &[f64; TERMS]) -> Option<DVec3> {
    let [uu, vv, uv, u, v, _] = *a;
    let size = a[..5].iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if size == 0.0 || !size.is_finite() {
        return None;
    }
    let determinant = 4.0 * uu * vv - uv * uv;
    if uu + vv < 0.0 && determinant > 1e-12 * size * size {
        let top = DVec2::new(uv * v - 2.0 * vv * u, uv * u - 2.0 * uu * v) / determinant;
        if top.length_squared() <= 1.0 {
            return Some(top.extend((1.0 - top.length_squared()).max(0.0).sqrt()));
        }
    }
    // On the rim: L(φ) = (uu + vv)/2 + (uu − vv)/2 cos 2φ + uv/2 sin 2φ + u cos φ + v sin φ.
    let (even, odd) = (0.5 * (uu - vv), 0.5 * uv);
    let value = |phi: f64| {
        let ((s, c), (s2, c2)) = (phi.sin_cos(), (2.0 * phi).sin_cos());
        even * c2 + odd * s2 + u * c + v * s
    };
    let step = std::f64::consts::TAU / 64.0;
    let mut phi = (0..64).map(|k| step * f64::from(k)).max_by(|a, b| value(*a).total_cmp(&value(*b)))?;
    for _ in 0..8 {
        let ((s, c), (s2, c2)) = (phi.sin_cos(), (2.0 * phi).sin_cos());
        let slope = 2.0 * (odd * c2 - even * s2) + v * c - u * s;
        let bend = -4.0 * (even * c2 + odd * s2) - u * c - v * s;
        if bend >= 0.0 {
            break;
        }
        phi -= (slope / bend).clamp(-step, step);
    }
    Some(DVec3::new(phi.cos(), phi.sin(), 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions uniform on the hemisphere.
    fn hemisphere(n: usize) -> Vec<DVec3> {
        let at = |k: usize| {
            let z = (k as f64 + 0.5) / n as f64;
            let (s, phi) = ((1.0 - z * z).sqrt(), 2.399_963_229_728_653 * k as f64);
            DVec3::new(s * phi.cos(), s * phi.sin(), z)
        };
        (0..n).map(at).collect()
    }

    #[test]
    fn quadratics_are_recovered() {
        let lights = hemisphere(24);
        let fit = Fit::<6>::new(&lights).unwrap();
        let a = [-0.4, -0.7, 0.2, 0.3, -0.1, 0.9];
        let found = fit.coefficients(lights.iter().map(|l| evaluate(&a, *l)));
        assert!(a.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    }

    /// Least squares of the cosine over the hemisphere: 9/8 − 15/16 (u² + v²), off by an eighth of its RMS.
    #[test]
    fn lambert_seen_from_above_has_a_closed_form() {
        let lights = hemisphere(200_000);
        let a = Fit::<6>::new(&lights).unwrap().coefficients(lights.iter().map(|l| l.z));
        let want = [-15.0 / 16.0, -15.0 / 16.0, 0.0, 0.0, 0.0, 9.0 / 8.0];
        assert!(a.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-4), "{a:?}");
        let sum = |f: &dyn Fn(&DVec3) -> f64| lights.iter().map(f).sum::<f64>();
        let off = sum(&|l| (evaluate(&a, *l) - l.z).powi(2)) / sum(&|l| l.z * l.z);
        assert!((off.sqrt() - 0.125).abs() < 1e-3, "{}", off.sqrt());
    }

    /// Normals of tilted Lambertian facets are biased, since a parabola is no cosine with its own shadow.
    #[test]
    fn normals_of_tilted_facets_are_biased() {
        let lights = hemisphere(20_000);
        let fit = Fit::<6>::new(&lights).unwrap();
        for (tilt, bias) in [(0.0f64, 0.0), (15.0, 7.1), (30.0, 11.0)] {
            let n = DVec3::new(tilt.to_radians().sin(), 0.0, tilt.to_radians().cos());
            let a = fit.coefficients(lights.iter().map(|l| l.dot(n).max(0.0)));
            let found = normal(&a).unwrap().angle_between(n).to_degrees();
            assert!((found - bias).abs() < 0.1, "{tilt}: {found}");
        }
    }

    /// Harmonics have the cosine among them: Lambert seen from above is recovered, and facets are followed
    /// more closely.
    #[test]
    fn normals_by_harmonics_are_less_biased() {
        fn biases<const N: usize>(want: [(f64, f64, f64); 4]) {
            let lights = hemisphere(20_000);
            let fit = Fit::<N>::new(&lights).unwrap();
            for (tilt, bias, rms) in want {
                let n = DVec3::new(tilt.to_radians().sin(), 0.0, tilt.to_radians().cos());
                let facet = |l: &DVec3| l.dot(n).max(0.0);
                let a = fit.coefficients(lights.iter().map(facet));
                let found = brightest(&a).unwrap().angle_between(n).to_degrees();
                let sum = |f: &dyn Fn(&DVec3) -> f64| lights.iter().map(f).sum::<f64>();
                let off =
                    sum(&|l| (evaluate(&a, *l).max(0.0) - facet(l)).powi(2)) / sum(&|l| facet(l).powi(2));
                println!("{N} {tilt}: {found:.3} {:.4}", off.sqrt());
                assert!((found - bias).abs() < 0.05, "{N}: {tilt}: {found}");
                assert!((off.sqrt() - rms).abs() < 1e-3, "{N}: {tilt}: {}", off.sqrt());
            }
        }
        biases::<9>([(0.0, 0.0, 0.0), (15.0, 0.76, 0.027), (30.0, 0.49, 0.052), (60.0, 1.39, 0.063)]);
        biases::<16>([(0.0, 0.0, 0.0), (15.0, 0.91, 0.0185), (30.0, 0.32, 0.021), (60.0, 2.36, 0.043)]);
    }

    #[test]
    fn harmonics_are_recovered_and_have_the_biquadratic_among_them() {
        fn recovered<const N: usize>() {
            let lights = hemisphere(40);
            let fit = Fit::<N>::new(&lights).unwrap();
            let a: [f64; N] = std::array::from_fn(|k| (k as f64 * 1.7).sin());
            let found = fit.coefficients(lights.iter().map(|l| evaluate(&a, *l)));
            assert!(a.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-10), "{found:?}");
            let six = [-0.4, -0.7, 0.2, 0.3, -0.1, 0.9];
            let all = fit.coefficients(lights.iter().map(|l| evaluate(&six, *l)));
            assert!(hemisphere(100).iter().all(|l| (evaluate(&all, *l) - evaluate(&six, *l)).abs() < 1e-10));
            // Orthonormal over the sphere: those of even order and those of odd order each over the
            // hemisphere.
            let all = hemisphere(20_000);
            let dot = |i: usize, j: usize| {
                let sum: f64 = all.iter().map(|l| terms::<N>(*l)[i] * terms::<N>(*l)[j]).sum();
                sum * 4.0 * std::f64::consts::PI / all.len() as f64
            };
            for (i, j, want) in [(0, 0, 1.0), (2, 2, 1.0), (6, 6, 1.0), (8, 8, 1.0), (4, 6, 0.0), (0, 6, 0.0)]
            {
                assert!((dot(i, j) - want).abs() < 1e-3, "{i} {j}: {}", dot(i, j));
            }
        }
        recovered::<9>();
        recovered::<16>();
    }

    /// The direction that any basis finds is the best of many.
    #[test]
    fn no_direction_is_brighter_than_the_brightest() {
        let all = hemisphere(4000);
        for seed in 0..40 {
            let a: [f64; 16] = std::array::from_fn(|k| ((k + 1) as f64 * 7.3 + f64::from(seed) * 2.1).sin());
            let n = brightest(&a).unwrap();
            assert!((n.length() - 1.0).abs() < 1e-9 && n.z > -1e-9);
            let most = all.iter().map(|l| evaluate(&a, *l)).fold(f64::MIN, f64::max);
            assert!(evaluate(&a, n) >= most - 2e-3 * most.abs(), "{seed}: {} {most}", evaluate(&a, n));
        }
        let mut constant = [0.0; 9];
        constant[0] = 2.0;
        assert_eq!(brightest(&constant), None);
    }

    #[test]
    fn without_a_maximum_within_it_lies_on_the_rim() {
        for a in [
            [0.0, 0.0, 0.0, 3.0, 4.0, 0.0],
            [0.5, -1.0, 0.0, 0.0, 0.0, 1.0],
            [-1.0, -1.0, 0.0, 4.0, 1.0, 0.0],
        ] {
            let n = normal(&a).unwrap();
            assert!((n.length() - 1.0).abs() < 1e-12 && n.z.abs() < 1e-12);
            let best = (0..10_000).map(|k| {
                let (s, c) = (std::f64::consts::TAU * f64::from(k) / 10_000.0).sin_cos();
                evaluate(&a, DVec3::new(c, s, 0.0))
            });
            assert!(evaluate(&a, n) >= best.fold(f64::MIN, f64::max) - 1e-12, "{a:?}: {n}");
        }
        assert_eq!(normal(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.7]), None);
    }

    #[test]
    fn lights_that_determine_nothing_are_refused() {
        assert_eq!(Fit::<6>::new(&hemisphere(5)).unwrap_err(), FitError::Few { got: 5, want: 6 });
        let e = Fit::<16>::new(&hemisphere(15)).unwrap_err().to_string();
        assert!(e.contains("16 coefficients needs 16"), "{e}");
        let ring: Vec<DVec3> = (0..12)
            .map(|k| {
                let (s, c) = (f64::from(k) * 0.5).sin_cos();
                DVec3::new(0.6 * c, 0.6 * s, 0.8)
            })
            .collect();
        let e = Fit::<6>::new(&ring).unwrap_err();
        assert!(matches!(e, FitError::Conic(c) if c > MAX_CONDITION) && !e.to_string().contains('\n'), "{e}");
        let mut below = hemisphere(8);
        below[3].z = -0.1;
        assert!(matches!(Fit::<6>::new(&below), Err(FitError::Below(3, ..))));
        below[3] = DVec3::NAN;
        assert!(matches!(Fit::<6>::new(&below), Err(FitError::Below(3, ..))));
    }

    /// Photographs of one colour under lights give its polynomial and its colour; polynomial · colour / 255
    /// is the radiance.
    #[test]
    fn photographs_become_polynomials_and_colours() {
        let lights = hemisphere(16);
        let fit = Fit::<6>::new(&lights).unwrap();
        let a = [-0.3, -0.2, 0.1, 0.05, -0.1, 0.6];
        let color = [0.8, 0.4, 0.2];
        let texels = 100;
        let mut all = Photographs::new(&fit, texels);
        for l in &lights {
            let planes = color.map(|c| vec![(c * evaluate(&a, *l)) as f32; texels]);
            all.add([&planes[0], &planes[1], &planes[2]]).unwrap();
        }
        let (luminance, bytes) = all.finish();
        assert_eq!(bytes[texels - 1], [255, 128, 64]);
        for (found, a) in luminance[texels - 1].iter().zip(a) {
            assert!((f64::from(*found) / WHITE - 0.8 * a).abs() < 1e-6, "{found} {a}");
        }
        let mut wrong = Photographs::new(&fit, 2);
        let (two, three) = ([0.5f32; 2], [0.5f32; 3]);
        assert!(matches!(
            wrong.add([&two, &three, &two]),
            Err(FitError::Size { photograph: 0, got: 3, want: 2 })
        ));
        assert_eq!(wrong.add([&two, &[f32::NAN; 2], &two]), Err(FitError::Finite(0)));
    }
}
