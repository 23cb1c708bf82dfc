//! The parameters.

use steradian_base::{ParamInfo, params};

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// 3: a stack over the elevation; 2: one map.
        pub dimensions: usize = ParamInfo::whole("dimensions", [2.0, 3.0], 3.0, "3: a stack of maps over the elevation (eq. 29); 2: one map (eq. 31)"),
        /// Lobes.
        pub lobes: usize = ParamInfo::whole("lobes", [1.0, 4.0], 1.0, "lobes that are summed, each with maps of its own"),
        /// Axes: 0 the mirror direction, 1 off it.
        pub axis: usize = ParamInfo::choice("axis", &["mirror-direction", "off-specular"], "lobes about the mirror direction r, or about o(r), what captures most of each lobe").numbered(0.0).preset("off-specular"),
        /// Is n·wi inside the mean over the azimuth, rather than n·r outside the integral?
        pub cosine: bool = ParamInfo::switch("cosine", true, "n·wi inside the mean over the azimuth, which keeps the energy of every view; off: outside the integral as n·r, as eqs. 29 and 31 are printed"),
        /// Elevations in a stack.
        pub elevations: usize = ParamInfo::whole("elevations", [2.0, 64.0], 17.0, "elevations in the stack, the denser the nearer to grazing"),
        /// Intervals per cube edge; where `None`, as many as the tolerance needs.
        pub size: Option<usize> = ParamInfo::whole("size", [1.0, 1024.0], 0.0, "intervals per cube edge; auto: what the tolerance needs, at most 128").auto(0.0).unit("texels"),
    }
}
