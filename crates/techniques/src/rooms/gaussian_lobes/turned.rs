//! Anisotropic reflectance: lobes by elevation and azimuth of the view, whose means may lie off the plane of
//! incidence, each swept along a direction of its own. `turned.wgsl` has the same functions.

use super::GaussianLobes;
use super::frame::Frame;
use super::light::Light;
use super::lookups::{TAPS, elevation, number};
use super::views::Views;
use super::visibility::{self, Blocked, MOST};
use crate::shared::maths::angle::sin_cos;
use crate::shared::maths::vector::{cross, dot};
use crate::shared::points::batch::{self, Block, BlockShader, Point, WIDTH};
use crate::shared::points::central::tangent;
use crate::{Bake, Points, Radiance};
use std::f32::consts::TAU;

/// One lobe of a view, in world space.
pub(super) struct Lobe {
    /// The mean.
    pub mean: [f32; 3],
    along: [f32; 3],
    /// Standard deviation of the angles of lookups, their number, level of the chain.
    sweep: f32,
    taps: f32,
    level: f32,
    /// Weights, and the zonal coefficients of visibility.
    pub weight: [f32; 4],
    pub zonal: [f32; 4],
}

/// Position of a view in the tables, and its frame.
pub(super) struct Place {
    /// Place in a lobe's part of the tables, and weights of the next column and the next row.
    first: usize,
    part: [f32; 2],
    /// The part of wo perpendicular to n, normalised; n × that; and n.
    axes: [[f32; 3]; 3],
    /// Sine and cosine of θ_o.
    polar: [f32; 2],
}

impl Place {
    /// Coordinates and frame of the view `wo` on normal and tangent.
    #[inline(always)]
    pub(super) fn new(v: &Views, n: [f32; 3], t: [f32; 3], wo: [f32; 3]) -> Self {
        let (b, cos_o) = (cross(n, t), dot(n, wo).min(1.0));
        let [sine, theta] = elevation(cos_o);
        let (x, y) = (dot(wo, t), dot(wo, b));
        let length = (x * x + y * y).sqrt();
        let [x, y] = if length > 1e-6 { [x / length, y / length] } else { [1.0, 0.0] };
        let (rows, columns) = (v.count() / v.columns, v.columns);
        let row = theta.clamp(0.0, 1.0) * (rows - 1) as f32;
        let i = (row as usize).min(rows - 2);
        let turn = y.atan2(x) / TAU;
        let column = (turn - turn.floor()) * (columns - 1) as f32;
        let j = (column as usize).min(columns - 2);
        Self {
            first: i * columns + j,
            part: [column - j as f32, row - i as f32],
            axes: [
                std::array::from_fn(|k| x * t[k] + y * b[k]),
                std::array::from_fn(|k| x * b[k] - y * t[k]),
                n,
            ],
            polar: [sine, cos_o],
        }
    }

    /// Interpolates the values of a table for a lobe.
    #[inline(always)]
    fn at(&self, v: &Views, table: &[[f32; 4]], lobe: usize) -> [f32; 4] {
        let first = lobe * v.count() + self.first;
        let [a, b, c, d] = [0, 1, v.columns, v.columns + 1].map(|k| table[first + k]);
        let [x, y] = self.part;
        std::array::from_fn(|k| {
            let (near, far) = (a[k] + (b[k] - a[k]) * x, c[k] + (d[k] - c[k]) * x);
            near + (far - near) * y
        })
    }

