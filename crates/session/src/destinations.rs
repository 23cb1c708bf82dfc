//! Destinations of outputs, checked before any work: one that cannot be written leaves nothing half done.

use crate::{Error, probe_of};
use std::path::{Path, PathBuf};
use steradian_base::{Input, without_folders};
use steradian_formats::{Container, Limits, check_writable};

/// The destinations of one command.
#[derive(Default)]
pub struct Destinations {
    files: Vec<(String, PathBuf)>,
    folders: Vec<PathBuf>,
}

impl Destinations {
    /// A folder that is made where it is missing; with `deep` the folders above it too.
    pub fn folder(&mut self, path: &Path, deep: bool) -> Result<(), Error> {
        if path.exists() && !path.is_dir() {
            return Err(unwritable(path, "exists and is not a folder"));
        }
        if deep {
            let above = path.ancestors().skip(1).find(|a| a.as_os_str().is_empty() || a.exists());
            if let Some(a) = above.filter(|a| !a.as_os_str().is_empty() && !a.is_dir()) {
                return Err(unwritable(path, format_args!("{} is not a folder", a.display())));
            }
            let first = path.ancestors().take_while(|a| !a.exists() && !a.as_os_str().is_empty()).last();
            first.map_or(Ok(()), check_writable)?;
        } else {
            has_parent(path)?;
            check_writable(path)?;
        }
        let spot = place(path);
        if let Some((other, _)) = self.files.iter().find(|(_, p)| *p == spot) {
            let why = format!("is the file of {other}: name a folder");
            return Err(Error::usage(format!("{}: {why}", path.display())));
        }
        self.folders.push(spot);
        Ok(())
    }

    /// Registers a file as an output. In a folder of outputs it must end in .json, so that it is not mistaken
    /// for one of the folder's.
    pub fn file(&mut self, option: &str, path: &Path) -> Result<(), Error> {
        if path == Path::new("-") {
            return Ok(());
        }
        let spot = place(path);
        let inside = spot.parent().is_some_and(|p| self.folders.iter().any(|f| f == p));
        if self.folders.contains(&spot) {
            return Err(Error::usage(format!("{option} {}: is the folder of outputs", path.display())));
        }
        if inside && path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("json")) {
            let why = "lies in the folder of outputs: give it the extension .json";
            return Err(Error::usage(format!("{option} {}: {why}", path.display())));
        }
        if !inside {
            has_parent(path)?;
        }
        match std::fs::metadata(path) {
            Ok(m) if m.is_dir() => return Err(unwritable(path, "is a folder")),
            // Devices take any number of outputs.
            Ok(m) if !m.is_file() => return Ok(()),
            Ok(m) if m.permissions().readonly() => return Err(unwritable(path, "the file is read-only")),
            _ if !inside => check_writable(path)?,
            _ => {}
        }
        if let Some((other, _)) = self.files.iter().find(|(_, p)| *p == spot) {
            let why = format!("is what {other} writes too: name two files");
            return Err(Error::usage(format!("{option} {}: {why}", path.display())));
        }
        self.files.push((option.into(), spot));
        Ok(())
    }
}

/// Metadata key under which a texture names the light that it was made from.
pub const LIGHT_KEY: &str = "steradian.light";

/// Identifies a light in the metadata of data made from it: its name, and for a file the hash of its
/// contents.
pub fn light_mark(spec: &str) -> String {
    let (path, probe) = match probe_of(spec) {
        Some((path, k)) => (path, format!("#{k}")),
        None => (Path::new(spec), String::new()),
    };
    let hashed = if path.is_file() { Input::of_file(path).ok() } else { None };
    hashed.map_or_else(|| without_folders(spec), |i| format!("{}{probe} sha256:{}", i.name, i.sha256))
}

/// Refuses to replace the texture at `path` where it was made from a light other than `mark`, or does not
/// name its light. Accepts a path without a file.
pub fn check_replaced(path: &Path, mark: &str, limits: &Limits) -> Result<(), Error> {
    let Some(container) = Container::of_file(path) else { return Ok(()) };
    let texture = container.read(path, limits)?;
    let (from, what) = match texture.get(LIGHT_KEY) {
        Some(m) if m == mark => return Ok(()),
        Some(m) => (m.split(" sha256:").next().unwrap_or(m).to_string(), "was made from"),
        None => ("of what light it is".into(), "does not say"),
    };
    let why = format!("{what} {from}, and would be replaced: give `name`, or another folder");
    Err(Error::usage(format!("{}: {why}", path.display())))
}

fn unwritable(path: &Path, why: impl std::fmt::Display) -> Error {
    Error::failed(format!("{}: cannot write: {why}", path.display()))
}

/// The folder that a path lies in.
fn parent(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn has_parent(path: &Path) -> Result<(), Error> {
    if path.exists() {
        return Ok(());
    }
    let folder = parent(path);
    if folder.is_dir() {
        return Ok(());
    }
    let what = if folder.exists() { "is not a folder" } else { "does not exist" };
    Err(unwritable(path, format_args!("the folder {} {what}", folder.display())))
}

/// One path for all names of a place.
fn place(path: &Path) -> PathBuf {
    if let Ok(p) = path.canonicalize() {
        return p;
    }
    match (path.file_name(), parent(path)) {
        (Some(name), folder) if folder != path => place(folder).join(name),
        _ => path.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn destinations_are_judged_before_the_work() {
        let d = tempfile::tempdir().unwrap();
        let at = |name: &str| d.path().join(name);
        std::fs::write(at("file"), "").unwrap();
        let code = |r: Result<(), Error>| match r.map_err(|e| e.kind()) {
            Ok(()) => 0,
            Err(crate::Kind::Usage) => 2,
            Err(_) => 1,
        };
        let mut all = Destinations::default();
        assert_eq!(code(all.file("-o", &at("none/a.exr"))), 1);
        assert_eq!(code(all.file("-o", &at("file/a.exr"))), 1);
        assert_eq!(code(all.file("-o", d.path())), 1);
        #[cfg(target_os = "linux")]
        assert_eq!(code(all.file("-o", Path::new("/proc/a.exr"))), 1);
        assert_eq!(code(all.file("-o", &at("a.exr"))), 0);
        assert_eq!(code(all.file("`extract-sun`", &at("./a.exr"))), 2);
        assert_eq!(code(all.folder(&at("file"), true)), 1);
        assert_eq!(code(all.folder(&at("file/deep"), true)), 1);
        assert_eq!(code(all.folder(&at("none/out"), false)), 1);
        assert_eq!(code(all.folder(&at("none/out"), true)), 0);
        assert_eq!(code(all.folder(&at("out"), false)), 0);
        assert_eq!(code(all.file("`extract-sun`", &at("out/suns.json"))), 0);
        assert_eq!(code(all.file("`extract-sun`", &at("out/suns.ktx2"))), 2);
        assert_eq!(code(all.file("`extract-sun`", &at("out"))), 2);
        assert_eq!(code(all.file("`extract-sun`", Path::new("-"))), 0);
    }
}
