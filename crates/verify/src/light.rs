//! The light as hypotheses have it: as it is, reduced, or clipped; its texels read as cells, points or
//! bilinearly.

use crate::kernel::Kernel;
use crate::orientation::Orientation;
use crate::rings::{COARSE, FINE, Rings};
use crate::samples::Samples;
use crate::scale::{Column, Moments};
use glam::DVec3;
use std::cell::OnceCell;
use std::collections::HashMap;
use steradian_base::{Cancelled, Task};
use steradian_light::Lights;
use steradian_prefilter::{SmallLight, Tree, Zonal};
use steradian_sphere::layout::Position;
use steradian_sphere::{Layout, SphereImage};

/// Alteration of the light before it was filtered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Alteration {
    /// Nothing.
    None,
    /// The image was reduced by this factor, by means over blocks of texels or by single texels of them.
    Reduced {
        /// Texels a side of a block.
        factor: usize,
        /// Means?
        means: bool,
    },
    /// Radiance was clipped at this value, channel by channel.
    Clipped(f64),
}

/// Interpretation of texels between their centres.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// Each texel's value over its cell.
    Cells,
    /// A texel's flux is at its centre.
    Points,
    /// Interpolation between centres.
    Bilinear,
}

impl Reading {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cells => "constant over cells",
            Self::Points => "points at centres",
            Self::Bilinear => "bilinear",
        }
    }
}

/// All readings.
pub const READINGS: [Reading; 3] = [Reading::Cells, Reading::Points, Reading::Bilinear];

/// Most rows of a light that is refined for other readings, to three times as many: those of larger ones
/// hardly differ.
const READ_ROWS: usize = 256;
/// Rows up to which texels are divided: to 0.016 radians, little more than the steps of rings far out.
const DIVIDED_ROWS: usize = 192;
/// Most rows of the light by which hypotheses are compared: texels of 3e-3 radians, less than any kernel
/// resolves ([`FINEST`]).
const MAX_ROWS: usize = 1024;

impl Alteration {
    /// Lights so altered; environment and disks, point lights left out.
    pub fn of(self, lights: &Lights) -> Lights {
        let image = lights.environment.as_ref().map(|e| match self {
            Self::None => e.image.clone(),
            Self::Reduced { factor, means } => reduced(&e.image, factor, means),
            Self::Clipped(c) => between(&e.image, f64::NEG_INFINITY, c),
        });
        let mut disks = lights.disks.clone();
        if let Self::Clipped(c) = self {
            disks.iter_mut().for_each(|d| d.radiance = d.radiance.map(|l| l.min(c)));
        }
        let environment = image.map(|image| std::sync::Arc::new(steradian_light::Environment { image }));
        Lights { environment, disks, directionals: lights.directionals.clone(), ..Lights::default() }
    }
}

/// An image made smaller.
fn reduced(image: &SphereImage, factor: usize, means: bool) -> SphereImage {
    let (w, h) = ((image.width / factor).max(2), (image.height / factor).max(1));
    if means {
        return image.resample(Layout::LatLong, w, h);
    }
    let mut out = SphereImage::new(Layout::LatLong, w, h);
    for (j, i) in (0..h).flat_map(|j| (0..w).map(move |i| (j, i))) {
        let at = |i: usize, n: usize, all: usize| (i * all / n + all / n / 2).min(all - 1);
        let (from, to) = (image.index(0, at(i, w, image.width), at(j, h, image.height)), out.index(0, i, j));
        (0..3).for_each(|c| out.planes[c][to] = image.planes[c][from]);
    }
    out
}

/// The part of each value above `low` and below `high`, less `low` where that is finite.
fn between(image: &SphereImage, low: f64, high: f64) -> SphereImage {
    let mut out = image.clone();
    let floor = if low.is_finite() { low } else { 0.0 };
    let part = |v: f32| (f64::from(v).clamp(low, high) - floor) as f32;
    out.planes.iter_mut().flatten().for_each(|v| *v = part(*v));
    out
}

/// The samples of all levels as a turn places them.
pub struct View<'a> {
    pub levels: &'a [SphereImage],
    pub samples: &'a [Samples],
    pub orientation: Orientation,
    /// Directions of the samples in the world.
    directions: Vec<Vec<DVec3>>,
    /// Per level, the angle below which the light is not resolved, radians: half the width of the kernel.
    finest: Vec<f64>,
}

/// Bounds of that angle, radians: ten times the first node of rings, and 3.4° however wide the kernel is.
const FINEST: (f64, f64) = (5e-3, 0.06);

