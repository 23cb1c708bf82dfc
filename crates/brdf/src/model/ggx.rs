//! GGX microfacets.
//!
//! Walter, Marschner, Li, Torrance 2007, Microfacet Models for Refraction through Rough Surfaces, eqs 20, 33;
//! Heitz 2014, Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs, eqs 85–87 (anisotropic
//! D) and 99 (height-correlated G₂).
//!
//! With σ(w) = √(ax² w_x² + ay² w_y² + w_z²): Λ(w) = (σ(w)/w_z − 1)/2, G₂ = 1/(1 + Λ(wi) + Λ(wo)), thus
//! G₂/(4 n·wi n·wo) = ½/(σ(wi) n·wo + σ(wo) n·wi), which has no cancellation at grazing angles.
//!
//! **f = D F/(2 (σ(wi) n·wo + σ(wo) n·wi))**

use crate::draw::{self, Draw, ggx_d, stretched_length};
use crate::math::{above, half, half_cosine, schlick, times};
use crate::registry::Entry;
use crate::shader::{BrdfShader, four, rgb};
use crate::spec::{self, Args};
use crate::{Brdf, Form, Info, Lobe, Peak, Sample, SharedBrdf, SpecError, hint};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::ParamInfo;
use steradian_simd::{Arch, Kernel, run};

/// The page.
pub static INFO: Info = Info {
    name: "ggx",
    source: "Walter et al. 2007, eqs 20, 33; Heitz 2014, eq. 99; Schlick 1994",
    formula: "f = D G₂ F/(4 n·wi n·wo); D = 1/(π ax ay (h_x²/ax² + h_y²/ay² + h_z²)²), G₂ = 1/(1 + Λ(wi) + Λ(wo)), \
              Λ = (√(1 + (ax² x² + ay² y²)/z²) − 1)/2, F = f0 + (1 − f0)(1 − wi·h)⁵",
    units: "sr⁻¹",
    parameters: &[
        ParamInfo::real("alpha", [1e-4, 10.0], 0.0, "width of D, perceptual roughness squared").optional(),
        ParamInfo::real("ax", [1e-4, 10.0], 0.0, "width along the tangent, instead of alpha").optional(),
        ParamInfo::real("ay", [1e-4, 10.0], 0.0, "width along the bitangent, instead of alpha").optional(),
        ParamInfo::rgb("f0", [0.0, 1.0], 1.0, "reflectance at normal incidence"),
    ],
    reciprocity: "reciprocal",
    energy: "albedo ≤ 1 (single scattering: the rest is lost)",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let f0 = a.rgb("f0")?;
    if !a.has("ax") && !a.has("ay") {
        let alpha = a.number("alpha")?;
        return Ok(Arc::new(Ggx { ax: alpha, ay: alpha, f0 }));
    }
    if a.has("alpha") {
        return Err(a.syntax("give either alpha= or both ax= and ay=, not all".into()));
    }
    Ok(Arc::new(Ggx { ax: a.number("ax")?, ay: a.number("ay")?, f0 }))
}

/// D of a unit half vector for one width, sr⁻¹.
pub fn distribution(h: DVec3, alpha: f64) -> f64 {
    ggx_d(h, alpha, alpha)
}

/// n·wi n·wo/G₂ = ½(σ(wi) n·wo + σ(wo) n·wi) for one width and cosines of at least 0.
pub fn cosines_over_masking(alpha: f64, cos_i: f64, cos_o: f64) -> f64 {
    let length = |c: f64| (alpha * alpha * (1.0 - c * c).max(0.0) + c * c).sqrt();
    0.5 * (length(cos_i) * cos_o + length(cos_o) * cos_i)
}

/// GGX with Schlick's Fresnel term.
#[derive(Debug, Clone, Copy)]
pub struct Ggx {
    /// Width along the tangent.
    pub ax: f64,
    /// Width along the bitangent.
    pub ay: f64,
    /// Reflectance at normal incidence.
    pub f0: [f64; 3],
}

impl Ggx {
    /// D · G₂/(4 n·wi n·wo), and wi·h = |wi + wo|/2.
    fn shape(&self, wi: DVec3, wo: DVec3) -> (f64, f64) {
        let (ax, ay) = (self.ax, self.ay);
        let s = stretched_length(wi, ax, ay) * wo.z + stretched_length(wo, ax, ay) * wi.z;
        // With v = wi + wo, D = ax³ ay³ v⁴/(π p²), p = ay² v_x² + ax² v_y² + ax² ay² v_z².
        let v = wi + wo;
        let (square, area) = (v.length_squared(), ax * ay);
        let p = DVec3::new(ay * v.x, ax * v.y, area * v.z).length_squared();
        if square < 1e-100 {
            return (0.5 * ggx_d(half(wi, wo), ax, ay) / s.max(1e-150), half_cosine(wi, wo));
        }
        let shape = 0.5 * area.powi(3) * square * square / (PI * p * p * s.max(1e-150));
        (shape, (0.5 * square.sqrt()).min(1.0))
    }

    fn draw(&self) -> [(f64, Draw); 1] {
        [(1.0, Draw::Visible { ax: self.ax, ay: self.ay })]
    }
}

