//! One factor's baked data.

use crate::tensors::{PartError, TensorFile};

/// One factor's baked data: it saves to and loads from tensors.
pub trait Part: Sized + Send + Sync + 'static {
    /// Writes the part under names that start with `prefix`.
    fn save(&self, to: &mut TensorFile, prefix: &str);
    /// Reads what [`Part::save`] wrote.
    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError>;
    /// Bytes of the tables.
    fn bytes(&self) -> usize;
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
