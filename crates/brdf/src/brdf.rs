//! The trait that every reflectance model implements.

use crate::{BrdfShader, Form, Peak};
use glam::{DVec2, DVec3};
use std::fmt::Debug;
use steradian_base::ParamInfo;

/// Where f_cos may be non-zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// wi above the horizon only.
    Hemisphere,
    /// The whole sphere (map kernels).
    Sphere,
}

/// How reciprocity or energy conservation holds.
pub type Statement = &'static str;

/// What a model says of itself; `inspect brdf:SPEC` prints it.
#[derive(Debug, Clone, Copy)]
pub struct Info {
    /// Name in a spec string.
    pub name: &'static str,
    /// Author, year, title, equation.
    pub source: &'static str,
    /// The formula.
    pub formula: &'static str,
    /// Units of what the formula gives.
    pub units: &'static str,
    /// Parameters; every model takes `scale` beside them.
    pub parameters: &'static [ParamInfo],
    /// Is f(wi, wo) = f(wo, wi)?
    pub reciprocity: Statement,
    /// Is the albedo at most 1?
    pub energy: Statement,
}

/// Where f_cos(·, wo) is concentrated: integrators refine there. All in the local frame.
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
    /// What the model is.
    fn info(&self) -> &'static Info;

    /// The spec string that makes this very reflectance.
    fn spec(&self) -> String;

    /// What the files hold that the spec names, in the order of the model's own: with it
    /// ([`crate::Files::Held`]) the spec makes the reflectance again without the files. `None` where the spec
    /// names none.
    fn held(&self) -> Option<Vec<f64>> {
        None
    }

    /// What was found in the measurements that whoever uses them should know, one line each: cells that are
    /// missing and how they were filled, negative values. Empty for formulas.
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

    /// [`Brdf::f_cos`] of many directions to the light, into `out`: one call through the trait, and what
    /// depends on `wo` alone is computed once.
    fn f_cos_batch(&self, wi: &[DVec3], wo: DVec3, out: &mut [[f64; 3]]) {
        for (f, wi) in out.iter_mut().zip(wi) {
            *f = self.f_cos(*wi, wo);
        }
    }

    /// Where `f_cos` may be non-zero.
    fn domain(&self) -> Domain {
        Domain::Hemisphere
    }

    /// Is f unchanged when wi and wo turn together about n?
    fn is_isotropic(&self) -> bool {
        true
    }

    /// Where f_cos(·, wo) is concentrated; empty for smooth reflectance.
    fn lobes(&self, wo: DVec3) -> Vec<Lobe>;

    /// How sharply f_cos varies where, as direct lights need it; by default the narrowest lobe at normal
    /// view.
    fn peak(&self) -> Peak {
        let width = |l: &Lobe| match *l {
            Lobe::Axis { width, .. } | Lobe::Cone { width, .. } | Lobe::Arc { width, .. } => width,
        };
        let narrowest = self.lobes(DVec3::Z).iter().map(width).min_by(f64::total_cmp);
        narrowest.map_or(Peak::Smooth, |width| Peak::Anywhere { width })
    }

    /// The reflectance as plain data, where it is of a family that techniques know.
    fn form(&self) -> Form {
        Form::Other
    }

    /// The same reflectance as plain data for a GPU; `None` where it has no WGSL text.
    fn shader(&self) -> Option<BrdfShader> {
        None
    }

    /// Draws wi for `wo` from two uniform numbers; `None` where the model gives no direction.
    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample>;

    /// Density of [`Brdf::sample`] at `wi`, per steradian.
    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64;
}
