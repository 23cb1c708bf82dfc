//! Compact representations of any reflectance; they know no light.

pub mod gaussian;
pub mod radial;
