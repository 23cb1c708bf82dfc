//! Reports of inputs, in words and as JSON.

mod bake;
mod brdf;
mod btf;
mod engine;
mod light;
mod mesh;
mod probes;
mod rti;
mod transfer;

use super::{BrdfFacts, is_bake, is_lp, is_mesh, is_ptm};
use crate::fit::measurements;
use crate::inputs::check_any;
use crate::{Adjust, Error, Session, file_name, is_sky};
use serde_json::Value;
use std::path::Path;
use steradian_formats::{NO_IMAGE, is_image};

/// One line of a report in words: heading and text.
pub type Line = (&'static str, String);

/// A report in both forms.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// A document with stable keys, `kind` and `name` among them.
    pub json: Value,
    /// The report in words.
    pub lines: Vec<Line>,
}

impl Report {
    /// The lines as text, aligned.
    pub fn text(&self) -> String {
        let width = self.lines.iter().map(|l| l.0.len()).max().unwrap_or(0);
        self.lines.iter().map(|(name, value)| format!("{name:width$}  {value}\n")).collect()
    }
}

impl BrdfFacts {
    /// The report of these facts.
    pub fn report(&self) -> Report {
        brdf::report(self)
    }
}

impl Session {
    /// What an input is that is told by its name and content: an environment (turned, scaled, and of a
    /// texture one level), a sky, a mesh or shape, a saved bake or its tables, transfer, probes, the files of
    /// reflectance transformation imaging, pictures of a bidirectional texture function, what lies beside an
    /// engine's maps (a light in a glTF file, suns, coefficients, the split sum's table), a file of
    /// measurements, `brdf:SPEC`, `brdf:` for the list of models, or `brdf:MODEL:*` for one of materials.
    pub fn inspect(&mut self, what: &str, adjust: &Adjust, level: usize) -> Result<Report, Error> {
        if let Some(spec) = what.strip_prefix("brdf:") {
            return match spec {
                "" => Ok(brdf::list()),
                _ if spec.ends_with('*') => brdf::materials(spec),
                _ => Ok(self.inspect_brdf(spec)?.report()),
            };
        }
        check_any(what)?;
        let path = Path::new(what);
        let name = if is_sky(what) { what.into() } else { file_name(path) };
        if let Some(report) = self.inspect_beside(path, adjust)? {
            return Ok(report);
        }
        // What its bytes say is what a renderer would read.
        if path.is_file() && is_image(path) {
            return Ok(light::report(&self.inspect_light(what, adjust, level)?, &name));
        }
        if let Some(spec) = measurements(path).filter(|_| path.is_file()) {
            return Ok(self.inspect_brdf(&spec)?.report());
        }
        if is_mesh(what) {
            return Ok(mesh::report(&self.inspect_mesh(what)?, &name));
        }
        if is_ptm(what) {
            return Ok(rti::ptm(&self.inspect_ptm(path)?, &name));
        }
        if is_lp(what) {
            return Ok(rti::lp(&self.inspect_lp(path)?, &name));
        }
        if what.to_lowercase().ends_with(".csv") {
            return Ok(btf::report(&self.inspect_btf(path)?, &name));
        }
        if let Some(facts) = self.inspect_transfer(path)? {
            return Ok(transfer::report(&facts, &name));
        }
        if let Some(facts) = self.inspect_probes(path)? {
            return Ok(probes::report(&facts, &name));
        }
        if let Some(facts) = self.inspect_local_bake(path)? {
            return Ok(bake::local(&facts, &name));
        }
        if is_bake(what) {
            return Ok(bake::bake(&self.inspect_bake(path)?, &name));
        }
        if let Some(facts) = self.inspect_array(path) {
            return Ok(bake::array(&facts, &name));
        }
        let facts = self.inspect_light(what, adjust, level).map_err(|e| match e.to_string() {
            // Other measurements have no extension of their own.
            why if why.contains(NO_IMAGE) => Error::input(format!(
                "{why}; a measured reflectance is told by its model, such as brdf:npf:FILE,MATERIAL (brdf: lists them)"
            )),
            _ => e,
        })?;
        Ok(light::report(&facts, &name))
    }
}
