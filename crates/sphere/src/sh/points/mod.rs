//! Synthesis at any points.
//!
//! The transform makes samples on a grid of twice the needed density, which a short window reads; what the
//! window does to each frequency is undone beforehand, in φ by a factor for each m and in θ by one for each
//! frequency of the meridian, continued over the poles to a whole circle (Potts, Steidl & Tasche 2001, "Fast
//! Fourier transforms for nonequispaced data"). The window is exp(β(√(1 − z²) − 1)) (Barnett, Magland & af
//! Klinteberg 2019, "A parallel nonuniform fast Fourier transform library based on an 'exponential of
//! semicircle' kernel"): W samples an axis leave about 10^(1−W) of the function's range.

mod bell;
mod cube;
mod meridians;
mod read;

use super::transform::{PlanesMut, Precision, Real, Sample, ShTransform};
use super::{ColumnsRgb, Grid};
use bell::{WIDEST, WindowSpectrum, polynomials};
pub(crate) use cube::CubeAngles;
use glam::DVec3;
use meridians::Meridians;
use read::Read;
use std::f64::consts::PI;
use steradian_parallel::prelude::*;

/// A function of the sphere, ready to be read at any points, three channels at a time.
pub struct PointSynthesis(Any);

enum Any {
    Coarse(Fine<f32, 4>),
    Fair(Fine<f32, 6>),
    Usual(Fine<f32, 8>),
    Good(Fine<f64, 8>),
    Fine(Fine<f64, 10>),
    Precise(Fine<f64, 12>),
    Exact(Fine<f64, 16>),
}

macro_rules! each {
    ($any:expr, $fine:ident => $do:expr) => {
        match $any {
            Any::Coarse($fine) => $do,
            Any::Fair($fine) => $do,
            Any::Usual($fine) => $do,
            Any::Good($fine) => $do,
            Any::Fine($fine) => $do,
            Any::Precise($fine) => $do,
            Any::Exact($fine) => $do,
        }
    };
}

impl PointSynthesis {
    /// Prepares the function of coefficients about the pole y (see [`ShTransform::analyze_polar`]), each band
    /// multiplied with its factor as in [`ShTransform::synthesize_columns`]; `error` is relative to the
    /// function's range and is kept down to 1e-13.
    pub fn new(columns: &ColumnsRgb, factors: &[f64], error: f64) -> Self {
        Self(match error {
            e if e >= 2e-3 => Any::Coarse(Fine::new(columns, factors)),
            e if e >= 1e-4 => Any::Fair(Fine::new(columns, factors)),
            e if e >= 1e-5 => Any::Usual(Fine::new(columns, factors)),
            e if e >= 1e-6 => Any::Good(Fine::new(columns, factors)),
            e if e >= 5e-8 => Any::Fine(Fine::new(columns, factors)),
            e if e >= 1e-10 => Any::Precise(Fine::new(columns, factors)),
            _ => Any::Exact(Fine::new(columns, factors)),
        })
    }

    /// Values in unit directions, in world coordinates (pole +Y), on all threads.
    ///
    /// # Panics
    /// If a plane is shorter than the directions.
    pub fn at<S: Sample>(&self, directions: &[DVec3], planes: [&mut [S]; 3]) {
        self.at_any(directions, S::planes_mut(planes));
    }

    fn at_any(&self, directions: &[DVec3], planes: PlanesMut<'_>) {
        match planes {
            PlanesMut::Single(planes) => self.at_all(directions, planes),
            PlanesMut::Double(planes) => self.at_all(directions, planes),
        }
    }

    fn at_all<S: Sample>(&self, directions: &[DVec3], planes: [&mut [S]; 3]) {
        let n = directions.len();
        let [r, g, b] = planes.map(|p| p[..n].par_chunks_mut(1024));
        let shares = r.zip(g).zip(b).zip(directions.par_chunks(1024));
        shares.for_each(|(((r, g), b), directions)| {
            let angles: Vec<[f64; 2]> = directions.iter().map(|d| angles(*d)).collect();
            self.read(&angles, [r, g, b]);
        });
    }

