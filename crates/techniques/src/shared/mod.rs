//! What rooms share: rooms never import rooms.

pub mod albedo;
pub mod batch;
pub mod certify;
pub mod chain;
pub mod distant;
pub mod lights;
pub mod lobe;
pub mod once;
pub mod quadric;
pub mod reflectance;
pub mod tables;
pub mod turn;
