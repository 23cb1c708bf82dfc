//! Spherical harmonic reflection maps: products of distant light and kernels about a central direction.
//!
//! Ramamoorthi & Hanrahan 2002, "Frequency Space Environment Map Rendering". A reflectance recentred about a
//! central direction C (the mirror direction, the normal, the tangent) with coefficients ρ̂_lpq (5.22) turns
//! light into
//!
//! ```text
//! B(C, wo') = Σ_pq B_pq(C) y_pq(wo'),   B_pq(C) = Σ_l ρ̂_lp|q| L'_lq(C)                           (5.9,
//! 5.10)
//! L'_lq(C) = ∫ L(wi) y_lq(R_C⁻¹ wi) dwi,   R_C = [x' y' z'] the frame at C (see [`frame`])
//! ```
//!
//! with y the real orthonormal basis about z', in local coordinates; |q| ≤ min(l, p). Slices at an elevation
//! θ_o are the same with κ_l|q|(θ_o) for ρ̂ and a_q(φ_o) = 1, √2 cos qφ_o, √2 sin |q|φ_o ([`azimuth`]) for y:
//! their kernels are Σ_p ρ̂_lpq f_pq(θ_o), y_pq = f_pq a_q. A [`Term`] is one such product and knows nothing
//! of reflectance; [`Plan`] makes the [`CoefficientMaps`] of many.

pub mod choice;
mod combine;
pub mod error;
pub mod explicit;
mod fourier;
pub mod global;
mod grid;
mod maps;
mod plan;
mod recursion;
pub mod resolution;
pub mod spectral_error;
mod sums;
#[cfg(test)]
mod tests;

pub use grid::{Grid, angles_in, frame, frame_at};
pub use maps::{CoefficientMaps, Key, azimuth};
pub use plan::{Plan, Term};

/// The pairs (p, q), 0 ≤ q ≤ p ≤ P, in the order that complete local maps are kept in: by q, then by p. The
/// terms of [`Plan::maps`] in this order give maps that [`global`] and [`explicit`] understand.
pub fn pairs(p: usize) -> Vec<(usize, usize)> {
    (0..=p).flat_map(|q| (q..=p).map(move |p| (p, q))).collect()
}
