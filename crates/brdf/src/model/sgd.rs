//! Shifted-gamma microfacet fits of the 100 MERL materials.
//!
//! Bagher, Soler, Holzschuch 2012, Accurate Fitting of Measured Reflectances Using a Shifted Gamma
//! Micro-facet Distribution; parameters of the authors, per channel. With u = wi·h:
//!
//! D = κ exp(−a)/(π a^p cos⁴θ_h), a = α + tan²θ_h/α; G₁(w) = clamp(1 + λ(1 − exp(c max(0, θ_w − θ₀)^k)), 0,
//! 1); F = f0 − f1 u + (1 − f0)(1 − u)⁵. **f = (ρ_d + ρ_s F D G₁(wi) G₁(wo)/(n·wi n·wo))/π**

use super::merl_fits::SGD;
use crate::draw::{self, Draw};
use crate::math::{INV_PI, above, half, half_cosine, polar_angle, pow5, times};
use crate::registry::Entry;
use crate::shader::{BrdfShader, rgb};
use crate::spec::{self, Args};
use crate::{Brdf, Info, Lobe, Peak, Sample, SharedBrdf, SpecError, hint};
use glam::{DVec2, DVec3};
use std::sync::Arc;
use steradian_base::ParamInfo;

/// The page.
pub static INFO: Info = Info {
    name: "sgd",
    source: "Bagher, Soler, Holzschuch 2012, with the authors' parameters of 100 MERL materials",
    formula: "f = (ρ_d + ρ_s F D G₁(wi) G₁(wo)/(n·wi n·wo))/π; D = κ exp(−a)/(π a^p cos⁴θ_h), a = α + tan²θ_h/α; \
              G₁ = clamp(1 + λ(1 − exp(c max(0, θ − θ₀)^k)), 0, 1); F = f0 − f1 u + (1 − f0)(1 − u)⁵, u = wi·h",
    units: "sr⁻¹",
    parameters: &[ParamInfo::name("name", "a MERL material, such as gold-metallic-paint").positional()],
    reciprocity: "reciprocal",
    energy: "not conserved in general: a fit",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let (name, row) = SGD.find("sgd", a.name("name").as_deref())?;
    let channel = |c: usize| {
        let v = |i: usize| row.get(3 * i + c).copied().unwrap_or(0.0);
        Channel {
            rho_d: v(0),
            rho_s: v(1),
            alpha: v(2),
            p: v(3),
            f0: v(4),
            f1: v(5),
            kappa: v(6),
            lambda: v(7),
            c: v(8),
            k: v(9),
            theta0: v(10),
        }
    };
    Ok(Arc::new(Sgd { name, channels: std::array::from_fn(channel) }))
}

#[derive(Debug, Clone, Copy)]
struct Channel {
    rho_d: f64,
    rho_s: f64,
    alpha: f64,
    p: f64,
    f0: f64,
    f1: f64,
    kappa: f64,
    lambda: f64,
    c: f64,
    k: f64,
    theta0: f64,
}

impl Channel {
    fn d(&self, tan2: f64, cos2: f64) -> f64 {
        let a = self.alpha + tan2 / self.alpha;
        // Where e would be below the least number.
        if a > 746.0 && self.p >= 0.0 {
            return 0.0;
        }
        // exp(−a)/a^p as one exponential.
        let e = (-a - self.p * a.ln()).exp();
        if e > 0.0 { self.kappa * e * INV_PI / (cos2 * cos2) } else { 0.0 }
    }

    fn g1(&self, theta: f64) -> f64 {
        // 0^k is 0: nothing is masked up to θ₀.
        if theta <= self.theta0 {
            return 1.0;
        }
        let beyond = (theta - self.theta0).max(0.0).powf(self.k);
        (1.0 - self.lambda * (self.c * beyond).exp_m1()).clamp(0.0, 1.0)
    }

    /// The elevation below which masking begins, less 1 radian, for comparisons in WGSL.
    fn rise(&self) -> f64 {
        std::f64::consts::FRAC_PI_2 - 1.0 - self.theta0
    }

    fn fresnel(&self, u: f64) -> f64 {
        self.f0 - self.f1 * u + (1.0 - self.f0) * pow5(1.0 - u)
    }
}

/// One material of the table.
#[derive(Debug, Clone, Copy)]
pub struct Sgd {
    name: &'static str,
    channels: [Channel; 3],
}

impl Sgd {
    /// Narrowest core (a^−p turns over at tan θ_h = α) and the exponential's reach √α.
    fn widths(&self) -> (f64, f64) {
        let alpha = self.channels.iter().map(|c| c.alpha).fold(f64::INFINITY, f64::min);
        (alpha.max(1e-5), alpha.sqrt())
    }

    /// G₁ of a direction.
    fn masked(&self, w: DVec3) -> [f64; 3] {
        let theta = polar_angle(w);
        self.channels.map(|c| c.g1(theta))
    }

    /// f, of G₁(wo).
    fn value(&self, wi: DVec3, wo: DVec3, masked: [f64; 3]) -> [f64; 3] {
        let h = half(wi, wo);
        let cos2 = h.z * h.z;
        let tan2 = (h.x * h.x + h.y * h.y) / cos2;
        let (ti, u) = (polar_angle(wi), half_cosine(wi, wo));
        let mut f = [0.0; 3];
        for (f, (c, g1)) in f.iter_mut().zip(self.channels.iter().zip(masked)) {
            let d = c.d(tan2, cos2);
            let masked = if d == 0.0 { 0.0 } else { c.g1(ti) * g1 };
            let s = c.fresnel(u) * d * masked / (wi.z * wo.z).max(1e-150);
            *f = INV_PI * (c.rho_d + c.rho_s * s);
        }
        f
    }

    fn draw(&self) -> [(f64, Draw); 3] {
        let (core, reach) = self.widths();
        let (core, reach) = (core.min(1.0), reach.min(1.0));
        [
            (0.4, Draw::Cosine),
            (0.4, Draw::Visible { ax: reach, ay: reach }),
            (0.2, Draw::Visible { ax: core, ay: core }),
        ]
    }
}

impl Brdf for Sgd {
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
        self.value(wi, wo, self.masked(wo))
    }

    fn f_cos_batch(&self, wi: &[DVec3], wo: DVec3, out: &mut [[f64; 3]]) {
        let masked = self.masked(wo);
        for (wi, f) in wi.iter().zip(out) {
            *f = if above(*wi, wo) { times(self.value(*wi, wo, masked), wi.z) } else { [0.0; 3] };
        }
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        let (core, reach) = self.widths();
        let mut lobes = hint::half_vector(self, wo, core, core);
        lobes.extend(hint::half_vector(self, wo, 0.5 * reach, 0.5 * reach));
        lobes
    }

    fn peak(&self) -> Peak {
        let core = self.widths().0;
        Peak::Mirror { narrow: core, wide: core }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let parameters: [fn(&Channel) -> f64; 12] = [
            |c| c.rho_d,
            |c| c.rho_s,
            |c| c.alpha,
            |c| c.p,
            |c| c.f0,
            |c| c.f1,
            |c| c.kappa,
            |c| c.lambda,
            |c| c.c.ln(),
            |c| c.k,
            |c| c.rise(),
            |c| c.rise() - f64::from(c.rise() as f32),
        ];
        let parameters = parameters.map(|p| rgb(self.channels.each_ref().map(p)));
        Some(BrdfShader::new(include_str!("sgd.wgsl"), self.peak(), self.domain(), parameters))
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(&self.draw(), wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(&self.draw(), wi, wo)
    }
}
