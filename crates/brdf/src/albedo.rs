//! Directional and hemispherical albedo of a reflectance.

use crate::adaptive::{Estimate, graded, integrate};
use crate::{Brdf, Domain, Lobe};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// ∫ f_cos(wi, wo) dwi per channel over the model's domain, by adaptive quadrature that starts from the
/// model's own hints; `tolerance` is relative to the largest channel. 0 where n·wo ≤ 0.
pub fn directional(brdf: &dyn Brdf, wo: DVec3, tolerance: f64) -> [f64; 3] {
    integral(&brdf.lobes(wo), brdf.domain(), wo, tolerance, &mut |wi| brdf.f_cos(wi, wo))
}

/// ∫ g(wi) dwi over `domain`, refined where `lobes` say that g is concentrated.
pub(crate) fn integral(
    lobes: &[Lobe],
    domain: Domain,
    wo: DVec3,
    tolerance: f64,
    g: &mut dyn FnMut(DVec3) -> [f64; 3],
) -> [f64; 3] {
    if wo.z <= 0.0 {
        return [0.0; 3];
    }
    let plan = Plan::new(lobes, domain);
    let mut largest = 0.0f64;
    let mut slice = |phi: f64| {
        let e = plan.slice(phi, 0.1 * tolerance, 1e-3 * tolerance * largest, g);
        largest = e.value.iter().fold(largest, |m, v| m.max(v.abs()));
        e.value
    };
    integrate(&mut slice, &plan.azimuths(), tolerance, 0.0, 400).value
}

/// (1/π) ∫ albedo(wo) n·wo dwo: the share of uniform light that comes back.
pub fn hemispherical(brdf: &dyn Brdf, tolerance: f64) -> [f64; 3] {
    let azimuths = if brdf.is_isotropic() { 1 } else { 8 };
    let mut sum = [0.0; 3];
    for i in 0..azimuths {
        let phi = 2.0 * PI * (f64::from(i) + 0.5) / f64::from(azimuths);
        // ∫ ρ μ dμ · 2 with μ = cos θ: in θ, ρ sin 2θ.
        let mut f = |theta: f64| {
            let wo = crate::math::spherical(theta, phi);
            directional(brdf, wo, 0.3 * tolerance).map(|a| a * (2.0 * theta).sin())
        };
        let part = integrate(&mut f, &[0.0, 1.2, FRAC_PI_2], tolerance, 0.0, 20);
        sum = crate::math::plus(sum, part.value.map(|v| v / f64::from(azimuths)));
    }
    sum
}

/// Polar coordinates (θ, φ) about the strongest hint, with the breakpoints of all hints.
struct Plan {
    axis: DVec3,
    /// ⊥ axis, towards n.
    u: DVec3,
    v: DVec3,
    hemisphere: bool,
    thetas: Vec<(f64, f64)>,
    phis: Vec<(f64, f64)>,
}

impl Plan {
    fn new(lobes: &[Lobe], domain: Domain) -> Self {
        let hemisphere = domain == Domain::Hemisphere;
        let axis = Self::choose(lobes, hemisphere);
        // n − (n·a) a without cancellation where a is near n.
        let sine2 = axis.x * axis.x + axis.y * axis.y;
        let towards_n = DVec3::new(-axis.x * axis.z, -axis.y * axis.z, sine2);
        let u = towards_n.try_normalize().unwrap_or(DVec3::X);
        let mut plan = Self { axis, u, v: axis.cross(u), hemisphere, thetas: Vec::new(), phis: Vec::new() };
        plan.phis.extend([(FRAC_PI_2, axis.z.max(1e-3)), (-FRAC_PI_2, axis.z.max(1e-3))]);
        lobes.iter().for_each(|l| plan.add(*l));
        plan
    }

    /// A ridge's axis first, else the first peak above the horizon, else n.
    fn choose(lobes: &[Lobe], hemisphere: bool) -> DVec3 {
        let ridge = lobes.iter().find_map(|l| match *l {
            Lobe::Cone { axis, .. } | Lobe::Arc { normal: axis, .. } => Some(axis),
            Lobe::Axis { .. } => None,
        });
        let peak = || {
            lobes.iter().find_map(|l| match *l {
                Lobe::Axis { axis, .. } if axis.z >= 0.0 || !hemisphere => Some(axis),
                _ => None,
            })
        };
        let axis = ridge.or_else(peak).unwrap_or(DVec3::Z);
        if hemisphere && axis.z < 0.0 { -axis } else { axis }
    }

    fn add(&mut self, lobe: Lobe) {
        match lobe {
            Lobe::Axis { axis, width } => {
                let theta = self.axis.cross(axis).length().atan2(self.axis.dot(axis));
                self.thetas.push((theta, width));
                let sine = theta.sin();
                if sine > width {
                    self.phis.push((axis.dot(self.v).atan2(axis.dot(self.u)), width / sine));
                }
            }
            Lobe::Cone { axis, cosine, width } if axis.dot(self.axis).abs() > 0.999 => {
                self.thetas.push((cosine.clamp(-1.0, 1.0).acos(), width));
            }
            Lobe::Arc { normal, width } if normal.dot(self.axis).abs() > 0.999 => {
                self.thetas.push((FRAC_PI_2, width));
            }
            Lobe::Cone { .. } | Lobe::Arc { .. } => {}
        }
    }

    fn azimuths(&self) -> Vec<f64> {
        graded(-PI, PI, &self.phis)
    }

    /// Polar angle at which the meridian of φ meets the horizon: z = a_z cos θ + u_z sin θ cos φ = 0.
    fn horizon(&self, phi: f64) -> f64 {
        if self.hemisphere { self.axis.z.max(0.0).atan2(-self.u.z * phi.cos()) } else { PI }
    }

    fn slice(
        &self,
        phi: f64,
        relative: f64,
        absolute: f64,
        g: &mut dyn FnMut(DVec3) -> [f64; 3],
    ) -> Estimate {
        let end = self.horizon(phi);
        let across = self.u * phi.cos() + self.v * phi.sin();
        let mut f = |theta: f64| {
            let (s, c) = theta.sin_cos();
            g(self.axis * c + across * s).map(|x| x * s)
        };
        integrate(&mut f, &graded(0.0, end.max(1e-300), &self.thetas), relative, absolute, 100)
    }
}
