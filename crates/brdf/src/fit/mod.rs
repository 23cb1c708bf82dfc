//! Compact representations of any reflectance; they do not depend on the light.

pub mod gaussian;
pub mod radial;
