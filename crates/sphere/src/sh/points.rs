//! Synthesis at any points.
//!
//! The transform makes samples on a grid of twice the needed density, which a short window reads; what the window
//! does to each frequency is undone beforehand, in φ by a factor for each m and in θ by one for each frequency of
//! the meridian, continued over the poles to a whole circle (Potts, Steidl & Tasche 2001, "Fast Fourier transforms
//! for nonequispaced data"). The window is exp(β(√(1 − z²) − 1)) (Barnett, Magland & af Klinteberg 2019, "A parallel
//! nonuniform fast Fourier transform library based on an 'exponential of semicircle' kernel"): W samples an axis
//! leave about 10^(1−W) of the function's range.

use super::transform::{Precision, Real, Sample, ShTransform};
use super::{ColumnsRgb, Grid};
use crate::quadrature::gauss_legendre;
use glam::DVec3;
use rayon::prelude::*;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
use steradian_simd::{Arch, Kernel};

/// Coefficients of the polynomials that a sample's weight is.
const TERMS: usize = 20;

/// Columns whose meridians are transformed together.
const SIDE: usize = 16;

/// Rows that they are then written to together.
const ROWS: usize = 64;

/// A function of the sphere, ready to be read at any points, three channels at a time.
pub struct PointSynthesis(Any);

enum Any {
    Coarse(Fine<f32, 4>),
    Usual(Fine<f32, 8>),
    Fine(Fine<f64, 8>),
    Precise(Fine<f64, 12>),
    Exact(Fine<f64, 16>),
}

macro_rules! each {
    ($any:expr, $fine:ident => $do:expr) => {
        match $any {
            Any::Coarse($fine) => $do,
            Any::Usual($fine) => $do,
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
            e if e >= 1e-5 => Any::Usual(Fine::new(columns, factors)),
            e if e >= 1e-6 => Any::Fine(Fine::new(columns, factors)),
            e if e >= 1e-10 => Any::Precise(Fine::new(columns, factors)),
            _ => Any::Exact(Fine::new(columns, factors)),
        })
    }

    /// Values in unit directions, in world coordinates (pole +Y), on all threads.
    ///
    /// # Panics
    /// If a plane is shorter than the directions.
    pub fn at<S: Sample>(&self, directions: &[DVec3], planes: [&mut [S]; 3]) {
        let n = directions.len();
        let [r, g, b] = planes.map(|p| p[..n].par_chunks_mut(1024));
        let shares = r.zip(g).zip(b).zip(directions.par_chunks(1024));
        shares.for_each(|(((r, g), b), directions)| {
            self.values(directions.len(), |i| angles(directions[i]), [r, g, b]);
        });
    }

    /// Values of `n` points given as (θ, φ), 0 ≤ θ ≤ π from +Y and φ = atan2(z, x) within a turn of it, on this
    /// thread.
    ///
    /// # Panics
    /// If a plane is shorter than `n`.
    pub fn values<S: Sample>(&self, n: usize, angles: impl Fn(usize) -> [f64; 2], planes: [&mut [S]; 3]) {
        each!(&self.0, fine => fine.values(n, angles, planes));
    }
}

/// (θ, φ) of a direction.
pub(super) fn angles(d: DVec3) -> [f64; 2] {
    [d.x.hypot(d.z).atan2(d.y), d.z.atan2(d.x)]
}

/// (θ, φ) of all texel centres of a cube map, from an eighth of them.
pub(super) struct CubeAngles {
    size: usize,
    /// Of column i of a side face: φ from the face's axis.
    column: Vec<f64>,
    /// Of texel (i, j) of a side face: π/2 − θ of the upper half; row-major, first quadrant by distance from
    /// the face's axis.
    height: Vec<f64>,
    /// Of texel (i, j) of a polar face: angle from the pole, and about it.
    polar: Vec<[f64; 2]>,
}

impl CubeAngles {
    pub(super) fn new(size: usize) -> Self {
        let half = size.div_ceil(2);
        // Distances from the middle, as `fold` counts them.
        let a: Vec<f64> = (0..half).map(|q| (2 * q + 1 - size % 2) as f64 / size as f64).collect();
        let quadrant = || (0..half * half).map(|k| (a[k % half], a[k / half]));
        Self {
            size,
            column: a.iter().map(|a| a.atan()).collect(),
            height: quadrant().map(|(a, b)| b.atan2(a.hypot(1.0))).collect(),
            polar: quadrant()
                .map(|(a, b)| [a.hypot(b).atan(), if b > 0.0 { b.atan2(a) } else { 0.0 }])
                .collect(),
        }
    }

