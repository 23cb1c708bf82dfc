//! The factors by least squares in the logarithm over samples of the exact radiance.

use super::maps::{CubeGrid, Tap, line_taps};
use super::params::Params;
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_brdf::views::Slices;
use steradian_numerics::lsqr::{Rgb, Sparse};
use steradian_numerics::products::Problem;
use steradian_parallel::prelude::*;
use steradian_prefilter::ViewImage;
use steradian_prefilter::probe;
use steradian_sphere::frame::reflect;
use steradian_sphere::sh::ShRgb;

/// Samples of the factor over n·wo, at equal steps of √(n·wo).
pub const LINE: usize = 48;
/// Samples of the radiance per unknown: where light and reflectance are no product, a fit to fewer would
/// follow noise.
pub const PER_UNKNOWN: usize = 24;
/// Most samples: those of 25,000 unknowns. With rows of fourteen entries they take 110 MB.
const MAX_SAMPLES: usize = 600_000;
/// Radiance below this share of the mean is clamped to it, so that its logarithm is finite, and weighs no
/// less.
const FLOOR: f64 = 1e-4;
/// Weight of smoothness relative to that of the samples that see an unknown, for the factors over n, r, wo
/// and n·wo. Where light and reflectance are no product, the fit would otherwise put the misfit into noise of
/// single texels, most of all in the factor over n, which is smooth by nature.
const SMOOTH: [f64; 4] = [1.0, 0.1, 0.1, 0.03];
/// Most steps of each solution.
const MAX_STEPS: usize = 60;
/// Gradient, relative to the first, at which a solution ends earlier; all but the last are linearised anew.
const ACCURACY: f64 = 1e-4;
/// Solutions after the first, each of the problem linearised about the one before.
const REFINEMENTS: usize = 2;

/// Order of the unknowns: those of each factor in turn.
pub struct Layout {
    pub n: Option<CubeGrid>,
    pub r: Option<CubeGrid>,
    pub wo: Option<CubeGrid>,
    pub line: bool,
    /// First unknown of n, r, wo and the line, and the number of all.
    pub starts: [usize; 5],
}

impl Layout {
    pub fn new(p: &Params, size: usize) -> Self {
        let cube = |used: bool, size: usize| used.then(|| CubeGrid::new(size));
        // The view changes little that n and r do not determine: its map is coarse, and few views determine
        // it.
        let (n, r, wo) = (cube(p.n, size), cube(p.r, size), cube(p.wo, (size / 4).max(2)));
        let mut starts = [0; 5];
        let counts = [&n, &r, &wo].map(|g| g.as_ref().map_or(0, CubeGrid::count));
        for k in 0..3 {
            starts[k + 1] = starts[k] + counts[k];
        }
        starts[4] = starts[3] + if p.line { LINE } else { 0 };
        Self { n, r, wo, line: p.line, starts }
    }

    pub fn count(&self) -> usize {
        self.starts[4]
    }

    /// Range of factor `k` among the unknowns.
    pub fn range(&self, k: usize) -> std::ops::Range<usize> {
        self.starts[k]..self.starts[k + 1]
    }

    /// The row of a sample.
    fn row(&self, n: DVec3, wo: DVec3, out: &mut Vec<Tap>) {
        let directions = [n, reflect(wo, n), wo];
        let cubes = [&self.n, &self.r, &self.wo].into_iter().zip(directions).zip(&self.starts);
        for ((grid, d), start) in cubes {
            if let Some(g) = grid {
                let taps = g.taps(d.as_vec3().to_array());
                out.extend(taps.map(|(k, w)| (k + *start as u32, w)));
            }
        }
        if self.line {
            let u = n.dot(wo).max(0.0).sqrt() as f32;
            out.extend(line_taps(LINE, u).map(|(k, w)| (k + self.starts[3] as u32, w)));
        }
    }

    /// Rows that say that an unknown is the mean of its neighbours; `put` begins a row with its factor.
    fn smoothness(&self, mut put: impl FnMut(usize, &[(usize, f64)])) {
        for (f, grid) in [&self.n, &self.r, &self.wo].into_iter().enumerate() {
            let Some(g) = grid else { continue };
            for (k, near) in g.neighbours().iter().enumerate() {
                let share = -1.0 / near.len() as f64;
                let mut row = vec![(self.starts[f] + k, 1.0)];
                row.extend(near.iter().map(|j| (self.starts[f] + *j as usize, share)));
                put(f, &row);
            }
        }
        if self.line {
            for k in self.starts[3] + 1..self.starts[4] - 1 {
                put(3, &[(k - 1, -0.5), (k, 1.0), (k + 1, -0.5)]);
            }
        }
    }
}

/// Samples of L_o over normals and views, uniform in both.
pub struct Samples {
    /// Normal and view.
    at: Vec<[DVec3; 2]>,
    /// L_o.
    l: Vec<Rgb>,
}