/// [`Brdf::f_cos_batch`], eight directions at a time, with the operations of [`Ggx::shape`] in their order:
/// the bits are the same.
struct Batch<'a> {
    ggx: &'a Ggx,
    wi: &'a [DVec3],
    wo: DVec3,
    out: &'a mut [[f64; 3]],
}

impl Kernel for Batch<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let Self { ggx, wi, wo, out } = self;
        let (ax, ay, f0) = (ggx.ax, ggx.ay, ggx.f0);
        let (length_o, area) = (stretched_length(wo, ax, ay), ax * ay);
        let scale = 0.5 * area.powi(3);
        for (wi, out) in wi.chunks(8).zip(out[..wi.len()].chunks_mut(8)) {
            let mut of = [wi[wi.len() - 1]; 8];
            of[..wi.len()].copy_from_slice(wi);
            let (mut x, mut y, mut z) = ([0.0; 8], [0.0; 8], [0.0; 8]);
            for k in 0..8 {
                (x[k], y[k], z[k]) = (of[k].x, of[k].y, of[k].z);
            }
            let (mut shape, mut fresnel, mut usual) = ([0.0; 8], [0.0; 8], true);
            for k in 0..8 {
                let (sx, sy) = (ax * x[k], ay * y[k]);
                let length_i = (sx * sx + sy * sy + z[k] * z[k]).sqrt();
                let s = length_i * wo.z + length_o * z[k];
                let (vx, vy, vz) = (x[k] + wo.x, y[k] + wo.y, z[k] + wo.z);
                let square = vx * vx + vy * vy + vz * vz;
                let (px, py, pz) = (ay * vx, ax * vy, area * vz);
                let p = px * px + py * py + pz * pz;
                shape[k] = scale * square * square / (PI * p * p * s);
                let u = 1.0 - (0.5 * square.sqrt()).min(1.0);
                let u2 = u * u;
                fresnel[k] = u2 * u2 * u;
                usual &= square >= 1e-100 && s >= 1e-150 && z[k] > 0.0;
            }
            if usual {
                for (k, out) in out.iter_mut().enumerate() {
                    *out = f0.map(|f0| (f0 + (1.0 - f0) * fresnel[k]) * shape[k] * z[k]);
                }
            } else {
                wi.iter().zip(out).for_each(|(wi, f)| *f = ggx.f_cos(*wi, wo));
            }
        }
    }
}

impl Brdf for Ggx {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        let f0 = ("f0", self.f0.into());
        if self.is_isotropic() {
            spec::print(&INFO, [("alpha", self.ax.into()), f0])
        } else {
            spec::print(&INFO, [("ax", self.ax.into()), ("ay", self.ay.into()), f0])
        }
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        let (shape, u) = self.shape(wi, wo);
        times(schlick(self.f0, u), shape)
    }

    fn f_cos_batch(&self, wi: &[DVec3], wo: DVec3, out: &mut [[f64; 3]]) {
        if wo.z > 0.0 {
            run(Batch { ggx: self, wi, wo, out });
        } else {
            out.fill([0.0; 3]);
        }
    }

    fn is_isotropic(&self) -> bool {
        self.ax == self.ay
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        hint::half_vector(self, wo, 0.5 * self.ax, 0.5 * self.ay)
    }

    fn peak(&self) -> Peak {
        Peak::Mirror { narrow: self.ax.min(self.ay), wide: self.ax.max(self.ay) }
    }

    fn form(&self) -> Form {
        Form::Ggx { alpha: [self.ax, self.ay], f0: self.f0, scale: [1.0; 3] }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let parameters = [rgb(self.f0), four([self.ax, self.ay, 0.0, 0.0])];
        Some(BrdfShader::new(include_str!("ggx.wgsl"), self.peak(), self.domain(), parameters))
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

    #[test]
    fn many_directions_give_the_bits_of_one_at_a_time() {
        for (ax, ay) in [(0.3, 0.3), (1e-4, 1e-4), (0.02, 0.7), (1.0, 1.0)] {
            let ggx = Ggx { ax, ay, f0: [0.04, 0.5, 1.0] };
            for wo in [DVec3::Z, DVec3::new(0.6, -0.3, 0.2).normalize(), DVec3::new(0.6, 0.8, -0.1)] {
                let at = |k: usize| {
                    let (z, phi) = (1.0 - 0.03 * k as f64, 2.4 * k as f64);
                    let r = (1.0 - z * z).max(0.0).sqrt();
                    DVec3::new(r * phi.cos(), r * phi.sin(), z)
                };
                let mut wi: Vec<DVec3> = (0..51).map(at).collect();
                wi[20] = -wo;
                for n in [0, 1, 8, 13, 51] {
                    let mut out = vec![[f64::NAN; 3]; n];
                    ggx.f_cos_batch(&wi[..n], wo, &mut out);
                    for (f, wi) in out.iter().zip(&wi) {
                        assert_eq!(f.map(f64::to_bits), ggx.f_cos(*wi, wo).map(f64::to_bits), "{wi} {wo}");
                    }
                }
            }
        }
    }
}
