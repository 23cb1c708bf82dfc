//! Reflectance as plain data.

use crate::Domain;
use crate::fit::gaussian::GaussianFit;
use crate::model::lafortune::Lafortune;
use crate::model::strand;
use crate::model::ward;

/// The analytic family of a reflectance with its numbers, for techniques that are made for it: they match on
/// this, never on a name. Formulas and sources are on the pages of the models that have the form; a user's
/// own reflectance may return it too, where it is that function.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Form {
    /// f = albedo/π ([`crate::model::lambert`]).
    Lambert {
        /// Directional-hemispherical reflectance.
        albedo: [f64; 3],
    },
    /// f_cos = factor · max(0, r·wi)^n ([`crate::model::phong`]).
    Phong {
        /// Exponent.
        n: f64,
        /// Factor per channel.
        factor: [f64; 3],
        /// Does the lobe end at the horizon?
        domain: Domain,
    },
    /// f = scale · D G₂ F/(4 n·wi n·wo) of GGX with Schlick's F ([`crate::model::ggx`]).
    Ggx {
        /// Widths along tangent and bitangent.
        alpha: [f64; 2],
        /// Reflectance at normal incidence.
        f0: [f64; 3],
        /// Factor per channel.
        scale: [f64; 3],
    },
    /// f = scale · D G F/(4 n·wi n·wo) of Beckmann's distribution with Schlick's F
    /// ([`crate::model::cook_torrance`]).
    CookTorrance {
        /// Rms slope.
        m: f64,
        /// Reflectance at normal incidence.
        f0: [f64; 3],
        /// Smith's masking instead of the V-cavity's?
        smith: bool,
        /// Factor per channel.
        scale: [f64; 3],
    },
    /// An anisotropic power of n·h with Schlick's F over a diffuse base
    /// ([`crate::model::ashikhmin_shirley`]).
    AshikhminShirley {
        /// Exponents along tangent and bitangent.
        exponents: [f64; 2],
        /// Specular reflectance at normal incidence.
        rs: [f64; 3],
        /// Diffuse reflectance below the specular layer.
        rd: [f64; 3],
        /// Factor per channel.
        scale: [f64; 3],
    },
    /// A layer of GGX with Schlick's F over a diffuse base, coupled by the layer's albedo
    /// ([`crate::model::dielectric`]).
    Dielectric {
        /// Width of the layer.
        alpha: f64,
        /// Reflectance of the layer at normal incidence.
        f0: [f64; 3],
        /// Reflectance of the base.
        albedo: [f64; 3],
        /// Factor per channel.
        scale: [f64; 3],
    },
    /// f = rd/π + rs · a Gaussian of the half vector's slopes, in one of three normalisations
    /// ([`crate::model::ward`]).
    Ward {
        /// Widths along tangent and bitangent.
        alpha: [f64; 2],
        /// Specular factor.
        rs: [f64; 3],
        /// Diffuse reflectance.
        rd: [f64; 3],
        /// The normalisation.
        variant: ward::Variant,
    },
    /// f = kd/π + ks (n·h)^n/(n·wi) ([`crate::model::blinn_phong`]).
    BlinnPhongGl {
        /// Diffuse albedo.
        kd: [f64; 3],
        /// Specular factor.
        ks: [f64; 3],
        /// Exponent.
        n: f64,
    },
    /// A power of the cosine between wi and a cone about the tangent ([`crate::model::strand`]).
    Strand {
        /// The cone, and whether the formula includes the cosine.
        kind: strand::Kind,
        /// Exponent.
        n: f64,
        /// Factor per channel.
        scale: [f64; 3],
    },
    /// Generalised cosine lobes and a diffuse part ([`crate::model::lafortune`]).
    Lafortune(Lafortune),
    /// A diffuse part and spherical Gaussians by the view ([`crate::model::lobes`]).
    Gaussians(GaussianFit),
    /// Any other.
    #[default]
    Other,
}

