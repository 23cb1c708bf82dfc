//! Reflectance: models, measurements and fits behind one trait.
//!
//! [`parse`] makes a reflectance from a spec string such as `ggx:alpha=0.1,f0=0.9/0.7/0.3`, [`parse_with`]
//! also where the spec names files; [`models`] lists what there is. All directions are in the local frame
//! (t = x, b = y, n = z) and point away from the surface.

mod adaptive;
pub mod albedo;
mod brdf;
pub mod central;
mod describe;
pub mod dfg;
mod draw;
mod error;
mod files;
pub mod fit;
mod form;
mod hint;
mod kernel;
mod math;
pub mod measured;
pub mod model;
mod peak;
pub mod plots;
mod registry;
mod scaled;
mod shader;
mod spec;
mod symmetry;
pub mod views;
pub mod wgsl;
mod width;

#[cfg(test)]
mod conformance;

pub use brdf::{Brdf, Domain, Info, Lobe, Sample, SharedBrdf};
pub use describe::{ALBEDO_DEGREES, Description, describe, describe_brdf};
pub use error::SpecError;
pub use files::Files;
pub use form::Form;
pub use kernel::NormalKernel;
pub use peak::Peak;
pub use registry::{measured_models, models, parse, parse_noting, parse_with, spec_without_folders};
pub use scaled::Scaled;
pub use shader::{ATAN2, BrdfShader, MAX_CELLS};
pub use symmetry::Symmetry;
pub use width::{width_names, with_widths};
