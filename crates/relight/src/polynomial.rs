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
use std::sync::LazyLock;
use steradian_formats::Photograph;
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

/// Of what of the photographs polynomials are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channels {
    /// Of luminance, which scales one colour a texel.
    Luminance,
    /// Of red, of green and of blue.
    Colour,
}

impl Channels {
    /// Polynomials a texel.
    fn count(self) -> usize {
        if self == Self::Luminance { 1 } else { 3 }
    }
}

/// What photographs have become. Polynomials are in units of which white is 255.
#[derive(Debug, Clone, Default)]
pub struct Polynomials<const N: usize> {
    /// Of each channel the coefficients, one plane after the other; of luminance such that polynomial ·
    /// colour / 255 is the radiance.
    pub planes: Vec<[Vec<f32>; N]>,
    /// Of luminance the colour that it scales, its largest channel 255.
    pub color: Option<Vec<[u8; 3]>>,
}

/// Texels that are worked on at a time: their values under a few lights stay in the nearest cache.
const RUN: usize = 1024;

/// Linear red, green and blue of a photograph, run by run.
trait Rows: Sync {
    fn texels(&self) -> usize;
    fn finite(&self) -> bool;
    fn run(&self, from: usize, out: [&mut [f32]; 3]);
}

impl Rows for Photograph {
    fn texels(&self) -> usize {
        let (w, h) = self.size();
        w * h
    }

    fn finite(&self) -> bool {
        self.first_non_finite().is_none()
    }

    fn run(&self, from: usize, out: [&mut [f32]; 3]) {
        self.linear(from, out);
    }
}

impl Rows for [&[f32]; 3] {
    /// The plane that is out of line, where one is.
    fn texels(&self) -> usize {
        let first = self[0].len();
        self.iter().map(|p| p.len()).find(|n| *n != first).unwrap_or(first)
    }

    fn finite(&self) -> bool {
        self.iter().all(|p| p.par_iter().map(|v| usize::from(!v.is_finite())).sum::<usize>() == 0)
    }

    fn run(&self, from: usize, out: [&mut [f32]; 3]) {
        for (plane, out) in self.iter().zip(out) {
            out.copy_from_slice(&plane[from..from + out.len()]);
        }
    }
}

/// Polynomials of photographs that are taken one by one or a few at a time: of six coefficients 36 bytes a
/// texel for luminance and its colour, 72 for three channels, whatever the number of photographs.
///
/// What is summed in single precision are the values along an orthonormal basis ([`Fit`]), so that rounding
/// is that of photographs whose values were rounded to single precision; coefficients are made of the sums in
/// double precision, in their place.
pub struct Photographs<'a, const N: usize = TERMS> {
    fit: &'a Fit<N>,
    channels: Channels,
    /// Of each channel the sums, and behind them those of red, green and blue where one colour is asked for.
    planes: Vec<Vec<f32>>,
    texels: usize,
    taken: usize,
}

impl<'a, const N: usize> Photographs<'a, N> {
    /// Photographs of `texels` texels each under the lights of `fit`.
    pub fn new(fit: &'a Fit<N>, channels: Channels, texels: usize) -> Self {
        let planes = (0..Self::numbers(channels)).map(|_| vec![0.0; texels]).collect();
        Self { fit, channels, planes, texels, taken: 0 }
    }

    /// Numbers of a texel.
    fn numbers(channels: Channels) -> usize {
        let colour = if channels == Channels::Luminance { 3 } else { 0 };
        N * channels.count() + colour
    }

    /// Bytes that so many texels take.
    pub fn bytes(channels: Channels, texels: usize) -> u64 {
        4 * Self::numbers(channels) as u64 * texels as u64
    }

    /// Adds the photograph under the next light: linear red, green and blue planes.
    ///
    /// # Panics
    /// If there is no further light.
    pub fn add(&mut self, planes: [&[f32]; 3]) -> Result<(), FitError> {
        self.add_rows(&[&planes])
    }

