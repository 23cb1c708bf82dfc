//! Everything that a picture is made of.

mod file;
mod ground;
mod model;
mod request;

use crate::inputs::DEFAULT_SKY;
use crate::{Adjust, Error, Material, Method, Session};
pub(crate) use file::below;
pub use file::{SceneOverrides, is_scene_file};
use glam::Vec3;
pub(crate) use model::complete;
pub use model::{Model, make_tangents};
pub use request::{CameraRequest, GroundRequest, SceneRequest, SurfaceRequest};
pub(crate) use request::{materials, opened};
use std::borrow::Cow;
use std::sync::Arc;
use steradian_base::{ParamValues, Task};
use steradian_light::{Lights, Probes};
use steradian_render::scenefile::SceneBackground;
use steradian_render::{Settings, ToneMapper};
use steradian_scene::{Camera, Framing, Mesh};
use steradian_techniques::Sites;
use steradian_transfer::{Refinement, Saved, refine};

/// A mesh with its materials, lights, camera, and how its picture is made.
#[derive(Clone)]
pub struct Scene {
    /// The geometry; [`Mesh::materials`] are indices into `materials`.
    pub mesh: Mesh,
    /// One per slot.
    pub materials: Vec<Material>,
    /// Material of a plane under the mesh, which extends to the horizon.
    pub ground: Option<Material>,
    /// The lights.
    pub lights: Lights,
    /// The camera; `None` sees the whole mesh.
    pub camera: Option<Camera>,
    /// Size and sampling of the picture.
    pub settings: Settings,
    /// Exposure value before tone mapping; `None` is automatic.
    pub exposure: Option<f32>,
    /// Tone mapper, from radiance to the display's colours.
    pub tone_mapper: ToneMapper,
    /// Background where no surface is visible.
    pub background: SceneBackground,
    /// Largest relative RMS error of radiance.
    pub tolerance: Option<f64>,
    /// Light that varies over space. Surfaces are lit by it in place of `lights`, which remain the
    /// background.
    pub probes: Option<Arc<Probes>>,
    /// Transfer of the mesh that a file holds ([`Session::saved_transfer`]), in place of rays for techniques
    /// that bake on it.
    pub transfer: Option<Arc<Saved>>,
}

/// Default vertical field of view, degrees.
pub const FOV: f32 = 32.0;

impl Scene {
    /// `mesh` under `lights`, 512 × 512 pixels, seen whole before its environment.
    pub fn new(mesh: Mesh, materials: Vec<Material>, lights: Lights) -> Self {
        Self {
            mesh,
            materials,
            ground: None,
            lights,
            camera: None,
            settings: Settings::new(512, 512),
            exposure: None,
            tone_mapper: ToneMapper::default(),
            background: SceneBackground::Environment(0.0),
            tolerance: None,
            probes: None,
            transfer: None,
        }
    }

    /// A mesh file or built-in shape, with `brdf` or else the file's own materials (or a grey one), under an
    /// image or a sky; an empty name is the usual sky.
    pub fn of(mesh: &str, brdf: Option<&str>, light: &str, session: &mut Session) -> Result<Self, Error> {
        let model = session.model(mesh)?;
        let brdf = brdf.map(|spec| session.brdf(spec)).transpose()?;
        let usual = Material::new(session.brdf("lambert")?);
        let materials = materials(&model, brdf, None, &usual, session)?;
        let light = if light.is_empty() { DEFAULT_SKY } else { light };
        Ok(Self::new(model.mesh, materials, session.light(light, &Adjust::default())?))
    }

    /// The camera, or one that sees the whole mesh, without the ground, with +Y up and [`FOV`].
    pub fn camera_or_framed(&self) -> Result<Camera, Error> {
        self.camera.map_or_else(|| self.framed(FOV, Vec3::Y), Ok)
    }

    /// A camera that sees the whole mesh, without the ground, with a vertical field of view of `fov` degrees.
    pub fn framed(&self, fov: f32, up: Vec3) -> Result<Camera, Error> {
        let aspect = self.settings.width as f32 / self.settings.height as f32;
        let framing = Framing { up, fov_y: fov.to_radians(), aspect, ..Framing::default() };
        let camera = self.mesh.bounds().and_then(|_| framing.camera(&self.mesh.positions));
        camera.ok_or_else(|| Error::input("the mesh has no triangles"))
    }

