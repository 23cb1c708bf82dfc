//! The scene that the options describe.

use super::{Exposure, Options};
use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs;
use glam::{Affine3A, Vec3};
use std::path::Path;
use std::sync::Arc;
use steradian_base::{ParamValues, split_spec};
use steradian_light::Lights;
use steradian_render::SurfaceMaps;
use steradian_render::scenefile::SceneBackground;
use steradian_scene::{Camera, Mesh};
use steradian_session::{
    DEFAULT_SKY, FOV, Local, Material, Method, Model, Scene, SceneOverrides, make_tangents,
};
use steradian_techniques::SavedBake;

pub fn scene(o: &Options, context: &mut Context) -> Result<Scene, Failure> {
    context.suns = o.lights.suns();
    context.shadows = o.shadows.shadows.unwrap_or_default();
    let mut scene = if Path::new(&o.input).extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        let overrides = overrides(o, context)?;
        context.scene_file(Path::new(&o.input), &overrides)?
    } else {
        bare(o, context)?
    };
    if let Some((w, h)) = o.size {
        (scene.settings.width, scene.settings.height) = (w, h);
    }
    if let Some(n) = o.samples {
        scene.settings.edge = usize::from(n);
        scene.settings.inner = scene.settings.inner.min(usize::from(n));
    }
    match o.exposure {
        Some(Exposure::Ev(ev)) => scene.exposure = Some(ev),
        Some(Exposure::Auto) => scene.exposure = None,
        None => {}
    }
    scene.tone_mapper = o.tone_mapper.unwrap_or(scene.tone_mapper);
    scene.background = o.background.unwrap_or(scene.background);
    if let (Some(blur), SceneBackground::Environment(b)) = (o.blur, &mut scene.background) {
        *b = blur.to_radians();
    }
    o.lights.join(&mut scene.lights, &o.adjust.get(), context)?;
    let local = scene.materials.iter().find_map(|m| m.local.as_ref());
    if let Some(local) =
        local.filter(|_| scene.lights.directionals.is_empty() && scene.lights.points.is_empty())
    {
        let name = local.technique.card().slug;
        let what = if local.has_bumps() { "gives its normals alone" } else { "has nothing to shade" };
        context.say(format_args!("no directional and no point light: {name} {what} (--light)"));
    }
    scene.tolerance = o.tolerance;
    if let Some(path) = &o.probes {
        let field = context.probes(path)?;
        scene.probes = Some(Arc::new(field));
    }
    if let Some(filtering) = o.normal_filtering {
        scene.materials.iter_mut().for_each(|m| m.maps.filtering = filtering);
    }
    camera(o, &mut scene)?;
    if let Some(spec) = &o.ground {
        scene.ground = Some(ground(o, spec, context)?);
    }
    Ok(scene)
}

/// The technique of the mesh shades the ground too where it takes its reflectance; else one is chosen.
fn ground(o: &Options, spec: &str, context: &mut Context) -> Result<Material, Failure> {
    let brdf = context.brdf(spec)?;
    if let Some(spec) = &o.ground_technique {
        let (name, body) = split_spec(spec);
        let method = Method::find(name)?;
        let Method::Technique(t) = method else {
            return Err(Failure::usage(format!("--ground-technique: {name} shades all of a scene, or none")));
        };
        if let Err(why) = (t.card().materials)(&*brdf) {
            return Err(Failure::usage(format!("--ground-technique: {name} {why}")));
        }
        let params = ParamValues::parse(body, t.params())
            .map_err(|e| Failure::usage(format!("--ground-technique: {e}")))?;
        return Ok(Material { method: Some(method), params, ..Material::new(brdf) });
    }
    let named = o.technique.as_deref().map(Method::find).transpose()?;
    let method = named.filter(|m| match m {
        Method::Technique(t) => (t.card().materials)(&*brdf).is_ok(),
        _ => true,
    });
    let asked = o.local.get()?.flatten();
    let taken = |l: &Local| (l.technique.card().materials)(&*brdf).is_ok() && !l.is_textured(false);
    let local = asked.clone().filter(taken);
    if let (Some(l), None) = (&asked, &local) {
        let name = l.technique.card().slug;
        let why =
            if l.is_textured(false) { "its files belong to the mesh" } else { "of another reflectance" };
        context
            .say(format_args!("ground: not by {name} ({why}): directional and point lights are exact there"));
    }
    Ok(Material { method, local, ..Material::new(brdf) })
}