    #[inline(always)]
    pub(super) fn lobe(&self, v: &Views, lobe: usize) -> Lobe {
        let [angle, aside, level, taps] = self.at(v, &v.means, lobe);
        let [qx, qy, ..] = self.at(v, &v.sweeps, lobe);
        let ([s, c], [sb, cb]) = (sin_cos(angle), sin_cos(aside));
        let [sine, cosine] = self.polar;
        let (s, c) = (sine * c + cosine * s, cosine * c - sine * s);
        let [x, y, n] = &self.axes;
        let plane: [f32; 3] = std::array::from_fn(|k| c * n[k] - s * x[k]);
        let up: [f32; 3] = std::array::from_fn(|k| -c * x[k] - s * n[k]);
        let side: [f32; 3] = std::array::from_fn(|k| cb * y[k] - sb * plane[k]);
        let square = (qx * qx + qy * qy).sqrt();
        let [ct, st] = half_angle(if square > 1e-12 { [qx / square, qy / square] } else { [1.0, 0.0] });
        Lobe {
            mean: std::array::from_fn(|k| cb * plane[k] + sb * y[k]),
            along: std::array::from_fn(|k| ct * up[k] + st * side[k]),
            sweep: square.sqrt(),
            taps,
            level,
            weight: self.at(v, &v.weights, lobe),
            zonal: if v.zonal.is_empty() { [1.0; 4] } else { self.at(v, &v.zonal, lobe) },
        }
    }
}

/// Cosine and sine of half the angle with this cosine and sine.
#[inline(always)]
fn half_angle([c, s]: [f32; 2]) -> [f32; 2] {
    if c >= 0.0 {
        let half = (0.5 * (1.0 + c)).sqrt();
        [half, 0.5 * s / half]
    } else {
        let half = (0.5 * (1.0 - c)).sqrt();
        [0.5 * s / half, half]
    }
}

/// Shader with `BANDS` bands of visibility.
struct Shader<'a, const BANDS: usize> {
    light: &'a Light,
    v: &'a Views,
    blocked: &'a Blocked,
    f: &'a Frame,
    q: &'a Points<'a>,
}

impl<const BANDS: usize> BlockShader for Shader<'_, BANDS> {
    #[inline(always)]
    fn shade(&self, p: &Block) -> [[f32; 4]; WIDTH] {
        let Self { light, v, blocked, f, q } = *self;
        let seen = visibility::at::<BANDS>(&blocked.visibility, q, &p.index);
        let mut out = [[0.0; 4]; WIDTH];
        for (k, sum) in out.iter_mut().enumerate() {
            let (n, r, cos_o) = (p.n.map(|c| c[k]), p.r.map(|c| c[k]), p.cos_o[k]);
            let wo = std::array::from_fn(|c| 2.0 * cos_o * n[c] - r[c]);
            let even = light.irradiance.sample(f.turn.apply(n));
            let less = if BANDS > 0 { f.blocked(q, p.index[k]) } else { [0.0; 3] };
            for c in 0..3 {
                sum[c] = (v.diffuse[c] * even[c] - less[c]).max(0.0);
            }
            let mut b = [0.0; MOST * MOST];
            for l in 0..BANDS * BANDS {
                b[l] = seen[l][k];
            }
            let point = Point { n, wo, r, cos_o, index: p.index[k] };
            let place = Place::new(v, n, tangent(q, &point), wo);
            for i in 0..v.lobes {
                let lobe = place.lobe(v, i);
                let (near, far, part) = light.chain.around(lobe.level);
                for [at, share] in TAPS.get(number(lobe.taps)).map_or(&[][..], |t| t) {
                    let [s, c] = sin_cos(lobe.sweep * at);
                    let d = std::array::from_fn(|k| c * lobe.mean[k] + s * lobe.along[k]);
                    let mut share = *share;
                    if BANDS > 0 {
                        share *= visibility::ratio::<BANDS>(&b, n, lobe.zonal, d).clamp(0.0, 1.0);
                    }
                    let d = f.turn.apply(d);
                    let (l0, l1) = (near.sample(d), far.sample(d));
                    for c in 0..3 {
                        sum[c] += lobe.weight[c] * share * (l0[c] + (l1[c] - l0[c]) * part);
                    }
                }
            }
        }
        out
    }
}

pub(super) fn shade(b: &Bake<GaussianLobes>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    match b.transfer.bands() {
        0 => run::<0>(b, f, q, out),
        1 => run::<1>(b, f, q, out),
        2 => run::<2>(b, f, q, out),
        3 => run::<3>(b, f, q, out),
        _ => run::<4>(b, f, q, out),
    }
}

fn run<const BANDS: usize>(b: &Bake<GaussianLobes>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    let shader = Shader::<BANDS> { light: &b.light, v: &b.linked, blocked: &b.transfer, f, q };
    batch::shade_blocks(q, out, &shader);
}
