//! ABC microfacet fits of the 100 MERL materials.
//!
//! Löw, Kronander, Ynnerman, Unger 2012, BRDF Models for Accurate and Efficient Rendering of Glossy Surfaces:
//! D = A/(1 + B(1 − cos θ_h))^C, A per channel; G = min(1, 2 h_z wi_z/(h·wi), 2 h_z wo_z/(h·wo)); F the
//! unpolarised Fresnel reflectance of a dielectric of index ior. **f = k_D/π + F D G/(π n·wi n·wo)**

use super::merl_fits::ABC;
use crate::draw::{self, Draw};
use crate::math::{INV_PI, above, dielectric, half, half_cosine};
use crate::registry::Entry;
use crate::shader::{BrdfShader, four, rgb};
use crate::spec::{self, Args};
use crate::{Brdf, Info, Lobe, Peak, Sample, SharedBrdf, SpecError, hint};
use glam::{DVec2, DVec3};
use std::sync::Arc;
use steradian_base::ParamInfo;

/// The page.
pub static INFO: Info = Info {
    name: "abc",
    source: "Löw, Kronander, Ynnerman, Unger 2012, with the authors' parameters of 100 MERL materials",
    formula: "f = k_D/π + F D G/(π n·wi n·wo); D = A/(1 + B(1 − cos θ_h))^C; G = min(1, 2 h_z wi_z/(h·wi), \
              2 h_z wo_z/(h·wo)); F dielectric of index ior",
    units: "sr⁻¹",
    parameters: &[ParamInfo::name("name", "a MERL material, such as gold-metallic-paint").positional()],
    reciprocity: "reciprocal",
    energy: "not conserved in general: a fit",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let (name, row) = ABC.find("abc", a.name("name").as_deref())?;
    let v = |i: usize| row.get(i).copied().unwrap_or(0.0);
    Ok(Arc::new(Abc { name, kd: [v(0), v(1), v(2)], a: [v(3), v(4), v(5)], b: v(6), c: v(7), ior: v(8) }))
}

/// One material of the table.
#[derive(Debug, Clone, Copy)]
pub struct Abc {
    name: &'static str,
    kd: [f64; 3],
    a: [f64; 3],
    b: f64,
    c: f64,
    ior: f64,
}

impl Abc {
    /// Half width of D in θ_h: B(1 − cos θ_h) ≈ B θ²/2 = 1.
    fn width(&self) -> f64 {
        (2.0 / self.b.max(2.0)).sqrt()
    }

    fn draw(&self) -> [(f64, Draw); 3] {
        let narrow = self.width();
        let wide = (10.0 * narrow).min(1.0);
        [
            (0.4, Draw::Cosine),
            (0.3, Draw::Visible { ax: narrow, ay: narrow }),
            (0.3, Draw::Visible { ax: wide, ay: wide }),
        ]
    }
}

impl Brdf for Abc {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        spec::print(&INFO, [("name", self.name.into())])
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        let h = half(wi, wo);
        let u = half_cosine(wi, wo);
        let versine = (h.x * h.x + h.y * h.y) / (1.0 + h.z);
        let d = (1.0 + self.b * versine).powf(-self.c);
        let (low, high) = (wi.z.min(wo.z), wi.z.max(wo.z));
        // G/(n·wi n·wo) without 0/0 at grazing angles.
        let masking = (1.0 / (low * high)).min(2.0 * h.z / (u * high)).min(1e150);
        let s = dielectric(u, self.ior) * d * masking;
        std::array::from_fn(|c| INV_PI * (self.kd[c] + self.a[c] * s))
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        hint::half_vector(self, wo, 0.5 * self.width(), 0.5 * self.width())
    }

    fn peak(&self) -> Peak {
        Peak::Mirror { narrow: self.width(), wide: self.width() }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let parameters = [rgb(self.kd), rgb(self.a), four([self.b, self.c, self.ior, 0.0])];
        Some(BrdfShader::new(include_str!("abc.wgsl"), self.peak(), self.domain(), parameters))
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(&self.draw(), wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(&self.draw(), wi, wo)
    }
}
