//! Parameters of spherical harmonic reflection maps.

use crate::shared::material::kernels::Kernels;
use steradian_base::{ParamInfo, params};
use steradian_brdf::central::{Argument, Centre};
use steradian_prefilter::shrm::choice::Options;

params! {
    /// Orders and resolutions, or how to find them.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Orders {
        /// The central direction; chosen by measured energy where `None`.
        pub centre: Option<Centre> = ParamInfo::choice("centre", &Centre::NAMES, "central direction, tangent for kajiya-kay and banks-map; auto: by measured energy").numbered(1.0).auto(0.0),
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
    /// Options of the choice of an expansion of `kernels`. Suns can be shaded apart where the reflectance is
    /// kept.
    pub fn options(&self, kernels: &Kernels) -> Options {
        let published = self.plain || self.energy_epsilon.is_some();
        let view = published || self.of_view || kernels.slices.centre != Centre::Reflection;
        let lights = if kernels.brdf.is_some() { self.lights } else { Some(0) };
        Options {
            order: self.order,
            p: self.p,
            energy_epsilon: self.energy_epsilon,
            plain: self.plain,
            of: if view { Argument::View } else { Argument::Normal },
            size: self.size,
            lights,
        }
    }
}
