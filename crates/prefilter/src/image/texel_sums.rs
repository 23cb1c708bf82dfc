//! Sums over the texels of a lat-long image, each constant over its cell: all of them, or those around a
//! direction.
//!
//! A texel's part is the kernel's mean over its cell: at its centre where the kernel hardly varies over it,
//! else by a product of Gauss–Legendre rules; cells that contain the axis of a kernel narrower than a texel
//! are divided further ([`Cell::leaves`]).
//!
//! With ρ = sin and y = cos of the direction's polar angle, a texel at azimuth distance Δφ and polar angle θ
//! has s² = sin²(angle/2) = ((ρ − sin θ)² + (y − cos θ)²)/4 + ρ sin θ sin²(Δφ/2): a sum of squares, which
//! keeps its digits in single precision. Kernels are evaluated for many texels at once ([`Zonal::fill`]), in
//! blocks that begin with a register; long rows are summed in double precision.

use crate::kernel::split::{Split, step};
use crate::light::cell::{nodes_for, step_scale};
use crate::light::small_light::rule;
use crate::{Cell, Zonal};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::mem::take;
use steradian_simd::{Arch, Kernel, Vector, run};
use steradian_sphere::SphereImage;

/// Cells within this many times their size of the axis of a kernel narrower than a texel are divided further.
const CORE: f64 = 4.0;
/// Most nodes along a cell's side.
const MOST: usize = 24;

/// An image and its rows.
pub(crate) struct TexelSums<'a> {
    image: &'a SphereImage,
    /// sin θ and cos θ of each row's middle, and its texels' solid angle.
    rows: Vec<[f64; 3]>,
    /// The longer side of the texels at the equator, radians.
    size: f64,
}

/// Buffers of one thread.
#[derive(Default)]
pub(crate) struct Scratch {
    /// sin²(Δφ/2), for each place within a texel.
    turns: Vec<f32>,
    /// Places within a texel, from −½ to ½ of its width.
    places: Vec<f64>,
    spans: Vec<Span>,
    s2: Vec<f32>,
    weights: Vec<f32>,
    /// For texels that are divided: solid angles, and the index at which each texel begins.
    omegas: Vec<f64>,
    texels: Vec<(usize, usize)>,
}

/// Texels side by side in a row, at one node of each.
#[derive(Clone, Copy)]
struct Span {
    row: usize,
    /// First one, counted from the column at or before the direction.
    first: i64,
    len: usize,
    /// s² = base + slope sin²(Δφ/2).
    base: f32,
    slope: f32,
    /// Index of the part within a texel.
    place: usize,
    /// The node's share of the solid angle.
    omega: f32,
}

/// Texels of a block: the most that a register of any instruction set holds.
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

impl<'a> TexelSums<'a> {
    pub(crate) fn new(image: &'a SphereImage) -> Self {
        let (width, height) = (image.width, image.height);
        let row = |j: usize| {
            let (s, c) = (PI * (j as f64 + 0.5) / height as f64).sin_cos();
            [s, c, image.layout.solid_angle(width, height, 0, 0, j)]
        };
        let size = PI / (height.max(1) as f64).min(0.5 * width.max(1) as f64);
        Self { image, rows: (0..height).map(row).collect(), size }
    }

    /// The longer side of a texel.
    pub(crate) fn size(&self) -> f64 {
        self.size
    }

    /// Σ L ∫K over all texels.
    pub(crate) fn all(&self, kernel: &dyn Zonal, d: DVec3, scratch: &mut Scratch) -> [f64; 3] {
        self.around(None, kernel, d, scratch)
    }

    /// Σ L ∫Kχ.
    pub(crate) fn near(
        &self,
        split: &Split<'_>,
        kernel: &dyn Zonal,
        d: DVec3,
        scratch: &mut Scratch,
    ) -> [f64; 3] {
        self.around(Some(split), kernel, d, scratch)
    }

