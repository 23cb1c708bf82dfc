//! Frames of a fixed view: radiance of every site by its transport towards the eye. Points that are seen from
//! elsewhere have transport made for each.

use super::choice::{Chosen, choose, not_chosen, on_cube};
use super::light::Light;
use super::material::Glossy;
use super::params::Params;
use super::seen::{Linked, Towards, Work};

use super::transport::{Row, Seen};
use crate::shared::geometry::transport;
use crate::{Points, Radiance, View};
use glam::{Mat3, Vec3};
use std::sync::Arc;
use steradian_parallel::prelude::*;

/// Cosine of the angle, 0.08°, by which a point's view may be off the direction to the frame's eye: rounding.
const SAME: f32 = 1.0 - 1e-6;

/// Wavelets of light on the cube, per channel.
type Wavelets = [Vec<f32>; 3];

/// Radiance of each site in a frame.
#[derive(Default)]
pub struct Frame {
    pub(super) radiance: Vec<[f32; 3]>,
    /// What a frame of a fixed view was made from.
    pub(super) fixed: Fixed,
}

/// What a frame of a fixed view was made from.
#[derive(Default)]
pub struct Fixed {
    /// Rotation of the light, and its wavelets, times the reflectance's tint.
    light: Option<(Mat3, Wavelets)>,
    /// The eye, and the transport towards it.
    pub(super) seen: Option<(Vec3, Arc<Seen>)>,
}

/// The light, turned, in wavelets; times the tint of a reflectance whose channels share their transport.
fn lit(light: &Light, matter: &Glossy, side: usize, rotation: Mat3) -> Wavelets {
    let mut planes = on_cube(light, side, rotation);
    for (plane, tint) in planes.iter_mut().zip(matter.tint.unwrap_or([1.0; 3])) {
        plane.iter_mut().for_each(|l| *l *= tint);
    }
    planes
}

/// What is known before there is a view, an estimate of the relative error of the light's wavelets that a
/// frame leaves out, and the mean number of wavelets that a site keeps; of some sites seen from all
/// directions.
pub fn link(towards: Towards<'_>, light: &Light, p: &Params) -> (Linked, f64, f64) {
    let sample = towards.sample();
    let planes = lit(light, towards.matter, towards.sights.cube.side, Mat3::IDENTITY);
    let chosen = choose(&planes, &sample.norms, p);
    let radiance = |rows: &Vec<Row>| reflected(rows, &planes);
    let all: f64 = sample.rows.iter().flat_map(radiance).map(|l| f64::from(l).powi(2)).sum();
    let left = not_chosen(&planes, &sample.norms, &chosen);
    let kept: usize = sample.rows.iter().flatten().map(|r| r.kept.len()).sum();
    let error = if all > 0.0 { (left / all).sqrt() } else { 0.0 };
    (Linked { norms: sample.norms }, error, kept as f64 / sample.rows.len().max(1) as f64)
}

/// Σ_k L_k T_k over the coefficients of a site's rows, one for all channels or one for each.
fn reflected(rows: &[Row], light: &Wavelets) -> [f32; 3] {
    let channel = |c: usize| {
        let Some(row) = rows.get(c).or(rows.first()) else { return 0.0 };
        let (l, face) = (&light[c], light[c].len() / 6);
        let scaling: f32 = row.scaling.iter().enumerate().map(|(f, t)| t * l[f * face]).sum();
        (scaling + row.kept.iter().map(|(k, t)| t * l[*k as usize]).sum::<f32>()).max(0.0)
    };
    [0, 1, 2].map(channel)
}

/// The light of a frame without a view: it is as it came.
pub fn unseen(f: &mut Frame, towards: Towards<'_>, light: &Light) {
    let planes = lit(light, towards.matter, towards.sights.cube.side, Mat3::IDENTITY);
    *f = Frame { radiance: Vec::new(), fixed: Fixed { light: Some((Mat3::IDENTITY, planes)), seen: None } };
}

/// Makes again what depends on an eye or a light that has moved.
pub fn renew(f: &mut Frame, towards: Towards<'_>, light: &Light, p: &Params, v: &View) {
    let (side, fixed) = (towards.sights.cube.side, &mut f.fixed);
    let turned = fixed.light.as_ref().is_none_or(|(rotation, _)| *rotation != v.light_rotation);
    let moved = fixed.seen.as_ref().is_none_or(|(eye, _)| *eye != v.eye);
    if turned {
        fixed.light = Some((v.light_rotation, lit(light, towards.matter, side, v.light_rotation)));
    }
    if moved {
        let make = || towards.all(v.eye);
        fixed.seen = Some((v.eye, towards.sights.towards(v.eye, &towards.matter.brdf, make)));
    }
    let (Some((_, planes)), Some((_, seen))) = (&fixed.light, &fixed.seen) else { return };
    if turned || moved {
        f.radiance = radiance(seen, planes, p);
    }
}

