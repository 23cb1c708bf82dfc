//! Fibres along the tangent: powers of a cosine between two angles to t.
//!
//! - `banks`: Banks 1994, Illumination in Diverse Codimensions; Kautz 2004 (STAR), eq. 33:
//!   **f = (√(1 − (wi·t)²) √(1 − (wo·t)²) − (wi·t)(wo·t))₊^N**, the highlight on the cone t·wi = −t·wo.
//!   `banks-map` (eq. 35) is f_cos without the cosine, over the whole sphere.
//! - `kajiya-kay`: Kajiya & Kay 1989; Ramamoorthi & Hanrahan 2002, sections 5.3.1, 5.7.1, with cos θ = t·w:
//!   **f_cos = cos^s(θ_i − θ_o)₊ = ((wi·t)(wo·t) + √·√)₊^s** over the whole sphere. As both directions point
//!   away from the surface, its highlight lies on t·wi = +t·wo: it is Banks's with the sign of one tangent
//!   product turned, not the same function.
//!
//! With x = t·wi = sin a, y = t·wo = sin b, Banks's cosine is cos(a + b) and sin(a + b) = x √(1 − y²) +
//! y √(1 − x²), which gives the power near its peak without cancellation.

use crate::draw::{self, Draw};
use crate::registry::Entry;
use crate::shader::{BrdfShader, four};
use crate::spec::{self, Args};
use crate::{Brdf, Domain, Form, Info, Lobe, Peak, Sample, SharedBrdf, SpecError};
use glam::{DVec2, DVec3};
use std::sync::Arc;
use steradian_base::ParamInfo;

/// The page of `banks`.
pub static BANKS_INFO: Info = Info {
    name: "banks",
    source: "Banks 1994; Kautz 2004 (STAR), eq. 33",
    formula: "f = (√(1 − (wi·t)²) √(1 − (wo·t)²) − (wi·t)(wo·t))₊^n",
    units: "f sr⁻¹; not normalised",
    parameters: &[ParamInfo::real("n", [0.0, 1e8], 0.0, "exponent").required()],
    reciprocity: "reciprocal (the self-shadow factor n·wi is not part of f)",
    energy: "not conserved: the lobe is not normalised",
};

/// The page of `banks-map`.
pub static BANKS_MAP_INFO: Info = Info {
    name: "banks-map",
    source: "Kautz 2004 (STAR), eq. 35",
    formula: "f_cos = (√(1 − (wi·t)²) √(1 − (wo·t)²) − (wi·t)(wo·t))₊^n over the whole sphere",
    units: "f_cos sr⁻¹; not normalised",
    parameters: &[ParamInfo::real("n", [0.0, 1e8], 0.0, "exponent").required()],
    reciprocity: "not reciprocal: a map kernel, defined with the cosine left out",
    energy: "not conserved: the lobe is not normalised, and it takes light from behind",
};

/// The page of `kajiya-kay`.
pub static KAJIYA_KAY_INFO: Info = Info {
    name: "kajiya-kay",
    source: "Kajiya & Kay 1989; Ramamoorthi & Hanrahan 2002, sections 5.3.1 and 5.7.1",
    formula: "f_cos = cos^s(θ_i − θ_o)₊ over the whole sphere, cos θ = t·w",
    units: "f_cos sr⁻¹; not normalised",
    parameters: &[ParamInfo::real("s", [0.0, 1e8], 0.0, "exponent").required()],
    reciprocity: "not reciprocal: defined with the cosine in (f_cos itself is symmetric)",
    energy: "not conserved: the lobe is not normalised",
};

fn make(a: &Args, kind: Kind, key: &'static str) -> Result<SharedBrdf, SpecError> {
    Ok(Arc::new(Strand { kind, n: a.number(key)? }))
}

