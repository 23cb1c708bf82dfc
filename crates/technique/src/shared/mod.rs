//! What techniques share: techniques never import techniques. A folder each for the factors that techniques
//! multiply (light, material, geometry, surface), and for what shading needs of tables, points and numbers.

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
