//! The reflectance's factor: the model itself, and its tables.

pub mod albedo;
pub mod glossy;
pub mod kernels;
pub mod phong_lobe;
pub mod reflectance;
pub mod view_table;
pub mod views;
