//! Common code of the methods: evaluation at texel centres, and the extent of a kernel in angle and in
//! frequency.

use super::Cost;
use crate::Zonal;
use crate::kernel::zonal::quadrature;
use glam::DVec3;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_sphere::{Layout, SphereImage};

/// Layout, width and height of a face.
pub type Shape = (Layout, usize, usize);

/// A filtered image and the cost of making it.
#[derive(Debug, Clone)]
pub struct Made {
    /// ∫ L K at texel centres; planar.
    pub image: SphereImage,
    /// Work done.
    pub cost: Cost,
}

/// `f` at every texel centre of `shape`, rows in parallel, and the sum of the costs.
pub(super) fn each(
    (layout, width, height): Shape,
    label: &str,
    task: &Task,
    f: impl Fn(DVec3) -> ([f64; 3], Cost) + Sync,
) -> Result<Made, Cancelled> {
    let mut image = SphereImage::new(layout, width, height);
    task.begin(label, (layout.faces() * height) as u64);
    let [r, g, b] = image.planes.each_mut().map(|p| p.par_chunks_mut(width.max(1)));
    let costs: Result<Vec<Cost>, Cancelled> = r
        .zip(g)
        .zip(b)
        .enumerate()
        .map(|(row, ((r, g), b))| {
            task.check()?;
            let mut cost = Cost::default();
            for i in 0..width {
                if let Some(d) = layout.texel_direction(width, height, row / height, i, row % height) {
                    let (v, c) = f(d);
                    [r[i], g[i], b[i]] = v.map(|v| v as f32);
                    cost = cost + c;
                }
            }
            task.advance(1);
            Ok(cost)
        })
        .collect();
    task.end();
    Ok(Made { image, cost: costs?.into_iter().fold(Cost::default(), |a, b| a + b) })
}

/// The angle within which all but the part `epsilon` of ∫K lies, radians (Ramamoorthi & Hanrahan 2002, 5.30).
pub fn reach(kernel: &dyn Zonal, epsilon: f64) -> f64 {
    let within = |angle: f64| quadrature(|x| kernel.value(x), kernel.width(), angle, 0)[0];
    let support = kernel.support();
    let wanted = (1.0 - epsilon) * within(support);
    let (mut low, mut high) = (0.0, support);
    if epsilon <= 0.0 {
        return support;
    }
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if within(middle) < wanted { low = middle } else { high = middle }
    }
    high
}

/// The smallest order beyond which no coefficient exceeds `tolerance` · k_0, at most that of the last one.
pub fn band_limit(k: &[f64], tolerance: f64) -> usize {
    let limit = tolerance * k.first().map_or(0.0, |k| k.abs());
    k.iter().rposition(|k| k.abs() > limit).unwrap_or(0)
}
