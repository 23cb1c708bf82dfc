//! Distant light prepared for filtering: a base image whose spectrum is known, and small bright lights apart.
//!
//! A truncated series rings around a small bright light. So the brightest texels keep only what the others have,
//! and their excess becomes a [`Beam`] that filters treat exactly, as they treat suns and directional lights.

use crate::Beam;
use glam::DVec3;
use steradian_base::{Cancelled, Task};
use steradian_light::Lights;
use steradian_sphere::layout::Position;
use steradian_sphere::sh::{self, ShRgb};
use steradian_sphere::{Layout, SphereImage};

/// Rows of the image that filters see at most: they blur, so larger images are first reduced, area-exact.
const MAX_HEIGHT: usize = 1024;
/// At most this many texels become beams.
const MAX_BEAMS: usize = 256;
/// A texel becomes a beam where it holds more than this part of all flux …
const BEAM_FLUX: f64 = 1e-4;
/// … and is this many times brighter than the mean.
const BEAM_CONTRAST: f64 = 32.0;

/// Distant light, prepared.
pub struct Source {
    /// What is left of the image; `None` without an environment.
    pub base: Option<SphereImage>,
    /// Suns, directional lights and the excess of the brightest texels.
    pub beams: Vec<Beam>,
    /// Spectrum of `base` up to the order that was asked for.
    pub spectrum: ShRgb,
    /// ∫ of the square of `base`, all channels.
    pub base_energy: f64,
    /// Energy per band of the whole light: Σ over channels and m of (base + beams)².
    pub bands: Vec<f64>,
    /// Does the light hold negative texels?
    pub negative: bool,
}

impl Source {
    /// Prepares everything in `lights` but its point lights, with a spectrum up to `order`.
    pub fn new(lights: &Lights, order: usize, task: &Task) -> Result<Self, Cancelled> {
        let image = lights.environment.as_ref().map(|e| reduced(&e.image, MAX_HEIGHT));
        let mut beams: Vec<Beam> = lights.disks.iter().map(Beam::from).collect();
        beams.extend(lights.directionals.iter().map(Beam::from));
        Self::of(image, beams, order, task)
    }

    /// Prepares an image and small lights beside it.
    pub fn of(
        image: Option<SphereImage>,
        mut beams: Vec<Beam>,
        order: usize,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        task.check()?;
        let base = image.map(|i| split(i, &mut beams));
        Ok(Self::prepared(base, beams, order))
    }

    /// A base image and beams that [`Source::of`] split, as they were saved.
    pub fn prepared(base: Option<SphereImage>, beams: Vec<Beam>, order: usize) -> Self {
        let order = base.as_ref().map_or(order, |b| order.min(2 * b.height.max(2)));
        let spectrum = base.as_ref().map_or_else(|| ShRgb::zero(order), |b| sh::project_exact(b, order));
        Self::assembled(base, beams, spectrum)
    }

    /// The parts, with the spectrum of `base` known.
    pub(crate) fn assembled(base: Option<SphereImage>, beams: Vec<Beam>, spectrum: ShRgb) -> Self {
        let base_energy = base.as_ref().map_or(0.0, energy);
        let negative = base.as_ref().is_some_and(|b| b.planes.iter().flatten().any(|&l| l < 0.0));
        let bands = bands(&spectrum, &beams);
        Self { base, beams, spectrum, base_energy, bands, negative }
    }

    /// Highest band of the spectrum.
    pub fn order(&self) -> usize {
        self.spectrum.order
    }

    /// Coefficients of base and beams together, up to `order` ≤ the spectrum's; disks in closed form.
    pub fn coefficients(&self, order: usize) -> ShRgb {
        let order = order.min(self.order());
        let mut all =
            ShRgb { order, c: std::array::from_fn(|c| self.spectrum.c[c][..sh::count(order)].to_vec()) };
        add_beams(&mut all, &self.beams);
        all
    }
}

/// Adds the coefficients of disks: flux · b_l · Y_lm(centre).
pub fn add_beams(to: &mut ShRgb, beams: &[Beam]) {
    let mut y = vec![0.0; sh::count(to.order)];
    for beam in beams {
        sh::eval(to.order, beam.direction, &mut y);
        for (l, b) in beam.spread(to.order).into_iter().enumerate() {
            for k in l * l..(l + 1) * (l + 1) {
                (0..3).for_each(|c| to.c[c][k] += beam.flux[c] * b * y[k]);
            }
        }
    }
}

fn bands(spectrum: &ShRgb, beams: &[Beam]) -> Vec<f64> {
    let mut all = spectrum.clone();
    add_beams(&mut all, beams);
    let band = |l: usize| all.c.iter().flat_map(|c| &c[l * l..(l + 1) * (l + 1)]).map(|x| x * x).sum();
    (0..=all.order).map(band).collect()
}

