//! Anisotropic reflectance: lobes by elevation and azimuth of the view, whose means may lie off the plane of
//! incidence, each swept along a direction of its own, or about half vectors ([`halves`]). `turned.wgsl` and
//! `halves.wgsl` have the same functions.

use super::frame::Frame;
use super::light::Light;
use super::lookups::{TAPS, number};
use super::place::Place;
use super::views::Views;
use super::visibility::{self, Blocked, MOST};
use super::{GaussianLobes, halves};
use crate::shared::maths::angle::sin_cos;
use crate::shared::maths::vector::cross;
use crate::shared::points::batch::{self, Block, BlockShader, Point, WIDTH};
use crate::shared::points::central::tangent;
use crate::{Bake, Points, Radiance};

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

impl Lobe {
    #[inline(always)]
    pub(super) fn new(v: &Views, place: &Place, lobe: usize) -> Self {
        let [angle, aside, level, taps] = place.at(v, &v.means, lobe);
        let [qx, qy, ..] = place.at(v, &v.sweeps, lobe);
        let ([s, c], [sb, cb]) = (sin_cos(angle), sin_cos(aside));
        let [sine, cosine] = place.polar;
        let (s, c) = (sine * c + cosine * s, cosine * c - sine * s);
        let [x, y, n] = &place.axes;
        let plane: [f32; 3] = std::array::from_fn(|k| c * n[k] - s * x[k]);
        let up: [f32; 3] = std::array::from_fn(|k| -c * x[k] - s * n[k]);
        let side: [f32; 3] = std::array::from_fn(|k| cb * y[k] - sb * plane[k]);
        let square = (qx * qx + qy * qy).sqrt();
        let [ct, st] = half_angle(if square > 1e-12 { [qx / square, qy / square] } else { [1.0, 0.0] });
        Self {
            mean: std::array::from_fn(|k| cb * plane[k] + sb * y[k]),
            along: std::array::from_fn(|k| ct * up[k] + st * side[k]),
            sweep: square.sqrt(),
            taps,
            level,
            weight: place.at(v, &v.weights, lobe),
            zonal: if v.zonal.is_empty() { [1.0; 4] } else { place.at(v, &v.zonal, lobe) },
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
            let t = tangent(q, &Point { n, wo, r, cos_o, index: p.index[k] });
            let mut add = |d: [f32; 3], level: f32, mut share: f32, weight: &[f32; 4], zonal: [f32; 4]| {
                if BANDS > 0 {
                    share *= visibility::ratio::<BANDS>(&b, n, zonal, d).clamp(0.0, 1.0);
                }
                let ((near, far, part), d) = (light.chain.around(level), f.turn.apply(d));
                let mut l = near.sample(d);
                if part > 0.0 {
                    let next = far.sample(d);
                    (0..3).for_each(|c| l[c] += (next[c] - l[c]) * part);
                }
                (0..3).for_each(|c| sum[c] += weight[c] * share * l[c]);
            };
            if !v.half_vectors.is_empty() {
                let (place, axes) = (halves::place(v, n, t, wo), [t, cross(n, t), n]);
                for i in v.used_at(place.first) {
                    let g = halves::Gaussian::new(v, &place, *i as usize, &axes, wo);
                    add(g.mean, g.level, 1.0, &g.weight, g.zonal);
                }
                continue;
            }
            let place = Place::new(v, n, t, wo);
            for i in 0..v.lobes {
                let lobe = Lobe::new(v, &place, i);
                for [at, share] in TAPS.get(number(lobe.taps)).map_or(&[][..], |t| t) {
                    let [s, c] = sin_cos(lobe.sweep * at);
                    let d = std::array::from_fn(|k| c * lobe.mean[k] + s * lobe.along[k]);
                    add(d, lobe.level, *share, &lobe.weight, lobe.zonal);
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
