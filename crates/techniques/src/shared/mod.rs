//! What rooms share: rooms never import rooms.

pub mod albedo;
pub mod apart;
pub mod batch;
pub mod bundle;
pub mod chain;
pub mod distant;
pub mod exact;
pub mod harmonics;
pub mod kernels;
pub mod lights;
pub mod lobe;
pub mod meter;
pub mod once;
pub mod quadric;
pub mod reflectance;
pub mod shrm;
pub mod sky;
pub mod spectrum;
pub mod strands;
pub mod sun;
pub mod tables;
#[cfg(test)]
pub mod trial;
pub mod turn;
pub mod views;
