//! Every byte in or out, as plain data: images, meshes, tensors. This crate knows no meaning: it does not know
//! what an environment or a reflectance is.
//!
//! Limits are checked before allocation; errors are typed and name file and fault in one line; files are
//! written beside their destination and renamed, so that a failed write leaves the old file whole.

pub mod error;
pub mod raster;

pub use error::{FormatError, Limits};
pub use raster::{Channel, Raster};
