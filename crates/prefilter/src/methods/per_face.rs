//! Each cube face filtered in its own plane, with its four neighbours folded flat around it.
//!
//! Kautz, course notes (2006), *How to filter a cube map*: "filter each face separately, surrounded by other
//! faces [Ashikhmin 2003] … there is no way to fill in the corners around the center face". One
//! shift-invariant kernel of texels, as graphics hardware convolves, stands for the kernel on the sphere; its
//! radius is right for the mean texel, too wide in the middle of a face (a texel there spans 2/N, the mean
//! √(4π/6)/N) and too narrow towards the corners. In the corners there are no texels to filter, and the sum
//! of the existing ones is divided by their weight; a box filter without that division would darken them.

use super::grid::each;
use super::table::Table;
use super::{Card, Cost, Made, Shape, reach};
use crate::{Sampled, Zonal};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_sphere::{Layout, SphereImage};

pub(super) const CARD: Card = Card {
    name: "per-face",
    source: "Ashikhmin & Ghosh 2002; Kautz, course notes, 2006",
    equation: "Σ K(|x − x_i| τ) L_i / Σ K(|x − x_i| τ) in the plane of a face, τ the mean texel's angle",
    exact_when: "the lobe narrows: wide ones meet the distortion of the faces and the missing corners",
};

/// Radius of the kernel in texels of the source.
pub(super) const TEXELS: usize = 12;
/// Part of the kernel beyond its radius.
const CUT: f64 = 2e-3;
/// A face is surrounded by at most one more.
const FARTHEST: f64 = 1.4;

/// Filters by planar convolution of each face; the kernel's radius is `texels` texels of the source.
pub fn per_face(
    light: &Sampled,
    kernel: &dyn Zonal,
    shape: Shape,
    texels: usize,
    task: &Task,
) -> Result<Made, Cancelled> {
    let k0 = kernel.coefficients(0)[0];
    let angle = reach(kernel, CUT).min(FARTHEST);
    let mean = (4.0 * PI / 6.0).sqrt();
    let n = ((texels as f64 * mean / angle).ceil() as usize).clamp(8, 2 * light.image.height);
    let texel = mean / n as f64;
    let radius = angle / texel;
    let cube = light.mirror(Layout::Cube, n, n);
    let faces: Vec<Face> = (0..6).map(|f| Face::unfold(&cube, f, radius.ceil() as usize + 1)).collect();
    let table = Table::new(kernel, angle);
    each(shape, "filtering face by face", task, |d| {
        let at = Layout::Cube.position(n, n, d);
        let (sum, weight, taps) = faces[at.face].sum(at.x, at.y, radius, texel, &table);
        let mean = |c: usize| if weight > 0.0 { sum[c] / weight } else { 0.0 };
        (std::array::from_fn(|c| k0 * mean(c)), Cost { kernel: taps, taps })
    })
}

/// A face with a border of its neighbours.
struct Face {
    border: usize,
    side: usize,
    /// r, g, b and 1, or 0 in the corners.
    texels: Vec<[f32; 4]>,
}

impl Face {
    fn unfold(cube: &SphereImage, face: usize, border: usize) -> Self {
        let n = cube.width;
        let border = border.min(n);
        let side = n + 2 * border;
        let texel = |k: usize| {
            let at = |k: usize| 2.0 * (k as f64 - border as f64 + 0.5) / n as f64 - 1.0;
            let Some(d) = folded(face, at(k % side), at(k / side)) else { return [0.0; 4] };
            let [r, g, b] = cube.nearest(d);
            [r, g, b, 1.0]
        };
        Self { border, side, texels: (0..side * side).map(texel).collect() }
    }

    /// Σ K L, Σ K and the number of texels within `radius` of (x, y), texels of the face.
    fn sum(&self, x: f64, y: f64, radius: f64, texel: f64, table: &Table) -> ([f64; 3], f64, u64) {
        let (x, y) = (x + self.border as f64 - 0.5, y + self.border as f64 - 0.5);
        let last = self.side - 1;
        let range =
            |a: f64, r: f64| ((a - r).ceil().max(0.0) as usize)..=((a + r).floor() as usize).min(last);
        let (mut sum, mut taps) = ([0.0; 4], 0);
        for j in range(y, radius) {
            let dy = j as f64 - y;
            let half = (radius * radius - dy * dy).max(0.0).sqrt();
            for i in range(x, half) {
                let distance2 = dy * dy + (i as f64 - x).powi(2);
                // The table goes by chords: sin²(θ/2) ≤ θ²/4 to second order.
                let theta2 = distance2 * texel * texel;
                let chord2 = theta2 * (1.0 - theta2 / 12.0 * (1.0 - theta2 / 30.0));
                let t = &self.texels[j * self.side + i];
                let k = table.at(chord2) * f64::from(t[3]);
                taps += 1;
                (0..3).for_each(|c| sum[c] += k * f64::from(t[c]));
                sum[3] += k;
            }
        }
        ([sum[0], sum[1], sum[2]], sum[3], taps)
    }
}

/// The direction at (s, t) of a face's plane, the neighbours folded flat into it; nothing in the corners.
fn folded(face: usize, s: f64, t: f64) -> Option<DVec3> {
    let at = |s: f64, t: f64| {
        // A point of the face's plane: the unit direction divided by its largest component.
        let p = steradian_sphere::layout::Position { face, x: 0.5 * (s + 1.0), y: 0.5 * (t + 1.0) };
        let d = Layout::Cube.direction(1, 1, p)?;
        Some(d / d.abs().max_element())
    };
    let beyond = |v: f64| (v.abs() - 1.0).max(0.0);
    let (u, v) = (beyond(s), beyond(t));
    if (u > 0.0 && v > 0.0) || u > 2.0 || v > 2.0 {
        return None;
    }
    let p = at(s.clamp(-1.0, 1.0), t.clamp(-1.0, 1.0))?;
    Some((p - (u + v) * at(0.0, 0.0)?).normalize())
}
