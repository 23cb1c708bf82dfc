//! Means of a reflectance, less the lobes already fitted, over rings about axes in the plane of n and wo.

use super::rings::Place;
use super::{Curve, RadialLobe, Rings};
use crate::adaptive::{graded, integrate};
use crate::{Brdf, Domain, Lobe};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Relative tolerance of a ring's mean, an estimate far above the error. Half and twice change amplitudes by
/// 2e-5 at most.
const TOLERANCE: f64 = 2e-3;
/// Relative tolerance of the mean of a residual, which is fitted again. Half and twice change what is left by
/// 4e-4 of itself at most.
const RESIDUAL_TOLERANCE: f64 = 2e-2;
/// Values below this part of the strongest ring's are ignored. Half and twice give the same fits to five
/// digits.
const FAINT: f64 = 2e-5;
/// Splits of a ring's integral at most. Half and twice change amplitudes by 2e-6 at most.
const MAX_SPLITS: usize = 60;
/// n·wo of the last view. Half and twice change the amplitudes there, of measured chrome by 20 % of their sum
/// over views, but not what is left.
const LAST_COSINE: f64 = 5e-4;

/// Views from the normal to grazing, equally spaced in x = √(1 − √(n·wo)): in θ_v near the normal, and the
/// denser the nearer to grazing, where the horizon cuts lobes.
#[derive(Debug, Clone, PartialEq)]
pub struct Views {
    /// θ_v, ascending from 0; the last one is just above the horizon.
    pub theta: Vec<f64>,
}

impl Views {
    /// `count` ≥ 2 views.
    pub fn new(count: usize) -> Self {
        let last = (count.max(2) - 1) as f64;
        let theta = |k: usize| (1.0 - (k as f64 / last).powi(2)).powi(2).max(LAST_COSINE).acos();
        Self { theta: (0..count.max(2)).map(theta).collect() }
    }

    /// Number of rings.
    pub fn len(&self) -> usize {
        self.theta.len()
    }

    /// Never.
    pub fn is_empty(&self) -> bool {
        self.theta.is_empty()
    }

    /// Share of view `k` where views are uniform in solid angle: |d cos θ_v| = 4x (1 − x²) dx.
    pub fn weight(&self, k: usize) -> f64 {
        let last = (self.len() - 1) as f64;
        let x = k as f64 / last;
        4.0 * x * (1.0 - x * x) / last
    }

    /// wo of view `k` in the local frame.
    pub fn wo(&self, k: usize) -> DVec3 {
        let (s, c) = self.theta[k].sin_cos();
        DVec3::new(s, 0.0, c)
    }
}

/// Where a lobe's axis may lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// The mirror direction: γ = θ_v.
    Mirror,
    /// The normal: γ = 0.
    Normal,
    /// The centroid of f_cos.
    Centroid,
    /// The centroid of f_cos², which follows peaks.
    Peak,
    /// Back to the viewer: γ = −θ_v.
    Back,
}

impl Axis {
    /// All, the plainer ones first.
    pub const ALL: [Self; 5] = [Self::Mirror, Self::Normal, Self::Centroid, Self::Peak, Self::Back];
}

/// The narrowest lobe of any view, radians; 1 where there is none.
pub(super) fn narrowest(brdf: &dyn Brdf, views: &Views) -> f64 {
    let width = |l: &Lobe| match *l {
        Lobe::Axis { width, .. } | Lobe::Cone { width, .. } | Lobe::Arc { width, .. } => width,
    };
    let all = (0..views.len()).flat_map(|k| brdf.lobes(views.wo(k)));
    all.map(|l| width(&l)).fold(1.0, f64::min)
}

/// A lobe at the ready.
struct Fitted<'a> {
    lobe: &'a RadialLobe,
    curves: Vec<[Curve; 3]>,
}

impl Fitted<'_> {
    fn place(&self, shape: usize, psi: f64) -> Option<Place> {
        self.curves[shape].iter().find_map(|c| c.place(psi))
    }
}

/// A reflectance less some lobes.
pub struct Residual<'a> {
    brdf: &'a dyn Brdf,
    rings: &'a Rings,
    views: &'a Views,
    stride: usize,
    lobes: Vec<Fitted<'a>>,
}

/// An axis at γ from n away from wo, and the two directions across it: in the plane, and y.
struct About {
    gamma: f64,
    c: DVec3,
    u: DVec3,
}

impl About {
    fn new(gamma: f64) -> Self {
        let (s, c) = gamma.sin_cos();
        Self { gamma, c: DVec3::new(-s, 0.0, c), u: DVec3::new(c, 0.0, s) }
    }

    fn at(&self, psi: f64, phi: f64) -> DVec3 {
        let ((sp, cp), (sf, cf)) = (psi.sin_cos(), phi.sin_cos());
        self.c * cp + (self.u * cf + DVec3::Y * sf) * sp
    }

    /// Azimuth at which the ring ψ meets the horizon: cos φ = −cos γ cos ψ/(sin γ sin ψ).
    fn horizon(&self, psi: f64) -> Option<f64> {
        let x = -(self.gamma.cos() * psi.cos()) / (self.gamma.sin() * psi.sin());
        (x.abs() < 1.0).then(|| x.acos())
    }

    /// Is the whole ring below the horizon? Its highest point is at |ψ ± γ| from n.
    fn below(&self, psi: f64) -> bool {
        (psi - self.gamma.abs()).abs() >= FRAC_PI_2
    }
}

