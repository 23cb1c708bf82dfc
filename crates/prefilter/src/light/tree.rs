//! The light as a hierarchy: exact integrals of the image's piecewise constant radiance against any function,
//! in which far or smooth parts of the light are merged.
//!
//! Texels are merged 2 × 2; a node knows its flux, the centroid of its radiance and its radius. A node is
//! used as a point where its radius is below [`Tree::OPENING`] times the angle over which the other factor
//! varies there, and else opened; texels are divided further. With centroids the error is of second order in
//! that part.

use crate::SmallLight;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_sphere::SphereImage;

/// Directions at which [`Tree::integrate_many`] evaluates at once.
const TOGETHER: usize = 128;
/// Most times that a texel is quartered.
const DEEPEST: usize = 12;
/// Most columns of divided images whose angles are kept, half a megabyte. Computed for each part they took 6
/// % of the techniques' conformance suite, most of whose lights are small.
const KEPT_COLUMNS: usize = 8192;

/// A lat-long image and its hierarchy.
pub struct Tree {
    width: usize,
    height: usize,
    planes: [Vec<f32>; 3],
    /// Of the image, and with its texels divided into 2 × 2, 4 × 4 … up to [`KEPT_COLUMNS`].
    divided: Vec<Divided>,
    levels: Vec<Level>,
    small_lights: Vec<SmallLight>,
}

/// The image with its texels divided into n × n.
struct Divided {
    /// [`azimuth`] of each column.
    columns: Vec<[f64; 2]>,
    /// [`row`] of each row.
    rows: Vec<[f64; 4]>,
}

impl Divided {
    fn new(width: usize, height: usize, n: usize) -> Self {
        let column = |i: usize| azimuth((i as f64 + 0.5) / n as f64, width);
        Self {
            columns: (0..width * n).map(column).collect(),
            rows: (0..height * n).map(|j| row(j, width, height, n)).collect(),
        }
    }
}

struct Level {
    width: usize,
    height: usize,
    nodes: Vec<Node>,
}

#[derive(Clone, Copy)]
struct Node {
    flux: [f64; 3],
    /// Centroid of |radiance|, unit.
    centre: Vec3,
    radius: f32,
}

impl Node {
    fn is_dark(&self) -> bool {
        let [r, g, b] = self.flux;
        r == 0.0 && g == 0.0 && b == 0.0
    }
}

/// Weight of a channel in a centroid.
fn weight(flux: [f64; 3]) -> f64 {
    flux.iter().map(|f| f.abs()).sum()
}

impl Tree {
    /// Radius over scale up to which a node counts as a point.
    pub const OPENING: f64 = 0.12;

    /// The hierarchy of a lat-long image (`None`: black) and of small lights in addition.
    pub fn new(
        image: Option<&SphereImage>,
        small_lights: &[SmallLight],
        task: &Task,
    ) -> Result<Self, Cancelled> {
        let black = SphereImage::new(steradian_sphere::Layout::LatLong, 2, 1);
        let image = image.unwrap_or(&black);
        let (width, height) = (image.width, image.height);
        let kept = |d: &usize| *d == 0 || width << d <= KEPT_COLUMNS;
        let divided = (0..=DEEPEST).take_while(kept).map(|d| Divided::new(width, height, 1 << d)).collect();
        let mut tree = Self {
            width,
            height,
            planes: image.planes.clone(),
            divided,
            levels: Vec::new(),
            small_lights: small_lights.to_vec(),
        };
        let (mut w, mut h) = (width, height);
        while w > 4 || h > 2 {
            task.check()?;
            (w, h) = (w.div_ceil(2), h.div_ceil(2));
            let below = tree.levels.len();
            let nodes = (0..h).into_par_iter().flat_map_iter(|j| {
                let tree = &tree;
                (0..w).map(move |i| tree.merged(below, i, j))
            });
            let nodes = nodes.collect();
            tree.levels.push(Level { width: w, height: h, nodes });
        }
        Ok(tree)
    }

    /// Node (i, j) of level `k` (0: texels).
    #[inline(always)]
    fn node(&self, k: usize, i: usize, j: usize) -> Node {
        if k > 0 {
            let l = &self.levels[k - 1];
            return l.nodes[j * l.width + i];
        }
        let ([s, c, omega, radius], [cos, sin]) = (self.divided[0].rows[j], self.divided[0].columns[i]);
        let k = j * self.width + i;
        Node {
            flux: self.flux(k, omega),
            centre: DVec3::new(s * cos, c, s * sin).as_vec3(),
            radius: radius as f32,
        }
    }

    #[inline(always)]
    fn flux(&self, k: usize, omega: f64) -> [f64; 3] {
        let [r, g, b] = &self.planes;
        [f64::from(r[k]) * omega, f64::from(g[k]) * omega, f64::from(b[k]) * omega]
    }

