//! Where radiance comes from.

use glam::DVec3;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use steradian_base::{Cancelled, Task};
use steradian_brdf::model::dielectric::Dielectric;
use steradian_brdf::model::ggx::Ggx;
use steradian_brdf::{Brdf, Form, Scaled, SharedBrdf};
use steradian_reference::path::PathScene;
use steradian_reference::{Estimate, Reference, ReferencePoint};
use steradian_scene::shadow::Blocker;
use steradian_sphere::Frame;
use steradian_technique::direct::{Direct, Shadows};
use steradian_technique::local::LocalShading;
use steradian_technique::{AnyBake, PointLobe, Points, Radiance, TexelReflectance, Varies};

/// Outgoing radiance of batches of surface points.
pub trait Shader: Send + Sync {
    /// Writes the radiance of every point of `q`.
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, task: &Task) -> Result<(), Cancelled>;

    /// Does it read data per texel?
    fn is_textured(&self) -> bool {
        false
    }

    /// Two shaders whose product this is, where each can be interpolated better than the product.
    fn factors(&self) -> Option<[&dyn Shader; 2]> {
        None
    }

    /// This shader without shadows of the lights that are shaded one by one; `None` where there are none.
    fn unshadowed(&self) -> Option<Arc<dyn Shader>> {
        None
    }

    /// The largest difference that interpolation of radiance ignores, relative to the largest channel, and
    /// the least value that it is relative to. Half a step of an 8-bit display at mid-grey, which exceeds the
    /// differences between neighbours by the reference's own error.
    fn difference(&self) -> [f32; 2] {
        [4e-3, 0.0]
    }

    /// Visibility of small lights at each point, a bit each: a shadow's edge lies between points that differ.
    /// Empty where there are no such shadows.
    fn lights_seen(&self, _: &Points<'_>) -> Vec<u64> {
        Vec::new()
    }
}

/// [`Shader::lights_seen`] of lights that are shaded one by one.
pub(super) fn lights_seen(direct: &Direct, by: &dyn Blocker, q: &Points<'_>) -> Vec<u64> {
    if direct.is_empty() || q.p[0].len() != q.len() {
        return Vec::new();
    }
    let at = |v: &[&[f32]; 3], i: usize| DVec3::from_array(v.map(|c| f64::from(c[i])));
    let shadows = Shadows { by, offset: PathScene::OFFSET, reference: false };
    (0..q.len()).map(|i| direct.seen_from(shadows, at(&q.p, i), at(&q.n, i).normalize_or_zero())).collect()
}

/// A technique's bake.
pub struct BakeShader(pub Box<dyn AnyBake>);

impl Shader for BakeShader {
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, task: &Task) -> Result<(), Cancelled> {
        task.check()?;
        self.0.shade(q, out);
        Ok(())
    }

    fn is_textured(&self) -> bool {
        self.0.is_textured()
    }
}

/// A technique's bake, plus lights that are shaded with the exact reflectance, plus lights that a separate
/// technique shades.
pub struct DirectShader {
    /// The bake.
    pub bake: Arc<BakeShader>,
    /// The lights.
    pub direct: Direct,
    /// The reflectance.
    pub brdf: SharedBrdf,
    /// Shading of directional and point lights that are neither in the bake nor in `direct`.
    pub local: Option<Arc<dyn LocalShading>>,
    /// Occluders of these lights; `None` leaves them unshadowed.
    pub shadows: Option<Arc<dyn Blocker>>,
}

impl Shader for DirectShader {
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, task: &Task) -> Result<(), Cancelled> {
        self.bake.shade(q, out, task)?;
        let shadows =
            self.shadows.as_deref().map(|by| Shadows { by, offset: PathScene::OFFSET, reference: false });
        self.direct.add_behind(shadows, &*self.brdf, q, out);
        if let Some(local) = &self.local {
            local.add(shadows, q, out);
        }
        Ok(())
    }

    fn is_textured(&self) -> bool {
        self.bake.is_textured() || self.local.as_ref().is_some_and(|l| l.is_textured())
    }

    fn unshadowed(&self) -> Option<Arc<dyn Shader>> {
        self.shadows.as_ref()?;
        let (bake, direct) = (self.bake.clone(), self.direct.clone());
        let (brdf, local) = (self.brdf.clone(), self.local.clone());
        Some(Arc::new(Self { bake, direct, brdf, local, shadows: None }))
    }

    fn lights_seen(&self, q: &Points<'_>) -> Vec<u64> {
        self.shadows.as_deref().map(|by| lights_seen(&self.direct, by, q)).unwrap_or_default()
    }
}

/// The reference: the integral itself, unshadowed, to a tolerance.
pub struct ReferenceShader {
    /// The reference of the lights.
    pub reference: Arc<Reference>,
    /// The reflectance.
    pub brdf: SharedBrdf,
    /// The reflectance of each point in its place, where it differs from texel to texel.
    texels: Option<TexelReflectance>,
    /// Target relative error at each point.
    pub tolerance: f64,
    /// Bits of the largest error so far; those of non-negative doubles grow with them.
    worst: AtomicU64,
}

