//! Kernels that light is convolved with: functions of the angle to a direction, and their coefficients.

mod fibre;
pub(crate) mod legendre;
mod lobes;
mod octaves;
pub(crate) mod profile;
mod radial;
pub(crate) mod split;
pub(crate) mod zonal;

pub use fibre::FibreKernel;
pub use lobes::Lobe;
pub use radial::Radial;
pub use zonal::{Cosine, GgxMirror, Power, Zonal, quadrature};
