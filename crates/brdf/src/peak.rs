//! Width and location of a reflectance's narrowest features, as plain data, for quadrature over direct
//! lights.

use crate::math::mirror;
use glam::DVec3;

/// Position and width of the ridge of f_cos(·, wo): cheap enough for every point and light, on a CPU and on a
/// GPU. Widths are standard deviations in wi, radians, at normal view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Peak {
    /// No ridge: f_cos varies with the angles themselves.
    Smooth,
    /// About the mirror direction of wo; narrower towards grazing angles, as the smaller of n·wo and (n·wi +
    /// n·wo)/2.
    Mirror {
        /// Across the narrowest direction.
        narrow: f64,
        /// Across the widest.
        wide: f64,
    },
    /// Along the cone t·wi = sign · t·wo.
    Cone {
        /// −1 for reflection off fibres, +1 for Kajiya and Kay's.
        sign: f64,
        /// Radians.
        width: f64,
    },
    /// Somewhere.
    Anywhere {
        /// Radians.
        width: f64,
    },
}

/// Largest width, radians: no reflectance is treated as smoother.
const SMOOTH: f64 = 0.6;
/// Mean cosines are clamped to this, so that the peak does not become narrower still.
const GRAZING: f64 = 1e-4;

impl Peak {
    /// The angle over which f_cos(·, wo) varies within `radius` of `wi`, radians: the width of the ridge on
    /// it, and the more the farther away, as tails do.
    pub fn scale(&self, wi: DVec3, wo: DVec3, radius: f64) -> f64 {
        match *self {
            Self::Smooth => SMOOTH,
            Self::Mirror { narrow, wide } => {
                let from = wi - mirror(wo);
                let away = |x: f64| (x - radius - wide).max(0.0);
                let mean = 0.5 * (wi.z.max(0.0) + wo.z);
                let width = narrow * wo.z.min(mean).clamp(GRAZING, 1.0);
                // Above the ridge of a grazing view a tail is as narrow across as the half vector, at mean
                // height, tilts fast.
                let tail = away(from.x.hypot(from.y)).max(mean.clamp(GRAZING, 1.0) * away(from.z.abs()));
                width.max(0.5 * tail * (narrow / wide)).min(SMOOTH)
            }
            Self::Cone { sign, width } => {
                let angle = |x: f64| x.clamp(-1.0, 1.0).asin();
                let away = ((angle(wi.x) - angle(sign * wo.x)).abs() - radius).max(0.0);
                width.max(0.5 * away).min(SMOOTH)
            }
            Self::Anywhere { width } => width.min(SMOOTH),
        }
    }

    /// Kind, narrow, wide, in the order in which WGSL's `brdf_scale` reads them.
    pub(crate) fn packed(&self) -> [f32; 3] {
        match *self {
            Self::Smooth => [0.0, 1.0, 1.0],
            Self::Mirror { narrow, wide } => [1.0, narrow as f32, wide as f32],
            Self::Cone { sign, width } => [if sign < 0.0 { 2.0 } else { 3.0 }, width as f32, width as f32],
            Self::Anywhere { width } => [4.0, width as f32, width as f32],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sharp_at_the_ridge_and_smooth_far_from_it() {
        let wo = DVec3::new(0.6, 0.0, 0.8);
        let p = Peak::Mirror { narrow: 0.01, wide: 0.02 };
        assert!((p.scale(DVec3::new(-0.6, 0.0, 0.8), wo, 0.0) - 0.008).abs() < 1e-12);
        assert!((p.scale(DVec3::Z, wo, 0.1) - 0.25 * (0.6 - 0.12)).abs() < 1e-12);
        // Straight above the ridge of a grazing view: 0.1 up, and less than 0.01 sideways.
        let grazing = DVec3::new((1.0 - 0.03f64.powi(2)).sqrt(), 0.0, 0.03);
        let above = DVec3::new(-(1.0 - 0.13f64.powi(2)).sqrt(), 0.0, 0.13);
        assert!((p.scale(above, grazing, 0.0) - 0.25 * 0.08 * (0.1 - 0.02)).abs() < 1e-12);
        let p = Peak::Cone { sign: -1.0, width: 0.05 };
        assert_eq!(p.scale(DVec3::new(-0.6, 0.8, 0.0), wo, 0.0), 0.05);
        assert!(p.scale(DVec3::new(0.6, 0.8, 0.0), wo, 0.0) > 0.5);
        assert_eq!(Peak::Smooth.scale(wo, wo, 0.0), SMOOTH);
    }
}
