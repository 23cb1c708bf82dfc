//! What is to be seen, in words.

use crate::Orbit;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use steradian_render::ToneMapper;
use steradian_render::scenefile::SceneFile;
use steradian_session::is_scene_file;

/// Reflectance of a ground.
pub const GROUND: &str = "lambert:albedo=0.4";
/// The technique that gives a ground shadows, and its parameters: as coarse as soft shadows on a ground
/// allow, and a window that takes the rings off a low sun (2.6 % of error in place of 4.1).
pub const SHADOWS: (&str, &str) = ("prt_diffuse", "bands=6,precision=0.05,window=9");

/// A scene and how it is looked at. Every field is what an option of `steradian render` takes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Wish {
    /// Scene file, mesh file or built-in shape.
    pub input: String,
    /// Light: a file or a sky spec; `None`: the scene file's.
    pub light: Option<String>,
    /// Rotation of the light about +Y, degrees.
    pub turn: f64,
    /// Reflectance of the meshes; `None`: what the file says.
    pub brdf: Option<String>,
    /// Technique; `None`: the scene file's, or one is chosen.
    pub technique: Option<String>,
    /// Parameters of techniques, `name=value,…`, by slug.
    pub params: BTreeMap<String, String>,
    /// Reflectance of a plane under the mesh.
    pub ground: Option<String>,
    /// Its technique; `None`: that of the mesh where it takes the reflectance, else one is chosen.
    pub ground_technique: Option<String>,
    /// Tangent-space normal map.
    pub normal_map: Option<String>,
    /// A saved bake in place of reflectance and technique.
    pub bake: Option<String>,
    /// Exposure in stops; `None` is automatic.
    pub exposure: Option<f32>,
    /// Name of the tone mapper.
    pub tone_mapper: String,
    /// The camera; `None` sees the whole mesh.
    pub orbit: Option<Orbit>,
}

impl Default for Wish {
    fn default() -> Self {
        Self {
            input: "knot".into(),
            light: Some("studio".into()),
            turn: 0.0,
            brdf: Some("ggx:alpha=0.2,f0=1/0.77/0.34".into()),
            technique: Some("split_sum".into()),
            params: [(SHADOWS.0.to_string(), SHADOWS.1.to_string())].into(),
            ground: Some(GROUND.into()),
            ground_technique: Some(SHADOWS.0.into()),
            normal_map: None,
            bake: None,
            exposure: None,
            tone_mapper: "neutral".into(),
            orbit: None,
        }
    }
}

impl Wish {
    /// `input` as its file says, under a light where it is not a scene file.
    pub fn of(input: &str) -> Self {
        let scene = is_scene_file(input);
        let plain = Self { input: input.into(), ..Self::default() };
        match scene {
            true => {
                let (ground, ground_technique) = (None, None);
                let (exposure, tone_mapper) = developed(Path::new(input));
                Self {
                    light: None,
                    brdf: None,
                    technique: None,
                    ground,
                    ground_technique,
                    exposure,
                    tone_mapper: tone_mapper.name().into(),
                    ..plain
                }
            }
            false if steradian_session::is_shape(input) => plain,
            false => Self { brdf: None, ground: None, ground_technique: None, ..plain },
        }
    }

    /// Is the input a scene file?
    pub fn is_scene(&self) -> bool {
        is_scene_file(&self.input)
    }

    /// The parameters of a technique, as a spec has them behind its name.
    fn given(&self, technique: &str) -> &str {
        self.params.get(technique).map(String::as_str).unwrap_or_default()
    }

