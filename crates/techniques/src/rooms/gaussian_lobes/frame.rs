//! The state of a frame: the rotated light, and the part of diffuse light that is blocked at each site.

use super::GaussianLobes;
use super::visibility::DIFFUSE;
use crate::gpu::Uniform;
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::light::sh_light;
use crate::{Bake, Points, View};
use std::f64::consts::PI;
use steradian_parallel::prelude::*;

/// The state of a frame.
#[derive(Default)]
pub struct Frame {
    pub(super) turn: LightRotation,
    /// ρ_d/π L_i, turned; empty where nothing is blocked or nothing diffuse.
    pub(super) light: Vec<[f32; 3]>,
    /// Radiance that each site's diffuse part loses to occlusion.
    blocked: Vec<[f32; 3]>,
}

impl Frame {
    pub(super) fn new(b: &Bake<GaussianLobes>, v: &View) -> Self {
        let mut out = Self { turn: LightRotation::new(v.light_rotation), ..Self::default() };
        let irradiance = &b.transfer.irradiance;
        let Some(light) = b.light.sh.as_ref().filter(|_| b.linked.is_diffuse() && irradiance.stride > 0)
        else {
            return out;
        };
        let factor = b.linked.diffuse.map(|d| f64::from(d) / PI);
        out.light = light.turned(DIFFUSE, v.light_rotation, factor);
        let site = |t: &[f32]| {
            let mut sum = [0.0; 3];
            for (l, t) in out.light.iter().zip(t) {
                (0..3).for_each(|c| sum[c] += l[c] * t);
            }
            sum
        };
        out.blocked = irradiance.data.par_chunks_exact(irradiance.stride).map(site).collect();
        out
    }

    /// Radiance that the diffuse part loses to occlusion at point `i`, interpolated.
    #[inline(always)]
    pub(super) fn blocked(&self, q: &Points<'_>, i: usize) -> [f32; 3] {
        let mut sum = [0.0; 3];
        let unknown = q.site.index.iter().any(|s| s.is_empty()) || q.site.weight.iter().any(|s| s.is_empty());
        if self.blocked.is_empty() || unknown {
            return sum;
        }
        let [u, v] = q.site.weight.map(|w| w[i]);
        for (index, w) in q.site.index.iter().zip([1.0 - u - v, u, v]) {
            let site = self.blocked.get(index[i] as usize).copied().unwrap_or_default();
            (0..3).for_each(|c| sum[c] += w * site[c]);
        }
        sum
    }

    pub(super) fn uniforms(&self) -> Vec<Uniform> {
        let mut all = vec![self.turn.uniform()];
        all.extend(sh_light::uniforms(&self.light));
        all
    }
}
