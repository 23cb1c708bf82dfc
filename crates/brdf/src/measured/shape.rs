//! Shape of a measured reflectance's highlight, found by evaluating it, for samplers, hints and the peak.

use crate::draw::Draw;
use crate::math::{largest, spherical};
use crate::{Brdf, Lobe, Peak, hint};
use glam::DVec3;
use std::f64::consts::PI;

/// Smallest tilt of the half vector that is sampled, radians: less than the finest cell of MERL's tables, 0.2
/// milliradians.
const MIN_TILT: f64 = 1e-4;
/// Number of tilts that are sampled: each is 1.058 times the one before, so that a width, read off as one of
/// them, is less than 6 % too large.
const TILTS: usize = 160;
/// Tilts of the half vector beyond this, radians, are not sampled: only the diffuse part is left there.
const MAX_TILT: f64 = 0.75;
/// Tilts of the half vector from here on, radians, determine the diffuse part: D of a GGX of width 0.2 is
/// down to 3 % of its peak there.
const DIFFUSE_TILT: f64 = 0.45;
/// Angle of the view from the normal, radians: the half vector of retro-reflection, the view itself, is at
/// least as far from every half vector of the profile.
const VIEW_ANGLE: f64 = 0.5;

/// A distribution of half vectors like the measured one: a GGX of the highlight's core, one of its reach, a
/// diffuse part, and retro-reflection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shape {
    /// Width α of a GGX with the profile's width at a quarter of its height; `None` where there is no
    /// highlight.
    core: Option<f64>,
    /// Width α of a GGX that has four fifths of its energy within the same angle as the profile.
    reach: f64,
    /// Share of the diffuse part.
    diffuse: f64,
    retro: Option<Retro>,
}

/// A lobe about the view.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Retro {
    /// Angle at which half of its height is left, radians.
    core: f64,
    /// Angle within which four fifths of it lie.
    reach: f64,
    /// Share of the reflected light.
    share: f64,
}

/// Angles from [`MIN_TILT`] to [`MAX_TILT`], by a constant ratio.
fn angles() -> (Vec<f64>, f64) {
    let ratio = (MAX_TILT / MIN_TILT).powf(1.0 / (TILTS - 1) as f64);
    ((0..TILTS).map(|i| MIN_TILT * ratio.powi(i as i32)).collect(), ratio.ln())
}

impl Shape {
    /// Measures f(wi, wo): its profile over the angle of the half vector, across the plane of incidence.
    /// Where f is anisotropic, the narrowest of four planes.
    pub fn measure(f: &dyn Fn(DVec3, DVec3) -> [f64; 3], isotropic: bool) -> Self {
        let first = Self::in_plane(f, 0.0);
        if isotropic {
            return first;
        }
        (1..4).map(|k| Self::in_plane(f, 0.25 * PI * f64::from(k))).fold(first, |a, b| {
            let core = match (a.core, b.core) {
                (Some(a), Some(b)) => Some(a.min(b)),
                (a, b) => a.or(b),
            };
            // A highlight broad in one plane may be narrow in another.
            let reach = [a, b].iter().filter(|s| s.core.is_some()).map(|s| s.reach).fold(0.0, f64::max);
            let reach = if core.is_some() { reach } else { 1.0 };
            Self { core, reach, diffuse: a.diffuse.min(b.diffuse).max(0.15), retro: a.retro.or(b.retro) }
        })
    }

