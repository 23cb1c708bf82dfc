//! Techniques on the GPU: a wgpu device, and pipelines made from a technique's plain-data description
//! ([`steradian_technique::GpuTechnique`]). This crate names no technique.
//!
//! Vulkan, Metal and DX12; not the GL back end, whose cube lookups are not seamless and which lacks 32-bit
//! float targets. Failures (no adapter, missing features, out of memory, a lost device) are [`GpuError`]s.
//!
//! Without the feature `device` the crate assembles shaders ([`program`]) and packs their data ([`packed`],
//! [`lights`]), from which pages for browsers are made.

#[cfg(feature = "device")]
mod compute;
#[cfg(feature = "device")]
mod device;
#[cfg(feature = "device")]
mod direct;
mod error;
#[cfg(feature = "device")]
mod layout;
pub mod lights;
pub mod packed;
pub mod program;
#[cfg(feature = "device")]
pub mod refilter;
#[cfg(feature = "device")]
mod renderer;
pub mod scene;
#[cfg(feature = "device")]
mod technique;

#[cfg(feature = "device")]
pub use compute::ComputeTechnique;
#[cfg(feature = "device")]
pub use device::Gpu;
pub use error::GpuError;
#[cfg(feature = "device")]
pub use renderer::Renderer;
#[cfg(feature = "device")]
pub use technique::TechniqueData;
