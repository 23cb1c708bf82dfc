//! The first pass of 5.22: Fourier coefficients in φ of f_cos on a circle about the centre.

use super::geometry::{Elevation, Slice};
use super::rule::{self, POINTS};
use super::waves::{self, ROOM, Values, Waves};
use crate::adaptive::graded;
use crate::{Brdf, Lobe};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_simd::run;

/// Panels of a circle at most.
const MAX_PANELS: usize = 96;
/// Circles fainter than this, relative to the brightest so far, need only the absolute accuracy of that one.
const FAINT: f64 = 1e-3;
/// Orders in q whose convergence is watched.
const WATCHED: usize = 16;
/// A panel spans at most this many radians of cos qφ: a wave of 9 radians is integrated to 2e-6 by the
/// 7-point rule, by whose difference panels are divided, and to rounding by the 15-point rule.
const MAX_PHASE: f64 = 9.0;

/// Integrals over one circle: ∫ f_cos cos qφ dφ as `[3q + c]` for q ≤ Q, then ∫ f_cos² dφ, then ∫ f_cos
/// (n·wi)₊ dφ.
pub(super) fn width(q: usize) -> usize {
    3 * (q + 1) + 6
}

/// A lobe as seen about the centre.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spot {
    pub theta: f64,
    /// `None` for a ridge along the whole circle.
    pub phi: Option<f64>,
    pub width: f64,
}

/// Integrates over circles of one slice.
pub(super) struct Rings<'a> {
    brdf: &'a dyn Brdf,
    axes: [DVec3; 3],
    wo: DVec3,
    q: usize,
    /// f_cos(φ) ≠ f_cos(−φ): both sides are read.
    two_sided: bool,
    pub spots: Vec<Spot>,
    tolerance: f64,
    loudest: f64,
    /// Absolute accuracy that suffices everywhere, once the slice's energy is known.
    pub floor: f64,
    /// Σ f_cos cos qφ over a panel, with room for whole registers.
    sum: Vec<f64>,
    /// The sum minus that of the 7-point rule, as an error estimate for the orders that are watched.
    difference: Vec<f64>,
    /// ∫ f_cos² dφ and ∫ f_cos (n·wi)₊ dφ over a panel.
    tail: [f64; 6],
}

impl<'a> Rings<'a> {
    pub fn new(brdf: &'a dyn Brdf, slice: &Slice, q: usize, two_sided: bool, tolerance: f64) -> Self {
        let (c, u) = (slice.centre(), slice.zero_azimuth());
        let axes = [u, DVec3::Y, c];
        let wo = slice.view();
        let spots = brdf.lobes(wo).into_iter().filter_map(|l| spot(l, &axes)).collect();
        let (sum, difference) = (vec![0.0; waves::room(q)], vec![0.0; waves::room(q.min(WATCHED))]);
        let (loudest, floor, tail) = (0.0, 0.0, [0.0; 6]);
        Self { brdf, axes, wo, q, two_sided, spots, tolerance, loudest, floor, sum, difference, tail }
    }

    /// Q.
    pub fn order(&self) -> usize {
        self.q
    }

    /// Overwrites `out[..width(q)]` with the integrals over the circle at `at`.
    pub fn integrate(&mut self, at: &Elevation, out: &mut [f64]) {
        out.fill(0.0);
        let [lo, hi] = at.azimuths;
        if hi <= lo {
            return;
        }
        let (sine, cosine) = at.theta.sin_cos();
        let breaks = graded(lo, hi, &self.centres(at.theta, sine));
        let mut queue = rule::split(&breaks, MAX_PHASE / self.q.max(1) as f64);
        let (mut begin, mut energy) = (0, 0.0);
        // Rounds: the panels of a round are judged against the energy of all before them.
        while begin < queue.len() {
            let end = queue.len();
            for i in begin..end {
                let [a, b] = queue[i];
                let (error, missed) = self.panel(sine, cosine, [a, b]);
                let here = self.energy();
                energy += if begin == 0 { here } else { 0.0 };
                let norm = (2.0 * PI * energy.max(here)).sqrt();
                // An error of the energy weighs as half of it on the norm.
                let error = error.max(PI * missed / norm.max(f64::MIN_POSITIVE));
                self.loudest = self.loudest.max(norm);
                let enough = self.tolerance * norm.max(FAINT * self.loudest);
                let enough = enough.max(self.floor) * ((b - a) / (hi - lo)).sqrt();
                if error > enough && queue.len() < MAX_PANELS.max(2 * end.min(MAX_PANELS)) && b - a > 1e-9 {
                    let middle = 0.5 * (a + b);
                    queue.extend([[a, middle], [middle, b]]);
                } else {
                    let (waves, tail) = out.split_at_mut(3 * (self.q + 1));
                    waves.iter_mut().zip(&self.sum).for_each(|(o, s)| *o += 2.0 * s);
                    tail.iter_mut().zip(&self.tail).for_each(|(o, s)| *o += 2.0 * s);
                }
            }
            begin = end;
        }
    }