    fn size(&self, k: usize) -> (usize, usize) {
        if k == 0 { (self.width, self.height) } else { (self.levels[k - 1].width, self.levels[k - 1].height) }
    }

    /// Part (i, j) of the image with its texels quartered `depth` times.
    fn part(&self, depth: usize, i: usize, j: usize) -> Node {
        let n = 1 << depth;
        let ([s, c, omega, radius], [cos, sin]) = match self.divided.get(depth) {
            Some(d) => (d.rows[j], d.columns[i]),
            None => (row(j, self.width, self.height, n), azimuth((i as f64 + 0.5) / n as f64, self.width)),
        };
        let k = (j >> depth) * self.width + (i >> depth);
        Node {
            flux: self.flux(k, omega),
            centre: DVec3::new(s * cos, c, s * sin).as_vec3(),
            radius: radius as f32,
        }
    }

    fn merged(&self, below: usize, i: usize, j: usize) -> Node {
        let (w, h) = self.size(below);
        let mut children = [None; 4];
        for (k, c) in children.iter_mut().enumerate() {
            let (i, j) = (2 * i + k % 2, 2 * j + k / 2);
            *c = (i < w && j < h).then(|| self.node(below, i, j));
        }
        let there = || children.iter().flatten();
        let mut flux = [0.0; 3];
        let mut moment = DVec3::ZERO;
        for n in there() {
            (0..3).for_each(|c| flux[c] += n.flux[c]);
            moment += n.centre.as_dvec3() * weight(n.flux);
        }
        if moment.length_squared() < 1e-60 {
            moment = there().map(|n| n.centre.as_dvec3()).sum();
        }
        let centre = moment.normalize_or(DVec3::Y).as_vec3();
        let reach = |n: &Node| centre.distance(n.centre).clamp(0.0, 2.0) + n.radius;
        Node { flux, centre, radius: there().map(reach).fold(0.0, f32::max) }
    }

    /// ∫ L(d) f(d) dω, where `f` varies over angles of about `scale(d)` around d. `scale` returns infinity
    /// where f is zero for all directions within the second argument (radians) of d.
    pub fn integrate(&self, scale: impl Fn(DVec3, f64) -> f64, f: impl Fn(DVec3) -> [f64; 3]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        self.visit(&scale, |flux, d| {
            let v = f(d);
            (0..3).for_each(|c| sum[c] += flux[c] * v[c]);
        });
        for b in &self.small_lights {
            let v = b.mean(scale(b.direction, b.radius), &f);
            (0..3).for_each(|c| sum[c] += b.flux[c] * v[c]);
        }
        sum
    }

