//! Filtered images: light convolved with a kernel, evaluated at the texel centres of any layout.
//!
//! Nothing is resampled from another filtered map. In frequency space (Ramamoorthi & Hanrahan 2002, 5.4)
//! where the analysis has all bands that the kernel passes; for sharper kernels, and where it costs less,
//! only the part of the kernel far from each direction, while the texels near it are summed
//! ([`ImageMethod::Near`]). The brightest texels are summed exactly where the series would ring. Where
//! neither is sure to meet the tolerance all texels are summed, if they are few.

use super::measure::finish;
use super::plan::{self, Frequency, Near, Plan};
use super::rows::for_rows;
use super::synthesize;
use super::texel_sums::{Scratch, TexelSums};
use crate::light::sampled::{Sampled, small_lights_at};
use crate::{SmallLight, Zonal};
use glam::DVec3;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_sphere::{Layout, SphereImage};

/// Method by which an image was filtered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ImageMethod {
    /// Resampled by areas: a mirror.
    Area,
    /// By spherical harmonics.
    Frequency {
        /// Highest band.
        order: usize,
        /// Bright texels and suns that were summed directly.
        small_lights: usize,
    },
    /// Near texels directly, the far part of the kernel by spherical harmonics.
    Near {
        /// Highest band of the far part.
        order: usize,
        /// Reach of the direct sum, radians.
        reach: f64,
    },
    /// All texels directly.
    All,
}

impl ImageMethod {
    /// The method in one word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Area => "area",
            Self::Frequency { .. } => "frequency",
            Self::Near { .. } => "near",
            Self::All => "all",
        }
    }

    /// Highest band; 0 where there is none.
    pub fn order(self) -> usize {
        match self {
            Self::Area | Self::All => 0,
            Self::Frequency { order, .. } | Self::Near { order, .. } => order,
        }
    }
}

/// A filtered image and its estimated errors.
#[derive(Debug, Clone)]
pub struct FilteredImage {
    /// ∫ L K at texel centres.
    pub image: SphereImage,
    /// Method of filtering.
    pub way: ImageMethod,
    /// Bound of the relative RMS error by the bands left out.
    pub predicted: f64,
    /// Flux added by raising negative values to zero, relative to all.
    pub clipped: f64,
    /// ∫ L dω · ∫ K dω: the energy that the image should have.
    pub energy_in: [f64; 3],
    /// ∫ of the image, texel values times solid angles.
    pub energy_out: [f64; 3],
}

/// Relative error of interpolation and single precision, added to any bound.
const ROUNDING: f64 = 2e-6;

/// Relative error of the quadrature over the cells of texels.
const NODES: f64 = 2e-5;

/// Layout, width and height of an image.
type Shape = (Layout, usize, usize);

/// Convolves `light` with `kernel` to relative RMS error `tolerance`, at the texel centres of an image.
pub fn filter_image(
    light: &Sampled,
    kernel: &dyn Zonal,
    shape: Shape,
    tolerance: f64,
    task: &Task,
) -> Result<FilteredImage, Cancelled> {
    task.check()?;
    let (layout, width, height) = shape;
    let k = plan::coefficients(kernel);
    let plan = plan::plan(light, kernel, &k, layout.faces() * width * height, tolerance);
    task.check()?;
    let (mut image, way, predicted) = match plan {
        Plan::Frequency(p) => by_frequency(light, kernel, &k, p, shape, tolerance),
        Plan::Near(p) => by_parts(light, kernel, &p, shape, tolerance, task)?,
        Plan::All => (by_sums(light, kernel, shape, task)?, ImageMethod::All, 0.0),
    };
    task.check()?;
    let (energy_out, clipped) = finish(&mut image, !light.has_negative());
    let energy_in = light.flux().map(|f| f * k[0]);
    Ok(FilteredImage {
        image,
        way,
        predicted: predicted
            + ROUNDING
            + light.error_of_reduction(kernel)
            + if matches!(way, ImageMethod::Frequency { small_lights: 0, .. }) { 0.0 } else { NODES },
        clipped,
        energy_in,
        energy_out,
    })
}

