//! The list of models, and the parsing of spec strings.

use crate::scaled::Scaled;
use crate::spec::{Args, SCALE};
use crate::{Files, Info, SharedBrdf, SpecError, measured, model};
use std::path::PathBuf;
use std::sync::Arc;
use steradian_base::{nearest, split_spec, without_folders};

/// One model: its page, and how it is made.
pub(crate) struct Entry {
    pub info: &'static Info,
    pub make: fn(&Args<'_>) -> Result<SharedBrdf, SpecError>,
}

/// Every model, by its own page.
pub fn models() -> &'static [&'static Info] {
    static INFOS: std::sync::LazyLock<Vec<&'static Info>> =
        std::sync::LazyLock::new(|| model::ENTRIES.iter().map(|e| e.info).collect());
    &INFOS
}

/// Every reader of measurements, by its own page.
pub fn measured_models() -> &'static [&'static Info] {
    static INFOS: std::sync::LazyLock<Vec<&'static Info>> =
        std::sync::LazyLock::new(|| measured::ENTRIES.iter().map(|e| e.info).collect());
    &INFOS
}

/// The reflectance that `spec` names: `name:key=value,…`, values scalars or `r/g/b` triples; the key `scale`
/// multiplies any model. No file is opened; a spec that names one needs [`parse_with`].
pub fn parse(spec: &str) -> Result<SharedBrdf, SpecError> {
    parse_with(spec, Files::None)
}

/// [`parse`] that opens the files that the spec names as far as `files` allows it.
pub fn parse_with(spec: &str, files: Files<'_>) -> Result<SharedBrdf, SpecError> {
    parse_noting(spec, files, &mut Vec::new())
}

/// [`parse_with`] that also returns the files that it has read, for provenance.
pub fn parse_noting(
    spec: &str,
    files: Files<'_>,
    opened: &mut Vec<PathBuf>,
) -> Result<SharedBrdf, SpecError> {
    let (entry, args) = read(spec, files)?;
    let scale = args.rgb(SCALE.name)?;
    let brdf = (entry.make)(&args);
    opened.append(&mut args.opened.borrow_mut());
    let brdf = brdf?;
    Ok(if scale == [1.0; 3] { brdf } else { Arc::new(Scaled { brdf, scale }) })
}

/// A spec without the folders of the files that it names, for data that leave the machine.
pub fn spec_without_folders(spec: &str) -> String {
    // An invalid spec is treated like any other command-line argument.
    read(spec, Files::None).map_or_else(|_| without_folders(spec), |(_, args)| args.spec_without_folders())
}

/// The model that a spec names, and its values. No file is opened yet.
fn read<'a>(spec: &str, files: Files<'a>) -> Result<(&'static Entry, Args<'a>), SpecError> {
    let (name, body) = split_spec(spec);
    let name = name.to_ascii_lowercase().replace('_', "-");
    let mut entries = model::ENTRIES.iter().chain(measured::ENTRIES);
    let Some(entry) = entries.find(|e| e.info.name == name) else {
        let available: Vec<_> = models().iter().chain(measured_models()).map(|i| i.name).collect();
        return Err(SpecError::UnknownModel { nearest: nearest(&name, &available), name, available });
    };
    Ok((entry, Args::new(entry.info, body, files)?))
}
