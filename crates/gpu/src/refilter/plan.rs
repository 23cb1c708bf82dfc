//! Order of the computation: the numbers of every pass, computed once for a chain.

use super::kernel;
use super::program::{Builder, Job, Pass, Work};
use crate::GpuError;
use steradian_prefilter::Zonal;
use steradian_technique::GpuTechnique;
use steradian_technique::gpu::{Kernel, LightCube, Shape, Table};

/// Method of filtering.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// The level of a box mip chain whose width is nearest to the kernel's (K06): the cheapest and crudest,
    /// with the seams of its cube.
    Box,
    /// Sums of Gaussians of doubling width, each made of the one before over an equiangular cube, and
    /// spherical harmonics for the lowest bands: within a percent of exact.
    #[default]
    Convolution,
    /// Two kernels in the plane of dual-paraboloid maps, blended (STAR04 7.4.2).
    Paraboloid,
    /// Spherical harmonics alone, up to 16 bands: exact for light and kernels without higher ones.
    Frequency,
}

/// A level of the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Intervals per cube edge; a face has (size + 1)² samples.
    pub size: u32,
    /// Kernel of the level.
    pub kernel: Kernel,
    /// Factor of all values.
    pub gain: f32,
}

/// Levels equally spaced in perceptual roughness from 0 (the light itself) to 1, each half the size of the
/// one before. A level has at least 16 intervals, and no fewer than bilinear lookup of a point's reflection
/// needs for an error of about a percent.
pub fn ggx_levels(size: u32, count: usize) -> Vec<Level> {
    let last = count.max(2) - 1;
    let kernel = |k: usize| match k {
        0 => Kernel::Mirror,
        _ => Kernel::Ggx { alpha: (k as f64 / last as f64).powi(2) },
    };
    let level = |k: usize| {
        let kernel = kernel(k);
        // Half the spread of the kernel's core (2α) as the mean spacing, √(4π/6)/size.
        let needed = (1.45 / (0.6 * kernel::width(kernel))).clamp(16.0, 2048.0) as u32;
        let own = (size >> k.min(31)).max(needed.next_power_of_two());
        Level { size: own.min(size), kernel, gain: 1.0 }
    };
    (0..=last).map(level).collect()
}

/// Samples of the finest Gaussian per standard deviation: cubics between them miss 0.4 % of its peak at most,
/// 5 % with one, 0.04 % with four, which would take sixteen times the sums.
const FINENESS: f64 = 2.0;
/// Extent of a Gaussian's sum, in standard deviations: it has fallen to 2e-3 of its peak there, by which
/// [`kernel::gaussian`] lowers it, so that it ends without a step and weights are fitted to what is summed.
const REACH: f64 = 3.5;
/// Intervals of the coarsest Gaussian's cube. Its second Gaussian, 16° wide, has 1.4 % of band 10 left, and
/// wider parts of kernels are in the bands that are corrected: for GGX of α = 0.2 and ten bands 0.09 % are
/// missed, 0.10 % with a coarser cube more, 0.19 % with one fewer.
const MIN_CUBE: u32 = 16;
/// Most bands of spherical harmonics (the shader's arrays).
pub(super) const MOST_BANDS: usize = 16;
/// Bands by which the sums of Gaussians are corrected in cubes larger than [`SMALL_CUBE`]; in smaller ones
/// all bands are. Of GGX of α = 0.6 four leave 1.9 %, ten 0.6 % and sixteen 0.3 %, with bands² terms a texel.
const LOW_BANDS: usize = 10;
/// Intervals up to which a cube counts as small: 6 · 65² texels with 256 terms each are 6.5 million, as many
/// as those of ten bands over 103 intervals.
const SMALL_CUBE: u32 = 64;
/// Intervals of the cube from which harmonics are projected: 17 samples for each wave of band 15, which its
/// Gaussian of 2.8° leaves three quarters of.
const PROJECTED_CUBE: u32 = 64;

/// The passes of one chain.
#[derive(Debug, Clone)]
pub struct Plan {
    pub(super) way: Method,
    pub(super) levels: Vec<Level>,
    pub(super) places: Vec<[u32; 3]>,
    /// Texels a row and rows of a face of the atlas.
    pub(super) extent: [u32; 2],
    /// Texels a row on the way to it: a multiple of 16, as copies want.
    pub(super) pitch: u32,
    pub(super) work: Work,
    errors: Vec<f64>,
}

