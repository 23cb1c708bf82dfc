//! From coefficients about the pole y to images in any layout.
//!
//! Lat-long images by the transform itself. Others are read from a lat-long grid of twice the needed samples with the
//! regularised sinc of Kircheis, Potts & Tasche 2022, "On regularized Shannon sampling formulas with localized
//! sampling" (their sinh-type window, as in [`steradian_sphere::sh::synthesize`]), whose error is e^−β of the
//! neighbourhood's range, β = mπ/2 for 2m samples a side: here in single precision, with tabulated weights.

use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::OnceLock;
use steradian_simd::{Arch, Kernel, run};
use steradian_sphere::sh::{Grid, ShRgb, ShTransform};
use steradian_sphere::{Layout, SphereImage};

/// Samples a side: e^−4π = 3.5e-6.
const USUAL: usize = 16;
/// Samples a side where the tolerance asks for more: e^−6π = 7e-9.
const PRECISE: usize = 24;
/// Tolerance below which it does.
const STRICT: f64 = 1e-4;
/// Steps of a sample's width at which weights are tabulated: linear between them, to 4e-7.
const STEPS: usize = 1024;

/// The function of `sh` at every texel centre, times `scale(θ)`.
pub(crate) fn synthesize(
    sh: &ShRgb,
    (layout, width, height): (Layout, usize, usize),
    tolerance: f64,
    scale: impl Fn(f64) -> f64 + Sync,
) -> SphereImage {
    let mut image = SphereImage::new(layout, width, height);
    if image.planes[0].is_empty() {
        return image;
    }
    if layout == Layout::LatLong {
        let plan = ShTransform::new(sh.order, width, height, Grid::Equirectangular);
        plan.synthesize_polar(sh, image.planes.each_mut().map(Vec::as_mut_slice));
        let factor = |j: usize| scale(PI * (j as f64 + 0.5) / height as f64) as f32;
        for plane in &mut image.planes {
            let rows = plane.par_chunks_mut(width).enumerate();
            rows.for_each(|(j, row)| row.iter_mut().for_each(|v| *v *= factor(j)));
        }
    } else if tolerance < STRICT {
        Fine::<PRECISE>::new(sh).fill(&mut image, scale);
    } else {
        Fine::<USUAL>::new(sh).fill(&mut image, scale);
    }
    image
}

/// A function on a grid twice as dense as its band needs, with a border as wide as the interpolation's reach.
struct Fine<const T: usize> {
    width: usize,
    height: usize,
    planes: [Vec<f32>; 3],
}

impl<const T: usize> Fine<T> {
    fn new(sh: &ShRgb) -> Self {
        let height = smooth(2 * (sh.order + 1)).max(T);
        let width = 2 * height;
        let mut inner: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; width * height]);
        let plan = ShTransform::new(sh.order, width, height, Grid::Equirectangular);
        plan.synthesize_polar(sh, inner.each_mut().map(Vec::as_mut_slice));
        let stride = width + 2 * T;
        let planes = inner.map(|p| {
            let mut out = vec![0.0; stride * (height + 2 * T)];
            out.par_chunks_mut(stride).enumerate().for_each(|(j, row)| {
                // Beyond a pole the meridian continues on the other side.
                let (j, shift) = match j {
                    _ if j < T => (T - 1 - j, width / 2),
                    _ if j >= height + T => (2 * height + T - 1 - j, width / 2),
                    _ => (j - T, 0),
                };
                let from = &p[j * width..(j + 1) * width];
                row.iter_mut().enumerate().for_each(|(i, v)| *v = from[(i + shift + width - T) % width]);
            });
            out
        });
        Self { width, height, planes }
    }

    fn fill(&self, image: &mut SphereImage, scale: impl Fn(f64) -> f64 + Sync) {
        let (layout, width, height) = (image.layout, image.width, image.height);
        let table = table::<T>();
        let (cube, scale) = ((layout == Layout::Cube).then(|| CubeAngles::new(width)), &scale);
        let [r, g, b] = image.planes.each_mut().map(|p| p.par_chunks_mut(width));
        r.zip(g).zip(b).enumerate().for_each_init(Vec::new, |places: &mut Vec<Place>, (row, ((r, g), b))| {
            let (face, j) = (row / height, row % height);
            places.clear();
            places.extend((0..width).map(|i| {
                let angles = match &cube {
                    Some(cube) => Some(cube.at(face, i, j)),
                    None => {
                        let d = layout.texel_direction(width, height, face, i, j);
                        d.map(|d| [d.x.hypot(d.z).atan2(d.y), d.z.atan2(d.x)])
                    }
                };
                angles.map_or(Place::default(), |[theta, phi]| self.place(theta, phi, scale(theta)))
            }));
            run(Row { fine: self, table, places, out: [r, g, b] });
        });
    }

    fn place(&self, theta: f64, phi: f64, scale: f64) -> Place {
        let y = theta / PI * self.height as f64 - 0.5;
        let x = (0.5 + phi / (2.0 * PI)) * self.width as f64 - 0.5;
        // The first sample is T/2 − 1 before the place.
        let first = |v: f64| (v.floor() + (T / 2 + 1) as f64) as usize;
        let (i, j) = (first(x).min(self.width + T), first(y).min(self.height + T));
        Place {
            start: j * (self.width + 2 * T) + i,
            x: (x - x.floor()) as f32,
            y: (y - y.floor()) as f32,
            scale: scale as f32,
        }
    }
}

