//! The light as a pyramid, in which parts that are small relative to the kernel are treated as points.
//!
//! Kautz, Vázquez, Heidrich & Seidel 2000, *A Unified Approach to Prefiltered Environment Maps*, filter on a
//! pyramid of the map and descend where the kernel varies over a texel of it. Here a node knows its flux, the
//! centroid of its radiance and its solid angle; it counts as a point where its radius is at most `opening`
//! times the angle over which the kernel varies there (its width, or half the distance in its tails). About
//! the centroid the first moment vanishes, so the error falls as opening².

use super::grid::each;
use super::table::Table;
use super::{Card, Cost, Made, Shape, reach};
use crate::light::sampled::{azimuth, small_lights_at};
use crate::{Sampled, Zonal};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;

pub(super) const CARD: Card = Card {
    name: "hierarchical",
    source: "Kautz, Vázquez, Heidrich & Seidel 2000",
    equation: "Σ Φ_n K(d·c_n) / Σ K Ω over the nodes of a pyramid that look like points",
    exact_when: "opening → 0",
};

/// The opening that gives a relative RMS error of about `tolerance`.
pub(super) fn opening(tolerance: f64) -> f64 {
    (4.0 * tolerance.sqrt()).min(1.0)
}

/// Filters by a pyramid of the light.
pub fn hierarchical(
    light: &Sampled,
    kernel: &dyn Zonal,
    shape: Shape,
    opening: f64,
    task: &Task,
) -> Result<Made, Cancelled> {
    let k0 = kernel.coefficients(0)[0];
    let pyramid = Pyramid::new(light);
    // The truncated tail falls as opening², like the rest of the error.
    let edge = reach(kernel, 2e-3 * opening * opening);
    let eye = Eye { table: Table::new(kernel, edge), width: kernel.width(), opening };
    each(shape, "filtering hierarchically", task, |d| {
        let suns = small_lights_at(light.suns(), kernel, d);
        let (sum, weight, cost) = pyramid.sum(&eye, d);
        let nearest = light.image.nearest(d).map(f64::from);
        let mean = |c: usize| if weight > 0.0 { sum[c] / weight } else { nearest[c] };
        (std::array::from_fn(|c| k0 * mean(c) + suns[c]), cost)
    })
}

/// The kernel, and the criterion by which nodes are opened.
struct Eye {
    table: Table,
    width: f64,
    opening: f64,
}

#[derive(Clone, Copy)]
struct Node {
    flux: [f64; 3],
    omega: f64,
    /// Centroids of the radiance and of the area, unit.
    light: Vec3,
    middle: Vec3,
    /// Chord from `light` that encloses the centres of its texels.
    radius: f32,
}

struct Level {
    width: usize,
    height: usize,
    nodes: Vec<Node>,
}

struct Pyramid {
    /// Texels first.
    levels: Vec<Level>,
}

impl Pyramid {
    fn new(light: &Sampled) -> Self {
        let image = &light.image;
        let (width, height) = (image.width, image.height);
        let columns: Vec<[f64; 2]> = (0..width).map(|i| azimuth(i, width)).collect();
        let texel = |k: usize| {
            let (i, j) = (k % width, k / width);
            let (s, c) = (PI * (j as f64 + 0.5) / height as f64).sin_cos();
            let at = DVec3::new(s * columns[i][0], c, s * columns[i][1]).as_vec3();
            let omega = image.layout.solid_angle(width, height, 0, i, j);
            let flux = [0, 1, 2].map(|c: usize| omega * f64::from(image.planes[c][k]));
            Node { flux, omega, light: at, middle: at, radius: 0.0 }
        };
        let mut levels =
            vec![Level { width, height, nodes: (0..width * height).into_par_iter().map(texel).collect() }];
        while let Some(next) = levels.last().and_then(Level::above) {
            levels.push(next);
        }
        Self { levels }
    }

    /// Σ L K Ω, Σ K Ω and the work.
    fn sum(&self, eye: &Eye, d: DVec3) -> ([f64; 3], f64, Cost) {
        let (mut sum, mut weight, mut cost) = ([0.0; 3], 0.0, Cost::default());
        let top = self.levels.len() - 1;
        let mut stack: Vec<(usize, usize)> = (0..self.levels[top].nodes.len()).map(|k| (top, k)).collect();
        let edge = eye.table.reach2.sqrt();
        while let Some((level, k)) = stack.pop() {
            let node = &self.levels[level].nodes[k];
            let chord2 = d.distance_squared(node.light.as_dvec3());
            let (chord, radius) = (chord2.sqrt(), f64::from(node.radius));
            if chord - radius > edge {
                continue;
            }
            if level > 0 && radius > eye.opening * eye.width.max(0.5 * chord) {
                stack.extend(self.levels[level].children(k, &self.levels[level - 1]).map(|k| (level - 1, k)));
                continue;
            }
            let bright = if chord2 < eye.table.reach2 { eye.table.at(chord2) } else { 0.0 };
            (0..3).for_each(|c| sum[c] += node.flux[c] * bright);
            let even =
                if level == 0 { bright } else { eye.value(d.distance_squared(node.middle.as_dvec3())) };
            weight += node.omega * even;
            cost = cost + Cost { kernel: 1 + u64::from(level > 0), taps: 1 };
        }
        (sum, weight, cost)
    }
}

impl Eye {
    fn value(&self, chord2: f64) -> f64 {
        if chord2 < self.table.reach2 { self.table.at(chord2) } else { 0.0 }
    }
}

impl Level {
    /// The next level, whose nodes are two by two of these; `None` where few are left.
    fn above(&self) -> Option<Self> {
        if self.width <= 4 && self.height <= 2 {
            return None;
        }
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let empty = Level { width, height, nodes: Vec::new() };
        let nodes =
            (0..width * height).into_par_iter().map(|k| self.merged(empty.children(k, self))).collect();
        Some(Self { nodes, ..empty })
    }

    /// Indices of the children of node `k` in the level `below`.
    fn children(&self, k: usize, below: &Level) -> impl Iterator<Item = usize> + Clone + use<> {
        let (i, j) = (2 * (k % self.width), 2 * (k / self.width));
        let (width, height) = (below.width, below.height);
        (0..4)
            .map(move |c| (i + c % 2, j + c / 2))
            .filter(move |&(i, j)| i < width && j < height)
            .map(move |(i, j)| j * width + i)
    }

    fn merged(&self, children: impl Iterator<Item = usize> + Clone) -> Node {
        let nodes = || children.clone().map(|k| &self.nodes[k]);
        let (mut flux, mut omega) = ([0.0; 3], 0.0);
        let (mut bright, mut even) = (DVec3::ZERO, DVec3::ZERO);
        for n in nodes() {
            (0..3).for_each(|c| flux[c] += n.flux[c]);
            omega += n.omega;
            bright += n.light.as_dvec3() * n.flux.iter().map(|f| f.abs()).sum::<f64>();
            even += n.middle.as_dvec3() * n.omega;
        }
        let middle = even.normalize_or(DVec3::Y).as_vec3();
        let light = if bright.length_squared() > 1e-60 { bright.normalize().as_vec3() } else { middle };
        let reach = |n: &Node| light.distance(n.light).max(light.distance(n.middle)) + n.radius;
        Node { flux, omega, light, middle, radius: nodes().map(reach).fold(0.0, f32::max) }
    }
}
