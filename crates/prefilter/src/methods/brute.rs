//! The sum over all texels, each constant over its cell.
//!
//! Kautz, course notes (2006), *How to filter a cube map*: "for each target pixel, go over the full input map
//! (take solid angle of each pixel into account)".
//!
//! ```text
//! B(d) = Σ_i L_i ∫_i K(d·w) dω
//! ```

use super::grid::each;
use super::{Card, Cost, Made, Shape};
use crate::{Sampled, Zonal};
use steradian_base::{Cancelled, Task};

pub(super) const CARD: Card = Card {
    name: "brute",
    source: "Kautz, course notes, 2006",
    equation: "Σ L ∫K over all texels",
    exact_when: "always: the others are measured by it",
};

/// The sum over all texels.
pub fn brute(light: &Sampled, kernel: &dyn Zonal, shape: Shape, task: &Task) -> Result<Made, Cancelled> {
    let texels = (light.image.width * light.image.height) as u64;
    let cost = Cost { kernel: texels, taps: texels };
    each(shape, "filtering by brute force", task, |d| (light.brute_force(kernel, d), cost))
}