    /// The azimuths where the circle crosses lobes, with their widths on it.
    fn centres(&self, theta: f64, sine: f64) -> Vec<(f64, f64)> {
        let crossing = |s: &Spot| {
            let away = (theta - s.theta).abs();
            let width = (s.width.max(0.5 * away) / sine.max(1e-9)).max(1e-6);
            s.phi.filter(|_| width < 1.0).map(|phi| (phi, width))
        };
        self.spots.iter().filter_map(crossing).collect()
    }

    fn energy(&self) -> f64 {
        self.tail[..3].iter().sum()
    }

    /// One panel into `sum`; returns the estimated errors of the Fourier coefficients and of the energy.
    fn panel(&mut self, sine: f64, cosine: f64, ends: [f64; 2]) -> (f64, f64) {
        let watched = self.q.min(WATCHED);
        let mut cosines = [0.0; ROOM];
        let (mut values, mut differences): (Values, Values) = Default::default();
        let (mut missed, mut tail) = (0.0, [0.0; 6]);
        let nodes = rule::nodes(ends[0], ends[1]);
        let [u, v, c] = self.axes;
        let mut wi = [c; ROOM];
        for (k, node) in nodes.iter().enumerate() {
            let (sp, cp) = node.at.sin_cos();
            wi[k] = c * cosine + (u * cp + v * sp) * sine;
            cosines[k] = cp;
        }
        let (f, f2) = self.values(&wi);
        for (k, node) in nodes.iter().enumerate() {
            let (f, f2, nwi) = (f[k], f2[k], wi[k].z.max(0.0));
            missed += node.difference * (f2[0] + f2[1] + f2[2]);
            for c in 0..3 {
                (values[c][k], differences[c][k]) = (node.weight * f[c], node.difference * f[c]);
                tail[c] += node.weight * f2[c];
                tail[3 + c] += node.weight * f[c] * nwi;
            }
        }
        self.tail = tail;
        self.sum.fill(0.0);
        self.difference.fill(0.0);
        let cosines = &cosines;
        run(Waves { cosines, values: &values, q: self.q, out: &mut self.sum });
        run(Waves { cosines, values: &differences, q: watched, out: &mut self.difference });
        let square: f64 = self.difference[..3 * (watched + 1)].iter().map(|d| d * d).sum();
        let energy = self.energy();
        let coefficients = rule::error(square.sqrt(), (energy * (ends[1] - ends[0])).sqrt());
        (coefficients, rule::error(missed.abs(), energy))
    }

    /// f_cos and f_cos² of a panel's directions, averaged over both sides where they differ.
    fn values(&self, wi: &[DVec3; ROOM]) -> ([[f64; 3]; ROOM], [[f64; 3]; ROOM]) {
        let (mut f, mut f2) = ([[0.0; 3]; ROOM], [[0.0; 3]; ROOM]);
        self.brdf.f_cos_batch(&wi[..POINTS], self.wo, &mut f[..POINTS]);
        if !self.two_sided {
            for k in 0..ROOM {
                (0..3).for_each(|c| f2[k][c] = f[k][c] * f[k][c]);
            }
            return (f, f2);
        }
        let mut g = [[0.0; 3]; ROOM];
        let mirrored = wi.map(|w| DVec3::new(w.x, -w.y, w.z));
        self.brdf.f_cos_batch(&mirrored[..POINTS], self.wo, &mut g[..POINTS]);
        for k in 0..ROOM {
            for c in 0..3 {
                f2[k][c] = 0.5 * (f[k][c] * f[k][c] + g[k][c] * g[k][c]);
                f[k][c] = 0.5 * (f[k][c] + g[k][c]);
            }
        }
        (f, f2)
    }
}

/// Where a lobe lies about the centre.
fn spot(lobe: Lobe, axes: &[DVec3; 3]) -> Option<Spot> {
    let [u, v, c] = *axes;
    match lobe {
        Lobe::Axis { axis, width } => {
            let theta = axis.cross(c).length().atan2(axis.dot(c));
            let phi = axis.dot(v).abs().atan2(axis.dot(u));
            Some(Spot { theta, phi: Some(phi), width })
        }
        Lobe::Cone { axis, cosine, width } if axis.dot(c).abs() > 0.999 => {
            let theta = (cosine * axis.dot(c).signum()).clamp(-1.0, 1.0).acos();
            Some(Spot { theta, phi: None, width })
        }
        Lobe::Arc { normal, width } if normal.dot(c).abs() > 0.999 => {
            Some(Spot { theta: 0.5 * PI, phi: None, width })
        }
        Lobe::Cone { .. } | Lobe::Arc { .. } => None,
    }
}
