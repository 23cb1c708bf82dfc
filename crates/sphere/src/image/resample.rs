//! Resampling that conserves energy.
//!
//! A target texel is the mean of the source over the texel's exact cell: the cell's outline on the sphere is
//! cut at the source's seams (planes through the centre cut spherical polygons exactly), mapped into the
//! source image, and its area in every source texel found exactly. Neighbouring cells share their corners, so
//! that each source texel is dealt out completely: ∫ L dω is kept to about 1e-6, single bright texels
//! included. Where texels do not grow enough for a box filter to look right, the source is first refined
//! twofold with every texel's mean kept. Where all texels clearly shrink there is nothing to average:
//! Catmull–Rom lookup at texel centres (which may undershoot beside bright texels).

use super::coverage::Coverage;
use super::patch::Patches;
use super::refine::refine;
use super::{Filter, SphereImage};
use crate::layout::{Layout, Position, disc};
use glam::{DMat3, DVec3};
use steradian_parallel::prelude::*;

/// `source` seen through `back` (target direction → source direction) in another layout and size.
pub fn remap(source: &SphereImage, layout: Layout, width: usize, height: usize, back: DMat3) -> SphereImage {
    let straight = back == DMat3::IDENTITY;
    if straight && (source.layout, source.width, source.height) == (layout, width, height) {
        return source.clone();
    }
    if straight && source.layout == Layout::LatLong && layout == Layout::LatLong {
        return super::latlong::resample(source, width, height);
    }
    let job = Job::new(source, layout, width, height, back);
    if job.growth.1 < 0.9 {
        if straight && source.layout == Layout::LatLong && layout == Layout::Cube && width == height {
            return super::cube_lookups::cube(source, width);
        }
        return SphereImage::from_fn(layout, width, height, |d| source.lookup(Filter::CatmullRom, back * d));
    }
    job.run()
}

/// One resampling.
struct Job<'a> {
    source: &'a SphereImage,
    layout: Layout,
    width: usize,
    height: usize,
    back: DMat3,
    patches: Patches,
    /// Smallest and largest size of target texels in source texels.
    growth: (f64, f64),
    /// Largest angle that a target texel spans.
    span: f64,
    /// Steps per side of a cell's outline.
    steps: usize,
}

/// What the source's texels add up to in a cell.
struct Sum {
    /// Σ weight · value.
    total: [f64; 3],
    /// Σ weight.
    weight: f64,
    /// The smallest value.
    least: [f64; 3],
}

/// Buffers of one thread.
#[derive(Default)]
struct Scratch {
    flat: Vec<(f64, f64)>,
    outline: Vec<DVec3>,
    part: Vec<DVec3>,
    spare: Vec<DVec3>,
    mapped: Vec<(f64, f64)>,
    coverage: Coverage,
}

/// The longer of the two extents of the cell around a position, in radians.
fn extent(layout: Layout, w: usize, h: usize, at: Position) -> Option<f64> {
    let d = |dx: f64, dy: f64| layout.direction(w, h, Position { face: at.face, x: at.x + dx, y: at.y + dy });
    let across = d(-0.5, 0.0)?.angle_between(d(0.5, 0.0)?);
    let along = d(0.0, -0.5)?.angle_between(d(0.0, 0.5)?);
    Some(across.max(along))
}

impl<'a> Job<'a> {
    fn new(source: &'a SphereImage, layout: Layout, width: usize, height: usize, back: DMat3) -> Self {
        let (mut growth, mut span) = ((f64::MAX, 0.0f64), 0.0f64);
        const PROBES: usize = 12;
        for k in 0..layout.faces() * PROBES * PROBES {
            let (face, a, b) = (k / (PROBES * PROBES), k % PROBES, k / PROBES % PROBES);
            let middle = |a: usize, n: usize| ((a * n) as f64 / PROBES as f64).floor() + 0.5;
            let at = Position { face, x: middle(a, width), y: middle(b, height) };
            let Some(d) = layout.direction(width, height, at) else { continue };
            let there = source.position(back * d);
            let (Some(t), Some(s)) = (
                extent(layout, width, height, at),
                extent(source.layout, source.width, source.height, there),
            ) else {
                continue;
            };
            span = span.max(t);
            growth = (growth.0.min(t / s), growth.1.max(t / s));
        }
        let steps = (growth.1 / 4.0).max(span / 0.03).ceil().clamp(1.0, 32.0) as usize;
        let patches = Patches::new(source.layout, source.width, source.height);
        Self { source, layout, width, height, back, patches, growth, span, steps }
    }

