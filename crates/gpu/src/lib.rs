//! Techniques on the GPU: a wgpu device, and pipelines made from a technique's plain-data description
//! ([`steradian_techniques::GpuTechnique`]). This crate names no technique.
//!
//! Vulkan, Metal and DX12; not the GL back end, whose cube lookups are not seamless and which lacks 32-bit
//! float targets. Failures (no adapter, missing features, out of memory, a lost device) are [`GpuError`]s.

mod compute;
mod device;
mod direct;
mod error;
mod layout;
pub mod refilter;
mod renderer;
pub mod scene;
mod technique;

pub use compute::ComputeTechnique;
pub use device::Gpu;
pub use error::GpuError;
pub use renderer::Renderer;
pub use technique::TechniqueData;
