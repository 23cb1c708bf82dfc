//! The reference: adaptive quadrature of the lighting integral ([`Reference`]), and path tracing where there
//! is visibility ([`path`]).

pub mod path;
mod quadrature;

pub use quadrature::{Estimate, Lookup, MAX_EVALUATIONS, Reference, ReferenceError, ReferencePoint};