    /// [`Tree::integrate`] of a function of many directions at a time, which `f` may overwrite. `bound` must
    /// be infinite where `scale` is; elsewhere only whether it is at least the radius over [`Tree::OPENING`]
    /// matters.
    pub fn integrate_many(
        &self,
        bound: impl Fn(DVec3, f64) -> f64,
        scale: impl Fn(DVec3, f64) -> f64,
        f: impl Fn(&mut [DVec3], &mut [[f64; 3]]),
    ) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let mut add = |fluxes: &[[f64; 3]], at: &mut [DVec3]| {
            let mut values = [[0.0; 3]; TOGETHER];
            f(at, &mut values[..at.len()]);
            for (flux, v) in fluxes.iter().zip(&values) {
                (0..3).for_each(|c| sum[c] += flux[c] * v[c]);
            }
        };
        let (mut fluxes, mut at, mut n) = ([[0.0; 3]; TOGETHER], [DVec3::ZERO; TOGETHER], 0);
        self.visit(&bound, |flux, d| {
            (fluxes[n], at[n]) = (flux, d);
            n += 1;
            if n == TOGETHER {
                add(&fluxes, &mut at);
                n = 0;
            }
        });
        add(&fluxes[..n], &mut at[..n]);
        for b in &self.small_lights {
            let v = b.mean(scale(b.direction, b.radius), |d| {
                let mut v = [[0.0; 3]];
                f(&mut [d], &mut v);
                v[0]
            });
            (0..3).for_each(|c| sum[c] += b.flux[c] * v[c]);
        }
        sum
    }

    /// The brightest parts that hold at least `share` of all flux within an angle of about `radius`, at most
    /// `most` of them: suns, lamps, and parts of windows. Each is returned as its direction and its part of
    /// all flux.
    pub fn peaks(&self, radius: f64, share: f64, most: usize) -> Vec<(DVec3, f64)> {
        let mut parts: Vec<(DVec3, f64)> =
            self.small_lights.iter().map(|b| (b.direction, weight(b.flux))).collect();
        self.visit(|_, _| radius / Self::OPENING, |flux, d| parts.push((d, weight(flux))));
        let all: f64 = parts.iter().map(|p| p.1).sum();
        parts.retain(|p| p.1 >= share * all && p.1 > 0.0);
        parts.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut out: Vec<(DVec3, f64)> = Vec::new();
        for (d, flux) in parts {
            let near = out.iter_mut().find(|p| p.0.angle_between(d) < radius);
            if let Some(peak) = near {
                peak.1 += flux / all;
            } else if out.len() < most {
                out.push((d, flux / all));
            }
        }
        out
    }

    /// Visits the light of the image in parts, as flux and direction each: small relative to `scale` there,
    /// as in [`Tree::integrate`].
    pub fn visit(&self, scale: impl Fn(DVec3, f64) -> f64, mut add: impl FnMut([f64; 3], DVec3)) {
        let top = self.levels.len();
        let (w, h) = self.size(top);
        let mut stack: Vec<(usize, usize, usize)> = Vec::with_capacity(64);
        stack.extend((0..w * h).map(|k| (top, k % w, k / w)));
        while let Some((k, i, j)) = stack.pop() {
            let node = self.node(k, i, j);
            let centre = unit(node.centre);
            let radius = f64::from(node.radius);
            if node.is_dark() {
                continue;
            }
            let s = scale(centre, radius);
            if s.is_infinite() {
                continue;
            }
            if radius <= Self::OPENING * s {
                add(node.flux, centre);
            } else if k > 0 {
                let (w, h) = self.size(k - 1);
                for c in 0..4 {
                    let (i, j) = (2 * i + c % 2, 2 * j + c / 2);
                    if i < w && j < h {
                        stack.push((k - 1, i, j));
                    }
                }
            } else {
                self.divide(i, j, &scale, &mut add);
            }
        }
    }

    /// Divides texel (i, j) into quarters of quarters, down to parts that are small relative to `scale`
    /// there.
    fn divide(
        &self,
        i: usize,
        j: usize,
        scale: &impl Fn(DVec3, f64) -> f64,
        add: &mut impl FnMut([f64; 3], DVec3),
    ) {
        let mut stack = Vec::with_capacity(3 * DEEPEST + 4);
        for q in 0..4 {
            stack.push((1, 2 * i + q % 2, 2 * j + q / 2));
        }
        while let Some((depth, i, j)) = stack.pop() {
            let part = self.part(depth, i, j);
            let (centre, radius) = (unit(part.centre), f64::from(part.radius));
            let s = scale(centre, radius);
            if s.is_infinite() {
                continue;
            }
            if radius <= Self::OPENING * s || depth == DEEPEST {
                add(part.flux, centre);
            } else {
                for q in 0..4 {
                    stack.push((depth + 1, 2 * i + q % 2, 2 * j + q / 2));
                }
            }
        }
    }
}

/// A unit vector of single precision with its length corrected.
#[inline]
fn unit(v: Vec3) -> DVec3 {
    let v = v.as_dvec3();
    v * (1.5 - 0.5 * v.length_squared())
}

/// sin θ, cos θ, solid angle and radius of the parts in row `j` of the image with its texels divided into n ×
/// n.
fn row(j: usize, width: usize, height: usize, n: usize) -> [f64; 4] {
    let step = PI / (height * n) as f64;
    let (s, c) = ((j as f64 + 0.5) * step).sin_cos();
    let omega = 2.0 * s * (0.5 * step).sin() * 2.0 * PI / (width * n) as f64;
    [s, c, omega, (0.5 * step).hypot(PI / (width * n) as f64 * s)]
}