    fn run(&self) -> SphereImage {
        // Texels that grow by less than half show the source's cells: give them smaller ones.
        let small = self.source.planes[0].len() <= 1 << 24;
        let factor = if self.growth.0 < 1.5 && small { 2 } else { 1 };
        let fine = (factor == 2).then(|| refine(self.source));
        let weights = weights(self.source);
        let grid = Grid { source: self.source, fine: fine.as_ref(), factor, weights: &weights };
        let mut out = SphereImage::new(self.layout, self.width, self.height);
        let n = self.width;
        let [r, g, b] = &mut out.planes;
        r.par_chunks_mut(n).zip(g.par_chunks_mut(n)).zip(b.par_chunks_mut(n)).enumerate().for_each_init(
            Scratch::default,
            |scratch, (row, ((r, g), b))| {
                for i in 0..n {
                    [r[i], g[i], b[i]] = self.texel(&grid, scratch, row / self.height, i, row % self.height);
                }
            },
        );
        out
    }

    fn texel(&self, grid: &Grid, scratch: &mut Scratch, face: usize, i: usize, j: usize) -> [f32; 3] {
        let mut sum = Sum { total: [0.0; 3], weight: 0.0, least: [f64::INFINITY; 3] };
        self.outline(scratch, face, i, j);
        if scratch.outline.len() >= 3 {
            self.gather(grid, scratch, &mut sum);
        }
        if sum.weight > 0.0 {
            // What exceeds the smallest value is dealt out by the exact solid angle, which keeps its energy;
            // the weights' own sum differs from it by the density's change within texels.
            let omega = self.layout.solid_angle(self.width, self.height, face, i, j);
            return std::array::from_fn(|c| {
                let m = sum.least[c];
                (m + (sum.total[c] - m * sum.weight) / omega) as f32
            });
        }
        // No area: corners of a paraboloid show the other face, corners of a probe nothing.
        let d = self.layout.texel_direction(self.width, self.height, face, i, j);
        d.map_or([0.0; 3], |d| self.source.lookup(Filter::Bilinear, self.back * d))
    }

    /// The target cell's outline as source directions.
    fn outline(&self, scratch: &mut Scratch, face: usize, i: usize, j: usize) {
        let n = self.steps;
        scratch.outline.clear();
        scratch.flat.clear();
        let (w, h) = (self.width as f64, self.height as f64);
        let o = self.layout.offset();
        if self.layout.is_disc() {
            let [x0, x1, y0, y1] = self.layout.cell(self.width, self.height, i, j);
            disc::outline(x0, x1, y0, y1, n, &mut scratch.flat);
            scratch.flat.iter_mut().for_each(|p| *p = (0.5 * (p.0 + 1.0) * w + o, 0.5 * (p.1 + 1.0) * h + o));
        } else {
            let (x, y, f) = (i as f64, j as f64, 1.0 / n as f64);
            scratch.flat.extend((0..n).map(|k| (x + k as f64 * f, y)));
            scratch.flat.extend((0..n).map(|k| (x + 1.0, y + k as f64 * f)));
            scratch.flat.extend((0..n).map(|k| (x + 1.0 - k as f64 * f, y + 1.0)));
            scratch.flat.extend((0..n).map(|k| (x, y + 1.0 - k as f64 * f)));
        }
        for &(x, y) in &scratch.flat {
            // A rim point may fall, by rounding, on a texel outside the disc.
            let inwards = |v: f64, n: f64| v + (0.5 * n + o - v) * 1e-12;
            let at = Position { face, x: inwards(x, w), y: inwards(y, h) };
            let d = if self.layout.is_disc() {
                self.layout.direction(self.width, self.height, at)
            } else {
                self.layout.direction(self.width, self.height, Position { face, x, y })
            };
            scratch.outline.extend(d.map(|d| self.back * d));
        }
    }

    /// Adds the cell's part in every source texel.
    fn gather(&self, grid: &Grid, scratch: &mut Scratch, sum: &mut Sum) {
        let p = self.patches;
        let home = p.home(scratch.outline[0]);
        let near = 5.0 * self.span;
        let plain = scratch.outline.iter().all(|&d| p.home(d) == home && !p.singular(d, near));
        if plain {
            // On a disc circles of latitude stay circles: their pieces must be as fine as beside the seams.
            let steps = if self.source.layout.is_disc() { 8 } else { 1 };
            map_part(p, home, &scratch.outline, steps, &mut scratch.mapped);
            grid.add(p.face(home), &scratch.mapped, &mut scratch.coverage, sum);
            return;
        }
        for patch in 0..p.count() {
            scratch.part.clear();
            scratch.part.extend_from_slice(&scratch.outline);
            let (planes, n) = p.planes(patch);
            for plane in &planes[..n] {
                clip(&mut scratch.part, &mut scratch.spare, *plane);
            }
            if scratch.part.len() >= 3 {
                let steps = if p.straight() { 1 } else { 16 };
                map_part(p, patch, &scratch.part, steps, &mut scratch.mapped);
                grid.add(p.face(patch), &scratch.mapped, &mut scratch.coverage, sum);
            }
        }
    }
}

