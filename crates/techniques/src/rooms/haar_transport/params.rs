//! Parameters.

use steradian_base::{ParamInfo, params};

/// Words of `fix`.
const FIX: [&str; 2] = ["nothing", "view"];

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// log2 of the texels a side of a face.
        pub size: usize = ParamInfo::whole("size", [2.0, 7.0], 6.0, "binary logarithm of the texels a side of a cube face: 6 is 64"),
        /// Wavelets of the light in a frame.
        pub wavelets: usize = ParamInfo::whole("wavelets", [6.0, 98304.0], 200.0, "wavelets of the light that a frame sums, the six scaling functions among them"),
        /// Measure by which wavelets are chosen, an index of the choices.
        pub choice: usize = ParamInfo::choice("choice", &["transport", "magnitude", "area"], "by what wavelets of the light are chosen: its coefficient times the length of the transport's column, the coefficient alone, or times the wavelet's area"),
        /// Part of each site's transport that is left out.
        pub precision: f64 = ParamInfo::real("precision", [0.0, 0.5], 0.07, "part of each site's transport vector that is left out: of the geometric mean of the lengths of what is blocked and of the cosine over the texels, or with fix=view the square root of the part of the sum over wavelets of squares over means, which keeps tails of lobes"),
        /// Scattering events.
        pub bounces: usize = ParamInfo::whole("bounces", [1.0, 64.0], 1.0, "scattering events at surfaces: 1 is direct light alone; what is reflected is smooth, and held in spherical harmonics"),
        /// Bands of reflected light.
        pub bands: usize = ParamInfo::whole("bands", [1.0, 6.0], 5.0, "bands of spherical harmonics of reflected light"),
        /// Quantity that is static, an index of the choices.
        pub fix: usize = ParamInfo::choice("fix", &FIX, "what stands still: view, for which vertices of a mesh keep their transport, of any reflectance; the light may turn and change"),
    }
}

/// Quantity that is static, so that sites can keep data that depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fix {
    Nothing,
    View,
}

impl Params {
    pub(super) fn fix(&self) -> Fix {
        [Fix::Nothing, Fix::View][self.fix.min(1)]
    }

    pub(super) fn side(&self) -> usize {
        1 << self.size
    }
}