impl Plan {
    /// A chain of `levels`, packed as techniques pack theirs.
    pub fn new(way: Method, levels: &[Level]) -> Result<Self, GpuError> {
        let x = levels.first().map_or(0, |l| l.size + 1);
        let mut y = 0;
        let place = |(k, l): (usize, &Level)| {
            if k == 0 {
                return [0, 0, l.size];
            }
            y += l.size + 1;
            [x, y - l.size - 1, l.size]
        };
        let places: Vec<[u32; 3]> = levels.iter().enumerate().map(place).collect();
        let end = |axis: usize| places.iter().map(|p| p[axis] + p[2] + 1).max().unwrap_or(1);
        let extent = [end(0), end(1)];
        Self::placed(way, levels, places, extent)
    }

    /// The levels of a table of `technique` that `cube` says the material looks up, as large as its bake made
    /// them.
    pub fn of_table(way: Method, technique: &GpuTechnique, cube: &LightCube) -> Result<Self, GpuError> {
        let (name, kernels) = (cube.table, &cube.levels);
        let table = table(technique, name)?;
        let places = match &table.shape {
            Shape::EdgeCube => vec![[0, 0, table.level.width as u32 - 1]],
            Shape::EdgeCubeChain(places) => places.clone(),
            _ => return Err(no_cube(technique, name)),
        };
        if places.len() != kernels.len() {
            let why =
                format!("'{name}' of {} has {} levels, not {}", technique.slug, places.len(), kernels.len());
            return Err(GpuError::Scene(why));
        }
        let used = places.iter().zip(kernels).filter_map(|(p, k)| Some((*p, (*k)?)));
        let (places, levels): (Vec<_>, Vec<_>) =
            used.map(|(p, (kernel, gain))| (p, Level { size: p[2], kernel, gain })).unzip();
        Self::placed(way, &levels, places, [table.level.width, table.level.height].map(|n| n as u32))
    }

    /// Gives `technique` an empty table `name` of this chain's sizes, ready for [`super::Refilter::deliver`]:
    /// later light may be sharper than that which the technique was baked for.
    pub fn install(&self, technique: &mut GpuTechnique, name: &str) -> Result<(), GpuError> {
        let slug = technique.slug;
        let found = technique.tables.iter_mut().find(|t| t.name == name);
        let table = found.ok_or_else(|| GpuError::Scene(format!("{slug} has no table '{name}'")))?;
        match &mut table.shape {
            Shape::EdgeCubeChain(places) => places.clone_from(&self.places),
            Shape::EdgeCube if self.places.len() == 1 => {}
            _ => return Err(GpuError::Scene(format!("'{name}' of {slug} cannot hold this chain"))),
        }
        let [width, height] = self.extent;
        (table.level.width, table.level.height) = (width as usize, height as usize);
        table.level.bytes = vec![0; 6 * 16 * (width * height) as usize];
        Ok(())
    }

    fn placed(
        way: Method,
        levels: &[Level],
        places: Vec<[u32; 3]>,
        extent: [u32; 2],
    ) -> Result<Self, GpuError> {
        if levels.is_empty() || levels.len() > 100 {
            return Err(GpuError::Scene("a chain has 1 to 100 levels".into()));
        }
        for l in levels {
            kernel::check(l.kernel)?;
            if !(1..=1024).contains(&l.size) || !l.gain.is_finite() {
                return Err(GpuError::Scene(format!("a level of {} texels a side", l.size)));
            }
        }
        let mut plan = Self {
            way,
            levels: levels.to_vec(),
            places,
            extent,
            pitch: extent[0].next_multiple_of(16),
            work: Work::default(),
            errors: Vec::new(),
        };
        plan.schedule();
        Ok(plan)
    }

    /// Method of filtering.
    pub fn method(&self) -> Method {
        self.way
    }

