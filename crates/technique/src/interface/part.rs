//! One factor's baked data.

use crate::tensors::{PartError, TensorFile};
use steradian_brdf::Brdf;
use steradian_prefilter::Tree;

/// One factor's baked data: it saves to and loads from tensors.
pub trait Part: Sized + Send + Sync + 'static {
    /// Writes the part under names that start with `prefix`.
    fn save(&self, to: &mut TensorFile, prefix: &str);
    /// Reads what [`Part::save`] wrote.
    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError>;
    /// Bytes of the tables.
    fn bytes(&self) -> usize;
    /// The light itself, where this factor keeps it: a loaded bake with another reflectance is certified
    /// against it.
    fn kept_light(&self) -> Option<&Tree> {
        None
    }
    /// The reflectance itself, where this factor keeps it: a loaded bake under another light is certified
    /// against it.
    fn kept_reflectance(&self) -> Option<&dyn Brdf> {
        None
    }
}

impl Part for () {
    fn save(&self, _: &mut TensorFile, _: &str) {}

    fn load(_: &TensorFile, _: &str) -> Result<Self, PartError> {
        Ok(())
    }

    fn bytes(&self) -> usize {
        0
    }
}
