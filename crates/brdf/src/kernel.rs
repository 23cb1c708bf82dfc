//! The kernel of a prefiltered map.

use crate::SharedBrdf;
use glam::DVec3;

/// f_cos at normal view of an isotropic reflectance, as a function of cos θ between wi and n = wo = r: the
/// zonal kernel that a radially symmetric prefilter applies (n = v = r). Kernels over the sphere are given
/// for cos θ < 0 too.
#[derive(Debug, Clone)]
pub struct NormalKernel {
    brdf: SharedBrdf,
}

impl NormalKernel {
    /// `None` for an anisotropic reflectance, whose kernel is not zonal.
    pub fn new(brdf: SharedBrdf) -> Option<Self> {
        brdf.is_isotropic().then_some(Self { brdf })
    }

    /// The value at `cosine` = wi·r, −1 … 1.
    pub fn value(&self, cosine: f64) -> [f64; 3] {
        let c = cosine.clamp(-1.0, 1.0);
        self.brdf.f_cos(DVec3::new((1.0 - c * c).sqrt(), 0.0, c), DVec3::Z)
    }

    /// The value at an angle, accurate for narrow lobes.
    pub fn at_angle(&self, theta: f64) -> [f64; 3] {
        let (s, c) = theta.sin_cos();
        self.brdf.f_cos(DVec3::new(s, 0.0, c), DVec3::Z)
    }

    /// The angular width (standard deviation, radians) of the narrowest peak; `None` for smooth kernels.
    pub fn width(&self) -> Option<f64> {
        let widths = self.brdf.lobes(DVec3::Z).into_iter().map(|l| match l {
            crate::Lobe::Axis { width, .. }
            | crate::Lobe::Cone { width, .. }
            | crate::Lobe::Arc { width, .. } => width,
        });
        widths.min_by(f64::total_cmp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lambert_is_the_clamped_cosine() {
        let k = NormalKernel::new(crate::parse("lambert").expect("spec")).expect("isotropic");
        assert!((k.value(0.5)[0] - 0.5 / std::f64::consts::PI).abs() < 1e-15);
        assert_eq!(k.value(-0.5), [0.0; 3]);
        assert_eq!(k.width(), None);
        assert!(NormalKernel::new(crate::parse("ward:ax=0.1,ay=0.2").expect("spec")).is_none());
    }
}
