//! Facts of an environment.

use super::TextureFacts;
use crate::inputs::{self, Adjust, is_sky};
use crate::{Error, Session};
use glam::DVec3;
use steradian_base::{Cancelled, Task};
use steradian_light::load::{Report, Samples};
use steradian_light::{DiskLight, Lights};
use steradian_parallel::prelude::*;
use steradian_sphere::layout::Position;
use steradian_sphere::sh::{self, ShRgb};
use steradian_sphere::{Layout, SphereImage};

/// Bands of the reported spectrum.
const BANDS: usize = 16;
/// Histogram bins per factor of two.
const BINS_PER_STOP: f64 = 16.0;
/// Stops of the histogram below and above 1.
const STOPS: f64 = 64.0;

/// Facts of an environment: ranges, means, energy and spectrum.
#[derive(Debug, Clone)]
pub struct EnvironmentFacts {
    /// Layout of the image.
    pub layout: Layout,
    /// Width of a face.
    pub width: usize,
    /// Height of a face.
    pub height: usize,
    /// Smallest radiance of each channel.
    pub min: [f32; 3],
    /// Largest radiance of each channel.
    pub max: [f32; 3],
    /// Negative samples.
    pub negative: u64,
    /// Mean radiance over the sphere, W sr⁻¹ m⁻².
    pub mean: [f64; 3],
    /// Integral of radiance over the sphere.
    pub integral: [f64; 3],
    /// Irradiance on a floor, W m⁻².
    pub irradiance_up: [f64; 3],
    /// log2 of the largest over the smallest positive luminance.
    pub stops: f32,
    /// Direction and luminance of the brightest texel.
    pub brightest: (DVec3, f32),
    /// Luminance-weighted mean direction.
    pub dominant: Option<DVec3>,
    /// Parts of the luminous energy that the brightest 0.01 %, 0.1 %, 1 % and 10 % of the sphere hold.
    pub shares: [f64; 4],
    /// Energy of each band of spherical harmonics.
    pub bands: Vec<f64>,
    /// Suns in addition to the image.
    pub disks: Vec<DiskLight>,
    /// Suns in the image, with their parts of its flux.
    pub suns: Vec<(DiskLight, f64)>,
    /// Advice that follows from these facts.
    pub advice: Vec<Advice>,
    /// Report of loading the file; `None` for a sky.
    pub file: Option<Report>,
    /// Facts of the file where it is a texture; all other facts are those of one of its levels.
    pub texture: Option<TextureFacts>,
}

/// Advice to a user; displays as one line.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Advice {
    /// The data are not linear radiance of full range.
    #[error(
        "display-referred data: lights are clipped, so that lighting comes out too dark; use the HDR original"
    )]
    LowRange,
    /// Much of the energy is in a small part of the sphere.
    #[error("{:.0} % of the energy is in 0.01 % of the sphere: a sun or a lamp. SH of few bands will ring, and sampling will be noisy", 100.0 * share)]
    Sharp {
        /// Share of the energy.
        share: f64,
    },
    /// Half floats would clip.
    #[error("beyond the range of half floats (65504): write 32-bit floats")]
    BeyondHalf,
    /// There are negative samples.
    #[error("negative samples are kept as data; `negative` zero removes them")]
    Negative,
    /// Few coefficients suffice for diffuse light.
    #[error("9 SH coefficients hold {:.0} % of the energy below band {BANDS}; diffuse lighting needs no more", 100.0 * part)]
    Smooth {
        /// Their part of the flux.
        part: f64,
    },
    /// Nothing is brighter than 1.
    #[error("nothing is brighter than 1: it may have been clipped or tone-mapped")]
    NotBright,
}

