//! A scene by the names of its parts, as a command line or a form gives them.

use super::{FOV, Scene, is_scene_file};
use crate::transfer::check_reads;
use crate::{
    Adjust, DEFAULT_SKY, Error, Local, Material, Method, Model, SceneOverrides, Session, make_tangents,
};
use glam::{Affine3A, Vec3};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use steradian_base::{ParamValues, split_spec};
use steradian_brdf::SharedBrdf;
use steradian_light::{Lamp, Lights};
use steradian_render::scenefile::SceneBackground;
use steradian_render::{NormalFiltering, SurfaceMaps, Texture, ToneMapper};
use steradian_scene::{Camera, Mesh};
use steradian_techniques::SavedBake;

/// What a scene is made of, by name. What is left out is as [`Scene::new`] or the scene file has it.
#[derive(Clone, Default)]
pub struct SceneRequest {
    /// Scene file (.toml), mesh file or built-in shape.
    pub input: String,
    /// What the mesh is made of; a scene file has materials of its own.
    pub surface: SurfaceRequest,
    /// A technique, or the reference, for every material.
    pub method: Option<Method>,
    /// A technique for directional and point lights for every material; `Some(None)` shades them exactly.
    pub local: Option<Option<Local>>,
    /// Image or sky; `None` is the usual sky, or no environment where other lights are named.
    pub environment: Option<String>,
    /// How the environment is read, turned and scaled.
    pub adjust: Adjust,
    /// File of lights in addition to the environment, which turn and scale with it.
    pub sun_lights: Option<PathBuf>,
    /// Lights in addition to the environment, which neither turn nor scale with it.
    pub lamps: Vec<Lamp>,
    /// File of light that varies over space, in place of every other light.
    pub probes: Option<PathBuf>,
    /// A plane under the mesh.
    pub ground: Option<GroundRequest>,
    /// The camera.
    pub camera: CameraRequest,
    /// Width and height, pixels.
    pub size: Option<(usize, usize)>,
    /// Samples per pixel and axis on edges.
    pub samples: Option<usize>,
    /// Exposure value before tone mapping; `Some(None)` is automatic.
    pub exposure: Option<Option<f32>>,
    /// How radiance becomes a display's colours.
    pub tone_mapper: Option<ToneMapper>,
    /// Background, where a pixel shows no surface.
    pub background: Option<SceneBackground>,
    /// Blur of the environment that is seen, degrees.
    pub blur: Option<f64>,
    /// How the normals under a pixel are filtered.
    pub normal_filtering: Option<NormalFiltering>,
    /// Relative RMS error of radiance that is asked for.
    pub tolerance: Option<f64>,
}

/// What a mesh is made of, by name.
#[derive(Clone, Default, PartialEq)]
pub struct SurfaceRequest {
    /// Reflectance, which the base colours of the mesh's file multiply; `None`: what the file says.
    pub brdf: Option<String>,
    /// Parameters of the technique.
    pub params: ParamValues,
    /// A saved bake, in place of reflectance and technique.
    pub bake: Option<PathBuf>,
    /// File of the mesh's transfer, in place of rays.
    pub transfer: Option<PathBuf>,
    /// Image that multiplies the reflectance, in place of the file's base colours.
    pub base_colour: Option<PathBuf>,
    /// Tangent-space normal map, green up, in place of the file's, and the factor of its bumps.
    pub normal_map: Option<(PathBuf, f32)>,
    /// Image of perceptual roughness, in place of the reflectance's.
    pub roughness_map: Option<PathBuf>,
    /// Leave out the materials of the mesh's file.
    pub plain: bool,
    /// Moves the mesh, metres.
    pub translate: Option<Vec3>,
}

/// A plane under a mesh, as far as the horizon.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GroundRequest {
    /// Its reflectance.
    pub brdf: String,
    /// Its technique with parameters, such as `prt_diffuse:precision=0.05`; `None`: the mesh's where that
    /// takes the reflectance, else one is chosen.
    pub technique: Option<String>,
}

/// Where a camera stands; what is left out frames the mesh, or is as the scene file says.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CameraRequest {
    /// Its position, metres.
    pub from: Option<Vec3>,
    /// What it looks at, metres.
    pub at: Option<Vec3>,
    /// Upwards, not zero.
    pub up: Option<Vec3>,
    /// Vertical field of view, degrees below 180.
    pub fov: Option<f32>,
}

