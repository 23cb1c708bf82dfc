//! The trait of techniques, and the parts that several of them share.
//!
//! A [`Technique`] bakes light, reflectance and geometry each on its own, links them, and shades batches of
//! points; [`local::LocalTechnique`] shades directional and point lights one by one. [`Erased`] and
//! [`local::ErasedLocal`] make both types that a list can hold ([`AnyTechnique`], [`local::AnyLocal`]). The
//! techniques themselves are in the crate `steradian-techniques`; those who only shade with a bake, as
//! renderers do, need this one alone.

pub mod certify;
pub mod direct;
pub mod gpu;
mod interface;
pub mod local;
pub mod shared;
pub mod tensors;

pub use certify::{Estimate, Model, Report, Target};
pub use gpu::GpuTechnique;
pub use interface::{
    AnyBake, AnyTechnique, Bake, BakeError, Capabilities, Card, Check, Claim, Erased, Geometry, Material,
    Needs, Part, Parts, PointChart, PointLobe, Points, PointsBuf, Radiance, Sites, SitesAt, Technique,
    Varies, View,
};
pub use local::{AnyLocal, LocalBake, LocalLights};
pub use shared::surface::reflectance::TexelReflectance;
pub use tensors::TensorFile;