    /// Adds the photographs under the next lights. Sums are the same to the bit as one by one; memory is gone
    /// over once.
    ///
    /// # Panics
    /// If there are fewer lights.
    pub fn add_all(&mut self, photographs: &[Photograph]) -> Result<(), FitError> {
        self.add_rows(&photographs.iter().map(|p| p as &dyn Rows).collect::<Vec<_>>())
    }

    fn add_rows(&mut self, all: &[&dyn Rows]) -> Result<(), FitError> {
        let want = self.texels;
        for (photograph, rows) in (self.taken..).zip(all) {
            if rows.texels() != want {
                return Err(FitError::Size { photograph, got: rows.texels(), want });
            }
            if !rows.finite() {
                return Err(FitError::Finite(photograph));
            }
        }
        let along = &self.fit.along[self.taken..self.taken + all.len()];
        let mut runs: Vec<Vec<&mut [f32]>> =
            (0..want.div_ceil(RUN)).map(|_| Vec::with_capacity(self.planes.len())).collect();
        for plane in &mut self.planes {
            runs.iter_mut().zip(plane.chunks_mut(RUN)).for_each(|(run, part)| run.push(part));
        }
        let channels = self.channels;
        runs.par_iter_mut().enumerate().for_each(|(k, run)| add_run(k * RUN, run, channels, all, along));
        self.taken += all.len();
        Ok(())
    }

    /// The texels, once every light has its photograph.
    ///
    /// # Panics
    /// If photographs are missing.
    pub fn finish(self) -> Polynomials<N> {
        assert_eq!(self.taken, self.fit.lights(), "a photograph for each light");
        let mut planes = self.planes.into_iter();
        let mut of: Vec<[Vec<f32>; N]> = (0..self.channels.count())
            .map(|_| std::array::from_fn(|_| planes.next().unwrap_or_default()))
            .collect();
        let sums: Vec<Vec<f32>> = planes.collect();
        let mut color = vec![[0u8; 3]; sums.first().map_or(0, Vec::len)];
        for channel in &mut of {
            let mut parts = color.chunks_mut(RUN);
            let mut runs: Vec<Finished<'_>> = (0..self.texels.div_ceil(RUN))
                .map(|_| (Vec::with_capacity(N), parts.next().unwrap_or_default()))
                .collect();
            for plane in channel {
                runs.iter_mut().zip(plane.chunks_mut(RUN)).for_each(|(run, part)| run.0.push(part));
            }
            let back = &self.fit.back;
            runs.par_iter_mut().enumerate().for_each(|(r, run)| finish_run(r * RUN, run, &sums, back));
        }
        Polynomials { planes: of, color: (!sums.is_empty()).then_some(color) }
    }
}

/// A run of a channel's sums, which become coefficients in their place, and of colours.
type Finished<'a> = (Vec<&'a mut [f32]>, &'a mut [[u8; 3]]);

fn finish_run<const N: usize>(
    from: usize,
    (planes, color): &mut Finished<'_>,
    sums: &[Vec<f32>],
    back: &[[f64; N]; N],
) {
    let mut white = [WHITE; RUN];
    for t in 0..color.len() {
        let [r, g, b] = [sums[0][from + t], sums[1][from + t], sums[2][from + t]];
        let shade = Shade::of([f64::from(r), f64::from(g), f64::from(b)]);
        (color[t], white[t]) = (shade.color, shade.luminance);
    }
    let n = planes[0].len();
    let along: Vec<Vec<f32>> = planes.iter().map(|plane| plane.to_vec()).collect();
    let mut sum = [0.0; RUN];
    for (plane, back) in planes.iter_mut().zip(back) {
        let a = &mut sum[..n];
        a.fill(0.0);
        for (back, along) in back.iter().zip(&along) {
            let x = &along[..n];
            for t in 0..n {
                a[t] += back * f64::from(x[t]);
            }
        }
        let (to, white) = (&mut plane[..n], &white[..n]);
        for t in 0..n {
            to[t] = (white[t] * a[t]) as f32;
        }
    }
}

/// A texel's colour, its largest channel 255, and what its luminance is scaled by.
struct Shade {
    color: [u8; 3],
    luminance: f64,
}

