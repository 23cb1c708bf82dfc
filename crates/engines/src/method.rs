//! A level by a method that is asked for by name, in place of the usual choice.

use steradian_base::{Cancelled, Task};
use steradian_prefilter::map::ImageMethod;
use steradian_prefilter::methods::{Cost, Made, Method, Shape};
use steradian_prefilter::{FilteredImage, Sampled, Zonal};

/// A method and what it took.
#[derive(Debug, Clone, Copy)]
pub struct MethodCost {
    /// The method.
    pub method: Method,
    /// Kernel evaluations and texels read.
    pub cost: Cost,
}

/// The map filtered by one method, and its cost. Its error is unknown until measured.
pub(crate) fn filter(
    method: Method,
    light: &Sampled,
    kernel: &dyn Zonal,
    shape: Shape,
    tolerance: f64,
    task: &Task,
) -> Result<(FilteredImage, MethodCost), Cancelled> {
    let Made { image, cost } = method.filter(light, kernel, shape, tolerance, task)?;
    let energy_out = image.integral();
    let k0 = kernel.coefficients(0)[0];
    let energy_in = light.flux().map(|f| f * k0);
    let filtered = FilteredImage {
        image,
        way: ImageMethod::Area,
        predicted: f64::INFINITY,
        clipped: 0.0,
        energy_in,
        energy_out,
    };
    Ok((filtered, MethodCost { method, cost }))
}
