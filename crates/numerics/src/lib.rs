//! Linear algebra that several crates need: small dense systems and eigenvectors, in double precision, one
//! thread; sparse least squares, and products and singular values of large dense matrices, on all cores, with
//! sums in fixed blocks, so that the number of threads changes no bit.
//!
//! Small dense matrices are rows of numbers, `a[i][j]`.

pub mod clusters;
pub mod dense;
pub mod eigen;
pub mod low_rank;
pub mod lsqr;
pub mod matrix;
pub mod products;
pub mod svd;
