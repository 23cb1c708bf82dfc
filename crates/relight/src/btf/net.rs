//! The three directions around a given one, and their interpolation weights.
//!
//! Directions are seen in stereographic projection from below, p = (x, y)/(1 + z), which takes the hemisphere
//! to the unit disk and circles to circles, so that triangles with empty circumscribed circles are the same
//! there as on the sphere (Delaunay 1934; Bowyer 1981; Watson 1981). Weights are barycentric: continuous, and
//! 1 for a direction at itself. Around the horizon stands a ring of further corners, each of which has the
//! values of the direction nearest to it: between the last directions and the horizon values are constant.

use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// A triangle of directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangle {
    /// Its directions.
    pub corners: [u32; 3],
    /// The triangles across from them; itself where there is none.
    pub across: [u32; 3],
    /// The weights of the first two corners: w · (x, y, 1) of the projection.
    pub weights: [[f32; 3]; 2],
}

/// Triangles over the hemisphere.
#[derive(Debug, Clone, PartialEq)]
pub struct Net {
    /// The triangles.
    pub triangles: Vec<Triangle>,
    /// The triangle over the middle of each of [`Net::SIDE`]² cells of the square around the disk, rows from
    /// y = −1.
    pub starts: Vec<u32>,
}

/// Number of further corners around the horizon, and their distance from the centre of the disk: from 1.002
/// on their polygon covers it; at 1.35 they are two of their spacings off, so that triangles at the horizon
/// are no slivers.
const RING: (usize, f64) = (48, 1.35);
/// Displacement of projections, so that no four lie on a circle: far above the rounding of double precision,
/// below that of single, in which weights are kept.
const MOVED: f64 = 1e-8;
/// Most triangles that a search walks through.
pub const MOST_STEPS: usize = 64;

type Corners = [usize; 3];

fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Is `d` within the circle through the corners of a triangle that turns left?
fn encircled([a, b, c]: [DVec2; 3], d: DVec2) -> bool {
    let row = |p: DVec2| DVec3::new(p.x - d.x, p.y - d.y, (p - d).length_squared());
    row(a).dot(row(b).cross(row(c))) > 0.0
}

/// Delaunay's triangles of points within a few units of the origin.
fn delaunay(points: &[DVec2]) -> Vec<Corners> {
    // Circles through a far corner bulge from the straight line by chord²/(4 FAR_CORNER): 8e-7 between two
    // corners of [`RING`], so that no triangle at the border is lost.
    const FAR_CORNER: f64 = 1e4;
    let n = points.len();
    let mut p = points.to_vec();
    p.extend([
        DVec2::new(-2.0 * FAR_CORNER, -FAR_CORNER),
        DVec2::new(2.0 * FAR_CORNER, -FAR_CORNER),
        DVec2::new(0.0, 2.0 * FAR_CORNER),
    ]);
    let mut all: Vec<Corners> = vec![[n, n + 1, n + 2]];
    for k in 0..n {
        let mut edges: HashMap<(usize, usize), usize> = HashMap::new();
        let mut order = Vec::new();
        all.retain(|t| {
            if !encircled(t.map(|i| p[i]), p[k]) {
                return true;
            }
            for e in 0..3 {
                let edge = (t[e], t[(e + 1) % 3]);
                order.push(edge);
                *edges.entry((edge.0.min(edge.1), edge.0.max(edge.1))).or_default() += 1;
            }
            false
        });
        let outer = order.into_iter().filter(|(a, b)| edges[&(*a.min(b), *a.max(b))] == 1);
        all.extend(outer.map(|(a, b)| [a, b, k]));
    }
    all.retain(|t| t.iter().all(|i| *i < n));
    all
}

impl Net {
    /// Cells a side of [`Net::starts`].
    pub const SIDE: usize = 32;