impl Form {
    /// The form of the reflectance times `by`, whose spec is `spec`.
    pub(crate) fn scaled(self, by: [f64; 3], spec: impl FnOnce() -> String) -> Self {
        let times = |v: [f64; 3]| std::array::from_fn(|c| v[c] * by[c]);
        match self {
            Self::Lambert { albedo } => Self::Lambert { albedo: times(albedo) },
            Self::Phong { n, factor, domain } => Self::Phong { n, factor: times(factor), domain },
            Self::Ggx { alpha, f0, scale } => Self::Ggx { alpha, f0, scale: times(scale) },
            Self::CookTorrance { m, f0, smith, scale } => {
                Self::CookTorrance { m, f0, smith, scale: times(scale) }
            }
            Self::AshikhminShirley { exponents, rs, rd, scale } => {
                Self::AshikhminShirley { exponents, rs, rd, scale: times(scale) }
            }
            Self::Dielectric { alpha, f0, albedo, scale } => {
                Self::Dielectric { alpha, f0, albedo, scale: times(scale) }
            }
            Self::Ward { alpha, rs, rd, variant } => {
                Self::Ward { alpha, rs: times(rs), rd: times(rd), variant }
            }
            Self::BlinnPhongGl { kd, ks, n } => Self::BlinnPhongGl { kd: times(kd), ks: times(ks), n },
            Self::Strand { kind, n, scale } => Self::Strand { kind, n, scale: times(scale) },
            Self::Lafortune(mut own) => {
                own.spec = spec();
                own.kd = times(own.kd);
                for lobe in &mut own.lobes {
                    lobe.iter_mut().zip(by).for_each(|(l, s)| l.ks *= s);
                }
                Self::Lafortune(own)
            }
            Self::Gaussians(fit) => Self::Gaussians(fit.scaled(by)),
            Self::Other => Self::Other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Brdf, parse};
    use glam::DVec3;
    use std::f64::consts::PI;

    /// The numbers of a form reproduce the reflectance, also with a factor.
    #[test]
    fn forms_hold_the_numbers() {
        let (wi, wo) = (DVec3::new(0.3, 0.2, 0.9).normalize(), DVec3::new(-0.4, 0.1, 0.8).normalize());
        let form = |spec: &str| parse(spec).expect(spec).form();
        for spec in ["lambert:albedo=0.5/0.2/0.1", "lambert:albedo=0.5,scale=0.5/1/2"] {
            let Form::Lambert { albedo } = form(spec) else { panic!("{spec}") };
            let f = parse(spec).expect(spec).eval(wi, wo);
            assert!((0..3).all(|c| (albedo[c] / PI - f[c]).abs() < 1e-15), "{spec}");
        }
        for (spec, end) in
            [("phong:n=9", true), ("phong-map:n=9", false), ("phong-normalized:s=9,scale=2", false)]
        {
            let Form::Phong { n, factor, domain } = form(spec) else { panic!("{spec}") };
            let f = parse(spec).expect(spec).f_cos(wi, wo)[1];
            let lobe = factor[1] * DVec3::new(-wo.x, -wo.y, wo.z).dot(wi).max(0.0).powf(n);
            assert!((f / lobe - 1.0).abs() < 1e-12 && (domain == Domain::Hemisphere) == end, "{spec}");
        }
        let ggx = Form::Ggx { alpha: [0.1, 0.2], f0: [0.9; 3], scale: [0.5; 3] };
        assert_eq!(form("ggx:ax=0.1,ay=0.2,f0=0.9,scale=0.5"), ggx);
        let rough = Form::CookTorrance { m: 0.2, f0: [1.0; 3], smith: false, scale: [1.0; 3] };
        assert_eq!(form("cook-torrance:m=0.2"), rough);
        let (rs, rd) = ([0.2; 3], [0.5; 3]);
        let brushed = Form::AshikhminShirley { exponents: [10.0, 90.0], rs, rd, scale: [0.5; 3] };
        assert_eq!(form("ashikhmin-shirley:nu=10,nv=90,rs=0.2,rd=0.5,scale=0.5"), brushed);
        let (f0, albedo) = ([0.04; 3], [0.5; 3]);
        let layered = Form::Dielectric { alpha: 0.2, f0, albedo, scale: [2.0; 3] };
        assert_eq!(form("dielectric:alpha=0.2,scale=2"), layered);
        let Form::Ward { alpha, rs, variant, .. } = form("ward:ax=0.1,ay=0.4,rs=0.5,variant=duer,scale=0.5")
        else {
            panic!("ward")
        };
        assert_eq!((alpha, rs, variant), ([0.1, 0.4], [0.25; 3], ward::Variant::Duer));
        let hair = Form::Strand { kind: strand::Kind::KajiyaKay, n: 8.0, scale: [1.0; 3] };
        assert_eq!(form("kajiya-kay:s=8"), hair);
        let Form::Lafortune(skin) = form("lafortune:@skin,scale=0.5") else { panic!("skin") };
        assert_eq!(skin.eval(wi, wo), parse("lafortune:@skin,scale=0.5").expect("skin").eval(wi, wo));
        assert_eq!(form("sgd:alum-bronze"), Form::Other);
    }
}