impl Session {
    /// The scene that `request` describes, with a camera.
    pub fn scene(&mut self, request: &SceneRequest) -> Result<Scene, Error> {
        let o = request;
        let mut scene = if is_scene_file(&o.input) { of_file(o, self)? } else { of_mesh(o, self)? };
        if let Some((w, h)) = o.size {
            (scene.settings.width, scene.settings.height) = (w, h);
        }
        if let Some(n) = o.samples {
            scene.settings.edge = n;
            scene.settings.inner = scene.settings.inner.min(n);
        }
        scene.exposure = o.exposure.unwrap_or(scene.exposure);
        scene.tone_mapper = o.tone_mapper.unwrap_or(scene.tone_mapper);
        scene.background = o.background.unwrap_or(scene.background);
        if let (Some(blur), SceneBackground::Environment(b)) = (o.blur, &mut scene.background) {
            *b = blur.to_radians();
        }
        if let Some(path) = &o.sun_lights {
            self.join_lights(path, &mut scene.lights, &o.adjust)?;
        }
        o.lamps.iter().for_each(|l| l.join(&mut scene.lights));
        self.tell_idle(&scene);
        scene.tolerance = o.tolerance;
        if let Some(path) = &o.probes {
            scene.probes = Some(Arc::new(self.probes(path)?));
        }
        if let Some(filtering) = o.normal_filtering {
            scene.materials.iter_mut().for_each(|m| m.maps.filtering = filtering);
        }
        scene.camera = Some(camera(o, &scene)?);
        scene.ground = match &o.ground {
            Some(ground) => Some(of_ground(ground, o, self)?),
            None => scene.ground,
        };
        self.check()?;
        Ok(scene)
    }

    /// Tells where a technique for directional and point lights has none.
    fn tell_idle(&self, scene: &Scene) {
        let lit = !scene.lights.directionals.is_empty() || !scene.lights.points.is_empty();
        let local = scene.materials.iter().find_map(|m| m.local.as_ref());
        if let (Some(local), false) = (local, lit) {
            let name = local.technique.card().slug;
            let what = if local.has_bumps() { "gives its normals alone" } else { "has nothing to shade" };
            self.say(format_args!("no directional and no point light: {name} {what}"));
        }
    }
}

/// A scene file, with what the request changes in it.
fn of_file(o: &SceneRequest, session: &mut Session) -> Result<Scene, Error> {
    if o.surface != SurfaceRequest::default() {
        return Err(Error::usage(format!(
            "{}: a scene file has materials: reflectance, bake, transfer, textures, parameters and place belong to a mesh",
            o.input
        )));
    }
    let overrides = SceneOverrides {
        environment: o.environment.clone(),
        adjust: o.adjust.clone(),
        method: o.method.clone(),
        local: opened(o.local.as_ref(), session)?,
    };
    session.scene_file(Path::new(&o.input), &overrides)
}

/// The technique for directional and point lights, with what its files hold.
pub(crate) fn opened(
    local: Option<&Option<Local>>,
    session: &mut Session,
) -> Result<Option<Option<Local>>, Error> {
    let open = |local: &Option<Local>| local.as_ref().map(|l| session.open_local(l, None)).transpose();
    local.map(open).transpose()
}

