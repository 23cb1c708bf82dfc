//! Anisotropic Phong with Fresnel-coupled diffuse reflection.
//!
//! Ashikhmin & Shirley 2000, An Anisotropic Phong BRDF Model, eqs 4, 5 (h normalised, u = t, v = b):
//!
//! ρ_s = √((nu + 1)(nv + 1))/(8π) · (n·h)^((nu (h·u)² + nv (h·v)²)/(1 − (h·n)²)) / (h·wi max(n·wi, n·wo)) ·
//! F, F = rs + (1 − rs)(1 − wi·h)⁵; ρ_d = 28 rd/(23π) (1 − rs)(1 − (1 − n·wi/2)⁵)(1 − (1 − n·wo/2)⁵). **f =
//! ρ_s + ρ_d**

use crate::draw::{self, Draw};
use crate::math::{above, half, half_cosine, largest, pow5, schlick};
use crate::registry::Entry;
use crate::shader::{BrdfShader, with};
use crate::spec::{self, Args};
use crate::{Brdf, Form, Info, Lobe, Peak, Sample, SharedBrdf, SpecError, hint};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::ParamInfo;

/// The page.
pub static INFO: Info = Info {
    name: "ashikhmin-shirley",
    source: "Ashikhmin & Shirley 2000, eqs 4, 5",
    formula: "f = √((nu + 1)(nv + 1))/(8π) (n·h)^(nu cos²φ_h + nv sin²φ_h)/(h·wi max(n·wi, n·wo)) F(h·wi) \
              + 28 rd/(23π) (1 − rs)(1 − (1 − n·wi/2)⁵)(1 − (1 − n·wo/2)⁵), F = rs + (1 − rs)(1 − h·wi)⁵",
    units: "sr⁻¹",
    parameters: &[
        ParamInfo::real("nu", [0.0, 1e8], 0.0, "exponent along the tangent").required(),
        ParamInfo::real("nv", [0.0, 1e8], 0.0, "exponent along the bitangent").required(),
        ParamInfo::rgb("rs", [0.0, 1.0], 1.0, "specular reflectance at normal incidence"),
        ParamInfo::rgb("rd", [0.0, 1.0], 0.0, "diffuse reflectance below the specular layer"),
    ],
    reciprocity: "reciprocal",
    energy: "albedo ≤ 1",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    Ok(Arc::new(AshikhminShirley {
        nu: a.number("nu")?,
        nv: a.number("nv")?,
        rs: a.rgb("rs")?,
        rd: a.rgb("rd")?,
    }))
}

/// Ashikhmin and Shirley's anisotropic Phong.
#[derive(Debug, Clone, Copy)]
pub struct AshikhminShirley {
    nu: f64,
    nv: f64,
    rs: [f64; 3],
    rd: [f64; 3],
}

/// ln(1 − x)/x, with its limit at 0.
fn ln_ratio(x: f64) -> f64 {
    if x < 1e-8 { -1.0 - 0.5 * x } else { (-x).ln_1p() / x }
}

/// √((nu + 1)(nv + 1))/(8π) (n·h)^(nu cos²φ_h + nv sin²φ_h) of a unit half vector, sr⁻¹, where
/// (n·h)^e = exp(½ ln(1 − s²)(nu h_x² + nv h_y²)/s²), s² = h_x² + h_y².
pub fn power(h: DVec3, nu: f64, nv: f64) -> f64 {
    let (x2, y2) = (h.x * h.x, h.y * h.y);
    let s2 = (x2 + y2).min(1.0 - f64::EPSILON);
    let power = (0.5 * ln_ratio(s2) * (nu * x2 + nv * y2)).exp();
    ((nu + 1.0) * (nv + 1.0)).sqrt() / (8.0 * PI) * power
}

/// The diffuse part without rd (1 − rs): 28/(23π) (1 − (1 − n·wi/2)⁵)(1 − (1 − n·wo/2)⁵), sr⁻¹.
pub fn base(cos_i: f64, cos_o: f64) -> f64 {
    let side = |z: f64| 1.0 - pow5(1.0 - 0.5 * z);
    28.0 / (23.0 * PI) * side(cos_i) * side(cos_o)
}

impl AshikhminShirley {
    /// ρ_s without F.
    fn lobe(&self, wi: DVec3, wo: DVec3, h: DVec3) -> f64 {
        power(h, self.nu, self.nv) / (half_cosine(wi, wo) * wi.z.max(wo.z)).max(1e-150)
    }

    fn draw(&self) -> [(f64, Draw); 2] {
        let q = if largest(self.rd) > 0.0 { 0.5 } else { 1.0 };
        let alpha = |n: f64| (2.0 / (n + 2.0)).sqrt();
        [(1.0 - q, Draw::Cosine), (q, Draw::Visible { ax: alpha(self.nu), ay: alpha(self.nv) })]
    }
}

impl Brdf for AshikhminShirley {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        let (nu, nv) = (("nu", self.nu.into()), ("nv", self.nv.into()));
        spec::print(&INFO, [nu, nv, ("rs", self.rs.into()), ("rd", self.rd.into())])
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        let h = half(wi, wo);
        let lobe = self.lobe(wi, wo, h);
        let fresnel = schlick(self.rs, half_cosine(wi, wo));
        let diffuse = base(wi.z, wo.z);
        std::array::from_fn(|c| lobe * fresnel[c] + diffuse * self.rd[c] * (1.0 - self.rs[c]))
    }

    fn is_isotropic(&self) -> bool {
        self.nu == self.nv
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        let slope = |n: f64| (1.0 / (n + 2.0)).sqrt();
        hint::half_vector(self, wo, slope(self.nu), slope(self.nv))
    }

    fn peak(&self) -> Peak {
        let width = |n: f64| 2.0 * (1.0 / (n + 2.0)).sqrt();
        Peak::Mirror { narrow: width(self.nu.max(self.nv)), wide: width(self.nu.min(self.nv)) }
    }

    fn form(&self) -> Form {
        let (exponents, scale) = ([self.nu, self.nv], [1.0; 3]);
        Form::AshikhminShirley { exponents, rs: self.rs, rd: self.rd, scale }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let parameters = [with(self.rs, self.nu), with(self.rd, self.nv)];
        Some(BrdfShader::new(include_str!("ashikhmin_shirley.wgsl"), self.peak(), self.domain(), parameters))
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(&self.draw(), wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(&self.draw(), wi, wo)
    }
}