impl ReferenceShader {
    /// The reference's radiance of `brdf` to a relative error of `tolerance` at each point.
    pub fn new(reference: Arc<Reference>, brdf: SharedBrdf, tolerance: f64) -> Self {
        Self { reference, brdf, texels: None, tolerance, worst: AtomicU64::new(0) }
    }

    /// This shader with a reflectance that differs from texel to texel.
    #[must_use]
    pub fn varied(self, texels: Option<TexelReflectance>) -> Self {
        Self { texels, ..self }
    }

    /// Properties that may differ from point to point: width and colours of models that have them, but no
    /// spread of normals.
    pub fn varies(&self) -> Varies {
        let varied = Varied::of(&*self.brdf).is_some();
        Varies { alpha: varied, normals: false, colours: varied }
    }

    /// The largest relative error that a point has been left with.
    pub fn worst(&self) -> f64 {
        f64::from_bits(self.worst.load(Ordering::Relaxed))
    }
}

/// A reflectance whose width and colours may differ from point to point.
#[derive(Debug, Clone, Copy)]
struct Varied {
    alpha: f64,
    f0: [f64; 3],
    albedo: [f64; 3],
    scale: [f64; 3],
}

impl Varied {
    /// The parameters of a model that has them; of another one width and colours stay the material's.
    fn of(brdf: &dyn Brdf) -> Option<Self> {
        match brdf.form() {
            Form::Ggx { alpha: [alpha, ay], f0, scale } if alpha == ay => {
                Some(Self { alpha, f0, albedo: [0.0; 3], scale })
            }
            Form::Dielectric { alpha, f0, albedo, scale } => Some(Self { alpha, f0, albedo, scale }),
            _ => None,
        }
    }

    /// The reflectance of a point.
    fn at(&self, lobe: PointLobe) -> SharedBrdf {
        let alpha = if lobe.alpha < 0.0 { self.alpha } else { f64::from(lobe.alpha) };
        let colour = |own: [f32; 3], material: [f64; 3]| {
            if own[0] < 0.0 { material } else { own.map(|x| f64::from(x).min(1.0)) }
        };
        let (f0, albedo) = (colour(lobe.f0, self.f0), colour(lobe.albedo, self.albedo));
        let brdf: SharedBrdf = match albedo {
            [0.0, 0.0, 0.0] => Arc::new(Ggx { ax: alpha.max(1e-4), ay: alpha.max(1e-4), f0 }),
            _ => Arc::new(Dielectric::new(alpha.clamp(1e-4, 1.0), f0, albedo)),
        };
        if self.scale == [1.0; 3] { brdf } else { Arc::new(Scaled { brdf, scale: self.scale }) }
    }
}

impl Shader for ReferenceShader {
    fn is_textured(&self) -> bool {
        self.texels.is_some()
    }

    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, task: &Task) -> Result<(), Cancelled> {
        let at = |v: &[&[f32]; 3], i: usize| DVec3::from_array(v.map(|c| f64::from(c[i])));
        let varied = Varied::of(&*self.brdf);
        let points: Vec<ReferencePoint> = (0..q.len())
            .map(|i| ReferencePoint {
                frame: Frame::from_normal_tangent(at(&q.n, i).normalize(), at(&q.t, i)),
                wo: at(&q.wo, i).normalize(),
                position: (!q.p[0].is_empty()).then(|| at(&q.p, i)),
            })
            .collect();
        let mut write = |i: usize, e: &Estimate| {
            (0..3).for_each(|c| out.rgb[c][i] = e.rgb[c] as f32);
            self.worst.fetch_max(e.error.abs().to_bits(), Ordering::Relaxed);
        };
        let own = |i: usize| match (&self.texels, varied.filter(|_| q.has_lobes())) {
            (Some(texels), _) => Some(texels.at(q.uv.map(|v| v.get(i).copied().unwrap_or(0.0)))),
            (None, Some(varied)) => Some(varied.at(PointLobe::from_array(q.lobe.map(|s| s[i])))),
            (None, None) => None,
        };
        match points.first().and_then(|_| own(0)) {
            Some(_) => {
                for (i, p) in points.iter().enumerate() {
                    let Some(brdf) = own(i) else { continue };
                    let e = self.reference.radiance_batch(
                        &*brdf,
                        std::slice::from_ref(p),
                        self.tolerance,
                        task,
                    )?;
                    e.iter().for_each(|e| write(i, e));
                }
            }
            None => {
                let estimates = self.reference.radiance_batch(&*self.brdf, &points, self.tolerance, task)?;
                estimates.iter().enumerate().for_each(|(i, e)| write(i, e));
            }
        }
        Ok(())
    }
}