    /// The levels.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// For each level the relative RMS error of the fit of its kernel under light whose bands fall like 1/l²;
    /// 0 for mirrors, and unknown (1) for boxes and paraboloids.
    pub fn predicted(&self) -> &[f64] {
        &self.errors
    }

    /// Texels read by one refilter: each way's cost, pass by pass with the level that it serves.
    pub fn reads(&self) -> Vec<(&'static str, Option<usize>, u64)> {
        self.work.jobs.iter().map(|j| (j.pass.entry(), j.level, j.outputs * j.reads)).collect()
    }

    /// Bands of the spherical harmonics that this way leaves behind.
    pub fn bands(&self) -> Option<usize> {
        match self.way {
            Method::Convolution | Method::Frequency => Some(MOST_BANDS),
            Method::Box | Method::Paraboloid => None,
        }
    }

    /// Does this way leave spherical harmonics behind?
    pub fn has_harmonics(&self) -> bool {
        self.bands().is_some()
    }

    fn narrowest(&self) -> f64 {
        self.levels.iter().map(|l| kernel::width(l.kernel)).fold(1.0, f64::min)
    }

    fn schedule(&mut self) {
        let mut b = Builder::default();
        self.errors = match self.way {
            Method::Convolution => self.convolution(&mut b),
            Method::Frequency => self.frequency(&mut b),
            Method::Box => self.boxes(&mut b),
            Method::Paraboloid => self.paraboloids(&mut b),
        };
        self.work = b.finish();
    }

    /// A job that writes level `k` of the chain.
    fn onto(&self, k: usize, pass: Pass) -> Job {
        let (l, p) = (&self.levels[k], self.places[k]);
        let n = kernel::numbers(l.kernel);
        let size = u64::from(l.size + 1);
        Job {
            pass,
            level: Some(k),
            outputs: 6 * size * size,
            span: [0, 0, l.size, 0],
            place: [p[0], p[1], self.pitch, self.extent[1]],
            kernel: [n[0] as f32, n[1] as f32, n[2] as f32, l.gain],
            ..Job::default()
        }
    }

    fn mirror(&self, b: &mut Builder, k: usize) {
        b.push(Job { reads: 64, ..self.onto(k, Pass::Mirror) });
        b.push(Job { reads: 1, outputs: 64, ..self.onto(k, Pass::Suns) });
    }

    /// Filters levels by `other`, mirrors separately.
    fn each(
        &self,
        b: &mut Builder,
        mut other: impl FnMut(&mut Builder, usize, &dyn Zonal) -> f64,
    ) -> Vec<f64> {
        let level = |k: usize| match self.levels[k].kernel.zonal() {
            None => {
                self.mirror(b, k);
                0.0
            }
            Some(zonal) => other(b, k, &*zonal),
        };
        (0..self.levels.len()).map(level).collect()
    }

    /// The cube of `n` intervals that everything starts from, and the factors of its bands.
    fn source(b: &mut Builder, n: u32, order: usize) -> (u32, Vec<f64>) {
        let samples = 6 * (n + 1) * (n + 1);
        let at = b.reserve(samples);
        b.push(Job {
            pass: Pass::Source,
            outputs: samples.into(),
            reads: 64,
            span: [0, 0, n, 0],
            at: [at, 0, 1, 0],
            ..Job::default()
        });
        (at, kernel::cells(cell(n), order))
    }

