//! The light that arrives at the vertices along their links in a frame, and the radiance that points reflect
//! of it; `shade.wgsl` has the latter.

use super::PrecomputedVisibility;
use super::tables::{Emitter, Params, Seen, Tables};
use crate::direct::Shadows;
use crate::gpu::{Buffer, Uniform, Value, shadow};
use crate::local::{self, Light, LocalBaked, LocalFrame, LocalShading, LocalText, PerPoint, arriving};
use crate::shared::maths::vector::{Axes, dot, tangent};
use crate::{BakeError, GpuTechnique, Points, Radiance};
use glam::{DVec3, Vec3};
use std::f32::consts::PI;
use std::sync::Arc;
use steradian_base::Certificate;
use steradian_brdf::Form;
use steradian_parallel::prelude::*;
use steradian_scene::Ray;
use steradian_transfer::Link;

/// Data of the vertices under the lights of a frame. Each vertex has a row of the radiance that arrives along
/// each direction, and of the visible part of each light; a last row holds the directions.
#[derive(Debug, Clone, Default)]
pub struct Rows {
    data: Vec<f32>,
    /// Directions, and 3 numbers each in a row.
    directions: usize,
    /// Numbers a row.
    stride: usize,
}

/// Radiance that leaves emitters, or arrives at vertices, for each direction.
type Light3 = Vec<[f32; 3]>;

fn finite(x: f64) -> f32 {
    (x as f32).clamp(-f32::MAX, f32::MAX)
}

impl Rows {
    /// Lets the light of a frame through.
    pub fn new(s: &Seen, lights: &[Light], p: &Params) -> Self {
        let (count, vertices) = (s.directions.len(), s.origins.len());
        let stride = 3 * count + lights.len();
        let mut data = vec![0.0f32; (vertices + 1) * stride];
        let seen = |v: usize, l: &Light| {
            let Some((direction, _, distance)) = l.at(Some(s.origins[v].to_array())) else { return 0.0 };
            let ray = Ray { origin: s.origins[v], direction: Vec3::from_array(direction) };
            let lit = !p.shadowed() || !s.bvh.occluded(&ray, distance);
            f32::from(u8::from(lit))
        };
        data[..vertices * stride].par_chunks_mut(stride.max(1)).enumerate().for_each(|(v, row)| {
            row[3 * count..].iter_mut().zip(lights).for_each(|(to, l)| *to = seen(v, l));
        });
        let mut leaving = s.direct(lights, |v, k| data[v * stride + 3 * count + k]);
        for bounce in 0..p.bounces {
            let arriving = s.arriving(&leaving);
            let rows = data[..vertices * stride].par_chunks_mut(stride.max(1));
            rows.zip(arriving.par_chunks(count.max(1))).for_each(|(row, more)| {
                row[..3 * count].iter_mut().zip(more.iter().flatten()).for_each(|(to, x)| *to += x);
            });
            if bounce + 1 < p.bounces {
                leaving = s.reflected(&arriving);
            }
        }
        let last = data[vertices * stride..].chunks_mut(3);
        last.zip(&s.directions).for_each(|(to, d)| to.copy_from_slice(&d.as_vec3().to_array()));
        Self { data, directions: count, stride }
    }

    fn vertices(&self) -> usize {
        (self.data.len() / self.stride.max(1)).saturating_sub(1)
    }

    fn row(&self, v: usize) -> &[f32] {
        &self.data[v * self.stride..][..self.stride]
    }
}

impl Seen {
    fn emitted(&self, one: impl Fn(Emitter, &mut [[f32; 3]]) + Sync) -> Light3 {
        let count = self.directions.len();
        let mut out = vec![[0.0f32; 3]; self.emitters.len() * count];
        out.par_chunks_mut(count.max(1)).zip(self.emitters.par_iter()).for_each(|(out, e)| one(*e, out));
        out
    }

    /// Radiance that emitters reflect directly of the lights, against each direction; `seen` is the part of a
    /// light that a vertex sees.
    fn direct(&self, lights: &[Light], seen: impl Fn(usize, usize) -> f32 + Sync) -> Light3 {
        self.emitted(|e, out| {
            let v = e.vertex as usize;
            let one = |(k, l): (usize, &Light)| {
                let (d, irradiance, _) = l.at(Some(self.origins[v].to_array()))?;
                let part = f64::from(seen(v, k));
                let wi = self.frames[v].to_local(DVec3::from_array(d.map(f64::from)).normalize_or_zero());
                (part > 0.0).then(|| (wi, irradiance.map(|x| part * f64::from(x))))
            };
            let from: Vec<(DVec3, [f64; 3])> = lights.iter().enumerate().filter_map(one).collect();
            self.leaving(e, &from, out);
        })
    }

