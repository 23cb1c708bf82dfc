//! Request for a comparison: lights and reflectances by name, a sweep, saved bakes, or a scene file.

use super::{Finding, Kept, Sweep, Swept, digest, mark as file_mark};
use crate::compare::Plan;
use crate::scene::{materials, opened};
use crate::{
    Adjust, DEFAULT_SKY, Error, Local, Material, Method, Renderer, Scene, SceneOverrides, Session, Shadows,
    is_scene_file, light_as_baked, make_tangents,
};
use glam::Vec3;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use steradian_base::ParamValues;
use steradian_brdf::SharedBrdf;
use steradian_light::{Lamp, Lights};
use steradian_render::scenefile::SceneBackground;
use steradian_render::{Settings, ToneMapper};
use steradian_techniques::SavedBake;
use steradian_techniques::direct::Suns;

/// Inputs and settings of a comparison.
#[derive(Clone)]
pub struct Request {
    /// Mesh file, built-in shape, or scene file (.toml).
    pub model: String,
    /// Lights: images, or specs of skies; none: the usual sky, or the scene file's light.
    pub environments: Vec<String>,
    /// How these lights are read, rotated and scaled.
    pub adjust: Adjust,
    /// Lights in addition; without an environment the only ones.
    pub lights: Vec<Lamp>,
    /// The technique for directional and point lights: `Some(None)` is exact shading, `None` that of a scene
    /// file.
    pub local: Option<Option<Local>>,
    /// Specs of reflectances; none: the mesh file's materials, else two usual ones.
    pub brdfs: Vec<String>,
    /// Names of techniques; where empty, all that accept the material, or with saved bakes none.
    pub techniques: Vec<String>,
    /// Parameters of those techniques that have them.
    pub params: ParamValues,
    /// File of the mesh's transfer, in place of rays for the techniques that take it.
    pub transfer: Option<PathBuf>,
    /// Saved bakes of one light and one reflectance.
    pub bakes: Vec<PathBuf>,
    /// A parameter that is varied.
    pub sweep: Option<Sweep>,
    /// File of a light field, in place of every other light.
    pub probes: Option<PathBuf>,
    /// Width and height of each picture, pixels.
    pub size: [usize; 2],
    /// The reference and its precision.
    pub plan: Plan,
    /// Largest relative RMS error of the pictures.
    pub tolerance: Option<f64>,
    /// Tone mapper of the pictures and of FLIP.
    pub tone_mapper: ToneMapper,
    /// File of earlier results, which are not computed again and to which new ones are added.
    pub results: Option<PathBuf>,
    /// Are the pictures of earlier results needed?
    pub pictured: bool,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            model: "sphere".into(),
            environments: Vec::new(),
            adjust: Adjust::default(),
            lights: Vec::new(),
            local: None,
            brdfs: Vec::new(),
            techniques: Vec::new(),
            params: ParamValues::default(),
            transfer: None,
            bakes: Vec::new(),
            sweep: None,
            probes: None,
            size: [160; 2],
            plan: Plan { reference_tolerance: 5e-3, paths: false, ev: 0.0, certificates: true },
            tolerance: None,
            tone_mapper: ToneMapper::default(),
            results: None,
            pictured: false,
        }
    }
}

/// Name of the light in rows whose only light is lamps.
const NO_ENVIRONMENT: &str = "the lights given";
/// Vertical field of view, degrees.
const FOV: f32 = 30.0;
/// Blur of the background, radians.
const BLUR: f64 = 0.02;

