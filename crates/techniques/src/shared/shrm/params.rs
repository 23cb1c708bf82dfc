//! Parameters of spherical harmonic reflection maps.

use crate::shared::kernels::{centre_of, word};
use steradian_base::{ParamError, ParamInfo, ParamValues};
use steradian_brdf::central::{Argument, Centre};

const CENTRE: ParamInfo = ParamInfo::whole(
    "centre",
    [0.0, 3.0],
    0.0,
    "central direction: 1 mirror direction, 2 normal, 3 tangent (kajiya-kay, banks-map); 0: by measured energy",
);
const ORDER: ParamInfo =
    ParamInfo::whole("order", [-1.0, 255.0], -1.0, "F, the highest l; -1: what the tolerance needs");
const P: ParamInfo = ParamInfo::whole(
    "p",
    [-1.0, 30.0],
    -1.0,
    "P, the highest p; -1: what the tolerance needs, about 5 at most",
);
const EPSILON: ParamInfo = ParamInfo::real(
    "energy_epsilon",
    [0.0, 1.0],
    0.0,
    "share of the reflectance's energy that orders may miss (eq. 5.18: a squared error); 0: use the tolerance",
);
const PLAIN: ParamInfo = ParamInfo::switch(
    "plain",
    false,
    "1: the paper's projection, of the view; 0: a fit weighted by elevation of what is left when the albedo is \
     divided out",
);
const OF_VIEW: ParamInfo = ParamInfo::switch(
    "of_view",
    false,
    "1: harmonics of the view, as published; 0: of the normal about the mirror direction, which hold at grazing",
);
const SIZE: ParamInfo = ParamInfo::whole(
    "size",
    [0.0, 2048.0],
    0.0,
    "S: intervals from pole to pole of the maps (per edge of cubes); 0: what the tolerance needs",
)
.unit("texels");
const HALVES: ParamInfo = ParamInfo::switch("halves", false, "1: maps of 16-bit floats");
const LIGHTS: ParamInfo = ParamInfo::whole(
    "lights",
    [-1.0, 64.0],
    -1.0,
    "suns that are taken out of the light and shaded with the exact reflectance; -1: as few as the tolerance needs, \
     mostly none, at most 16; none where F or P is given, or the orders are as published",
);

/// Orders and resolutions, or how to find them.
#[derive(Debug, Clone, PartialEq)]
pub struct Orders {
    /// The central direction; by measured energy where `None`.
    pub centre: Option<Centre>,
    /// F.
    pub order: Option<usize>,
    /// P.
    pub p: Option<usize>,
    /// ε of (5.18); 0: by tolerance.
    pub energy_epsilon: f64,
    /// The paper's projection.
    pub plain: bool,
    /// y_pq of the view, whatever the centre.
    pub of_view: bool,
    /// S; 0: by tolerance.
    pub size: usize,
    /// 16-bit maps.
    pub halves: bool,
    /// Suns apart; by tolerance where `None`.
    pub lights: Option<usize>,
}

/// All of them.
pub const ORDERS: [ParamInfo; 9] = [CENTRE, ORDER, P, EPSILON, PLAIN, OF_VIEW, SIZE, HALVES, LIGHTS];

impl Orders {
    /// Is the paper's projection asked for, in words or by its energy?
    pub fn published(&self) -> bool {
        self.plain || self.energy_epsilon > 0.0
    }

    /// Are F or P given, or as published?
    pub fn given(&self) -> bool {
        self.p.is_some() || self.order.is_some() || self.published()
    }

    /// What y_pq are functions of.
    pub fn argument(&self, centre: Centre) -> Argument {
        let view = self.published() || self.of_view || centre != Centre::Reflection;
        if view { Argument::View } else { Argument::Normal }
    }

    /// From values that somebody has checked.
    pub fn read(values: &ParamValues) -> Self {
        let get = |i: &ParamInfo| values.get(i);
        let least = |i: &ParamInfo| Some(values.get(i)).filter(|x| *x >= 0.0).map(|x| x as usize);
        Self {
            centre: centre_of(get(&CENTRE)),
            order: least(&ORDER),
            p: least(&P),
            energy_epsilon: get(&EPSILON),
            plain: get(&PLAIN) > 0.0,
            of_view: get(&OF_VIEW) > 0.0,
            size: get(&SIZE) as usize,
            halves: get(&HALVES) > 0.0,
            lights: least(&LIGHTS),
        }
    }
}

impl steradian_base::Params for Orders {
    const INFO: &'static [ParamInfo] = &ORDERS;

    fn from_values(values: &ParamValues) -> Result<Self, ParamError> {
        values.check(Self::INFO)?;
        Ok(Self::read(values))
    }

    fn to_values(&self) -> ParamValues {
        let optional = |x: Option<usize>| x.map_or(-1.0, |x| x as f64);
        let pairs = [
            (CENTRE, self.centre.map_or(0.0, word)),
            (ORDER, optional(self.order)),
            (P, optional(self.p)),
            (EPSILON, self.energy_epsilon),
            (PLAIN, f64::from(u8::from(self.plain))),
            (OF_VIEW, f64::from(u8::from(self.of_view))),
            (SIZE, self.size as f64),
            (HALVES, f64::from(u8::from(self.halves))),
            (LIGHTS, optional(self.lights)),
        ];
        ParamValues(pairs.into_iter().map(|(i, v)| (i.name.to_string(), v)).collect())
    }
}

/// The number of an argument in files and on GPUs.
pub fn argument_word(of: Argument) -> f64 {
    f64::from(u8::from(of == Argument::Normal))
}

/// The argument that number stands for.
pub fn argument_of(word: f64) -> Argument {
    if word == 1.0 { Argument::Normal } else { Argument::View }
}