impl Shade {
    /// Of the sum over all photographs.
    fn of(sum: [f64; 3]) -> Self {
        let largest = sum[0].max(sum[1]).max(sum[2]);
        let total = LUMINANCE[0] * sum[0] + LUMINANCE[1] * sum[1] + LUMINANCE[2] * sum[2];
        if total <= 0.0 {
            return Self { color: [255; 3], luminance: WHITE };
        }
        // Sums are not negative: rounded without a call.
        let byte = 255.0 / largest;
        let color = [(byte * sum[0] + 0.5) as u8, (byte * sum[1] + 0.5) as u8, (byte * sum[2] + 0.5) as u8];
        Self { color, luminance: WHITE * largest / total }
    }
}

/// Adds texels from `from` on under a few lights to their sums.
fn add_run<const N: usize>(
    from: usize,
    run: &mut [&mut [f32]],
    channels: Channels,
    all: &[&dyn Rows],
    along: &[[f32; N]],
) {
    let n = run[0].len();
    let mut planes = vec![[[0.0f32; RUN]; 3]; all.len()];
    for (rows, [r, g, b]) in all.iter().zip(&mut planes) {
        rows.run(from, [&mut r[..n], &mut g[..n], &mut b[..n]]);
    }
    if channels == Channels::Luminance {
        let weights = LUMINANCE.map(|w| w as f32);
        for [r, g, b] in &mut planes {
            for (sum, x) in run[N..].iter_mut().zip([&*r, &*g, &*b]) {
                add_positive(sum, x);
            }
            for t in 0..RUN {
                r[t] = weights[0] * r[t] + weights[1] * g[t] + weights[2] * b[t];
            }
        }
    }
    for (k, sum) in run[..N * channels.count()].iter_mut().enumerate() {
        let mut lights = along.iter().zip(&planes).map(|(along, planes)| (along[k % N], &planes[k / N]));
        while let Some(one) = lights.next() {
            match lights.next() {
                Some(other) => add_two(sum, one, other),
                None => add_two(sum, one, (0.0, one.1)),
            }
        }
    }
}

/// Adds what is above 0 of a run. Here and below loops count: closures that other loops go through may be
/// compiled apart and called for each texel.
fn add_positive(sum: &mut [f32], x: &[f32; RUN]) {
    let x = &x[..sum.len()];
    for t in 0..sum.len() {
        sum[t] += x[t].max(0.0);
    }
}

