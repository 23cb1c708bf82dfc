//! The parameters.

use steradian_base::{ParamInfo, params};

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// A factor over n?
        pub n: bool = ParamInfo::switch("normal", true, "a factor over n"),
        /// A factor over r?
        pub r: bool = ParamInfo::switch("mirror", true, "a factor over r"),
        /// A factor over n·wo?
        pub line: bool = ParamInfo::switch("elevation", true, "a factor over n·wo"),
        /// A factor over wo?
        pub wo: bool = ParamInfo::switch("viewer", false, "a factor over wo, with a quarter of the others' size"),
        /// Intervals per cube edge; where `None`, as many as the reflectance needs.
        pub size: Option<usize> = ParamInfo::whole("size", [1.0, 128.0], 0.0, "intervals per cube edge of the factors over n and r; auto: 16 or 24, as fine as the reflectance needs").auto(0.0).unit("texels"),
        /// Power of the radiance by which errors of its logarithm count.
        pub weight: f64 = ParamInfo::real("weight", [0.0, 1.0], 0.5, "what the fit minimises: 1 the absolute error of the radiance, which suns and grazing views rule, 0 its relative error, which the dark parts rule"),
    }
}
