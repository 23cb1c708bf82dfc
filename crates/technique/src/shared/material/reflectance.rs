//! The reflectance's factor of techniques that read a model's parameters: the model itself, by its spec
//! string.

use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{Material, Part};
use steradian_brdf::{Brdf, Domain, Files, Form, SharedBrdf, parse_with, spec_without_folders};

/// A reflectance that is saved as its spec string and the contents of the files that the spec names.
#[derive(Debug, Clone)]
pub struct Reflectance {
    /// The model.
    pub brdf: SharedBrdf,
}

impl Reflectance {
    /// The material's reflectance.
    pub fn of(material: &Material) -> Self {
        Self { brdf: material.brdf.clone() }
    }

    /// The reflectance as plain data.
    pub fn form(&self) -> Form {
        self.brdf.form()
    }
}

/// Saves a reflectance under `key`: its spec, and the contents of the files that the spec names.
pub fn put(to: &mut TensorFile, key: &str, brdf: &dyn Brdf) {
    let mut spec = brdf.spec();
    if let Some(held) = brdf.held() {
        spec = spec_without_folders(&spec);
        put_f64(to, key.into(), vec![held.len()], held);
    }
    to.metadata.insert(key.into(), spec);
}

/// The reflectance that [`put`] saved, rebuilt from its spec and saved tensors; no file that the spec names
/// is opened.
pub fn kept(from: &TensorFile, key: &str) -> Result<SharedBrdf, PartError> {
    let spec = from.metadata.get(key).ok_or_else(|| PartError::Missing(key.into()))?;
    let held = if from.tensors.contains_key(key) { Some(get_f64(from, key, 1)?.1) } else { None };
    let files = held.as_deref().map_or(Files::None, Files::Held);
    parse_with(spec, files).map_err(|_| PartError::Unexpected(key.into()))
}

/// Takes every isotropic reflectance ([`crate::Card::materials`]).
pub fn isotropic(brdf: &dyn Brdf) -> Result<(), String> {
    if brdf.is_isotropic() {
        return Ok(());
    }
    Err(format!("takes isotropic reflectance only, not this {}: use reference", brdf.info().name))
}

/// Takes every reflectance that takes light from above the surface alone ([`crate::Card::materials`]).
pub fn one_sided(brdf: &dyn Brdf) -> Result<(), String> {
    if brdf.domain() == Domain::Hemisphere {
        return Ok(());
    }
    Err(format!("takes reflectance of light from above the surface, not {}: use exact", brdf.info().name))
}

impl Part for Reflectance {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        put(to, &format!("steradian.{prefix}.brdf"), &*self.brdf);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        Ok(Self { brdf: kept(from, &format!("steradian.{prefix}.brdf"))? })
    }

    fn bytes(&self) -> usize {
        0
    }

    fn kept_reflectance(&self) -> Option<&dyn Brdf> {
        Some(&*self.brdf)
    }
}
