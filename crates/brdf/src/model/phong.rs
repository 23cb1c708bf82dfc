//! Phong lobes about the mirror direction r, defined with the cosine in.
//!
//! - Phong 1975; Kautz 2004, Hardware Lighting and Shading: a Survey, eqs 22–24: k_s (r·wi)^N/(n·wi), so that
//!   **f_cos = max(0, r·wi)^N** above the horizon (`phong`) or over the whole sphere (`phong-map`, the value
//!   that a prefiltered map holds: the map of eq. 25 has no horizon).
//! - Ramamoorthi & Hanrahan 2002, Frequency Space Environment Map Rendering, eq. 5.26:
//!   **f_cos = (s + 1)/2π · max(0, r·wi)^s** over the whole sphere (`phong-normalized`), of integral 1.

use crate::draw::{self, Draw};
use crate::math::{mirror, power_cosine};
use crate::registry::Entry;
use crate::shader::{BrdfShader, four};
use crate::spec::{self, Args};
use crate::{Brdf, Domain, Form, Info, Lobe, Peak, Sample, SharedBrdf, SpecError};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::ParamInfo;

/// The page of `phong`.
pub static PHONG_INFO: Info = Info {
    name: "phong",
    source: "Phong 1975; Kautz 2004 (STAR), eqs 22–24 with k_s = 1",
    formula: "f = max(0, r·wi)^n/(n·wi): f_cos = max(0, r·wi)^n above the horizon",
    units: "f sr⁻¹; not normalised",
    parameters: &[ParamInfo::real("n", [0.0, 1e8], 0.0, "exponent").required()],
    reciprocity: "not reciprocal: the division by n·wi alone breaks the symmetry",
    energy: "not conserved for n < 2π − 1: the lobe integral is 2π/(n + 1) at normal view",
};

/// The page of `phong-map`.
pub static PHONG_MAP_INFO: Info = Info {
    name: "phong-map",
    source: "Kautz 2004 (STAR), eq. 25 with k_s = 1, over the whole sphere as a prefiltered map holds it",
    formula: "f_cos = max(0, r·wi)^n over the whole sphere",
    units: "f_cos sr⁻¹; not normalised",
    parameters: &[ParamInfo::real("n", [0.0, 1e8], 0.0, "exponent").required()],
    reciprocity: "not reciprocal: a map kernel, defined with the cosine in",
    energy: "not conserved for n < 2π − 1: the kernel integral is 2π/(n + 1)",
};

/// The page of `phong-normalized`.
pub static PHONG_NORMALIZED_INFO: Info = Info {
    name: "phong-normalized",
    source: "Ramamoorthi & Hanrahan 2002, eq. 5.26",
    formula: "f_cos = (s + 1)/2π · max(0, r·wi)^s over the whole sphere",
    units: "f_cos sr⁻¹",
    parameters: &[ParamInfo::real("s", [0.0, 1e8], 0.0, "exponent").required()],
    reciprocity: "not reciprocal: a map kernel, defined with the cosine in",
    energy: "albedo = 1 over the sphere for every view",
};

fn make(a: &Args, kind: Kind, key: &'static str) -> Result<SharedBrdf, SpecError> {
    Ok(Arc::new(Phong { kind, n: a.number(key)? }))
}

pub(crate) const PHONG: Entry = Entry { info: &PHONG_INFO, make: |a| make(a, Kind::Phong, "n") };
pub(crate) const PHONG_MAP: Entry = Entry { info: &PHONG_MAP_INFO, make: |a| make(a, Kind::Map, "n") };
pub(crate) const PHONG_NORMALIZED: Entry =
    Entry { info: &PHONG_NORMALIZED_INFO, make: |a| make(a, Kind::Normalized, "s") };

/// Variant of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Above the horizon.
    Phong,
    /// Over the sphere.
    Map,
    /// Over the sphere, of integral 1.
    Normalized,
}

/// A power of the cosine about the mirror direction.
#[derive(Debug, Clone, Copy)]
pub struct Phong {
    /// Domain and factor.
    pub kind: Kind,
    /// Exponent.
    pub n: f64,
}

impl Phong {
    fn factor(&self) -> f64 {
        if self.kind == Kind::Normalized { (self.n + 1.0) / (2.0 * PI) } else { 1.0 }
    }

    fn draw(&self, wo: DVec3) -> [(f64, Draw); 1] {
        [(1.0, Draw::Power { axis: mirror(wo), n: self.n })]
    }
}

impl Brdf for Phong {
    fn info(&self) -> &'static Info {
        match self.kind {
            Kind::Phong => &PHONG_INFO,
            Kind::Map => &PHONG_MAP_INFO,
            Kind::Normalized => &PHONG_NORMALIZED_INFO,
        }
    }

    fn spec(&self) -> String {
        let info = self.info();
        spec::print(info, [(info.parameters[0].name, self.n.into())])
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if wi.z <= 0.0 {
            return [0.0; 3];
        }
        self.f_cos(wi, wo).map(|v| v / wi.z)
    }

    fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if wo.z <= 0.0 || (self.kind == Kind::Phong && wi.z <= 0.0) {
            return [0.0; 3];
        }
        [self.factor() * power_cosine(mirror(wo), wi, self.n); 3]
    }

    fn domain(&self) -> Domain {
        if self.kind == Kind::Phong { Domain::Hemisphere } else { Domain::Sphere }
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        vec![Lobe::Axis { axis: mirror(wo), width: (1.0 / (self.n + 1.0)).sqrt() }]
    }

    fn peak(&self) -> Peak {
        let width = (1.0 / (self.n + 1.0)).sqrt();
        Peak::Mirror { narrow: width, wide: width }
    }

    fn form(&self) -> Form {
        Form::Phong { n: self.n, factor: [self.factor(); 3], domain: self.domain() }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let parameters = [four([self.n, self.factor(), f64::from(self.domain() == Domain::Sphere), 0.0])];
        Some(BrdfShader::new(include_str!("phong.wgsl"), self.peak(), self.domain(), parameters).with_f_cos())
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(&self.draw(wo), wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(&self.draw(wo), wi, wo)
    }
}