    /// Measures at a view of the azimuth `phi`.
    fn in_plane(f: &dyn Fn(DVec3, DVec3) -> [f64; 3], phi: f64) -> Self {
        let wo = spherical(VIEW_ANGLE, phi);
        let aside = DVec3::new(-phi.sin(), phi.cos(), 0.0);
        let (angles, step) = angles();
        let value = |wi: DVec3| largest(f(wi, wo));
        let mirrored = |t: f64| {
            let h = aside * t.sin() + DVec3::Z * t.cos();
            value(2.0 * wo.dot(h) * h - wo)
        };
        let profile: Vec<f64> = angles.iter().map(|t| mirrored(*t)).collect();
        let back = |t: f64| value(wo * t.cos() + aside * t.sin());
        let behind: Vec<f64> = angles.iter().map(|t| back(*t)).collect();
        // Far from the mirror direction, the nearly even part is the diffuse part.
        let far = angles.iter().zip(&profile).filter(|(t, _)| **t > DIFFUSE_TILT);
        let base = far.map(|(_, v)| *v).fold(0.0, f64::max);
        let mut shape = Self { core: None, reach: 1.0, diffuse: 1.0, retro: None };
        let mut specular = 0.0;
        let peak = profile.iter().copied().fold(0.0, f64::max);
        if peak > 1.3 * base && peak > 0.0 {
            let above: Vec<f64> = profile.iter().map(|v| (v - base).max(0.0)).collect();
            let top = above.iter().position(|v| *v >= 0.999 * (peak - base)).unwrap_or(0);
            let fallen = (top..TILTS).find(|i| above[*i] <= 0.25 * (peak - base)).unwrap_or(TILTS - 1);
            let core = angles[fallen].tan();
            // ∫ 4 cos θ_h sin θ_h dθ_h dφ with dθ_h = θ_h d ln θ_h: the solid angle of wi near the mirror
            // direction.
            let part = |i: usize| above[i] * 4.0 * angles[i].cos() * angles[i].sin() * angles[i];
            let (total, four_fifths) = parts(part);
            // A GGX holds t²/(α² + t²) of itself within tan θ_h = t: four fifths at t = 2α.
            shape.core = Some(core);
            shape.reach = (0.5 * angles[four_fifths].tan()).clamp(core, 1.0);
            specular = 2.0 * PI * step * total * VIEW_ANGLE.cos();
        }
        let (retro, returned) = Retro::measure(&angles, step, &behind, mirrored(VIEW_ANGLE));
        let even = PI * base.min(behind[TILTS - 1]);
        let all = (even + specular + returned).max(f64::MIN_POSITIVE);
        if shape.core.is_some() || retro.is_some() {
            shape.diffuse = (even / all).clamp(0.15, 0.9);
        }
        let rest = (specular + returned).max(f64::MIN_POSITIVE);
        shape.retro = retro.map(|r| Retro { share: (returned / rest).clamp(0.1, 1.0), ..r });
        shape
    }

    /// The densities to draw from, with their weights.
    pub fn draw(&self, wo: DVec3) -> [(f64, Draw); 5] {
        let rest = 1.0 - self.diffuse;
        let returned = rest * self.retro.map_or(0.0, |r| if self.core.is_some() { r.share } else { 1.0 });
        let specular = rest - returned;
        let (core, reach) = (self.core.unwrap_or(1.0), self.reach);
        // cos^n falls to a half at the angle t where n = −ln 2/ln cos t.
        let power = |t: f64| Draw::Power { axis: wo, n: (-2f64.ln() / t.cos().ln()).clamp(1.0, 1e8) };
        let (near, wide) = self.retro.map_or((0.5, 0.5), |r| (r.core, r.reach));
        [
            (self.diffuse, Draw::Cosine),
            (0.6 * specular, Draw::Visible { ax: reach, ay: reach }),
            (0.4 * specular, Draw::Visible { ax: core, ay: core }),
            (0.5 * returned, power(near)),
            (0.5 * returned, power(wide)),
        ]
    }

    /// Where integrators refine.
    pub fn lobes(&self, brdf: &dyn Brdf, wo: DVec3) -> Vec<Lobe> {
        let mut lobes = Vec::new();
        if let Some(core) = self.core {
            lobes.extend(hint::half_vector(brdf, wo, core, core));
            if self.reach > 2.0 * core {
                lobes.extend(hint::half_vector(brdf, wo, 0.5 * self.reach, 0.5 * self.reach));
            }
        }
        if let Some(retro) = self.retro {
            let axis = DVec3::new(wo.x, wo.y, wo.z.max(0.0)).normalize_or(DVec3::Z);
            lobes.push(Lobe::Axis { axis, width: 0.85 * retro.core });
            if retro.reach > 2.0 * retro.core {
                lobes.push(Lobe::Axis { axis, width: 0.5 * retro.reach });
            }
        }
        lobes
    }

    pub fn peak(&self) -> Peak {
        match (self.core, self.retro) {
            (None, None) => Peak::Smooth,
            (Some(core), None) => Peak::Mirror { narrow: core, wide: core },
            (core, Some(retro)) => {
                Peak::Anywhere { width: core.unwrap_or(f64::INFINITY).min(0.85 * retro.core) }
            }
        }
    }
}

