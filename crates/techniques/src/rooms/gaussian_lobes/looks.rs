//! Directions of the lobes of a view, and the part of their visibility that is clamped.

use super::halves;
use super::lookups::{elevation, mean, row};
use super::place::Place;
use super::turned;
use super::views::Views;
use super::visibility::{Blocked, MOST, ratio};
use crate::certify::Report;
use crate::shared::maths::vector::{cross, tangent};
use glam::{DVec3, Vec3};
use steradian_prefilter::probe;
use steradian_sphere::Frame;

/// For each lobe towards `wo`: its mean direction, the zonal coefficients of the visibility there, and its
/// weight.
fn looks(v: &Views, n: DVec3, wo: DVec3) -> Vec<([f32; 3], [f32; 4], f64)> {
    let to = |v: DVec3| v.as_vec3().to_array();
    if v.is_turned() {
        let n = to(n);
        let (t, wo) = (tangent(n), to(wo));
        if !v.half_vectors.is_empty() {
            let (place, axes) = (halves::place(v, n, t, wo), [t, cross(n, t), n]);
            let used = v.used_at(place.first).iter().map(|k| *k as usize);
            let all = used.map(|k| halves::Gaussian::new(v, &place, k, &axes, wo));
            let weight = |w: &[f32; 4]| w[..3].iter().map(|w| f64::from(*w)).sum();
            return all.map(|g| (g.mean, g.zonal, weight(&g.weight))).collect();
        }
        let place = Place::new(v, n, t, wo);
        let lobes = (0..v.lobes).map(|i| turned::Lobe::new(v, &place, i));
        return lobes.map(|l| (l.mean, l.zonal, l.weight.iter().map(|w| f64::from(*w)).sum())).collect();
    }
    let r = to(2.0 * n.dot(wo) * n - wo);
    let cos_o = n.dot(wo) as f32;
    let (n, [sine, x], count) = (n.as_vec3().to_array(), elevation(cos_o), v.count());
    let lobe = |i: usize| {
        let [angle, ..] = row(&v.means, i * count, count, x);
        let weight = row(&v.weights, i * count, count, x);
        let zonal = if v.zonal.is_empty() { [1.0; 4] } else { row(&v.zonal, i * count, count, x) };
        (mean(n, r, [sine, cos_o], angle), zonal, weight.iter().map(|w| f64::from(*w)).sum())
    };
    (0..v.lobes).map(lobe).collect()
}

/// Most sites at which [`report`] evaluates visibility: with [`VIEWS`] each, 8192 pairs, of which shares have
/// a standard error of 0.6 % at most.
const SITES: usize = 512;
/// Views of each site.
const VIEWS: usize = 16;

/// Reports the share of the lobes' weight whose visibility was below 0 or above 1 before it was clamped.
pub(super) fn report(blocked: &Blocked, v: &Views, mut report: Report) -> Report {
    let bands = blocked.bands();
    let count = blocked.normals.data.len() / 3;
    if bands == 0 || count == 0 {
        return report;
    }
    let (mut all, mut below, mut above, mut seen) = (0.0, 0.0, 0.0, 0.0);
    for k in 0..count.min(SITES) {
        let site = (k * count / count.min(SITES)) as u32;
        let (Some(n), Some(row)) = (blocked.normals.at(site), blocked.visibility.at(site)) else { continue };
        let n = [n[0], n[1], n[2]];
        let mut b = [0.0; MOST * MOST];
        b[..row.len().min(MOST * MOST)].copy_from_slice(&row[..row.len().min(MOST * MOST)]);
        let frame = Frame::from_normal(Vec3::from_array(n).as_dvec3().normalize_or(DVec3::Z));
        for view in 0..VIEWS {
            // Half of a spiral over the sphere: uniform over the hemisphere.
            let local = probe::direction(view, 2 * VIEWS);
            let wo = frame.to_world(DVec3::new(local.x, local.z, local.y.abs()));
            for (d, zonal, weight) in looks(v, frame.n, wo) {
                let value = match bands {
                    1 => ratio::<1>(&b, n, zonal, d),
                    2 => ratio::<2>(&b, n, zonal, d),
                    3 => ratio::<3>(&b, n, zonal, d),
                    _ => ratio::<4>(&b, n, zonal, d),
                };
                all += weight;
                below += if value < 0.0 { weight } else { 0.0 };
                above += if value > 1.0 { weight } else { 0.0 };
                seen += weight * f64::from(value.clamp(0.0, 1.0));
            }
        }
    }
    let share = |part: f64| if all > 0.0 { part / all } else { 0.0 };
    report = report.detail("visibility of lobes, mean", share(seen));
    report
        .detail("weight whose visibility was below 0 and is cut", share(below))
        .detail("weight whose visibility was above 1 and is cut", share(above))
}
