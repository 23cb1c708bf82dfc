//! The parameters.

use steradian_base::{ParamInfo, params};
use steradian_brdf::fit::gaussian::MIN_HALF_VECTORS;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// K.
        pub lobes: usize = ParamInfo::whole("lobes", [1.0, 4.0], 3.0, "K, Gaussians of every view (a fit from a file keeps its own)"),
        /// N.
        pub views: usize = ParamInfo::whole("views", [2.0, 64.0], 15.0, "N, elevations of the view, equally spaced from 0 to 89 degrees (a fit from a file keeps its own)"),
        /// Objective of the fit: 0 with the albedo kept, 1 eq. 8.
        pub objective: usize = ParamInfo::choice("objective", &["energy", "published"], "least squares with the albedo of each view kept, or without that condition (eq. 8)").preset("energy"),
        /// M.
        pub azimuths: usize = ParamInfo::whole("azimuths", [4.0, 64.0], 36.0, "M, azimuths of the view where reflectance is anisotropic (a fit from a file keeps its own)"),
        /// Shape of the fit's lobes: 0 round, 1 stretched.
        pub shape: usize = ParamInfo::choice("shape", &["round", "stretched"], "round lobes as the paper's, or each swept along the plane of incidence by its own angle: more lookups, far closer at grazing views (a fit from a file keeps its own; those of anisotropic reflectance are stretched, along any direction)").preset("round"),
        /// Lobes of anisotropic reflectance: 0 about half vectors, 1 swept.
        pub anisotropic: usize = ParamInfo::choice("anisotropic", &["half-vectors", "swept"], "where reflectance is anisotropic: round Gaussians about mirror images of the view in fixed half vectors, or K lobes, each swept along a direction of its own").preset("half-vectors"),
        /// Half vectors at most.
        pub half_vectors: usize = ParamInfo::whole("half_vectors", [MIN_HALF_VECTORS as f64, MAX_HALF_VECTORS], 176.0, "Gaussians of anisotropic reflectance at most, of which a third to a half are in use at a view"),
        /// Lookups of a lobe at most.
        pub taps: usize = ParamInfo::whole("taps", [1.0, MAX_TAPS], 16.0, "lookups of the most stretched lobe; beyond it lookups widen"),
        /// Bands of visibility, an index of [`VISIBILITY`].
        pub visibility: usize = ParamInfo::choice("visibility", &VISIBILITY, "what a mesh blocks of its own light, by spherical harmonics at its vertices: nothing; the unblocked fraction of the hemisphere; visibility at each lobe's mean (eq. 7); or its mean over the lobe"),
        /// Bands of visibility.
        pub visibility_bands: usize = ParamInfo::whole("visibility_bands", [2.0, 4.0], 4.0, "bands of spherical harmonics of visibility"),
        /// Absolute error of the coefficients of transfer.
        pub precision: f64 = ParamInfo::real("precision", [1e-4, 0.1], 5e-3, "absolute error of the coefficients of transfer, with visibility"),
        /// σ of level 1, degrees.
        pub sigma: f64 = ParamInfo::real("sigma", [0.25, 30.0], 1.0, "width of the first filtered map; level 0 is the light itself").unit("degrees"),
        /// Intervals per cube edge of level 0; the environment's own where `None`.
        pub size: Option<usize> = ParamInfo::whole("size", [1.0, 1024.0], 0.0, "intervals per cube edge; auto: as fine as the environment, at most 256").auto(0.0).unit("texels"),
    }
}

/// Most Gaussians about half vectors.
pub(super) const MAX_HALF_VECTORS: f64 = 256.0;
/// Most lookups of a lobe.
pub(super) const MAX_TAPS: f64 = 64.0;
/// Words of `visibility`.
const VISIBILITY: [&str; 4] = ["none", "ambient", "published", "convolved"];

impl Params {
    /// Does anything block light?
    pub(super) fn is_shadowed(&self) -> bool {
        self.visibility > 0
    }

    /// Bands of visibility: the fraction of the hemisphere is one.
    pub(super) fn bands(&self) -> usize {
        if self.visibility == 1 { 1 } else { self.visibility_bands }
    }

    /// Is visibility convolved with the lobe?
    pub(super) fn is_convolved(&self) -> bool {
        self.visibility == 3
    }
}
