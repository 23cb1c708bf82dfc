//! Saved bakes in use: their lights, and what they are shaded with.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, Adjust};
use std::path::Path;
use steradian_light::Lights;
use steradian_techniques::SavedBake;

/// Reads `path`, a `.safetensors` file or a folder that holds one. Its light turns by what `adjust` says.
pub fn read(path: &Path, adjust: &Adjust, context: &mut Context) -> Result<SavedBake, Failure> {
    if adjust.light_exposure != 0.0 {
        return Err(Failure::usage("--light-exposure: a bake holds its light as it was scaled; bake again"));
    }
    let mut file = SavedBake::read(path, &context.limits())?;
    context.note_input(&file.path);
    file.turn = adjust.rotation().as_mat3();
    Ok(file)
}

/// Refuses data per vertex, which need the mesh that they were baked on.
pub fn for_any_mesh(file: &SavedBake) -> Outcome {
    if file.technique.card().needs.sites {
        let why = "holds data for the vertices of one mesh, which is not shaded here yet";
        return Err(Failure::usage(format!("{}: {why}", file.path.display())));
    }
    Ok(())
}

/// How a light is turned and scaled to be that of the bake, turned as `given` says.
pub fn adjust(file: &SavedBake, given: &Adjust) -> Adjust {
    let (rotate, light_exposure) = (file.made.rotate + given.rotate, file.made.exposure);
    Adjust { rotate, light_exposure, ..given.clone() }
}

/// The light of the bake, to be seen or compared with: `environment`, else the sky that the file names. A file that
/// is not the one that was baked is warned about.
pub fn lights(
    file: &SavedBake,
    environment: Option<&str>,
    given: &Adjust,
    context: &mut Context,
) -> Result<Option<Lights>, Failure> {
    let named = Some(&*file.made.environment).filter(|e| inputs::is_sky(e));
    let Some(spec) = environment.or(named) else { return Ok(None) };
    warn_of_another(file, spec, context);
    inputs::light(spec, &adjust(file, given), context).map(Some)
}

/// Warns where `spec` is not the light that was baked.
pub fn warn_of_another(file: &SavedBake, spec: &str, context: &Context) {
    if !file.was_made_of(spec) {
        let (name, light) = (file.path.display(), &file.made.environment);
        context.warn(format_args!("{spec}: {name} was baked from another light, {light}"));
    }
}

/// Warns where `spec`, a reflectance's canonical one, is not what was baked.
pub fn warn_of_another_brdf(file: &SavedBake, spec: &str, context: &Context) {
    if file.is_of_another_brdf(spec) {
        let (name, brdf) = (file.path.display(), &file.made.brdf);
        context.warn(format_args!("{spec}: {name} was baked of another reflectance, {brdf}"));
    }
}