    fn around(
        &self,
        split: Option<&Split<'_>>,
        kernel: &dyn Zonal,
        d: DVec3,
        scratch: &mut Scratch,
    ) -> [f64; 3] {
        let (place, height) = (self.place(d), self.rows.len());
        let reach = split.map_or(kernel.support().min(PI), Split::reach);
        let most = split.map_or(f64::INFINITY, |s| 0.25 * s.reach()).min(step_scale(kernel));
        let width = kernel.width();
        let core = if self.size > width { CORE * self.size } else { 0.0 };
        let theta = place.rho.atan2(place.y);
        let row = |theta: f64| (theta / PI * height as f64).floor().max(0.0) as usize;
        let (first, last) = (row(theta - reach), row(theta + reach).min(height - 1));
        let farthest = (0.5 * (reach + self.size).min(PI)).sin().powi(2);
        scratch.spans.clear();
        scratch.places.clear();
        scratch.texels.clear();
        scratch.omegas.clear();
        scratch.s2.clear();
        for j in first..=last {
            let middle = PI * (j as f64 + 0.5) / height as f64;
            let (base, slope) = self.distance(&place, [middle.sin(), middle.cos()]);
            if base > farthest {
                continue;
            }
            let (from, len) = self.columns((farthest - base) / slope.max(1e-300), place.beyond);
            let mut hole = (from, 0);
            if core > 0.0 {
                let room = ((0.5 * core).min(1.0).powi(2) - base) / slope.max(1e-300);
                if room >= 0.0 {
                    hole = self.columns(room, place.beyond);
                    hole = (hole.0.max(from), hole.1.min(len));
                    self.divide(j, hole, place.column, d, width, most, scratch);
                }
            }
            // No texel of the row is nearer than this.
            let near = ((middle - theta).abs() - 0.5 * self.size).max(if core > 0.0 {
                core - 0.5 * self.size
            } else {
                0.0
            });
            let ratio = self.size / width.max(0.5 * near).min(most);
            let n = nodes_for(ratio).max((2.0 * ratio).min(MOST as f64) as usize);
            let left = (from, (hole.0 - from).max(0) as usize);
            let end = hole.0 + hole.1 as i64;
            let right = (end, (from + len as i64 - end).max(0) as usize);
            for (first, len) in if hole.1 == 0 { [(from, len), (0, 0)] } else { [left, right] } {
                if len > 0 {
                    self.spans(j, n, (first, len), &place, scratch);
                }
            }
        }
        let divided = self.divided(kernel, split, scratch);
        let first = scratch.spans.iter().map(|s| s.first).min().unwrap_or(0);
        let end = scratch.spans.iter().map(|s| s.first + s.len as i64).max().unwrap_or(0);
        let columns = (end - first).max(0) as usize;
        let mut turns = take(&mut scratch.turns);
        turns.clear();
        for x in &scratch.places {
            self.turns(first, columns, place.beyond - x, &mut turns);
        }
        let scale = split.map(|s| (4.0 / s.reach2()) as f32);
        let sum = self.sum(kernel, &place, (first, columns, &turns), scratch, scale);
        scratch.turns = turns;
        std::array::from_fn(|c| sum[c] + divided[c])
    }

    /// Spans of row `j` at n × n nodes of each texel.
    fn spans(&self, j: usize, n: usize, (first, len): (i64, usize), place: &Place, scratch: &mut Scratch) {
        let (x, w) = rule(n);
        let height = self.rows.len() as f64;
        let row = |x: &f64| (PI * (j as f64 + 0.5 + 0.5 * x) / height).sin_cos();
        let all: f64 = x.iter().zip(w).map(|(x, w)| w * row(x).0).sum();
        for (xt, wt) in x.iter().zip(w) {
            let (s, c) = row(xt);
            let (base, slope) = self.distance(place, [s, c]);
            for (xp, wp) in x.iter().zip(w) {
                let at = scratch.places.iter().position(|p| *p == 0.5 * xp).unwrap_or_else(|| {
                    scratch.places.push(0.5 * xp);
                    scratch.places.len() - 1
                });
                let omega = (0.5 * wp * wt * s / all * self.rows[j][2]) as f32;
                let (base, slope) = (base as f32, slope as f32);
                scratch.spans.push(Span { row: j, first, len, base, slope, place: at, omega });
            }
        }
    }

    /// Nodes of texels that are divided further.
    #[expect(clippy::too_many_arguments, reason = "a row, its columns, a direction and a kernel")]
    fn divide(
        &self,
        j: usize,
        (first, len): (i64, usize),
        column: i64,
        d: DVec3,
        width: f64,
        most: f64,
        scratch: &mut Scratch,
    ) {
        let columns = self.image.width;
        for k in 0..len as i64 {
            let i = (column + first + k).rem_euclid(columns as i64) as usize;
            scratch.texels.push((j * columns + i, scratch.omegas.len()));
            let (s2, omegas) = (&mut scratch.s2, &mut scratch.omegas);
            Cell::texel(i, j, columns, self.rows.len()).leaves(d, width, most, &mut |w, omega| {
                s2.push((0.25 * w.distance_squared(d)) as f32);
                omegas.push(omega);
            });
        }
    }

    /// Σ L ∫K, or Kχ, over the texels that were divided.
    fn divided(&self, kernel: &dyn Zonal, split: Option<&Split<'_>>, scratch: &mut Scratch) -> [f64; 3] {
        let Scratch { s2, weights, omegas, texels, .. } = scratch;
        weights.resize(s2.len(), 0.0);
        kernel.fill(s2, weights);
        if let Some(split) = split {
            let scale = (4.0 / split.reach2()) as f32;
            weights.iter_mut().zip(&*s2).for_each(|(w, s2)| *w *= step(scale * s2));
        }
        let mut sum = [0.0; 3];
        for (t, &(texel, from)) in texels.iter().enumerate() {
            let to = texels.get(t + 1).map_or(omegas.len(), |t| t.1);
            let nodes = weights[from..to].iter().zip(&omegas[from..to]);
            let w: f64 = nodes.map(|(w, omega)| f64::from(*w) * omega).sum();
            (0..3).for_each(|c| sum[c] += w * f64::from(self.image.planes[c][texel]));
        }
        sum
    }