    /// Values of points given as (θ, φ), 0 ≤ θ ≤ π from +Y and φ = atan2(z, x) within a turn of it, on this
    /// thread.
    ///
    /// # Panics
    /// If a plane is shorter than the angles.
    pub fn values<S: Sample>(&self, angles: &[[f64; 2]], planes: [&mut [S]; 3]) {
        self.values_any(angles, S::planes_mut(planes));
    }

    fn values_any(&self, angles: &[[f64; 2]], planes: PlanesMut<'_>) {
        match planes {
            PlanesMut::Single(planes) => self.read(angles, planes),
            PlanesMut::Double(planes) => self.read(angles, planes),
        }
    }

    fn read<S: Sample>(&self, angles: &[[f64; 2]], planes: [&mut [S]; 3]) {
        each!(&self.0, fine => steradian_simd::run(Read { fine, angles, out: planes }));
    }
}

/// (θ, φ) of a direction.
pub(super) fn angles(d: DVec3) -> [f64; 2] {
    [d.x.hypot(d.z).atan2(d.y), d.z.atan2(d.x)]
}

/// Samples on a grid of twice the needed density, with a border.
struct Fine<T, const W: usize> {
    /// Samples about the whole circle, in φ and in θ over both poles.
    width: usize,
    circle: usize,
    grid: Grid2<T>,
    weights: Vec<[T; WIDEST]>,
}

/// Three planes of samples of rows and columns, each way with a border that continues them.
struct Grid2<T> {
    border: usize,
    stride: usize,
    planes: [Vec<T>; 3],
}

/// Where a point lies: its first sample, and how far it is beyond the middle ones, −1 … 1.
#[derive(Clone, Copy)]
struct Place<T> {
    start: usize,
    x: T,
    y: T,
}

impl<T: Real, const W: usize> Fine<T, W> {
    fn new(columns: &ColumnsRgb, factors: &[f64]) -> Self {
        let order = columns.order().min(if factors.is_empty() { usize::MAX } else { factors.len() - 1 });
        let height = smooth(order + 1).max(W / 2);
        let (width, circle) = (smooth(4 * (order + 1)).max(2 * W), 4 * height);
        let precision = if size_of::<T>() == 4 { Precision::Image } else { Precision::Double };
        let mut plan = ShTransform::with_precision(order, width, height, Grid::Equirectangular, precision);
        let spectrum = WindowSpectrum::new::<W>();
        plan.scale_orders(|m| spectrum.at(m as f64 / width as f64).recip());
        let mut samples: [Vec<T>; 3] = std::array::from_fn(|_| vec![T::default(); width * height]);
        plan.synthesize_columns(columns, factors, samples.each_mut().map(Vec::as_mut_slice));
        // Registers reach beyond the window: there are zeros.
        let stride = width + 2 * W + WIDEST;
        let rows = 2 * height + 1 + 2 * W;
        let planes = std::array::from_fn(|_| vec![T::default(); rows * stride]);
        let mut grid = Grid2 { border: W, stride, planes };
        Meridians::new(order, width, height, &spectrum).refine(&samples, &mut grid);
        Self { width, circle, grid, weights: polynomials::<T, W>() }
    }

    #[inline(always)]
    fn place(&self, [theta, phi]: [f64; 2]) -> Place<T> {
        let y = (theta / (2.0 * PI) * self.circle as f64).clamp(0.0, (self.circle / 2) as f64);
        let x = (0.5 + phi / (2.0 * PI)) * self.width as f64 - 0.5;
        let width = self.width as f64;
        let x = if x < 0.0 { x + width } else { x };
        let x = if x >= width { x - width } else { x };
        // A number that is none lands on the first sample.
        let (i, j) = ((x as usize).min(self.width - 1), y as usize);
        // Borders of W; the first sample is W/2 − 1 before the place.
        let first = W / 2 + 1;
        Place {
            start: (j + first) * self.grid.stride + i + first,
            x: T::of(2.0 * (x - i as f64) - 1.0),
            y: T::of(2.0 * (y - j as f64) - 1.0),
        }
    }
}