impl Session {
    /// Every light with every reflectance by every technique, and the number of rows taken from earlier
    /// results. Finished rows are saved as they come, so that an interrupted comparison resumes where it
    /// stopped. Errors are not compared with the tolerance yet: [`Finding::missed`] does that.
    pub fn findings(
        &mut self,
        request: &Request,
        renderers: &[Renderer],
    ) -> Result<(Vec<Finding>, usize), Error> {
        let o = request;
        let bakes = bakes(o, self)?;
        if !bakes.is_empty() && (!o.lights.is_empty() || o.local.is_some()) {
            return Err(Error::usage("`bake`: has its own light; leave `light` and `local` out"));
        }
        let methods = methods(o, &bakes)?;
        let reads = |m: &Method| matches!(m, Method::Technique(t) if t.reads_transfer(&o.params));
        if o.transfer.is_some() && (is_scene_file(&o.model) || !methods.iter().any(reads)) {
            let why = "belongs to a mesh, and to a technique that takes it, such as prt_diffuse";
            return Err(Error::usage(format!("`transfer`: {why}")));
        }
        if o.plan.paths {
            // Suns are shaded exactly under techniques with self-shadowing, and shadowed by rays, as paths
            // are.
            self.suns = Suns::Exact;
        } else if !matches!(self.shadows, Shadows::Auto | Shadows::Off | Shadows::Lobe) {
            let why = "the reference has no shadows: add `path`, or give lobe, which shadows both";
            return Err(Error::usage(format!("`shadows`: {why}")));
        }
        let cases = if is_scene_file(&o.model) {
            scenes(o, &methods, self)?
        } else {
            meshes(o, &bakes, &methods, self)?
        };
        let field = o.probes.as_deref().map(|path| self.probes(path)).transpose()?.map(Arc::new);
        self.check()?;
        let mut kept = o.results.as_deref().map(|path| Kept::open(path, o.pictured)).transpose()?;
        let (mut findings, mut reused) = (Vec::new(), 0);
        for Case { environment, brdf, base, value, mark, mut scene } in cases {
            scene.probes = field.clone().or(scene.probes);
            let keys = keys(o, self, &mark, &methods, renderers);
            if let Some(answers) = kept.as_ref().and_then(|k| k.row(&keys)) {
                findings.push(Finding { environment, brdf, base, value, answers });
                reused += 1;
                continue;
            }
            scene.settings = Settings::new(o.size[0], o.size[1]);
            scene.tone_mapper = o.tone_mapper;
            scene.tolerance = o.tolerance;
            if scene.mesh.bounds().is_none() {
                return Err(Error::input(format!("{}: has no triangles", o.model)));
            }
            let framed = || scene.framed(FOV, Vec3::Y);
            scene.camera = Some(scene.camera.map_or_else(framed, Ok)?);
            // All findings, earlier results included, are compared with the tolerance at the end.
            let (answers, _) = self.compare(&scene, &methods, renderers, &o.plan)?.even_if_missed();
            let finding = Finding { environment, brdf, base, value, answers };
            if let Some(kept) = &mut kept {
                kept.add(&finding, &keys)?;
            }
            findings.push(finding);
        }
        Ok((findings, reused))
    }
}

/// The keys of a row's results: the reference's, then each method's on each renderer.
fn keys(
    o: &Request,
    session: &Session,
    mark: &str,
    methods: &[Method],
    renderers: &[Renderer],
) -> Vec<String> {
    let number = |v: Option<f64>| v.map_or_else(|| "-".into(), |v| v.to_string());
    let common = [
        env!("CARGO_PKG_VERSION").to_string(),
        file_mark(&o.model),
        mark.into(),
        format!("{:?}", o.adjust),
        format!("{:?} {:?} {:?}", o.params, o.lights, o.local.as_ref().map(|l| l.as_ref().map(local_mark))),
        // Files as they are.
        o.params.0.values().map(|value| file_mark(&value.to_string())).collect(),
        [&o.probes, &o.transfer]
            .into_iter()
            .flatten()
            .map(|path| file_mark(&path.display().to_string()))
            .collect(),
        format!("{}x{}", o.size[0], o.size[1]),
        format!("{:?} {} {:?}", o.plan, number(o.tolerance), session.paths),
        format!("{:?}", session.shadows),
        o.tone_mapper.name().into(),
    ];
    let one = |label: String, backend: &str| digest(&[&common[..], &[label, backend.into()]].concat());
    let file = |m: &Method| match m {
        Method::File(f) => file_mark(&f.path.display().to_string()),
        _ => m.label(),
    };
    let answers = methods.iter().flat_map(|m| renderers.iter().map(move |r| (file(m), r.name())));
    let reference = (Method::Reference.label(), Renderer::Cpu.name());
    [reference].into_iter().chain(answers).map(|(label, backend)| one(label, backend)).collect()
}