    fn place(&self, d: DVec3) -> Place {
        let x = (0.5 + d.z.atan2(d.x) / (2.0 * PI)) * self.image.width as f64 - 0.5;
        Place { rho: DVec2::new(d.x, d.z).length(), y: d.y, column: x.floor() as i64, beyond: x - x.floor() }
    }

    fn distance(&self, p: &Place, [s, c]: [f64; 2]) -> (f64, f64) {
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

    /// Σ L w Ω over the spans, w = K or K χ with χ's argument `scale` s²; `turns` are sin²(Δφ/2) of so many
    /// columns from `first` on, for each place within a texel.
    fn sum(
        &self,
        kernel: &dyn Zonal,
        place: &Place,
        (first, columns, turns): (i64, usize, &[f32]),
        scratch: &mut Scratch,
        scale: Option<f32>,
    ) -> [f64; 3] {
        let Scratch { spans, s2, weights, .. } = scratch;
        let mut all = [0.0; 3];
        let mut rest = spans.as_slice();
        while !rest.is_empty() {
            let (batch, after) = rest.split_at(batch(rest));
            rest = after;
            let count = batch.iter().map(|s| s.padded()).sum();
            s2.resize(count, 0.0);
            weights.resize(count, 0.0);
            run(Distances { spans: batch, turns, columns, first, s2 });
            kernel.fill(s2, weights);
            run(Factors { spans: batch, s2, weights, scale });
            let planes = self.image.planes.each_ref().map(Vec::as_slice);
            let more = run(Products {
                spans: batch,
                weights,
                planes,
                column: place.column,
                width: self.image.width,
            });
            (0..3).for_each(|c| all[c] += more[c]);
        }
        all
    }

    /// Appends sin²(Δφ/2) of columns from `first` on.
    fn turns(&self, first: i64, len: usize, beyond: f64, out: &mut Vec<f32>) {
        let step = PI / self.image.width as f64;
        let h = |k: usize| step * ((first + k as i64) as f64 - beyond);
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

/// Number of spans to process at once: as many as fit into the nearest cache, and one at least.
fn batch(spans: &[Span]) -> usize {
    const TEXELS: usize = 4096;
    let mut texels = 0;
    let fits = |s: &&Span| {
        texels += s.padded();
        texels <= TEXELS
    };
    spans.iter().take_while(fits).count().max(1)
}

/// s² of every texel of the spans, and 1 in the padding of their last blocks.
struct Distances<'a> {
    spans: &'a [Span],
    turns: &'a [f32],
    columns: usize,
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
            let from = s.place * self.columns + (s.first - self.first) as usize;
            let turns = &self.turns[from..from + s.len];
            for k in 0..s.len {
                here[k] = s.base + s.slope * turns[k];
            }
            here[s.len..].fill(1.0);
            start += here.len();
        }
    }
}

/// Multiplies weights by solid angles, and by χ where a scale is given; the padding of blocks becomes 0.
struct Factors<'a> {
    spans: &'a [Span],
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
            let omega = s.omega;
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

/// Σ w L per channel over spans of an image whose columns begin again at their end.
struct Products<'a> {
    spans: &'a [Span],
    weights: &'a [f32],
    planes: [&'a [f32]; 3],
    column: i64,
    width: usize,
}

/// Number of texels from which on a span's sum is accumulated separately in double precision.
const LONG: usize = 128;

impl Kernel for Products<'_> {
    type Output = [f64; 3];

    #[inline(always)]
    fn run<A: Arch>(self) -> [f64; 3] {
        let lanes = A::F32::LANES;
        let mut all = [0.0_f64; 3];
        let mut sums = [A::F32::splat(0.0); 3];
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
                }
            } else {
                // A span that wraps around the row, or lies near the image's end: whole registers of both
                // parts first, then the remainders.
                let before = s.len.min(self.width - start);
                for (weights, at) in [(&weights[..before], at), (&weights[before..s.len], row)] {
                    let whole = weights.len() / lanes * lanes;
                    for k in (0..whole).step_by(lanes) {
                        let w = A::F32::load(&weights[k..]);
                        for c in 0..3 {
                            sums[c] = w.fma(A::F32::load(&self.planes[c][at + k..]), sums[c]);
                        }
                    }
                    for k in whole..weights.len() {
                        for c in 0..3 {
                            all[c] += f64::from(weights[k]) * f64::from(self.planes[c][at + k]);
                        }
                    }
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
fn flush<A: Arch>(sums: &mut [A::F32; 3], all: &mut [f64; 3]) {
    for c in 0..3 {
        let mut lanes = [0.0_f32; BLOCK];
        sums[c].store(&mut lanes[..A::F32::LANES]);
        for v in lanes {
            all[c] += f64::from(v);
        }
        sums[c] = A::F32::splat(0.0);
    }
}