impl Session {
    /// Facts of an image or a sky. `level` is that of a texture.
    pub fn inspect_light(
        &mut self,
        spec: &str,
        adjust: &Adjust,
        level: usize,
    ) -> Result<EnvironmentFacts, Error> {
        if is_sky(spec) {
            let lights = self.light(spec, adjust)?;
            let disks = lights.disks.clone();
            return facts(&lights.into_image(), disks, None, &self.task);
        }
        let loaded = self.map(spec, adjust, level)?;
        let facts = facts(&loaded.image, Vec::new(), Some(loaded.report), &self.task)?;
        Ok(EnvironmentFacts { texture: self.inspect_texture(spec, adjust)?, ..facts })
    }

    /// What an image that no file of its own holds is.
    pub(super) fn image_facts(&self, image: &SphereImage) -> Result<EnvironmentFacts, Error> {
        facts(image, Vec::new(), None, &self.task)
    }
}

fn facts(
    image: &SphereImage,
    disks: Vec<DiskLight>,
    file: Option<Report>,
    task: &Task,
) -> Result<EnvironmentFacts, Error> {
    let mut s = sums(image, task)?;
    if let Some(Samples { min, max, negative }) = file.as_ref().and_then(|r| r.samples) {
        (s.min, s.max, s.negative) = (min, max, negative);
    }
    task.begin("spherical harmonics", 0);
    let sh = spectrum(image, &disks);
    task.end();
    task.check()?;
    let bands = band_energy(&sh);
    let integral = plus_disks(s.integral, &disks, DiskLight::solid_angle);
    Ok(EnvironmentFacts {
        layout: image.layout,
        width: image.width,
        height: image.height,
        min: s.min,
        max: s.max,
        negative: s.negative,
        mean: integral.map(|v| v / (4.0 * std::f64::consts::PI)),
        integral,
        irradiance_up: plus_disks(s.floor, &disks, on_floor),
        stops: (s.brightest.0 / s.lowest_positive).log2(),
        brightest: (direction(image, s.brightest.1), s.brightest.0),
        dominant: inputs::dominant(&sh),
        shares: [1e-4, 1e-3, 1e-2, 1e-1].map(|p| s.share(p)),
        suns: suns(image),
        advice: advice(&s, &bands, &disks, file.as_ref().is_some_and(|r| r.low_range)),
        bands,
        disks,
        file,
        texture: None,
    })
}

/// Sums over an image, in one pass over its rows.
#[derive(Clone)]
struct Sums {
    min: [f32; 3],
    max: [f32; 3],
    negative: u64,
    lowest_positive: f32,
    brightest: (f32, usize),
    /// ∫ L dω.
    integral: [f64; 3],
    /// Irradiance on a floor, ∫ L ⟨d·y⟩₊ dω, by texel centres and exact solid angles.
    floor: [f64; 3],
    /// Luminous energy and solid angle by luminance.
    bins: Vec<(f64, f64)>,
}

impl Sums {
    fn new() -> Self {
        Self {
            min: [f32::INFINITY; 3],
            max: [f32::NEG_INFINITY; 3],
            negative: 0,
            lowest_positive: f32::INFINITY,
            brightest: (f32::NEG_INFINITY, 0),
            integral: [0.0; 3],
            floor: [0.0; 3],
            bins: vec![(0.0, 0.0); (2.0 * STOPS * BINS_PER_STOP) as usize],
        }
    }

    /// Texel `index` of solid angle `omega` in a direction whose cosine with the upward one is `up`.
    fn add(&mut self, rgb: [f32; 3], omega: f64, up: f64, index: usize) {
        for c in 0..3 {
            self.integral[c] += omega * f64::from(rgb[c]);
            self.floor[c] += up.max(0.0) * omega * f64::from(rgb[c]);
            self.min[c] = self.min[c].min(rgb[c]);
            self.max[c] = self.max[c].max(rgb[c]);
            self.negative += u64::from(rgb[c] < 0.0);
        }
        let y = steradian_render::tone::luminance(rgb);
        if y > self.brightest.0 {
            self.brightest = (y, index);
        }
        if y > 0.0 {
            self.lowest_positive = self.lowest_positive.min(y);
        }
        let stop = if y > 0.0 { (f64::from(y).log2() + STOPS) * BINS_PER_STOP } else { 0.0 };
        let bin = (stop as usize).min(self.bins.len() - 1);
        self.bins[bin].0 += f64::from(y.max(0.0)) * omega;
        self.bins[bin].1 += omega;
    }

