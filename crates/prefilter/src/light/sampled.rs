//! Light prepared for filtering into images.
//!
//! A filtered map holds ∫ L K dω at its texels' centres, with L constant over each texel's exact cell, as
//! everywhere (see "Conventions" in ARCHITECTURE.md).

use super::cell::step_scale;
use super::polar;
use super::source::{self, Statistics, bright_texels};
use crate::image::precision;
use crate::{Cell, SmallLight, Zonal};
use glam::DVec3;
use std::borrow::Cow;
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::{Cancelled, Task};
use steradian_light::Lights;
use steradian_parallel::prelude::*;
use steradian_sphere::sh::{ColumnsRgb, Grid, ShRgb, ShTransform};
use steradian_sphere::{Layout, SphereImage};

/// Highest band of the analysis.
pub(crate) const MAX_ORDER: usize = 1023;
/// Rows of the image at most; larger ones are first reduced, area-exact.
const MAX_ROWS: usize = 2048;

/// Texels of an image that is still refined.
const REFINED: usize = 1 << 22;

/// Prepared light.
pub struct Sampled {
    /// The image, whole.
    pub image: SphereImage,
    /// Suns, directional lights and the brightest texels of an image that was reduced; then the excess taken
    /// off the brightest texels of this image.
    small_lights: Vec<SmallLight>,
    suns: usize,
    /// Spectrum of the image with its brightest texels capped, about the pole y.
    spectrum: ColumnsRgb,
    /// Energy of each of its bands, all channels.
    bands: Vec<f64>,
    /// ∫ of the square of the capped image.
    energy: f64,
    /// ∫ L dω of the image.
    flux: [f64; 3],
    /// ∫ of the square of the detail that was lost when the image was reduced.
    detail: f64,
    negative: bool,
}

impl Sampled {
    /// Prepares everything in `lights` but its point lights, with the bands that `kernels` need for
    /// `tolerance`.
    pub fn new(
        lights: &Lights,
        kernels: &[&dyn Zonal],
        tolerance: f64,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        Self::of(lights.clone(), kernels, tolerance, task)
    }

    /// [`Sampled::new`] that takes the lights: their image is moved, not copied.
    pub fn of(
        lights: Lights,
        kernels: &[&dyn Zonal],
        tolerance: f64,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        task.check()?;
        let mut small_lights: Vec<SmallLight> = lights.disks.iter().map(SmallLight::from).collect();
        small_lights.extend(lights.directionals.iter().map(SmallLight::from));
        let given = lights.environment.map(|e| Arc::try_unwrap(e).unwrap_or_else(|e| (*e).clone()).image);
        let mut detail = 0.0;
        let mut image = match given {
            None => SphereImage::new(Layout::LatLong, 4, 2),
            // Texels as bright as suns keep their own cells: a lobe as sharp as they are would see the larger
            // cells of the reduced image instead.
            Some(image) if image.height > MAX_ROWS => {
                let capped = source::split(image, &mut small_lights);
                let smaller = source::reduced(&capped, MAX_ROWS);
                // Means over cells are nearly a projection: the energies of what is kept and of what is lost
                // add up.
                detail = (source::energy(&capped) - source::energy(&smaller)).max(0.0);
                smaller
            }
            Some(image) => image,
        };
        let suns = small_lights.len();
        task.check()?;
        let statistics = Statistics::of(&image);
        let bright_texels = bright_texels(&image, &statistics);
        let whole: Vec<[f32; 3]> = bright_texels.iter().map(|s| s.cap(&mut image)).collect();
        small_lights.extend(bright_texels.iter().map(|s| s.small_light));
        let capped = statistics.without(&image, &bright_texels, &whole);
        let order = order(&capped, kernels, tolerance);
        let (width, height) = (image.width, image.height);
        let plan = ShTransform::with_precision(order, width, height, Grid::Cells, precision(tolerance));
        let mut spectrum = ColumnsRgb::default();
        plan.analyze_columns(image.planes.each_ref().map(Vec::as_slice), &mut spectrum);
        let bands = spectrum.band_energies().iter().map(|e| e.iter().sum()).collect();
        for (s, whole) in bright_texels.iter().zip(whole) {
            (0..3).for_each(|c| image.planes[c][s.k] = whole[c]);
        }
        task.check()?;
        let (flux, negative) = (statistics.flux, statistics.negative);
        Ok(Self { image, small_lights, suns, spectrum, bands, energy: capped.energy, flux, detail, negative })
    }

    /// Suns and directional lights, and the brightest texels of an image that was too large and is reduced
    /// here.
    pub fn suns(&self) -> &[SmallLight] {
        &self.small_lights[..self.suns]
    }

    /// The excess taken off the brightest texels, as small lights.
    pub fn bright_texels(&self) -> &[SmallLight] {
        &self.small_lights[self.suns..]
    }

