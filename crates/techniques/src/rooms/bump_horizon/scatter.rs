//! Light from bump to bump along fixed directions; `scatter.wgsl` has the same functions.

use super::bake::{Kept, Relief};
use super::horizon::{Texel, seen};
use super::links::{Scatter, centre, frame, normal, out_of};
use crate::Material;
use crate::shared::maths::vector::dot;
use crate::shared::surface::bumps;
use glam::DVec3;
use std::f64::consts::PI;
use steradian_relight::height::Caster;
use steradian_sphere::sampling::{Pcg32, cosine_hemisphere, hammersley};

/// Paths per texel of the reference.
const PATHS: u32 = 512;

#[inline(always)]
fn into(frame: [[f32; 3]; 3], w: [f32; 3]) -> DVec3 {
    DVec3::from_array(frame.map(|e| f64::from(dot(e, w)))).normalize_or_zero()
}

#[inline(always)]
fn double(d: [f32; 3]) -> DVec3 {
    DVec3::from_array(d.map(f64::from))
}

/// Radiance after one reflection more than direct light, and up to `bounces` more, of a light in the
/// direction `wi` above the surface, over its irradiance.
#[inline(always)]
pub(super) fn bounced(t: &Relief, s: &Scatter, x: &Texel, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    let count = s.directions.len();
    let to_viewer = into(x.frame, wo);
    let mut sum = [0.0f32; 3];
    for (k, direction) in s.directions.iter().enumerate() {
        let Some(mut texel) = s.meets(x.at, k) else { continue };
        // w f(d → v)(n·d), and π f(d → v) of reflections before it, which are one each.
        let part = |d: [f32; 3], wo: DVec3, weight: f64| {
            let weight = weight / f64::from(d[2]);
            t.brdf.f_cos(double(d).normalize(), wo).map(|f| (weight * f) as f32)
        };
        let mut through = part(direction.d, to_viewer, PI / count as f64);
        let (mut k, mut d) = (k, out_of(x.frame, direction.d));
        for bounce in 0..s.bounces {
            let (at, back) = (centre(texel, s.size), d.map(|x| -x));
            let here = frame(bumps::facing_bump(normal(&t.normals, at), back));
            let back = into(here, back);
            let v = seen(t, at, wi);
            if v > 0.0 {
                let f = t.brdf.f_cos(into(here, wi), back);
                (0..3).for_each(|c| sum[c] += through[c] * v * f[c] as f32);
            }
            if bounce + 1 == s.bounces {
                break;
            }
            k = s.directions[k].before;
            let Some(next) = s.links.link(texel, k) else { break };
            let f = part(s.directions[k].d, back, PI);
            (0..3).for_each(|c| through[c] *= f[c]);
            (texel, d) = (next, out_of(here, s.directions[k].d));
        }
    }
    sum
}

/// [`bounced`] with many directions, each path with random ones after the first, and rays in place of
/// horizons: certificates are measured against it.
pub(super) fn exact(
    t: &Relief,
    caster: &Caster<'_>,
    s: &Scatter,
    [i, j]: [usize; 2],
    [wi, wo]: [DVec3; 2],
) -> [f64; 3] {
    let width = s.size[0];
    let n = t.bumps.as_ref().map_or(DVec3::Z, |b| b.normal([i, j]));
    let axes = |n: DVec3| {
        let [t, b] = bumps::exact_frame(n);
        [t, b, n]
    };
    let local =
        |[t, b, n]: [DVec3; 3], w: DVec3| DVec3::new(w.dot(t), w.dot(b), w.dot(n)).normalize_or_zero();
    let world = |[t, b, n]: [DVec3; 3], d: DVec3| t * d.x + b * d.y + n * d.z;
    let first = axes(bumps::exact_facing(n, wo));
    let to_viewer = local(first, wo);
    let mut random = Pcg32::new((j * width + i) as u64, 3);
    let mut sum = [0.0; 3];
    for k in 0..PATHS {
        let mut d = cosine_hemisphere::sample(hammersley(k, PATHS));
        let (mut here, mut back) = (first, to_viewer);
        let mut texel = j * width + i;
        let mut through = [1.0 / f64::from(PATHS); 3];
        for _ in 0..s.bounces {
            let f = t.brdf.f_cos(d, back).map(|f| PI * f / d.z.max(1e-9));
            (0..3).for_each(|c| through[c] *= f[c]);
            let along = world(here, d);
            let Some(next) = caster.hit(texel % width, texel / width, along.as_vec3()) else { break };
            texel = next;
            let at = centre(texel, s.size);
            let n = double(bumps::facing_bump(normal(&t.normals, at), (-along).as_vec3().to_array()));
            (here, back) = (axes(n.normalize()), -along);
            back = local(here, back);
            // Without shadows all light arrives.
            if t.kept == Kept::Open || caster.hit(texel % width, texel / width, wi.as_vec3()).is_none() {
                let f = t.brdf.f_cos(local(here, wi), back);
                (0..3).for_each(|c| sum[c] += through[c] * f[c]);
            }
            d = cosine_hemisphere::sample(glam::DVec2::new(random.next_f64(), random.next_f64()));
        }
    }
    sum
}

/// Pairs of directions and texels at which light that bounces is compared.
pub(super) fn pairs(m: &Material) -> impl Iterator<Item = (u32, crate::local::Pair)> {
    crate::local::pairs(&*m.brdf, 512)
}