/// What the command line changes in a scene file.
fn overrides(o: &Options, context: &mut Context) -> Result<SceneOverrides, Failure> {
    let maps = [&o.base_color_texture, &o.normal_map, &o.roughness_map].iter().any(|m| m.is_some());
    if o.brdf.is_some()
        || o.bake.is_some()
        || o.transfer.is_some()
        || maps
        || o.plain
        || o.translate.is_some()
        || !o.params.is_empty()
    {
        let why = "--brdf, --bake, --transfer, --base-color-texture, --normal-map, --roughness-map, --plain, --translate and --param belong \
                   to a mesh; a scene file has materials";
        return Err(Failure::usage(why));
    }
    let method = o.technique.as_deref().map(Method::find).transpose()?;
    let local = o.local.open(context)?;
    Ok(SceneOverrides { environment: o.environment.clone(), adjust: o.adjust.get(), method, local })
}

/// A mesh or shape with the material of the command line, of its file, or of clay.
fn bare(o: &Options, context: &mut Context) -> Result<Scene, Failure> {
    if o.technique.is_none() && !o.params.is_empty() {
        return Err(Failure::usage("--param belongs to a technique: name it with --technique"));
    }
    let params = inputs::parameters(&o.params)?;
    let local = o.local.open(context)?.flatten();
    let file = o.bake.as_deref().map(|p| saved_bake(p, o, context)).transpose()?;
    let method = match &file {
        Some(file) => Some(Method::File(file.clone())),
        None => o.technique.as_deref().map(Method::find).transpose()?,
    };
    let given = match (&file, &o.brdf) {
        // Of no part in shading: what the bake was made of, in name.
        (Some(file), _) => Some(file.brdf().map_or_else(|| context.brdf("lambert"), Ok)?),
        (None, spec) => spec.as_deref().map(|spec| context.brdf(spec)).transpose()?,
    };
    let texture = o.base_color_texture.as_deref().map(|p| context.texture(p)).transpose()?;
    let mut model = context.model(&o.input)?;
    if texture.is_some() && model.mesh.uvs.is_empty() {
        let why = format!("{}: has no texture coordinates for --base-color-texture", o.input);
        return Err(Failure::usage(why));
    }
    let given_maps = maps(o, &model.mesh, context)?;
    let usual =
        Material { method, params, local, maps: given_maps, ..Material::new(context.brdf("lambert")?) };
    let usual = context.open_material(usual, None)?;
    usual.check_mesh(&model.mesh, &o.input)?;
    if usual.maps.normal.is_some() || usual.is_textured() {
        make_tangents(std::slice::from_mut(&mut model.mesh));
    }
    if o.plain {
        model.materials.clear();
        model.mesh.materials.clear();
    }
    if let Some(by) = o.translate {
        let by = Affine3A::from_translation(Vec3::from(by.map(|x| x as f32)));
        model.mesh = model.mesh.transformed(&by);
    }
    let known = o.transfer.as_deref().map(|path| context.transfer_of(path, &model.mesh)).transpose()?;
    let lights = lights(o, file.as_deref(), context)?;
    let material = |brdf, base_colour, file: SurfaceMaps| {
        let maps = SurfaceMaps {
            normal: usual.maps.normal.clone().or(file.normal),
            alpha2: usual.maps.alpha2.clone().or(file.alpha2),
            ..file
        };
        Material { brdf, base_colour, maps, ..usual.clone() }
    };
    let mut materials = Vec::new();
    for m in &model.materials {
        let brdf = match &given {
            Some(brdf) => brdf.clone(),
            None => m.brdf()?,
        };
        let base_colour = texture.clone().or_else(|| m.tint(given.is_none()));
        materials.push(material(brdf, base_colour, m.maps(given.is_none())));
    }
    if materials.is_empty() {
        let usual = if texture.is_some() { "lambert" } else { "lambert:albedo=0.6" };
        let brdf = given.clone().map_or_else(|| context.brdf(usual), Ok)?;
        materials.push(material(brdf, texture.clone(), SurfaceMaps::default()));
    }
    say_materials(o, &model, given.is_some(), texture.is_some(), context);
    Ok(Scene { transfer: known, ..Scene::new(model.mesh, materials, lights) })
}