    fn merge(mut self, o: Self) -> Self {
        for c in 0..3 {
            self.integral[c] += o.integral[c];
            self.floor[c] += o.floor[c];
            self.min[c] = self.min[c].min(o.min[c]);
            self.max[c] = self.max[c].max(o.max[c]);
        }
        self.negative += o.negative;
        self.lowest_positive = self.lowest_positive.min(o.lowest_positive);
        if o.brightest.0 > self.brightest.0 {
            self.brightest = o.brightest;
        }
        self.bins.iter_mut().zip(o.bins).for_each(|(a, b)| *a = (a.0 + b.0, a.1 + b.1));
        self
    }

    /// Part of the luminous energy that the brightest `part` of the sphere holds.
    fn share(&self, part: f64) -> f64 {
        let (energy, omega) = self.bins.iter().fold((0.0, 0.0), |s, b| (s.0 + b.0, s.1 + b.1));
        if energy <= 0.0 {
            return 0.0;
        }
        let (mut left, mut sum) = (part * omega, 0.0);
        for (e, w) in self.bins.iter().rev().filter(|b| b.1 > 0.0) {
            let taken = (left / w).min(1.0);
            sum += taken * e;
            left -= taken * w;
            if left <= 0.0 {
                break;
            }
        }
        sum / energy
    }
}

/// Rows per block: blocks are summed in order, whatever the number of threads.
const ROWS: usize = 64;

fn sums(image: &SphereImage, task: &Task) -> Result<Sums, Cancelled> {
    let rows = image.layout.faces() * image.height;
    let blocks = rows.div_ceil(ROWS);
    task.begin("sums over the texels", blocks as u64);
    let blocks: Result<Vec<Sums>, Cancelled> = (0..blocks)
        .into_par_iter()
        .map(|b| {
            task.check()?;
            let mut s = Sums::new();
            for row in b * ROWS..((b + 1) * ROWS).min(rows) {
                let omega = image.row_solid_angles(row / image.height, row % image.height);
                for (i, &w) in omega.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                    let k = row * image.width + i;
                    let rgb = [image.planes[0][k], image.planes[1][k], image.planes[2][k]];
                    s.add(rgb, w, direction(image, k).y, k);
                }
            }
            task.advance(1);
            Ok(s)
        })
        .collect();
    task.end();
    Ok(blocks?.into_iter().fold(Sums::new(), Sums::merge))
}

/// Direction of texel `k` of a plane.
fn direction(image: &SphereImage, k: usize) -> DVec3 {
    let row = k / image.width;
    let at = Position {
        face: row / image.height,
        x: (k % image.width) as f64 + 0.5,
        y: (row % image.height) as f64 + 0.5,
    };
    image.layout.direction(image.width, image.height, at).unwrap_or(DVec3::Y)
}

/// Irradiance of a floor by a disk of unit radiance, exact where the disk is wholly above the horizon: π
/// sin²ρ sin(elevation).
fn on_floor(disk: &DiskLight) -> f64 {
    std::f64::consts::PI * disk.angular_radius.sin().powi(2) * disk.direction.y.max(0.0)
}

/// `sum` with each disk's radiance times its weight added.
fn plus_disks(sum: [f64; 3], disks: &[DiskLight], weight: impl Fn(&DiskLight) -> f64) -> [f64; 3] {
    disks.iter().fold(sum, |s, d| std::array::from_fn(|c| s[c] + weight(d) * d.radiance[c]))
}

/// Images of more texels are not searched for suns.
const MOST_TEXELS: usize = 1 << 25;

