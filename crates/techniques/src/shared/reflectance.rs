//! The reflectance's factor of rooms that read a model's parameters: the model itself, by its spec string.

use crate::tensors::{PartError, TensorFile};
use crate::{Material, Part};
use steradian_brdf::{Brdf, SharedBrdf};

/// A reflectance that saves as its spec string.
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

    /// The model's name.
    pub fn name(&self) -> &'static str {
        self.brdf.info().name
    }

    /// Parameter `key` of the model's spec: a scalar three times, or an r/g/b triple.
    pub fn get(&self, key: &str) -> Option<[f64; 3]> {
        get(&*self.brdf, key)
    }

    /// The factor that multiplies the whole model (`scale=`, 1 where absent).
    pub fn scale(&self) -> [f64; 3] {
        self.get("scale").unwrap_or([1.0; 3])
    }
}

/// Takes every isotropic reflectance ([`crate::Card::materials`]).
pub fn isotropic(brdf: &dyn Brdf) -> Result<(), String> {
    if brdf.is_isotropic() {
        return Ok(());
    }
    Err(format!("takes isotropic reflectance only, not this {}: use reference", brdf.info().name))
}

/// Parameter `key` of the spec of `brdf`.
pub fn get(brdf: &dyn Brdf, key: &str) -> Option<[f64; 3]> {
    let spec = brdf.spec();
    let (_, body) = spec.split_once(':')?;
    let text = body.split(',').filter_map(|item| item.split_once('=')).find(|(k, _)| k.trim() == key)?.1;
    let values: Vec<f64> = text.split('/').map(|t| t.trim().parse().ok()).collect::<Option<_>>()?;
    match values[..] {
        [x] => Some([x; 3]),
        [r, g, b] => Some([r, g, b]),
        _ => None,
    }
}

impl Part for Reflectance {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        to.metadata.insert(format!("steradian.{prefix}.brdf"), self.brdf.spec());
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let key = format!("steradian.{prefix}.brdf");
        let spec = from.metadata.get(&key).ok_or_else(|| PartError::Missing(key.clone()))?;
        // A spec from a file names no files of its own: rooms take analytic models only.
        let brdf = steradian_brdf::parse(spec).map_err(|_| PartError::Unexpected(key))?;
        Ok(Self { brdf })
    }

    fn bytes(&self) -> usize {
        0
    }
}