    /// Distance from the middle in texels, rounded down, and whether before it.
    fn fold(&self, i: usize) -> (usize, bool) {
        let twice = 2 * i + 1;
        (twice.abs_diff(self.size) / 2, twice < self.size)
    }

    /// (θ, φ) of texel (i, j) of a face in the order +X −X +Y −Y +Z −Z.
    pub(super) fn at(&self, face: usize, i: usize, j: usize) -> [f64; 2] {
        let half = self.size.div_ceil(2);
        let ((a, left), (b, up)) = (self.fold(i), self.fold(j));
        let signed = |x: f64, negative: bool| if negative { -x } else { x };
        match face {
            2 | 3 => {
                let [from_pole, about] = self.polar[b * half + a];
                // +Y: x to the right, z downwards; −Y: z upwards.
                let up = up != (face == 3);
                let about = if left { PI - about } else { about };
                [if face == 2 { from_pole } else { PI - from_pole }, signed(about, up)]
            }
            _ => {
                let theta = FRAC_PI_2 - signed(self.height[b * half + a], !up);
                // φ grows to the left on all sides but is measured from each face's axis.
                let across = signed(self.column[a], !left);
                let axis = [0.0, PI, 0.0, 0.0, FRAC_PI_2, -FRAC_PI_2][face];
                [theta, axis + across]
            }
        }
    }
}

/// Samples on a grid of twice the needed density, with a border of W.
struct Fine<T, const W: usize> {
    /// Samples about the whole circle, in φ and in θ over both poles.
    width: usize,
    circle: usize,
    stride: usize,
    planes: [Vec<T>; 3],
    /// Polynomials in 2t − 1 of the W weights, highest power first.
    weights: Box<[[T; W]; TERMS]>,
}

/// Where a point lies: its first sample, and how far it is beyond the middle ones, −1 … 1.
#[derive(Clone, Copy, Default)]
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
        let stride = width + 2 * W;
        let meridians = Meridians::<T, W>::new(order, width, height, &spectrum);
        let planes = samples.map(|p| meridians.refine(&p, stride));
        Self { width, circle, stride, planes, weights: Box::new(polynomials()) }
    }

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
            start: (j + first) * self.stride + i + first,
            x: T::of(2.0 * (x - i as f64) - 1.0),
            y: T::of(2.0 * (y - j as f64) - 1.0),
        }
    }

    fn values<S: Sample>(&self, n: usize, angles: impl Fn(usize) -> [f64; 2], planes: [&mut [S]; 3]) {
        let places: Vec<Place<T>> = (0..n).map(|i| self.place(angles(i))).collect();
        let out = planes.map(|p| &mut p[..n]);
        steradian_simd::run(Read { fine: self, places: &places, out });
    }
}

struct Read<'a, T, S, const W: usize> {
    fine: &'a Fine<T, W>,
    places: &'a [Place<T>],
    out: [&'a mut [S]; 3],
}

impl<T: Real, S: Sample, const W: usize> Kernel for Read<'_, T, S, W> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let [red, green, blue] = self.out;
        let [r, g, b] = &self.fine.planes;
        for i in 0..self.places.len() {
            let place = self.places[i];
            let (wx, wy) = (weigh(&self.fine.weights, place.x), weigh(&self.fine.weights, place.y));
            let mut sums = [[T::default(); W]; 3];
            for k in 0..W {
                let at = place.start + k * self.fine.stride;
                let (r, g, b) = (&r[at..at + W], &g[at..at + W], &b[at..at + W]);
                for c in 0..W {
                    sums[0][c] = sums[0][c] + wy[k] * r[c];
                    sums[1][c] = sums[1][c] + wy[k] * g[c];
                    sums[2][c] = sums[2][c] + wy[k] * b[c];
                }
            }
            red[i] = S::from_f64(dot(&sums[0], &wx).f64());
            green[i] = S::from_f64(dot(&sums[1], &wx).f64());
            blue[i] = S::from_f64(dot(&sums[2], &wx).f64());
        }
    }
}

#[inline(always)]
fn weigh<T: Real, const W: usize>(polynomials: &[[T; W]; TERMS], s: T) -> [T; W] {
    let mut w = polynomials[TERMS - terms(W)];
    for k in TERMS - terms(W) + 1..TERMS {
        for c in 0..W {
            w[c] = w[c] * s + polynomials[k][c];
        }
    }
    w
}