/// The suns that `--extract-sun` would take out of the image, and their parts of its flux.
fn suns(image: &SphereImage) -> Vec<(DiskLight, f64)> {
    if image.planes[0].len() > MOST_TEXELS {
        return Vec::new();
    }
    let e = steradian_light::suns::extract(image, &steradian_light::suns::SunOptions::default());
    e.suns.into_iter().zip(e.shares).collect()
}

fn spectrum(image: &SphereImage, disks: &[DiskLight]) -> ShRgb {
    let mut all = sh::project(image, BANDS - 1);
    let alone = inputs::coefficients(&Lights { disks: disks.to_vec(), ..Lights::default() }, BANDS - 1);
    for (to, from) in all.c.iter_mut().zip(&alone.c) {
        to.iter_mut().zip(from).for_each(|(a, b)| *a += b);
    }
    all
}

/// Σ over channels and m of squared coefficients, by band.
fn band_energy(sh: &ShRgb) -> Vec<f64> {
    let band = |l: usize| sh.c.iter().flat_map(|c| &c[l * l..(l + 1) * (l + 1)]).map(|v| v * v).sum();
    (0..=sh.order).map(band).collect()
}

fn advice(s: &Sums, bands: &[f64], disks: &[DiskLight], low_range: bool) -> Vec<Advice> {
    let sharp = s.share(1e-4);
    let total: f64 = bands.iter().sum();
    let three: f64 = bands.iter().take(3).sum();
    let smooth = disks.is_empty() && sharp <= 0.2 && total > 0.0;
    let all = [
        (low_range, Advice::LowRange),
        (sharp > 0.2, Advice::Sharp { share: sharp }),
        (s.max.iter().any(|m| *m > 65504.0), Advice::BeyondHalf),
        (s.negative > 0, Advice::Negative),
        (smooth, Advice::Smooth { part: three / total }),
        (s.brightest.0 <= 1.0 && !low_range, Advice::NotBright),
    ];
    all.into_iter().filter(|a| a.0).map(|a| a.1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bright_texel_is_found_and_holds_its_energy() {
        let mut image = SphereImage::from_fn(Layout::LatLong, 64, 32, |_| [1.0; 3]);
        let k = image.index(0, 48, 10);
        image.planes.iter_mut().for_each(|p| p[k] = 1e6);
        let s = sums(&image, &Task::quiet()).unwrap();
        assert_eq!(s.brightest.1, k);
        // The texel covers about 0.07 % of the sphere.
        assert!(s.share(1e-2) > 0.99 && s.share(1e-5) < 0.1);
        assert!((s.share(1.0) - 1.0).abs() < 1e-9);
        let d = direction(&image, k);
        assert!((d.y - (std::f64::consts::PI * 10.5 / 32.0).cos()).abs() < 1e-12);
    }

    #[test]
    fn the_white_furnace_has_one_band() {
        let image = SphereImage::from_fn(Layout::LatLong, 64, 32, |_| [1.0; 3]);
        let bands = band_energy(&spectrum(&image, &[]));
        assert!((bands[0] - 12.0 * std::f64::consts::PI).abs() < 1e-4);
        assert!(bands[1..].iter().all(|b| *b < 1e-12 * bands[0]));
        assert!((sums(&image, &Task::quiet()).unwrap().floor[0] - std::f64::consts::PI).abs() < 1e-2);
    }

    #[test]
    fn a_disk_overhead_counts_in_the_floor_and_in_the_sphere() {
        let disk = DiskLight { direction: DVec3::Y, angular_radius: 0.1, radiance: [2.0; 3] };
        let up = plus_disks([1.0; 3], &[disk], on_floor);
        assert!((up[0] - (1.0 + 2.0 * std::f64::consts::PI * 0.1f64.sin().powi(2))).abs() < 1e-12);
        assert_eq!(plus_disks([0.0; 3], &[disk], DiskLight::solid_angle)[1], 2.0 * disk.solid_angle());
    }
}