/// The image with at most `rows` rows, area-exact.
pub(crate) fn reduced(image: &SphereImage, rows: usize) -> SphereImage {
    if image.height <= rows {
        return image.clone();
    }
    let width = (image.width * rows).div_ceil(image.height);
    image.resample(Layout::LatLong, width, rows)
}

fn row_solid_angles(image: &SphereImage) -> Vec<f64> {
    (0..image.height).map(|j| image.layout.solid_angle(image.width, image.height, 0, 0, j)).collect()
}

/// ∫ of the square, all channels.
pub(crate) fn energy(image: &SphereImage) -> f64 {
    let omega = row_solid_angles(image);
    let square = |l: &f32| f64::from(*l).powi(2);
    let row = |j: usize| -> f64 {
        let row = j * image.width..(j + 1) * image.width;
        omega[j] * image.planes.iter().flat_map(|p| &p[row.clone()]).map(square).sum::<f64>()
    };
    (0..image.height).map(row).sum()
}

/// Caps the brightest texels of `image`; their excess is appended to `beams`.
pub(crate) fn split(mut image: SphereImage, beams: &mut Vec<Beam>) -> SphereImage {
    let omega = row_solid_angles(&image);
    let value =
        |image: &SphereImage, k: usize| image.planes.iter().map(|p| f64::from(p[k]).max(0.0)).sum::<f64>();
    let width = image.width;
    let texels = width * image.height;
    let total: f64 = (0..texels).map(|k| value(&image, k) * omega[k / width]).sum();
    let dimmest = BEAM_CONTRAST * total / (4.0 * std::f64::consts::PI);
    let mut bright: Vec<(usize, f64)> = (0..texels)
        .map(|k| (k, value(&image, k)))
        .filter(|&(k, v)| v > dimmest && v * omega[k / width] > BEAM_FLUX * total)
        .collect();
    bright.sort_by(|a, b| {
        (b.1 * omega[b.0 / width]).total_cmp(&(a.1 * omega[a.0 / width])).then(a.0.cmp(&b.0))
    });
    bright.truncate(MAX_BEAMS);
    for (k, v) in bright {
        let (i, j) = (k % width, k / width);
        let at = Position { face: 0, x: i as f64 + 0.5, y: j as f64 + 0.5 };
        let d = image.layout.direction(width, image.height, at).unwrap_or(DVec3::Y);
        let keep = dimmest / v;
        let mut flux = [0.0; 3];
        for c in 0..3 {
            let l = image.planes[c][k];
            let kept = if l > 0.0 { (f64::from(l) * keep) as f32 } else { l };
            flux[c] = f64::from(l - kept) * omega[j];
            image.planes[c][k] = kept;
        }
        beams.push(Beam::texel(d, omega[j], flux));
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_light::DiskLight;

    #[test]
    fn bright_texels_become_beams_and_nothing_is_lost() {
        let mut image =
            SphereImage::from_fn(Layout::LatLong, 128, 64, |d| [1.0 + 0.5 * d.y as f32, 1.0, 0.2]);
        let k = image.index(0, 30, 20);
        image.planes[0][k] = 5000.0;
        image.planes[1][k] = 4000.0;
        let before = image.integral();
        let s = Source::of(Some(image), Vec::new(), 16, &Task::quiet()).unwrap();
        assert_eq!(s.beams.len(), 1);
        let after = s.base.as_ref().unwrap().integral();
        for c in 0..3 {
            assert!((after[c] + s.beams[0].flux[c] - before[c]).abs() < 1e-5 * before[c]);
        }
        // L_00 is the integral times Y_00.
        let all = s.coefficients(2);
        assert!((all.c[0][0] - before[0] * 0.28209479177387814).abs() < 1e-4 * all.c[0][0]);
    }

    #[test]
    fn a_constant_sky_has_no_beams() {
        let image = SphereImage::from_fn(Layout::LatLong, 32, 16, |_| [1.0; 3]);
        let s = Source::of(Some(image), Vec::new(), 8, &Task::quiet()).unwrap();
        assert!(s.beams.is_empty());
        assert!((s.base_energy - 12.0 * std::f64::consts::PI).abs() < 1e-5);
        assert!(s.bands[1..].iter().all(|b| *b < 1e-20 * s.bands[0]), "{:?}", s.bands);
    }

    #[test]
    fn suns_are_beams() {
        let disk = DiskLight { direction: DVec3::Y, angular_radius: 0.1, radiance: [2.0, 1.0, 0.0] };
        let lights = Lights { disks: vec![disk], ..Lights::default() };
        let s = Source::new(&lights, 4, &Task::quiet()).unwrap();
        assert!((s.beams[0].flux[0] - 2.0 * disk.solid_angle()).abs() < 1e-15);
        assert!(s.coefficients(4).c[0][sh::index(1, -1)] > 0.0);
    }
}
