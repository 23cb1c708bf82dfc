//! Disks and texels that are many times larger than the reflectance's lobe: rectangles in polar coordinates
//! about the disk's centre or the image's pole, cut until the reflectance varies little over each.

use super::rule::Cap;
use glam::DVec3;
use std::f64::consts::PI;

/// Nodes and weights on −1 … 1 of Gauss's rule of five points (Abramowitz & Stegun 1964, 25.4.30).
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];
/// A rectangle is cut while its larger side exceeds this many times the scale at it.
const FACTOR: f64 = 1.5;
/// Largest depth of subdivision: sides are halved in turn, so that twenty times each make 1e-6 of them.
const MAX_DEPTH: u32 = 40;
/// Rectangles beyond which none is subdivided: 5 million evaluations, at 25 nodes each.
const MAX_RECTANGLES: usize = 200_000;

/// θ and φ ranges.
#[derive(Clone, Copy)]
struct Rect {
    theta: [f64; 2],
    phi: [f64; 2],
    depth: u32,
}

impl Rect {
    fn halves(self) -> [Self; 2] {
        let cut = |[a, b]: [f64; 2]| [[a, 0.5 * (a + b)], [0.5 * (a + b), b]];
        let depth = self.depth + 1;
        if self.theta[1] - self.theta[0] > self.across() {
            cut(self.theta).map(|theta| Self { theta, depth, ..self })
        } else {
            cut(self.phi).map(|phi| Self { phi, depth, ..self })
        }
    }

    /// Arc length along the circle of latitude.
    fn across(&self) -> f64 {
        (self.phi[1] - self.phi[0]) * self.theta[1].min(0.5 * PI).sin()
    }
}

/// The domain of integration, in polar coordinates.
pub struct Patch<'a> {
    /// Angles from the axis.
    pub theta: [f64; 2],
    /// Four parts of the azimuth.
    pub phi: [[f64; 2]; 4],
    /// Approximate radius of the patch, radians.
    pub size: f64,
    /// The direction at θ and φ.
    pub at: &'a dyn Fn(f64, f64) -> DVec3,
}

/// Values of many directions.
pub type Many<'a> = &'a dyn Fn(&[DVec3], &mut [[f64; 3]]);

/// [`integrate`] over a cap.
pub fn cap(cap: &Cap, scale: &dyn Fn(DVec3, f64) -> f64, f: Many<'_>) -> [f64; 3] {
    let at = |theta: f64, phi: f64| cap.direction(2.0 * (0.5 * theta).sin().powi(2), phi);
    let phi = [0.0, 1.0, 2.0, 3.0].map(|k| [0.5 * PI * k, 0.5 * PI * (k + 1.0)]);
    integrate(&Patch { theta: [0.0, cap.radius], phi, size: cap.radius, at: &at }, scale, f)
}

/// ∫ f over the patch, where f varies over `scale(direction, radius)` within a radius of a direction. f may
/// jump or have a kink at the horizon z = 0: rectangles on it are cut to a hundredth of the patch.
pub fn integrate(patch: &Patch<'_>, scale: &dyn Fn(DVec3, f64) -> f64, f: Many<'_>) -> [f64; 3] {
    let at = patch.at;
    let mut open: Vec<Rect> =
        patch.phi.iter().map(|phi| Rect { theta: patch.theta, phi: *phi, depth: 0 }).collect();
    let mut sum = [0.0; 3];
    let mut done = 0;
    while let Some(r) = open.pop() {
        let size = (r.theta[1] - r.theta[0]).max(r.across());
        let middle = at(0.5 * (r.theta[0] + r.theta[1]), 0.5 * (r.phi[0] + r.phi[1]));
        let mut allowed = FACTOR * scale(middle, 0.7 * size);
        if middle.z.abs() < 0.7 * size {
            allowed = allowed.min(0.01 * patch.size);
        }
        if size > allowed && r.depth < MAX_DEPTH && done + open.len() < MAX_RECTANGLES {
            open.extend(r.halves());
            continue;
        }
        done += 1;
        let [half_t, half_p] = [r.theta, r.phi].map(|[a, b]| 0.5 * (b - a));
        let mut nodes = [DVec3::ZERO; GAUSS.len() * GAUSS.len()];
        let mut values = [[0.0; 3]; GAUSS.len() * GAUSS.len()];
        for (row, (x, _)) in nodes.chunks_exact_mut(GAUSS.len()).zip(GAUSS) {
            let theta = r.theta[0] + half_t * (1.0 + x);
            row.iter_mut().zip(GAUSS).for_each(|(d, (y, _))| *d = at(theta, r.phi[0] + half_p * (1.0 + y)));
        }
        f(&nodes, &mut values);
        for (row, (x, wx)) in values.chunks_exact(GAUSS.len()).zip(GAUSS) {
            let weight = wx * half_t * half_p * (r.theta[0] + half_t * (1.0 + x)).sin();
            for (v, (_, wy)) in row.iter().zip(GAUSS) {
                (0..3).for_each(|c| sum[c] += weight * wy * v[c]);
            }
        }
    }
    sum
}
