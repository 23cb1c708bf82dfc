//! Sums over the texels of a lat-long image, each at its centre: all of them, or those around a direction.
//!
//! With ρ = sin and y = cos of the direction's polar angle, a texel at azimuth distance Δφ in row j has
//! s² = sin²(θ/2) = ((ρ − s_j)² + (y − c_j)²)/4 + ρ s_j sin²(Δφ/2): a sum of squares, which keeps its digits in single
//! precision. Kernels are evaluated for many texels at once ([`Zonal::fill`]), in blocks that begin with a register;
//! long rows are summed in double precision.

use crate::Zonal;
use crate::split::{Split, step};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::mem::take;
use steradian_simd::{Arch, Kernel, Vector, run};
use steradian_sphere::SphereImage;

/// A sum of weights that is none: what is left of a kernel far narrower than the texels, looking between them. The far
/// part's rounding is below it.
pub(crate) const NOTHING: f64 = 1e-13;

/// An image and its rows.
pub(crate) struct Texels<'a> {
    image: &'a SphereImage,
    /// sin θ, cos θ and solid angle of each row.
    rows: Vec<[f64; 3]>,
}

/// Buffers of one thread.
#[derive(Default)]
pub(crate) struct Scratch {
    /// sin²(Δφ/2).
    turns: Vec<f32>,
    spans: Vec<Span>,
    s2: Vec<f32>,
    weights: Vec<f32>,
}

/// Texels side by side in a row.
#[derive(Clone, Copy)]
struct Span {
    row: usize,
    /// First one, counted from the column at or before the direction.
    first: i64,
    len: usize,
    /// s² = base + slope sin²(Δφ/2).
    base: f32,
    slope: f32,
}

/// Texels of a block: no register holds more.
const BLOCK: usize = 16;

impl Span {
    /// Room for whole registers.
    #[inline(always)]
    fn padded(&self) -> usize {
        self.len.next_multiple_of(BLOCK)
    }
}

/// A direction in the image's terms.
struct Place {
    rho: f64,
    y: f64,
    /// Column at or before it, and how far beyond.
    column: i64,
    beyond: f64,
}

impl<'a> Texels<'a> {
    pub(crate) fn new(image: &'a SphereImage) -> Self {
        let (width, height) = (image.width, image.height);
        let row = |j: usize| {
            let (s, c) = (PI * (j as f64 + 0.5) / height as f64).sin_cos();
            [s, c, image.layout.solid_angle(width, height, 0, 0, j)]
        };
        Self { image, rows: (0..height).map(row).collect() }
    }

    /// Σ L K Ω and Σ K Ω over all texels, for every direction. A few rows at a time serve all directions, so that the
    /// image passes through memory once.
    pub(crate) fn all(&self, kernel: &dyn Zonal, directions: &[DVec3]) -> Vec<([f64; 3], f64)> {
        const ROWS: usize = 16;
        let farthest = (0.5 * kernel.support()).sin().powi(2);
        let width = self.image.width;
        let first = -(width as i64 / 2);
        let place = |d: &DVec3| {
            let (place, mut turns) = (self.place(*d), Vec::new());
            self.turns(first, width, place.beyond, &mut turns);
            (place, turns)
        };
        let places: Vec<(Place, Vec<f32>)> = directions.par_iter().map(place).collect();
        let starts: Vec<usize> = (0..self.rows.len()).step_by(ROWS).collect();
        let block = |scratch: &mut Scratch, &start: &usize| -> Vec<([f64; 3], f64)> {
            let end = (start + ROWS).min(self.rows.len());
            let sum = |(place, turns): &(Place, Vec<f32>)| {
                scratch.spans.clear();
                for row in start..end {
                    let (base, slope) = self.distance(place, row);
                    if base <= farthest {
                        let (base, slope) = (base as f32, slope as f32);
                        scratch.spans.push(Span { row, first, len: width, base, slope });
                    }
                }
                self.sum(kernel, place, (first, turns), scratch, None)
            };
            places.iter().map(sum).collect()
        };
        let blocks: Vec<_> = starts.par_iter().map_init(Scratch::default, block).collect();
        let mut all = vec![([0.0; 3], 0.0); directions.len()];
        for block in &blocks {
            for (to, (sum, weight)) in all.iter_mut().zip(block) {
                to.1 += weight;
                (0..3).for_each(|c| to.0[c] += sum[c]);
            }
        }
        all
    }

