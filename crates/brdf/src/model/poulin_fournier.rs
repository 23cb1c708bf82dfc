//! A surface of parallel micro-cylinders.
//!
//! Poulin & Fournier 1990, A Model for Anisotropic Reflection: the reflected light is that of the portion of
//! the cylinders (and of the floor between them) that is both lit and seen, their neighbours blocking. Here
//! that portion is exact, the diffuse integral is closed, and the specular one (which the paper approximates
//! by Chebyshev polynomials) is reduced to ∫ cosⁿ, which is tabulated.
//!
//! Cylinders of radius 1 lie along t with axes `d` apart; the floor lies at height `h` above the axes. Across
//! t, a direction w has length l = √(1 − (w·t)²) and tilt θ = atan2(w·b, w·n). The point of a cylinder with
//! normal n'(φ) = sin φ b + cos φ n, |φ| ≤ arccos h, sees w if |φ − θ| < π/2 and the nearest neighbour on
//! that side leaves it free: ±sin(φ − θ) ≤ d cos θ − 1. The floor sees w between 1/cos θ-wide shadows. With a
//! local reflectance f' = kd/π + ks (N + 8)/(8π) (n'·h)^N:
//!
//! **f = 1/(d n·wi n·wo) [∫ f' (n'·wi)(n'·wo) dφ + w f'_floor n·wi n·wo]**, w the width of floor that is lit
//! and seen. For d → ∞ and h → 1 this is the local reflectance itself.

use crate::draw::{self, Draw};
use crate::math::{INV_PI, above, half, largest, positive_pow, power_cosine};
use crate::model::cosine_power::CosinePower;
use crate::registry::Entry;
use crate::shader::{BrdfShader, rgb, with};
use crate::spec::{self, Args};
use crate::{Brdf, Info, Lobe, Peak, Sample, SharedBrdf, SpecError};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;
use steradian_base::ParamInfo;

/// The page.
pub static INFO: Info = Info {
    name: "poulin-fournier",
    source: "Poulin & Fournier 1990 (added cylinders; exact visibility and integrals)",
    formula: "f = 1/(d n·wi n·wo) [∫ f' (n'·wi)(n'·wo) dφ over the lit and seen part of a cylinder, plus the same of \
              the floor], f' = kd/π + ks (n + 8)/(8π) (n'·h)^n",
    units: "sr⁻¹",
    parameters: &[
        ParamInfo::real("d", [2.0, 1e3], 2.0, "distance of the cylinders' axes in radii"),
        ParamInfo::real("h", [0.0, 0.99], 0.0, "height of the floor above the axes in radii"),
        ParamInfo::rgb("kd", [0.0, 1.0], 0.0, "diffuse albedo of the material"),
        ParamInfo::rgb("ks", [0.0, 1.0], 1.0, "specular factor of the material"),
        ParamInfo::real("n", [0.0, 1e5], 0.0, "exponent of the material").required(),
    ],
    reciprocity: "reciprocal",
    energy: "albedo ≤ that of the material (light that the cylinders block is lost)",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let n = a.number("n")?;
    Ok(Arc::new(PoulinFournier {
        d: a.number("d")?,
        h: a.number("h")?,
        kd: a.rgb("kd")?,
        ks: a.rgb("ks")?,
        n,
        powers: CosinePower::new(n),
    }))
}

/// Parallel micro-cylinders along the tangent.
#[derive(Debug, Clone)]
pub struct PoulinFournier {
    d: f64,
    h: f64,
    kd: [f64; 3],
    ks: [f64; 3],
    n: f64,
    powers: CosinePower,
}

/// A direction across the cylinders.
#[derive(Clone, Copy)]
struct Across {
    length: f64,
    theta: f64,
}

impl Across {
    fn new(w: DVec3) -> Self {
        Self { length: w.y.hypot(w.z), theta: w.y.atan2(w.z) }
    }
}

impl PoulinFournier {
    /// The interval of normals φ of a cylinder that sees `w`.
    fn seen(&self, w: Across) -> (f64, f64) {
        let limit = self.h.acos();
        let free = (self.d * w.theta.cos() - 1.0).clamp(-1.0, 1.0).asin();
        if w.theta >= 0.0 {
            ((w.theta - FRAC_PI_2).max(-limit), (w.theta + free).min(limit))
        } else {
            ((w.theta - free).max(-limit), (w.theta + FRAC_PI_2).min(limit))
        }
    }

    /// The interval of floor positions x between the axes 0 and d that sees `w`.
    fn floor(&self, w: Across) -> (f64, f64) {
        let edge = (1.0 - self.h * self.h).sqrt();
        let sine = w.theta.sin().abs();
        // Where the rim that w grazes lies below the floor, the neighbour ends where the floor meets it.
        let shadow = if sine <= self.h { edge } else { (1.0 - self.h * sine) / w.theta.cos() };
        if w.theta >= 0.0 { (edge, self.d - shadow.max(edge)) } else { (shadow.max(edge), self.d - edge) }
    }

