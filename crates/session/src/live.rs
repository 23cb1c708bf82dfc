//! A scene for interactive display, drawn again and again while its camera, its lights and its materials
//! change.
//!
//! [`Session::live`] bakes only what changed since the scene before; [`Live::gpu`] is its data for a GPU, and
//! [`Live::turned`] the changes to these by another camera or a rotated light. [`Following`] lets it follow a
//! sky that moves faster than bakes. Pictures by the reference ([`Session::truth`]) are those that
//! [`Session::compare`] compares techniques with.

mod follow;

pub use follow::{Following, MovingSky};

use crate::compare::{differences, worst};
use crate::gpu_scene::{scene as drawn, unlit};
use crate::material::{Changed, Under, view};
use crate::picture::background;
use crate::scene::Sited;
use crate::{Error, Method, Prepared, Renderer, Scene, Session};
use glam::{Mat3, Vec3};
use std::sync::Arc;
use steradian_base::Certificate;
use steradian_gpu::scene as gpu;
use steradian_light::Environment;
use steradian_light::adjust::about_y;
use steradian_render::metrics::Errors;
use steradian_render::{Develop, Display, Film, Settings, Stage};
use steradian_scene::{Bvh, Camera};
use steradian_sphere::Layout;
use steradian_techniques::gpu::Uniform;
use steradian_techniques::{GpuTechnique, View};

/// Identities of a scene's inputs: data that depend only on inputs whose names are unchanged are not baked
/// again.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Names {
    /// The geometry and its maps.
    pub mesh: String,
    /// The lights, before they are turned.
    pub light: String,
}

/// A scene with its bakes.
pub struct Live {
    scene: Scene,
    names: Names,
    /// Where data are baked at vertices.
    sited: Sited,
    bvh: Arc<Bvh>,
    camera: Camera,
    materials: Vec<Prepared>,
    rebaked: usize,
    preview: bool,
}

/// Tolerance of previews at least: they are there within a tenth of a second or two, and stand in until data
/// of the scene's own tolerance are baked.
const PREVIEW_TOLERANCE: f64 = 0.2;
/// Rows of the light of previews at most: texels of 1.4°.
const PREVIEW_ROWS: usize = 128;

/// Changes of an object by another view.
pub enum Turned {
    /// Uniforms alone.
    Uniforms(Vec<Uniform>),
    /// More than that.
    Technique(Box<GpuTechnique>),
}

/// The surface under a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Probe {
    /// Material slot.
    pub material: usize,
    /// Position, metres.
    pub position: Vec3,
    /// Unit shading normal, without normal maps.
    pub normal: Vec3,
    /// Unit direction to the viewer.
    pub wo: Vec3,
}

/// The reference's picture.
#[derive(Clone)]
pub struct Truth {
    /// Radiance and coverage.
    pub film: Film,
    /// The largest relative error that a point was left with.
    pub error: f64,
}

/// Difference of a picture from the reference's, over the pixels that surfaces cover.
pub struct Difference {
    /// Errors of radiance.
    pub errors: Errors,
    /// Mean FLIP.
    pub flip: f64,
    /// FLIP as a picture.
    pub picture: Display,
}

impl Session {
    /// Bakes the data that `scene` needs. Data of `before` that depend on the same light, reflectance and
    /// geometry are reused; where a technique was chosen for a material, it stays under another light.
    pub fn live(&self, scene: &Scene, names: Names, before: Option<&Live>) -> Result<Live, Error> {
        self.baked(scene, names, before, false)
    }

    /// A preview of `scene` while [`Session::live`] bakes it: within a tenth of a second or two, by coarser
    /// bakes of unknown error under light of fewer texels. `None` where nothing of `before` can be reused, or
    /// everything.
    pub fn preview(&self, scene: &Scene, names: Names, before: &Live) -> Result<Option<Live>, Error> {
        let same_mesh = before.has_mesh_of(scene, &names);
        let materials = scene.materials.iter().chain(&scene.ground);
        let mut any = false;
        for (p, m) in before.materials.iter().zip(materials) {
            match Changed::of(p, m, before.names.light != names.light, !same_mesh) {
                Some(Changed::Nothing) => {}
                Some(_) => any = true,
                None => return Ok(None),
            }
        }
        if !same_mesh || !any {
            return Ok(None);
        }
        let mut coarse = scene.clone();
        coarse.tolerance = Some(scene.tolerance.unwrap_or(0.0).max(PREVIEW_TOLERANCE));
        if before.names.light != names.light {
            let many = |e: &&Arc<Environment>| e.image.height > PREVIEW_ROWS;
            if let Some(e) = coarse.lights.environment.as_ref().filter(many) {
                let image = e.image.resample(Layout::LatLong, 2 * PREVIEW_ROWS, PREVIEW_ROWS);
                coarse.lights.environment = Some(Arc::new(Environment { image }));
            }
        }
        self.baked(&coarse, names, Some(before), true).map(Some)
    }