    /// Σ L K χ Ω and Σ K χ Ω.
    pub(crate) fn near(
        &self,
        split: &Split<'_>,
        kernel: &dyn Zonal,
        d: DVec3,
        scratch: &mut Scratch,
    ) -> ([f64; 3], f64) {
        let place = self.place(d);
        let height = self.rows.len();
        let middle = place.rho.atan2(place.y) / PI * height as f64 - 0.5;
        let reach = split.reach() / PI * height as f64;
        let first = (middle - reach).ceil().max(0.0) as usize;
        let last = ((middle + reach).floor().max(0.0) as usize).min(height - 1);
        scratch.spans.clear();
        for j in first..=last {
            let (base, slope) = self.distance(&place, j);
            let room = (0.25 * split.reach2() - base) / slope.max(1e-300);
            if room >= 0.0 {
                let (first, len) = self.columns(room, place.beyond);
                scratch.spans.push(Span { row: j, first, len, base: base as f32, slope: slope as f32 });
            }
        }
        let first = scratch.spans.iter().map(|s| s.first).min().unwrap_or(0);
        let end = scratch.spans.iter().map(|s| s.first + s.len as i64).max().unwrap_or(0);
        let mut turns = take(&mut scratch.turns);
        self.turns(first, (end - first).max(0) as usize, place.beyond, &mut turns);
        let scale = (4.0 / split.reach2()) as f32;
        let sum = self.sum(kernel, &place, (first, &turns), scratch, Some(scale));
        scratch.turns = turns;
        sum
    }

    fn place(&self, d: DVec3) -> Place {
        let x = (0.5 + d.z.atan2(d.x) / (2.0 * PI)) * self.image.width as f64 - 0.5;
        Place { rho: d.x.hypot(d.z), y: d.y, column: x.floor() as i64, beyond: x - x.floor() }
    }

    fn distance(&self, p: &Place, j: usize) -> (f64, f64) {
        let [s, c, _] = self.rows[j];
        (0.25 * ((p.rho - s).powi(2) + (p.y - c).powi(2)), p.rho * s)
    }

    /// First column and number of columns with sin²(Δφ/2) up to `room`.
    fn columns(&self, room: f64, beyond: f64) -> (i64, usize) {
        let width = self.image.width;
        if room < 0.09 {
            // asin r ≤ r + r³/5 up to 0.3.
            let r = room.sqrt();
            let half = (r + 0.2 * r * room) / PI * width as f64;
            let (from, to) = ((beyond - half).ceil() as i64, (beyond + half).floor() as i64);
            let len = (to - from + 1).max(0) as usize;
            if len <= width {
                return (from, len);
            }
        }
        (-(width as i64 / 2), width)
    }

    /// Σ L w Ω and Σ w Ω over the spans, w = K or K χ with χ's argument `scale` s²; `turns` are sin²(Δφ/2) from column
    /// `first` on.
    fn sum(
        &self,
        kernel: &dyn Zonal,
        place: &Place,
        (first, turns): (i64, &[f32]),
        scratch: &mut Scratch,
        scale: Option<f32>,
    ) -> ([f64; 3], f64) {
        let Scratch { spans, s2, weights, .. } = scratch;
        let mut all = [0.0; 4];
        let mut rest = spans.as_slice();
        while !rest.is_empty() {
            let (batch, after) = rest.split_at(batch(rest));
            rest = after;
            let count = batch.iter().map(|s| s.padded()).sum();
            s2.resize(count, 0.0);
            weights.resize(count, 0.0);
            run(Distances { spans: batch, turns, first, s2 });
            kernel.fill(s2, weights);
            run(Factors { spans: batch, rows: &self.rows, s2, weights, scale });
            let planes = self.image.planes.each_ref().map(Vec::as_slice);
            let more = run(Products {
                spans: batch,
                weights,
                planes,
                column: place.column,
                width: self.image.width,
            });
            (0..4).for_each(|c| all[c] += more[c]);
        }
        ([all[0], all[1], all[2]], all[3])
    }

    /// sin²(Δφ/2) of columns from `first` on.
    fn turns(&self, first: i64, len: usize, beyond: f64, out: &mut Vec<f32>) {
        let step = PI / self.image.width as f64;
        let h = |k: usize| step * ((first + k as i64) as f64 - beyond);
        out.clear();
        if h(0).abs().max(h(len).abs()) < 0.25 {
            let square = |k: usize| {
                let h = h(k) as f32;
                let h2 = h * h;
                h2 * (1.0 - h2 * (1.0 / 3.0 - h2 * (2.0 / 45.0 - h2 / 315.0)))
            };
            out.extend((0..len).map(square));
        } else {
            out.extend((0..len).map(|k| h(k).sin().powi(2) as f32));
        }
    }
}

