//! Sums over photographs, and the polynomials that they become.

use super::{Fit, FitError, LUMINANCE, TERMS, WHITE};
use steradian_formats::Photograph;
use steradian_parallel::prelude::*;

/// The values of the photographs that polynomials are fitted to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channels {
    /// Luminance, which scales one colour per texel.
    Luminance,
    /// Red, green and blue, each by a polynomial of its own.
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
pub(super) const RUN: usize = 1024;

/// Linear red, green and blue of a photograph, run by run.
pub(super) trait Rows: Sync {
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
    pub(super) planes: Vec<Vec<f32>>,
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

    pub(super) fn add_rows(&mut self, all: &[&dyn Rows]) -> Result<(), FitError> {
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