    fn baked(
        &self,
        scene: &Scene,
        names: Names,
        before: Option<&Live>,
        preview: bool,
    ) -> Result<Live, Error> {
        crate::probes::refuse(scene)?;
        let camera = scene.camera_or_framed()?;
        let sited = scene.sited();
        let mesh = before.filter(|b| b.names.mesh == names.mesh && b.sited == sited);
        let (staged, bvh) = match mesh {
            Some(b) => {
                let mut staged = scene.clone();
                staged.ground = None;
                staged.materials.extend(scene.ground.clone());
                staged.mesh = b.scene.mesh.clone();
                (staged, b.bvh.clone())
            }
            None => {
                let staged = scene.staged(&camera, &sited, &self.task)?.into_owned();
                let bvh = Arc::new(Bvh::build(&staged.mesh));
                (staged, bvh)
            }
        };
        let under = Under {
            sites: &sited,
            lights: &staged.lights,
            camera: &camera,
            tolerance: staged.tolerance,
            scene: &staged,
        };
        let mut materials: Vec<Prepared> = Vec::new();
        let mut rebaked = 0;
        for (k, m) in staged.materials.iter().enumerate() {
            self.check()?;
            if let Some(done) = materials.iter().find(|p| m.shades_like(p)) {
                let shared = done.shared(m);
                materials.push(shared);
                continue;
            }
            let old = before.and_then(|b| Some((b, b.materials.get(k)?)));
            let changed = old.and_then(|(b, p)| {
                let geometry = mesh.is_none();
                Changed::of(p, m, b.names.light != names.light, geometry)
            });
            let prepared = match (changed, old) {
                (Some(Changed::Nothing), Some((_, p))) => p.shared(m),
                (Some(changed), Some((_, p))) => {
                    rebaked += 1;
                    self.rebaked(p, m, changed, under, preview)?
                }
                _ => {
                    rebaked += 1;
                    self.prepare_or_choose(&staged, &bvh, camera, m, false)?
                }
            };
            if prepared.bake.is_none() {
                let why = "no technique shades it: choose another reflectance";
                return Err(Error::usage(format!("{}: {why}", m.brdf.spec())));
            }
            self.tell_left_out(&prepared);
            materials.push(prepared);
        }
        if let Some(why) = unlit(&materials) {
            return Err(Error::usage(why));
        }
        Ok(Live { scene: staged, names, sited, bvh, camera, materials, rebaked, preview })
    }

    /// The reference's picture, by quadrature to a relative error of `tolerance` at each point, under the
    /// light turned by `degrees` about +Y.
    pub fn truth(
        &self,
        live: &Live,
        camera: Camera,
        degrees: f64,
        size: [usize; 2],
        tolerance: f64,
    ) -> Result<Truth, Error> {
        let mut lights = live.scene.lights.clone();
        if degrees != 0.0 {
            lights.adjust(degrees, 1.0);
        }
        let seen = Scene { lights, ..live.scene.clone() };
        let under = Under {
            lights: &seen.lights,
            camera: &camera,
            tolerance: Some(tolerance),
            scene: &seen,
            sites: &Sited::ALL,
        };
        let exact = |m: &crate::Material| self.prepare(m, &Method::Reference, under, &self.task);
        let prepared = seen.materials.iter().map(exact).collect::<Result<Vec<_>, _>>()?;
        let surfaces: Vec<_> = prepared.iter().map(|p| p.surface.clone()).collect();
        let settings = Settings { inner: 1, share: true, ..Settings::new(size[0], size[1]) };
        let framed = Scene { settings, mesh: steradian_scene::Mesh::default(), ..seen.clone() };
        let background = background(&framed, &camera);
        let stage = Stage {
            mesh: &live.scene.mesh,
            bvh: &live.bvh,
            surfaces: &surfaces,
            background: &background,
            camera,
        };
        let film = Renderer::Cpu.film(&stage, &prepared, &settings, self)?.0;
        let error = prepared.iter().map(Prepared::error).fold(0.0, f64::max);
        Ok(Truth { film, error })
    }
}

