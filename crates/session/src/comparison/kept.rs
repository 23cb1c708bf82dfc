//! Results of earlier comparisons, kept in a file next to the table: a result of the same inputs by the same
//! version is not computed again. Pictures, where needed, are PNG files in a folder next to it.

use super::{Finding, answer_json};
use crate::Error;
use crate::compare::{Answer, Rendering};
use crate::page::{decoded, encoded};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use steradian_base::{Certificate, Evidence, Input};
use steradian_formats::{read_file, read_text, write_atomic};
use steradian_render::{Display, Errors};

/// Largest size, bytes, of such a file: a hundred thousand results take less.
const MAX_BYTES: u64 = 64 << 20;

/// Largest size, bytes, of a picture.
const MAX_PICTURE: u64 = 256 << 20;

/// The file and its entries, by digest.
pub struct Kept {
    path: PathBuf,
    /// The folder of the pictures, where they are needed: a result without its pictures is none then.
    pictures: Option<PathBuf>,
    results: Map<String, Value>,
}

/// The digest of everything that decides a result.
pub fn digest(parts: &[String]) -> String {
    Input::of(Path::new("key"), parts.join("\n").as_bytes()).sha256
}

impl Kept {
    /// Reads the entries in `path`, none where it does not exist; with the pictures in the folder of the
    /// file's name and `.pictures`, where they are needed.
    pub fn open(path: &Path, with_pictures: bool) -> Result<Self, Error> {
        let path = path.to_path_buf();
        let mut folder = path.clone().into_os_string();
        folder.push(".pictures");
        let pictures = with_pictures.then(|| PathBuf::from(folder));
        if !path.exists() {
            return Ok(Self { path, pictures, results: Map::new() });
        }
        let text = read_text(&path, MAX_BYTES, "a file of results")?;
        let document: Value = serde_json::from_str(&text).unwrap_or_default();
        match document.get("results").and_then(Value::as_object) {
            Some(results) => Ok(Self { results: results.clone(), pictures, path }),
            None => {
                let why = "holds no results that `resume` keeps: name another file";
                Err(Error::input(format!("{}: {why}", path.display())))
            }
        }
    }

    /// The answer of a key; with pictures of one pixel where none are needed.
    fn answer(&self, key: &str) -> Option<Answer> {
        let v = self.results.get(key)?;
        let (label, backend) = (v["technique"].as_str()?.to_string(), backend(v["backend"].as_str()?)?);
        if let Some(why) = v["refused"].as_str() {
            return Some(Answer::Refused { label, backend, why: why.into() });
        }
        let number = |name: &str| v[name].as_f64();
        let errors = |_| {
            let errors = Errors {
                rmse: number("rmse")?,
                relative_rms: number("relative_rms")?,
                rel_mse: number("rel_mse")?,
                median: number("median")?,
                ninetieth: number("ninetieth")?,
                stops: number("stops")?,
                ..Errors::default()
            };
            Some((errors, number("flip")?))
        };
        let certificate = v["certificate"]["error"].as_f64().and_then(|e| {
            let known = [Evidence::Proved, Evidence::Estimated, Evidence::Measured];
            let word = v["certificate"]["known"].as_str()?;
            Some(Certificate::new(e, known.into_iter().find(|k| k.word() == word)?))
        });
        let errors = number("flip").and_then(errors);
        let difference = match (&self.pictures, &errors) {
            (Some(folder), Some(_)) => Some(picture(folder, &format!("{key}-difference"))?),
            _ => None,
        };
        Some(Answer::Rendered(Box::new(Rendering {
            label,
            backend,
            picture: match &self.pictures {
                Some(folder) => picture(folder, key)?,
                None => Display::filled(1, 1, [0; 3]),
            },
            errors,
            difference,
            flip_to_cpu: number("flip_to_cpu"),
            certificate,
            bake_seconds: number("bake_seconds")?,
            shade_seconds: number("shade_seconds")?,
            bytes: v["bytes"].as_u64()? as usize,
        })))
    }

    /// The answers of a row, if all were kept.
    pub fn row(&self, keys: &[String]) -> Option<Vec<Answer>> {
        keys.iter().map(|k| self.answer(k)).collect()
    }

    /// Adds the results of a row and writes the file, whole or not at all.
    pub fn add(&mut self, finding: &Finding, keys: &[String]) -> Result<(), Error> {
        if let Some(folder) = &self.pictures {
            std::fs::create_dir_all(folder)
                .map_err(|e| Error::failed(format!("{}: {e}", folder.display())))?;
            for (key, r) in keys.iter().zip(&finding.answers).filter_map(|(k, a)| Some((k, a.rendering()?))) {
                keep(folder, key, &r.picture)?;
                if let Some(difference) = &r.difference {
                    keep(folder, &format!("{key}-difference"), difference)?;
                }
            }
        }
        let answers = finding.answers.iter().map(answer_json);
        self.results.extend(keys.iter().cloned().zip(answers));
        let document = json!({"version": env!("CARGO_PKG_VERSION"), "results": self.results});
        let text = format!("{document:#}\n");
        Ok(write_atomic(&self.path, |w| w.write_all(text.as_bytes()))?)
    }
}

fn backend(name: &str) -> Option<&'static str> {
    ["cpu", "gpu"].into_iter().find(|b| *b == name)
}

/// A kept picture; `None` where there is none, or no whole one.
fn picture(folder: &Path, name: &str) -> Option<Display> {
    decoded(&read_file(&folder.join(format!("{name}.png")), MAX_PICTURE, "a picture").ok()?)
}

fn keep(folder: &Path, name: &str, picture: &Display) -> Result<(), Error> {
    let bytes = encoded(picture)?;
    Ok(write_atomic(&folder.join(format!("{name}.png")), |w| w.write_all(&bytes))?)
}