impl Samples {
    /// Enough samples for `unknowns`, from the exact images of views spread over the sphere.
    pub fn new(slices: &Slices, light: &ShRgb, unknowns: usize, task: &Task) -> Result<Self, Cancelled> {
        let total = (PER_UNKNOWN * unknowns).clamp(4096, MAX_SAMPLES);
        let views = ((total as f64).sqrt() * 0.7) as usize;
        let per = total.div_ceil(views);
        let of = |v: usize| {
            task.check()?;
            let wo = probe::direction(v, views);
            let image = ViewImage::new(slices, light, wo);
            let f = steradian_sphere::Frame::from_normal(wo);
            let sample = |k: usize| {
                let id = (v * per + k) as f64;
                // n·wo in equal steps, each view by another offset.
                let z = (k as f64 + (v as f64 * 0.618_033_988 + 0.5).fract()) / per as f64;
                let phi = 2.0 * PI * (id * 0.754_877_666).fract();
                let s = (1.0 - z * z).max(0.0).sqrt();
                let n = f.to_world(DVec3::new(s * phi.cos(), s * phi.sin(), z));
                ([n, wo], image.towards(reflect(wo, n)))
            };
            Ok((0..per).map(sample).collect::<Vec<_>>())
        };
        let all: Vec<_> = (0..views).into_par_iter().map(of).collect::<Result<_, _>>()?;
        let (at, l) = all.into_iter().flatten().unzip();
        Ok(Self { at, l })
    }

    fn mean(&self) -> Rgb {
        let mut sum = [0.0; 3];
        self.l.iter().for_each(|l| (0..3).for_each(|c| sum[c] += l[c] / self.l.len() as f64));
        sum
    }
}

/// Result of the fit.
pub struct Fit {
    /// Logarithms of the factors.
    pub x: Vec<Rgb>,
    /// Radiance of all factors 1.
    pub scale: Rgb,
    /// Relative RMS difference from the samples.
    pub residual: f64,
    /// RMS difference of the logarithms.
    pub log_residual: f64,
    /// Samples.
    pub samples: usize,
    /// Steps of all solutions.
    pub steps: usize,
}

/// Fits ln L_o ≈ Σ_j P_j; `weight` 1 minimises the absolute error of the radiance, 0 the relative one.
pub fn fit(layout: &Layout, samples: &Samples, weight: f64, task: &Task) -> Result<Fit, Cancelled> {
    let (problem, scale) = problem(layout, samples, weight);
    let mut now = problem.solve();
    for _ in 0..REFINEMENTS {
        task.check()?;
        problem.refine(&mut now);
    }
    let l = &problem.values;
    let radiance = |l: Rgb| -> Rgb { std::array::from_fn(|c| scale[c] * l[c]) };
    let shown = now.model.iter().map(|m| radiance(m.map(f64::exp)));
    let residual = probe::relative_rms(shown.zip(l.iter().map(|l| radiance(*l))));
    let square = |(m, b): (&Rgb, &Rgb)| (0..3).map(|c| (m[c] - b[c]).powi(2)).sum::<f64>();
    let squares: f64 = now.model.iter().zip(&problem.logs()).take(l.len()).map(square).sum();
    let log_residual = (squares / (3 * l.len()) as f64).sqrt();
    Ok(Fit { x: now.x, scale, residual, log_residual, samples: l.len(), steps: now.steps })
}

/// The least-squares problem for radiance over its mean (1 in channels without light), and that mean.
fn problem(layout: &Layout, samples: &Samples, power: f64) -> (Problem, Rgb) {
    let scale = samples.mean().map(|m| m.max(0.0));
    let over = |l: &Rgb| std::array::from_fn(|c| if scale[c] > 0.0 { l[c] / scale[c] } else { 1.0 });
    let mut problem = Problem {
        a: matrix(layout, samples),
        values: samples.l.iter().map(over).collect(),
        share: Vec::new(),
        floor: FLOOR,
        dim: FLOOR,
        power,
        smooth: Vec::new(),
        accuracy: ACCURACY,
        steps: MAX_STEPS,
        dense: false,
    };
    problem.smooth = smoothness(&problem, layout);
    (problem, scale)
}

/// Weight of smoothness of each factor: a share of the mean weight of samples per unknown of that factor.
fn smoothness(problem: &Problem, layout: &Layout) -> Vec<Rgb> {
    let mut sum = [0.0; 3];
    for l in (0..problem.values.len()).map(|k| problem.floored(k)) {
        (0..3).for_each(|c| sum[c] += l[c].powf(2.0 * problem.power));
    }
    let mut out = Vec::new();
    layout.smoothness(|factor, _| {
        let per = layout.range(factor).len() as f64;
        out.push(sum.map(|s| (SMOOTH[factor] * s / per).sqrt()));
    });
    out
}

/// One row per sample, then those of smoothness.
fn matrix(layout: &Layout, samples: &Samples) -> Sparse {
    let (mut ends, mut entries) = (Vec::new(), Vec::new());
    for [n, wo] in &samples.at {
        layout.row(*n, *wo, &mut entries);
        ends.push(entries.len() as u32);
    }
    layout.smoothness(|_, row| {
        entries.extend(row.iter().map(|(k, v)| (*k as u32, *v as f32)));
        ends.push(entries.len() as u32);
    });
    Sparse::new(layout.count(), ends, entries)
}
