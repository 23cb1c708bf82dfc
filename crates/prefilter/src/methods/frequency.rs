//! In frequency space: coefficients of the light times those of the kernel, and back.
//!
//! Ramamoorthi & Hanrahan 2002, 5.4, for one outgoing dimension: B_lm = k_l L_lm, k_l = Λ_l ρ̂_l; O(F S²) for
//! S² texels (5.29). This is the crate's own [`filter_image`], which sums the texels near sharp lobes and the
//! brightest ones directly, and chooses F by the tolerance.

use super::{Card, Cost, Made, Shape, reach};
use crate::image::map::ImageMethod;
use crate::{Sampled, Zonal, filter_image};
use steradian_base::{Cancelled, Task};

pub(super) const CARD: Card = Card {
    name: "frequency",
    source: "Ramamoorthi & Hanrahan 2002, 5.4 and 5.6",
    equation: "B_lm = k_l L_lm, k_l = 2π ∫ K(x) P_l(x) dx, l ≤ F",
    exact_when: "F → ∞ (chosen by the tolerance)",
};

/// Filters by spherical harmonics, to relative RMS error `tolerance`. The taps are the leading terms of
/// appendix C of the thesis: (F + 1)² products for each row of the light and of the map.
pub fn frequency(
    light: &Sampled,
    kernel: &dyn Zonal,
    shape: Shape,
    tolerance: f64,
    task: &Task,
) -> Result<Made, Cancelled> {
    let made = filter_image(light, kernel, shape, tolerance, task)?;
    let (layout, width, height) = shape;
    let texels = (layout.faces() * width * height) as f64;
    let rows = light.image.height as f64 + (0.5 * texels).sqrt();
    let near = match made.way {
        ImageMethod::Near { reach: angle, .. } => {
            let part = 0.5 * (1.0 - angle.min(reach(kernel, 0.0)).cos());
            texels * part * light.image.planes[0].len() as f64
        }
        ImageMethod::All => texels * light.image.planes[0].len() as f64,
        ImageMethod::Area | ImageMethod::Frequency { .. } => 0.0,
    };
    let products = (made.way.order() as f64 + 1.0).powi(2) * rows;
    Ok(Made { image: made.image, cost: Cost { kernel: near as u64, taps: (products + near) as u64 } })
}
