//! Preparation of a material for shading: the bake, lights in addition to it, and their shadows.

#[cfg(feature = "gpu")]
use super::Changed;
use super::{Material, OtherCertificates, PICTURE_TOLERANCE, Prepared, picture_reference};
use crate::saved::check_mesh;
use crate::scene::Sited;
use crate::{Error, Local, Method, Notice, Session, Shadows};
use glam::Vec3;
use std::cell::LazyCell;
use std::sync::Arc;
use std::time::Instant;
use steradian_base::{Cancelled, Task};
use steradian_brdf::Form;
use steradian_light::Lights;
use steradian_reference::{Lookup, Reference};
use steradian_render::{
    BakeShader, DirectShader, LobeShadow, LobeShadowShader, ReferenceShader, Shader, Surface,
};
use steradian_scene::shadow::Blocker;
use steradian_scene::{Bvh, Camera};
use steradian_techniques::direct::{Direct, Suns, split};
use steradian_techniques::local::{self, LocalBake, LocalFrame, LocalLights, LocalShading};
use steradian_techniques::{AnyBake, AnyTechnique, BakeError, Geometry, Points, Radiance, View};

/// The light and the view of a picture, and its tolerance.
#[derive(Clone, Copy)]
pub(crate) struct Under<'a> {
    pub lights: &'a Lights,
    pub camera: &'a Camera,
    pub tolerance: Option<f64>,
    /// Scene whose mesh techniques with sites bake on.
    pub scene: &'a crate::Scene,
    /// Selection of vertices that are sites.
    pub sites: &'a Sited,
}

impl Under<'_> {
    /// The mesh with the materials of its slots, where a technique `bakes_on` it; the mean of a base colour
    /// multiplies the albedo of a reflecting surface.
    fn geometry(&self, bakes_on: bool) -> Option<Geometry> {
        let slot = |m: &Material| {
            let plain = steradian_techniques::Material::new(m.brdf.clone());
            let (Form::Lambert { albedo: a }, Some(t)) = (m.brdf.form(), &m.base_colour) else {
                return plain;
            };
            let [r, g, b] = t.mean().map(|x| f64::from(x).clamp(0.0, 1.0));
            let spec = format!("lambert:albedo={}/{}/{}", a[0] * r, a[1] * g, a[2] * b);
            steradian_brdf::parse(&spec).map_or(plain, steradian_techniques::Material::new)
        };
        bakes_on.then(|| Geometry {
            materials: self.scene.materials.iter().map(slot).collect(),
            transfer: self.scene.transfer.clone(),
            ..Geometry::new(Arc::new(self.scene.mesh.clone()), self.sites.sites())
        })
    }
}

impl Session {
    /// Bakes a material by `method`, opens its bake, or makes the reference its shader.
    pub(crate) fn prepare(
        &self,
        material: &Material,
        method: &Method,
        under: Under<'_>,
        task: &Task,
    ) -> Result<Prepared, Error> {
        let mut prepared = self.draft(material, method, under, task)?;
        prepared.certify(under, task)?;
        Ok(prepared)
    }