pub(crate) const BANKS: Entry = Entry { info: &BANKS_INFO, make: |a| make(a, Kind::Banks, "n") };
pub(crate) const BANKS_MAP: Entry = Entry { info: &BANKS_MAP_INFO, make: |a| make(a, Kind::BanksMap, "n") };
pub(crate) const KAJIYA_KAY: Entry =
    Entry { info: &KAJIYA_KAY_INFO, make: |a| make(a, Kind::KajiyaKay, "s") };

/// Variant of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// f, above the horizon.
    Banks,
    /// f_cos, over the sphere.
    BanksMap,
    /// f_cos, over the sphere, with the other sign.
    KajiyaKay,
}

/// A highlight on a cone about the tangent.
#[derive(Debug, Clone, Copy)]
pub struct Strand {
    /// Sign, cosine and domain.
    pub kind: Kind,
    /// Exponent.
    pub n: f64,
}

const DRAW: &[(f64, Draw)] = &[(1.0, Draw::Cosine)];
const DRAW_SPHERE: &[(f64, Draw)] = &[(1.0, Draw::Uniform)];

impl Strand {
    /// The cosine of the highlight's cone about t: x such that t·wi = x is brightest.
    fn ridge(&self, wo: DVec3) -> f64 {
        if self.kind == Kind::KajiyaKay { wo.x } else { -wo.x }
    }

    fn power(&self, wi: DVec3, wo: DVec3) -> f64 {
        let (x, y) = (wi.x, -self.ridge(wo));
        let (cx, cy) = (wi.y.hypot(wi.z), wo.y.hypot(wo.z));
        let c = cx * cy - x * y;
        if c <= 0.0 {
            return 0.0;
        }
        let s = x * cy + y * cx;
        if c < 0.9 { c.powf(self.n) } else { (0.5 * self.n * (-(s * s).min(1.0)).ln_1p()).exp() }
    }

    fn draw(&self) -> &'static [(f64, Draw)] {
        if self.kind == Kind::Banks { DRAW } else { DRAW_SPHERE }
    }
}

impl Brdf for Strand {
    fn info(&self) -> &'static Info {
        match self.kind {
            Kind::Banks => &BANKS_INFO,
            Kind::BanksMap => &BANKS_MAP_INFO,
            Kind::KajiyaKay => &KAJIYA_KAY_INFO,
        }
    }

    fn spec(&self) -> String {
        let info = self.info();
        spec::print(info, [(info.parameters[0].name, self.n.into())])
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return [0.0; 3];
        }
        let p = self.power(wi, wo);
        [if self.kind == Kind::Banks { p } else { p / wi.z }; 3]
    }

    fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if wo.z <= 0.0 || (self.kind == Kind::Banks && wi.z <= 0.0) {
            return [0.0; 3];
        }
        let cosine = if self.kind == Kind::Banks { wi.z } else { 1.0 };
        [self.power(wi, wo) * cosine; 3]
    }

    fn domain(&self) -> Domain {
        if self.kind == Kind::Banks { Domain::Hemisphere } else { Domain::Sphere }
    }

    fn is_isotropic(&self) -> bool {
        self.n == 0.0
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        let width = (1.0 / (self.n + 1.0)).sqrt();
        vec![Lobe::Cone { axis: DVec3::X, cosine: self.ridge(wo), width }]
    }

    fn peak(&self) -> Peak {
        let sign = if self.kind == Kind::KajiyaKay { 1.0 } else { -1.0 };
        Peak::Cone { sign, width: (1.0 / (self.n + 1.0)).sqrt() }
    }

    fn form(&self) -> Form {
        Form::Strand { kind: self.kind, n: self.n, scale: [1.0; 3] }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let sign = if self.kind == Kind::KajiyaKay { 1.0 } else { -1.0 };
        let parameters = [four([self.n, sign, f64::from(self.kind == Kind::Banks), 0.0])];
        Some(
            BrdfShader::new(include_str!("strand.wgsl"), self.peak(), self.domain(), parameters).with_f_cos(),
        )
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(self.draw(), wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(self.draw(), wi, wo)
    }
}
