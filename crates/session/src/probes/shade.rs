//! Shading under a light field: radiance is linear in the light, so that the radiance of a point is the mean
//! of its radiance under the light of each probe around it, with the probes' weights.

use crate::eval::{Answers, Points as At, Request};
use crate::material::{PICTURE_TOLERANCE, Under};
use crate::scene::Sited;
use crate::{Backend, Error, Method, Prepared, Scene, Session};
use glam::DVec3;
use std::borrow::Cow;
use std::sync::Arc;
use std::time::Instant;
use steradian_base::{Cancelled, Certificate, Evidence, Task};
use steradian_light::{Lights, Probe, Probes};
use steradian_render::{BakeShader, Shader, Surface};
use steradian_techniques::{Points, PointsBuf, Radiance};

/// Shading by a light field.
struct FieldShader {
    field: Arc<Probes>,
    /// A shader for each probe that is needed.
    shaders: Vec<Option<Arc<dyn Shader>>>,
}

impl Shader for FieldShader {
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, task: &Task) -> Result<(), Cancelled> {
        out.rgb.iter_mut().for_each(|plane| plane.fill(0.0));
        let at = |i: usize| DVec3::from_array(q.p.map(|c| f64::from(c[i])));
        let weights =
            (0..q.len()).flat_map(|i| self.field.weights(at(i)).into_iter().map(move |(k, w)| (k, i, w)));
        let mut weights: Vec<(usize, usize, f64)> = weights.collect();
        weights.sort_by_key(|w| (w.0, w.1));
        for of_one in weights.chunk_by(|a, b| a.0 == b.0) {
            let Some(shader) = self.shaders.get(of_one[0].0).and_then(Option::as_ref) else { continue };
            let part = gathered(q, of_one.iter().map(|w| w.1));
            let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; of_one.len()]);
            shader.shade(&part.as_points(), &mut Radiance::of(&mut rgb), task)?;
            for (to, from) in out.rgb.iter_mut().zip(&rgb) {
                of_one.iter().zip(from).for_each(|((_, i, w), x)| to[*i] += *w as f32 * x);
            }
        }
        Ok(())
    }
}

/// Some points of a batch.
fn gathered(q: &Points<'_>, some: impl Iterator<Item = usize> + Clone) -> PointsBuf {
    fn of<T: Copy, const N: usize>(v: [&[T]; N], some: impl Iterator<Item = usize> + Clone) -> [Vec<T>; N] {
        v.map(|v| if v.is_empty() { Vec::new() } else { some.clone().map(|i| v[i]).collect() })
    }
    PointsBuf {
        n: of(q.n, some.clone()),
        t: of(q.t, some.clone()),
        wo: of(q.wo, some.clone()),
        p: of(q.p, some.clone()),
        lobe: of(q.lobe, some.clone()),
        uv: of(q.uv, some.clone()),
        chart: of(q.chart, some.clone()),
        corners: of(q.site.index, some.clone()),
        weights: of(q.site.weight, some),
    }
}

/// The light of a probe.
fn lights(probe: &Probe) -> Lights {
    Lights::from(probe.environment())
}

/// Refuses methods that have a light of their own.
pub(crate) fn has_no_light(method: &Method) -> Result<(), Error> {
    if matches!(method, Method::Path | Method::File(_)) {
        let why = "has its own light: leave probes out, or name a technique";
        return Err(Error::usage(format!("{} {why}", method.slug())));
    }
    Ok(())
}

/// Refuses a light field where a single light is needed.
pub(crate) fn refuse(scene: &Scene) -> Result<(), Error> {
    let why = "light fields are shaded by render, eval and compare alone: leave probes out, or choose another light";
    if scene.probes.is_some() { Err(Error::usage(why)) } else { Ok(()) }
}