/// The sum of all steps, and the step up to which four fifths of it lie.
fn parts(part: impl Fn(usize) -> f64) -> (f64, usize) {
    let total: f64 = (0..TILTS).map(&part).sum();
    let mut sum = 0.0;
    let four_fifths = (0..TILTS).find(|i| {
        sum += part(*i);
        sum >= 0.8 * total
    });
    (total, four_fifths.unwrap_or(TILTS - 1))
}

impl Retro {
    /// The lobe about the view with the profile `behind`, and its albedo; `forward` is f at the same tilt of
    /// the half vector to the side: only values well above it are retro-reflection.
    fn measure(angles: &[f64], step: f64, behind: &[f64], forward: f64) -> (Option<Self>, f64) {
        let far = angles.iter().zip(behind).filter(|(t, _)| **t > DIFFUSE_TILT).map(|(_, v)| *v);
        let base = far.fold(0.0, f64::max);
        let top = behind.iter().copied().fold(0.0, f64::max);
        if top <= 1.5 * base || top <= 1.5 * forward || top <= 0.0 {
            return (None, 0.0);
        }
        let above: Vec<f64> = behind.iter().map(|v| (v - base).max(0.0)).collect();
        let peak = above.iter().position(|v| *v >= 0.999 * (top - base)).unwrap_or(0);
        let half = (peak..TILTS).find(|i| above[*i] <= 0.5 * (top - base)).unwrap_or(TILTS - 1);
        let (total, four_fifths) = parts(|i| above[i] * angles[i].sin() * angles[i]);
        let core = angles[half];
        let reach = angles[four_fifths].max(core);
        (Some(Self { core, reach, share: 1.0 }), 2.0 * PI * step * total * VIEW_ANGLE.cos())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse;

    #[test]
    fn widths_of_what_is_known() {
        for alpha in [0.003, 0.05, 0.2] {
            let brdf = parse(&format!("ggx:alpha={alpha}")).expect("spec");
            let shape = Shape::measure(&|i, o| brdf.eval(i, o), true);
            let core = shape.core.expect("a highlight");
            // A GGX falls to a quarter at tan θ_h = α.
            assert!((core / alpha - 1.0).abs() < 0.1, "{alpha}: {shape:?}");
            assert!((shape.reach / alpha - 1.0).abs() < 0.25, "{alpha}: {shape:?}");
        }
        let lambert = parse("lambert").expect("spec");
        assert_eq!(Shape::measure(&|i, o| lambert.eval(i, o), true).peak(), Peak::Smooth);
        let both = parse("ashikhmin-shirley:nu=5000,nv=5000,rs=0.04,rd=0.5").expect("spec");
        let shape = Shape::measure(&|i, o| both.eval(i, o), true);
        assert!(shape.diffuse > 0.8 && shape.core.expect("a highlight") < 0.03, "{shape:?}");
    }
    #[test]
    fn what_goes_back_is_found() {
        // A Gaussian of 0.1 radians about the view over a diffuse part.
        let f = |i: DVec3, o: DVec3| [0.1 + 5.0 * (-0.5 * (i.angle_between(o) / 0.1).powi(2)).exp(); 3];
        let shape = Shape::measure(&f, true);
        assert_eq!(shape.core, None);
        let retro = shape.retro.expect("a lobe");
        assert!((retro.core / 0.1177 - 1.0).abs() < 0.1, "{shape:?}");
        assert!(matches!(shape.peak(), Peak::Anywhere { width } if (0.08..0.12).contains(&width)));
        for spec in ["ggx:alpha=0.5", "oren-nayar:sigma=0.3", "ward:alpha=0.3,rd=0.3"] {
            let brdf = parse(spec).expect("spec");
            assert_eq!(Shape::measure(&|i, o| brdf.eval(i, o), true).retro, None, "{spec}");
        }
        let ward = parse("ward:ax=0.05,ay=0.3").expect("spec");
        let core = Shape::measure(&|i, o| ward.eval(i, o), false).core.expect("a highlight");
        assert!((0.03..0.12).contains(&core), "{core}");
    }
}