    fn convolution(&self, b: &mut Builder) -> Vec<f64> {
        // The finest is at most as wide as α: most of GGX is in wider ones.
        let wanted = FINENESS * std::f64::consts::FRAC_PI_2 / self.narrowest();
        let finest = (wanted.ceil() as u32).next_power_of_two().clamp(PROJECTED_CUBE, 512);
        let sigma = |n: u32| FINENESS * std::f64::consts::FRAC_PI_2 / f64::from(n);
        let order = (5.0 / sigma(finest)).ceil() as usize;
        let (mut from, mut transfer) = Self::source(b, finest, order);
        let (mut places, mut basis) = (Vec::new(), Vec::new());
        let mut n = finest;
        while n >= MIN_CUBE {
            // A step of √2 in width, after the first, reads every other sample of the cube before.
            let (strides, added) = if n == finest { (1, 1.0) } else { (2, 0.5f64.sqrt()) };
            let wider = [([n, n], strides, added * sigma(n)), ([n, n / 2], 2, sigma(n))];
            for (step, (sizes, stride, sigma)) in wider.into_iter().enumerate() {
                let k;
                (from, k) = Self::blur(b, sizes, stride, from, sigma, order);
                transfer.iter_mut().zip(&k).for_each(|(t, k)| *t *= k);
                if (n, step) == (PROJECTED_CUBE, 0) {
                    Self::project(b, n, from, MOST_BANDS, &transfer);
                }
                places.push((from, n));
                basis.push(transfer.clone());
            }
            n /= 2;
        }
        self.each(b, |b, k, zonal| {
            let bands = if self.levels[k].size > SMALL_CUBE { LOW_BANDS } else { MOST_BANDS };
            let m = kernel::fit(&zonal.coefficients(order), &basis, bands);
            let row = |(&(at, n), w): (&(u32, u32), &f64)| [at as f32, n as f32, *w as f32, 0.0];
            let gaussians = b.table(places.iter().zip(&m.weights).map(row));
            let rest = b.table(m.rest.iter().map(|r| [*r as f32, 0.0, 0.0, 0.0]));
            let recurrence = b.recurrence();
            let reads = 16 * places.len() as u64 + (bands * bands) as u64;
            b.push(Job {
                reads,
                at: [0, 0, 1, places.len() as u32],
                tables: [gaussians, recurrence, rest, bands as u32],
                ..self.onto(k, Pass::Mix)
            });
            m.error
        })
    }

    /// A Gaussian of standard deviation `sigma` over every `stride`th sample of the cube at `from`, which
    /// make a cube of `read`, on a cube of `n`; where it lies and its bands.
    fn blur(
        b: &mut Builder,
        [n, read]: [u32; 2],
        stride: u32,
        from: u32,
        sigma: f64,
        order: usize,
    ) -> (u32, Vec<f64>) {
        let samples = 6 * (n + 1) * (n + 1);
        let at = b.reserve(samples);
        let (kappa, reach) = (sigma.powi(-2), REACH * sigma);
        let weights = b.even_weights(read);
        let height = 1.0 - reach.cos();
        let sine = if reach < std::f64::consts::FRAC_PI_2 { reach.sin() } else { 1.0 };
        // The square around the reach, in cells of the mean size.
        let reads = (2.0 * reach / cell(read).sqrt() + 1.0).powi(2).ceil() as u64;
        b.push(Job {
            pass: Pass::Gauss,
            outputs: samples.into(),
            reads,
            span: [0, 0, n, read],
            at: [at, from, stride, 0],
            tables: [weights, 0, 0, 0],
            a: [kappa as f32, height as f32, sine as f32, (-kappa * height).exp() as f32],
            ..Job::default()
        });
        (at, kernel::gaussian(kappa, reach, order))
    }

    /// Bands of the cube at `from`, whose own are `transfer` times the light's.
    fn project(b: &mut Builder, n: u32, from: u32, bands: usize, transfer: &[f64]) {
        let factors: Vec<f64> = transfer[..bands].iter().map(|t| 1.0 / t).collect();
        b.project(n, from, bands, &factors);
    }

    fn frequency(&self, b: &mut Builder) -> Vec<f64> {
        // Bands of GGX fall like e^(−αl): eight widths on they are 3e-4, and below α = 1/50 more are taken.
        const MIN_ORDER: usize = 400;
        let (at, transfer) = Self::source(b, PROJECTED_CUBE, MOST_BANDS);
        Self::project(b, PROJECTED_CUBE, at, MOST_BANDS, &transfer);
        self.each(b, |b, k, zonal| {
            let order = MIN_ORDER.max((8.0 / kernel::width(self.levels[k].kernel)) as usize);
            let m = kernel::fit(&zonal.coefficients(order), &[], MOST_BANDS);
            let rest = b.table(m.rest.iter().map(|r| [*r as f32, 0.0, 0.0, 0.0]));
            let recurrence = b.recurrence();
            b.push(Job {
                reads: (MOST_BANDS * MOST_BANDS) as u64,
                tables: [0, recurrence, rest, MOST_BANDS as u32],
                ..self.onto(k, Pass::Mix)
            });
            m.error
        })
    }

