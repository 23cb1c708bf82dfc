//! Sums over the texels of a lat-long image, each at its centre: all of them, or those around a direction.
//!
//! With ρ = sin and y = cos of the direction's polar angle, a texel at azimuth distance Δφ in row j has
//! s² = sin²(θ/2) = ((ρ − s_j)² + (y − c_j)²)/4 + ρ s_j sin²(Δφ/2): a sum of squares, which keeps its digits in single
//! precision. Kernels are evaluated for many texels at once ([`Zonal::fill`]); rows are summed in double precision.

use crate::Zonal;
use crate::split::{Split, step};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::mem::take;
use steradian_simd::{Arch, Kernel, Vector, run};
use steradian_sphere::SphereImage;

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
        let (mut sum, mut weight) = ([0.0; 3], 0.0);
        let mut rest = spans.as_slice();
        while !rest.is_empty() {
            let (batch, after) = rest.split_at(batch(rest));
            rest = after;
            let count = batch.iter().map(|s| s.len).sum();
            s2.resize(count, 0.0);
            weights.resize(count, 0.0);
            run(Distances { spans: batch, turns, first, s2 });
            kernel.fill(s2, weights);
            if let Some(scale) = scale {
                run(Taper { s2, weights, scale });
            }
            let mut at = 0;
            for s in batch {
                let l = self.row(s, place.column, &weights[at..at + s.len]);
                let omega = self.rows[s.row][2];
                weight += omega * l[3];
                (0..3).for_each(|c| sum[c] += omega * l[c]);
                at += s.len;
            }
        }
        (sum, weight)
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

    /// Σ L w per channel, and Σ w, of a span.
    fn row(&self, s: &Span, column: i64, weights: &[f32]) -> [f64; 4] {
        let width = self.image.width;
        let start = (column + s.first).rem_euclid(width as i64) as usize;
        let at = s.row * width;
        let (before, after) = weights.split_at(s.len.min(width - start));
        let part = |from: usize, weights: &[f32]| {
            let planes = self.image.planes.each_ref().map(|p| &p[from..from + weights.len()]);
            run(Products { weights, planes })
        };
        let (mut all, more) = (part(at + start, before), part(at, after));
        (0..4).for_each(|c| all[c] += more[c]);
        all
    }
}

/// How many of the spans to take at once: as many as fit into the nearest cache, and one at least.
fn batch(spans: &[Span]) -> usize {
    const TEXELS: usize = 4096;
    let mut texels = 0;
    let fits = |s: &&Span| {
        texels += s.len;
        texels <= TEXELS
    };
    spans.iter().take_while(fits).count().max(1)
}

/// s² of every texel of the spans.
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
        let mut rest = self.s2;
        for s in self.spans {
            let (here, after) = rest.split_at_mut(s.len);
            let from = (s.first - self.first) as usize;
            let turns = &self.turns[from..from + s.len];
            here.iter_mut().zip(turns).for_each(|(s2, t)| *s2 = s.base + s.slope * t);
            rest = after;
        }
    }
}

/// Multiplies weights by χ.
struct Taper<'a> {
    s2: &'a [f32],
    weights: &'a mut [f32],
    scale: f32,
}

impl Kernel for Taper<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        self.weights.iter_mut().zip(self.s2).for_each(|(w, s2)| *w *= step(self.scale * s2));
    }
}

/// Σ w L per channel, and Σ w.
struct Products<'a> {
    weights: &'a [f32],
    planes: [&'a [f32]; 3],
}

impl Kernel for Products<'_> {
    type Output = [f64; 4];

    #[inline(always)]
    fn run<A: Arch>(self) -> [f64; 4] {
        /// Registers of each sum, so that one addition need not wait for the last.
        const SETS: usize = 2;
        let step = SETS * A::F32::LANES;
        let mut sums = [[A::F32::splat(0.0); SETS]; 4];
        let whole = self.weights.len() / step * step;
        for from in (0..whole).step_by(step) {
            for set in 0..SETS {
                let at = from + set * A::F32::LANES;
                let w = A::F32::load(&self.weights[at..]);
                for c in 0..3 {
                    sums[c][set] = w.fma(A::F32::load(&self.planes[c][at..]), sums[c][set]);
                }
                sums[3][set] = sums[3][set].add(w);
            }
        }
        let mut all = sums.map(|sets| {
            let mut lanes = [0.0_f32; 16];
            sets.iter()
                .map(|s| {
                    s.store(&mut lanes[..A::F32::LANES]);
                    lanes.iter().map(|&v| f64::from(v)).sum::<f64>()
                })
                .sum::<f64>()
        });
        for (i, &w) in self.weights.iter().enumerate().skip(whole) {
            (0..3).for_each(|c| all[c] += f64::from(w * self.planes[c][i]));
            all[3] += f64::from(w);
        }
        all
    }
}