    /// The command line that makes the same picture in a file of this size, exposed by `ev` stops.
    pub fn command(&self, size: [usize; 2], ev: f32) -> String {
        let mut words: Vec<String> = vec!["steradian".into(), "render".into(), quoted(&self.input)];
        let mut option = |name: &str, value: &str| words.push(format!("{name} {}", quoted(value)));
        if let Some(light) = &self.light {
            option("--environment", light);
        }
        if self.turn != 0.0 {
            option("--rotate", &format!("{}", self.turn));
        }
        // The window's techniques have suns in their data.
        if self.is_scene() || self.light.as_deref().is_some_and(steradian_session::is_sky) {
            option("--suns", "fold");
        }
        match &self.bake {
            Some(file) => option("--bake", file),
            None => {
                if let Some(brdf) = &self.brdf {
                    option("--brdf", brdf);
                }
                if let Some(t) = &self.technique {
                    option("--technique", t);
                    self.given(t).split(',').filter(|p| !p.is_empty()).for_each(|p| option("--param", p));
                }
            }
        }
        if let Some(map) = &self.normal_map {
            option("--normal-map", map);
        }
        if let Some(o) = &self.orbit {
            let [from, at] = [o.from(), o.at].map(|v| format!("{},{},{}", v[0], v[1], v[2]));
            option("--from", &from);
            option("--at", &at);
        }
        option("--exposure", &format!("{ev:.3}"));
        option("--tone-mapper", &self.tone_mapper);
        option("--size", &format!("{}x{}", size[0], size[1]));
        if let Some(ground) = self.ground.as_ref().filter(|_| !self.is_scene()) {
            words.push(format!("--ground={}", quoted(ground)));
            if let Some(t) = &self.ground_technique {
                let given = self.given(t);
                let spec = if given.is_empty() { t.clone() } else { format!("{t}:{given}") };
                words.push(format!("--ground-technique {}", quoted(&spec)));
            }
        }
        words.push("--backend gpu -o picture.png".into());
        words.join(" ")
    }

    /// The text of a scene file of this picture, and the files that it refers to, which lie beside it under
    /// their own names. Fails in a line where a scene file cannot say it.
    pub fn scene_file(&self, size: [usize; 2], ev: f32) -> Result<(String, Vec<PathBuf>), String> {
        if self.is_scene() {
            return Err(format!("{}: is a scene file already", self.input));
        }
        if self.bake.is_some() {
            return Err("a saved bake has no place in a scene file".into());
        }
        let Some(brdf) = &self.brdf else {
            return Err(format!(
                "{}: choose a material: those of mesh files have no place in a scene file",
                self.input
            ));
        };
        if steradian_brdf::parse(brdf).is_err() {
            return Err(format!("{brdf}: measurements in files are not copied: choose another material"));
        }
        let mut files = Vec::new();
        let mut beside = |path: &str| {
            files.push(PathBuf::from(path));
            let name = Path::new(path).file_name().map(|n| n.to_string_lossy().into_owned());
            word(&name.unwrap_or_default())
        };
        let mesh = match steradian_session::is_shape(&self.input) {
            true => format!("shape = {}", word(&self.input)),
            false => format!("file = {}", beside(&self.input)),
        };
        let mut text = String::new();
        if let Some(o) = &self.orbit {
            let fov = o.fov_y.to_degrees();
            text += &format!("[camera]\nfrom = {:?}\nat = {:?}\nfov = {fov}\n\n", o.from(), o.at);
        }
        text +=
            &format!("[[mesh]]\n{mesh}\nmaterial = \"object\"\n\n[material.object]\nbrdf = {}\n", word(brdf));
        if let Some(map) = &self.normal_map {
            text += &format!("normal_texture = {}\n", beside(map));
        }
        let technique = |t: &String| {
            let parameter = |p: &str| {
                let (name, value) = p.split_once('=')?;
                let plain = value.parse::<f64>().is_ok() || matches!(value, "true" | "false");
                Some(format!("{name} = {}", if plain { value.into() } else { word(value) }))
            };
            let params: Vec<String> = self.given(t).split(',').filter_map(parameter).collect();
            let params = match params.is_empty() {
                true => String::new(),
                false => format!("params = {{ {} }}\n", params.join(", ")),
            };
            format!("technique = {}\n{params}", word(t))
        };
        text += &self.technique.as_ref().map(technique).unwrap_or_default();
        if let Some(ground) = &self.ground {
            let by = self.ground_technique.as_ref().map(technique).unwrap_or_default();
            text += &format!(
                "\n[material.ground]\nbrdf = {}\n{by}\n[ground]\nmaterial = \"ground\"\n",
                word(ground)
            );
        }
        let light = self.light.as_deref().unwrap_or(steradian_session::DEFAULT_SKY);
        let light = if steradian_session::is_sky(light) { word(light) } else { beside(light) };
        text += &format!("\n[light]\nenvironment = {light}\nrotation = {}\n", self.turn);
        text += &format!(
            "\n[output]\nwidth = {}\nheight = {}\nexposure = {ev}\ntone_mapper = {}\n",
            size[0],
            size[1],
            word(&self.tone_mapper)
        );
        Ok((text, files))
    }

