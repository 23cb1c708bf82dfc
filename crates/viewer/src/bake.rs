//! From what is wished for to what can be drawn.

use crate::Wish;
use std::path::Path;
use std::sync::Arc;
use steradian_base::{ParamValues, Task};
use steradian_light::Lights;
use steradian_render::ToneMapper;
use steradian_session::live::{Live, Names};
use steradian_session::{
    Adjust, Error, Material, Method, Scene, SceneOverrides, Session, light_as_baked, make_tangents,
};
use steradian_techniques::AnyTechnique;

/// What shades a ground while its shadows are baked.
const OPEN_GROUND: &str = "sh_irradiance";

/// Loads inputs and bakes; what is loaded or baked already stays.
pub struct Baker {
    session: Session,
    /// Geometry and the materials of its file, by what they were loaded for.
    model: Option<(String, Scene)>,
    lights: Option<(String, Lights)>,
    last: Option<Arc<Live>>,
}

impl Baker {
    /// A baker that has nothing yet.
    pub fn new(session: Session) -> Self {
        Self { session, model: None, lights: None, last: None }
    }

    /// What it loads and bakes with.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// What `wish` asks for.
    pub fn bake(&mut self, wish: &Wish, task: Task) -> Result<Arc<Live>, Error> {
        self.session.task = task;
        let (scene, names) = self.scene(wish)?;
        self.finish(&scene, names)
    }

    fn finish(&mut self, scene: &Scene, names: Names) -> Result<Arc<Live>, Error> {
        let live = Arc::new(self.session.live(scene, names, self.last.as_deref())?);
        self.last = Some(live.clone());
        Ok(live)
    }

    /// The same; `preview` gets a coarser one first, or one whose ground has no shadows yet; `None` where
    /// that takes no less than the bake.
    pub fn bake_after(
        &mut self,
        wish: &Wish,
        task: Task,
        preview: impl FnOnce(Option<Arc<Live>>),
    ) -> Result<Arc<Live>, Error> {
        self.session.task = task;
        let (scene, names) = self.scene(wish)?;
        let early = match &self.last {
            Some(last) => self.session.preview(&scene, names.clone(), last)?.map(Arc::new),
            None => None,
        };
        let known = self.last.as_ref().is_some_and(|l| l.has_mesh_of(&scene, &names));
        let early = match wish.ground_technique.is_some() && scene.ground.is_some() && !known {
            true => {
                let open = Wish { ground_technique: Some(OPEN_GROUND.into()), ..wish.clone() };
                let (scene, names) = self.scene(&open)?;
                Some(self.finish(&scene, names)?)
            }
            false => early,
        };
        preview(early);
        self.finish(&scene, names)
    }