    /// [`Session::prepare`] without the measurement of a technique's error, which [`Prepared::certify`] makes
    /// good.
    pub(crate) fn draft(
        &self,
        material: &Material,
        method: &Method,
        under: Under<'_>,
        task: &Task,
    ) -> Result<Prepared, Error> {
        let start = Instant::now();
        let lobe = self.shadows == Shadows::Lobe;
        if let Method::Technique(t) = method
            && lobe
            && t.self_shadowing(&material.params)
        {
            let why = "knows shadows itself; leave `shadows` out, or give ray";
            return Err(Error::usage(format!("`shadows` lobe: {} {why}", method.label())));
        }
        let bvh = LazyCell::new(|| match &self.common_shadows {
            Some(common) => common.bvh(&under.scene.mesh),
            None => Arc::new(Bvh::build(&under.scene.mesh)),
        });
        let mut view = view(under.camera);
        let baked = self.bake_local(material, method, under, task)?;
        let bumps = baked.as_ref().and_then(|b| b.normals()).filter(|_| material.maps.normal.is_none());
        let asked = material;
        let mut bumpy = material.clone();
        bumpy.maps.normal = bumpy.maps.normal.or_else(|| bumps.clone());
        let material = &bumpy;
        let (bake, direct, lights) = match method {
            Method::Reference if lobe => {
                let mut exact = reference(material, under, task)?;
                self.shadow(&mut exact, under.lights, &bvh);
                return Ok(exact);
            }
            Method::Reference => return reference(material, under, task),
            Method::Path => return Err(Error::usage("path shades all materials of a scene, or none")),
            Method::Technique(t) => link(*t, material, self.suns, under, task)?,
            Method::File(file) => {
                view.light_rotation = file.turn;
                let bake = file.open()?;
                check_mesh(file, &*bake, &under.scene.mesh)?;
                (bake, Direct::default(), LocalLights::default())
            }
        };
        let shadows = match method {
            Method::Technique(_) if lobe && !lights.is_empty() => {
                return Err(Error::usage("`shadows` lobe: not beside `local`; give `shadows` ray"));
            }
            Method::Technique(t)
                if self.shadows.under(*t, &material.params)
                    && (lobe || !(direct.is_empty() && lights.is_empty())) =>
            {
                Some(match lobe {
                    true => bvh.clone(),
                    false => self.shadows.blocker(&under.scene.mesh, &direct, &lights, task.max_memory())?,
                })
            }
            _ => None,
        };
        let share = || self.share(material, under.lights, bvh.clone(), false);
        let lobe = shadows.as_ref().filter(|_| lobe).map(|_| share());
        let local = match baked.filter(|_| !lights.is_empty()) {
            Some(bake) => {
                let view = View { eye: eye(under.camera), ..view };
                let mesh = Some(&under.scene.mesh);
                let frame = LocalFrame { lights: &lights, view: &view, mesh, shadowed: shadows.is_some() };
                let shading: Arc<dyn LocalShading> = bake.lit(&frame)?.into();
                Some((bake, shading))
            }
            None => None,
        };
        let prepared = framed(material, method, bake, OtherLights { direct, local, shadows, lobe }, &view);
        let seconds = start.elapsed().as_secs_f64();
        Ok(Prepared { seconds, material: asked.clone(), bumps, ..prepared })
    }

    /// The tables of a material's technique for directional and point lights, where there are such lights.
    fn bake_local(
        &self,
        material: &Material,
        method: &Method,
        under: Under<'_>,
        task: &Task,
    ) -> Result<Option<Arc<dyn LocalBake>>, Error> {
        let Some(local) = material.local.as_ref().filter(|_| matches!(method, Method::Technique(_))) else {
            return Ok(None);
        };
        // Its bumps apply to all light.
        let unlit = under.lights.directionals.is_empty() && under.lights.points.is_empty();
        if unlit && !local.has_bumps() {
            return Ok(None);
        }
        local.check_mesh(&under.scene.mesh, material.maps.normal.is_some(), "the mesh")?;
        local.check_tangents(&*material.brdf, &under.scene.mesh)?;
        let task = task.clone().with_tolerance(under.tolerance);
        let geometry = under.geometry(local.technique.needs_sites(&local.params));
        local.bake(&material.brdf, material.maps.normal.as_deref(), geometry, &task).map(Some)
    }

    /// `before` with its changed light or reflectance: only the factors that depend on these are baked again.
    /// The error of a preview is not measured.
    #[cfg(feature = "gpu")]
    pub(crate) fn rebaked(
        &self,
        before: &Prepared,
        material: &Material,
        changed: Changed,
        under: Under<'_>,
        preview: bool,
    ) -> Result<Prepared, Error> {
        let Some(old) = &before.bake else {
            return Err(Error::failed("a material without a bake"));
        };
        let start = Instant::now();
        let task = self.task.clone().with_tolerance(under.tolerance);
        let suns = suns(material, self.suns);
        let (bake, direct) = match changed {
            Changed::Light => {
                let (baked, direct) = split(under.lights, suns);
                let bake = match preview {
                    true => old.0.preview(Some(&baked), None, &task)?,
                    false => old.0.with_light(&baked, &task)?,
                };
                (bake, direct)
            }
            Changed::Reflectance => {
                let of = material.baked();
                let bake = match preview {
                    true => old.0.preview(None, Some(&of), &task)?,
                    false => old.0.with_material(&of, &task)?,
                };
                (bake, before.direct.1.clone())
            }
            Changed::Nothing => (old.0.with_view(&view(under.camera)), before.direct.1.clone()),
        };
        let beside = OtherLights { direct, local: None, shadows: None, lobe: None };
        let prepared = framed(material, &before.method, bake, beside, &view(under.camera));
        Ok(Prepared { seconds: start.elapsed().as_secs_f64(), ..prepared })
    }