/// A technique for directional and point lights with its files as they are.
fn local_mark(local: &Local) -> String {
    let files: Vec<String> = local.inputs().map(|path| file_mark(&path.display().to_string())).collect();
    format!("{} {files:?}", local.label())
}

/// The saved bakes, which are of one light.
fn bakes(o: &Request, session: &mut Session) -> Result<Vec<Arc<SavedBake>>, Error> {
    let mut out: Vec<Arc<SavedBake>> = Vec::new();
    let adjust = &o.adjust;
    for path in &o.bakes {
        let file = session.saved_bake(path, adjust)?;
        if let Some(first) = out.first()
            && (light_as_baked(first, adjust).rotate, first.made.exposure)
                != (light_as_baked(&file, adjust).rotate, file.made.exposure)
        {
            let why = "its light was turned or scaled otherwise than that of the first `bake`";
            return Err(Error::usage(format!("{}: {why}", path.display())));
        }
        out.push(Arc::new(file));
    }
    if out.is_empty() {
        return Ok(out);
    }
    if o.environments.len() > 1 || o.brdfs.len() > 1 {
        return Err(Error::usage("`bake`: is of one light and one reflectance; give each once at most"));
    }
    Ok(out)
}

/// Methods that are compared with the reference.
fn methods(o: &Request, bakes: &[Arc<SavedBake>]) -> Result<Vec<Method>, Error> {
    let slugs: Vec<&str> = if o.techniques.is_empty() && bakes.is_empty() {
        Method::slugs()
    } else {
        o.techniques.iter().map(String::as_str).collect()
    };
    let all =
        slugs.into_iter().map(Method::find).filter(|m| !matches!(m, Ok(Method::Reference | Method::Path)));
    let mut out: Vec<Method> = all.collect::<Result<_, _>>()?;
    let swept = o.sweep.iter().filter(|s| s.of == Swept::Param).map(|s| &s.key);
    for name in o.params.0.keys().chain(swept) {
        let has = |m: &Method| matches!(m, Method::Technique(t) if t.params().iter().any(|p| p.name == name));
        if !out.iter().any(has) {
            return Err(Error::usage(format!("`param` {name}: no technique that is compared has it")));
        }
    }
    out.extend(bakes.iter().cloned().map(Method::File));
    Ok(out)
}

/// One row of a comparison.
struct Case {
    environment: String,
    brdf: String,
    base: String,
    value: Option<f64>,
    /// Light and materials with the contents of their files.
    mark: String,
    scene: Scene,
}

/// Materials of a mesh.
struct MeshMaterials {
    name: String,
    base: String,
    value: Option<f64>,
    mark: String,
    materials: Vec<Material>,
}

/// The specs that a sweep makes of one, each with its value and the parameters of the techniques.
fn swept(o: &Request, spec: &str) -> Result<Vec<(String, Option<f64>, ParamValues)>, Error> {
    let params = o.params.clone();
    let Some(sweep) = &o.sweep else { return Ok(vec![(spec.into(), None, params)]) };
    let one = |value: f64| match sweep.of {
        Swept::Brdf => (sweep.spec(spec, value), Some(value), params.clone()),
        Swept::Param => {
            let mut params = params.clone();
            params.0.insert(sweep.key.clone(), value.into());
            (spec.to_string(), Some(value), params)
        }
    };
    Ok(sweep.values.iter().map(|v| one(*v)).collect())
}

