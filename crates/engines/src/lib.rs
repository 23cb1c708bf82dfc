//! Conventions of engines, and the files that they take.
//!
//! One row of [`ENGINES`] says how an engine's cubes lie, which kernel each level holds and which files there
//! are. What writes these files ([`Request`], [`Plan`], [`Filtered`]) reads the same table as what checks
//! them (the crate `verify`).

mod companions;
mod error;
mod files;
mod gltf;
mod irradiance;
mod levels;
mod method;
mod packing;
mod plan;
mod profile;
mod range;
mod report;
mod request;
mod snippet;
mod sun;
mod transfer;

pub use companions::Companions;
pub use error::EngineError;
pub use files::Written;
pub use irradiance::{CoefficientForm, irradiance, irradiance_source, polynomial};
pub use levels::{Filtered, Level};
pub use method::MethodCost;
pub use plan::{Filter, Kernel, Plan};
pub use profile::{Curve, ENGINES, Engine, Files};
pub use range::{BeyondRange, Remedy};
pub use report::percent;
pub use request::{KERNELS, MethodChoice, Request, kernel_name, kernels_with};
pub use transfer::{Carried, OtherSites, VertexNumbers, carried, glb, transfer_source};
