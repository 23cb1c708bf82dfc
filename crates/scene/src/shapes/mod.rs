//! Built-in shapes.

mod sphere;

pub use sphere::sphere;
