//! Parameters.

use steradian_base::{ParamInfo, params};

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Bands of light and transferred light.
        pub bands: usize = ParamInfo::whole("bands", [1.0, 8.0], 5.0, "bands of spherical harmonics"),
        /// Clusters of sites.
        pub clusters: usize = ParamInfo::whole("clusters", [1.0, 2048.0], 256.0, "clusters of sites, fewer where there are few sites"),
        /// Matrices of a cluster in addition to its mean.
        pub components: usize = ParamInfo::whole("components", [0.0, 16.0], 8.0, "matrices of a cluster beside their mean, each with a weight per site"),
        /// Texels along an edge of the table.
        pub size: usize = ParamInfo::whole("size", [16.0, 1024.0], 128.0, "edge of the table of views, of reflectance but phong").unit("texels"),
        /// Absolute error of the coefficients of transfer.
        pub precision: f64 = ParamInfo::real("precision", [1e-4, 0.1], 5e-3, "absolute error of the coefficients of transfer, before compression"),
        /// Where the window ends; 0 for none.
        pub window: f64 = ParamInfo::real("window", [0.0, 32.0], 0.0, "band at which a window of Hann ends that takes ringing off the light; 0: none"),
    }
}