/// The smallest even number from `n` without prime factors above 5.
fn smooth(n: usize) -> usize {
    let rest = |mut n: usize| {
        for p in [2, 3, 5] {
            while n.is_multiple_of(p) {
                n /= p;
            }
        }
        n
    };
    (n..).find(|&n| n.is_multiple_of(2) && rest(n) == 1).unwrap_or(n)
}

/// Where a texel reads: its first sample, how far beyond a sample it is in x and y, and a factor.
#[derive(Clone, Copy, Default)]
struct Place {
    start: usize,
    x: f32,
    y: f32,
    scale: f32,
}

/// Weights at every step, their sum 1.
type Table<const T: usize> = Vec<[f32; T]>;

fn table<const T: usize>() -> &'static [[f32; T]] {
    static USUAL_TABLE: OnceLock<Table<USUAL>> = OnceLock::new();
    static PRECISE_TABLE: OnceLock<Table<PRECISE>> = OnceLock::new();
    let usual = || USUAL_TABLE.get_or_init(weights::<USUAL>).as_flattened();
    let flat =
        if T == USUAL { usual() } else { PRECISE_TABLE.get_or_init(weights::<PRECISE>).as_flattened() };
    flat.as_chunks::<T>().0
}

fn weights<const T: usize>() -> Table<T> {
    let half = (T / 2) as f64;
    let beta = half * FRAC_PI_2;
    let weight = |u: f64| {
        let sinc = if u == 0.0 { 1.0 } else { (PI * u).sin() / (PI * u) };
        let inside = (1.0 - (u / half).powi(2)).max(0.0).sqrt();
        sinc * (beta * inside).sinh() / beta.sinh()
    };
    let step = |k: usize| {
        let t = k as f64 / STEPS as f64;
        let w: [f64; T] = std::array::from_fn(|i| weight(t + half - 1.0 - i as f64));
        let sum: f64 = w.iter().sum();
        w.map(|w| (w / sum) as f32)
    };
    (0..=STEPS).map(step).collect()
}

/// Interpolates a row of texels.
struct Row<'a, const T: usize> {
    fine: &'a Fine<T>,
    table: &'a [[f32; T]],
    places: &'a [Place],
    out: [&'a mut [f32]; 3],
}

impl<const T: usize> Row<'_, T> {
    #[inline(always)]
    fn weights(&self, t: f32) -> [f32; T] {
        let at = t * STEPS as f32;
        let k = (at as usize).min(STEPS - 1);
        let (a, b, f) = (&self.table[k], &self.table[k + 1], at - k as f32);
        std::array::from_fn(|i| a[i] + (b[i] - a[i]) * f)
    }
}

impl<const T: usize> Kernel for Row<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let stride = self.fine.width + 2 * T;
        for (k, p) in self.places.iter().enumerate() {
            let (wx, wy) = (self.weights(p.x), self.weights(p.y));
            // Named apart and made of whole arrays: that stays in registers.
            let [red, green, blue] = &self.fine.planes;
            let (mut r, mut g, mut b) = ([0.0_f32; T], [0.0_f32; T], [0.0_f32; T]);
            for (j, w) in wy.iter().enumerate() {
                let at = p.start + j * stride;
                add(&mut r, *w, taps(red, at));
                add(&mut g, *w, taps(green, at));
                add(&mut b, *w, taps(blue, at));
            }
            for (c, sum) in [r, g, b].iter().enumerate() {
                self.out[c][k] = p.scale * dot(&wx, sum);
            }
        }
    }
}