    /// Materials as another camera sees them: those whose techniques prepare a view are prepared anew.
    pub(crate) fn seen_by(
        &self,
        scene: &crate::Scene,
        materials: Vec<Prepared>,
        camera: Camera,
    ) -> Result<Vec<Prepared>, Error> {
        let sites = &scene.sited();
        let under =
            Under { lights: &scene.lights, camera: &camera, tolerance: scene.tolerance, scene, sites };
        let again = |p: Prepared| match &p.method {
            Method::Technique(t)
                if t.needs_view(&p.material.params)
                    || p.material.local.as_ref().is_some_and(Local::sees_view) =>
            {
                self.prepare(&p.material, &p.method, under, &self.task)
            }
            Method::File(f) if f.needs_view() => self.prepare(&p.material, &p.method, under, &self.task),
            _ => Ok(p),
        };
        materials.into_iter().map(again).collect()
    }

    /// Shadows all of `lights` on a prepared material as [`Shadows::Lobe`] does, where its technique knows no
    /// shadows itself and nothing else gives it lights of its own.
    pub(crate) fn shadow(&self, p: &mut Prepared, lights: &Lights, bvh: &Arc<Bvh>) {
        let without = match &p.method {
            Method::Technique(t) => !t.self_shadowing(&p.material.params) && p.material.local.is_none(),
            Method::Reference => true,
            _ => false,
        };
        if without && !p.lobe {
            let exact = matches!(p.method, Method::Reference);
            let share = self.share(&p.material, lights, bvh.clone(), exact);
            p.surface.shader = Arc::new(LobeShadowShader::new(p.surface.shader.clone(), share));
            (p.shadowed, p.lobe) = (true, true);
        }
    }

    /// The share of all of `lights` that arrives where `bvh` blocks it.
    fn share(&self, material: &Material, lights: &Lights, bvh: Arc<Bvh>, reference: bool) -> Arc<LobeShadow> {
        let (sky, direct) = split(lights, Suns::Exact);
        let make =
            |reference: bool| LobeShadow::new(sky.environment, direct, material.brdf.clone(), bvh, reference);
        match &self.common_shadows {
            Some(common) => common.of(material.brdf.spec(), || make(true).remembering()),
            None => Arc::new(make(reference)),
        }
    }

    /// Reports the maps of a material that its technique ignores.
    pub(crate) fn tell_left_out(&self, p: &Prepared) {
        let what = p.left_out();
        if !what.is_empty() {
            self.tell(Notice::LeftOut { technique: p.method.slug(), what });
        }
    }
}

/// The reference, which needs no bake but hierarchies of the lights.
fn reference(material: &Material, under: Under<'_>, task: &Task) -> Result<Prepared, Error> {
    let start = Instant::now();
    let (reference, tolerance) = match under.tolerance {
        Some(tolerance) => (Reference::new(under.lights, Lookup::Bilinear, task)?, tolerance),
        None => (picture_reference(under.lights, &*material.brdf, task)?, PICTURE_TOLERANCE),
    };
    let shader = ReferenceShader::new(Arc::new(reference), material.brdf.clone(), tolerance);
    let shader = Arc::new(shader.varied(material.texel_reflectance()));
    Ok(Prepared {
        material: material.clone(),
        method: Method::Reference,
        surface: surface(material, shader.clone()),
        certificate: None,
        reference: Some(shader.clone()),
        varies: shader.varies(),
        lit: false,
        picture_error: None,
        picture_unmeasured: None,
        sample_seconds: 0.0,
        choice: None,
        bumps: None,
        bake: None,
        #[cfg(any(feature = "gpu", feature = "web"))]
        direct: (material.brdf.clone(), Direct::default()),
        #[cfg(any(feature = "gpu", feature = "web"))]
        local: None,
        #[cfg(any(feature = "gpu", feature = "web"))]
        blocker: None,
        shadowed: false,
        lobe: false,
        bytes: 0,
        seconds: start.elapsed().as_secs_f64(),
        others: OtherCertificates::default(),
    })
}

/// Message that refuses point lights for a technique with data per texel.
pub(crate) const ONE_REFLECTANCE: &str = "point lights beside it have one reflectance everywhere: give a `local` technique with data per texel, or leave them out";

/// No radiance.
pub(super) struct Black;

impl Shader for Black {
    fn shade(&self, _: &Points<'_>, out: &mut Radiance<'_>, _: &Task) -> Result<(), Cancelled> {
        out.rgb.iter_mut().for_each(|plane| plane.fill(0.0));
        Ok(())
    }
}

/// Maps and planes apply only to light in a technique's data, so with these suns are folded into it.
fn suns(material: &Material, usual: Suns) -> Suns {
    if material.maps.is_empty() && material.planes.is_empty() { usual } else { Suns::Fold }
}