/// Terms of the weights' polynomials that count.
const fn terms(w: usize) -> usize {
    if w + 4 < TERMS { w + 4 } else { TERMS }
}

#[inline(always)]
fn dot<T: Real, const W: usize>(a: &[T; W], b: &[T; W]) -> T {
    let mut four = [T::default(); 4];
    for k in 0..W {
        four[k % 4] = four[k % 4] + a[k] * b[k];
    }
    (four[0] + four[1]) + (four[2] + four[3])
}

/// β of the window at twofold density.
fn beta(w: usize) -> f64 {
    2.3 * w as f64
}

/// The window at a distance of u samples.
fn window<const W: usize>(u: f64) -> f64 {
    let z = 2.0 * u / W as f64;
    (beta(W) * ((1.0 - z * z).max(0.0).sqrt() - 1.0)).exp()
}

/// The window's Fourier transform, as a sum over nodes: u, and weights times the window there.
struct WindowSpectrum(Vec<[f64; 2]>);

impl WindowSpectrum {
    /// u = W/2 sin s makes the integrand smooth.
    fn new<const W: usize>() -> Self {
        let (x, w) = gauss_legendre(32 + 2 * W);
        let half = 0.5 * W as f64;
        let node = |(x, w): (&f64, &f64)| {
            let (sin, cos) = (FRAC_PI_4 * (1.0 + x)).sin_cos();
            [half * sin, w * FRAC_PI_2 * half * cos * (beta(W) * (cos - 1.0)).exp()]
        };
        Self(x.iter().zip(&w).map(node).collect())
    }

    /// ∫ window(u) cos 2πfu du at f cycles a sample.
    fn at(&self, f: f64) -> f64 {
        self.0.iter().map(|[u, w]| w * (2.0 * PI * f * u).cos()).sum()
    }
}

/// Polynomials through each sample's weight at the nodes of Chebyshev, highest power first; the leading ones of
/// short windows are 0.
fn polynomials<T: Real, const W: usize>() -> [[T; W]; TERMS] {
    let n = terms(W);
    let mut out = [[T::default(); W]; TERMS];
    for c in 0..W {
        let nodes: Vec<f64> = (0..n).map(|k| (PI * (k as f64 + 0.5) / n as f64).cos()).collect();
        // Newton's divided differences, then powers.
        let mut d: Vec<f64> =
            nodes.iter().map(|s| window::<W>(c as f64 - (W / 2) as f64 + 1.0 - 0.5 * (s + 1.0))).collect();
        for level in 1..n {
            for k in (level..n).rev() {
                d[k] = (d[k] - d[k - 1]) / (nodes[k] - nodes[k - level]);
            }
        }
        let mut powers = vec![0.0; n];
        for k in (0..n).rev() {
            for p in (0..n).rev() {
                powers[p] = if p > 0 { powers[p - 1] } else { 0.0 } - nodes[k] * powers[p];
            }
            powers[0] += d[k];
        }
        for (p, v) in powers.iter().enumerate() {
            out[TERMS - 1 - p][c] = T::of(*v);
        }
    }
    out
}

/// Refines samples in θ: meridians over both poles are trigonometric polynomials.
struct Meridians<T: Real, const W: usize> {
    width: usize,
    height: usize,
    forward: std::sync::Arc<dyn rustfft::Fft<T>>,
    backward: std::sync::Arc<dyn rustfft::Fft<T>>,
    /// Of frequency k ≥ 0: from the first texel's centre to the pole, and what undoes the window.
    factors: Vec<Complex<T>>,
}

impl<T: Real, const W: usize> Meridians<T, W> {
    fn new(order: usize, width: usize, height: usize, spectrum: &WindowSpectrum) -> Self {
        let mut planner = FftPlanner::new();
        let n = 2 * height;
        let factor = |k: usize| {
            let size = (n as f64 * spectrum.at(k as f64 / (2 * n) as f64)).recip();
            let (sin, cos) = (PI * k as f64 / n as f64).sin_cos();
            Complex::new(T::of(size * cos), T::of(-size * sin))
        };
        Self {
            width,
            height,
            forward: planner.plan_fft_forward(n),
            backward: planner.plan_fft_inverse(2 * n),
            factors: (0..=order).map(factor).collect(),
        }
    }