/// Samples from `at` on.
#[inline(always)]
fn taps<const T: usize>(plane: &[f32], at: usize) -> &[f32; T] {
    plane[at..].first_chunk().expect("the border is as wide as the interpolation's reach")
}

#[inline(always)]
fn add<const T: usize>(sum: &mut [f32; T], w: f32, taps: &[f32; T]) {
    for i in 0..T {
        sum[i] += w * taps[i];
    }
}

#[inline(always)]
fn dot<const T: usize>(a: &[f32; T], b: &[f32; T]) -> f32 {
    let mut all = [0.0_f32; 8];
    for i in 0..T {
        all[i % 8] += a[i] * b[i];
    }
    ((all[0] + all[4]) + (all[1] + all[5])) + ((all[2] + all[6]) + (all[3] + all[7]))
}

/// θ and φ at the texel centres of a cube: the upright faces share theirs, and top and bottom.
struct CubeAngles {
    n: usize,
    /// θ on an upright face.
    upright: Vec<f64>,
    /// atan s of the columns.
    turn: Vec<f64>,
    /// θ and φ on the top face.
    top: Vec<[f64; 2]>,
}

impl CubeAngles {
    fn new(n: usize) -> Self {
        let at = |k: usize| (2 * k + 1) as f64 / n as f64 - 1.0;
        let upright = |k: usize| {
            let (s, t) = (at(k % n), at(k / n));
            (1.0 + s * s).sqrt().atan2(-t)
        };
        let top = |k: usize| {
            let (s, t) = (at(k % n), at(k / n));
            [s.hypot(t).atan(), t.atan2(s)]
        };
        let all = |m: usize| (0..m).into_par_iter().with_min_len(1024);
        Self {
            n,
            upright: all(n * n).map(upright).collect(),
            turn: (0..n).map(|k| at(k).atan()).collect(),
            top: all(n * n).map(top).collect(),
        }
    }

    /// θ, and φ within a turn of −π … π.
    fn at(&self, face: usize, i: usize, j: usize) -> [f64; 2] {
        let upright = |middle: f64| {
            let phi = middle - self.turn[i];
            [self.upright[j * self.n + i], if phi > PI { phi - 2.0 * PI } else { phi }]
        };
        let [theta, phi] = self.top[j * self.n + i];
        match face {
            0 => upright(0.0),
            1 => upright(PI),
            2 => [theta, phi],
            3 => [PI - theta, -phi],
            4 => upright(FRAC_PI_2),
            _ => upright(-FRAC_PI_2),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polar;
    use steradian_sphere::sh;

    /// All energy in the highest band is the worst case.
    #[test]
    fn every_layout_holds_the_function() {
        for order in [0, 3, 20, 77] {
            let mut sh = ShRgb::zero(order);
            for (k, c) in sh.c.iter_mut().flatten().enumerate() {
                *c = ((k * k + 1) as f64).sin();
            }
            let world = polar::to_world(&sh);
            for (tolerance, close) in [(1e-3, 2e-5), (1e-6, 1e-6)] {
                for shape in [(Layout::Cube, 9, 9), (Layout::LatLong, 24, 12), (Layout::Octahedral, 8, 8)] {
                    let got = synthesize(&sh, shape, tolerance, |_| 2.0);
                    let exact = sh::synthesize_direct(&world, shape.0, shape.1, shape.2);
                    let peak = exact.planes[0].iter().fold(0.0_f32, |m, v| m.max(v.abs()));
                    for (a, b) in got.planes.iter().flatten().zip(exact.planes.iter().flatten()) {
                        assert!((0.5 * a - b).abs() <= close * peak, "{order} {shape:?}: {a} {b} of {peak}");
                    }
                }
            }
        }
    }

    #[test]
    fn angles_are_those_of_the_directions() {
        let angles = CubeAngles::new(5);
        for face in 0..6 {
            for k in 0..25 {
                let d = Layout::Cube.texel_direction(5, 5, face, k % 5, k / 5).unwrap();
                let [theta, phi] = angles.at(face, k % 5, k / 5);
                assert!((theta.cos() - d.y).abs() < 1e-12);
                let r = theta.sin();
                assert!(
                    (r * phi.cos() - d.x).abs() < 1e-12 && (r * phi.sin() - d.z).abs() < 1e-12,
                    "{face} {k}"
                );
            }
        }
    }
}
