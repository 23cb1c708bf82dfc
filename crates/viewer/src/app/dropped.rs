//! Files that are dropped onto the window.

use super::{App, Said};
use crate::Wish;
use eframe::egui;
use std::path::{Path, PathBuf};
use steradian_session::{Adjust, Error, Session};
use steradian_techniques::{AnyTechnique, SavedBake, find};

impl App {
    /// Takes files that were dropped.
    pub(super) fn drop_files(&mut self, ctx: &egui::Context) {
        let files: Vec<PathBuf> =
            ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_path_buf()).collect());
        for file in files {
            self.take(&file);
        }
    }

    /// Takes a file for what it is by its name.
    pub(super) fn take(&mut self, file: &Path) {
        let name = file.display().to_string();
        let extension = file.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let before = self.kept.wish.clone();
        let wish = &mut self.kept.wish;
        match extension.as_str() {
            "toml" => *wish = Wish::of(&name),
            "obj" | "ply" | "stl" | "gltf" | "glb" => {
                (wish.input, wish.orbit, wish.normal_map, wish.brdf) = (name, None, None, None);
                wish.light.get_or_insert_with(|| "studio".into());
            }
            "png" | "jpg" | "jpeg" | "tga" => wish.normal_map = Some(name),
            "hdr" | "exr" | "pfm" | "pic" | "dds" | "ktx" | "ktx2" => {
                let bake = wish.bake.clone();
                return self.read(move || Ok(light(name, bake)));
            }
            "safetensors" => return self.read(move || saved(name)),
            _ => {
                let technique = wish.technique.clone();
                return self.read(move || measured(&name, technique.as_deref()));
            }
        }
        self.before_drop = Some(before);
    }

    /// Has a thread look into a file for how it changes what is wished for.
    fn read(&self, read: impl FnOnce() -> Result<Change, String> + Send + 'static) {
        let (say, ctx) = (self.threads.say.clone(), self.threads.ctx.clone());
        std::thread::spawn(move || {
            let _ = say.send(Said::Dropped(read()));
            ctx.request_repaint();
        });
    }
}

/// What a dropped file does to the wish, and what there is to say about it.
pub(super) type Change = Box<dyn FnOnce(&mut Wish) -> Option<String> + Send>;

/// An image as light. A saved bake that was made of it goes on; it holds no other light.
fn light(file: String, bake: Option<String>) -> Change {
    let of_it = bake.and_then(|bake| read_bake(&bake).ok()).is_some_and(|bake| bake.was_made_of(&file));
    Box::new(move |wish| {
        wish.light = Some(file);
        wish.bake.take_if(|_| !of_it);
        None
    })
}

fn read_bake(file: &str) -> Result<SavedBake, Error> {
    Session::new().saved_bake(Path::new(file), &Adjust::default())
}

/// A saved bake: with it come the sky that it was made of and, for when it is put away, its reflectance and
/// technique. Files that it names are not opened.
fn saved(file: String) -> Result<Change, String> {
    let bake = read_bake(&file).map_err(|e| e.to_string())?;
    let technique = bake.technique;
    let params = bake.open().map_err(|e| e.to_string())?.params().body(technique.params());
    let named = bake.made.environment.clone();
    let is_file = |spec: &str| steradian_brdf::parse(spec).is_err();
    let brdf = Some(bake.made.brdf.clone()).filter(|spec| !is_file(spec));
    Ok(Box::new(move |wish| {
        let slug = technique.card().slug;
        wish.params.insert(slug.into(), params);
        (wish.technique, wish.bake) = (Some(slug.into()), Some(file));
        if brdf.is_some() {
            wish.brdf = brdf;
        }
        if steradian_session::is_sky(&named) {
            wish.light = Some(named);
            return None;
        }
        Some(format!("was baked under {named}: drop that too, to see it around the object"))
    }))
}

/// The reflectance that a file of measurements holds, by whichever reader takes it. Where `technique` does
/// not take it, the best is chosen for it.
fn measured(file: &str, technique: Option<&str>) -> Result<Change, String> {
    let mut session = Session::new();
    for model in steradian_brdf::measured_models() {
        let Some(info) = model.parameters.iter().find(|p| p.kind == steradian_base::Kind::File) else {
            continue;
        };
        let spec = if info.positional {
            format!("{}:{file}", model.name)
        } else {
            format!("{}:{}={file}", model.name, info.name)
        };
        if let Ok(brdf) = session.brdf(&spec) {
            let takes = |t: &dyn AnyTechnique| (t.card().materials)(&*brdf).is_ok();
            let taken = technique.and_then(find).is_some_and(takes);
            return Ok(Box::new(move |wish| {
                wish.brdf = Some(spec);
                wish.technique.take_if(|_| !taken);
                wish.bake = None;
                None
            }));
        }
    }
    Err(format!("{file}: is no light, mesh, scene, map, bake or measured reflectance that is known here"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_saved_bake_brings_its_sky_its_reflectance_and_its_technique() {
        use steradian_session::bake::{Accuracy, Output, Request};
        let file = std::env::temp_dir().join(format!("steradian-dropped-{}.safetensors", std::process::id()));
        let request = Request {
            environment: "overcast".into(),
            adjust: Adjust::default(),
            sun_lights: None,
            brdf: "ggx:alpha=0.6,f0=0.3".into(),
            technique: find("split_sum").expect("registered"),
            params: steradian_base::ParamValues::default(),
            accuracy: Accuracy::Usual,
            mesh: None,
            transfer: None,
            half: false,
        };
        let mut session = Session::new();
        let baked = session.bake(&request).expect("bakes").met().expect("no tolerance");
        baked.write(&Output::of(&file).expect("a place"), &session).expect("writes");
        let name = file.display().to_string();
        let change = saved(name.clone());
        std::fs::remove_file(&file).expect("there");
        let mut wish = Wish::default();
        assert_eq!(change.unwrap_or_else(|e| panic!("{e}"))(&mut wish), None);
        assert_eq!((wish.bake, wish.light.as_deref()), (Some(name), Some("overcast")));
        assert_eq!(wish.brdf.as_deref(), Some("ggx:alpha=0.6,f0=0.3"));
        assert_eq!(wish.technique.as_deref(), Some("split_sum"));
    }

    #[test]
    fn a_file_of_nothing_known_is_refused_in_a_line() {
        let Err(e) = measured("/nonexistent/file.abc", None) else { panic!("no such file") };
        assert!(e.contains("file.abc") && !e.contains('\n'), "{e}");
    }
}