impl Live {
    /// The materials, as they are shaded.
    pub fn materials(&self) -> &[Prepared] {
        &self.materials
    }

    /// The scene with its ground as part of the mesh.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The camera that sees the whole mesh, or that the scene gave.
    pub fn camera(&self) -> Camera {
        self.camera
    }

    /// Number of materials baked for this scene; the data of all other ones were reused.
    pub fn rebaked(&self) -> usize {
        self.rebaked
    }

    /// Is it a preview, whose error is not measured?
    pub fn is_preview(&self) -> bool {
        self.preview
    }

    /// Would baking `scene` after this one keep the triangles, with data at the same vertices?
    pub fn has_mesh_of(&self, scene: &Scene, names: &Names) -> bool {
        self.names.mesh == names.mesh && self.sited == scene.sited()
    }

    /// Has `other` the same triangles?
    pub fn same_mesh(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.bvh, &other.bvh)
    }

    /// Is it lit as `other` is?
    pub fn same_light(&self, other: &Self) -> bool {
        self.names.light == other.names.light
    }

    /// The certificate of the largest error.
    pub fn certificate(&self) -> Option<Certificate> {
        worst(&self.materials)
    }

    /// Bytes that shading reads.
    pub fn bytes(&self) -> usize {
        self.materials.iter().map(|p| p.bytes).sum()
    }

    /// Data for a GPU to draw a picture of `height` rows.
    pub fn gpu(&self, camera: Camera, height: usize, rotation: Mat3) -> gpu::Scene {
        let scene = Scene { settings: Settings { height, ..self.scene.settings }, ..self.without_mesh() };
        let background = background(&scene, &camera);
        let stage =
            Stage { mesh: &self.scene.mesh, bvh: &self.bvh, surfaces: &[], background: &background, camera };
        let mut out = drawn(&stage, &self.materials);
        out.light_rotation = rotation;
        for (object, turned) in out.objects.iter_mut().zip(self.turned(camera, rotation)) {
            match turned {
                Turned::Uniforms(u) => object.technique.set_uniforms(&u),
                Turned::Technique(t) => object.technique = *t,
            }
        }
        out
    }

    /// The scene but for its triangles, which are many.
    fn without_mesh(&self) -> Scene {
        let s = &self.scene;
        let mut out = Scene::new(steradian_scene::Mesh::default(), Vec::new(), s.lights.clone());
        out.background = s.background;
        out.settings = s.settings;
        out
    }

    /// Changes by a camera and a rotation of the light to each object of [`Live::gpu`].
    pub fn turned(&self, camera: Camera, rotation: Mat3) -> Vec<Turned> {
        let view = View { light_rotation: rotation, ..view(&camera) };
        let of = |k: usize| {
            let p = &self.materials[k];
            let bake = p.bake.as_ref()?.0.with_view(&view);
            let varied = || if p.surface.maps.is_empty() { None } else { bake.gpu_varied() };
            Some(match bake.gpu_frame() {
                Some(uniforms) => Turned::Uniforms(uniforms),
                None => Turned::Technique(Box::new(varied().unwrap_or_else(|| bake.gpu()))),
            })
        };
        self.used().into_iter().filter_map(of).collect()
    }

    /// The material slots that triangles have, in the order of objects.
    fn used(&self) -> Vec<usize> {
        let last = self.materials.len().saturating_sub(1);
        let mut used = vec![false; self.materials.len()];
        let mesh = &self.scene.mesh;
        (0..mesh.triangles.len()).for_each(|i| used[(mesh.material(i) as usize).min(last)] = true);
        (0..used.len()).filter(|&k| used[k]).collect()
    }

    /// The surface under the point (`x`, `y`) of a picture of `size`, in pixels from its upper left corner.
    pub fn probe(&self, camera: Camera, [x, y]: [f32; 2], size: [usize; 2]) -> Option<Probe> {
        let ray = camera.ray(x, y, size[0] as u32, size[1] as u32);
        let hit = self.bvh.closest(&ray, f32::INFINITY)?;
        let mesh = &self.scene.mesh;
        let corners = mesh.triangles[hit.triangle as usize].map(|v| v as usize);
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        let normal: Vec3 = corners.iter().zip(weights).map(|(&v, w)| mesh.normals[v] * w).sum();
        let wo = -ray.direction;
        Some(Probe {
            material: (mesh.material(hit.triangle as usize) as usize).min(self.materials.len() - 1),
            position: ray.origin + ray.direction * hit.t,
            normal: normal.normalize_or(wo),
            wo,
        })
    }
}

