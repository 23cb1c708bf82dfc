//! A rough dielectric layer over a diffuse base, lossless except for losses of the layer itself.
//!
//! Kelemen & Szirmay-Kalos 2001, A Microfacet Based Coupled Specular-Matte BRDF Model with Importance
//! Sampling, eq. 5, as Kulla & Conty 2017, Revisiting Physically Based Shading at Imageworks, use it: the
//! base gets the light that the layer does not reflect, on the way in and on the way out:
//!
//! **f = D F G₂/(4 n·wi n·wo) + albedo/π (1 − E(n·wi))(1 − E(n·wo))/(1 − Ē)**
//!
//! D, F and G₂ are those of [`super::ggx`], E(μ) = f0 A(μ) + B(μ) the layer's albedo ([`crate::dfg::ggx`],
//! piecewise linear in √μ), Ē = 2 ∫ E μ dμ. Under constant light the base reflects albedo (1 − E(n·wo)) of
//! it. With albedo = (1 − m) c and f0 = 0.04 (1 − m) + m c it is a glTF material of base colour c and
//! metalness m.

use crate::dfg;
use crate::draw::{self, Draw};
use crate::math::{INV_PI, above, largest};
use crate::model::ggx::Ggx;
use crate::registry::Entry;
use crate::shader::{BrdfShader, four, rgb, with};
use crate::spec::{self, Args};
use crate::{Brdf, Form, Info, Lobe, Peak, Sample, SharedBrdf, SpecError, hint};
use glam::{DVec2, DVec3};
use std::sync::Arc;
use steradian_base::ParamInfo;

/// The page.
pub static INFO: Info = Info {
    name: "dielectric",
    source: "Kelemen & Szirmay-Kalos 2001, eq. 5; Kulla & Conty 2017; the layer: Walter et al. 2007",
    formula: "f = D G₂ F/(4 n·wi n·wo) + albedo/π (1 − E(n·wi))(1 − E(n·wo))/(1 − Ē), E the albedo of the GGX layer, \
              Ē = 2 ∫ E μ dμ",
    units: "sr⁻¹",
    parameters: &[
        ParamInfo::real("alpha", [1e-4, 1.0], 0.0, "width of the layer's D, perceptual roughness squared")
            .required(),
        ParamInfo::rgb("f0", [0.0, 1.0], 0.04, "reflectance of the layer at normal incidence"),
        ParamInfo::rgb("albedo", [0.0, 1.0], 0.5, "reflectance of the base"),
    ],
    reciprocity: "reciprocal",
    energy: "albedo ≤ 1 (single scattering in the layer: the rest is lost)",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let alpha = a.number("alpha")?;
    let (f0, albedo) = (a.rgb("f0")?, a.rgb("albedo")?);
    Ok(Arc::new(Dielectric::new(alpha, f0, albedo)))
}

/// Nodes of A and B at √μ = i/(NODES − 1).
const NODES: usize = 32;
/// Nodes and weights of Gauss's rule of three on 0 … 1.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// A GGX layer over a diffuse base.
#[derive(Debug, Clone, Copy)]
pub struct Dielectric {
    layer: Ggx,
    albedo: [f64; 3],
    nodes: [[f64; 2]; NODES],
    /// 1 − Ē.
    passed: [f64; 3],
}

impl Dielectric {
    /// A layer of width `alpha` (1e-4 … 1) and reflectance `f0` at normal incidence over a base of `albedo`.
    pub fn new(alpha: f64, f0: [f64; 3], albedo: [f64; 3]) -> Self {
        let last = (NODES - 1) as f64;
        let nodes = std::array::from_fn(|i| {
            let d = dfg::ggx((i as f64 / last).powi(2), alpha);
            [d.scale, d.bias]
        });
        let layer = Ggx { ax: alpha, ay: alpha, f0 };
        let mut out = Self { layer, albedo, nodes, passed: [0.0; 3] };
        // μ = s², dμ μ = 2 s³ ds; E is linear in s between nodes, so that the rule is exact.
        for i in 0..NODES - 1 {
            for (x, w) in GAUSS {
                let s = (i as f64 + x) / last;
                let through = out.through(s * s);
                (0..3).for_each(|c| out.passed[c] += 4.0 * w / last * s.powi(3) * through[c]);
            }
        }
        out
    }

