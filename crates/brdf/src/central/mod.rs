//! Isotropic reflectance about a central direction: explicit elevation slices and spherical harmonic
//! coefficients ρ̂_lpq.
//!
//! Ramamoorthi & Hanrahan 2002, Frequency Space Environment Map Rendering, sections 5.3.1, 5.5.1 and 5.6.2.
//! f_cos is seen about a **centre** C (the mirror direction of wo, the normal or the tangent): cos θ_i =
//! C·wi, cos θ_o = C·wo, φ = φ_i − φ_o about C. With y_lq = f_lq(θ) · a_q(φ), the real orthonormal harmonics
//! with C as their pole, a_q = (1, √2 cos qφ, √2 sin |q|φ) for q = 0, q > 0, q < 0:
//!
//! - a **slice** holds one elevation: **k_lq(θ_o) = ∫∫ f_cos cos qφ dφ f_lq(θ_i) sin θ_i dθ_i**, so that
//!   f_cos = Σ_l Σ_{|q|≤l} k_l|q|(θ_o) y_lq(wi) a_q(φ_o), and for a light L with coefficients L'_lq about C,
//!   B(C, wo) = Σ_q a_q(φ_o) Σ_l k_l|q|(θ_o) L'_lq. Parseval: ∫ f_cos² dwi = Σ_lq k², q and −q both counted.
//! - **ρ̂_lpq = 2π ∫ k_lq(θ_o) f_pq(θ_o) sin θ_o dθ_o** (5.22: the three passes are φ, θ_i, θ_o), so that
//!   k_lq(θ_o) = Σ_p ρ̂_lpq f_pq(θ_o), f_cos = Σ ρ̂_lp|q| y_lq(wi) y_pq(wo) and the energy
//!   2π ∫∫∫ f_cos² sin θ_i sin θ_o dθ_i dθ_o dφ (right side of 5.18) is Σ_lpq ρ̂², q and −q both counted.
//!
//! θ_o runs over 0 … π: about the mirror direction it is twice the angle between n and wo; about the tangent
//! it is the angle between t and wo; about the normal, where a viewer exists for θ_o < π/2 only, f_cos is
//! continued evenly, f_cos(π − θ_o) = f_cos(θ_o), so that reflectance that does not depend on the viewer
//! needs p = 0 only.
//!
//! **Refused**: anisotropic reflectance, which has a fourth dimension that these expansions do not represent.
//! Only reflectance that depends on t·wi and t·wo alone (Kajiya–Kay, Banks's map) is accepted, about the
//! tangent and with q = 0.

mod bands;
mod choose;
mod error;
mod fit;
mod geometry;
mod kernel;
mod lpq;
mod project;
mod ring;
mod rule;
mod slices;
#[cfg(test)]
mod tests;
mod theta;
mod waves;

pub use choose::best_centre;
pub use error::CentralError;
pub use fit::Scale;
pub use geometry::{Argument, Centre, Slice};
pub use lpq::Lpq;
pub use slices::Slices;
pub use theta::Polar;

/// Highest order F, P or Q: below it f_lq needs no extended exponent.
pub const MAX_ORDER: usize = 255;
