//! Hints for integrators: the directions in which a lobe of half vectors has its light.

use crate::math::{around, mirror};
use crate::{Brdf, Lobe};
use glam::DVec3;

/// Climbs from `start` to a local maximum of the brightest channel of f_cos(·, wo): pattern search with
/// steps from `step` down to `finest`. At most 400 evaluations.
pub(crate) fn climb(brdf: &dyn Brdf, wo: DVec3, start: DVec3, step: f64, finest: f64) -> DVec3 {
    let value = |w| crate::math::largest(brdf.f_cos(w, wo));
    let (mut at, mut best, mut step, mut budget) = (start, value(start), step, 100);
    while step > finest && budget > 0 {
        budget -= 1;
        let (a, b) = around(at);
        let tries = [a, -a, b, -b].map(|d| (at + d * step).normalize_or(at));
        let found = tries.into_iter().map(|w| (w, value(w))).max_by(|x, y| x.1.total_cmp(&y.1));
        match found {
            Some((w, v)) if v > best => (at, best, step) = (w, v, step * 1.5),
            _ => step *= 0.5,
        }
    }
    at
}

/// Hints for a lobe of half vectors with slope widths `ax`, `ay` (standard deviations along t and b).
///
/// Turning h by δ turns wi by 2δ in the plane of incidence and by 2δ (wo·h) across it, which gives the narrow
/// side of the highlight at grazing views. Where ax ≪ ay, h runs along b, and wi along the cone
/// t·wi = −t·wo (reflection about any h ⊥ t turns the sign of the t component).
pub(crate) fn half_vector(brdf: &dyn Brdf, wo: DVec3, ax: f64, ay: f64) -> Vec<Lobe> {
    let narrow = ax.min(ay);
    let across = 2.0 * narrow * wo.z.max(narrow).min(1.0);
    let specular = mirror(wo);
    let peak = climb(brdf, wo, lifted(specular, narrow), across, 0.1 * across);
    let mut lobes = vec![Lobe::Axis { axis: peak, width: across }];
    if peak.dot(specular) < (2.0 * across).cos() {
        lobes.push(Lobe::Axis { axis: specular, width: across });
    }
    if ax.max(ay) > 2.0 * narrow {
        let axis = if ax < ay { DVec3::X } else { DVec3::Y };
        lobes.push(Lobe::Cone { axis, cosine: -axis.dot(wo), width: 2.0 * narrow });
    }
    lobes
}

/// `w`, lifted off the horizon where f_cos vanishes.
fn lifted(w: DVec3, by: f64) -> DVec3 {
    let z = w.z.max(0.1 * by.min(0.1));
    DVec3::new(w.x, w.y, z).normalize_or(DVec3::Z)
}
