//! The scene that the options describe.

use super::{Exposure, Options};
use crate::context::Context;
use crate::failure::Failure;
use crate::inputs;
use glam::Vec3;
use steradian_session::{
    CameraRequest, GroundRequest, Method, Scene, SceneRequest, SurfaceRequest, is_scene_file,
};

/// Loads the scene, and tells the session how its lights are shaded.
pub fn scene(o: &Options, context: &mut Context) -> Result<Scene, Failure> {
    context.suns = o.lights.suns();
    context.shadows = o.shadows.shadows.unwrap_or_default();
    Ok(context.scene(&request(o)?)?)
}

fn request(o: &Options) -> Result<SceneRequest, Failure> {
    let vector = |v: Option<[f64; 3]>| v.map(|v| Vec3::from(v.map(|c| c as f32)));
    let surface = SurfaceRequest {
        brdf: o.brdf.clone(),
        params: inputs::parameters(&o.params)?,
        bake: o.bake.clone(),
        transfer: o.transfer.clone(),
        base_colour: o.base_color_texture.clone(),
        normal_map: o.normal_map.clone().map(|path| (path, o.normal_scale.unwrap_or(1.0) as f32)),
        roughness_map: o.roughness_map.clone(),
        plain: o.plain,
        translate: vector(o.translate),
    };
    // What follows the library says too, in words of its own: here are the options to change.
    if is_scene_file(&o.input) && surface != SurfaceRequest::default() {
        let why = "--brdf, --bake, --transfer, --base-color-texture, --normal-map, --roughness-map, --plain, --translate and --param belong \
                   to a mesh; a scene file has materials";
        return Err(Failure::usage(why));
    }
    if o.technique.is_none() && !o.params.is_empty() {
        return Err(Failure::usage("--param belongs to a technique: name it with --technique"));
    }
    let ground = |brdf: &String| GroundRequest { brdf: brdf.clone(), technique: o.ground_technique.clone() };
    let exposure = |e: Exposure| match e {
        Exposure::Ev(ev) => Some(ev),
        Exposure::Auto => None,
    };
    Ok(SceneRequest {
        input: o.input.clone(),
        surface,
        method: o.technique.as_deref().map(Method::find).transpose()?,
        local: o.local.get()?,
        environment: o.environment.clone(),
        adjust: o.adjust.get(),
        sun_lights: o.lights.sun_lights.clone(),
        lamps: o.lights.light.clone(),
        probes: o.probes.clone(),
        ground: o.ground.as_ref().map(ground),
        camera: CameraRequest {
            from: vector(o.from),
            at: vector(o.at),
            up: vector(o.up),
            fov: o.fov.map(|d| d as f32),
        },
        size: o.size,
        samples: o.samples.map(usize::from),
        exposure: o.exposure.map(exposure),
        tone_mapper: o.tone_mapper,
        background: o.background,
        blur: o.blur,
        normal_filtering: o.normal_filtering,
        tolerance: o.tolerance,
    })
}
