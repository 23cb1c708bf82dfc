//! Choice of the centre for a reflectance, by measurement.

use super::{CentralError, Centre, Lpq, Slice};
use crate::albedo::integral;
use crate::math::{largest, spherical};
use crate::{Brdf, Domain};
use glam::{DVec3, dvec3};
use std::f64::consts::{FRAC_PI_2, PI};
use steradian_base::Task;

/// Directions tried.
const TRIALS: u64 = 64;
/// Relative change of f_cos, to the larger value, up to which it counts as unchanged.
const SAME: f64 = 1e-9;
/// Orders at which centres are compared.
const ORDERS: (usize, usize) = (24, 2);

/// Is the reflectance one that `centre` can hold?
pub(super) fn check(brdf: &dyn Brdf, centre: Centre) -> Result<(), CentralError> {
    match centre {
        Centre::Tangent if !depends_on_tangent_only(brdf) => {
            Err(CentralError::NotTangent { spec: brdf.spec() })
        }
        Centre::Reflection | Centre::Normal if !brdf.is_isotropic() => {
            Err(CentralError::Anisotropic { spec: brdf.spec() })
        }
        _ => Ok(()),
    }
}

/// Are f_cos(wi, wo) and its mirror image in the plane of n and wo different?
pub(super) fn has_two_sides(brdf: &dyn Brdf) -> bool {
    pairs().any(|(wi, wo)| {
        // wo in the plane y = 0, as slices have it.
        let wo = dvec3(-wo.x.hypot(wo.y), 0.0, wo.z);
        differ(brdf, (wi, wo), (dvec3(wi.x, -wi.y, wi.z), wo))
    })
}

/// Is f_cos unchanged as wi and wo are rotated about t, independently? wo stays above the horizon, where
/// viewers are; wi goes everywhere, so that a model with a horizon fails.
fn depends_on_tangent_only(brdf: &dyn Brdf) -> bool {
    let turned = |w: DVec3, angle: f64| {
        let r = w.y.hypot(w.z);
        dvec3(w.x, r * angle.cos(), r * angle.sin())
    };
    brdf.domain() == Domain::Sphere
        && !pairs().zip(0u8..).any(|((wi, wo), i)| {
            let x = f64::from(i);
            let other = (turned(wi, 2.0 + x), turned(wo, PI * (0.5 + 0.45 * x.sin())));
            differ(brdf, (wi, wo), other)
        })
}

fn differ(brdf: &dyn Brdf, a: (DVec3, DVec3), b: (DVec3, DVec3)) -> bool {
    let (f, g) = (brdf.f_cos(a.0, a.1), brdf.f_cos(b.0, b.1));
    let size = largest(f.map(f64::abs)).max(largest(g.map(f64::abs)));
    (0..3).any(|c| (f[c] - g[c]).abs() > SAME * size)
}

/// Pairs of directions: wi over the sphere, wo over the hemisphere, well spread.
fn pairs() -> impl Iterator<Item = (DVec3, DVec3)> {
    let u = |i: u64, step: f64| (0.5 + step * i as f64).fract();
    (0..TRIALS).map(move |i| {
        let wi = spherical((1.0 - 2.0 * u(i, 0.754_877_666)).acos(), 2.0 * PI * u(i, 0.569_840_29));
        let wo = spherical((1.0 - 0.98 * u(i, 0.671_043_6)).acos(), 2.0 * PI * u(i, 0.819_172_5));
        (wi, wo)
    })
}

/// The slice at `theta_v` whose centre is the middle of the lobe, the direction of ∫ f_cos² wi dwi: at
/// grazing views lobes peak off the mirror direction, and need fewer orders in q about their middle.
pub(super) fn leaning(brdf: &dyn Brdf, theta_v: f64) -> Result<Slice, CentralError> {
    check(brdf, Centre::Reflection)?;
    let mirror = Slice::reflection(theta_v);
    mirror.check(Centre::Reflection)?;
    let wo = mirror.view();
    let mut moment = |wi: DVec3| {
        let square: f64 = brdf.f_cos(wi, wo).iter().map(|f| f * f).sum();
        [square * wi.x, square * wi.z, 0.0]
    };
    let [x, z, _] = integral(&brdf.lobes(wo), brdf.domain(), wo, 1e-4, &mut moment);
    let gamma = if x == 0.0 && z == 0.0 { theta_v } else { x.atan2(z) };
    Ok(Slice { theta_v, gamma: gamma.clamp(-theta_v, FRAC_PI_2) })
}

/// The centre about which low orders hold most of the energy: the tangent for reflectance that depends on it
/// alone, else the mirror direction or the normal, whichever holds more of the energy at F = 24, P = 2.
pub fn best_centre(brdf: &dyn Brdf, task: &Task) -> Result<Centre, CentralError> {
    if !brdf.is_isotropic() {
        let tangent = check(brdf, Centre::Tangent).map(|()| Centre::Tangent);
        return tangent.map_err(|_| CentralError::Anisotropic { spec: brdf.spec() });
    }
    let (f, p) = ORDERS;
    let share = |centre| Lpq::project(brdf, centre, f, p, task).map(|rho| rho.share(f, p));
    let (reflection, normal) = (share(Centre::Reflection)?, share(Centre::Normal)?);
    Ok(if normal > reflection { Centre::Normal } else { Centre::Reflection })
}