    /// Box mips of the finest level's size; where their places are listed, how many, and the size.
    fn mips(&self, b: &mut Builder) -> (u32, u32, u32) {
        let largest = self.levels.iter().map(|l| l.size).max().unwrap_or(1);
        let size = largest.next_power_of_two().clamp(32, 512);
        let mut places = Vec::new();
        let mut n = size;
        while n >= 1 {
            let (at, pass) = (b.reserve(6 * n * n), if n == size { Pass::Box } else { Pass::Halve });
            let from = places.last().map_or(0, |p: &(u32, u32)| p.0);
            b.push(Job {
                pass,
                outputs: u64::from(6 * n * n),
                reads: if n == size { 64 } else { 4 },
                span: [0, 0, n, 0],
                at: [at, from, 1, 0],
                ..Job::default()
            });
            places.push((at, n));
            n /= 2;
        }
        let list = b.table(places.iter().map(|&(at, n)| [at as f32, n as f32, 0.0, 0.0]));
        (list, places.len() as u32, size)
    }

    fn boxes(&self, b: &mut Builder) -> Vec<f64> {
        let (list, count, size) = self.mips(b);
        self.each(b, |b, k, zonal| {
            let order = 400.max((8.0 / kernel::width(self.levels[k].kernel)) as usize).min(2000);
            let v = kernel::variance(&zonal.coefficients(order));
            // A box has the variance h²/12, bilinear lookup adds h²/6.
            let own = cell(size) / 4.0;
            let level = (0.5 * (v / own).log2()).clamp(0.0, f64::from(count - 1));
            b.push(Job {
                reads: 8,
                tables: [list, 0, 0, count],
                a: [level as f32, 0.0, 0.0, 0.0],
                ..self.onto(k, Pass::Boxed)
            });
            1.0
        })
    }

    fn paraboloids(&self, b: &mut Builder) -> Vec<f64> {
        // Samples along the radius, 0.66 α apart on the map, which is 1.3 α of angle: 1 % of GGX is beyond. A
        // texel reads 16² π of them.
        const TAPS: u32 = 16;
        let (list, count, _) = self.mips(b);
        self.each(b, |b, k, _| {
            // An angle is twice a length at the centre, where the narrower kernel must have its samples.
            let width = kernel::width(self.levels[k].kernel);
            let spacing = (0.66 * width).clamp(0.004, 0.1);
            let extent = 1.0 + f64::from(TAPS) * spacing;
            let n = (2.0 * extent / spacing).ceil() as u32;
            let (from, to) = (b.reserve(2 * n * n), b.reserve(2 * n * n));
            let numbers = self.onto(k, Pass::Lobes).kernel;
            let map = Job {
                outputs: u64::from(2 * n * n),
                level: Some(k),
                span: [0, 0, n, 0],
                tables: [list, 0, 0, count],
                a: [0.0, extent as f32, 0.0, 0.0],
                kernel: numbers,
                ..Job::default()
            };
            b.push(Job { pass: Pass::Parabola, reads: 8, at: [from, 0, 1, 0], ..map });
            let taps = (std::f64::consts::PI * f64::from(TAPS * TAPS)) as u64;
            b.push(Job { pass: Pass::Lobes, reads: taps, at: [to, from, TAPS, 0], ..map });
            let mut unfold = Job { reads: 4, at: [0, to, 1, 0], a: map.a, ..self.onto(k, Pass::Unfold) };
            unfold.span[3] = n;
            b.push(unfold);
            1.0
        })
    }
}

/// Solid angle of a cell, in the mean: 4π over six faces of n².
fn cell(n: u32) -> f64 {
    4.0 * std::f64::consts::PI / (6.0 * f64::from(n).powi(2))
}

/// The table of that name.
fn table<'a>(technique: &'a GpuTechnique, name: &str) -> Result<&'a Table, GpuError> {
    technique.tables.iter().find(|t| t.name == name).ok_or_else(|| no_cube(technique, name))
}

fn no_cube(technique: &GpuTechnique, name: &str) -> GpuError {
    GpuError::Scene(format!("{} has no cube '{name}'", technique.slug))
}