    /// Rows −W … 2·height + W of θ = jπ/(2·height), each with a border.
    fn refine(&self, samples: &[T], stride: usize) -> Vec<T> {
        let (half, circle) = (self.width / 2, 4 * self.height);
        // Meridians of columns i and i + 1 as real and imaginary parts, [j][i] for all of the circle.
        let mut torus = vec![T::default(); circle * half];
        let columns: Vec<usize> = (0..half).step_by(SIDE).collect();
        let sides: Vec<Vec<Complex<T>>> =
            columns.par_iter().map(|&first| self.side(samples, first, (first + SIDE).min(half))).collect();
        torus.par_chunks_mut(ROWS * half).enumerate().for_each(|(block, rows)| {
            for (side, &first) in sides.iter().zip(&columns) {
                for (k, pair) in side.chunks_exact(circle).enumerate() {
                    let column = first + 2 * k;
                    let pair = &pair[block * ROWS..];
                    // `half` is even: the pair's second column is there.
                    for (row, z) in rows.chunks_exact_mut(half).zip(pair) {
                        row[column] = z.re;
                        row[column + 1] = z.im;
                    }
                }
            }
        });
        let rows = 2 * self.height + 1 + 2 * W;
        let mut out = vec![T::default(); rows * stride];
        out.par_chunks_mut(stride).enumerate().for_each(|(row, out)| {
            // Beyond half a turn of φ the circle is met on its way back.
            let j = (row + circle - W) % circle;
            let (there, back) = (&torus[j * half..][..half], &torus[(circle - j) % circle * half..][..half]);
            out[W..W + half].copy_from_slice(there);
            out[W + half..W + 2 * half].copy_from_slice(back);
            out.copy_within(2 * half..2 * half + W, 0);
            out.copy_within(W..2 * W, W + 2 * half);
        });
        out
    }

    /// Refined meridians of the columns first…last, two in one.
    fn side(&self, samples: &[T], first: usize, last: usize) -> Vec<Complex<T>> {
        let (n, circle, half) = (2 * self.height, 4 * self.height, self.width / 2);
        let zero = Complex::new(T::default(), T::default());
        let mut out = vec![zero; (last - first) / 2 * circle];
        let mut coarse = vec![zero; n];
        let scratch = self.forward.get_inplace_scratch_len().max(self.backward.get_inplace_scratch_len());
        let mut scratch = vec![zero; scratch];
        for (i, fine) in (first..last).step_by(2).zip(out.chunks_exact_mut(circle)) {
            let (there, back) = coarse.split_at_mut(self.height);
            let rows = samples.chunks_exact(self.width);
            for ((there, back), row) in there.iter_mut().zip(back.iter_mut().rev()).zip(rows) {
                *there = Complex::new(row[i], row[i + 1]);
                *back = Complex::new(row[i + half], row[i + half + 1]);
            }
            self.forward.process_with_scratch(&mut coarse, &mut scratch);
            for (k, factor) in self.factors.iter().enumerate() {
                fine[k] = coarse[k] * factor;
                if k > 0 {
                    fine[circle - k] = coarse[n - k] * factor.conj();
                }
            }
            self.backward.process_with_scratch(fine, &mut scratch);
        }
        out
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
    use crate::Layout;
    use crate::sh::rotation::exchange_yz;
    use crate::sh::{ShRgb, count};

    /// All energy in the highest bands is the worst case.
    fn noise(order: usize) -> ShRgb {
        let mut sh = ShRgb::zero(order);
        for (k, c) in sh.c.iter_mut().enumerate() {
            for (i, c) in c.iter_mut().enumerate() {
                *c = ((i * i + 3 * k) as f64).sin();
            }
        }
        sh.c[1][..order * order].fill(0.0);
        sh
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
            for error in [2e-3, 1e-5, 1e-6, 1e-10, 1e-13] {
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

    #[test]
    fn cube_angles_are_those_of_the_layout() {
        for size in [1, 2, 3, 7, 8] {
            let cube = CubeAngles::new(size);
            for face in 0..6 {
                for j in 0..size {
                    for i in 0..size {
                        let d = Layout::Cube.texel_direction(size, size, face, i, j).expect("a texel");
                        let ([a, b], [theta, phi]) = (cube.at(face, i, j), angles(d));
                        let turn = (b - phi) / (2.0 * PI);
                        let pole = d.x.hypot(d.z) < 1e-12;
                        assert!((a - theta).abs() < 1e-12, "{size} {face} {i} {j}: {a} {theta}");
                        assert!(
                            pole || (turn - turn.round()).abs() < 1e-12,
                            "{size} {face} {i} {j}: {b} {phi}"
                        );
                    }
                }
            }
        }
    }
}
