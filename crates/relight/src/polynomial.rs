//! Polynomial texture maps (Malzbender, Gelb & Wolters 2001, *Polynomial Texture Maps*) from photographs under known lights.
//!
//! A texel's luminance under a light of unit direction l is,
//!
//! > L(u, v) = a₀u² + a₁v² + a₂uv + a₃u + a₄v + a₅,  (u, v) = (l·t, l·b),
//!
//! x to the right of the photograph, y up, z to the camera. The coefficients are those of least squares; the rule
//! that takes the values under all lights to them is the same for every texel, so that photographs are taken one by one.

use glam::{DVec2, DVec3};
use steradian_formats::{PtmCoefficients, PtmTexels};
use steradian_numerics::eigen;
use steradian_parallel::prelude::*;

/// Numbers of a polynomial.
const TERMS: usize = 6;
/// Largest ratio of singular values of the lights' polynomials: beyond it the coefficients are mostly rounding of 8-bit
/// photographs.
const MAX_CONDITION: f64 = 1e5;
/// Weights of linear Rec. 709 red, green and blue in luminance.
pub const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];
/// What white is in the files of the usual fitters.
const WHITE: f64 = 255.0;

/// Why photographs give no polynomials.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Too few lights.
    #[error("{0} lights: a polynomial of six coefficients needs six at least")]
    Few(usize),
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

/// u², v², uv, u, v, 1.
fn terms(u: f64, v: f64) -> [f64; TERMS] {
    [u * u, v * v, u * v, u, v, 1.0]
}

/// The rule of least squares for a set of lights.
#[derive(Debug, Clone)]
pub struct Fit {
    /// What a value under each light adds to the coefficients.
    rule: Vec<[f64; TERMS]>,
    condition: f64,
}

