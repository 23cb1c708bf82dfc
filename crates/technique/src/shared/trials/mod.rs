//! Lights and textures by formula, for tests, claims and benchmarks.

pub mod lights;
pub mod specimens;
