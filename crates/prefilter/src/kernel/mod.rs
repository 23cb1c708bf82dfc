//! What light is convolved with: functions of the angle to a direction, and their coefficients.

mod cells;
mod cone;
pub(crate) mod legendre;
mod lobes;
pub(crate) mod profile;
mod radial;
pub(crate) mod split;
pub(crate) mod zonal;

pub use cone::ConeKernel;
pub use lobes::Lobe;
pub use radial::Radial;
pub use zonal::{Cosine, GgxMirror, Power, Zonal, quadrature};