    /// Estimated relative RMS error of maps from the reduction of the image: the lost detail varies within
    /// cells of a [`MAX_ROWS`]th of π, so that a kernel passes as much of it as it passes beyond the
    /// analysis' bands. 0 for images that were not reduced.
    pub(crate) fn error_of_reduction(&self, kernel: &dyn Zonal) -> f64 {
        if self.detail == 0.0 {
            return 0.0;
        }
        let k = kernel.coefficients(MAX_ORDER + 64);
        let beyond = k[MAX_ORDER..].iter().fold(0.0_f64, |m, k| m.max(k.abs()));
        // The mean's part of a map's energy: no map of this light has less.
        let mean = self.flux.iter().map(|f| f * f).sum::<f64>() / (4.0 * PI);
        (self.detail / mean.max(f64::MIN_POSITIVE)).sqrt() * beyond / k[0].abs().max(f64::MIN_POSITIVE)
    }

    /// Highest band of the analysis.
    pub fn order(&self) -> usize {
        self.spectrum.order()
    }

    /// Does the image hold negative texels?
    pub fn has_negative(&self) -> bool {
        self.negative
    }

    /// Spectrum of the capped image about the pole y: all of the analysis, or with the brightest texels' up
    /// to `order`.
    pub(crate) fn spectrum(&self, order: usize, with_bright_texels: bool) -> Cow<'_, ColumnsRgb> {
        if !with_bright_texels || self.bright_texels().is_empty() {
            return Cow::Borrowed(&self.spectrum);
        }
        let mut sh = polar::truncated(&self.spectrum.to_sh(), order);
        polar::add_small_lights(&mut sh, self.bright_texels());
        Cow::Owned(ColumnsRgb::from_sh(&sh))
    }

    /// Energy of each band of the capped image, all channels.
    pub(crate) fn base_bands(&self) -> &[f64] {
        &self.bands
    }

    /// ∫ of the square of the capped image, all channels.
    pub(crate) fn base_energy(&self) -> f64 {
        self.energy
    }

    /// Coefficients of everything, suns included, up to `order` (at most the analysis').
    pub fn coefficients(&self, order: usize) -> ShRgb {
        let mut sh = polar::truncated(&self.spectrum.to_sh(), order.min(self.order()));
        polar::add_small_lights(&mut sh, &self.small_lights);
        polar::to_world(&sh)
    }

    /// ∫ L dω of everything.
    pub fn flux(&self) -> [f64; 3] {
        let mut flux = self.flux;
        for b in self.suns() {
            (0..3).for_each(|c| flux[c] += b.flux[c]);
        }
        flux
    }

    /// The light itself in another layout: the image area-exact, suns shared among the texels that they
    /// cover.
    pub fn mirror(&self, layout: Layout, width: usize, height: usize) -> SphereImage {
        let mut out = if layout == Layout::Cube && covers(self.image.height, width) {
            self.image.cube_means(width)
        } else {
            self.enlarged(layout, width, height)
        };
        let texel = (4.0 * PI / (layout.faces() * width * height) as f64).sqrt();
        for b in self.suns() {
            let rings = (8.0 * b.radius / texel).ceil().clamp(1.0, 64.0) as usize;
            b.nodes(rings, 4 * rings, |d, w| {
                let (face, i, j) = out.texel_of(d);
                let omega = layout.solid_angle(width, height, face, i, j);
                let k = out.index(face, i, j);
                (0..3).for_each(|c| out.planes[c][k] += (b.flux[c] * w / omega) as f32);
            });
        }
        out
    }

    /// The image resampled to texels that may be smaller than its own. Cubic lookup undershoots next to
    /// bright texels; where it becomes negative for light that is not, the image is first refined within its
    /// texels' means, for a cube until means over its texels are exact.
    fn enlarged(&self, layout: Layout, width: usize, height: usize) -> SphereImage {
        let below = |image: &SphereImage| image.planes.iter().flatten().any(|&v| v < 0.0);
        let mut out = self.image.resample(layout, width, height);
        if self.negative || !below(&out) {
            return out;
        }
        let mut fine = self.image.refined();
        let small = |image: &SphereImage| image.planes[0].len() <= REFINED;
        while layout == Layout::Cube && small(&fine) && !covers(fine.height, width) {
            fine = fine.refined();
        }
        if layout == Layout::Cube && covers(fine.height, width) {
            return fine.cube_means(width);
        }
        out = fine.resample(layout, width, height);
        while below(&out) && small(&fine) {
            fine = fine.refined();
            out = fine.resample(layout, width, height);
        }
        out.planes.iter_mut().flatten().for_each(|v| *v = v.max(0.0));
        out
    }

    /// This light with texels so narrow that a sum over their centres is about that over their cells: a
    /// sixteenth of the kernel's width leaves an error of 2e-4, if that takes no more than 1024 rows.
    pub(crate) fn divided(&self, kernel: &dyn Zonal) -> Self {
        let (width, height) = (self.image.width, self.image.height);
        let size = PI / (height as f64).min(0.5 * width as f64);
        let n = ((16.0 * size / kernel.width()).ceil() as usize).min(1024 / height).max(1);
        let mut image = SphereImage::new(Layout::LatLong, width * n, height * n);
        for (to, from) in image.planes.iter_mut().zip(&self.image.planes) {
            for (k, to) in to.iter_mut().enumerate() {
                *to = from[k / (width * n) / n * width + k % (width * n) / n];
            }
        }
        Self {
            image,
            small_lights: self.small_lights.clone(),
            spectrum: self.spectrum.clone(),
            bands: self.bands.clone(),
            ..*self
        }
    }

    /// ∫ L K about `d` by integrals over every texel's cell in double precision, suns included.
    pub fn brute_force(&self, kernel: &dyn Zonal, d: DVec3) -> [f64; 3] {
        let (width, height) = (self.image.width, self.image.height);
        let mut sum = small_lights_at(self.suns(), kernel, d);
        let most = step_scale(kernel);
        for k in 0..width * height {
            let w = Cell::texel(k % width, k / width, width, height).integral(kernel, d, most);
            (0..3).for_each(|c| sum[c] += w * f64::from(self.image.planes[c][k]));
        }
        sum
    }
}