/// The smallest multiple of 4 from `n` without prime factors above 5.
fn smooth(n: usize) -> usize {
    let mut n = n.next_multiple_of(4).max(4);
    loop {
        let mut rest = n;
        for p in [2, 3, 5] {
            while rest.is_multiple_of(p) {
                rest /= p;
            }
        }
        if rest == 1 {
            return n;
        }
        n += 4;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sh::rotation::exchange_yz;
    use crate::sh::{ShRgb, count};

    /// All energy in the highest bands is the worst case.
    fn noise(order: usize) -> ShRgb {
        let mut sh = crate::sh::synthesis::tests::noise(order);
        sh.c[1][..order * order].fill(0.0);
        sh
    }

    /// Widths that fill no register of meridians meet what a worker's buffer held before.
    #[test]
    fn the_thread_count_does_not_change_a_bit() {
        let points = crate::quadrature::fibonacci(700).directions;
        for order in [3, 9, 14, 22, 37] {
            let columns = ColumnsRgb::from_sh(&noise(order));
            for error in [1e-5, 1e-10] {
                let read = |threads: usize| {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
                    let mut planes: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; points.len()]);
                    let [r, g, b] = &mut planes;
                    pool.install(|| PointSynthesis::new(&columns, &[], error).at(&points, [r, g, b]));
                    planes
                };
                let one = read(1);
                for threads in [2, 5] {
                    assert!(read(threads) == one, "order {order}, error {error}, {threads} threads");
                }
            }
        }
    }

    #[test]
    fn the_error_is_what_was_asked_for() {
        for order in [0, 1, 21, 64] {
            let sh = noise(order);
            let mut polar = sh.clone();
            exchange_yz(order, polar.c.each_mut().map(Vec::as_mut_slice));
            let columns = ColumnsRgb::from_sh(&polar);
            let mut points = crate::quadrature::fibonacci(300).directions;
            points.extend([
                DVec3::Y,
                -DVec3::Y,
                DVec3::X,
                -DVec3::X,
                DVec3::new(-1.0, 1e-9, -1e-12).normalize(),
            ]);
            let exact: Vec<[f64; 3]> = points.iter().map(|d| sh.value(*d)).collect();
            for error in [2e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-10, 1e-13] {
                let mut planes: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; points.len()]);
                let synthesis = PointSynthesis::new(&columns, &[], error);
                synthesis.at(&points, planes.each_mut().map(Vec::as_mut_slice));
                for k in 0..3 {
                    let range = exact.iter().map(|v| v[k].abs()).fold(0.0, f64::max);
                    let worst =
                        exact.iter().zip(&planes[k]).map(|(a, b)| (a[k] - b).abs()).fold(0.0, f64::max);
                    assert!(worst <= error * range, "order {order}, error {error:e}: {:e}", worst / range);
                }
            }
        }
    }

    #[test]
    fn factors_convolve() {
        let columns = ColumnsRgb::from_sh(&noise(30));
        let factors: Vec<f64> = (0..12).map(|l| 0.8_f64.powi(l)).collect();
        let mut scaled = noise(30);
        for c in &mut scaled.c {
            for l in 0..=30 {
                let factor = factors.get(l).copied().unwrap_or(0.0);
                c[l * l..count(l)].iter_mut().for_each(|c| *c *= factor);
            }
        }
        let points = crate::quadrature::fibonacci(50).directions;
        let [a, b] =
            [(&columns, &factors[..]), (&ColumnsRgb::from_sh(&scaled), &[])].map(|(columns, factors)| {
                let mut planes: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; points.len()]);
                let synthesis = PointSynthesis::new(columns, factors, 1e-12);
                synthesis.at(&points, planes.each_mut().map(Vec::as_mut_slice));
                planes
            });
        for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
            assert!((a - b).abs() < 1e-11);
        }
    }
}