/// A mesh or shape with the material that is asked for, of its file, or of clay.
fn of_mesh(o: &SceneRequest, session: &mut Session) -> Result<Scene, Error> {
    let s = &o.surface;
    let file = s.bake.as_deref().map(|p| session.saved_bake(p, &o.adjust)).transpose()?.map(Arc::new);
    let method = file.clone().map(Method::File).or_else(|| o.method.clone());
    if method.is_none() && !s.params.0.is_empty() {
        return Err(Error::usage("parameters belong to a technique: name it"));
    }
    let brdf = match (&file, &s.brdf) {
        // Of no part in shading: what the bake was made of, in name.
        (Some(file), _) => Some(file.brdf().map_or_else(|| session.brdf("lambert"), Ok)?),
        (None, spec) => spec.as_deref().map(|spec| session.brdf(spec)).transpose()?,
    };
    let base_colour = s.base_colour.as_deref().map(|p| session.texture(p)).transpose()?;
    let mut model = session.model(&o.input)?;
    let maps = maps(o, &model.mesh, session)?;
    let local = opened(o.local.as_ref(), session)?.flatten();
    let usual =
        Material { method, params: s.params.clone(), local, maps, ..Material::new(session.brdf("lambert")?) };
    let usual = session.open_material(usual, None)?;
    usual.check_mesh(&model.mesh, &o.input)?;
    if usual.maps.normal.is_some() || usual.is_textured() {
        make_tangents(std::slice::from_mut(&mut model.mesh));
    }
    if s.plain {
        model.materials.clear();
        model.mesh.materials.clear();
    }
    if let Some(by) = s.translate {
        model.mesh = model.mesh.transformed(&Affine3A::from_translation(by));
    }
    let transfer = match (s.transfer.as_deref(), &o.method) {
        (None, _) => None,
        (Some(path), Some(Method::Technique(t))) => {
            check_reads(*t, &s.params)?;
            Some(session.transfer_of(path, &model.mesh, "vertices")?)
        }
        _ => {
            return Err(Error::usage(
                "transfer of a file belongs to a technique: name one, such as prt_diffuse",
            ));
        }
    };
    let lights = lights(o, file.as_deref(), session)?;
    tell_materials(o, &model, brdf.is_some(), session);
    let materials = materials(&model, brdf, base_colour, &usual, session)?;
    Ok(Scene { transfer, ..Scene::new(model.mesh, materials, lights) })
}

/// A model's materials, one per slot: `usual` of the reflectance `brdf`, or of what its file says. Where both
/// are silent it is of clay, or where a base colour is given, of nothing but that.
pub(crate) fn materials(
    model: &Model,
    brdf: Option<SharedBrdf>,
    base_colour: Option<Arc<Texture>>,
    usual: &Material,
    session: &mut Session,
) -> Result<Vec<Material>, Error> {
    let own = brdf.is_none();
    if model.materials.is_empty() {
        let clay = if base_colour.is_some() { "lambert" } else { "lambert:albedo=0.6" };
        let brdf = brdf.map_or_else(|| session.brdf(clay), Ok)?;
        return Ok(vec![Material { brdf, base_colour, ..usual.clone() }]);
    }
    let of_slot = |m: &steradian_render::FileMaterial| {
        let file = m.maps(own);
        let maps = SurfaceMaps {
            normal: usual.maps.normal.clone().or(file.normal),
            alpha2: usual.maps.alpha2.clone().or(file.alpha2),
            ..file
        };
        let brdf = brdf.clone().map_or_else(|| m.brdf(), Ok)?;
        Ok(Material { brdf, base_colour: base_colour.clone().or_else(|| m.tint(own)), maps, ..usual.clone() })
    };
    model.materials.iter().map(of_slot).collect()
}

/// The lights of a mesh; with a saved bake what is seen of them.
fn lights(o: &SceneRequest, file: Option<&SavedBake>, session: &mut Session) -> Result<Lights, Error> {
    let others = o.sun_lights.is_some() || !o.lamps.is_empty() || o.probes.is_some();
    match (&o.environment, file) {
        (spec, Some(file)) => {
            let seen = session.light_of_bake(file, spec.as_deref(), &o.adjust)?;
            if seen.is_none() && o.background.is_none() {
                let light = &file.made.environment;
                session.say(format_args!("nothing is seen behind: the environment {light} would be"));
            }
            Ok(seen.unwrap_or_default())
        }
        (None, None) if others => Ok(Lights::default()),
        (spec, None) => session.light(spec.as_deref().unwrap_or(DEFAULT_SKY), &o.adjust),
    }
}

