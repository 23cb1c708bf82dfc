//! Verification of prefiltered files: levels of any tool's file against the light that they were made from.
//!
//! [`check`] takes levels as images over world directions, their expected kernels, and the light; it returns
//! a [`Report`]. Where a level is off, hypotheses are compared: another orientation, exchanged channels,
//! another curve or kernel, reduced or clipped light, a factor, an encoding. Each is the exact filter of that
//! hypothesis at a few hundred texels of every level; free numbers are fitted to one half of the texels and
//! judged on the other. One is named as the cause only where it explains clearly more than all others; else
//! the report says that none does, and which come nearest.
//!
//! The kernels of each engine's levels are in [`laws`], their layout in the crate `engines`.

mod kernel;
pub mod laws;
mod light;
mod measure;
mod model;
pub mod orientation;
mod report;
mod rings;
mod samples;
mod scale;
mod search;
mod texture;

pub use kernel::{Family, Kernel};
pub use light::{Alteration, Reading};
pub use measure::{Coefficients, Error};
pub use report::{Encoding, Fault, Level, Nearest, Report};
pub use scale::Scale;

use steradian_base::{Cancelled, Task};
use steradian_light::Lights;
use steradian_light::load::Profile;
use steradian_sphere::SphereImage;

/// Inputs of the comparison.
pub struct Input<'a> {
    /// The file's levels, as functions of world direction by the convention of its profile.
    pub levels: &'a [SphereImage],
    /// Expected kernel of each level.
    pub expected: &'a [Kernel],
    /// The curve that `expected` follows, where there is one.
    pub law: laws::Law,
    /// The light.
    pub lights: &'a Lights,
    /// The convention by which the light was read. Where the file is turned, the report names the conventions
    /// that would have given the same turn.
    pub read: &'static Profile,
    /// Quantisation step: values are multiples of `step` times max(1, largest channel of the texel). 0 for
    /// floats.
    pub step: f64,
}

/// Compares levels with the light.
pub fn check(input: &Input<'_>, task: &Task) -> Result<Report, Cancelled> {
    search::run(input, task)
}
