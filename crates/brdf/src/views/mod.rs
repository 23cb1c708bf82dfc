//! Reflectance as coefficients of spherical harmonics, view by view.
//!
//! In the surface's frame [`Rule`] projects f_cos(·, wo) for any one view, [`paraboloid`] for all of a table,
//! and [`Energies`] say what bands and lookups leave out. In the viewer's frame [`Slices`] hold isotropic
//! reflectance by the elevation of the normal alone. Neither knows any light.

mod energies;
mod panels;
pub mod paraboloid;
mod projection;
mod quadrature;
mod slices;

pub use energies::{ANGLES, Energies, ORDER};
pub use projection::{Projection, Rule};
pub use slices::{Slices, half_count, lambertian_part};