    /// Radiance that emitters reflect of the light that arrives at their vertices.
    fn reflected(&self, arriving: &Light3) -> Light3 {
        let count = self.directions.len();
        self.emitted(|e, out| {
            let v = e.vertex as usize;
            let all = self.directions.iter().zip(&arriving[v * count..]).filter(|(_, l)| **l != [0.0; 3]);
            let one = |(d, l): (&DVec3, &[f32; 3])| {
                (self.frames[v].to_local(*d), l.map(|x| self.weights[v] * f64::from(x)))
            };
            let from: Vec<(DVec3, [f64; 3])> = all.map(one).collect();
            self.leaving(e, &from, out);
        })
    }

    /// Σ f ⟨n·wi⟩ E against each direction above the emitter. Where the reflectance is Lambert's, one value
    /// serves all directions: radiosity.
    fn leaving(&self, e: Emitter, from: &[(DVec3, [f64; 3])], out: &mut [[f32; 3]]) {
        let (frame, brdf) = (&self.frames[e.vertex as usize], self.brdf(e));
        let matte = matches!(brdf.form(), Form::Lambert { .. });
        let mut alike = None;
        for (d, out) in self.directions.iter().zip(out) {
            let wo = frame.to_local(-*d);
            let sum = || {
                let mut sum = [0.0; 3];
                for (wi, light) in from {
                    let f = brdf.f_cos(*wi, wo);
                    (0..3).for_each(|c| sum[c] += f[c] * light[c]);
                }
                sum.map(finite)
            };
            if wo.z > 0.0 {
                *out = if matte { *alike.get_or_insert_with(sum) } else { sum() };
            }
        }
    }

    /// Radiance that arrives at the vertices along each direction, given that which leaves emitters.
    fn arriving(&self, leaving: &Light3) -> Light3 {
        let count = self.directions.len();
        let mut out = vec![[0.0f32; 3]; self.links.len()];
        let rows = out.par_chunks_mut(count.max(1)).zip(self.links.par_chunks(count.max(1)));
        rows.for_each(|(out, links)| {
            for (k, (to, l)) in
                out.iter_mut().zip(links).enumerate().filter(|(_, (_, l))| l.triangle != Link::NONE)
            {
                let [v, w] = l.weight;
                let [a, b, d] = self.corners[l.triangle as usize].map(|e| leaving[e as usize * count + k]);
                *to = std::array::from_fn(|c| (1.0 - v - w) * a[c] + v * b[c] + w * d[c]);
            }
        });
        out
    }
}

/// The reflectance itself.
#[inline(always)]
pub(super) fn f_cos(t: &Tables, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    let unit = |v: [f32; 3]| DVec3::from_array(v.map(f64::from)).normalize_or_zero();
    t.brdf.f_cos(unit(wi), unit(wo)).map(|x| x as f32)
}

