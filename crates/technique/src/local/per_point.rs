//! The loop over points and lights; `local.wgsl` and `textured.wgsl` have the same loops for GPUs.

use super::{Light, LocalBaked, LocalFrame, LocalShading, Place, TexturedTechnique, technique};
use crate::direct::Shadows;
use crate::shared::maths::vector::{Axes, tangent};
use crate::{GpuTechnique, PointChart, Points, Radiance};
use glam::DVec3;
use std::sync::Arc;
use steradian_base::Certificate;
use steradian_simd::{Arch, Kernel};

/// A local technique's function of two directions, evaluated at every point for every light.
pub struct PerPoint<T: TexturedTechnique> {
    tables: Arc<T::Tables>,
    lights: Vec<Light>,
    certificate: Certificate,
}

impl<T: TexturedTechnique> PerPoint<T> {
    /// Prepares the shading of points under the lights of a frame.
    pub fn new(b: &LocalBaked<T>, frame: &LocalFrame<'_>) -> Self {
        Self {
            tables: b.tables.clone(),
            lights: frame.lights.rows(frame.view),
            certificate: b.certificate.clone(),
        }
    }
}

/// Normal, tangent, side of the bitangent and footprint of point `i`; where `charted`, those of the texture's
/// chart, if the point has one.
#[inline(always)]
fn chart(q: &Points<'_>, charted: bool, i: usize) -> PointChart {
    let at = |v: &[&[f32]; 3]| v.map(|s| s[i]);
    if charted && !q.chart[0].is_empty() {
        return PointChart::from_array(q.chart.map(|s| s[i]));
    }
    let n = at(&q.n);
    let t = if q.t[0].is_empty() { tangent(n) } else { at(&q.t) };
    PointChart { n, t, side: 1.0, footprint: 0.0 }
}

/// The part of the light from `d` that reaches a point.
pub fn arriving(shadows: Shadows<'_>, p: [f32; 3], n: [f32; 3], d: [f32; 3], distance: f32) -> f32 {
    let [p, n, d] = [p, n, d].map(|v| DVec3::from_array(v.map(f64::from)));
    shadows.arriving(p, n, d, f64::from(distance)) as f32
}

/// A batch as a computation for every instruction set: a closure as large as this is inlined into none.
struct Batch<'a, 'p, 'r, T: TexturedTechnique> {
    tables: &'a T::Tables,
    lights: &'a [Light],
    shadows: Option<Shadows<'a>>,
    q: &'a Points<'p>,
    out: &'a mut Radiance<'r>,
}

impl<T: TexturedTechnique> Kernel for Batch<'_, '_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        run::<T>(self.tables, self.lights, self.shadows, self.q, self.out);
    }
}

#[inline(always)]
fn run<T: TexturedTechnique>(
    tables: &T::Tables,
    lights: &[Light],
    shadows: Option<Shadows<'_>>,
    q: &Points<'_>,
    out: &mut Radiance<'_>,
) {
    let (positions, textured) = (!q.p[0].is_empty(), T::CARD.needs.uv && !q.uv[0].is_empty());
    for i in 0..q.len() {
        let at = |v: &[&[f32]; 3]| v.map(|s| s[i]);
        let c = chart(q, T::CARD.needs.uv, i);
        let axes = Axes::sided(c.n, c.t, c.side);
        let o = axes.local(at(&q.wo));
        // False for NaN too.
        if o[2] > 0.0 {
            let p = positions.then(|| at(&q.p));
            let uv = if textured { q.uv.map(|s| s[i]) } else { [0.0; 2] };
            let x = T::texel(tables, Place { uv, footprint: c.footprint }, o);
            let mut sum = [0.0f32; 3];
            for light in lights {
                let Some((d, e, distance)) = light.at(p) else { continue };
                let f = T::f_cos(tables, &x, axes.local(d), o);
                let seen = match (shadows, p) {
                    (Some(shadows), Some(p)) if f != [0.0; 3] => arriving(shadows, p, c.n, d, distance),
                    _ => 1.0,
                };
                if seen > 0.0 {
                    (0..3).for_each(|c| sum[c] = (sum[c] + seen * f[c] * e[c]).clamp(-f32::MAX, f32::MAX));
                }
            }
            (0..3).for_each(|c| out.rgb[c][i] += sum[c]);
        }
    }
}

impl<T: TexturedTechnique> LocalShading for PerPoint<T> {
    fn add(&self, shadows: Option<Shadows<'_>>, q: &Points<'_>, out: &mut Radiance<'_>) {
        if q.is_consistent() && out.rgb.iter().all(|p| p.len() == q.len()) {
            let (tables, lights) = (&*self.tables, &*self.lights);
            steradian_simd::run(Batch::<T> { tables, lights, shadows, q, out });
        }
    }

    fn gpu(&self) -> Option<GpuTechnique> {
        Some(technique(&T::CARD, T::text(&self.tables)?, &self.lights))
    }

    fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    fn is_textured(&self) -> bool {
        T::CARD.needs.uv
    }
}