/// A draft of a technique's bake, and the lights that are no part of it.
fn link(
    technique: &'static dyn AnyTechnique,
    material: &Material,
    usual: Suns,
    under: Under<'_>,
    task: &Task,
) -> Result<(Box<dyn AnyBake>, Direct, LocalLights), Error> {
    let task = task.clone().with_tolerance(under.tolerance);
    let suns = suns(material, usual);
    let of = material.baked();
    let geometry = under.geometry(technique.needs_sites(&material.params));
    let with = |suns: Suns| {
        let (baked, direct, local) = match &material.local {
            Some(_) => local::split(under.lights, suns),
            None => {
                let (baked, direct) = split(under.lights, suns);
                (baked, direct, LocalLights::default())
            }
        };
        if !direct.is_empty() && !material.planes.is_empty() {
            return Err(BakeError::Light { slug: technique.card().slug, why: ONE_REFLECTANCE.into() });
        }
        let bake = technique.draft(&baked, &of, geometry.as_ref(), &material.params, &task);
        bake.map(|b| (b, direct, local))
    };
    match with(suns) {
        Err(BakeError::Light { .. }) if suns != usual && material.planes.is_empty() => Ok(with(usual)?),
        other => Ok(other?),
    }
}

/// Lights in addition to a bake, and their shadows.
struct OtherLights {
    direct: Direct,
    /// The part of these lights that a separate technique shades.
    local: Option<(Arc<dyn LocalBake>, Arc<dyn LocalShading>)>,
    shadows: Option<Arc<dyn Blocker>>,
    /// Share of the bake's light that arrives, where rays over the lobe shadow it.
    lobe: Option<Arc<LobeShadow>>,
}

/// A bake in the view of a camera.
fn framed(
    material: &Material,
    method: &Method,
    mut bake: Box<dyn AnyBake>,
    beside: OtherLights,
    view: &View,
) -> Prepared {
    bake.frame(view);
    let OtherLights { direct, local, shadows, lobe } = beside;
    let others = OtherCertificates {
        exact: !direct.is_empty(),
        local: local.as_ref().map(|l| l.1.certificate().clone()),
    };
    let (certificate, varies) = (others.join(bake.certificate().clone()), bake.varies());
    let bytes = bake.bytes() + local.as_ref().map_or(0, |l| l.0.bytes());
    let local = local.map(|l| l.1);
    let bake = Arc::new(BakeShader(bake));
    let (shadowed, by_lobe) = (shadows.is_some(), lobe.is_some());
    #[cfg(any(feature = "gpu", feature = "web"))]
    let blocker = shadows.clone();
    let lit = !direct.is_empty() || local.is_some();
    let mut shader: Arc<dyn Shader> = bake.clone();
    if lit {
        let (bake, direct, brdf) = (bake.clone(), direct.clone(), material.brdf.clone());
        let shadows = shadows.filter(|_| lobe.is_none());
        shader = Arc::new(DirectShader { bake, direct, brdf, local: local.clone(), shadows });
    }
    if let Some(share) = lobe {
        shader = Arc::new(LobeShadowShader::new(shader, share));
    }
    Prepared {
        material: material.clone(),
        method: method.clone(),
        surface: surface(material, shader),
        certificate: Some(certificate),
        reference: None,
        varies,
        lit,
        picture_error: None,
        picture_unmeasured: None,
        sample_seconds: 0.0,
        choice: None,
        bumps: None,
        bake: Some(bake),
        #[cfg(any(feature = "gpu", feature = "web"))]
        direct: (material.brdf.clone(), direct),
        #[cfg(any(feature = "gpu", feature = "web"))]
        local,
        #[cfg(any(feature = "gpu", feature = "web"))]
        blocker,
        shadowed,
        lobe: by_lobe,
        bytes,
        seconds: 0.0,
        others,
    }
}

pub(super) fn surface(material: &Material, shader: Arc<dyn Shader>) -> Surface {
    Surface { shader, base_colour: material.base_colour.clone(), maps: material.maps.clone() }
}

/// Position of the viewer; far away where all rays are parallel.
fn eye(camera: &Camera) -> Vec3 {
    /// Metres: the directions to the viewer from points a metre apart differ by 1e-6 radians.
    const FAR_METRES: f32 = 1e6;
    match *camera {
        Camera::Pinhole { from, .. } => from,
        Camera::Orthographic { from, .. } => from - FAR_METRES * camera.axes()[2],
    }
}

pub(crate) fn view(camera: &Camera) -> View {
    let (Camera::Pinhole { from, .. } | Camera::Orthographic { from, .. }) = *camera;
    View { eye: from, forward: camera.axes()[2], ..View::default() }
}
