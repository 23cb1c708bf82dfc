//! Small functions in single precision that kernels and their shaders share.

pub mod angle;
pub mod harmonics;
pub mod number;
pub mod quadric;
pub mod vector;