fn given<'a>(list: &'a [String], default: &[&'a str]) -> Vec<&'a str> {
    if list.is_empty() { default.to_vec() } else { list.iter().map(String::as_str).collect() }
}

/// A mesh or shape: every light with every reflectance, which the base colours of the mesh file multiply;
/// without a reflectance the file's own materials.
fn meshes(
    o: &Request,
    bakes: &[Arc<SavedBake>],
    methods: &[Method],
    session: &mut Session,
) -> Result<Vec<Case>, Error> {
    let mut model = session.model(&o.model)?;
    if o.sweep.is_some() && (o.brdfs.is_empty() || !bakes.is_empty()) {
        return Err(Error::usage(
            "`sweep` varies a reflectance or its techniques: give `brdf`, and no `bake`",
        ));
    }
    let local = opened(o.local.as_ref(), session)?.flatten();
    if let Some(local) = &local {
        local.check_mesh(&model.mesh, false, &o.model)?;
    }
    if local.as_ref().is_some_and(|l| l.is_textured(false)) {
        make_tangents(std::slice::from_mut(&mut model.mesh));
    }
    let usual = Material { local, ..Material::new(session.brdf("lambert")?) };
    let mut sets: Vec<MeshMaterials> = Vec::new();
    if o.brdfs.is_empty() && !model.materials.is_empty() {
        let usual = Material { params: o.params.clone(), ..usual };
        let materials = materials(&model, None, None, &usual, session)?;
        let name = String::from("the file's materials");
        sets.push(MeshMaterials { base: name.clone(), value: None, mark: name.clone(), name, materials });
    } else {
        let specs: Vec<String> = match bakes.first() {
            Some(file) if o.brdfs.is_empty() => vec![baked_brdf(file)?.0.into()],
            _ => given(&o.brdfs, &["lambert:albedo=0.6", "ggx:alpha=0.2"])
                .into_iter()
                .map(String::from)
                .collect(),
        };
        for base in &specs {
            for (spec, value, params) in swept(o, base)? {
                let brdf = match bakes.first() {
                    Some(file) if o.brdfs.is_empty() => baked_brdf(file)?.1,
                    _ => session.brdf(&spec)?,
                };
                bakes.iter().for_each(|file| session.tell_other_brdf(file, &brdf.spec()));
                let usual = Material { params, ..usual.clone() };
                let materials = materials(&model, Some(brdf), None, &usual, session)?;
                let mut name = short(&spec);
                if let (Some(s), Some(v)) = (o.sweep.as_ref().filter(|s| s.of == Swept::Param), value) {
                    name += &format!(" [{}={v}]", s.key);
                }
                let mark = format!("{} {name}", file_mark(&spec));
                sets.push(MeshMaterials { name, base: short(base), value, mark, materials });
            }
        }
    }
    for m in sets.iter_mut().flat_map(|s| &mut s.materials) {
        *m = session.open_compared(m.clone(), methods, None)?;
        if !m.planes.is_empty() {
            let mesh = &mut model.mesh;
            if mesh.uvs.len() != mesh.positions.len() {
                let why = "has no texture coordinates, which the images of `param` need";
                return Err(Error::usage(format!("{}: {why}", o.model)));
            }
            make_tangents(std::slice::from_mut(mesh));
        }
    }
    let transfer =
        o.transfer.as_deref().map(|path| session.transfer_of(path, &model.mesh, "vertices")).transpose()?;
    let mut out = Vec::new();
    let sky = bakes.first().map_or(DEFAULT_SKY, |b| &b.made.environment);
    let none = !o.lights.is_empty() && o.environments.is_empty() && bakes.is_empty();
    for environment in given(&o.environments, &[if none { NO_ENVIRONMENT } else { sky }]) {
        let mut lights = match bakes.first() {
            Some(file) => {
                bakes.iter().skip(1).for_each(|other| session.tell_other_light(other, environment));
                baked_light(file, o, session)?
            }
            None if none => Lights::default(),
            None => session.light(environment, &o.adjust)?,
        };
        o.lights.iter().for_each(|l| l.join(&mut lights));
        for set in &sets {
            let mut scene = Scene::new(model.mesh.clone(), set.materials.clone(), lights.clone());
            scene.background = SceneBackground::Environment(BLUR);
            scene.transfer.clone_from(&transfer);
            out.push(Case {
                environment: short(environment),
                brdf: set.name.clone(),
                base: set.base.clone(),
                value: set.value,
                mark: format!("{} {}", file_mark(environment), set.mark),
                scene,
            });
        }
    }
    Ok(out)
}

/// The reflectance that a bake names.
fn baked_brdf(file: &SavedBake) -> Result<(&str, SharedBrdf), Error> {
    let spec = &file.made.brdf;
    file.brdf().map(|brdf| (spec.as_str(), brdf)).ok_or_else(|| {
        Error::usage(format!("{}: was baked of {spec}: name it with `brdf`", file.path.display()))
    })
}

/// The light of a bake.
fn baked_light(file: &SavedBake, o: &Request, session: &mut Session) -> Result<Lights, Error> {
    let given = o.environments.first().map(String::as_str);
    session.light_of_bake(file, given, &o.adjust)?.ok_or_else(|| {
        let (name, light) = (file.path.display(), &file.made.environment);
        Error::usage(format!("{name}: was baked from {light}: name it with `environment`"))
    })
}

/// A scene file, under its own light or those of the command line.
fn scenes(o: &Request, methods: &[Method], session: &mut Session) -> Result<Vec<Case>, Error> {
    if o.sweep.is_some() || o.results.is_some() {
        // Files that a scene file refers to are not part of its digest.
        return Err(Error::usage("`sweep` and `resume` belong to a mesh or shape, not to a scene file"));
    }
    if !(o.brdfs.is_empty() && o.bakes.is_empty()) {
        let why = "`brdf` and `bake` belong to a mesh; a scene file has materials";
        return Err(Error::usage(why));
    }
    let lights =
        if o.environments.is_empty() { vec![None] } else { o.environments.iter().map(Some).collect() };
    let mut out = Vec::new();
    for environment in lights {
        let overrides = SceneOverrides {
            environment: environment.cloned(),
            adjust: o.adjust.clone(),
            method: None,
            local: opened(o.local.as_ref(), session)?,
        };
        let mut scene = session.scene_file(Path::new(&o.model), &overrides)?;
        o.lights.iter().for_each(|l| l.join(&mut scene.lights));
        if let SceneBackground::Environment(blur) = &mut scene.background {
            *blur = blur.max(BLUR);
        }
        for m in scene.materials.iter_mut().chain(&mut scene.ground) {
            let params = o.params.clone();
            let named = Material { params: params.clone(), ..m.clone() };
            m.planes = session.open_compared(named, methods, None)?.planes;
            m.params.0.extend(params.0);
        }
        let light = environment.map_or_else(|| "the scene's light".into(), |e| short(e));
        let brdf = short(&o.model);
        let (base, mark) = (brdf.clone(), String::new());
        out.push(Case { environment: light, brdf, base, value: None, mark, scene });
    }
    Ok(out)
}

/// A spec or a file's name without its folders.
pub fn short(spec: &str) -> String {
    let (head, tail) = spec.split_once(':').unwrap_or(("", spec));
    let name = if tail.contains(['=', ',']) && !Path::new(spec).exists() {
        tail.to_string()
    } else {
        Path::new(tail).file_name().map_or_else(|| tail.into(), |n| n.to_string_lossy().into_owned())
    };
    if head.is_empty() || head.contains(['/', '\\']) { name } else { format!("{head}:{name}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sweep_is_a_row_for_each_value() {
        let request = Request {
            environments: vec!["overcast".into()],
            brdfs: vec!["lambert".into()],
            techniques: vec!["sh_irradiance".into()],
            sweep: Some(Sweep::parse("brdf:albedo=0.2..0.8:2").expect("a sweep")),
            size: [12; 2],
            ..Request::default()
        };
        let mut session = Session::new();
        let (rows, earlier) = session.findings(&request, &[Renderer::Cpu]).expect("compared");
        assert_eq!((rows.len(), earlier), (2, 0));
        for (row, value) in rows.iter().zip([0.2, 0.8]) {
            assert_eq!((row.value, row.answers.len()), (Some(value), 2));
            assert_eq!(
                (row.base.as_str(), row.brdf.as_str()),
                ("lambert", format!("lambert:albedo={value}").as_str())
            );
            assert!(row.answers[1].error().is_some_and(|e| e < 0.02), "{:?}", row.answers[1].error());
        }
        let nothing = Request { sweep: None, bakes: vec!["none.safetensors".into()], ..request };
        assert!(session.findings(&nothing, &[Renderer::Cpu]).is_err());
    }

    #[test]
    fn names_lose_folders() {
        assert_eq!(short("/a/b/c.hdr"), "c.hdr");
        assert_eq!(short("merl:/a/b.binary"), "merl:b.binary");
        assert_eq!(short("ggx:alpha=0.1,f0=1/0.8/0.3"), "ggx:alpha=0.1,f0=1/0.8/0.3");
    }
}