impl<'a> View<'a> {
    pub fn new(
        levels: &'a [SphereImage],
        samples: &'a [Samples],
        kernels: &[Kernel],
        orientation: Orientation,
    ) -> Self {
        let width = |k: &Kernel| k.zonal().map(|z| 0.5 * z.width());
        let least = kernels.iter().filter_map(width).fold(1.0, f64::min);
        let finest = kernels.iter().map(|k| width(k).unwrap_or(least).clamp(FINEST.0, FINEST.1)).collect();
        let placed = |(l, s): (&SphereImage, &Samples)| {
            s.directions.iter().map(|d| orientation.world(l, *d)).collect()
        };
        let directions = levels.iter().zip(samples).map(placed).collect();
        Self { levels, samples, orientation, directions, finest }
    }

    /// World directions of a level's samples.
    pub fn directions(&self, m: usize) -> &[DVec3] {
        &self.directions[m]
    }
}

/// A light as the samples see it; what that takes is made where a kernel first needs it.
pub struct Prepared<'a> {
    view: &'a View<'a>,
    image: SphereImage,
    suns: Vec<SmallLight>,
    tree: Tree,
    /// [`crate::rings::FINE`] or coarser.
    fineness: f64,
    /// Per level, the rings around every sample.
    rings: Vec<OnceCell<Rings>>,
    /// Per level, candidates for the unfiltered light.
    mirrors: Vec<OnceCell<Vec<Column>>>,
}

impl<'a> Prepared<'a> {
    /// Altered lights, read as `reading`.
    pub fn new(
        lights: &Lights,
        reading: Reading,
        view: &'a View<'a>,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        Self::of(lights, reading, view, FINE, task)
    }

    fn of(
        lights: &Lights,
        reading: Reading,
        view: &'a View<'a>,
        fineness: f64,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        let black = || SphereImage::new(Layout::LatLong, 4, 2);
        let image = lights.environment.as_ref().map_or_else(black, |e| e.image.clone());
        let image = if image.height > MAX_ROWS {
            let width = (image.width * MAX_ROWS).div_ceil(image.height);
            image.resample(Layout::LatLong, width, MAX_ROWS)
        } else {
            image
        };
        let mut suns: Vec<SmallLight> = lights.disks.iter().map(SmallLight::from).collect();
        suns.extend(lights.directionals.iter().map(SmallLight::from));
        let finer = if image.height <= READ_ROWS { read(&image, reading) } else { None };
        let cells = divided(finer.as_ref().unwrap_or(&image));
        let tree = Tree::new(Some(cells.as_ref().or(finer.as_ref()).unwrap_or(&image)), &[], task)?;
        let levels = view.levels.len();
        let (rings, mirrors) = (vec_of(levels), vec_of(levels));
        Ok(Self { view, image, suns, tree, fineness, rings, mirrors })
    }

    /// Values of a level's samples under a kernel; for the light itself, of the candidate that fits the
    /// samples best.
    pub fn column(&self, m: usize, kernel: Kernel, samples: &Samples) -> Column {
        match kernel.zonal() {
            Some(k) => self.filtered(m, k.as_ref()),
            None => self.mirror(m, samples),
        }
    }

    fn filtered(&self, m: usize, kernel: &dyn Zonal) -> Column {
        let view = self.view;
        let new = || Rings::new(&self.tree, &self.suns, view.directions(m), view.finest[m], self.fineness);
        self.rings[m].get_or_init(new).filtered(kernel)
    }

    fn mirror(&self, m: usize, samples: &Samples) -> Column {
        let residual = |x: &Column| {
            let [a, b] = Moments::halves(samples, x);
            let all = a.plus(&b);
            let try_one = |p: &[usize; 3]| all.residual2(*p, all.gains(*p));
            ORDERS.iter().map(try_one).fold(f64::INFINITY, f64::min)
        };
        let all = self.mirrors[m].get_or_init(|| mirrors(&self.image, &self.suns, self.view, m));
        let best = all.iter().min_by(|a, b| residual(a).total_cmp(&residual(b)));
        best.cloned().unwrap_or_default()
    }

    /// The columns of a list of kernels.
    pub fn columns(&self, kernels: &[Kernel], samples: &[Samples]) -> Vec<Column> {
        kernels.iter().enumerate().map(|(m, k)| self.column(m, *k, &samples[m])).collect()
    }
}

fn vec_of<T>(n: usize) -> Vec<OnceCell<T>> {
    (0..n).map(|_| OnceCell::new()).collect()
}

/// Orders of three channels.
pub const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [2, 1, 0], [1, 0, 2], [0, 2, 1], [1, 2, 0], [2, 0, 1]];

