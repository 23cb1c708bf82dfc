//! Files of many materials: binary numbers, and a text file with one name per line.

use super::{nbrdf, npf};
use crate::error::{FEW, NEAREST};
use crate::model::merl_fits::{ABC, SGD};
use crate::model::published;
use crate::spec::Args;
use crate::{Files, SpecError};
use std::path::{Path, PathBuf};
use steradian_base::{brief, nearest, nearest_few, split_spec};

/// Bytes of a list of names at most.
const MAX_NAMES: u64 = 1 << 20;
/// Materials at most.
const MAX_MATERIALS: usize = 4096;

/// The place of the material `wanted` in the list `names`; a whole number counts from 0.
pub(super) fn find(names: &Path, wanted: Option<&str>, a: &Args<'_>) -> Result<usize, SpecError> {
    let text = a.read(names, MAX_NAMES, "a list of materials")?;
    let all: Vec<&str> = text.lines().map(str::trim).filter(|l| !l.is_empty()).take(MAX_MATERIALS).collect();
    let plain = |s: &str| s.trim_start_matches('@').to_ascii_lowercase().replace('_', "-");
    let wanted = wanted.map(plain).unwrap_or_default();
    if let Some(i) = all.iter().position(|n| plain(n) == wanted) {
        return Ok(i);
    }
    let near = nearest(&wanted, &all).map(|n| format!(" (did you mean '{n}'?)")).unwrap_or_default();
    let (model, count) = (a.model(), all.len());
    let list = match &all[..] {
        all if count <= FEW => format!("its {count} are: {}", all.join(", ")),
        all if wanted.is_empty() => format!("such as {}", all[0]),
        all => format!("near it are: {}", nearest_few(&wanted, all, NEAREST).join(", ")),
    };
    let help = format!("{list}; inspect 'brdf:{model}:FILE,*' lists all {count}");
    let what = if wanted.is_empty() {
        format!("its file holds many materials: name one as {model}:FILE,MATERIAL, {help}")
    } else {
        format!("{} has no material '{}'{near}; {help}", brief(&names.display().to_string()), brief(&wanted))
    };
    Err(SpecError::Syntax { model, what })
}

/// The list of names of a file: as the spec gives it, else `standard` in the file's folder.
pub(super) fn list(path: &Path, standard: &str, a: &Args<'_>) -> PathBuf {
    a.file("names").unwrap_or_else(|| path.with_file_name(standard))
}

/// The specs that a spec with `*` for the material expands to: `npf:FILE,*`, `nbrdf:FILE,*`, `sgd:*`,
/// `abc:*`, `lafortune:*`. Any other spec expands to itself.
pub fn expand(spec: &str, files: Files<'_>) -> Result<Vec<String>, SpecError> {
    let (model, body) = split_spec(spec);
    if body == "*" && model == "sgd" {
        return Ok(SGD.names().iter().map(|n| format!("sgd:{n}")).collect());
    }
    if body == "*" && model == "abc" {
        return Ok(ABC.names().iter().map(|n| format!("abc:{n}")).collect());
    }
    if body == "*" && model == "lafortune" {
        return Ok(published::names().iter().map(|n| format!("lafortune:@{n}")).collect());
    }
    let Some(body) = body.strip_suffix(",*") else { return Ok(vec![spec.into()]) };
    let info = match model {
        "npf" => &npf::INFO,
        "nbrdf" => &nbrdf::INFO,
        _ => return Ok(vec![spec.into()]),
    };
    let a = Args::new(info, body, files)?;
    let Some(path) = a.file("file") else { return Ok(vec![spec.into()]) };
    let standard = if model == "npf" { npf::NAMES.to_owned() } else { nbrdf::names(&path) };
    let text = a.read(&list(&path, &standard, &a), MAX_NAMES, "a list of materials")?;
    let names = text.lines().map(str::trim).filter(|l| !l.is_empty()).take(MAX_MATERIALS);
    Ok(names.map(|n| format!("{model}:{body},{n}")).collect())
}
