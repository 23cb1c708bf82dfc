//! Code that several techniques share: techniques never import techniques. There is a folder for each factor
//! that techniques multiply (light, material, geometry, surface), and more for tables, points and numbers.

pub mod geometry;
pub mod light;
pub mod material;
pub mod maths;
pub mod once;
pub mod points;
pub mod shrm;
pub mod surface;
pub mod tables;
pub mod trials;
