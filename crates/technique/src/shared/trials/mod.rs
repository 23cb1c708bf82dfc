//! What tests, claims and benchmarks try techniques with: lights and textures by formula.

pub mod lights;
pub mod specimens;
