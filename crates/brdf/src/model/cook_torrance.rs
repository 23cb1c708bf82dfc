//! Beckmann microfacets.
//!
//! Cook & Torrance 1982, A Reflectance Model for Computer Graphics; Kautz 2004 (STAR), eq. 12, with today's
//! 1/4 (the papers' 1/π goes with a D that has no 1/π): **f = D G F/(4 n·wi n·wo)**,
//! D = exp(−tan²θ_h/m²)/(π m² cos⁴θ_h), F Schlick's.
//!
//! - `g=v-cavity` (Torrance & Sparrow 1967): G = min(1, 2 n·h n·wo/(wo·h), 2 n·h n·wi/(wo·h)), so that
//!   G/(4 n·wi n·wo) = min(1/(4 n·wi n·wo), n·h/(2 wo·h n·wi), n·h/(2 wo·h n·wo)).
//! - `g=smith`, a function of (n·wi, n·wo) alone as STAR04's G must be: G = G₁(wi) G₁(wo), Smith 1967 for a
//!   Gaussian surface: G₁ = 2/(1 + erf a + exp(−a²)/(a√π)), a = cot θ/m. As n·w → 0, G₁/n·w → 2√π/(m sin θ).

use crate::draw::{self, Draw};
use crate::math::{above, erf, half, half_cosine, schlick, times};
use crate::registry::Entry;
use crate::shader::{BrdfShader, four, with};
use crate::spec::{self, Args};
use crate::{Brdf, Form, Info, Lobe, Peak, Sample, SharedBrdf, SpecError, hint};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::ParamInfo;

/// The page.
pub static INFO: Info = Info {
    name: "cook-torrance",
    source: "Cook & Torrance 1982; Kautz 2004 (STAR), eq. 12; Schlick 1994",
    formula: "f = D G F/(4 n·wi n·wo); D = exp(−tan²θ_h/m²)/(π m² cos⁴θ_h); G = min(1, 2 n·h n·wo/(wo·h), \
              2 n·h n·wi/(wo·h)), or Smith's G₁(wi) G₁(wo); F = f0 + (1 − f0)(1 − wi·h)⁵",
    units: "sr⁻¹",
    parameters: &[
        ParamInfo::real("m", [1e-4, 10.0], 0.0, "rms slope").required(),
        ParamInfo::rgb("f0", [0.0, 1.0], 1.0, "reflectance at normal incidence"),
        ParamInfo::choice("g", &["v-cavity", "smith"], "masking"),
    ],
    reciprocity: "reciprocal",
    energy: "albedo ≤ 1 (single scattering: the rest is lost)",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    Ok(Arc::new(CookTorrance { m: a.number("m")?, f0: a.rgb("f0")?, smith: a.word("g")? == "smith" }))
}

/// Beckmann's distribution with a V-cavity or Smith's masking.
#[derive(Debug, Clone, Copy)]
pub struct CookTorrance {
    /// Rms slope.
    pub m: f64,
    /// Reflectance at normal incidence.
    pub f0: [f64; 3],
    /// Smith's masking instead of the V-cavity's?
    pub smith: bool,
}

/// Beckmann & Spizzichino 1963: D = exp(−tan²θ_h/m²)/(π m² cos⁴θ_h) of a unit half vector, sr⁻¹.
pub fn beckmann(h: DVec3, m: f64) -> f64 {
    let c2 = h.z * h.z;
    let e = (-(h.x * h.x + h.y * h.y) / (c2 * m * m)).exp();
    if e > 0.0 { e / (PI * m * m * c2 * c2) } else { 0.0 }
}

/// Smith's G₁/n·w of a unit direction above the horizon, for slopes of rms m; at most 2√π/m.
pub fn smith_over_cosine(w: DVec3, m: f64) -> f64 {
    let sine = w.x.hypot(w.y);
    if sine <= 0.0 {
        return 1.0 / w.z;
    }
    // a = z/(m sin θ): z (1 + erf a + exp(−a²)/(a√π)) = z (1 + erf a) + m sin θ exp(−a²)/√π.
    let a = w.z / (m * sine);
    2.0 / (w.z * (1.0 + erf(a)) + m * sine * (-a * a).exp() / PI.sqrt())
}

impl CookTorrance {
    /// G/(4 n·wi n·wo).
    fn masking(&self, wi: DVec3, wo: DVec3, h: DVec3) -> f64 {
        if self.smith {
            return 0.25 * smith_over_cosine(wi, self.m) * smith_over_cosine(wo, self.m);
        }
        let (low, high) = (wi.z.min(wo.z), wi.z.max(wo.z));
        let open = 0.25 / (low * high);
        let cavity = h.z / (2.0 * half_cosine(wi, wo) * high);
        open.min(cavity).min(1e150)
    }

    fn draw(&self) -> [(f64, Draw); 1] {
        [(1.0, Draw::Visible { ax: self.m, ay: self.m })]
    }
}

impl Brdf for CookTorrance {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        let g = if self.smith { "smith" } else { "v-cavity" };
        spec::print(&INFO, [("m", self.m.into()), ("f0", self.f0.into()), ("g", g.into())])
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        let h = half(wi, wo);
        let d = beckmann(h, self.m);
        if d <= 0.0 {
            return [0.0; 3];
        }
        times(schlick(self.f0, half_cosine(wi, wo)), d * self.masking(wi, wo, h))
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        hint::half_vector(self, wo, 0.7 * self.m, 0.7 * self.m)
    }

    fn peak(&self) -> Peak {
        Peak::Mirror { narrow: 1.4 * self.m, wide: 1.4 * self.m }
    }

    fn form(&self) -> Form {
        Form::CookTorrance { m: self.m, f0: self.f0, smith: self.smith, scale: [1.0; 3] }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let parameters = [with(self.f0, self.m), four([f64::from(self.smith), 0.0, 0.0, 0.0])];
        Some(BrdfShader::new(include_str!("cook_torrance.wgsl"), self.peak(), self.domain(), parameters))
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(&self.draw(), wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(&self.draw(), wi, wo)
    }
}
