//! The trait that every reflectance model implements.

use crate::{BrdfShader, Form, Peak};
use glam::{DVec2, DVec3};
use std::fmt::Debug;
use steradian_base::ParamInfo;

/// Directions of light for which f_cos may be non-zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// wi above the horizon only.
    Hemisphere,
    /// The whole sphere (map kernels).
    Sphere,
}

/// Statement of how far reciprocity or energy conservation holds.
pub type Statement = &'static str;

/// Description of a model; `inspect brdf:SPEC` prints it.
#[derive(Debug, Clone, Copy)]
pub struct Info {
    /// Name in a spec string.
    pub name: &'static str,
    /// Author, year, title, equation.
    pub source: &'static str,
    /// The formula.
    pub formula: &'static str,
    /// Units of the formula's value.
    pub units: &'static str,
    /// Parameters of the model; `scale`, which every model takes, is not listed.
    pub parameters: &'static [ParamInfo],
    /// Is f(wi, wo) = f(wo, wi)?
    pub reciprocity: Statement,
    /// Is the albedo at most 1?
    pub energy: Statement,
}

/// Directions about which f_cos(·, wo) is concentrated, in the local frame: integrators refine there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lobe {
    /// A peak around `axis` whose narrowest angular standard deviation is about `width` radians.
    Axis {
        /// Unit direction of the peak.
        axis: DVec3,
        /// Radians.
        width: f64,
    },
    /// A ridge along the cone `axis·wi = cosine`, about `width` radians wide.
    Cone {
        /// Unit axis.
        axis: DVec3,
        /// Cosine of the cone's half angle.
        cosine: f64,
        /// Radians.
        width: f64,
    },
    /// A ridge along a great circle (the highlight of strongly anisotropic models is an arc).
    Arc {
        /// Unit normal of the great circle.
        normal: DVec3,
        /// Radians.
        width: f64,
    },
}

/// A direction drawn by [`Brdf::sample`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Local direction to the light.
    pub wi: DVec3,
    /// Probability density per steradian.
    pub pdf: f64,
}

/// A shared reflectance.
pub type SharedBrdf = std::sync::Arc<dyn Brdf>;

/// Reflectance in the local frame (t = x, b = y, n = z); `wi` points to the light, `wo` to the viewer, both
/// away from the surface and of unit length. Values are per RGB channel.
pub trait Brdf: Debug + Send + Sync {
    /// Description of the model.
    fn info(&self) -> &'static Info;

    /// The spec string that makes this very reflectance.
    fn spec(&self) -> String;

    /// Contents of the files that the spec names, as numbers in an order of the model's own. With them
    /// ([`crate::Files::Held`]) the spec restores the reflectance without the files. `None` where the spec
    /// names none.
    fn held(&self) -> Option<Vec<f64>> {
        None
    }

    /// Is it interpolated between tabulated values, with a crease at the border of every cell? Quadratures
    /// that add up the error estimates of their parts then state errors that are far too large.
    fn is_interpolated(&self) -> bool {
        false
    }

    /// Findings in the measurements that users should know, one line each: missing cells and how they were
    /// filled, negative values. Empty for formulas.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }

    /// f(wi, wo) in sr⁻¹, without the cosine; 0 where n·wi ≤ 0 or n·wo ≤ 0.
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3];

    /// f · ⟨n·wi⟩₊; models that are defined with the cosine in override it (and may cover the whole sphere).
    fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if wi.z <= 0.0 {
            return [0.0; 3];
        }
        self.eval(wi, wo).map(|f| f * wi.z)
    }

    /// [`Brdf::f_cos`] for many directions to the light, into `out`: one call through the trait, and terms
    /// that depend on `wo` alone are computed once.
    fn f_cos_batch(&self, wi: &[DVec3], wo: DVec3, out: &mut [[f64; 3]]) {
        for (f, wi) in out.iter_mut().zip(wi) {
            *f = self.f_cos(*wi, wo);
        }
    }

    /// Directions of light for which `f_cos` may be non-zero.
    fn domain(&self) -> Domain {
        Domain::Hemisphere
    }

    /// Is f unchanged when wi and wo turn together about n?
    fn is_isotropic(&self) -> bool {
        true
    }

    /// The directions about which f_cos(·, wo) is concentrated; empty for smooth reflectance.
    fn lobes(&self, wo: DVec3) -> Vec<Lobe>;

    /// Location and width of the narrowest features of f_cos, as quadrature over direct lights needs them; by
    /// default the narrowest lobe at normal view, at an unknown location.
    fn peak(&self) -> Peak {
        let width = |l: &Lobe| match *l {
            Lobe::Axis { width, .. } | Lobe::Cone { width, .. } | Lobe::Arc { width, .. } => width,
        };
        let narrowest = self.lobes(DVec3::Z).iter().map(width).min_by(f64::total_cmp);
        narrowest.map_or(Peak::Smooth, |width| Peak::Anywhere { width })
    }

    /// The reflectance as plain data, where it belongs to a family of [`Form`].
    fn form(&self) -> Form {
        Form::Other
    }

    /// The reflectance as plain data for a GPU; `None` where it has no WGSL text.
    fn shader(&self) -> Option<BrdfShader> {
        None
    }

    /// Draws wi for `wo` from two uniform numbers; `None` where the model gives no direction.
    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample>;

    /// Density of [`Brdf::sample`] at `wi`, per steradian.
    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64;
}
