//! Suns at the horizon, seen at grazing angles; `horizon.wgsl` has the same rule.
//!
//! There a lobe about the mirror direction is a narrow wedge: the half vector tilts by Δφ/(n·wi + n·wo) for
//! an azimuth Δφ from the plane of incidence, so that the lobe's width across that plane is its width at
//! normal view times (n·wi + n·wo)/2, which goes to 0 where the horizon is, while its height stays. And f_cos
//! rises from the horizon to n·wi ≈ n·wo. So the integral is taken in elevation e and azimuth: over panels of
//! elevation whose ends go up like n·wo · 4^k, Gauss–Legendre's nodes in s, e = a + (b − a)(1 − cos πs)/2
//! (without the square roots that the ends of a round outline have), and across in t, Δφ = w tan t, with w
//! the lobe's width at e.

use super::rule::nodes;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use steradian_brdf::{Brdf, Domain, Peak};

/// Views with n·wo below this use the rule: for steeper ones the nodes of the general rules are close enough.
const GRAZING: f64 = 0.1;
/// Lights whose centre has an n·wi below this use the rule.
const LOW: f64 = 0.5;
/// Lights above the horizon whose angular radius is less than so many widths of the lobe use the general
/// rules.
const ROUND: f64 = 0.6;
/// The upper end of a panel of elevation is at most so many times as high as its lower end …
const GROWTH: f64 = 4.0;
/// … and at most so many widths of the lobe above it, or this part of its distance from the mirror direction,
/// of panels below and above that: a lobe varies the less the farther away, so that one a thousand times
/// narrower than the light takes ten panels more.
const WIDTHS: f64 = 4.0;
const PARTS: [f64; 2] = [0.5, 1.0];
/// Panels are at least so high, radians: in single precision lower ones would not end.
const LEAST_HEIGHT: f64 = 1e-6;
/// Nodes of a panel in elevation: with 8 the error is up to 1.1e-2 of the largest radiance at a view, with 16
/// 1.2e-3.
const UP: usize = 16;
/// Nodes in azimuth; the second number where one width of the lobe is more than twice the other.
const ACROSS: [usize; 2] = [16, 32];
/// Mean cosines are clamped to this, so that the lobe does not become narrower still.
const LEAST: f64 = 1e-5;

/// Callback for each piece of a circle of elevation: the azimuths at which it begins and ends.
type Pieces<'a> = dyn FnMut([f64; 2]) + 'a;

/// The lobe of a grazing view.
#[derive(Debug, Clone, Copy)]
pub struct Horizon {
    /// Azimuth of the mirror direction.
    azimuth: f64,
    /// n·wo.
    cosine: f64,
    /// Widths of the lobe at normal view.
    narrow: f64,
    wide: f64,
}

impl Horizon {
    /// The rule for a light of angular radius `radius` (radians) about `centre`; `None` where the general
    /// rules serve.
    pub fn of(brdf: &dyn Brdf, centre: DVec3, radius: f64, scale: f64, wo: DVec3) -> Option<Self> {
        let Peak::Mirror { narrow, wide } = brdf.peak() else { return None };
        let near = wo.z < GRAZING && centre.z < LOW;
        // A light that is neither cut by the horizon nor large relative to the lobe is left to the general
        // rules.
        let near = near && (centre.z < radius || radius > ROUND * scale);
        (near && brdf.domain() == Domain::Hemisphere).then(|| Self {
            azimuth: (-wo.y).atan2(-wo.x),
            cosine: wo.z,
            narrow,
            wide,
        })
    }

    /// The largest elevation at which a panel that begins at elevation `e` may end.
    fn next(&self, e: f64) -> f64 {
        let above = e.sin() - self.cosine;
        let part = (-PARTS[0] * above).max(PARTS[1] * above);
        (GROWTH * e).max(self.cosine.max(LEAST)).min(e + part.max(WIDTHS * self.narrow).max(LEAST_HEIGHT))
    }

