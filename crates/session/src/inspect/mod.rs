//! What inputs are.

mod brdf;
mod light;
mod mesh;
mod plot;
mod rti;
mod texture;

pub use brdf::{BrdfFacts, brdf_models};
pub use light::{Advice, EnvironmentFacts};
pub use mesh::{MeshFacts, is_mesh};
pub use plot::polar_plot;
pub use rti::{LightPositionFacts, PtmFacts, is_lp, is_ptm};
pub use steradian_brdf::Domain;
pub use texture::{LevelFacts, TextureFacts};
