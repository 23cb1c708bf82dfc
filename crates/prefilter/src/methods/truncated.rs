//! The sum over the texels near a direction: the kernel is truncated where the part ε of it remains.
//!
//! Ramamoorthi & Hanrahan 2002, 5.6.4: of a Phong lobe all but ε lies within cos θ* = ε^{1/(s+1)}, which is
//! the part W = (1 − ε^{1/(s+1)})/2 of all texels (5.30), so the cost is W S_L² for each texel of the map
//! (5.32); ATI's CubeMapGen (2005) cuts so too. The truncated kernel is divided by its sum, else ε of the
//! light would be lost.

use super::grid::each;
use super::table::Table;
use super::{Card, Cost, Made, Shape, reach};
use crate::light::sampled::{azimuth, small_lights_at};
use crate::{Sampled, Zonal};
use glam::DVec3;
use std::f64::consts::PI;
use std::ops::Range;
use steradian_base::{Cancelled, Task};

pub(super) const CARD: Card = Card {
    name: "truncated-angular",
    source: "Ramamoorthi & Hanrahan 2002, 5.30; ATI CubeMapGen, 2005",
    equation: "Σ L K Ω / Σ K Ω over texels within θ*, ∫_{θ<θ*} K = (1 − ε) ∫K",
    exact_when: "ε → 0",
};

/// The sum over the texels within the angle that holds all but `epsilon` of the kernel.
pub fn truncated_angular(
    light: &Sampled,
    kernel: &dyn Zonal,
    shape: Shape,
    epsilon: f64,
    task: &Task,
) -> Result<Made, Cancelled> {
    let k0 = kernel.coefficients(0)[0];
    let near = Near::new(light, kernel, reach(kernel, epsilon));
    each(shape, "filtering by angle", task, |d| {
        let suns = small_lights_at(light.suns(), kernel, d);
        let (sum, weight, taps) = near.sum(d);
        let nearest = light.image.nearest(d).map(f64::from);
        let mean = |c: usize| if weight > 0.0 { sum[c] / weight } else { nearest[c] };
        (std::array::from_fn(|c| k0 * mean(c) + suns[c]), Cost { kernel: taps, taps })
    })
}

/// Kernel values at a time.
const RUN: usize = 32;

/// The light, with values that its rows and columns share computed once.
struct Near {
    width: usize,
    texels: Vec<[f32; 4]>,
    columns: Vec<[f64; 2]>,
    /// sin θ, cos θ and solid angle of each row's texels.
    rows: Vec<[f64; 3]>,
    table: Table,
    angle: f64,
}

impl Near {
    fn new(light: &Sampled, kernel: &dyn Zonal, angle: f64) -> Self {
        let image = &light.image;
        let (width, height) = (image.width, image.height);
        let [r, g, b] = &image.planes;
        let texels = r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b, 1.0]).collect();
        let row = |j: usize| {
            let (s, c) = (PI * (j as f64 + 0.5) / height as f64).sin_cos();
            [s, c, image.layout.solid_angle(width, height, 0, 0, j)]
        };
        let columns = (0..width).map(|i| azimuth(i, width)).collect();
        let rows = (0..height).map(row).collect();
        Self { width, texels, columns, rows, table: Table::new(kernel, angle), angle }
    }

    /// Σ L K Ω, Σ K Ω and the number of texels.
    fn sum(&self, d: DVec3) -> ([f64; 3], f64, u64) {
        let height = self.rows.len();
        let y = d.y.clamp(-1.0, 1.0).acos() / PI * height as f64 - 0.5;
        let reach = self.angle / PI * height as f64 + 1e-9;
        let first = (y - reach).ceil().max(0.0) as usize;
        let last = ((y + reach).floor().max(0.0) as usize).min(height - 1);
        let (mut all, mut taps) = ([0.0; 4], 0);
        let rho = d.x.hypot(d.z);
        let centre = (0.5 + d.z.atan2(d.x) / (2.0 * PI)) * self.width as f64 - 0.5;
        for j in first..=last {
            for span in self.spans(d.y, rho, centre, j) {
                taps += span.len() as u64;
                self.add(d, j, span, &mut all);
            }
        }
        ([all[0], all[1], all[2]], all[3], taps)
    }

    /// The columns of row `j` within reach of a direction (height `y`, distance `rho` from the axis) at
    /// column `centre`: up to two runs.
    fn spans(&self, y: f64, rho: f64, centre: f64, j: usize) -> [Range<usize>; 2] {
        let [s, c, _] = self.rows[j];
        let (width, w) = (self.width, self.width as f64);
        // chord² = (ρ − s)² + (y − c)² + 4 ρ s sin²(Δφ/2)
        let apart = (rho - s).powi(2) + (y - c).powi(2);
        let room = (self.table.reach2 - apart) / (4.0 * rho * s).max(1e-300);
        if room < 0.0 {
            return [0..0, 0..0];
        }
        let half = if room >= 1.0 { w } else { room.sqrt().asin() / PI * w };
        if 2.0 * half + 1.0 >= w {
            return [0..width, 0..0];
        }
        let (from, to) = ((centre - half).ceil() as i64, (centre + half).floor() as i64 + 1);
        let count = (to - from).max(0) as usize;
        let from = from.rem_euclid(width as i64) as usize;
        let end = from + count;
        [from..end.min(width), 0..end.saturating_sub(width)]
    }

    fn add(&self, d: DVec3, j: usize, span: Range<usize>, all: &mut [f64; 4]) {
        let [s, c, omega] = self.rows[j];
        let (a, x, z) = (2.0 - 2.0 * d.y * c, 2.0 * s * d.x, 2.0 * s * d.z);
        let texels = &self.texels[j * self.width..(j + 1) * self.width];
        let mut row = [0.0; 4];
        let mut kernel = [0.0; RUN];
        for (texels, columns) in texels[span.clone()].chunks(RUN).zip(self.columns[span].chunks(RUN)) {
            for (k, [cos, sin]) in kernel.iter_mut().zip(columns) {
                *k = self.table.at(a - x * cos - z * sin);
            }
            for (t, k) in texels.iter().zip(&kernel) {
                (0..4).for_each(|c| row[c] += k * f64::from(t[c]));
            }
        }
        (0..4).for_each(|c| all[c] += omega * row[c]);
    }
}