/// The image with large texels divided into several of the same value: a hierarchy stores its own nodes, but
/// computes parts of a texel anew at each visit.
fn divided(image: &SphereImage) -> Option<SphereImage> {
    let n = DIVIDED_ROWS.div_ceil(image.height);
    let mut out = SphereImage::new(Layout::LatLong, n * image.width, n * image.height);
    for (to, from) in out.planes.iter_mut().zip(&image.planes) {
        for (j, row) in to.chunks_exact_mut(n * image.width).enumerate() {
            let from = &from[j / n * image.width..][..image.width];
            row.chunks_exact_mut(n).zip(from).for_each(|(part, v)| part.fill(*v));
        }
    }
    (n > 1).then_some(out)
}

/// The image resampled to finer cells, which represent another reading.
fn read(image: &SphereImage, reading: Reading) -> Option<SphereImage> {
    let (w, h) = (3 * image.width, 3 * image.height);
    match reading {
        Reading::Cells => None,
        Reading::Bilinear => Some(SphereImage::from_fn(Layout::LatLong, w, h, |d| image.bilinear(d))),
        Reading::Points => {
            let mut out = SphereImage::new(Layout::LatLong, w, h);
            for j in 0..image.height {
                let whole = image.layout.solid_angle(image.width, image.height, 0, 0, j);
                let part = out.layout.solid_angle(w, h, 0, 0, 3 * j + 1);
                for i in 0..image.width {
                    let (from, to) = (image.index(0, i, j), out.index(0, 3 * i + 1, 3 * j + 1));
                    (0..3).for_each(|c| out.planes[c][to] = image.planes[c][from] * (whole / part) as f32);
                }
            }
            Some(out)
        }
    }
}

/// Ways to take the light unfiltered: means over the texels, and values at their centres.
fn mirrors(image: &SphereImage, suns: &[SmallLight], view: &View<'_>, m: usize) -> Vec<Column> {
    let (level, directions) = (&view.levels[m], view.directions(m));
    let of = |v: [f32; 3]| v.map(f64::from);
    let mut all: Vec<Column> = vec![
        directions.iter().map(|d| of(image.nearest(*d))).collect(),
        directions.iter().map(|d| of(image.bilinear(*d))).collect(),
        directions.iter().map(|d| of(image.bicubic(*d))).collect(),
        supersampled(image, view, m),
    ];
    if !view.orientation.interpolates() {
        let (w, h) = (level.width, level.height);
        let mut whole = vec![image.resample(level.layout, w, h)];
        if level.layout == Layout::Cube {
            let mut fine = image.clone();
            while 2.0 / (w as f64) < std::f64::consts::PI / fine.height as f64
                && fine.planes[0].len() < 1 << 19
            {
                fine = fine.refined();
            }
            whole.push(fine.cube_means(w));
        }
        all.extend(whole.iter().map(|x| directions.iter().map(|d| of(x.nearest(*d))).collect::<Column>()));
    }
    let shares = sun_shares(suns, view, m);
    for column in &mut all {
        for (k, flux) in &shares {
            (0..3).for_each(|c| column[*k][c] += flux[c]);
        }
    }
    all
}

/// Means of the interpolated light over the texels.
fn supersampled(image: &SphereImage, view: &View<'_>, m: usize) -> Column {
    let level = &view.levels[m];
    let (w, h) = (level.width, level.height);
    let across = if level.layout == Layout::LatLong { h } else { 2 * h };
    let n = (3 * image.height / across.max(1)).clamp(3, 16);
    let mean = |&(face, i, j): &(usize, usize, usize)| {
        let mut sum = [0.0; 3];
        for k in 0..n * n {
            let part = |k: usize| (k as f64 + 0.5) / n as f64;
            let at = Position { face, x: i as f64 + part(k % n), y: j as f64 + part(k / n) };
            let d = level.layout.direction(w, h, at).unwrap_or(DVec3::Y);
            let v = image.bilinear(view.orientation.world(level, d));
            (0..3).for_each(|c| sum[c] += f64::from(v[c]));
        }
        sum.map(|s| s / (n * n) as f64)
    };
    view.samples[m].texels.iter().map(mean).collect()
}

/// Contributions of separate suns to the samples whose texels they cover.
fn sun_shares(suns: &[SmallLight], view: &View<'_>, m: usize) -> Vec<(usize, [f64; 3])> {
    // 144 points, of equal parts of the disk.
    const RINGS: usize = 6;
    let (level, samples) = (&view.levels[m], &view.samples[m]);
    let at: HashMap<_, _> = samples.texels.iter().enumerate().map(|(k, t)| (*t, k)).collect();
    let mut out = Vec::new();
    for b in suns {
        let n = if b.radius == 0.0 { 1 } else { RINGS };
        let side = b.direction.any_orthonormal_vector();
        let up = b.direction.cross(side);
        for k in 0..4 * n * n {
            let r = if n == 1 { 0.0 } else { b.radius * ((k as f64 + 0.5) / (4 * n * n) as f64).sqrt() };
            let (s, c) = (2.399_963_229_728_653 * k as f64).sin_cos();
            let d = (b.direction + r.tan() * (c * side + s * up)).normalize();
            let texel = level.texel_of(view.orientation.file(level, d));
            if let Some(&sample) = at.get(&texel) {
                let (face, i, j) = texel;
                let omega = level.layout.solid_angle(level.width, level.height, face, i, j);
                out.push((sample, b.flux.map(|f| f / (omega * (4 * n * n) as f64))));
            }
        }
    }
    out
}

