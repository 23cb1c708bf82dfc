//! Facts of inputs.

mod bake;
mod brdf;
mod light;
mod mesh;
mod plot;
mod probes;
mod report;
mod rti;
mod slice;
mod texture;
mod transfer;

pub use bake::{ArrayContent, ArrayFacts, BakeFacts, LocalBakeFacts, TensorFacts, is_bake};
pub use brdf::{BrdfFacts, brdf_models};
pub use light::{Advice, EnvironmentFacts};
pub use mesh::{MaterialFacts, MeshFacts, is_mesh};
pub use plot::polar_plot;
pub use probes::ProbesFacts;
pub use report::{Line, Report};
pub use rti::{LightPositionFacts, PtmFacts, is_lp, is_ptm};
pub use slice::{image_slice, reciprocity_error};
pub use steradian_brdf::Domain;
pub use texture::{LevelFacts, TextureFacts};
pub use transfer::TransferFacts;