/// How many of the spans to take at once: as many as fit into the nearest cache, and one at least.
fn batch(spans: &[Span]) -> usize {
    const TEXELS: usize = 4096;
    let mut texels = 0;
    let fits = |s: &&Span| {
        texels += s.padded();
        texels <= TEXELS
    };
    spans.iter().take_while(fits).count().max(1)
}

/// s² of every texel of the spans, and 1 in what fills their last blocks.
struct Distances<'a> {
    spans: &'a [Span],
    turns: &'a [f32],
    first: i64,
    s2: &'a mut [f32],
}

impl Kernel for Distances<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let mut start = 0;
        for s in self.spans {
            let here = &mut self.s2[start..start + s.padded()];
            let from = (s.first - self.first) as usize;
            let turns = &self.turns[from..from + s.len];
            for k in 0..s.len {
                here[k] = s.base + s.slope * turns[k];
            }
            here[s.len..].fill(1.0);
            start += here.len();
        }
    }
}

/// Multiplies weights by the texels' solid angles, and by χ where a scale is given; what fills the blocks becomes 0.
struct Factors<'a> {
    spans: &'a [Span],
    rows: &'a [[f64; 3]],
    s2: &'a [f32],
    weights: &'a mut [f32],
    scale: Option<f32>,
}

impl Kernel for Factors<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let mut start = 0;
        for s in self.spans {
            let end = start + s.padded();
            let (weights, s2) = (&mut self.weights[start..end], &self.s2[start..end]);
            let omega = self.rows[s.row][2] as f32;
            match self.scale {
                Some(scale) => {
                    for k in 0..weights.len() {
                        weights[k] *= step(scale * s2[k]) * omega;
                    }
                }
                None => {
                    for k in 0..weights.len() {
                        weights[k] *= omega;
                    }
                }
            }
            weights[s.len..].fill(0.0);
            start = end;
        }
    }
}

/// Σ w L per channel, and Σ w, over spans of an image whose columns begin again at their end.
struct Products<'a> {
    spans: &'a [Span],
    weights: &'a [f32],
    planes: [&'a [f32]; 3],
    column: i64,
    width: usize,
}

/// Texels of a span from which on its sum is kept in double precision by itself.
const LONG: usize = 128;

impl Kernel for Products<'_> {
    type Output = [f64; 4];

    #[inline(always)]
    fn run<A: Arch>(self) -> [f64; 4] {
        let lanes = A::F32::LANES;
        let mut all = [0.0_f64; 4];
        let mut sums = [A::F32::splat(0.0); 4];
        let mut from = 0;
        for s in self.spans {
            let weights = &self.weights[from..from + s.padded()];
            from += weights.len();
            let row = s.row * self.width;
            let start = (self.column + s.first).rem_euclid(self.width as i64) as usize;
            let at = row + start;
            if start + s.len <= self.width && at + weights.len() <= self.planes[0].len() {
                for k in (0..weights.len()).step_by(lanes) {
                    let w = A::F32::load(&weights[k..]);
                    for c in 0..3 {
                        sums[c] = w.fma(A::F32::load(&self.planes[c][at + k..]), sums[c]);
                    }
                    sums[3] = sums[3].add(w);
                }
            } else {
                for k in 0..s.len {
                    let i = start + k;
                    let texel = row + if i < self.width { i } else { i - self.width };
                    let w = f64::from(weights[k]);
                    for c in 0..3 {
                        all[c] += w * f64::from(self.planes[c][texel]);
                    }
                    all[3] += w;
                }
            }
            if weights.len() >= LONG {
                flush::<A>(&mut sums, &mut all);
            }
        }
        flush::<A>(&mut sums, &mut all);
        all
    }
}

/// Adds the lanes of `sums` to `all`, and clears them.
#[inline(always)]
fn flush<A: Arch>(sums: &mut [A::F32; 4], all: &mut [f64; 4]) {
    for c in 0..4 {
        let mut lanes = [0.0_f32; BLOCK];
        sums[c].store(&mut lanes[..A::F32::LANES]);
        for v in lanes {
            all[c] += f64::from(v);
        }
        sums[c] = A::F32::splat(0.0);
    }
}
