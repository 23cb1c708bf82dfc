//! Normals that vary under the point: σ_k² grows by what they spread the reflection (the paper's future
//! work), and where they vary along one direction more than across it, lookups lie along that one.
//! `normals.wgsl` has the same functions.

use super::GaussianLobes;
use super::frame::Frame;
use super::light::{Light, moment};
use super::lookups::{TAPS, elevation, mean, number, row};
use super::shade;
use crate::gpu::{Entry, Uniform, Value};
use crate::shared::surface::lobe::{self, Taps};
use crate::{Bake, GpuTechnique, PointLobe, Points, Radiance};

/// 1 − the mean cosine under each level's Gaussian.
fn moments(light: &Light) -> Vec<f32> {
    light.sigmas.iter().map(|s| moment(*s) as f32).collect()
}

/// The moment of a mixture of levels.
#[inline(always)]
fn moment_at(moments: &[f32], level: f32) -> f32 {
    let level = level.clamp(0.0, (moments.len() - 1) as f32);
    let i = (level as usize).min(moments.len() - 2);
    moments[i] + (moments[i + 1] - moments[i]) * (level - i as f32)
}

/// The mixture of levels whose moment is `moment`.
#[inline(always)]
fn level_of(moments: &[f32], moment: f32) -> f32 {
    let mut i = 0;
    while i + 2 < moments.len() && moments[i + 1] < moment {
        i += 1;
    }
    i as f32 + ((moment - moments[i]) / (moments[i + 1] - moments[i])).clamp(0.0, 1.0)
}

/// [`shade::shade`] without visibility, for points with lobes of their own, whose alpha is ignored.
pub(super) fn shade(b: &Bake<GaussianLobes>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    let (light, v, turn) = (&b.light, &b.linked, &f.turn);
    let (count, moments, taps_of) = (v.count(), moments(light), &**TAPS);
    let finest = (0.5 * moments[0]).sqrt();
    lobe::shade(q, out, |p| {
        let even = lobe::normals(p).map(|n| light.irradiance.sample(turn.apply(n)));
        let mut sum =
            [0, 1, 2].map(|c| 0.25 * v.diffuse[c] * (even[0][c] + even[1][c] + even[2][c] + even[3][c]));
        let point = lobe::Point { lobe: PointLobe { alpha: -1.0, ..p.lobe }, ..*p };
        let [_, x] = elevation(p.cos_o);
        for i in 0..v.lobes {
            let own = moment_at(&moments, row(&v.means, i * count, count, x)[1]);
            // A Gaussian of σ is as wide as a lobe of α = σ/√2.
            let taps = Taps::new(&point, (0.5 * own).sqrt(), finest);
            let wider = (2.0 * taps.alpha * taps.alpha - own).max(0.0);
            let part = taps.sum(&point, |tap| {
                let [sine, x] = elevation(tap.cos_o);
                let [angle, level, sweep, lookups] = row(&v.means, i * count, count, x);
                let weight = row(&v.weights, i * count, count, x);
                let m = moment_at(&moments, level);
                // Mean cosines multiply.
                let (near, far, part) = light.chain.around(level_of(&moments, m + (1.0 - m) * wider));
                let mut l = [0.0; 3];
                for [place, share] in taps_of.get(number(lookups)).map_or(&[][..], |t| t) {
                    let d = mean(tap.n, tap.r, [sine, tap.cos_o], angle + sweep * place);
                    let d = turn.apply(d);
                    let (l0, l1) = (near.sample(d), far.sample(d));
                    for c in 0..3 {
                        l[c] += weight[c] * share * (l0[c] + (l1[c] - l0[c]) * part);
                    }
                }
                l
            });
            (0..3).for_each(|c| sum[c] += part[c]);
        }
        sum
    });
}

/// [`shade::gpu`] with a lobe per point.
pub(super) fn gpu(b: &Bake<GaussianLobes>, f: &Frame) -> GpuTechnique {
    let mut technique = shade::gpu(b, f);
    technique.modules.pop();
    technique.modules.push(lobe::WGSL.into());
    technique.modules.push(include_str!("normals.wgsl").into());
    technique.entry = Entry::LOBE;
    let sigmas = &b.light.sigmas;
    let chain = [sigmas[0] as f32, sigmas[1] as f32, sigmas.len() as f32, 0.0];
    technique.uniforms.push(Uniform { name: "chain_sigmas", value: Value::Vec4(chain) });
    technique
}