/// Are the texels of a cube of `size` as large as those of a lat-long image of `rows`, in the middle of a
/// face at least? Then means over them are exact; in smaller ones the image's cells would show.
fn covers(rows: usize, size: usize) -> bool {
    2.0 / size as f64 >= PI / rows as f64
}

/// cos φ and sin φ of a column's centre.
pub(crate) fn azimuth(i: usize, width: usize) -> [f64; 2] {
    let (s, c) = (2.0 * PI * (i as f64 + 0.5) / width as f64 - PI).sin_cos();
    [c, s]
}

/// Σ flux · mean of K over each small light.
pub(crate) fn small_lights_at(small_lights: &[SmallLight], kernel: &dyn Zonal, d: DVec3) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for b in small_lights {
        let x = d.dot(b.direction);
        let v = if let Some(cell) = b.cell {
            cell.integral(kernel, d, f64::INFINITY) / cell.solid_angle()
        } else if b.radius == 0.0 {
            kernel.value(x)
        } else {
            let scale = kernel.width().max((2.0 * (1.0 - x)).max(0.0).sqrt());
            b.mean(scale, |wi| [kernel.value(d.dot(wi))])[0]
        };
        (0..3).for_each(|c| sum[c] += b.flux[c] * v);
    }
    sum
}

/// Part of the tolerance that the bands left out may use.
pub(crate) const TAIL: f64 = 0.05;

/// The smallest order whose tail is negligible for all of the kernels: the result in bands above F of the
/// capped image is at most max_{l>F}|k_l| √(∫L² − L_0²), compared with a result of at least k_0 L_0, with
/// L_0² = |∫L|²/4π.
fn order(capped: &Capped, kernels: &[&dyn Zonal], tolerance: f64) -> usize {
    let top = MAX_ORDER;
    let mean2 = capped.flux.iter().map(|f| f * f).sum::<f64>() / (4.0 * PI);
    let contrast = if mean2 > 0.0 { ((capped.energy - mean2).max(0.0) / mean2).sqrt() } else { 1.0 };
    let needed = |kernel: &&dyn Zonal| {
        let k = kernel.coefficients(top);
        let limit = TAIL * tolerance * k[0] / contrast.max(1e-3);
        k.iter().rposition(|k| k.abs() > limit).unwrap_or(0)
    };
    let highest = kernels.par_iter().map(needed).max().unwrap_or(0);
    highest.max(8).min(top)
}

/// Figures of the image after its brightest texels are capped.
struct Capped {
    flux: [f64; 3],
    energy: f64,
}

impl Statistics {
    fn without(
        &self,
        image: &SphereImage,
        bright_texels: &[source::BrightTexel],
        whole: &[[f32; 3]],
    ) -> Capped {
        let mut left = Capped { flux: self.flux, energy: self.energy };
        for (s, whole) in bright_texels.iter().zip(whole) {
            let omega = image.layout.solid_angle(image.width, image.height, 0, 0, s.k / image.width);
            for c in 0..3 {
                let (l, kept) = (f64::from(whole[c]), f64::from(s.kept[c]));
                left.flux[c] -= omega * (l - kept);
                left.energy -= omega * (l * l - kept * kept);
            }
        }
        left
    }
}