impl Truth {
    /// Difference of `film` from this picture, both developed with the same settings: the numbers of
    /// [`Session::compare`].
    pub fn difference(&self, film: &Film, develop: Develop) -> Difference {
        let (errors, flip, picture) =
            differences(film, &develop.film(film), &self.film, &develop.film(&self.film));
        Difference { errors, flip, picture }
    }
}

/// The rotation of a light turned by `degrees` about +Y.
pub fn rotation(degrees: f64) -> Mat3 {
    about_y(degrees).as_mat3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Material;
    use crate::compare::Plan;
    use steradian_techniques::GpuTechnique;

    const FIRST: &str = "ggx:alpha=0.3,f0=1/0.8/0.4";

    fn scene(session: &mut Session, brdf: &str, light: &str) -> Scene {
        let mut scene = Scene::of("torus:segments=24", Some(brdf), light, session).expect("a scene");
        (scene.settings.width, scene.settings.height) = (32, 24);
        let method = Method::find("split_sum").expect("registered");
        scene.materials.iter_mut().for_each(|m: &mut Material| m.method = Some(method.clone()));
        scene
    }

    fn names(light: &str) -> Names {
        Names { mesh: "torus".into(), light: light.into() }
    }

    fn drawn(live: &Live) -> GpuTechnique {
        live.gpu(live.camera(), 24, Mat3::IDENTITY).objects.remove(0).technique
    }

    #[test]
    fn what_stays_is_taken_over_and_the_rest_is_as_baked_afresh() {
        let mut session = Session::new();
        let first = scene(&mut session, FIRST, "studio");
        let a = session.live(&first, names("studio"), None).expect("bakes");
        let same = session.live(&first, names("studio"), Some(&a)).expect("bakes");
        assert_eq!((a.rebaked(), same.rebaked()), (1, 0));
        assert!(same.same_mesh(&a));
        for (brdf, light) in
            [("ggx:alpha=0.4,f0=1/0.8/0.4", "studio"), (FIRST, "overcast"), ("ggx:alpha=0.2,f0=1", "sky")]
        {
            let changed = scene(&mut session, brdf, light);
            let b = session.live(&changed, names(light), Some(&a)).expect("bakes");
            let fresh = session.live(&changed, names(light), None).expect("bakes");
            assert_eq!(b.rebaked(), 1, "{brdf} under {light}");
            assert!(drawn(&b) == drawn(&fresh), "{brdf} under {light}");
            assert!(drawn(&b) != drawn(&a), "{brdf} under {light}");
            let preview = session.preview(&changed, names(light), &a).expect("bakes");
            match preview {
                Some(p) => assert!(p.is_preview() && !b.is_preview() && drawn(&p) != drawn(&a)),
                // Light and reflectance at once: all is baked.
                None => assert_eq!((brdf, light), ("ggx:alpha=0.2,f0=1", "sky")),
            }
        }
    }

    /// A ring on the ground, whose techniques bake at vertices; that of the ring and its reflectance as
    /// given.
    fn standing(session: &mut Session, brdf: &str, technique: &str) -> Scene {
        let named = |slug: &str| Some(Method::find(slug).expect("registered"));
        let mut scene = scene(session, brdf, "studio");
        let coarse = steradian_base::ParamValues([("precision".to_string(), 0.1.into())].into());
        scene.materials.iter_mut().for_each(|m| m.method = named(technique));
        let ground = Material::new(session.brdf("lambert:albedo=0.4").expect("a spec"));
        scene.ground = Some(Material { method: named("prt_diffuse"), params: coarse.clone(), ..ground });
        if technique == "prt_diffuse" {
            scene.materials.iter_mut().for_each(|m| m.params = coarse.clone());
        }
        scene
    }

    #[test]
    fn sites_are_those_of_the_materials_that_bake_there() {
        let mut session = Session::new();
        let first = standing(&mut session, FIRST, "split_sum");
        let a = session.live(&first, names("studio"), None).expect("bakes");
        // Another reflectance of the ring leaves the ground's data unchanged.
        let other = standing(&mut session, "ggx:alpha=0.4,f0=1", "split_sum");
        let b = session.live(&other, names("studio"), Some(&a)).expect("bakes");
        assert!(b.same_mesh(&a) && b.rebaked() == 1);
        // The ground's own technique and reflectance for the ring too: one bake with the vertices of both.
        let alike = standing(&mut session, "lambert:albedo=0.4", "prt_diffuse");
        let c = session.live(&alike, names("studio"), Some(&b)).expect("bakes");
        let fresh = session.live(&alike, names("studio"), None).expect("bakes");
        assert!(!c.same_mesh(&b) && drawn(&c) == drawn(&fresh));
    }

    #[test]
    fn a_saved_bake_of_the_same_technique_is_no_bake_of_before() {
        use crate::Adjust;
        use crate::bake::{Accuracy, Output, Request};
        let mut session = Session::new();
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("x.safetensors");
        let request = Request {
            environment: "furnace".into(),
            adjust: Adjust::default(),
            sun_lights: None,
            brdf: "ggx:alpha=0.6,f0=0.3".into(),
            technique: steradian_techniques::find("split_sum").expect("registered"),
            params: steradian_base::ParamValues::default(),
            accuracy: Accuracy::Usual,
            mesh: None,
            transfer: None,
            half: false,
        };
        let baked = session.bake(&request).expect("bakes").met().expect("no tolerance");
        baked.write(&Output::of(&file).expect("a place"), &session).expect("writes");
        let mut scene = scene(&mut session, FIRST, "studio");
        let before = session.live(&scene, names("studio"), None).expect("bakes");
        let saved = Arc::new(session.saved_bake(&file, &Adjust::default()).expect("reads"));
        scene.materials.iter_mut().for_each(|m| m.method = Some(Method::File(saved.clone())));
        let after = session.live(&scene, names("studio"), Some(&before)).expect("loads");
        assert!(after.rebaked() == 1 && drawn(&after) != drawn(&before));
        assert!(drawn(&after) == drawn(&session.live(&scene, names("studio"), None).expect("loads")));
    }

    #[test]
    fn the_reference_and_its_numbers_are_those_of_compare() {
        let mut session = Session::new();
        let scene = scene(&mut session, FIRST, "studio");
        let live = session.live(&scene, names("studio"), None).expect("bakes");
        let plan = Plan { reference_tolerance: 0.01, paths: false, ev: 0.0, certificates: false };
        let method = Method::find("split_sum").expect("registered");
        let answers = session.compared(&scene, &[method], &[Renderer::Cpu], &plan).expect("compares");
        let (want, flip) = answers[1].rendering().and_then(|r| r.errors).expect("numbers");
        let truth = session.truth(&live, live.camera(), 0.0, [32, 24], 0.01).expect("a picture");
        let surfaces: Vec<_> = live.materials().iter().map(|p| p.surface.clone()).collect();
        let background = background(&scene, &live.camera());
        let (mesh, bvh, camera) = (&live.scene.mesh, &*live.bvh, live.camera());
        let stage = Stage { mesh, bvh, surfaces: &surfaces, background: &background, camera };
        let settings = Settings { inner: 1, share: true, ..scene.settings };
        let film = Renderer::Cpu.film(&stage, live.materials(), &settings, &session).expect("a picture").0;
        let ev = crate::auto_exposure(&truth.film);
        let d = truth.difference(&film, Develop { ev, mapper: scene.tone_mapper });
        assert_eq!((d.errors.relative_rms, d.errors.stops, d.flip), (want.relative_rms, want.stops, flip));
        assert!(
            truth.error <= 0.01 && d.errors.relative_rms > 0.01,
            "{} {}",
            truth.error,
            d.errors.relative_rms
        );
    }

    #[test]
    fn probes_find_the_surface_under_a_pixel() {
        let mut session = Session::new();
        let mut scene = scene(&mut session, FIRST, "studio");
        scene.mesh = session.mesh("sphere").expect("a shape");
        let live = session.live(&scene, names("studio"), None).expect("bakes");
        let p = live.probe(live.camera(), [16.0, 12.0], [32, 24]).expect("the sphere is in the middle");
        assert!((p.position.length() - 1.0).abs() < 0.02 && p.normal.dot(p.wo) > 0.99, "{p:?}");
        assert_eq!(live.probe(live.camera(), [0.5, 0.5], [32, 24]), None);
    }
}