    /// The scene of a wish, its light not turned.
    fn scene(&mut self, wish: &Wish) -> Result<(Scene, Names), Error> {
        let named = |t: &Option<String>| t.as_deref().map(Method::find).transpose();
        let of_mesh = format!("{}|{:?}|{:?}", wish.input, wish.normal_map, wish.ground);
        if self.model.as_ref().is_none_or(|(name, _)| *name != of_mesh) {
            self.model = None;
            let scene = if wish.is_scene() {
                self.session.scene_file(Path::new(&wish.input), &SceneOverrides::default())?
            } else {
                self.bare(wish)?
            };
            self.model = Some((of_mesh.clone(), scene));
        }
        let Some((_, model)) = &self.model else { return Err(Error::failed("nothing was loaded")) };
        let mut scene = model.clone();
        let mut method = named(&wish.technique)?;
        // A light beside a saved bake stands as the bake's did.
        let mut adjust = Adjust::default();
        if let Some(path) = &wish.bake {
            let file = self.session.saved_bake(Path::new(path), &Adjust::default())?;
            adjust = light_as_baked(&file, &adjust);
            method = Some(Method::File(Arc::new(file)));
        }
        let mut light_name = format!("of {}", wish.input);
        if let Some(spec) = &wish.light {
            light_name.clone_from(spec);
            if (adjust.rotate, adjust.light_exposure) != (0.0, 0.0) {
                light_name += &format!(" turned by {}, {} EV", adjust.rotate, adjust.light_exposure);
            }
            if self.lights.as_ref().is_none_or(|(name, _)| *name != light_name) {
                self.lights = Some((light_name.clone(), self.session.light(spec, &adjust)?));
            }
            if let Some((_, lights)) = &self.lights {
                // Points belong to the scene's places, not to its surroundings.
                scene.lights = Lights { points: std::mem::take(&mut scene.lights.points), ..lights.clone() };
                scene.probes = None;
            }
        }
        let brdf = wish.brdf.as_deref().map(|spec| self.session.brdf(spec)).transpose()?;
        for m in &mut scene.materials {
            if let Some(brdf) = &brdf {
                m.brdf = brdf.clone();
            }
            by(m, method.as_ref(), &wish.params)?;
        }
        if let Some(m) = &mut scene.ground {
            let own = named(&wish.ground_technique)?.filter(|_| !wish.is_scene());
            let method = own.as_ref().or(method.as_ref().filter(|m| !matches!(m, Method::File(_))));
            by(m, method, &wish.params)?;
        }
        if let (Some(Method::Technique(t)), false) =
            (&method, scene.materials.iter().any(|m| m.method.is_some()))
        {
            return Err(Error::usage(refusal(*t, &scene)));
        }
        scene.tone_mapper = ToneMapper::from_name(&wish.tone_mapper).unwrap_or_default();
        scene.exposure = wish.exposure;
        Ok((scene, Names { mesh: of_mesh, light: light_name }))
    }

    /// A mesh or shape, its maps and its ground.
    fn bare(&mut self, wish: &Wish) -> Result<Scene, Error> {
        // The light is replaced; one that takes no time stands in.
        const NO_LIGHT: &str = "furnace";
        let mut scene = Scene::of(&wish.input, None, NO_LIGHT, &mut self.session)?;
        if scene.mesh.bounds().is_none() {
            return Err(Error::input(format!("{}: has no triangles", wish.input)));
        }
        if let Some(path) = &wish.normal_map {
            if scene.mesh.uvs.is_empty() {
                let why = "has no texture coordinates for a normal map";
                return Err(Error::usage(format!("{}: {why}", wish.input)));
            }
            let normal = self.session.normal_map(Path::new(path), 1.0)?.normal;
            make_tangents(std::slice::from_mut(&mut scene.mesh));
            scene.materials.iter_mut().for_each(|m| m.maps.normal.clone_from(&normal));
        }
        if let Some(spec) = &wish.ground {
            scene.ground = Some(Material::new(self.session.brdf(spec)?));
        }
        Ok(scene)
    }
}

/// Shades a material by `method` where that takes it; else the scene file says how, or a technique is chosen.
fn by(
    m: &mut Material,
    method: Option<&Method>,
    params: &std::collections::BTreeMap<String, String>,
) -> Result<(), Error> {
    match method {
        Some(Method::Technique(t)) if t.takes(&*m.brdf, &given(*t, params)?).is_err() => m.method = None,
        Some(method) => m.method = Some(method.clone()),
        None => {}
    }
    if let (Some(Method::Technique(t)), true) = (&m.method, method.is_some()) {
        m.params = given(*t, params)?;
    }
    Ok(())
}

/// The parameters wished for a technique.
fn given(
    t: &dyn AnyTechnique,
    params: &std::collections::BTreeMap<String, String>,
) -> Result<ParamValues, Error> {
    let given = params.get(t.card().slug).map(String::as_str).unwrap_or_default();
    Ok(ParamValues::parse(given, t.params())?)
}

/// Why a technique takes none of the materials.
fn refusal(t: &dyn AnyTechnique, scene: &Scene) -> String {
    let why = scene.materials.iter().find_map(|m| t.takes(&*m.brdf, &m.params).err());
    format!("{}: {}", t.card().slug, why.unwrap_or_default())
}
