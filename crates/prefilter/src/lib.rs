//! Light times reflectance: the filters. They see kernels and coefficients, never a reflectance's formula.
//!
//! [`Source`] prepares distant light, [`Zonal`] kernels say what it is convolved with, [`filter::filter`] makes a
//! cube map ([`EdgeCube`]) of the convolution to a tolerance, in frequency space or by direct summation over
//! a hierarchy of the light ([`Tree`]). [`Sampled`] and [`filter_image`] make images in any layout for other programs.

pub mod angular;
mod bands;
mod beam;
mod cell;
mod cells;
mod cone;
mod deviation;
pub mod edge_cube;
pub mod filter;
mod kernel;
mod legendre;
mod lobes;
pub mod map;
mod measure;
pub mod methods;
mod polar;
pub mod probe;
mod profile;
mod pursuit;
mod radial;
mod rows;
mod sampled;
pub mod shrm;
#[cfg(test)]
mod small;
pub mod source;
mod split;
mod stack;
mod synthesis;
mod texels;
mod tree;
mod ways;

pub use beam::Beam;
pub use cell::Cell;
pub use cone::Cone;
pub use deviation::{Deviation, deviation};
pub use edge_cube::EdgeCube;
pub use filter::{Filtered, Size, Way, filter};
pub use kernel::{Cosine, GgxMirror, Power, Zonal, quadrature};
pub use lobes::Lobe;
pub use map::{FilteredImage, filter_image, mirror_image};
pub use pursuit::Pursuit;
pub use radial::Radial;
pub use sampled::Sampled;
pub use source::Source;
pub use stack::{Stack, stack};
pub use tree::Tree;