impl<'a> Residual<'a> {
    pub(super) fn new(
        brdf: &'a dyn Brdf,
        rings: &'a Rings,
        views: &'a Views,
        stride: usize,
        lobes: &'a [RadialLobe],
    ) -> Self {
        let curves = |s: &[Vec<f64>; 3]| s.each_ref().map(|s| rings.curve(s));
        let fitted = |lobe: &'a RadialLobe| Fitted { lobe, curves: lobe.shapes.iter().map(curves).collect() };
        Self { brdf, rings, views, stride, lobes: lobes.iter().map(fitted).collect() }
    }

    /// Is it zero below the horizon?
    fn ends(&self) -> bool {
        self.lobes.is_empty() && self.brdf.domain() == Domain::Hemisphere
    }

    /// The value at `wi` of view `k`.
    fn value(&self, k: usize, wi: DVec3) -> [f64; 3] {
        let mut v = self.brdf.f_cos(wi, self.views.wo(k));
        for l in &self.lobes {
            let (s, c) = l.lobe.gamma[k].sin_cos();
            let psi = (wi.z * c - wi.x * s).clamp(-1.0, 1.0).acos();
            let (a, b, w) = l.lobe.around(k, self.stride);
            // Profiles share their rings, and with them the panels.
            let Some(place) = l.place(a, psi).or_else(|| l.place(b, psi)) else { continue };
            for (c, v) in v.iter_mut().enumerate() {
                let (at, amplitude) = (l.curves[a][c].there(&place), l.lobe.amplitude[k][c]);
                let next = if w > 0.0 { l.curves[b][c].there(&place) } else { at };
                *v -= amplitude * (at + (next - at) * w);
            }
        }
        v
    }

    /// The means of `g(ψ, φ, wi)`, even in φ, over every ring about the axis at `gamma`.
    fn over_rings(&self, about: &About, g: impl Fn(f64, f64, DVec3) -> [f64; 3]) -> [Vec<f64>; 3] {
        let mut rows: [Vec<f64>; 3] = Default::default();
        let mut largest = 0.0_f64;
        for &psi in self.rings.angles() {
            // Weight of a ring in an integral, where the width of panels grows with ψ.
            let area = psi.sin().powi(2).max(self.rings.width().powi(2));
            let row = self.ring(about, psi, FAINT * largest / area, |phi, wi| g(psi, phi, wi));
            largest = row.iter().fold(largest, |m, v| m.max(v.abs() * area));
            rows.iter_mut().zip(row).for_each(|(r, v)| r.push(v));
        }
        rows
    }

    fn ring(
        &self,
        about: &About,
        psi: f64,
        absolute: f64,
        mut g: impl FnMut(f64, DVec3) -> [f64; 3],
    ) -> [f64; 3] {
        if self.ends() && about.below(psi) {
            return [0.0; 3];
        }
        let width = (self.rings.width() / psi.sin().max(1e-9)).min(PI);
        let mut breaks = graded(0.0, PI, &[(0.0, width), (PI, width)]);
        if self.brdf.domain() == Domain::Hemisphere
            && let Some(phi) = about.horizon(psi)
        {
            breaks.push(phi);
            breaks.sort_by(f64::total_cmp);
        }
        let mut f = |phi: f64| g(phi, about.at(psi, phi));
        let tolerance = if self.lobes.is_empty() { TOLERANCE } else { RESIDUAL_TOLERANCE };
        integrate(&mut f, &breaks, tolerance, PI * absolute, MAX_SPLITS).value.map(|v| v / PI)
    }

    /// The profile of view `k` about the axis at `gamma`: per channel, at each ring.
    pub(super) fn mean(&self, k: usize, gamma: f64) -> [Vec<f64>; 3] {
        self.over_rings(&About::new(gamma), |_, _, wi| self.value(k, wi))
    }

    /// ∫ of the square of view `k`, all channels, by rings about the axis at `gamma`.
    pub(super) fn energy(&self, k: usize, gamma: f64) -> f64 {
        let squares = self.over_rings(&About::new(gamma), |_, _, wi| self.value(k, wi).map(|v| v * v));
        squares.iter().map(|s| self.rings.integral(s)).sum()
    }

    /// γ of an axis at view `k`.
    pub(super) fn gamma(&self, axis: Axis, k: usize) -> f64 {
        let theta = self.views.theta[k];
        match axis {
            Axis::Mirror => theta,
            Axis::Normal => 0.0,
            Axis::Back => -theta,
            Axis::Centroid => self.centroid(k, |v| v),
            Axis::Peak => self.centroid(k, |v| v * v),
        }
    }

    /// γ of ∫ w wi, w = `weight` of the sum of the channels, by rings about the mirror direction.
    fn centroid(&self, k: usize, weight: impl Fn(f64) -> f64) -> f64 {
        let theta = self.views.theta[k];
        let rows = self.over_rings(&About::new(theta), |psi, phi, wi| {
            let w = weight(self.value(k, wi).iter().sum());
            [w * psi.sin() * phi.cos(), w * psi.cos(), w]
        });
        let (across, along) = (self.rings.integral(&rows[0]), self.rings.integral(&rows[1]));
        if !(across.is_finite() && along > 0.0) {
            return theta;
        }
        // u points from the mirror direction towards n.
        (theta - across.atan2(along)).clamp(0.0, FRAC_PI_2)
    }
}
