//! Methods of prefiltering by name, for comparison: those of the literature, each implemented here as well as
//! it can be.
//!
//! All answer one question, B(d) = ∫ L(wi) K(d·wi) dwi, at the texel centres of any layout. Four tend to the
//! sum over all texels as their parameter refines (`truncated-angular`, `hierarchical`, `lat-long-angular`,
//! `frequency`); three are approximations that graphics hardware affords (`per-face`, `box-mip`,
//! `dual-paraboloid`) and tend to it only as the lobe narrows. A constant light stays constant under all of
//! them: weights are divided by their sum, as ATI's CubeMapGen (2005) did first; where a paper's own method
//! loses light, the documentation of its module says so.

mod box_mip;
mod brute;
mod cost;
mod dual_paraboloid;
mod frequency;
mod grid;
mod hierarchical;
mod lat_long;
mod per_face;
mod table;
#[cfg(test)]
mod tests;
mod truncated;

pub use box_mip::{BoxMip, effective_sigma};
pub use brute::brute;
pub use cost::{Cost, Model, Problem};
pub use dual_paraboloid::{Footprint, Lookup, Paraboloids, dual_paraboloid, paraboloids};
pub use frequency::frequency;
pub use grid::{Made, Shape, band_limit, reach};
pub use hierarchical::hierarchical;
pub use lat_long::{lat_long_angular, lat_long_bytes};
pub use per_face::per_face;
pub use truncated::truncated_angular;

use crate::{Sampled, Zonal};
use steradian_base::{Cancelled, Task};

/// Part ε of a kernel that is cut, over the tolerance.
const EPSILON: f64 = 0.2;

/// A way to prefilter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Method {
    /// Every texel of the light for every texel of the map.
    Brute,
    /// The texels within the angle that holds all but ε of the kernel.
    TruncatedAngular,
    /// Far and smooth parts of the light taken together.
    Hierarchical,
    /// Rows of a lat-long image against rows: products of azimuthal frequencies.
    LatLongAngular,
    /// Planar convolution of each cube face with its four neighbours around it.
    PerFace,
    /// The matching level of a box-filtered mip chain.
    BoxMip,
    /// Planar convolution of two paraboloids with the smallest and the largest radius.
    DualParaboloid,
    /// Spherical harmonics.
    Frequency,
}

/// Description of a method.
#[derive(Debug, Clone, Copy)]
pub struct Card {
    /// Name on the command line.
    pub name: &'static str,
    /// Who described it, and where.
    pub source: &'static str,
    /// The equation that it evaluates.
    pub equation: &'static str,
    /// When it tends to the sum over all texels.
    pub exact_when: &'static str,
}

impl Method {
    /// All of them, the reference first.
    pub const ALL: [Self; 8] = [
        Self::Brute,
        Self::TruncatedAngular,
        Self::Hierarchical,
        Self::LatLongAngular,
        Self::PerFace,
        Self::BoxMip,
        Self::DualParaboloid,
        Self::Frequency,
    ];

    /// Description of the method.
    pub fn card(self) -> &'static Card {
        match self {
            Self::Brute => &brute::CARD,
            Self::TruncatedAngular => &truncated::CARD,
            Self::Hierarchical => &hierarchical::CARD,
            Self::LatLongAngular => &lat_long::CARD,
            Self::PerFace => &per_face::CARD,
            Self::BoxMip => &box_mip::CARD,
            Self::DualParaboloid => &dual_paraboloid::CARD,
            Self::Frequency => &frequency::CARD,
        }
    }

    /// Name of the method.
    pub fn name(self) -> &'static str {
        self.card().name
    }

    /// The way of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|m| m.name() == name)
    }

    /// Does it tend to the sum over all texels as its parameter refines, whatever the kernel?
    pub fn converges(self) -> bool {
        !matches!(self, Self::PerFace | Self::BoxMip | Self::DualParaboloid)
    }

    /// Bytes of work space of [`Self::filter`], in addition to the light and the map, where they grow with
    /// the kernel's bands; else 0.
    pub fn bytes(self, light: &Sampled, kernel: &dyn Zonal, shape: Shape, tolerance: f64) -> u64 {
        match self {
            Self::LatLongAngular => lat_long_bytes(light, kernel, shape, EPSILON * tolerance),
            _ => 0,
        }
    }

    /// ∫ L K at the texel centres of `shape`, to about `tolerance` where the way can.
    pub fn filter(
        self,
        light: &Sampled,
        kernel: &dyn Zonal,
        shape: Shape,
        tolerance: f64,
        task: &Task,
    ) -> Result<Made, Cancelled> {
        let divided;
        let light = match self {
            Self::Brute | Self::Frequency => light,
            // The remaining methods sample texels at their centres.
            _ => {
                divided = light.divided(kernel);
                &divided
            }
        };
        match self {
            Self::Brute => brute(light, kernel, shape, task),
            Self::TruncatedAngular => truncated_angular(light, kernel, shape, EPSILON * tolerance, task),
            Self::Hierarchical => hierarchical(light, kernel, shape, hierarchical::opening(tolerance), task),
            Self::LatLongAngular => lat_long_angular(light, kernel, shape, EPSILON * tolerance, task),
            Self::PerFace => per_face(light, kernel, shape, per_face::TEXELS, task),
            Self::BoxMip => {
                let lobe = effective_sigma(kernel);
                let chain = BoxMip::new(light, BoxMip::base(light));
                chain.filter(kernel, shape, chain.level(lobe), task)
            }
            Self::DualParaboloid => {
                dual_paraboloid(light, kernel, shape, (dual_paraboloid::TEXELS, dual_paraboloid::RADII), task)
            }
            Self::Frequency => frequency(light, kernel, shape, tolerance, task),
        }
    }
}
