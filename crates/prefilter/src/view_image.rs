//! The exact outgoing radiance of any isotropic reflectance, seen along one view: STAR04 eq. 32.
//!
//! With the reflectance's coefficients g_lm(θ_v) ([`Slices`]) and the light's coefficients L_lm in the frame
//! of the direction to the viewer,
//!
//! > **L_o(n(θ_v, β)) = Σ_m Σ_l g_lm(θ_v) (L_lm cos mβ + L_l,−m sin mβ)**, m = 0 … F
//!
//! (Ramamoorthi & Hanrahan 2002, eqs 5.8–5.10 with the view in place of the reflection as centre, where φ_o
//! needs no expansion.) Each view costs one rotation of the light's coefficients and a sum over l per
//! elevation.

use glam::{DMat3, DVec3};
use std::f64::consts::PI;
use steradian_brdf::views::Slices;
use steradian_sphere::sh::{Rotation, ShRgb, index};

/// A frame whose z axis is `view`.
fn frame(view: DVec3) -> DMat3 {
    let f = steradian_sphere::Frame::from_normal(view);
    DMat3::from_cols(f.t, f.b, f.n)
}

/// L_o towards one viewer as a Fourier series in the azimuth of the normal, for every elevation of the
/// slices.
pub struct ViewImage {
    order: usize,
    intervals: usize,
    /// Columns x, y, wo.
    frame: DMat3,
    /// Per elevation and m: cosine r, g, b, sine r, g, b.
    rows: Vec<[f64; 6]>,
}

/// A direction about the view: the normal's elevation in intervals of the slices, and (cos β, sin β).
struct Polar {
    t: f64,
    cos: f64,
    sin: f64,
    pole: bool,
}

impl ViewImage {
    /// The view towards unit `view` under `light` (coefficients over the world, of at least the slices'
    /// order).
    pub fn new(slices: &Slices, light: &ShRgb, view: DVec3) -> Self {
        let order = slices.order();
        let frame = frame(view);
        let seen = Rotation::new(order, frame.transpose()).apply_rgb(light);
        let mut rows = Vec::with_capacity(slices.elevations() * (order + 1));
        // cosine and sine coefficients of the light, in the order of the slices.
        let ordered: Vec<[f64; 6]> = (0..=order)
            .flat_map(|m| (m..=order).map(move |l| (l, m as isize)))
            .map(|(l, m)| {
                let [r, g, b] = seen.c.each_ref().map(|c| c[index(l, m)]);
                let [x, y, z] = seen.c.each_ref().map(|c| if m == 0 { 0.0 } else { c[index(l, -m)] });
                [r, g, b, x, y, z]
            })
            .collect();
        for j in 0..slices.elevations() {
            let g = slices.at(j);
            let mut at = 0;
            for m in 0..=order {
                let mut sum = [0.0; 6];
                for (l, g) in ordered[at..at + order + 1 - m].iter().zip(&g[at..]) {
                    for c in 0..3 {
                        let g = f64::from(g[c]);
                        sum[c] += l[c] * g;
                        sum[c + 3] += l[c + 3] * g;
                    }
                }
                rows.push(sum);
                at += order + 1 - m;
            }
        }
        Self { order, intervals: slices.elevations() - 1, frame, rows }
    }

    /// L_o where the view is mirrored into `r` (any unit direction): the normal is half-way between.
    pub fn towards(&self, r: DVec3) -> [f64; 3] {
        let d = self.frame.transpose() * r;
        let rho = d.truncate().length();
        self.value(&Polar {
            t: rho.atan2(d.z) / PI * self.intervals as f64,
            cos: if rho > 0.0 { d.x / rho } else { 1.0 },
            sin: if rho > 0.0 { d.y / rho } else { 0.0 },
            // Opposite to the viewer the azimuth of the normal is undefined: the texel gets the mean over a
            // circle.
            pole: rho < 1e-9 && d.z < 0.0,
        })
    }

    /// Cubic through four elevations (mirrored at the pole), then the series in β.
    fn value(&self, p: &Polar) -> [f64; 3] {
        let first = (p.t.floor() as isize - 1).min(self.intervals as isize - 3);
        let w = cubic(p.t - first as f64);
        let n = self.order + 1;
        let last = if p.pole { 1 } else { n };
        let rows: [&[[f64; 6]]; 4] = std::array::from_fn(|k| {
            let j = (first + k as isize).unsigned_abs();
            &self.rows[j * n..(j + 1) * n]
        });
        // The elevation below zero is the one above, β turned by π: odd m change sign.
        let sign = if first < 0 { -1.0 } else { 1.0 };
        let (mut c, mut s) = (1.0, 0.0);
        let mut out = [0.0; 3];
        let mut flip = 1.0;
        for m in 0..last {
            let w = [flip * w[0], w[1], w[2], w[3]];
            for k in 0..3 {
                let mix = |i: usize| {
                    w[0] * rows[0][m][i] + w[1] * rows[1][m][i] + w[2] * rows[2][m][i] + w[3] * rows[3][m][i]
                };
                out[k] += mix(k) * c + mix(k + 3) * s;
            }
            (c, s) = (c * p.cos - s * p.sin, s * p.cos + c * p.sin);
            flip *= sign;
        }
        out
    }
}

/// Lagrange weights of nodes 0, 1, 2, 3 at x.
fn cubic(x: f64) -> [f64; 4] {
    let (a, b, c, d) = (x, x - 1.0, x - 2.0, x - 3.0);
    [-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0]
}
