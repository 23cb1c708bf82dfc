//! Which models there are, and how a spec string becomes one.

use crate::error::nearest;
use crate::scaled::Scaled;
use crate::spec::{Args, Interval, SCALE};
use crate::{Files, Info, SharedBrdf, SpecError, measured, model};
use std::sync::Arc;

/// One model: its page, whether `name:WORD` is allowed, and how it is made.
pub(crate) struct Entry {
    pub info: &'static Info,
    pub takes_name: bool,
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

/// Names that are reserved for files of measurements and fits.
const RESERVED: [(&str, &str); 3] = [
    ("merl", "measured isotropic tables, .binary"),
    ("rgl", "adaptively measured materials, .bsdf"),
    ("lobes", "fitted Gaussian lobes; for Lafortune lobes from a file write lafortune:lobes=FILE"),
];

/// The reflectance that `spec` names: `name:key=value,…`, values scalars or `r/g/b` triples; the key `scale`
/// multiplies any model. No file is opened; a spec that names one needs [`parse_with`].
pub fn parse(spec: &str) -> Result<SharedBrdf, SpecError> {
    parse_with(spec, Files::None)
}

/// [`parse`] that opens the files that the spec names as far as `files` allows it.
pub fn parse_with(spec: &str, files: Files<'_>) -> Result<SharedBrdf, SpecError> {
    let spec = spec.trim();
    let (name, body) = spec.split_once(':').unwrap_or((spec, ""));
    let name = name.trim().to_ascii_lowercase().replace('_', "-");
    let mut entries = model::ENTRIES.iter().chain(measured::ENTRIES);
    let Some(entry) = entries.find(|e| e.info.name == name) else {
        let available: Vec<_> = models().iter().chain(measured_models()).map(|i| i.name).collect();
        if let Some(&(name, what)) = RESERVED.iter().find(|r| r.0 == name) {
            return Err(SpecError::NotAvailable { name, what, available });
        }
        return Err(SpecError::UnknownModel { nearest: nearest(&name, &available), name, available });
    };
    let args = Args::new(entry.info, entry.takes_name, body, files)?;
    let scale = args.rgb(SCALE, Interval::NON_NEGATIVE, 1.0)?;
    let brdf = (entry.make)(&args)?;
    Ok(if scale == [1.0; 3] { brdf } else { Arc::new(Scaled { brdf, scale }) })
}