    /// ∫ (n'·wi)(n'·wo) dφ: ∫ cos(φ − a) cos(φ − b) = ½ [φ cos(a − b) + ½ sin(2φ − a − b)].
    fn diffuse(&self, i: Across, o: Across, (lo, hi): (f64, f64)) -> f64 {
        let sum = i.theta + o.theta;
        let sines = (2.0 * hi - sum).sin() - (2.0 * lo - sum).sin();
        0.5 * ((hi - lo) * (i.theta - o.theta).cos() + 0.5 * sines) * i.length * o.length
    }

    /// ∫ (n'·h)^n (n'·wi)(n'·wo) dφ. With x = φ − θ_h it is ½ lᵢ lₒ l_hⁿ ∫ cosⁿx [cos(a − b) + cos(2x + c)]
    /// dx, c = 2θ_h − a − b.
    fn specular(&self, i: Across, o: Across, h: Across, (lo, hi): (f64, f64)) -> f64 {
        let [even, twice, odd] = self.powers.integrals(lo - h.theta, hi - h.theta);
        let (s, c) = (2.0 * h.theta - i.theta - o.theta).sin_cos();
        let sum = (i.theta - o.theta).cos() * even + c * twice - s * odd;
        0.5 * sum.max(0.0) * positive_pow(h.length, self.n) * i.length * o.length
    }

    fn specular_norm(&self) -> f64 {
        (self.n + 8.0) / (8.0 * PI)
    }

    fn draw(&self) -> [(f64, Draw); 1] {
        [(1.0, Draw::Cosine)]
    }
}

impl Brdf for PoulinFournier {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        let shape = [("d", self.d.into()), ("h", self.h.into())];
        let material = [("kd", self.kd.into()), ("ks", self.ks.into()), ("n", self.n.into())];
        spec::print(&INFO, shape.into_iter().chain(material))
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        let m = half(wi, wo);
        let (i, o, h) = (Across::new(wi), Across::new(wo), Across::new(m));
        let (si, so) = (self.seen(i), self.seen(o));
        let part = (si.0.max(so.0), si.1.min(so.1));
        let (mut diffuse, mut specular) = (0.0, 0.0);
        if part.1 > part.0 {
            diffuse += self.diffuse(i, o, part).max(0.0);
            specular += self.specular(i, o, h, part);
        }
        let (fi, fo) = (self.floor(i), self.floor(o));
        let width = (fi.1.min(fo.1) - fi.0.max(fo.0)).max(0.0) * wi.z * wo.z;
        diffuse += width;
        specular += width * power_cosine(DVec3::Z, m, self.n);
        let scale = 1.0 / (self.d * wi.z * wo.z).max(1e-150);
        let specular = specular * self.specular_norm();
        std::array::from_fn(|c| scale * (self.kd[c] * INV_PI * diffuse + self.ks[c] * specular))
    }

    fn is_isotropic(&self) -> bool {
        false
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        if largest(self.ks) == 0.0 {
            return Vec::new();
        }
        let width = 2.0 * (1.0 / (self.n + 2.0)).sqrt();
        let mut lobes = vec![Lobe::Cone { axis: DVec3::X, cosine: -wo.x, width }];
        if self.d > 2.0 {
            lobes.push(Lobe::Axis { axis: crate::math::mirror(wo), width: width * wo.z.max(0.1) });
        }
        lobes
    }

    fn peak(&self) -> Peak {
        let width = 2.0 * (1.0 / (self.n + 2.0)).sqrt();
        if largest(self.ks) == 0.0 { Peak::Smooth } else { Peak::Cone { sign: -1.0, width } }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let (scalars, table) = self.powers.plain();
        let mut parameters = vec![with(self.kd, self.d), with(self.ks, self.h)];
        parameters.extend(scalars.map(rgb));
        parameters.extend(table.iter().map(|t| rgb(*t)));
        let text = include_str!("poulin_fournier.wgsl");
        let shader = BrdfShader::new(text, self.peak(), self.domain(), parameters);
        Some(shader.with_arrays([("BRDF_NODES", table.len())]))
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
    use crate::math::spherical;
    use crate::parse;

    /// Against rays from 400 000 points of the cylinders and as many of the floor. The first two see the
    /// floor from below the rim's tangent, |sin θ| < h.
    #[test]
    fn rays_against_neighbours() {
        for (spec, (a, b), exact) in [
            ("d=3,h=0.3,kd=0.4,n=200", ((0.1, 1.3), (0.2, -2.0)), 2.877_346_676),
            ("d=2.2,h=0.5,kd=0.4,ks=0.5,n=30", ((0.3, 0.9), (0.15, 2.2)), 0.360_082_213_6),
            ("d=3,h=0.3,kd=0.4,n=7.5", ((1.1, 0.5), (0.9, 2.9)), 0.405_464_374_7),
            ("d=2,h=0,kd=0.2,n=1.5", ((0.7, 0.5), (1.2, 1.9)), 0.389_595_833_1),
            ("d=3,h=0.3,kd=0.4,n=200", ((1.2, 1.4), (1.15, 1.6)), 2.150_301_086),
        ] {
            let brdf = parse(&format!("poulin-fournier:{spec}")).expect(spec);
            let f = brdf.eval(spherical(a.0, a.1), spherical(b.0, b.1))[0];
            let exact: f64 = exact;
            assert!((f / exact - 1.0).abs() < 3e-5, "{spec}: {f} {exact}");
        }
    }
}
