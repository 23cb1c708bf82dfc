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

mod brightest;
mod photographs;
#[cfg(test)]
mod tests;

pub use brightest::{brightest, evaluate, normal};
pub use photographs::{Channels, Photographs, Polynomials};

use glam::DVec3;
use steradian_numerics::eigen;

/// Numbers of the polynomial of Malzbender, Gelb & Wolters.
const TERMS: usize = 6;
/// Numbers of spherical harmonics up to order 2 and 3.
const HARMONICS: [usize; 2] = [9, 16];
/// Largest ratio of singular values of the lights' polynomials: beyond it the coefficients are mostly
/// rounding of 8-bit photographs.
const MAX_CONDITION: f64 = 1e5;
/// Weights of linear Rec. 709 red, green and blue in luminance.
pub const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];
/// Value of white in the files of the usual fitters.
const WHITE: f64 = 255.0;

/// Condition numbers beyond this are rounding: squares of singular values are known to 1e-16 of the largest.
const SINGULAR: f64 = 1e7;

/// Why photographs give no polynomials.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Too few lights.
    #[error("{got} lights: {} at least", needs(*.want))]
    Few {
        /// Lights.
        got: usize,
        /// Coefficients.
        want: usize,
    },
    /// A light that does not light the surface: which, from 0, and its direction.
    #[error("the light of photograph {} {}", .0 + 1, below([*.1, *.2, *.3]))]
    Below(usize, f64, f64, f64),
    /// Lights that leave coefficients undetermined.
    #[error("{}", undetermined(*.terms, *.condition))]
    Undetermined {
        /// Coefficients.
        terms: usize,
        /// Ratio of the largest singular value of the lights' polynomials to the smallest.
        condition: f64,
    },
    /// A photograph of another size.
    #[error("photograph {} has {got} texels where the first has {want}", photograph + 1)]
    Size {
        /// Index of the photograph, from 0.
        photograph: usize,
        /// Its number of texels.
        got: usize,
        /// Number of texels of the first photograph.
        want: usize,
    },
    /// A photograph with values that are not finite: which, from 0.
    #[error("photograph {} has values that are not finite", .0 + 1)]
    Finite(usize),
}

fn needs(terms: usize) -> String {
    match terms {
        TERMS => "a polynomial of six coefficients needs six".into(),
        n => format!("{n} spherical harmonics need {n}"),
    }
}

/// What is wrong with the direction of a light that does not light the surface.
pub fn below(direction: [f64; 3]) -> String {
    let [x, y, z] = direction.map(significant);
    format!("has the direction ({x}, {y}, {z}): it must be finite and above the surface, z > 0")
}

/// Four significant digits.
fn significant(x: f64) -> String {
    let size = x.abs();
    if !x.is_finite() || size >= 1e6 || (size < 1e-4 && x != 0.0) {
        return format!("{x:.3e}");
    }
    let before = if x == 0.0 { 0 } else { size.log10().floor() as i32 };
    let text = format!("{x:.*}", (3 - before).max(0) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

fn undetermined(terms: usize, condition: f64) -> String {
    let how =
        if condition < SINGULAR { format!("condition number {condition:.1e}") } else { "singular".into() };
    match terms {
        TERMS => format!("the lights lie on one conic, or nearly so ({how}): add some at another elevation"),
        n => {
            let rings = if n == HARMONICS[0] { "three" } else { "four" };
            format!(
                "the lights do not determine {n} spherical harmonics ({how}): add some at other elevations, of which \
                 rings of lights need {rings} at least, or take a basis of fewer"
            )
        }
    }
}

/// Basis functions of a texel's sum.
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
    /// Contribution of a value under each light to the coefficients.
    rule: Vec<[f64; N]>,
    /// Λ^(−1/2) Vᵀ φ of each light, with the eigenvectors V and eigenvalues Λ of Σ φφᵀ: over all lights these
    /// are orthonormal.
    along: Vec<[f32; N]>,
    /// V Λ^(−1/2), which makes coefficients of sums along them.
    back: [[f64; N]; N],
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
        if condition.is_nan() || condition > MAX_CONDITION {
            return Err(FitError::Undetermined { terms: N, condition });
        }
        // (Σ φφᵀ)⁻¹ φ = V Λ⁻¹ Vᵀ φ of each light.
        let dot = |row: &[f64; N], vector: &[f64]| row.iter().zip(vector).map(|(a, b)| a * b).sum::<f64>();
        let rule = rows.iter().map(|row| {
            let mut out = [0.0; N];
            for (value, vector) in &pairs {
                let along = dot(row, vector) / value;
                out.iter_mut().zip(vector).for_each(|(o, v)| *o += along * v);
            }
            out
        });
        let along = |row| std::array::from_fn(|k| (dot(row, &pairs[k].1) / pairs[k].0.sqrt()) as f32);
        Ok(Self {
            rule: rule.collect(),
            along: rows.iter().map(along).collect(),
            back: std::array::from_fn(|i| std::array::from_fn(|k| pairs[k].1[i] / pairs[k].0.sqrt())),
            condition,
        })
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
