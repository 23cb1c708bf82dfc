//! Parameters of spherical harmonic reflection maps.

use crate::shared::material::kernels::centre_of;
use steradian_base::{ParamInfo, params};
use steradian_brdf::central::{Argument, Centre};

params! {
    /// Orders and resolutions, or how to find them.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Orders {
        /// Index of the central direction among the words; chosen by measured energy where `None`.
        pub centre: Option<usize> = ParamInfo::choice("centre", &["mirror-direction", "normal", "tangent"], "central direction, tangent for kajiya-kay and banks-map; auto: by measured energy").numbered(1.0).auto(0.0),
        /// F.
        pub order: Option<usize> = ParamInfo::whole("order", [0.0, 255.0], 0.0, "F, the highest l; auto: what the tolerance needs").auto(-1.0),
        /// P.
        pub p: Option<usize> = ParamInfo::whole("p", [0.0, 30.0], 0.0, "P, the highest p; auto: what the tolerance needs, about 5 at most").auto(-1.0),
        /// ε of (5.18); by tolerance where `None`.
        pub energy_epsilon: Option<f64> = ParamInfo::real("energy_epsilon", [0.0, 1.0], 0.0, "share of the reflectance's energy that orders may miss (eq. 5.18: a squared error); auto: use the tolerance").auto(0.0),
        /// The paper's projection.
        pub plain: bool = ParamInfo::switch("plain", false, "the paper's projection, of the view; off: a fit weighted by elevation of what is left when the albedo is divided out"),
        /// Are y_pq functions of the view, whatever the centre?
        pub of_view: bool = ParamInfo::switch("of_view", false, "harmonics of the view, as published; off: of the normal about the mirror direction, which hold at grazing"),
        /// S; by tolerance where `None`.
        pub size: Option<usize> = ParamInfo::whole("size", [1.0, 2048.0], 0.0, "S: intervals from pole to pole of the maps (per edge of cubes); auto: what the tolerance needs").auto(0.0).unit("texels"),
        /// 16-bit maps.
        pub halves: bool = ParamInfo::switch("halves", false, "maps of 16-bit floats"),
        /// Number of suns that are shaded separately; by tolerance where `None`.
        pub lights: Option<usize> = ParamInfo::whole("lights", [0.0, 64.0], 0.0, "suns that are taken out of the light and shaded with the exact reflectance; auto: as few as the tolerance needs, mostly none, at most 16; none where F or P is given, or the orders are as published").auto(-1.0),
    }
}

impl Orders {
    /// Do the parameters ask for the paper's projection, directly or by its energy criterion?
    pub fn published(&self) -> bool {
        self.plain || self.energy_epsilon.is_some()
    }

    /// Are F or P given, or as published?
    pub fn given(&self) -> bool {
        self.p.is_some() || self.order.is_some() || self.published()
    }

    /// The direction that y_pq are functions of.
    pub fn argument(&self, centre: Centre) -> Argument {
        let view = self.published() || self.of_view || centre != Centre::Reflection;
        if view { Argument::View } else { Argument::Normal }
    }

    /// The central direction that the parameter gives.
    pub fn centre(&self) -> Option<Centre> {
        centre_of(self.centre? as f64 + 1.0)
    }
}

/// The number of an argument in files and on GPUs.
pub fn argument_word(of: Argument) -> f64 {
    f64::from(u8::from(of == Argument::Normal))
}

/// The argument that a number in files means.
pub fn argument_of(word: f64) -> Argument {
    if word == 1.0 { Argument::Normal } else { Argument::View }
}