/// The maps that are given for a mesh.
fn maps(o: &SceneRequest, mesh: &Mesh, session: &mut Session) -> Result<SurfaceMaps, Error> {
    let s = &o.surface;
    let images = [
        (s.base_colour.is_some(), "base colours"),
        (s.normal_map.is_some(), "a normal map"),
        (s.roughness_map.is_some(), "a roughness map"),
    ];
    if let (Some((_, what)), true) = (images.iter().find(|i| i.0), mesh.uvs.is_empty()) {
        return Err(Error::usage(format!("{}: has no texture coordinates for {what}", o.input)));
    }
    let mut out = SurfaceMaps::default();
    if let Some((path, scale)) = &s.normal_map {
        out.normal = session.normal_map(path, *scale)?.normal;
    }
    if let Some(path) = &s.roughness_map {
        out.alpha2 = session.roughness_map(path)?.alpha2;
    }
    Ok(out)
}

/// Tells what of the file's materials is used; of many, the first ones.
fn tell_materials(o: &SceneRequest, model: &Model, given: bool, session: &Session) {
    const LINES: usize = 4;
    let (name, materials) = (&o.input, &model.materials);
    if given {
        let own = materials.iter().filter(|m| m.base_colour.is_some()).count();
        if own > 0 && o.surface.base_colour.is_none() {
            session
                .say(format_args!("{name}: base colours of {own} of its materials multiply the reflectance"));
        }
        return;
    }
    materials.iter().take(LINES).for_each(|m| session.say(format_args!("{name}: {}", m.assumed())));
    if let Some(more @ 1..) = materials.len().checked_sub(LINES) {
        session.say(format_args!("{name}: and {more} more materials"));
    }
}

fn of_ground(ground: &GroundRequest, o: &SceneRequest, session: &mut Session) -> Result<Material, Error> {
    let brdf = session.brdf(&ground.brdf)?;
    if let Some(spec) = &ground.technique {
        let (name, body) = split_spec(spec);
        let method = Method::find(name)?;
        let refused = |why: String| Error::usage(format!("technique of the ground: {why}"));
        let Method::Technique(t) = method else {
            return Err(refused(format!("{name} shades all of a scene, or none")));
        };
        let params = ParamValues::parse(body, t.params()).map_err(|e| refused(e.to_string()))?;
        t.takes(&*brdf, &params).map_err(|why| refused(format!("{name} {why}")))?;
        return Ok(Material { method: Some(method), params, ..Material::new(brdf) });
    }
    let method = o.method.clone().filter(|m| match m {
        Method::Technique(t) => (t.card().materials)(&*brdf).is_ok(),
        _ => true,
    });
    let given = o.local.clone().flatten();
    let taken = |l: &Local| (l.technique.card().materials)(&*brdf).is_ok() && !l.is_textured(false);
    let local = given.clone().filter(taken);
    if let (Some(l), None) = (&given, &local) {
        let name = l.technique.card().slug;
        let why =
            if l.is_textured(false) { "its files belong to the mesh" } else { "of another reflectance" };
        session
            .say(format_args!("ground: not by {name} ({why}): directional and point lights are exact there"));
    }
    Ok(Material { method, local, ..Material::new(brdf) })
}

