//! Spec strings: `name:key=value,key=value`, with scalars or `r/g/b` triples.

use crate::{Files, Info, SpecError};
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use steradian_base::{ParamError, ParamInfo, ParamValues, Value};

/// Parameter of every model.
pub(crate) const SCALE: ParamInfo = ParamInfo::rgb("scale", [0.0, f64::INFINITY], 1.0, "factor of the whole");

/// Everything that specs of a model may say.
pub(crate) fn parameters(info: &'static Info) -> Vec<ParamInfo> {
    info.parameters.iter().copied().chain([SCALE]).collect()
}

/// The spec of a model with these values.
pub(crate) fn print(info: &'static Info, values: impl IntoIterator<Item = (&'static str, Value)>) -> String {
    let values: ParamValues = values.into_iter().collect();
    format!("{}:{}", info.name, values.body(&parameters(info)))
}

/// The parsed values of one spec string.
#[derive(Debug)]
pub(crate) struct Args<'a> {
    info: &'static Info,
    parameters: Vec<ParamInfo>,
    values: ParamValues,
    files: Files<'a>,
    /// The files that were read.
    pub opened: RefCell<Vec<PathBuf>>,
}

impl<'a> Args<'a> {
    /// Reads `body`, the part after `name:`; refuses arguments that the model does not have.
    pub fn new(info: &'static Info, body: &str, files: Files<'a>) -> Result<Self, SpecError> {
        let parameters = parameters(info);
        let values = ParamValues::parse(body, &parameters);
        let values = values.map_err(|error| SpecError::Param { model: info.name, error })?;
        Ok(Self { info, parameters, values, files, opened: RefCell::default() })
    }

    /// The model's name.
    pub fn model(&self) -> &'static str {
        self.info.name
    }

    fn of<T>(
        &self,
        key: &str,
        read: impl FnOnce(&ParamValues, &ParamInfo) -> Result<T, ParamError>,
    ) -> Result<T, SpecError> {
        let info = self.parameters.iter().find(|p| p.name == key);
        let unknown = || ParamError::Unknown { name: key.into(), nearest: None, available: Vec::new() };
        let value = info.ok_or_else(unknown).and_then(|info| read(&self.values, info));
        value.map_err(|error| SpecError::Param { model: self.info.name, error })
    }

    /// An error of form.
    pub fn syntax(&self, what: String) -> SpecError {
        SpecError::Syntax { model: self.info.name, what }
    }

    /// Is the key given?
    pub fn has(&self, key: &str) -> bool {
        self.values.0.contains_key(key)
    }

    /// The error of a value.
    pub fn refuse(&self, key: &'static str, expected: String) -> SpecError {
        let value = self.values.0.get(key).map_or_else(String::new, Value::to_string);
        SpecError::Param { model: self.info.name, error: ParamError::Value { name: key, value, expected } }
    }

    /// A number that is given or has a default.
    pub fn number(&self, key: &str) -> Result<f64, SpecError> {
        self.of(key, ParamValues::number)
    }

    /// A number, if given.
    pub fn optional(&self, key: &str) -> Result<Option<f64>, SpecError> {
        if self.has(key) { self.number(key).map(Some) } else { Ok(None) }
    }

    /// A colour.
    pub fn rgb(&self, key: &str) -> Result<[f64; 3], SpecError> {
        self.of(key, ParamValues::triple)
    }

    /// One word of a choice.
    pub fn word(&self, key: &str) -> Result<&'static str, SpecError> {
        self.of(key, ParamValues::word)
    }

    /// A name, if given.
    pub fn name(&self, key: &str) -> Option<String> {
        if let Some(Value::Word(name)) = self.values.0.get(key) { Some(name.clone()) } else { None }
    }

    /// The path of a file, if given.
    pub fn file(&self, key: &str) -> Option<PathBuf> {
        if let Some(Value::File(path)) = self.values.0.get(key) { Some(path.clone()) } else { None }
    }

    /// Text of a file that the spec names or implies. The file may have at most `most` bytes; messages call
    /// it `what`.
    pub fn read(&self, path: &Path, most: u64, what: &str) -> Result<String, SpecError> {
        let (path, text) = self.files.read(path, most, what)?;
        self.opened.borrow_mut().push(path);
        Ok(text)
    }

    /// Content of a file that the spec names or implies; unlike that of `read` it need not be text.
    pub fn bytes(&self, path: &Path, most: u64, what: &str) -> Result<Vec<u8>, SpecError> {
        let (path, bytes) = self.files.bytes(path, most, what)?;
        self.opened.borrow_mut().push(path);
        Ok(bytes)
    }

    /// Contents that replace the files, if given.
    pub fn held(&self) -> Option<&'a [f64]> {
        if let Files::Held(numbers) = self.files { Some(numbers) } else { None }
    }

    /// The spec as it was given, without the factor of the whole.
    pub fn spec(&self) -> String {
        format!("{}:{}", self.info.name, self.values.body(self.info.parameters))
    }

    /// The spec with file names without folders, and the factor.
    pub fn spec_without_folders(&self) -> String {
        let body = self.values.body_without_folders(&self.parameters);
        if body.is_empty() { self.info.name.into() } else { format!("{}:{body}", self.info.name) }
    }
}
