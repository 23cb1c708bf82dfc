//! Published techniques, one module each, behind one interface.
//!
//! A [`Technique`] bakes light, reflectance and geometry each on its own, links them, and shades batches of
//! points. [`registry`] lists all techniques without their types ([`AnyTechnique`], [`AnyBake`]); commands and
//! windows know no technique by name.

mod bibliography;
pub mod certify;
pub mod direct;
pub mod gpu;
mod interface;
pub mod local;
mod registry;
pub mod rooms;
mod saved;
pub mod shared;
pub mod tensors;

pub use bibliography::{bibtex, cards};
pub use certify::{Estimate, Model, Report, Target};
pub use gpu::GpuTechnique;
pub use interface::{
    AnyBake, AnyTechnique, Bake, BakeError, Capabilities, Card, Check, Claim, Erased, Geometry, Material,
    Needs, Part, Parts, PointChart, PointLobe, Points, PointsBuf, Radiance, Sites, SitesAt, Technique,
    Varies, View,
};
pub use local::{AnyLocal, LocalBake, LocalLights, find_local, locals};
pub use registry::{find, registry};
pub use saved::{BakedMesh, IN_FOLDER, Made, SavedBake, SavedError, SavedLocal, not_finite, seal};
pub use shared::surface::reflectance::TexelReflectance;
pub use tensors::TensorFile;