    /// The scene with its ground as part of the mesh, for a camera; where shadows and interreflection are
    /// interpolated between vertices, subdivided to the spacing that `sited` gives.
    pub(crate) fn staged(&self, camera: &Camera, sited: &Sited, task: &Task) -> Result<Cow<'_, Self>, Error> {
        let scene = self.grounded(camera);
        // Transfer read from a file belongs to the vertices as they are, so the mesh is not subdivided.
        let Some(coarsest) = sited.spacing.filter(|_| self.transfer.is_none()) else { return Ok(scene) };
        let mut scene = scene.into_owned();
        let refinement = Refinement { coarsest, ..Refinement::default() };
        scene.mesh = refine(&scene.mesh, self.mesh.bounds(), sited.slots.as_deref(), &refinement, task)?;
        Ok(Cow::Owned(scene))
    }

    /// The slots whose own techniques bake at vertices. Techniques that the session chooses bake at none.
    pub(crate) fn sited(&self) -> Sited {
        let all = || self.materials.iter().chain(&self.ground);
        let own = |m: &Material| spacing(m.method.as_ref()?, &m.params);
        let needs = |m: &Material| {
            let by = match &m.method {
                Some(Method::Technique(t)) => t.needs_sites(&m.params),
                _ => false,
            };
            by || m.local.as_ref().is_some_and(|l| l.technique.needs_sites(&l.params))
        };
        let slots: Arc<[u32]> = all().enumerate().filter(|(_, m)| needs(m)).map(|(k, _)| k as u32).collect();
        Sited {
            spacing: all().filter_map(own).chain(self.local_spacings()).reduce(f32::min),
            slots: (slots.len() < all().count()).then_some(slots),
        }
    }

    /// Largest distances between vertices for the techniques of local light.
    fn local_spacings(&self) -> impl Iterator<Item = f32> {
        self.materials.iter().chain(&self.ground).filter_map(|m| m.local.as_ref()?.spacing())
    }

    /// [`Scene::sited`] where all materials are shaded by each of `methods`.
    pub(crate) fn sited_by(&self, methods: &[Method]) -> Sited {
        let all = self.materials.iter().chain(&self.ground);
        let each = all.flat_map(|m| methods.iter().filter_map(|by| spacing(by, &given_to(by, &m.params))));
        Sited { spacing: each.chain(self.local_spacings()).reduce(f32::min), slots: None }
    }

    /// The techniques that its materials ask for.
    pub(crate) fn methods(&self) -> impl Iterator<Item = &Method> {
        self.materials.iter().chain(&self.ground).filter_map(|m| m.method.as_ref())
    }

    /// The scene with its ground as part of the mesh, for a camera.
    pub(crate) fn grounded(&self, camera: &Camera) -> Cow<'_, Self> {
        let Some(material) = &self.ground else { return Cow::Borrowed(self) };
        let mut scene = self.clone();
        scene.ground = None;
        let slot = scene.materials.len() as u32;
        scene.materials.push(material.clone());
        scene.mesh.materials.resize(scene.mesh.triangles.len(), 0);
        let plane = ground::under(&self.mesh, camera, self.settings.height).with_material(slot);
        let mut parts = [std::mem::take(&mut scene.mesh), plane];
        complete(&mut parts);
        scene.mesh = Mesh::merged(&parts);
        Cow::Owned(scene)
    }
}

/// Material slots whose techniques bake at vertices of a scene, and the spacing of these.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sited {
    /// Largest distance between vertices near the object, relative to its diagonal; `None`: as they were
    /// modelled.
    pub spacing: Option<f32>,
    /// The slots of the mesh, the ground's behind all others; `None`: all.
    pub slots: Option<Arc<[u32]>>,
}

impl Sited {
    /// At all vertices, as they were modelled.
    pub const ALL: Self = Self { spacing: None, slots: None };

    /// The sites.
    pub fn sites(&self) -> Sites {
        self.slots.clone().map_or(Sites::Vertices, Sites::Slots)
    }
}

/// Largest distance between vertices for a technique that bakes shadows at them.
fn spacing(method: &Method, params: &ParamValues) -> Option<f32> {
    match method {
        Method::Technique(t) if t.self_shadowing(params) => Some(t.spacing()),
        _ => None,
    }
}

/// Of parameters given for several techniques, those that this one has.
pub(crate) fn given_to(method: &Method, params: &ParamValues) -> ParamValues {
    let mut own = params.clone();
    if let Method::Technique(t) = method {
        own.0.retain(|name, _| t.params().iter().any(|p| p.name == name));
    }
    own
}