/// A saved bake for a picture.
fn saved_bake(path: &Path, o: &Options, context: &mut Context) -> Result<Arc<SavedBake>, Failure> {
    Ok(Arc::new(context.saved_bake(path, &o.adjust.get())?))
}

/// The lights of a mesh; with a saved bake what is seen of them.
fn lights(o: &Options, file: Option<&SavedBake>, context: &mut Context) -> Result<Lights, Failure> {
    let adjust = o.adjust.get();
    match (&o.environment, file) {
        (spec, Some(file)) => {
            let seen = context.light_of_bake(file, spec.as_deref(), &adjust)?;
            if seen.is_none() && o.background.is_none() {
                let light = &file.made.environment;
                context.say(format_args!("nothing is seen behind: --environment {light} would be"));
            }
            Ok(seen.unwrap_or_default())
        }
        (Some(spec), None) => Ok(context.light(spec, &adjust)?),
        (None, None) if o.lights.is_some() || o.probes.is_some() => Ok(Lights::default()),
        (None, None) => Ok(context.light(DEFAULT_SKY, &adjust)?),
    }
}

/// The maps of the command line.
fn maps(o: &Options, mesh: &Mesh, context: &mut Context) -> Result<SurfaceMaps, Failure> {
    let mut out = SurfaceMaps::default();
    for (name, option) in [(&o.normal_map, "--normal-map"), (&o.roughness_map, "--roughness-map")] {
        if name.is_some() && mesh.uvs.is_empty() {
            let why = format!("{}: has no texture coordinates for {option}", o.input);
            return Err(Failure::usage(why));
        }
    }
    if let Some(path) = &o.normal_map {
        out.normal = context.normal_map(path, o.normal_scale.unwrap_or(1.0) as f32)?.normal;
    }
    if let Some(path) = &o.roughness_map {
        out.alpha2 = context.roughness_map(path)?.alpha2;
    }
    Ok(out)
}

/// Says what of the file's materials is used; of many, the first ones.
fn say_materials(o: &Options, model: &Model, given: bool, texture: bool, context: &Context) {
    const LINES: usize = 4;
    if given {
        let own = model.materials.iter().filter(|m| m.base_colour.is_some()).count();
        if own > 0 && !texture {
            context.say(format_args!(
                "{}: base colours of {own} materials multiply --brdf (--plain leaves them out)",
                o.input
            ));
        }
        return;
    }
    model
        .materials
        .iter()
        .take(LINES)
        .for_each(|m| context.say(format_args!("{}: {}", o.input, m.assumed())));
    if let Some(more @ 1..) = model.materials.len().checked_sub(LINES) {
        context.say(format_args!("{}: and {more} more materials", o.input));
    }
}

fn camera(o: &Options, scene: &mut Scene) -> Outcome {
    if scene.mesh.bounds().is_none() {
        return Err(Failure::input(format!("{}: has no triangles", o.input)));
    }
    let fov = o.fov.map(|d| d as f32);
    if o.up.is_some_and(|v| v == [0.0; 3]) {
        return Err(Failure::usage("--up must not be zero"));
    }
    if fov.is_some_and(|f| f >= 180.0) {
        return Err(Failure::usage("--fov must be below 180 degrees"));
    }
    let vector = |v: [f64; 3]| Vec3::from(v.map(|c| c as f32));
    let framed = || scene.framed(fov.unwrap_or(FOV), o.up.map_or(Vec3::Y, vector));
    scene.camera = Some(match scene.camera.map_or_else(framed, Ok)? {
        Camera::Pinhole { from, at, up, fov_y } => Camera::Pinhole {
            from: o.from.map_or(from, vector),
            at: o.at.map_or(at, vector),
            up: o.up.map_or(up, vector),
            fov_y: fov.map_or(fov_y, f32::to_radians),
        },
        Camera::Orthographic { from, at, up, height } => Camera::Orthographic {
            from: o.from.map_or(from, vector),
            at: o.at.map_or(at, vector),
            up: o.up.map_or(up, vector),
            height,
        },
    });
    Ok(())
}
