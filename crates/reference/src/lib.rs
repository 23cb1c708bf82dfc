//! The judge: adaptive quadrature of the lighting integral ([`Judge`]), and path tracing where there is
//! visibility ([`path`]).

mod judge;
pub mod path;

pub use judge::{Estimate, Judge, JudgeError, JudgePoint, Lookup, MAX_EVALUATIONS};
