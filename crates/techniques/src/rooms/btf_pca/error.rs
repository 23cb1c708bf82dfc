//! The error at texels, against the function itself.

use super::bake::Tables;
use super::shade;
use crate::Material;
use crate::local::{Place, error_at, texel, texel_at};
use glam::DVec3;
use std::f64::consts::PI;

pub(super) fn error(t: &Tables, m: &Material) -> f64 {
    let (width, height, _) = t.small.levels.level(0);
    let size = (width, height);
    let place = |k| texel(k, size).0;
    let shaded = |at, wi, wo| shade::f_cos(t, &shade::texel(t, at, wo), wi);
    let Some(btf) = &m.apparent else {
        return error_at(&*m.brdf, place, |_, wi, wo| m.brdf.f_cos(wi, wo), shaded);
    };
    let exact = |at: Place, wi: DVec3, wo: DVec3| {
        let [i, j] = texel_at(at, size);
        let single = |d: DVec3| d.as_vec3().to_array();
        let ((v, a), (l, b)) = (t.views.around(single(wo)), t.lights.around(single(wi)));
        let mut sum = [0.0; 3];
        for p in 0..9 {
            let (p, q) = (p / 3, p % 3);
            let by = f64::from(a[p]) * f64::from(b[q]) * wi.z / (PI * btf.lights()[l[q] as usize].z);
            let value = btf.value(j * width + i, v[p] as usize, l[q] as usize);
            (0..3).for_each(|c| sum[c] += by * f64::from(value[c]));
        }
        sum
    };
    error_at(&*m.brdf, place, exact, shaded)
}