/// s + a x + b y of a run, added in this order: memory is gone over once for two photographs.
fn add_two(sum: &mut [f32], (a, x): (f32, &[f32; RUN]), (b, y): (f32, &[f32; RUN])) {
    let (x, y) = (&x[..sum.len()], &y[..sum.len()]);
    for t in 0..sum.len() {
        sum[t] = sum[t] + a * x[t] + b * y[t];
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
    let mut best = (f64::NEG_INFINITY, 0);
    for (k, [c, s, c2, s2]) in RIM.iter().enumerate() {
        let value = even * c2 + odd * s2 + u * c + v * s;
        if value >= best.0 {
            best = (value, k);
        }
    }
    let mut phi = RIM_STEP * best.1 as f64;
    for _ in 0..8 {
        let (s, c) = phi.sin_cos();
        let (s2, c2) = (2.0 * s * c, c * c - s * s);
        let slope = 2.0 * (odd * c2 - even * s2) + v * c - u * s;
        let bend = -4.0 * (even * c2 + odd * s2) - u * c - v * s;
        if bend >= 0.0 {
            break;
        }
        let change = (slope / bend).clamp(-RIM_STEP, RIM_STEP);
        phi -= change;
        // Newton's error is squared by each step: the next would be below rounding.
        if change.abs() < 1e-9 {
            break;
        }
    }
    Some(DVec3::new(phi.cos(), phi.sin(), 0.0))
}

/// Directions of the rim that are tried, and how far they are apart.
const RIM_TRIED: usize = 64;
const RIM_STEP: f64 = std::f64::consts::TAU / RIM_TRIED as f64;

/// Cosine and sine of φ and of 2φ of each.
static RIM: LazyLock<[[f64; 4]; RIM_TRIED]> = LazyLock::new(|| {
    std::array::from_fn(|k| {
        let phi = RIM_STEP * k as f64;
        let ((s, c), (s2, c2)) = (phi.sin_cos(), (2.0 * phi).sin_cos());
        [c, s, c2, s2]
    })
});

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

    /// Normals of tilted Lambertian facets are biased, since a parabola differs from a cosine clamped at its
    /// own shadow.
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
        assert!(e.contains("16 spherical harmonics need 16"), "{e}");
        let ring: Vec<DVec3> = (0..12)
            .map(|k| {
                let (s, c) = (f64::from(k) * 0.5).sin_cos();
                DVec3::new(0.6 * c, 0.6 * s, 0.8)
            })
            .collect();
        let e = Fit::<6>::new(&ring).unwrap_err();
        let singular = |e: &FitError| {
            let text = e.to_string();
            assert!(
                text.contains("singular") && !text.contains("inf") && text.lines().count() == 1,
                "{text}"
            );
            matches!(e, FitError::Undetermined { condition, .. } if *condition > MAX_CONDITION)
        };
        assert!(singular(&e) && e.to_string().contains("one conic"), "{e}");
        // Two rings are two conics: six numbers are determined, nine harmonics are not.
        let two = |second: f64| -> Vec<DVec3> {
            let z = |k: usize| if k.is_multiple_of(2) { 0.8 } else { second };
            let at = |k: usize| (z(k), (1.0 - z(k) * z(k)).sqrt(), 0.5 * k as f64);
            (0..24).map(at).map(|(z, r, phi)| DVec3::new(r * phi.cos(), r * phi.sin(), z)).collect()
        };
        assert!(Fit::<6>::new(&two(0.4)).is_ok());
        for (e, n) in
            [(Fit::<9>::new(&two(0.4)).unwrap_err(), 9), (Fit::<16>::new(&two(0.4)).unwrap_err(), 16)]
        {
            assert!(singular(&e) && e.to_string().contains(&format!("{n} spherical harmonics")), "{e}");
            assert!(!e.to_string().contains("conic"), "{e}");
        }
        let e = Fit::<6>::new(&two(0.8 + 1e-6)).unwrap_err().to_string();
        assert!(e.contains("condition number ") && e.contains("e6"), "{e}");
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
        let mut all = Photographs::new(&fit, Channels::Luminance, texels);
        for l in &lights {
            let planes = color.map(|c| vec![(c * evaluate(&a, *l)) as f32; texels]);
            all.add([&planes[0], &planes[1], &planes[2]]).unwrap();
        }
        let Polynomials { planes, color: bytes } = all.finish();
        assert_eq!(bytes.unwrap()[texels - 1], [255, 128, 64]);
        for (found, a) in planes[0].iter().zip(a) {
            let found = found[texels - 1];
            assert!((f64::from(found) / WHITE - 0.8 * a).abs() < 1e-6, "{found} {a}");
        }
        let mut wrong = Photographs::new(&fit, Channels::Luminance, 2);
        let (two, three) = ([0.5f32; 2], [0.5f32; 3]);
        assert!(matches!(
            wrong.add([&two, &three, &two]),
            Err(FitError::Size { photograph: 0, got: 3, want: 2 })
        ));
        assert_eq!(wrong.add([&two, &[f32::NAN; 2], &two]), Err(FitError::Finite(0)));
    }

    /// Planes by formula, others under each light.
    fn some(light: usize, texels: usize) -> [Vec<f32>; 3] {
        let value = |c: usize, k: usize| ((k * 37 + light * 1013 + c * 211) % 4099) as f32 / 4098.0;
        [0, 1, 2].map(|c| (0..texels).map(|k| value(c, k)).collect())
    }

    /// Bytes of a texel, which decide how many megapixels a machine takes: 60 photographs of 12 megapixels
    /// stay below a gigabyte in three channels.
    #[test]
    fn sums_take_few_bytes_a_texel() {
        assert_eq!(Photographs::<6>::bytes(Channels::Luminance, 1), 36);
        assert_eq!(Photographs::<6>::bytes(Channels::Colour, 1), 72);
        assert_eq!(Photographs::<16>::bytes(Channels::Colour, 1), 192);
        let fit = Fit::<6>::new(&hemisphere(8)).unwrap();
        for channels in [Channels::Luminance, Channels::Colour] {
            let texels = 3 * RUN + 5;
            let mut all = Photographs::new(&fit, channels, texels);
            (0..8).for_each(|l| all.add(some(l, texels).each_ref().map(|p| &p[..])).unwrap());
            let held = |planes: &[Vec<f32>]| planes.iter().map(|p| 4 * p.capacity() as u64).sum::<u64>();
            assert_eq!(held(&all.planes), Photographs::<6>::bytes(channels, texels));
            // Coefficients lie where the sums lay.
            let places: Vec<*const f32> = all.planes.iter().map(|p| p.as_ptr()).collect();
            let out = all.finish();
            let planes = out.planes.iter().flatten().map(|p| p.as_ptr());
            assert!(planes.zip(places).all(|(a, b)| a == b));
        }
    }

    /// Sums in single precision against the rule in double, where lights are badly placed too: off by
    /// rounding of the photographs' values times the condition number.
    #[test]
    fn sums_in_single_precision_lose_no_more_than_rounded_photographs() {
        let ring = |height: f64| -> Vec<DVec3> {
            let z = |k: usize| if k.is_multiple_of(2) { 0.8 } else { height };
            let at = |k: usize| (z(k), (1.0 - z(k) * z(k)).sqrt(), 0.7 * k as f64);
            (0..60).map(at).map(|(z, r, phi)| DVec3::new(r * phi.cos(), r * phi.sin(), z)).collect()
        };
        for lights in [hemisphere(60), ring(0.6), ring(0.79), ring(0.799)] {
            let fit = Fit::<6>::new(&lights).unwrap();
            let texels = 500;
            let photographs: Vec<[Vec<f32>; 3]> = (0..60).map(|l| some(l, texels)).collect();
            let mut all = Photographs::new(&fit, Channels::Colour, texels);
            photographs.iter().for_each(|p| all.add(p.each_ref().map(|p| &p[..])).unwrap());
            let out = all.finish();
            let mut most = 0.0f64;
            for (c, plane) in out.planes.iter().enumerate() {
                for t in 0..texels {
                    let want = fit.coefficients(photographs.iter().map(|p| f64::from(p[c][t])));
                    let size = want.iter().fold(1.0f64, |m, x| m.max(x.abs()));
                    for (got, want) in plane.iter().zip(want) {
                        most = most.max((f64::from(got[t]) / WHITE - want).abs() / size);
                    }
                }
            }
            assert!(most < 4e-7 * fit.condition().max(2.0), "{most:.1e} at {:.1e}", fit.condition());
        }
    }

    /// Neither the number of threads nor that of photographs at a time changes a bit.
    #[test]
    fn threads_and_batches_change_no_bit() {
        let lights = hemisphere(9);
        let fit = Fit::<6>::new(&lights).unwrap();
        let texels = 5 * RUN + 77;
        let photographs: Vec<[Vec<f32>; 3]> = (0..9).map(|l| some(l, texels)).collect();
        let of = |threads: usize, channels: Channels, at_once: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut all = Photographs::new(&fit, channels, texels);
                for batch in photographs.chunks(at_once) {
                    let planes: Vec<[&[f32]; 3]> =
                        batch.iter().map(|p| p.each_ref().map(|p| &p[..])).collect();
                    all.add_rows(&planes.iter().map(|p| p as &dyn Rows).collect::<Vec<_>>()).unwrap();
                }
                let out = all.finish();
                let bits = out.planes.iter().flatten().flatten().map(|x| x.to_bits());
                (bits.collect::<Vec<u32>>(), out.color)
            })
        };
        for channels in [Channels::Luminance, Channels::Colour] {
            let one = of(1, channels, 1);
            assert!([(3, 1), (1, 4), (3, 2)].iter().all(|(t, n)| of(*t, channels, *n) == one));
        }
    }
}
