//! What is to be seen, in words.

use crate::Orbit;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

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
            params: BTreeMap::new(),
            ground: None,
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
        let scene = is_scene(input);
        let plain = Self { input: input.into(), ..Self::default() };
        match scene {
            true => Self { light: None, brdf: None, technique: None, ground: None, ..plain },
            false if steradian_session::is_shape(input) => plain,
            false => Self { brdf: None, ..plain },
        }
    }

    /// Is the input a scene file?
    pub fn is_scene(&self) -> bool {
        is_scene(&self.input)
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
        match &self.bake {
            Some(file) => option("--bake", file),
            None => {
                if let Some(brdf) = &self.brdf {
                    option("--brdf", brdf);
                }
                if let Some(t) = &self.technique {
                    option("--technique", t);
                    let given = self.params.get(t).map(String::as_str).unwrap_or_default();
                    given.split(',').filter(|p| !p.is_empty()).for_each(|p| option("--param", p));
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
        }
        words.push("--backend gpu -o picture.png".into());
        words.join(" ")
    }
}

fn is_scene(input: &str) -> bool {
    std::path::Path::new(input).extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
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
    fn commands_quote_what_shells_would_take_apart() {
        let wish = Wish { input: "my mesh's.obj".into(), turn: 30.0, ..Wish::default() };
        let line = wish.command([640, 400], -1.5);
        assert!(
            line.starts_with("steradian render 'my mesh'\\''s.obj' --environment studio --rotate 30"),
            "{line}"
        );
        assert!(line.contains("--exposure -1.500") && line.contains("--size 640x400"), "{line}");
    }
}