fn camera(o: &SceneRequest, scene: &Scene) -> Result<Camera, Error> {
    if scene.mesh.bounds().is_none() {
        return Err(Error::input(format!("{}: has no triangles", o.input)));
    }
    let c = o.camera;
    if c.up.is_some_and(|v| v == Vec3::ZERO) {
        return Err(Error::usage("the camera's upward direction is zero"));
    }
    if c.fov.is_some_and(|f| f >= 180.0) {
        return Err(Error::usage("the field of view must be below 180 degrees"));
    }
    let framed = || scene.framed(c.fov.unwrap_or(FOV), c.up.unwrap_or(Vec3::Y));
    Ok(match scene.camera.map_or_else(framed, Ok)? {
        Camera::Pinhole { from, at, up, fov_y } => Camera::Pinhole {
            from: c.from.unwrap_or(from),
            at: c.at.unwrap_or(at),
            up: c.up.unwrap_or(up),
            fov_y: c.fov.map_or(fov_y, f32::to_radians),
        },
        Camera::Orthographic { from, at, up, height } => Camera::Orthographic {
            from: c.from.unwrap_or(from),
            at: c.at.unwrap_or(at),
            up: c.up.unwrap_or(up),
            height,
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(input: &str) -> SceneRequest {
        SceneRequest { input: input.into(), environment: Some("overcast".into()), ..SceneRequest::default() }
    }

    #[test]
    fn a_scene_is_what_its_request_says() {
        let mut session = Session::new();
        let by = Vec3::new(5.0, 0.0, 0.0);
        let request = SceneRequest {
            surface: SurfaceRequest {
                brdf: Some("ggx:alpha=0.3".into()),
                translate: Some(by),
                ..SurfaceRequest::default()
            },
            method: Some(Method::find("split_sum").unwrap()),
            ground: Some(GroundRequest {
                brdf: "lambert".into(),
                technique: Some("prt_diffuse:bands=3".into()),
            }),
            camera: CameraRequest { fov: Some(20.0), ..CameraRequest::default() },
            size: Some((64, 32)),
            exposure: Some(Some(1.0)),
            blur: Some(90.0),
            ..of("sphere")
        };
        let scene = session.scene(&request).unwrap();
        let (low, high) = scene.mesh.bounds().unwrap();
        assert!((0.5 * (low + high) - by).length() < 1e-5);
        assert_eq!(scene.materials[0].brdf.info().name, "ggx");
        assert_eq!(scene.materials[0].method.as_ref().map(Method::slug), Some("split_sum"));
        let ground = scene.ground.as_ref().unwrap();
        assert_eq!(ground.method.as_ref().map(Method::slug), Some("prt_diffuse"));
        assert!(ground.params.0.contains_key("bands"));
        assert_eq!((scene.settings.width, scene.settings.height, scene.exposure), (64, 32, Some(1.0)));
        let blurred = SceneBackground::Environment(90f64.to_radians());
        assert_eq!(scene.background, blurred);
        let Some(Camera::Pinhole { at, fov_y, .. }) = scene.camera else { panic!("a camera") };
        assert!((at - by).length() < 1e-4 && (fov_y - 20f32.to_radians()).abs() < 1e-6);
        // The technique of the mesh shades the ground where it takes it; the one named for the ground alone.
        let plain = GroundRequest { brdf: "lambert".into(), technique: None };
        let request = SceneRequest { ground: Some(plain), ..request };
        let ground = session.scene(&request).unwrap().ground.unwrap();
        let taken =
            (steradian_techniques::find("split_sum").unwrap().card().materials)(&*ground.brdf).is_ok();
        assert_eq!(ground.method.is_some(), taken);
    }

    /// Where lights are named, no default environment is added.
    #[test]
    fn lamps_stand_alone() {
        let lamp = Lamp::parse("point:position=1/2/3,intensity=1/1/1").unwrap();
        let request = SceneRequest { environment: None, lamps: vec![lamp], ..of("sphere") };
        let scene = Session::new().scene(&request).unwrap();
        assert!(scene.lights.environment.is_none() && scene.lights.points.len() == 1);
    }

    #[test]
    fn what_has_no_meaning_is_refused() {
        let refused = |request: SceneRequest, part: &str| {
            let why = Session::new().scene(&request).err().map(|e| e.to_string()).unwrap_or_default();
            assert!(why.contains(part), "{part}: {why}");
        };
        let params: ParamValues = [("bands", 3.0)].into_iter().collect();
        let surface = SurfaceRequest { params, ..SurfaceRequest::default() };
        refused(SceneRequest { surface: surface.clone(), ..of("sphere") }, "belong to a technique");
        refused(SceneRequest { surface, ..of("missing.toml") }, "belong to a mesh");
        let up = CameraRequest { up: Some(Vec3::ZERO), ..CameraRequest::default() };
        refused(SceneRequest { camera: up, ..of("sphere") }, "upward direction is zero");
        let wide = CameraRequest { fov: Some(180.0), ..CameraRequest::default() };
        refused(SceneRequest { camera: wide, ..of("sphere") }, "below 180 degrees");
        let ground = |brdf: &str, technique: &str| {
            Some(GroundRequest { brdf: brdf.into(), technique: Some(technique.into()) })
        };
        refused(SceneRequest { ground: ground("lambert", "path"), ..of("sphere") }, "shades all of a scene");
        refused(
            SceneRequest { ground: ground("ggx:alpha=0.3", "prt_diffuse"), ..of("sphere") },
            "takes lambert only",
        );
    }
}
