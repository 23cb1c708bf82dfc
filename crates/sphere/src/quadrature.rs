//! Quadrature rules on intervals and on the sphere.

mod adaptive;
mod interval;
mod sphere;

pub use adaptive::{Integral, integrate, kronrod};
pub(crate) use interval::gauss_legendre_angles;
pub use interval::{clenshaw_curtis, fejer1, gauss_legendre};
pub use sphere::{SphereRule, fibonacci, product_hemisphere, product_sphere};