    /// The net of unit directions above the surface.
    ///
    /// # Panics
    /// If there are none.
    pub fn new(directions: &[DVec3]) -> Self {
        assert!(!directions.is_empty(), "a direction at least");
        let mut points: Vec<DVec2> = directions.iter().map(|d| d.truncate() / (1.0 + d.z)).collect();
        let mut of: Vec<u32> = (0..directions.len() as u32).collect();
        for k in 0..RING.0 {
            let at = DVec2::from_angle(std::f64::consts::TAU * (k as f64 + 0.5) / RING.0 as f64);
            points.push(RING.1 * at);
            let along = |i: &u32| directions[*i as usize].truncate().dot(at);
            let better = |a: u32, b: u32| if along(&b) > along(&a) + 1e-9 { b } else { a };
            of.push((1..directions.len() as u32).fold(0, better));
        }
        for (k, p) in points.iter_mut().enumerate() {
            let angle = super::local::mixed(k as u64) as f64 / u64::MAX as f64 * std::f64::consts::TAU;
            *p += MOVED * DVec2::from_angle(angle);
        }
        let corners = delaunay(&points);
        let edges: HashMap<(usize, usize), usize> = corners
            .iter()
            .enumerate()
            .flat_map(|(t, c)| (0..3).map(move |e| ((c[e], c[(e + 1) % 3]), t)))
            .collect();
        let triangle = |(t, c): (usize, &Corners)| {
            let across = std::array::from_fn(|i| {
                let (a, b) = (c[(i + 1) % 3], c[(i + 2) % 3]);
                edges.get(&(b, a)).copied().unwrap_or(t) as u32
            });
            let q = c.map(|i| points[i]);
            let all = turn(q[0], q[1], q[2]);
            // turn(p, q1, q2)/all as a linear function of p.
            let weights = std::array::from_fn(|i| {
                let (a, b) = (q[(i + 1) % 3], q[(i + 2) % 3]);
                [(a.y - b.y) / all, (b.x - a.x) / all, a.perp_dot(b) / all].map(|x| x as f32)
            });
            Triangle { corners: c.map(|i| of[i]), across, weights }
        };
        let triangles: Vec<Triangle> = corners.iter().enumerate().map(triangle).collect();
        let mut net = Self { triangles, starts: Vec::new() };
        let middle = |k: usize| 2.0 * (k as f32 + 0.5) / Self::SIDE as f32 - 1.0;
        let least = |t: &Triangle, p: [f32; 2]| t.barycentric(p).into_iter().fold(f32::INFINITY, f32::min);
        net.starts = (0..Self::SIDE * Self::SIDE)
            .map(|k| {
                let p = [middle(k % Self::SIDE), middle(k / Self::SIDE)];
                let better = |a: usize, b: usize| {
                    if least(&net.triangles[b], p) > least(&net.triangles[a], p) { b } else { a }
                };
                (1..net.triangles.len()).fold(0, better) as u32
            })
            .collect();
        net
    }

    /// The directions around a unit direction above the surface, and their weights, which sum to 1.
    #[inline]
    pub fn around(&self, [x, y, z]: [f32; 3]) -> ([u32; 3], [f32; 3]) {
        let p = [x / (1.0 + z), y / (1.0 + z)];
        // Negative numbers and NaN become 0.
        let cell = |x: f32| ((0.5 * (x + 1.0) * Self::SIDE as f32) as usize).min(Self::SIDE - 1);
        let mut t = self.starts[cell(p[1]) * Self::SIDE + cell(p[0])] as usize;
        let mut w = self.triangles[t].barycentric(p);
        for _ in 0..MOST_STEPS {
            let mut least = 0;
            for i in 1..3 {
                if w[i] < w[least] {
                    least = i;
                }
            }
            let next = self.triangles[t].across[least] as usize;
            if w[least] >= 0.0 || next == t {
                break;
            }
            t = next;
            w = self.triangles[t].barycentric(p);
        }
        let w = w.map(|w| w.max(0.0));
        let all = w[0] + w[1] + w[2];
        (self.triangles[t].corners, w.map(|w| w / all))
    }
}

impl Triangle {
    /// Weights of the corners at a projection; one is negative outside.
    #[inline]
    fn barycentric(&self, [x, y]: [f32; 2]) -> [f32; 3] {
        let [a, b] = self.weights.map(|w| w[0] * x + w[1] * y + w[2]);
        [a, b, 1.0 - a - b]
    }
}
