//! Symmetries of a reflectance.

use crate::Brdf;
use glam::{DVec2, DVec3};
use steradian_sphere::sampling::{R2, hemisphere};

/// Transformations of both directions that leave f unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Symmetry {
    /// Turns about the normal.
    pub isotropic: bool,
    /// Mirrors in the planes of normal and tangent, and of normal and bitangent.
    pub mirrored: bool,
    /// The exchange of light and view.
    pub reciprocal: bool,
}

/// Number of pairs of directions that are tried.
const PAIRS: u32 = 512;
/// Relative difference up to which values count as equal.
const SAME: f64 = 1e-6;

impl Symmetry {
    /// Finds mirror symmetry and reciprocity by trial; isotropy is what the model declares.
    pub fn of(brdf: &dyn Brdf) -> Self {
        let (mut mirrored, mut reciprocal) = (true, true);
        let (lattice, mut alike) = (R2::default(), true);
        for k in 0..PAIRS {
            let u = lattice.point(k);
            let wo = hemisphere::sample(u);
            let v = DVec2::new((7.31 * u.x + 0.3).fract(), (5.17 * u.y + 0.1).fract());
            let wi = brdf.sample(wo, v).map_or_else(|| hemisphere::sample(v), |s| s.wi);
            if wi.z <= 0.0 || wo.z <= 0.0 {
                continue;
            }
            let f = brdf.eval(wi, wo);
            let same = |g: [f64; 3]| (0..3).all(|c| (f[c] - g[c]).abs() <= SAME * f[c].abs().max(g[c].abs()));
            for m in [DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, -1.0, 1.0)] {
                mirrored &= same(brdf.eval(m * wi, m * wo));
            }
            alike &= same(brdf.eval(wo, wi));
        }
        reciprocal &= alike;
        Self { isotropic: brdf.is_isotropic(), mirrored, reciprocal }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse;

    #[test]
    fn symmetries_of_models() {
        for (spec, isotropic, mirrored, reciprocal) in [
            ("lambert", true, true, true),
            ("ggx:alpha=0.3", true, true, true),
            ("ward:ax=0.15,ay=0.4,variant=1992", false, true, true),
            ("blinn-phong-gl:n=20", true, true, false),
        ] {
            let s = Symmetry::of(&*parse(spec).expect(spec));
            assert_eq!(s, Symmetry { isotropic, mirrored, reciprocal }, "{spec}");
        }
    }
}