impl Session {
    /// The scene under the mean of its light field around its surfaces, by which techniques are chosen and
    /// accept or refuse it; the scene itself where it has no light field.
    pub(crate) fn in_mean_light<'a>(&self, scene: &'a Scene) -> Result<Cow<'a, Scene>, Error> {
        let Some(field) = &scene.probes else { return Ok(Cow::Borrowed(scene)) };
        if self.backend == Backend::Gpu {
            return Err(Error::usage("light fields are shaded on the CPU: use `backend` cpu or auto"));
        }
        scene.methods().try_for_each(has_no_light)?;
        let needed = needed(field, scene)?;
        let w = 1.0 / needed.len() as f64;
        let all = needed.iter().filter_map(|k| field.light[*k].as_ref()).map(|p| (p, w));
        let mean = Probe::sum(all).ok_or_else(|| Error::input(NONE))?;
        Ok(Cow::Owned(Scene { lights: lights(&mean), ..scene.clone() }))
    }

    /// Materials that were prepared under the mean light, under the scene's light field: each bake gets the
    /// light of each probe that the surfaces need, and shares everything else.
    pub(crate) fn in_field(&self, scene: &Scene, materials: Vec<Prepared>) -> Result<Vec<Prepared>, Error> {
        let Some(field) = &scene.probes else { return Ok(materials) };
        let needed = needed(field, scene)?;
        let mut out: Vec<Prepared> = Vec::new();
        let mut plain: Vec<Arc<dyn Shader>> = Vec::new();
        self.task.begin("light of probes", (needed.len() * materials.len()) as u64);
        for p in materials {
            // Materials that differ in their textures only share a shader.
            let shader = p.surface.shader.clone();
            let lit = match plain.iter().position(|s| Arc::ptr_eq(s, &shader)) {
                Some(k) => out[k].shared(&p.material),
                None => self.of_probes(scene, field, &needed, p)?,
            };
            plain.push(shader);
            out.push(lit);
        }
        self.task.end();
        Ok(out)
    }

    fn of_probes(
        &self,
        scene: &Scene,
        field: &Arc<Probes>,
        needed: &[usize],
        prepared: Prepared,
    ) -> Result<Prepared, Error> {
        let start = Instant::now();
        let task = self.task.clone().without_progress().with_tolerance(scene.tolerance);
        let mut shaders: Vec<Option<Arc<dyn Shader>>> = vec![None; field.light.len()];
        let (mut bytes, mut certificate) = (0, prepared.certificate.clone());
        for k in needed {
            self.task.check()?;
            let Some(probe) = &field.light[*k] else { continue };
            let lights = lights(probe);
            shaders[*k] = Some(match &prepared.bake {
                Some(bake) => {
                    let lit = bake.0.with_light(&lights, &task)?;
                    bytes += lit.bytes();
                    worse(&mut certificate, lit.certificate());
                    Arc::new(BakeShader(lit)) as Arc<dyn Shader>
                }
                None => {
                    let camera = scene.camera_or_framed()?;
                    let under = Under {
                        lights: &lights,
                        camera: &camera,
                        tolerance: scene.tolerance,
                        scene,
                        sites: &Sited::ALL,
                    };
                    self.prepare(&prepared.material, &prepared.method, under, &task)?.surface.shader
                }
            });
            if bytes as u64 > self.task.max_memory() {
                return Err(Error::failed(format!(
                    "{} probes take more than {} MiB of data: fewer of them, or a larger `max-memory`",
                    needed.len(),
                    self.task.max_memory() >> 20
                )));
            }
            self.task.advance(1);
        }
        let shader = Arc::new(FieldShader { field: field.clone(), shaders });
        // The reference's tolerance applies to each point.
        let asked = scene.tolerance.unwrap_or(PICTURE_TOLERANCE);
        let certificate = certificate.unwrap_or_else(|| Certificate::new(asked, Evidence::Estimated));
        let certificate = Some(certificate).map(|c| c.detail("probes", needed.len() as f64));
        let seconds = prepared.seconds + start.elapsed().as_secs_f64();
        let surface = Surface { shader, ..prepared.surface.clone() };
        Ok(Prepared { surface, certificate, bytes, seconds, picture_error: None, ..prepared })
    }

    /// Radiance at points under a light field: that of each probe, weighted.
    pub(crate) fn eval_in_field(&self, field: &Probes, r: &Request, q: &At) -> Result<Answers, Error> {
        let Some(places) = &q.p else {
            return Err(Error::input("the points need positions (columns px,py,pz) with `probes`"));
        };
        let weights = |i: usize| field.weights(places[i]).into_iter().map(move |(k, w)| (k, i, w));
        let mut weights: Vec<(usize, usize, f64)> = (0..places.len()).flat_map(weights).collect();
        weights.sort_by_key(|w| (w.0, w.1));
        let mut sum = Answers { rows: vec![([0.0; 3], 0.0); places.len()], error: 0.0, certificate: None };
        for of_one in weights.chunk_by(|a, b| a.0 == b.0) {
            let Some(probe) = &field.light[of_one[0].0] else { continue };
            let lit = Request { lights: lights(probe), ..r.clone() };
            let part = self.radiance_at(&lit, &q.some(of_one.iter().map(|w| w.1)))?;
            for ((_, i, w), row) in of_one.iter().zip(&part.rows) {
                (0..3).for_each(|c| sum.rows[*i].0[c] += w * row.0[c]);
                sum.rows[*i].1 = sum.rows[*i].1.max(row.1);
            }
            sum.error = sum.error.max(part.error);
            if let Some(c) = &part.certificate {
                worse(&mut sum.certificate, c);
            }
        }
        Ok(sum)
    }
}

const NONE: &str = "the light field has no probe outside solids";

/// The probes that the scene's surfaces need.
fn needed(field: &Probes, scene: &Scene) -> Result<Vec<usize>, Error> {
    let corners: Vec<[glam::Vec3; 3]> =
        scene.mesh.triangles.iter().map(|t| t.map(|i| scene.mesh.positions[i as usize])).collect();
    let needed = field.around(&corners);
    if needed.is_empty() { Err(Error::input(NONE)) } else { Ok(needed) }
}

/// Keeps the certificate of the larger error: the error of a mean is at most that of its parts.
fn worse(kept: &mut Option<Certificate>, other: &Certificate) {
    if kept.as_ref().is_none_or(|k| k.error < other.error) {
        *kept = Some(other.clone());
    }
}
