//! Light as samples at texel centres, prepared for filtering into images.
//!
//! A filtered map is Σ L w Ω / Σ w Ω over all texels, each taken at its centre with its exact solid angle Ω: the
//! sum that any checker would write down. (The rooms' [`Source`] takes texels as constant over their cells instead.)

use crate::source::{self, Source, energy, split};
use crate::{Beam, Zonal};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_light::Lights;
use steradian_sphere::sh::{self, ShRgb};
use steradian_sphere::{Layout, SphereImage};

/// Highest band of the analysis.
pub(crate) const MAX_ORDER: usize = 1023;
/// Rows of the image at most; larger ones are first reduced, area-exact.
const MAX_ROWS: usize = 2048;

/// Prepared light.
pub struct Sampled {
    /// The image, whole.
    pub image: SphereImage,
    /// The same with its brightest texels capped, its spectrum, and as beams the suns and what was taken off the
    /// brightest texels.
    pub(crate) source: Source,
    suns: usize,
}

impl Sampled {
    /// Prepares everything in `lights` but its point lights, with the bands that `kernels` need for `tolerance`.
    pub fn new(
        lights: &Lights,
        kernels: &[&dyn Zonal],
        tolerance: f64,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        task.check()?;
        let black = || SphereImage::new(Layout::LatLong, 4, 2);
        let image = lights.environment.as_ref().map_or_else(black, |e| source::reduced(&e.image, MAX_ROWS));
        let mut beams: Vec<Beam> = lights.disks.iter().map(Beam::from).collect();
        beams.extend(lights.directionals.iter().map(Beam::from));
        let suns = beams.len();
        let base = split(image.clone(), &mut beams);
        // The texel's excess is at its centre, as everything is.
        beams[suns..].iter_mut().for_each(|b| b.radius = 0.0);
        let order = order(&base, kernels, tolerance);
        task.check()?;
        let spectrum = sh::project(&base, order);
        task.check()?;
        let source = Source::assembled(Some(base), beams, spectrum);
        Ok(Self { image, source, suns })
    }

    /// Suns and directional lights.
    pub fn suns(&self) -> &[Beam] {
        &self.source.beams[..self.suns]
    }

    /// What was taken off the brightest texels.
    pub fn sparks(&self) -> &[Beam] {
        &self.source.beams[self.suns..]
    }

    /// Highest band of the analysis.
    pub fn order(&self) -> usize {
        self.source.order()
    }

    /// Spectrum of the capped image up to `order`, zero beyond the analysis; with the brightest texels' if asked.
    pub(crate) fn spectrum(&self, order: usize, with_sparks: bool) -> ShRgb {
        let s = &self.source.spectrum;
        let known = sh::count(order.min(s.order));
        let mut sh = ShRgb::zero(order);
        for c in 0..3 {
            sh.c[c][..known].copy_from_slice(&s.c[c][..known]);
        }
        if with_sparks {
            source::add_beams(&mut sh, self.sparks());
        }
        sh
    }

    /// Energy of each band of the capped image, all channels.
    pub(crate) fn base_bands(&self) -> Vec<f64> {
        let s = &self.source.spectrum;
        let band =
            |l: usize| s.c.iter().flat_map(|c| &c[l * l..(l + 1) * (l + 1)]).map(|x| x * x).sum::<f64>();
        (0..=s.order).map(band).collect()
    }

    /// Coefficients of everything, suns included, up to `order` (at most the analysis').
    pub fn coefficients(&self, order: usize) -> ShRgb {
        self.source.coefficients(order)
    }

    /// ∫ L dω of everything.
    pub fn flux(&self) -> [f64; 3] {
        let mut flux = self.image.integral();
        for b in self.suns() {
            (0..3).for_each(|c| flux[c] += b.flux[c]);
        }
        flux
    }

    /// The light itself in another layout: the image area-exact, suns shared among the texels that they cover.
    pub fn mirror(&self, layout: Layout, width: usize, height: usize) -> SphereImage {
        let mut out = self.image.resample(layout, width, height);
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

    /// The filtered value in direction `d` by summing every texel; suns beside.
    pub fn brute_force(&self, kernel: &dyn Zonal, k0: f64, d: DVec3) -> [f64; 3] {
        let image = &self.image;
        let (width, height) = (image.width, image.height);
        let (mut sum, mut weight) = ([0.0; 3], 0.0);
        let columns: Vec<[f64; 2]> = (0..width).map(|i| azimuth(i, width)).collect();
        for j in 0..height {
            let omega = image.layout.solid_angle(width, height, 0, 0, j);
            let (s, c) = (PI * (j as f64 + 0.5) / height as f64).sin_cos();
            let (mut row, mut row_weight) = ([0.0; 3], 0.0);
            for (i, [cos, sin]) in columns.iter().enumerate() {
                let w = kernel.value(d.x * s * cos + d.y * c + d.z * s * sin);
                row_weight += w;
                let k = j * width + i;
                (0..3).for_each(|c| row[c] += w * f64::from(image.planes[c][k]));
            }
            weight += omega * row_weight;
            (0..3).for_each(|c| sum[c] += omega * row[c]);
        }
        let suns = beams_at(self.suns(), kernel, d);
        let scale = if weight > 0.0 { k0 / weight } else { 0.0 };
        std::array::from_fn(|c| sum[c] * scale + suns[c])
    }
}

/// cos φ and sin φ of a column's centre.
pub(crate) fn azimuth(i: usize, width: usize) -> [f64; 2] {
    let (s, c) = (2.0 * PI * (i as f64 + 0.5) / width as f64 - PI).sin_cos();
    [c, s]
}

/// Σ flux · mean of K over each beam.
pub(crate) fn beams_at(beams: &[Beam], kernel: &dyn Zonal, d: DVec3) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for b in beams {
        let x = d.dot(b.direction);
        let v = if b.radius == 0.0 {
            kernel.value(x)
        } else {
            let scale = kernel.width().max((2.0 * (1.0 - x)).max(0.0).sqrt());
            b.mean(scale, |wi| [kernel.value(d.dot(wi))])[0]
        };
        (0..3).for_each(|c| sum[c] += b.flux[c] * v);
    }
    sum
}

/// The smallest order whose tail cannot matter, for any of the kernels: what bands above F of the base can hold is
/// at most max_{l>F}|k_l| √∫base², beside a result of at least k_0 |∫L|/√4π.
fn order(base: &SphereImage, kernels: &[&dyn Zonal], tolerance: f64) -> usize {
    let top = MAX_ORDER.min(2 * base.height.max(2));
    let flux = base.integral();
    let mean = flux.iter().map(|f| f * f).sum::<f64>().sqrt() / (4.0 * PI).sqrt();
    let contrast = if mean > 0.0 { energy(base).sqrt() / mean } else { 0.0 };
    let needed = |kernel: &&dyn Zonal| {
        let k = kernel.coefficients(top);
        let limit = 0.02 * tolerance * k[0] / contrast.max(1.0);
        k.iter().rposition(|k| k.abs() > limit).unwrap_or(0)
    };
    // Panel-wise quadrature is a few milliseconds for each kernel.
    let highest = kernels.par_iter().map(needed).max().unwrap_or(0);
    highest.clamp(8, top)
}