impl Fit {
    /// The rule for lights in these directions, of any length.
    pub fn new(lights: &[DVec3]) -> Result<Self, FitError> {
        if lights.len() < TERMS {
            return Err(FitError::Few(lights.len()));
        }
        let mut rows = Vec::with_capacity(lights.len());
        for (k, l) in lights.iter().enumerate() {
            match l.try_normalize() {
                Some(d) if d.z > 0.0 => rows.push(terms(d.x, d.y)),
                _ => return Err(FitError::Below(k, l.x, l.y, l.z)),
            }
        }
        let gram = |i: usize, j: usize| rows.iter().map(|r| r[i] * r[j]).sum::<f64>();
        let pairs = eigen::symmetric((0..TERMS).map(|i| (0..TERMS).map(|j| gram(i, j)).collect()).collect());
        let (most, least) = (pairs[0].0, pairs[TERMS - 1].0.max(0.0));
        let condition = (most / least).sqrt();
        // Squares of singular values are known to rounding of the largest: far beyond the bound they are noise.
        if condition.is_nan() || condition > MAX_CONDITION {
            return Err(FitError::Conic(condition));
        }
        // (Σ φφᵀ)⁻¹ φ of each light.
        let rule = rows.iter().map(|row| {
            let mut out = [0.0; TERMS];
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
    pub fn coefficients(&self, values: impl IntoIterator<Item = f64>) -> [f64; TERMS] {
        let mut out = [0.0; TERMS];
        for (rule, value) in self.rule.iter().zip(values) {
            out.iter_mut().zip(rule).for_each(|(o, r)| *o += r * value);
        }
        out
    }
}

/// Polynomials of luminance and the colour that they scale, photograph by photograph: 72 bytes a texel,
/// whatever the number of photographs.
pub struct Photographs<'a> {
    fit: &'a Fit,
    luminance: Vec<[f64; TERMS]>,
    color: Vec<[f64; 3]>,
    taken: usize,
}

impl<'a> Photographs<'a> {
    /// Photographs of `texels` texels each under the lights of `fit`.
    pub fn new(fit: &'a Fit, texels: usize) -> Self {
        Self { fit, luminance: vec![[0.0; TERMS]; texels], color: vec![[0.0; 3]; texels], taken: 0 }
    }

    /// Adds the photograph under the next light: linear red, green and blue planes.
    ///
    /// # Panics
    /// If there is no further light.
    pub fn add(&mut self, planes: [&[f32]; 3]) -> Result<(), FitError> {
        let (photograph, want) = (self.taken, self.color.len());
        if let Some(plane) = planes.iter().find(|p| p.len() != want) {
            return Err(FitError::Size { photograph, got: plane.len(), want });
        }
        if planes.iter().any(|p| p.par_iter().map(|v| usize::from(!v.is_finite())).sum::<usize>() > 0) {
            return Err(FitError::Finite(photograph));
        }
        let rule = &self.fit.rule[photograph];
        self.luminance.par_iter_mut().zip(self.color.par_iter_mut()).enumerate().for_each(
            |(k, (luminance, color))| {
                let mut l = 0.0;
                for c in 0..3 {
                    let v = f64::from(planes[c][k]);
                    color[c] += v.max(0.0);
                    l += LUMINANCE[c] * v;
                }
                luminance.iter_mut().zip(rule).for_each(|(a, r)| *a += l * r);
            },
        );
        self.taken += 1;
        Ok(())
    }

    /// The texels, once every light has its photograph. A colour is the sum over all photographs, its largest channel 255;
    /// polynomials are in units of which white is 255, such that polynomial · colour / 255 is the radiance.
    ///
    /// # Panics
    /// If photographs are missing.
    pub fn finish(self) -> PtmTexels {
        assert_eq!(self.taken, self.fit.lights(), "a photograph for each light");
        let texel = |(a, sum): (&[f64; TERMS], &[f64; 3])| -> (PtmCoefficients, [u8; 3]) {
            let largest = sum.iter().fold(0.0f64, |m, x| m.max(*x));
            let total: f64 = sum.iter().zip(LUMINANCE).map(|(s, w)| s * w).sum();
            if total <= 0.0 {
                return (a.map(|a| (WHITE * a) as f32), [255; 3]);
            }
            let scale = WHITE * largest / total;
            (a.map(|a| (scale * a) as f32), sum.map(|s| (255.0 * s / largest).round() as u8))
        };
        let all: Vec<_> = self.luminance.par_iter().zip(self.color.par_iter()).map(texel).collect();
        let (luminance, color) = all.into_iter().unzip();
        PtmTexels::Lrgb { luminance, color }
    }
}

/// L(u, v) under a light of unit direction `l`.
pub fn evaluate(a: &[f64; TERMS], l: DVec3) -> f64 {
    a.iter().zip(terms(l.x, l.y)).map(|(a, t)| a * t).sum()
}

/// The direction of the light under which a texel is brightest, which Malzbender, Gelb & Wolters take for its normal,
/// or `None` for a constant. Where the polynomial has no maximum within the unit disk, the brightest point of its
/// rim: found among 64 and refined by Newton's steps.
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
        let fit = Fit::new(&lights).unwrap();
        let a = [-0.4, -0.7, 0.2, 0.3, -0.1, 0.9];
        let found = fit.coefficients(lights.iter().map(|l| evaluate(&a, *l)));
        assert!(a.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    }

    /// Least squares of the cosine over the hemisphere: 9/8 − 15/16 (u² + v²), off by an eighth of its RMS.
    #[test]
    fn lambert_seen_from_above_has_a_closed_form() {
        let lights = hemisphere(200_000);
        let a = Fit::new(&lights).unwrap().coefficients(lights.iter().map(|l| l.z));
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
        let fit = Fit::new(&lights).unwrap();
        for (tilt, bias) in [(0.0f64, 0.0), (15.0, 7.1), (30.0, 11.0)] {
            let n = DVec3::new(tilt.to_radians().sin(), 0.0, tilt.to_radians().cos());
            let a = fit.coefficients(lights.iter().map(|l| l.dot(n).max(0.0)));
            let found = normal(&a).unwrap().angle_between(n).to_degrees();
            assert!((found - bias).abs() < 0.1, "{tilt}: {found}");
        }
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
        assert_eq!(Fit::new(&hemisphere(5)).unwrap_err(), FitError::Few(5));
        let ring: Vec<DVec3> = (0..12)
            .map(|k| {
                let (s, c) = (f64::from(k) * 0.5).sin_cos();
                DVec3::new(0.6 * c, 0.6 * s, 0.8)
            })
            .collect();
        let e = Fit::new(&ring).unwrap_err();
        assert!(matches!(e, FitError::Conic(c) if c > MAX_CONDITION) && !e.to_string().contains('\n'), "{e}");
        let mut below = hemisphere(8);
        below[3].z = -0.1;
        assert!(matches!(Fit::new(&below), Err(FitError::Below(3, ..))));
        below[3] = DVec3::NAN;
        assert!(matches!(Fit::new(&below), Err(FitError::Below(3, ..))));
    }

    /// Photographs of one colour under lights give its polynomial and its colour; polynomial · colour / 255 is the radiance.
    #[test]
    fn photographs_become_polynomials_and_colours() {
        let lights = hemisphere(16);
        let fit = Fit::new(&lights).unwrap();
        let a = [-0.3, -0.2, 0.1, 0.05, -0.1, 0.6];
        let color = [0.8, 0.4, 0.2];
        let texels = 100;
        let mut all = Photographs::new(&fit, texels);
        for l in &lights {
            let planes = color.map(|c| vec![(c * evaluate(&a, *l)) as f32; texels]);
            all.add([&planes[0], &planes[1], &planes[2]]).unwrap();
        }
        let PtmTexels::Lrgb { luminance, color: bytes } = all.finish() else {
            panic!("luminance and colour")
        };
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
