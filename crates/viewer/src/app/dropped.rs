//! Files that are dropped onto the window.

use super::{App, Said};
use crate::Wish;
use eframe::egui;
use std::path::{Path, PathBuf};
use steradian_session::Session;
use steradian_techniques::{AnyTechnique, find};

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

    /// Takes a file for what it is by its name.
    pub(super) fn take(&mut self, file: &Path) {
        let name = file.display().to_string();
        let extension = file.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let before = self.kept.wish.clone();
        let wish = &mut self.kept.wish;
        match extension.as_str() {
            "toml" => *wish = Wish { tone_mapper: wish.tone_mapper.clone(), ..Wish::of(&name) },
            "obj" | "ply" | "stl" | "gltf" | "glb" => {
                (wish.input, wish.orbit, wish.normal_map, wish.brdf) = (name, None, None, None);
                wish.light.get_or_insert_with(|| "studio".into());
            }
            "hdr" | "exr" | "pfm" | "pic" | "dds" | "ktx" | "ktx2" => {
                (wish.light, wish.bake) = (Some(name), None);
            }
            "png" | "jpg" | "jpeg" | "tga" => wish.normal_map = Some(name),
            "safetensors" => wish.bake = Some(name),
            _ => {
                let (say, ctx, file) = (self.threads.say.clone(), self.threads.ctx.clone(), name);
                let technique = wish.technique.clone();
                std::thread::spawn(move || {
                    let _ = say.send(Said::Reflectance(measured(&file, technique.as_deref())));
                    ctx.request_repaint();
                });
                return;
            }
        }
        self.before_drop = Some(before);
    }
}

/// The reflectance that a file of measurements holds, by whichever reader takes it; is it one that `technique` takes?
fn measured(file: &str, technique: Option<&str>) -> Result<(String, bool), String> {
    let mut session = Session::new();
    let mut first = None;
    for model in steradian_brdf::measured_models() {
        let Some(info) = model.parameters.iter().find(|p| p.kind == steradian_base::Kind::File) else {
            continue;
        };
        let spec = if info.positional {
            format!("{}:{file}", model.name)
        } else {
            format!("{}:{}={file}", model.name, info.name)
        };
        match session.brdf(&spec) {
            Ok(brdf) => {
                let takes = |t: &dyn AnyTechnique| (t.card().materials)(&*brdf).is_ok();
                return Ok((spec, technique.and_then(find).is_some_and(takes)));
            }
            Err(e) => {
                first.get_or_insert_with(|| e.to_string());
            }
        }
    }
    Err(format!("{file}: is no light, mesh, scene, map, bake or measured reflectance that is known here"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_nothing_known_is_refused_in_a_line() {
        let e = measured("/nonexistent/file.abc", None).expect_err("no such file");
        assert!(e.contains("file.abc") && !e.contains('\n'), "{e}");
    }
}