fn by_frequency(
    light: &Sampled,
    kernel: &dyn Zonal,
    k: &[f64],
    plan: Frequency,
    shape: Shape,
    tolerance: f64,
) -> (SphereImage, ImageMethod, f64) {
    let Frequency { order, merged, tail } = plan;
    let k_used = &k[..=order.min(k.len() - 1)];
    let mut image = synthesize(&light.spectrum(order, merged), k_used, shape, tolerance);
    let direct: &[SmallLight] = if merged { &[] } else { light.bright_texels() };
    let suns = light.suns();
    if !(direct.is_empty() && suns.is_empty()) {
        for_rows(&mut image, |row, texels| {
            let width = texels[0].len();
            row.sums(direct, kernel);
            for i in 0..width {
                let Some(d) = row.direction(i) else { continue };
                let suns = small_lights_at(suns, kernel, d);
                for c in 0..3 {
                    texels[c][i] = (f64::from(texels[c][i]) + row.sum(c, i) + suns[c]) as f32;
                }
            }
        });
    }
    (image, ImageMethod::Frequency { order, small_lights: direct.len() + suns.len() }, tail)
}

fn by_parts(
    light: &Sampled,
    kernel: &dyn Zonal,
    plan: &Near<'_>,
    shape: Shape,
    tolerance: f64,
    task: &Task,
) -> Result<(SphereImage, ImageMethod, f64), Cancelled> {
    let far = &plan.far[..=plan.order.min(plan.far.len() - 1)];
    let mut image = synthesize(&light.spectrum(plan.order, plan.merged), far, shape, 0.1 * tolerance);
    task.check()?;
    let near = TexelSums::new(&light.image);
    let direct: &[SmallLight] = if plan.merged { &[] } else { light.bright_texels() };
    let scale = 0.25 * plan.split.reach();
    for_texels(&mut image, |scratch, d, texel| {
        let mut sum = near.near(&plan.split, kernel, d, scratch);
        for b in direct {
            let [w] = b.mean(scale, |wi| [plan.split.far_value(d.dot(wi))]);
            (0..3).for_each(|c| sum[c] += w * b.flux[c]);
        }
        let suns = small_lights_at(light.suns(), kernel, d);
        for (c, t) in texel.into_iter().enumerate() {
            *t = (f64::from(*t) + sum[c] + suns[c]) as f32;
        }
    });
    Ok((image, ImageMethod::Near { order: plan.order, reach: plan.split.reach() }, plan.predicted))
}

fn by_sums(light: &Sampled, kernel: &dyn Zonal, shape: Shape, task: &Task) -> Result<SphereImage, Cancelled> {
    let mut image = SphereImage::new(shape.0, shape.1, shape.2);
    let sums = TexelSums::new(&light.image);
    for_texels(&mut image, |scratch, d, texel| {
        if task.check().is_ok() {
            let (sum, suns) = (sums.all(kernel, d, scratch), small_lights_at(light.suns(), kernel, d));
            texel.into_iter().enumerate().for_each(|(c, t)| *t = (sum[c] + suns[c]) as f32);
        }
    });
    task.check()?;
    Ok(image)
}

/// The light itself as a [`FilteredImage`].
pub fn mirror_image(light: &Sampled, (layout, width, height): Shape) -> FilteredImage {
    let mut image = light.mirror(layout, width, height);
    let (energy_out, _) = finish(&mut image, false);
    let energy_in = light.flux();
    FilteredImage { image, way: ImageMethod::Area, predicted: 0.0, clipped: 0.0, energy_in, energy_out }
}

/// Calls `f(scratch, d, texel)` for every texel in use, rows in parallel.
fn for_texels(image: &mut SphereImage, f: impl Fn(&mut Scratch, DVec3, [&mut f32; 3]) + Sync) {
    let (layout, width, height) = (image.layout, image.width, image.height);
    let [r, g, b] = image.planes.each_mut().map(|p| p.par_chunks_mut(width.max(1)));
    r.zip(g).zip(b).enumerate().for_each_init(Scratch::default, |scratch, (row, ((r, g), b))| {
        for (i, ((r, g), b)) in r.iter_mut().zip(g).zip(b).enumerate() {
            if let Some(d) = layout.texel_direction(width, height, row / height, i, row % height) {
                f(scratch, d, [r, g, b]);
            }
        }
    });
}

#[cfg(test)]
mod tests;