    /// 1 − E(μ).
    fn through(&self, mu: f64) -> [f64; 3] {
        let x = mu.clamp(0.0, 1.0).sqrt() * (NODES - 1) as f64;
        let i = (x as usize).min(NODES - 2);
        let w = x - i as f64;
        let [a, b] = [0, 1].map(|k| self.nodes[i][k] + (self.nodes[i + 1][k] - self.nodes[i][k]) * w);
        self.layer.f0.map(|f0| (1.0 - f0 * a - b).max(0.0))
    }

    fn draw(&self) -> [(f64, Draw); 2] {
        let q = if largest(self.albedo) > 0.0 { 0.5 } else { 1.0 };
        [(1.0 - q, Draw::Cosine), (q, Draw::Visible { ax: self.layer.ax, ay: self.layer.ay })]
    }
}

impl Brdf for Dielectric {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        let (alpha, f0) = (("alpha", self.layer.ax.into()), ("f0", self.layer.f0.into()));
        spec::print(&INFO, [alpha, f0, ("albedo", self.albedo.into())])
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        let layer = self.layer.eval(wi, wo);
        let (i, o) = (self.through(wi.z), self.through(wo.z));
        std::array::from_fn(|c| layer[c] + self.albedo[c] * INV_PI * i[c] * o[c] / self.passed[c].max(1e-150))
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        hint::half_vector(self, wo, 0.5 * self.layer.ax, 0.5 * self.layer.ay)
    }

    fn peak(&self) -> Peak {
        self.layer.peak()
    }

    fn form(&self) -> Form {
        Form::Dielectric { alpha: self.layer.ax, f0: self.layer.f0, albedo: self.albedo, scale: [1.0; 3] }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let factors = std::array::from_fn(|c| self.albedo[c] * INV_PI / self.passed[c].max(1e-150));
        let mut parameters = vec![with(self.layer.f0, self.layer.ax), rgb(factors)];
        let pairs = self.nodes.as_chunks::<2>().0;
        parameters.extend(pairs.iter().map(|[p, q]| four([p[0], p[1], q[0], q[1]])));
        let text = include_str!("dielectric.wgsl");
        let shader = BrdfShader::new(text, self.peak(), self.domain(), parameters);
        Some(shader.with_arrays([("BRDF_NODES", pairs.len())]))
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(&self.draw(), wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(&self.draw(), wi, wo)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::albedo::directional;
    use crate::math::spherical;

    #[test]
    fn a_white_base_sends_back_all_that_the_layer_lets_through() {
        for (alpha, f0) in [(0.05, 0.04), (0.3, 0.04), (0.8, 0.2)] {
            let b = Dielectric::new(alpha, [f0; 3], [1.0; 3]);
            for theta in [0.0, 0.7, 1.2, 1.5] {
                let e = directional(&b, spherical(theta, 0.3), 1e-6)[0];
                assert!((e - 1.0).abs() < 2e-3, "alpha {alpha}, θ {theta}: {e}");
            }
        }
    }

    #[test]
    fn without_a_base_it_is_the_layer() {
        let (b, g) =
            (Dielectric::new(0.2, [0.9, 0.6, 0.3], [0.0; 3]), Ggx { ax: 0.2, ay: 0.2, f0: [0.9, 0.6, 0.3] });
        let (i, o) = (spherical(0.4, 0.0), spherical(0.9, 3.0));
        assert_eq!(b.eval(i, o), g.eval(i, o));
    }
}
