//! g_lm of one elevation by quadrature in rings about the view, cut at the horizon and graded around the
//! lobes.

use super::panels::{composite, panels};
use super::slices::half_count;
use crate::central::Polar;
use crate::{Brdf, Domain, Lobe};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};
use steradian_simd::{Arch, Kernel};
use steradian_sphere::quadrature::gauss_legendre;

/// Phase (length × order) of the longest panel: the largest rule integrates a wave of 20 radians to 5e-12.
const MAX_PHASE: f64 = 20.0;
/// Nodes of a panel over which the coefficients' basis hardly varies.
const FLAT: f64 = 4.5;
/// Nodes of the largest rule.
const MAX_NODES: usize = 15;
/// Length of the first panel next to the horizon's tangents, radians.
const BEND: f64 = 0.06;
/// Widths are clamped to this, radians, above which a function counts as smooth.
const SMOOTH: f64 = 0.6;

/// Rules for bands up to an order.
pub(super) struct Rule {
    order: usize,
    polar: Polar,
    gauss: Vec<(Vec<f64>, Vec<f64>)>,
}

/// Coefficients of one elevation.
pub(super) struct Slice {
    /// m by m, then l = m…F.
    pub g: Vec<[f64; 3]>,
    /// ∫ f_cos² dwi, without the Lambertian part, summed over the channels.
    pub energy: f64,
}

/// A lobe in the view's polar angles: θ, |φ|, width.
type Place = [f64; 3];

impl Rule {
    pub fn new(order: usize) -> Self {
        Self { order, polar: Polar::new(order, order), gauss: (0..=MAX_NODES).map(gauss_legendre).collect() }
    }

    /// Nodes and weights over [a, b], graded around each (centre, width).
    fn nodes(&self, a: f64, b: f64, centres: &[(f64, f64)]) -> Vec<[f64; 2]> {
        let short = centres.iter().map(|c| c.1).fold(SMOOTH, f64::min) * 0.3;
        let mut out = Vec::new();
        for pair in panels([a, b], centres, short).windows(2) {
            let phase = (pair[1] - pair[0]) * self.order as f64;
            let parts = (phase / MAX_PHASE).ceil().max(1.0);
            let n = (FLAT + 0.5 * phase / parts) as usize;
            out.extend(composite(pair, parts, &self.gauss[n.min(MAX_NODES)]));
        }
        out
    }

    /// The coefficients of the normal at `theta_v` from the view, without the Lambertian part `diffuse`.
    pub fn slice(&self, brdf: &dyn Brdf, diffuse: [f64; 3], theta_v: f64) -> Slice {
        let (s, c) = theta_v.sin_cos();
        let whole = brdf.domain() == Domain::Sphere;
        let places = places(brdf, theta_v);
        // Where rings begin and cease to meet the horizon, their arcs change like a root.
        let mut bends = vec![(FRAC_PI_2 - theta_v, BEND), (FRAC_PI_2 + theta_v, BEND)];
        bends.extend(places.iter().map(|p| (p[0], p[2])));
        let end = if whole { PI } else { (FRAC_PI_2 + theta_v).min(PI) };
        let mut out = Slice { g: vec![[0.0; 3]; half_count(self.order)], energy: 0.0 };
        let wo = DVec3::new(-s, 0.0, c);
        let mut ring = Ring { cosines: vec![[0.0; 3]; self.order + 1], nodes: Vec::new() };
        let mut row = Vec::new();
        for [theta, w] in self.nodes(0.0, end, &bends) {
            let (st, ct) = theta.sin_cos();
            let reach = if whole { PI } else { (-(c * ct) / (s * st).max(1e-300)).clamp(-1.0, 1.0).acos() };
            let arcs: Vec<_> = places.iter().map(|p| (p[1], arc_width(p, theta, st))).collect();
            ring.nodes.clear();
            for [phi, wp] in self.nodes(0.0, reach, &arcs) {
                let (sp, cp) = phi.sin_cos();
                // The view's frame to the surface's: n = (s, 0, c) becomes z.
                let (x, y) = (st * cp, st * sp);
                let wi = DVec3::new(c * x - s * ct, y, s * x + c * ct);
                let f = rest(brdf, diffuse, wi, wo);
                let weight = 2.0 * w * wp * st;
                out.energy += weight * f.iter().map(|f| f * f).sum::<f64>();
                ring.nodes.push((cp, f.map(|f| weight * f)));
            }
            steradian_simd::run(&mut ring);
            self.project(&ring.cosines, ct, st, &mut row, &mut out.g);
        }
        out
    }