/// The light cut into layers of radiance, so that light clipped anywhere is a sum of them.
pub struct Layers {
    /// Upper end of each layer; it begins where the one before ends.
    edges: Vec<f64>,
    /// Columns of each layer, per list of kernels and level.
    columns: Vec<Vec<Vec<Column>>>,
}

/// Layers per octave of radiance: clipping between two edges is interpolated.
const PER_OCTAVE: f64 = 1.0;
/// Most layers, each of which is filtered for every level: a factor of 1e6 between the mean and the
/// brightest.
const MAX_LAYERS: usize = 20;

impl Layers {
    /// Layers of the light under lists of kernels; `None` where nothing is bright.
    pub fn new(
        lights: &Lights,
        lists: &[&[Kernel]],
        view: &View<'_>,
        task: &Task,
    ) -> Result<Option<Self>, Cancelled> {
        let Some(e) = &lights.environment else { return Ok(None) };
        let values = || e.image.planes.iter().flatten().copied().filter(|v| v.is_finite() && *v > 0.0);
        let suns = lights.disks.iter().flat_map(|d| d.radiance);
        let peak = values().map(f64::from).chain(suns).fold(0.0, f64::max);
        let (sum, n) = values().fold((0.0, 0usize), |(s, n), v| (s + f64::from(v).sqrt(), n + 1));
        let mean = (sum / n.max(1) as f64).powi(2);
        if peak <= 1.5 * mean || n == 0 {
            return Ok(None);
        }
        let count = ((peak / mean).log2() * PER_OCTAVE).ceil().clamp(2.0, MAX_LAYERS as f64) as usize;
        let edges: Vec<f64> =
            (0..=count).map(|k| mean * (peak / mean).powf(k as f64 / count as f64)).collect();
        let mut columns = Vec::new();
        for (k, high) in edges.iter().enumerate() {
            let low = if k == 0 { f64::NEG_INFINITY } else { edges[k - 1] };
            let mut part = Alteration::None.of(lights);
            let image = between(&e.image, low, *high);
            part.environment = Some(std::sync::Arc::new(steradian_light::Environment { image }));
            for d in &mut part.disks {
                d.radiance = d.radiance.map(|l| l.clamp(low.max(0.0), *high) - low.max(0.0));
            }
            if k > 0 {
                part.directionals.clear();
            }
            columns.push(Self::layer(&part, lists, view, task)?);
        }
        Ok(Some(Self { edges, columns }))
    }

    fn layer(
        lights: &Lights,
        lists: &[&[Kernel]],
        view: &View<'_>,
        task: &Task,
    ) -> Result<Vec<Vec<Column>>, Cancelled> {
        let p = Prepared::of(lights, Reading::Cells, view, COARSE, task)?;
        let point = |d: &DVec3| p.image.bilinear(*d).map(f64::from);
        let level = |(m, k): (usize, &Kernel)| match k.zonal() {
            Some(k) => p.filtered(m, k.as_ref()),
            // Values at centres add up; which mean fits best does not.
            None => view.directions(m).iter().map(point).collect(),
        };
        Ok(lists.iter().map(|kernels| kernels.iter().enumerate().map(level).collect()).collect())
    }

    /// Radiances to try: each layer in parts.
    pub fn radiances(&self) -> Vec<f64> {
        // Radiances 7 % apart in a layer of an octave.
        const PARTS: usize = 10;
        let inside = |w: &[f64]| {
            let (a, b) = (w[0], w[1]);
            (0..PARTS).map(move |k| a * (b / a).powf(k as f64 / PARTS as f64)).collect::<Vec<_>>()
        };
        self.edges.windows(2).flat_map(inside).collect()
    }

    /// The columns of light clipped at `c`, under a list of kernels.
    pub fn clipped(&self, list: usize, c: f64) -> Vec<Column> {
        let mut out = self.columns[0][list].clone();
        for k in 1..self.edges.len() {
            let (a, b) = (self.edges[k - 1], self.edges[k]);
            let part = ((c - a) / (b - a)).clamp(0.0, 1.0);
            if part <= 0.0 {
                break;
            }
            for (sum, add) in out.iter_mut().zip(&self.columns[k][list]) {
                for (s, x) in sum.iter_mut().zip(add) {
                    (0..3).for_each(|c| s[c] += part * x[c]);
                }
            }
        }
        out
    }
}