/// Adds the radiance that points reflect of the lights and of the light that arrives at the vertices around
/// them.
pub(super) fn add(
    t: &Tables,
    rows: &Rows,
    lights: &[Light],
    shadows: Option<Shadows<'_>>,
    q: &Points<'_>,
    out: &mut Radiance<'_>,
) {
    let (positions, vertices) = (!q.p[0].is_empty(), rows.vertices());
    let sited =
        q.site.index.iter().all(|s| s.len() == q.len()) && q.site.weight.iter().all(|w| w.len() == q.len());
    if !sited || !q.is_consistent() || out.rgb.iter().any(|p| p.len() != q.len()) {
        return;
    }
    let directions: Vec<[f32; 3]> =
        rows.row(vertices)[..3 * rows.directions].chunks(3).map(|d| [d[0], d[1], d[2]]).collect();
    for i in 0..q.len() {
        let at = |v: &[&[f32]; 3]| v.map(|s| s[i]);
        let n = at(&q.n);
        let axes = Axes::new(n, if q.t[0].is_empty() { tangent(n) } else { at(&q.t) });
        let o = axes.local(at(&q.wo));
        let corners = q.site.index.map(|s| s[i] as usize);
        // False for NaN too.
        if !(o[2] > 0.0 && corners.iter().all(|v| *v < vertices)) {
            continue;
        }
        let corner = corners.map(|v| rows.row(v));
        let [v, w] = q.site.weight.map(|s| s[i]);
        let mix = |k: usize| dot([1.0 - v - w, v, w], corner.map(|row| row[k]));
        let p = positions.then(|| at(&q.p));
        let mut sum = [0.0f32; 3];
        for (k, light) in lights.iter().enumerate() {
            let Some((d, e, distance)) = light.at(p) else { continue };
            let f = f_cos(t, axes.local(d), o);
            let seen = match (shadows, p) {
                (Some(shadows), Some(p)) if f != [0.0; 3] => arriving(shadows, p, n, d, distance),
                _ => mix(3 * rows.directions + k),
            };
            (0..3).for_each(|c| sum[c] = (sum[c] + seen * f[c] * e[c]).clamp(-f32::MAX, f32::MAX));
        }
        let (mut cosines, mut more) = (0.0f32, [0.0f32; 3]);
        for (k, d) in directions.iter().enumerate() {
            let local = axes.local(*d);
            if local[2] > 0.0 {
                cosines += local[2];
                let l: [f32; 3] = std::array::from_fn(|c| mix(3 * k + c));
                if l != [0.0; 3] {
                    let f = f_cos(t, local, o);
                    (0..3).for_each(|c| more[c] = (more[c] + f[c] * l[c]).clamp(-f32::MAX, f32::MAX));
                }
            }
        }
        // All directions above a point have one weight, by which their cosines sum to π.
        let weight = if cosines > 0.0 { PI / cosines } else { 0.0 };
        (0..3).for_each(|c| out.rgb[c][i] += (sum[c] + weight * more[c]).clamp(-f32::MAX, f32::MAX));
    }
}

pub(super) fn lit(
    b: &LocalBaked<PrecomputedVisibility>,
    frame: &LocalFrame<'_>,
) -> Result<Box<dyn LocalShading>, BakeError> {
    if b.params.alone() {
        return Ok(Box::new(PerPoint::new(b, frame)));
    }
    let refused = |why: &str| BakeError::Geometry { slug: super::SLUG, why: why.into() };
    let seen = b.tables.seen.as_ref().ok_or_else(|| refused("was baked without a mesh"))?;
    if frame.mesh.is_none_or(|m| m.positions.len() != seen.origins.len()) {
        return Err(refused("was baked on another mesh"));
    }
    let lights = frame.lights.rows(frame.view);
    let rows = Rows::new(seen, &lights, &b.params);
    let (tables, certificate, shadowed) = (b.tables.clone(), b.certificate.clone(), frame.shadowed);
    Ok(Box::new(Scattered { tables, rows, lights, shadowed, certificate }))
}

/// Shading under the lights of a frame.
struct Scattered {
    tables: Arc<Tables>,
    rows: Rows,
    lights: Vec<Light>,
    /// Do shadows of the scene stand for the parts of the lights that vertices see?
    shadowed: bool,
    certificate: Certificate,
}

impl LocalShading for Scattered {
    fn add(&self, shadows: Option<Shadows<'_>>, q: &Points<'_>, out: &mut Radiance<'_>) {
        steradian_simd::dispatch(|| add(&self.tables, &self.rows, &self.lights, shadows, q, out));
    }

    fn gpu(&self) -> Option<GpuTechnique> {
        let mut text = LocalText::of_model(&*self.tables.brdf)?;
        let shadowed = f32::from(u8::from(self.shadowed));
        let sizes = [self.rows.directions as f32, self.rows.vertices() as f32, shadowed, 0.0];
        text.uniforms.push(Uniform { name: "local_scatter", value: Value::Vec4(sizes) });
        text.buffers.push(Buffer::new("local_rows", self.rows.stride, self.rows.data.clone()));
        let mut technique =
            local::run_by(super::SLUG, text, &self.lights, (include_str!("shade.wgsl"), true));
        technique.modules.push(shadow::OPEN.into());
        Some(technique)
    }

    fn certificate(&self) -> &Certificate {
        &self.certificate
    }
}