/// cos φ and sin φ of column coordinate x: u = 0.5 + φ/2π.
fn azimuth(x: f64, width: usize) -> [f64; 2] {
    let phi = 2.0 * PI * x / width as f64 - PI;
    [phi.cos(), phi.sin()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_sphere::Layout;

    fn image() -> SphereImage {
        SphereImage::from_fn(Layout::LatLong, 37, 19, |d| {
            [1.0 + d.x as f32, (3.0 * d.y).exp() as f32, if d.z > 0.9 { 50.0 } else { 0.1 }]
        })
    }

    #[test]
    fn a_constant_integrand_gives_the_integral() {
        let image = image();
        let tree = Tree::new(Some(&image), &[], &Task::quiet()).unwrap();
        let all = tree.integrate(|_, _| 1e9, |_| [1.0; 3]);
        for (a, b) in all.iter().zip(image.integral()) {
            assert!((a - b).abs() < 1e-6 * b, "{a} {b}");
        }
    }

    /// A lamp of the image and a sun, the brighter first, with their parts of all flux; nothing in even
    /// light.
    #[test]
    fn peaks_are_what_is_bright_and_small() {
        let lamp = DVec3::new(0.3, 0.5, -0.8).normalize();
        let image = |bright: f32| {
            SphereImage::from_fn(Layout::LatLong, 256, 128, |d| {
                [if d.angle_between(lamp) < 0.03 { bright } else { 0.5 }; 3]
            })
        };
        let sun = SmallLight { direction: DVec3::Y, radius: 0.005, flux: [4.0; 3], cell: None };
        let tree = Tree::new(Some(&image(200.0)), &[sun], &Task::quiet()).unwrap();
        let peaks = tree.peaks(0.1, 2e-3, 9);
        let flux: f64 = image(200.0).integral()[0];
        assert_eq!(peaks.len(), 2, "{peaks:?}");
        assert!(peaks[0].0 == DVec3::Y && (peaks[0].1 - 4.0 / (flux + 4.0)).abs() < 0.02, "{peaks:?}");
        assert!(peaks[1].0.angle_between(lamp) < 0.02, "{peaks:?}");
        assert!((peaks[1].1 - 200.0 * PI * 9e-4 / (flux + 4.0)).abs() < 0.01, "{peaks:?}");
        let even = Tree::new(Some(&image(0.5)), &[], &Task::quiet()).unwrap();
        assert!(even.peaks(0.02, 2e-3, 9).is_empty());
    }

    #[test]
    fn many_directions_at_a_time_give_the_bits_of_one() {
        let image = image();
        let sun = SmallLight { direction: DVec3::Y, radius: 0.1, flux: [4.0, 1.0, 0.0], cell: None };
        let tree = Tree::new(Some(&image), &[sun], &Task::quiet()).unwrap();
        let axis = DVec3::new(0.3, 0.5, -0.8).normalize();
        let scale = |d: DVec3, radius: f64| {
            if axis.dot(d) < -0.5 { f64::INFINITY } else { (0.5 * axis.distance(d)).max(0.05 + 0.0 * radius) }
        };
        let f = |d: DVec3| [d.x, (3.0 * axis.dot(d)).exp(), 1.0];
        let one = tree.integrate(scale, f);
        let many = tree.integrate_many(scale, scale, |at, out| {
            out.iter_mut().zip(&*at).for_each(|(out, d)| *out = f(*d));
            at.fill(DVec3::ZERO);
        });
        assert_eq!(one.map(f64::to_bits), many.map(f64::to_bits));
    }

    #[test]
    fn kernels_meet_brute_force_on_a_finer_image() {
        use crate::{GgxMirror, angular};
        let image = image();
        let tree = Tree::new(Some(&image), &[], &Task::quiet()).unwrap();
        // The piecewise constant function with each texel divided into 8 × 8.
        let fine = SphereImage::from_fn(Layout::LatLong, 37 * 8, 19 * 8, |d| image.nearest(d));
        for alpha in [0.1, 0.5] {
            let kernel = GgxMirror::new(alpha);
            for d in [DVec3::Y, DVec3::new(0.1, 0.2, 0.9), DVec3::new(-1.0, 0.2, 0.1)] {
                let d = d.normalize();
                let a = angular::convolve_at(&tree, &kernel, d);
                let b = angular::brute_force(&fine, &kernel, d);
                for c in 0..3 {
                    assert!((a[c] - b[c]).abs() < 1.5e-3 * b[c], "alpha {alpha}, {d}: {a:?} {b:?}");
                }
            }
        }
    }

    /// However sharp the kernel, a constant is preserved, and inside a texel the result is its value.
    #[test]
    fn a_texel_seen_by_a_needle_is_its_value() {
        use crate::{Lobe, angular};
        let image = SphereImage::from_fn(Layout::LatLong, 32, 16, |d| {
            [1.0, if d.x > 0.0 { 2.0 } else { 1.0 }, if d.z > 0.9 { 50.0 } else { 0.1 }]
        });
        let tree = Tree::new(Some(&image), &[], &Task::quiet()).unwrap();
        for alpha in [1e-4, 1e-3, 0.01] {
            let kernel = Lobe::ggx(alpha);
            for k in 0..40 {
                let d = crate::probe::direction(k, 40);
                let got = angular::convolve_at(&tree, &kernel, d)[0];
                assert!((got - 1.0).abs() < 2e-3, "alpha {alpha}, {d}: {got}");
            }
        }
        let centre = image.layout.texel_direction(32, 16, 0, 20, 5).unwrap();
        let got = angular::convolve_at(&tree, &Lobe::gaussian(1e-3), centre);
        for (got, l) in got.iter().zip(image.nearest(centre)) {
            assert!((got / f64::from(l) - 1.0).abs() < 2e-3, "{got} {l}");
        }
    }
}