    /// Writes [`Wish::scene_file`] and copies of its files into a new folder.
    pub fn export(&self, folder: &Path, size: [usize; 2], ev: f32) -> Result<(), String> {
        let (text, files) = self.scene_file(size, ev)?;
        let failed = |e: std::io::Error| format!("{}: cannot write: {e}", folder.display());
        std::fs::create_dir(folder).map_err(failed)?;
        for file in &files {
            let to = folder.join(file.file_name().unwrap_or_default());
            std::fs::copy(file, to).map_err(|e| format!("{}: cannot copy: {e}", file.display()))?;
        }
        std::fs::write(folder.join("scene.toml"), text).map_err(failed)
    }
}

/// A string of TOML.
fn word(text: &str) -> String {
    // JSON's strings are TOML's basic strings.
    serde_json::Value::from(text).to_string()
}

/// The exposure and the tone mapper of a scene file; the usual ones where it cannot be read, which loading it
/// tells.
fn developed(file: &Path) -> (Option<f32>, ToneMapper) {
    const MOST_BYTES: u64 = 1 << 20;
    let is_text = std::fs::metadata(file).is_ok_and(|m| m.is_file() && m.len() <= MOST_BYTES);
    let text = is_text.then(|| std::fs::read_to_string(file).ok()).flatten();
    text.and_then(|text| SceneFile::developed_by(&text)).unwrap_or_default()
}

/// A word for a POSIX shell.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-=:,./+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.into()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_read_as_they_were_written() {
        let folder = std::env::temp_dir().join(format!("steradian-scene-{}", std::process::id()));
        let wish = Wish {
            turn: 30.0,
            tone_mapper: "agx".into(),
            params: [("split_sum", "taps=4,multiscatter=on"), SHADOWS]
                .map(|(t, given)| (t.to_string(), given.to_string()))
                .into(),
            orbit: Some(crate::Orbit {
                at: [0.0; 3],
                distance: 4.0,
                azimuth: 0.5,
                elevation: 0.2,
                fov_y: 0.5,
            }),
            ..Wish::default()
        };
        wish.export(&folder, [320, 200], -1.5).expect("written");
        let mut session = steradian_session::Session::new();
        let file = folder.join("scene.toml");
        let again = Wish::of(&file.display().to_string());
        assert_eq!((again.exposure, again.tone_mapper.as_str()), (Some(-1.5), "agx"));
        let read = session.scene_file(&file, &Default::default());
        std::fs::remove_dir_all(&folder).expect("there");
        let scene = read.unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((scene.settings.width, scene.exposure), (320, Some(-1.5)));
        let object = scene.materials.iter().find(|m| m.brdf.spec().starts_with("ggx")).expect("the object");
        assert_eq!(object.method.as_ref().map(|m| m.slug()), Some("split_sum"));
        assert_eq!(object.brdf.spec(), "ggx:alpha=0.2,f0=1/0.77/0.34");
        assert_eq!(object.params.0.len(), 2);
        let ground = scene.ground.as_ref().expect("the ground");
        assert_eq!(ground.method.as_ref().map(|m| m.slug()), Some("prt_diffuse"));
        assert!(ground.params.0.len() == 3 && scene.camera.is_some());
        let other = Wish { brdf: None, ..wish };
        assert!(other.scene_file([1, 1], 0.0).is_err_and(|e| e.contains("choose a material")));
    }

    #[test]
    fn commands_quote_what_shells_would_take_apart() {
        let wish = Wish { input: "my mesh's.obj".into(), turn: 30.0, ..Wish::default() };
        let line = wish.command([640, 400], -1.5);
        assert!(
            line.starts_with("steradian render 'my mesh'\\''s.obj' --environment studio --rotate 30"),
            "{line}"
        );
        assert!(line.contains("--exposure -1.500") && line.contains("--size 640x400"), "{line}");
        let ground = "--suns fold --brdf ggx:alpha=0.2,f0=1/0.77/0.34 --technique split_sum";
        assert!(line.contains(ground), "{line}");
        assert!(
            line.contains(
                "--ground=lambert:albedo=0.4 --ground-technique prt_diffuse:bands=6,precision=0.05,window=9"
            ),
            "{line}"
        );
    }
}
