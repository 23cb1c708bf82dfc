//! The judge: adaptive quadrature of the lighting integral ([`Judge`]).

mod judge;

pub use judge::{Estimate, Judge, JudgeError, JudgePoint, Lookup, MAX_EVALUATIONS};
