//! Light convolved with a kernel as images in any layout, for other programs.

pub(crate) mod bands;
mod deviation;
pub mod map;
pub(crate) mod measure;
mod plan;
pub(crate) mod rows;
mod synthesis;
mod texel_sums;

pub(crate) use rows::Row;
pub(crate) use synthesis::{at_points, precision, synthesize};

pub use deviation::{Deviation, deviation};
pub use map::{FilteredImage, filter_image, mirror_image};
