//! The judge: adaptive quadrature of the lighting integral, and path tracing.
