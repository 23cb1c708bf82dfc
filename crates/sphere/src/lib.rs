//! Functions on the unit sphere.
//!
//! Conventions: right-handed world, +Y up; directions are unit vectors away from the surface; angles in
//! radians. Lat-long images have `u = 0.5 + atan2(z, x)/2π`, `v = acos(y)/π`, row 0 at +Y; a texel's value
//! is the function at its centre, and centres lie at half-integers.

pub use glam;

pub mod frame;
pub mod image;
pub mod layout;
pub mod quadrature;
pub mod sampling;
pub mod sg;
pub mod sh;
#[cfg(test)]
mod small;
pub mod wavelet;

pub use frame::Frame;
pub use image::SphereImage;
pub use layout::Layout;
pub use sh::fft;