/// Sutherland & Hodgman 1974 against one plane through the centre.
fn clip(part: &mut Vec<DVec3>, spare: &mut Vec<DVec3>, normal: DVec3) {
    spare.clear();
    for k in 0..part.len() {
        let (p, q) = (part[k], part[(k + 1) % part.len()]);
        let (hp, hq) = (normal.dot(p), normal.dot(q));
        if hp >= 0.0 {
            spare.push(p);
        }
        if (hp > 0.0 && hq < 0.0) || (hp < 0.0 && hq > 0.0) {
            spare.push(p + (q - p) * (hp / (hp - hq)));
        }
    }
    std::mem::swap(part, spare);
}

/// Maps a polygon that lies in one patch; great circles in `steps` pieces. A corner on the axis of an eighth
/// becomes the piece of the axis' line between its neighbours' azimuths.
fn map_part(p: Patches, patch: usize, part: &[DVec3], steps: usize, out: &mut Vec<(f64, f64)>) {
    out.clear();
    let n = part.len();
    // The apex where two planes cut may come twice.
    let same = |a: DVec3, b: DVec3| p.map(patch, a).is_none() && p.map(patch, b).is_none();
    let twin = |k: usize| same(part[k], part[(k + 1) % n]);
    let behind = |k: usize| (1..n).map(|s| part[(k + n - s) % n]).find(|&d| p.map(patch, d).is_some());
    for k in (0..n).filter(|&k| !twin(k)) {
        let (d, next) = (part[k], part[(k + 1) % n]);
        match p.map(patch, d) {
            Some(at) => out.push(at),
            None => {
                let Some(before) = behind(k) else { continue };
                out.push(p.map_axis(patch, d, before));
                arc(p, patch, d, before, next, out);
                out.push(p.map_axis(patch, d, next));
            }
        }
        for step in 1..steps {
            let f = step as f64 / steps as f64;
            out.extend(p.map(patch, d + (next - d) * f));
        }
    }
}

/// Points between two azimuths on the axis' line (the rim of a disc is round).
fn arc(p: Patches, patch: usize, axis: DVec3, from: DVec3, to: DVec3, out: &mut Vec<(f64, f64)>) {
    let (a, b) = (from - axis * axis.dot(from), to - axis * axis.dot(to));
    let (a, b) = (a.normalize_or_zero(), b.normalize_or_zero());
    out.extend((1..48).map(|k| p.map_axis(patch, axis, axis + a + (b - a) * (f64::from(k) / 48.0))));
}

/// The source's texels and what they weigh.
struct Grid<'a> {
    source: &'a SphereImage,
    fine: Option<&'a [Vec<f32>; 3]>,
    factor: usize,
    weights: &'a [f64],
}

/// Solid angle per area of each texel of a face (one value per row of a lat-long image).
fn weights(source: &SphereImage) -> Vec<f64> {
    let (layout, w, h) = (source.layout, source.width, source.height);
    if layout == Layout::LatLong {
        return (0..h).map(|j| layout.solid_angle(w, h, 0, 0, j)).collect();
    }
    (0..w * h)
        .into_par_iter()
        .with_min_len(1024)
        .map(|k| {
            let (i, j) = (k % w, k / w);
            let omega = layout.solid_angle(w, h, 0, i, j);
            if omega > 0.0 && layout.is_disc() { omega / layout.coverage(w, h, i, j) } else { omega }
        })
        .collect()
}

impl Grid<'_> {
    /// Adds the texels that the polygon covers; it is in texels of the unrefined source.
    fn add(&self, face: usize, polygon: &[(f64, f64)], coverage: &mut Coverage, sum: &mut Sum) {
        let (w, h, k) = (self.source.width as isize, self.source.height as isize, self.factor as isize);
        let planes = self.fine.unwrap_or(&self.source.planes);
        let lat_long = self.source.layout == Layout::LatLong;
        let share = 1.0 / (k * k) as f64;
        coverage.polygon(polygon, k as f64, |i, j, area| {
            let i = if lat_long { i.rem_euclid(w * k) } else { i.clamp(0, w * k - 1) };
            let j = j.clamp(0, h * k - 1);
            let weight = share
                * area
                * if lat_long {
                    self.weights[(j / k) as usize]
                } else {
                    self.weights[(j / k * w + i / k) as usize]
                };
            let at = ((face as isize * h * k + j) * w * k + i) as usize;
            for c in 0..3 {
                let v = f64::from(planes[c][at]);
                sum.total[c] += weight * v;
                sum.least[c] = sum.least[c].min(v);
            }
            sum.weight += weight;
        });
    }
}