/// Radiance of all sites, clamped, since the sum of few wavelets may be negative.
fn radiance(seen: &Seen, light: &Wavelets, p: &Params) -> Vec<[f32; 3]> {
    let Chosen { scaling, others } = choose(light, &seen.norms, p);
    let mut out = vec![[0.0; 3]; seen.channels.first().map_or(0, |c| c.sites)];
    if let [one] = &seen.channels[..] {
        one.add(&scaling, &others, &mut out);
    } else {
        for (c, columns) in seen.channels.iter().enumerate() {
            let own = |l: [f32; 3]| std::array::from_fn(|k| if k == c { l[k] } else { 0.0 });
            let others: Vec<_> = others.iter().map(|(k, l)| (*k, own(*l))).collect();
            columns.add(&scaling.map(own), &others, &mut out);
        }
    }
    out.par_iter_mut().for_each(|l| *l = l.map(|x| x.max(0.0)));
    out
}

/// Interpolates the radiance of the sites around points that are seen from the frame's eye. All others get
/// what their sites send towards a viewer far away in the point's direction of view, of the wavelets that
/// matter most over all views.
pub fn shade(
    towards: Towards<'_>,
    linked: &Linked,
    p: &Params,
    f: &Frame,
    q: &Points<'_>,
    out: &mut Radiance<'_>,
) {
    let at = |v: &[&[f32]; 3], i: usize| Vec3::from_array(v.map(|s| s[i]));
    let seen = |i: usize| {
        let Some((eye, _)) = f.fixed.seen else { return false };
        q.p[0].is_empty() || (eye - at(&q.p, i)).normalize_or_zero().dot(at(&q.wo, i)) >= SAME
    };
    let mut elsewhere = Vec::new();
    for i in 0..q.len() {
        if !seen(i) {
            elsewhere.push(i);
            continue;
        }
        let l = transport::gather(q, i, |s| f.radiance.get(s as usize).copied().unwrap_or_default());
        (0..3).for_each(|c| out.rgb[c][i] = l[c]);
    }
    let Some((_, light)) = f.fixed.light.as_ref().filter(|_| !elsewhere.is_empty()) else {
        elsewhere.iter().for_each(|i| (0..3).for_each(|c| out.rgb[c][*i] = 0.0));
        return;
    };
    let chosen = only(&choose(light, &linked.norms, p), light[0].len());
    let one = |w: &mut Work, i: usize| {
        let wo = at(&q.wo, i);
        if wo.dot(at(&q.n, i)) <= 0.0 {
            return [0.0; 3];
        }
        // Each corner once: all three may be one.
        let mut done: Vec<(u32, [f32; 3])> = Vec::with_capacity(3);
        let mut of = |s: u32| {
            if let Some((_, l)) = done.iter().find(|(k, _)| *k == s) {
                return *l;
            }
            let l = towards.row(s as usize, wo, w, None).map_or([0.0; 3], |rows| reflected(&rows, &chosen));
            done.push((s, l));
            l
        };
        let corners = q.site.index.map(|s| s.get(i).map_or([0.0; 3], |s| of(*s)));
        let corner = |s: u32| (0..3).find(|c| q.site.index[*c][i] == s).map_or([0.0; 3], |c| corners[c]);
        transport::gather(q, i, corner)
    };
    let shaded: Vec<[f32; 3]> = elsewhere.par_iter().map_init(|| towards.work(), |w, i| one(w, *i)).collect();
    for (i, l) in elsewhere.into_iter().zip(shaded) {
        (0..3).for_each(|c| out.rgb[c][i] = l[c]);
    }
}

/// The chosen wavelets among zeros.
fn only(chosen: &Chosen, texels: usize) -> Wavelets {
    std::array::from_fn(|c| {
        let mut plane = vec![0.0; texels];
        for (f, l) in chosen.scaling.iter().enumerate() {
            plane[f * (texels / 6)] = l[c];
        }
        chosen.others.iter().for_each(|(k, l)| plane[*k as usize] = l[c]);
        plane
    })
}
