//! Powers of n·h.
//!
//! - `blinn-phong`: Blinn 1977, Models of Light Reflection for Computer Synthesized Pictures, with the usual
//!   normalisation (Akenine-Möller, Haines, Hoffman 2008, Real-Time Rendering, 3rd ed., eq. 7.48):
//!   **f = (N + 8)/(8π) (n·h)^N**.
//! - `blinn-phong-gl`: Kautz 2004, Hardware Lighting and Shading: a Survey, eq. 11, what OpenGL's fixed
//!   function evaluates: **f = kd/π + ks (n·h)^N/(n·wi)**, so that f_cos = kd n·wi/π + ks (n·h)^N.

use crate::draw::{self, Draw};
use crate::math::{INV_PI, above, half, largest, power_cosine};
use crate::registry::Entry;
use crate::shader::{BrdfShader, with};
use crate::spec::{self, Args};
use crate::{Brdf, Form, Info, Lobe, Peak, Sample, SharedBrdf, SpecError, hint};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::ParamInfo;

/// The page of `blinn-phong`.
pub static INFO: Info = Info {
    name: "blinn-phong",
    source: "Blinn 1977; normalised as in Akenine-Möller, Haines, Hoffman 2008, eq. 7.48",
    formula: "f = (n + 8)/(8π) (n·h)^n",
    units: "sr⁻¹",
    parameters: &[ParamInfo::real("n", [0.0, 1e8], 0.0, "exponent").required()],
    reciprocity: "reciprocal",
    energy: "not conserved: the factor (n + 8)/8π is an approximation, albedo up to 1.076 at normal view (n = 9)",
};

/// The page of `blinn-phong-gl`.
pub static GL_INFO: Info = Info {
    name: "blinn-phong-gl",
    source: "Kautz 2004 (STAR), eq. 11",
    formula: "f = kd/π + ks (n·h)^n/(n·wi)",
    units: "f sr⁻¹; the specular term is not normalised",
    parameters: &[
        ParamInfo::rgb("kd", [0.0, 1.0], 0.0, "diffuse albedo"),
        ParamInfo::rgb("ks", [0.0, f64::INFINITY], 1.0, "specular factor"),
        ParamInfo::real("n", [0.0, 1e8], 0.0, "exponent").required(),
    ],
    reciprocity: "not reciprocal: the division by n·wi alone breaks the symmetry",
    energy: "not conserved: the specular term is not normalised",
};

/// Both models' text.
const WGSL: &str = include_str!("blinn_phong.wgsl");

pub(crate) const ENTRY: Entry =
    Entry { info: &INFO, make: |a| Ok(Arc::new(BlinnPhong { n: a.number("n")? })) };

pub(crate) const GL: Entry = Entry { info: &GL_INFO, make: make_gl };

fn make_gl(a: &Args) -> Result<SharedBrdf, SpecError> {
    Ok(Arc::new(BlinnPhongGl { kd: a.rgb("kd")?, ks: a.rgb("ks")?, n: a.number("n")? }))
}

/// The width of the GGX lobe that samples cos^n.
fn alpha(n: f64) -> f64 {
    (2.0 / (n + 2.0)).sqrt()
}

/// The slope deviation of cos^n.
fn slope(n: f64) -> f64 {
    (1.0 / (n + 2.0)).sqrt()
}

/// Normalised Blinn–Phong.
#[derive(Debug, Clone, Copy)]
pub struct BlinnPhong {
    /// Exponent.
    pub n: f64,
}

impl BlinnPhong {
    fn draw(&self) -> [(f64, Draw); 1] {
        [(1.0, Draw::Visible { ax: alpha(self.n), ay: alpha(self.n) })]
    }
}

impl Brdf for BlinnPhong {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        spec::print(&INFO, [("n", self.n.into())])
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        [(self.n + 8.0) / (8.0 * PI) * power_cosine(DVec3::Z, half(wi, wo), self.n); 3]
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        hint::half_vector(self, wo, slope(self.n), slope(self.n))
    }

    fn peak(&self) -> Peak {
        Peak::Mirror { narrow: 2.0 * slope(self.n), wide: 2.0 * slope(self.n) }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let parameters = [with([0.0; 3], self.n), with([0.0; 3], (self.n + 8.0) / (8.0 * PI))];
        Some(BrdfShader::new(WGSL, self.peak(), self.domain(), parameters).with_f_cos())
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(&self.draw(), wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(&self.draw(), wi, wo)
    }
}

/// STAR04's eq. 11.
#[derive(Debug, Clone, Copy)]
pub struct BlinnPhongGl {
    /// Diffuse albedo.
    pub kd: [f64; 3],
    /// Specular factor.
    pub ks: [f64; 3],
    /// Exponent.
    pub n: f64,
}

impl BlinnPhongGl {
    fn draw(&self) -> [(f64, Draw); 2] {
        let specular = largest(self.ks) * 8.0 * PI / (self.n + 8.0);
        let diffuse = largest(self.kd);
        let q = if specular + diffuse > 0.0 { (specular / (specular + diffuse)).max(0.1) } else { 0.0 };
        [(1.0 - q, Draw::Cosine), (q, Draw::Visible { ax: alpha(self.n), ay: alpha(self.n) })]
    }
}

impl Brdf for BlinnPhongGl {
    fn info(&self) -> &'static Info {
        &GL_INFO
    }

    fn spec(&self) -> String {
        spec::print(&GL_INFO, [("kd", self.kd.into()), ("ks", self.ks.into()), ("n", self.n.into())])
    }

    fn form(&self) -> Form {
        Form::BlinnPhongGl { kd: self.kd, ks: self.ks, n: self.n }
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if wi.z <= 0.0 {
            return [0.0; 3];
        }
        self.f_cos(wi, wo).map(|v| v / wi.z)
    }

    fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        let power = power_cosine(DVec3::Z, half(wi, wo), self.n);
        std::array::from_fn(|c| self.kd[c] * INV_PI * wi.z + self.ks[c] * power)
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        if largest(self.ks) > 0.0 {
            hint::half_vector(self, wo, slope(self.n), slope(self.n))
        } else {
            Vec::new()
        }
    }

    fn peak(&self) -> Peak {
        if largest(self.ks) > 0.0 {
            Peak::Mirror { narrow: 2.0 * slope(self.n), wide: 2.0 * slope(self.n) }
        } else {
            Peak::Smooth
        }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let parameters = [with(self.kd, self.n), with(self.ks, 0.0)];
        Some(BrdfShader::new(WGSL, self.peak(), self.domain(), parameters).with_f_cos())
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(&self.draw(), wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(&self.draw(), wi, wo)
    }
}
