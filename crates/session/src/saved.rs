//! Shading with saved bakes: their lights and reflectances.

use crate::{Adjust, Error, Notice, Session, is_sky};
use std::path::Path;
use steradian_light::Lights;
use steradian_scene::Mesh;
use steradian_techniques::{AnyBake, SavedBake};
use steradian_transfer::mesh_digest;

impl Session {
    /// Reads a saved bake, a `.safetensors` file or a folder that holds one. Its light is rotated as `adjust`
    /// says.
    pub fn saved_bake(&mut self, path: &Path, adjust: &Adjust) -> Result<SavedBake, Error> {
        if adjust.light_exposure != 0.0 {
            return Err(Error::usage(
                "`light-exposure`: a bake holds its light as it was scaled; bake again",
            ));
        }
        let mut file = SavedBake::read(path, &self.limits())?;
        self.note_input(&file.path);
        file.turn = adjust.rotation().as_mat3();
        Ok(file)
    }

    /// The light of a saved bake, for viewing or comparison: `environment`, else the sky that the file names.
    /// Warns where it is not the light that was baked.
    pub fn light_of_bake(
        &mut self,
        file: &SavedBake,
        environment: Option<&str>,
        given: &Adjust,
    ) -> Result<Option<Lights>, Error> {
        let named = Some(&*file.made.environment).filter(|e| is_sky(e));
        let Some(spec) = environment.or(named) else { return Ok(None) };
        self.tell_other_light(file, spec);
        self.light(spec, &light_as_baked(file, given)).map(Some)
    }

    /// Warns where `spec` is not the light that was baked.
    pub fn tell_other_light(&self, file: &SavedBake, spec: &str) {
        if !file.was_made_of(spec) {
            self.tell_not_baked(file, spec, "from another light", &file.made.environment);
        }
    }

    /// Reports where `spec`, a reflectance's canonical spec, is not the one that was baked.
    pub fn tell_other_brdf(&self, file: &SavedBake, spec: &str) {
        if file.is_of_another_brdf(spec) {
            self.tell_not_baked(file, spec, "of another reflectance", &file.made.brdf);
        }
    }

    fn tell_not_baked(&self, file: &SavedBake, given: &str, of: &'static str, baked: &str) {
        let (given, bake, baked) = (given.into(), file.path.display().to_string(), baked.into());
        self.tell(Notice::NotBaked { given, bake, of, baked });
    }
}

/// Refuses data for the vertices of another mesh than the one that `mesh` begins with (behind it may stand a
/// ground).
pub(crate) fn check_mesh(file: &SavedBake, bake: &dyn AnyBake, mesh: &Mesh) -> Result<(), Error> {
    if !file.technique.needs_sites(&bake.params()) {
        return Ok(());
    }
    let name = file.path.display();
    let Some(own) = &file.made.mesh else {
        return Err(Error::input(format!("{name}: does not say which mesh it was baked on; bake it again")));
    };
    if own.begins(mesh) {
        return Ok(());
    }
    let other = mesh_digest(mesh);
    let [own, other] = [&own.digest, &other].map(|d| d.chars().take(12).collect::<String>());
    let why = format!("baked on another mesh: its digest is {own}…, that of this mesh {other}…");
    Err(Error::input(format!(
        "{name}: {why}; a mesh that is moved, or refined for other techniques, is another: bake it anew"
    )))
}

/// Refuses data per vertex where no mesh is.
pub(crate) fn for_any_mesh(file: &SavedBake) -> Result<(), Error> {
    if file.technique.needs_sites(&file.open()?.params()) {
        let why = "holds data for the vertices of one mesh: render shades them; at points, give `technique` and `mesh`";
        return Err(Error::usage(format!("{}: {why}", file.path.display())));
    }
    Ok(())
}

/// Rotation and scale that turn a light into that of a saved bake, rotated as `given` says.
pub fn light_as_baked(file: &SavedBake, given: &Adjust) -> Adjust {
    let (rotate, light_exposure) = (file.made.rotate + given.rotate, file.made.exposure);
    Adjust { rotate, light_exposure, ..given.clone() }
}