    /// ∫ f dφ at elevation `e` between two azimuths from the mirror direction's.
    fn across(&self, e: f64, [from, to]: [f64; 2], f: &dyn Fn(DVec3) -> [f64; 3]) -> [f64; 3] {
        let (se, ce) = e.sin_cos();
        // Out of the ridge the half vector is tilted by half of the elevations' difference already.
        let tilt = (self.narrow * self.wide + (se - self.cosine).powi(2)).sqrt();
        let w = tilt * (0.5 * (se + self.cosine)).max(LEAST);
        let [t0, t1] = [from, to].map(|x| (x / w).atan());
        let mut sum = [0.0; 3];
        for &(x, wx) in nodes(ACROSS[usize::from(self.wide > 2.0 * self.narrow)]) {
            let tan = (t0 + (t1 - t0) * x).tan();
            let (s, c) = (self.azimuth + w * tan).sin_cos();
            let v = f(DVec3::new(ce * c, ce * s, se));
            let weight = wx * (t1 - t0) * w * (1.0 + tan * tan);
            (0..3).for_each(|k| sum[k] += weight * v[k]);
        }
        sum
    }

    /// ∫ f dω. `pieces` gives, at an elevation, the intervals of azimuth inside the domain, measured from the
    /// mirror direction. `breaks`, ascending, are the elevations at which the outline has a corner; the first
    /// and the last are its ends.
    fn integrate(
        &self,
        breaks: &[f64],
        pieces: &dyn Fn(f64, &mut Pieces<'_>),
        f: &dyn Fn(DVec3) -> [f64; 3],
    ) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for ends in breaks.windows(2) {
            let mut a = ends[0].max(0.0);
            while a < ends[1] {
                let b = self.next(a).min(ends[1]);
                for &(x, wx) in nodes(UP) {
                    let (s, c) = (PI * x).sin_cos();
                    let e = a + 0.5 * (b - a) * (1.0 - c);
                    let weight = wx * FRAC_PI_2 * (b - a) * s * e.cos();
                    pieces(e, &mut |piece| {
                        let v = self.across(e, piece, f);
                        (0..3).for_each(|k| sum[k] += weight * v[k]);
                    });
                }
                a = b;
            }
        }
        sum
    }

    /// ∫ f dω over a disk.
    pub fn disk(&self, centre: DVec3, radius: f64, f: &dyn Fn(DVec3) -> [f64; 3]) -> [f64; 3] {
        let middle = centre.z.clamp(-1.0, 1.0).asin();
        let off = self.off(centre);
        let top = (0.5 * radius).sin().powi(2);
        let pieces = |e: f64, piece: &mut Pieces<'_>| {
            let square =
                (top - (0.5 * (e - middle)).sin().powi(2)).max(0.0) / (e.cos() * middle.cos()).max(1e-12);
            let half = 2.0 * square.sqrt().min(1.0).asin();
            piece([off - half, off + half]);
        };
        self.integrate(&[middle - radius, middle + radius], &pieces, f)
    }

    /// Azimuth relative to the mirror direction, −π … π.
    fn off(&self, d: DVec3) -> f64 {
        let x = d.y.atan2(d.x) - self.azimuth;
        x - TAU * (x / TAU).round()
    }

    /// ∫ f dω over where all of d·a ≥ k.
    pub fn polygon(
        &self,
        sides: &[(DVec3, f64); 4],
        breaks: &[f64],
        f: &dyn Fn(DVec3) -> [f64; 3],
    ) -> [f64; 3] {
        let pieces = |e: f64, piece: &mut Pieces<'_>| {
            let (se, ce) = e.sin_cos();
            // Azimuths at which the circle of this elevation crosses the sides.
            let (mut at, mut count) = ([-PI, PI, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 2);
            for (a, k) in sides {
                let q = (k - a.z * se) / (ce * a.x.hypot(a.y)).max(1e-300);
                if q.abs() < 1.0 {
                    let (middle, half) = (self.off(*a), q.acos());
                    for x in [middle - half, middle + half] {
                        at[count] = x - TAU * (x / TAU).round();
                        count += 1;
                    }
                }
            }
            at[..count].sort_by(f64::total_cmp);
            for ends in at[..count].windows(2) {
                let (s, c) = (self.azimuth + 0.5 * (ends[0] + ends[1])).sin_cos();
                let d = DVec3::new(ce * c, ce * s, se);
                if ends[1] > ends[0] && sides.iter().all(|(a, k)| d.dot(*a) >= *k) {
                    piece([ends[0], ends[1]]);
                }
            }
        };
        self.integrate(breaks, &pieces, f)
    }
}
