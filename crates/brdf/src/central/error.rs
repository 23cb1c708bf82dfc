//! Why a reflectance has no expansion about a centre.

use steradian_base::Cancelled;

/// Why an expansion cannot be made; displays as one line that says what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CentralError {
    /// Four-dimensional reflectance about the normal or the mirror direction.
    #[error(
        "{spec} is anisotropic: reflection maps hold isotropic reflectance only; give equal widths along both axes"
    )]
    Anisotropic {
        /// The reflectance.
        spec: String,
    },
    /// Not a function of t·wi and t·wo.
    #[error("{spec} depends on more than t·wi and t·wo: it cannot be centred about the tangent")]
    NotTangent {
        /// The reflectance.
        spec: String,
    },
    /// An order beyond [`super::MAX_ORDER`].
    #[error("order {order} is beyond {}: ask for less", super::MAX_ORDER)]
    Order {
        /// Order of the request.
        order: usize,
    },
    /// A view elevation or a lean that cannot be.
    #[error("slice with view angle {} and centre at {} degrees from the normal: {what}", .theta_v.to_degrees(), .gamma.to_degrees())]
    Slice {
        /// Angle of the view from the normal, radians.
        theta_v: f64,
        /// Angle of the centre from the normal, radians.
        gamma: f64,
        /// The fault.
        what: &'static str,
    },
    /// Too few slices for the fit.
    #[error("{slices} slices do not determine {terms} terms in elevation: give more slices")]
    TooFew {
        /// Slices given.
        slices: usize,
        /// Terms of the fit.
        terms: usize,
    },
    /// f_cos is infinite or not a number somewhere.
    #[error("{spec} is not finite where the view is {} degrees from the normal", .theta_v.to_degrees())]
    NotFinite {
        /// The reflectance.
        spec: String,
        /// Angle of the view from the normal, radians.
        theta_v: f64,
    },
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