    /// Adds a ring's cosine coefficients to all bands.
    fn project(&self, cosines: &[[f64; 3]], ct: f64, st: f64, row: &mut Vec<f64>, g: &mut [[f64; 3]]) {
        let mut at = 0;
        self.polar.for_each(st, ct, row, |m, f| {
            let norm = if m == 0 { 1.0 } else { std::f64::consts::SQRT_2 };
            let a = cosines[m].map(|a| norm * a);
            let f = &f[m..];
            let to = &mut g[at..at + f.len()];
            for k in 0..to.len() {
                (0..3).for_each(|c| to[k][c] += f[k] * a[c]);
            }
            at += to.len();
        });
    }
}

/// The nodes of a ring, cos φ and weighted f_cos, and their sums with cos mφ.
struct Ring {
    cosines: Vec<[f64; 3]>,
    nodes: Vec<(f64, [f64; 3])>,
}

/// Number of nodes that are summed in lanes.
const SIDE: usize = 8;

impl Kernel for &mut Ring {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        self.cosines.fill([0.0; 3]);
        for nodes in self.nodes.chunks(SIDE) {
            let (mut twice, mut before, mut now) = ([0.0; SIDE], [0.0; SIDE], [0.0; SIDE]);
            let mut v = [[0.0; SIDE]; 3];
            for (k, (cos, value)) in nodes.iter().enumerate() {
                (twice[k], before[k], now[k]) = (2.0 * cos, *cos, 1.0);
                (0..3).for_each(|c| v[c][k] = value[c]);
            }
            for to in &mut self.cosines {
                for c in 0..3 {
                    let mut sum = [0.0; SIDE];
                    (0..SIDE).for_each(|k| sum[k] = v[c][k] * now[k]);
                    to[c] +=
                        ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
                }
                // cos (m + 1)φ = 2 cos φ cos mφ − cos (m − 1)φ.
                for k in 0..SIDE {
                    (before[k], now[k]) = (now[k], twice[k] * now[k] - before[k]);
                }
            }
        }
    }
}

/// f_cos without its Lambertian part.
fn rest(brdf: &dyn Brdf, diffuse: [f64; 3], wi: DVec3, wo: DVec3) -> [f64; 3] {
    let f = brdf.f_cos(wi, wo);
    std::array::from_fn(|k| f[k] - diffuse[k] * wi.z.max(0.0))
}

/// Azimuth over which a lobe varies on the ring at `theta`: wider far from the lobe, and on small rings.
fn arc_width(p: &Place, theta: f64, sin: f64) -> f64 {
    let away = (theta - p[0]).abs();
    (p[2].max(0.5 * away) / sin.max(1e-3)).clamp(1e-3, PI)
}

/// The lobes about the view; isotropic reflectance has them in the plane of view and normal.
fn places(brdf: &dyn Brdf, theta_v: f64) -> Vec<Place> {
    let (s, c) = theta_v.sin_cos();
    let place = |l: Lobe| {
        let (axis, width) = match l {
            Lobe::Axis { axis, width } | Lobe::Cone { axis, width, .. } => (axis, width),
            Lobe::Arc { normal, width } => (normal, width),
        };
        // The surface's frame to the view's.
        let d = DVec3::new(c * axis.x + s * axis.z, axis.y, c * axis.z - s * axis.x);
        let (theta, phi) = (d.x.hypot(d.y).atan2(d.z), d.y.atan2(d.x).abs());
        [theta, phi, width.clamp(1e-4, SMOOTH)]
    };
    brdf.lobes(DVec3::new(-s, 0.0, c)).into_iter().map(place).collect()
}
