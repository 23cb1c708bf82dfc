//! Linear algebra that several crates need: small dense systems and eigenvectors, in double precision, one thread; sparse
//! least squares on all cores, with sums in fixed blocks, so that the number of threads changes no bit.
//!
//! Dense matrices are rows of numbers, `a[i][j]`.

pub mod clusters;
pub mod dense;
pub mod eigen;
pub mod lsqr;
