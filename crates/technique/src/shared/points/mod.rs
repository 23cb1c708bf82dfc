//! Batches of points: the loop over them, and their central directions.

pub mod batch;
pub mod central;
