//! Light times reflectance: the filters. They see kernels and coefficients, never a reflectance's formula.
//!
//! [`Source`] prepares distant light, [`Zonal`] is a kernel that it is convolved with, [`filter::filter`]
//! makes a cube map ([`EdgeCube`]) of the convolution to a tolerance, in frequency space or by direct
//! summation over a hierarchy of the light ([`Tree`]). [`Sampled`] and [`filter_image`] make images in any
//! layout for other programs.

mod cube;
mod image;
mod kernel;
mod light;
pub mod methods;
pub mod order;
pub mod probe;
pub mod shrm;
#[cfg(test)]
mod small;
mod view_image;

pub use cube::{
    CubeArray, CubeMethod, EdgeCube, Filtered, Size, angular, cube_array, edge_cube, filter, filter::filter,
    lookup,
};
pub use image::{Deviation, FilteredImage, deviation, filter_image, map, mirror_image};
pub use kernel::{Cosine, FibreKernel, GgxMirror, Lobe, Power, Radial, Zonal, quadrature};
pub use light::{
    Apart, Cell, MatchingPursuit, Sampled, SmallLight, Source, Sun, SunlitSpectrum, Tree, source,
};
pub use view_image::ViewImage;
