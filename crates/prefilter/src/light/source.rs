//! Distant light prepared for filtering: a base image with its spectrum, and small bright lights.
//!
//! A truncated series rings around a small bright light. So the brightest texels are capped at 32 times the
//! mean, and their excess becomes a [`SmallLight`] that filters treat exactly, as they treat suns and
//! directional lights.

use crate::{Cell, SmallLight};
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_light::Lights;
use steradian_parallel::prelude::*;
use steradian_simd::{Arch, Kernel};
use steradian_sphere::sh::{self, Basis, Grid, ShRgb, ShTransform};
use steradian_sphere::{Layout, SphereImage};

/// Rows of the image that filters see at most: they blur, so larger images are first reduced, area-exact.
pub const MAX_HEIGHT: usize = 1024;
/// At most this many texels become small lights.
const MAX_SMALL_LIGHTS: usize = 256;
/// A texel becomes a small light where it holds more than this part of all flux …
const SMALL_LIGHT_FLUX: f64 = 1e-4;
/// … and is this many times brighter than the mean.
const SMALL_LIGHT_CONTRAST: f64 = 32.0;

/// Distant light, prepared.
pub struct Source {
    /// The image without its small lights; `None` without an environment.
    pub base: Option<SphereImage>,
    /// Suns, directional lights and the excess of the brightest texels.
    pub small_lights: Vec<SmallLight>,
    /// Spectrum of `base` up to the order of the analysis.
    pub spectrum: ShRgb,
    /// Spectrum of the small lights, which has no end, up to the same order.
    pub small_spectrum: ShRgb,
    /// ∫ of the square of `base`, all channels.
    pub base_energy: f64,
    /// Energy per band of the whole light: Σ over channels and m of (base + small lights)².
    pub bands: Vec<f64>,
    /// Does the light hold negative texels?
    pub negative: bool,
}

impl Source {
    /// Prepares everything in `lights` but its point lights, with a spectrum up to `order`.
    pub fn new(lights: &Lights, order: usize, task: &Task) -> Result<Self, Cancelled> {
        let image = lights.environment.as_ref().map(|e| reduced(&e.image, MAX_HEIGHT));
        let mut small_lights: Vec<SmallLight> = lights.disks.iter().map(SmallLight::from).collect();
        small_lights.extend(lights.directionals.iter().map(SmallLight::from));
        Self::of(image, small_lights, order, task)
    }

    /// Prepares an image and small lights in addition to it.
    pub fn of(
        image: Option<SphereImage>,
        mut small_lights: Vec<SmallLight>,
        order: usize,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        task.check()?;
        let base = image.map(|i| split(i, &mut small_lights));
        Ok(Self::prepared(base, small_lights, order))
    }

    /// A base image and small lights that [`Source::of`] split, as they were saved.
    pub fn prepared(base: Option<SphereImage>, small_lights: Vec<SmallLight>, order: usize) -> Self {
        // Bright texels are texels of the same image: one plan serves both.
        let plan = base.as_ref().map(|b| ([b.width, b.height], cells_plan(order, [b.width, b.height])));
        let spectrum = match (&base, &plan) {
            (Some(b), Some((_, plan))) => plan.analyze(b.planes.each_ref().map(Vec::as_slice)),
            _ => ShRgb::zero(order),
        };
        let mut small_spectrum = ShRgb::zero(order);
        add_with_plan(&mut small_spectrum, &small_lights, plan);
        Self::of_spectra(base, small_lights, spectrum, small_spectrum)
    }

    /// Assembles the parts.
    fn of_spectra(
        base: Option<SphereImage>,
        small_lights: Vec<SmallLight>,
        spectrum: ShRgb,
        small_spectrum: ShRgb,
    ) -> Self {
        let statistics = base.as_ref().map(Statistics::of);
        let base_energy = statistics.as_ref().map_or(0.0, |s| s.energy);
        let negative = statistics.is_some_and(|s| s.negative);
        let energy = |c: usize, l: usize| {
            let at = l * l..(l + 1) * (l + 1);
            let both = spectrum.c[c][at.clone()].iter().zip(&small_spectrum.c[c][at]);
            both.map(|(base, small)| (base + small).powi(2)).sum::<f64>()
        };
        let bands = (0..=spectrum.order).map(|l| (0..3).map(|c| energy(c, l)).sum()).collect();
        Self { base, small_lights, spectrum, small_spectrum, base_energy, bands, negative }
    }

    /// Highest band of the spectrum.
    pub fn order(&self) -> usize {
        self.spectrum.order
    }

    /// Energy of each band of `base`, all channels.
    pub fn base_bands(&self) -> impl Iterator<Item = f64> + '_ {
        let channels = &self.spectrum.c;
        let band = move |l: usize| {
            let at = l * l..(l + 1) * (l + 1);
            channels.iter().flat_map(|c| &c[at.clone()]).map(|x| x * x).sum()
        };
        (0..=self.order()).map(band)
    }

    /// Coefficients of base and small lights together, up to `order` ≤ the spectrum's.
    pub fn coefficients(&self, order: usize) -> ShRgb {
        let order = order.min(self.order());
        let all = |c: usize| {
            let both = self.spectrum.c[c].iter().zip(&self.small_spectrum.c[c]).take(sh::count(order));
            both.map(|(base, small)| base + small).collect()
        };
        ShRgb { order, c: std::array::from_fn(all) }
    }
}

/// Adds the coefficients of small lights: flux · b_l · Y_lm(centre) of disks, exact integrals over cells.
pub fn add_small_lights(to: &mut ShRgb, small_lights: &[SmallLight]) {
    add_with_plan(to, small_lights, None);
}

/// [`add_small_lights`] with the plan of a transform of cells of one size at hand.
fn add_with_plan(to: &mut ShRgb, small_lights: &[SmallLight], plan: Option<([usize; 2], ShTransform)>) {
    for (size, planes) in cells(small_lights) {
        let made;
        let plan = match &plan {
            Some((of, plan)) if *of == size => plan,
            _ => {
                made = cells_plan(to.order, size);
                &made
            }
        };
        let more = plan.analyze(planes.each_ref().map(Vec::as_slice));
        to.c.iter_mut().zip(&more.c).for_each(|(to, c)| to.iter_mut().zip(c).for_each(|(to, c)| *to += c));
    }
    let order = to.order;
    let disks: Vec<&SmallLight> = small_lights.iter().filter(|b| b.cell.is_none()).collect();
    if disks.is_empty() {
        return;
    }
    let basis = Basis::new(order);
    for some in disks.chunks(DISKS) {
        let harmonics = |disk: &&SmallLight| {
            let mut y = vec![0.0; sh::count(order)];
            basis.eval(order, disk.direction, &mut y);
            let spread = disk.spread(order).into_iter().enumerate();
            spread.for_each(|(l, b)| y[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|y| *y *= b));
            y
        };
        let made: Vec<Vec<f64>> = some.par_iter().with_max_len(1).map(harmonics).collect();
        to.c.par_iter_mut().enumerate().for_each(|(c, to)| {
            for (disk, y) in some.iter().zip(&made) {
                to.iter_mut().zip(y).for_each(|(to, y)| *to += disk.flux[c] * y);
            }
        });
    }
}

/// Disks whose coefficients are held at a time: of 1024 bands eight megabytes each.
const DISKS: usize = 8;

/// The transform of an image whose texels are cells.
pub(crate) fn cells_plan(order: usize, [width, height]: [usize; 2]) -> ShTransform {
    ShTransform::new(order, width, height, Grid::Cells)
}

/// For each size of image that cells are texels of, the image that holds those alone.
pub(crate) fn cells(small_lights: &[SmallLight]) -> Vec<([usize; 2], [Vec<f64>; 3])> {
    let mut images: Vec<([usize; 2], [Vec<f64>; 3])> = Vec::new();
    for (small_light, cell) in small_lights.iter().filter_map(|b| Some((b, b.cell?))) {
        let whole = |[a, b]: [f64; 2], circle: f64| (circle / (b - a)).round().max(1.0) as usize;
        let size = [whole(cell.phi, 2.0 * PI), whole(cell.theta, PI)];
        let place = |[a, _]: [f64; 2], circle: f64, n: usize| {
            ((a / circle * n as f64).round().max(0.0) as usize).min(n - 1)
        };
        let (i, j) = (place(cell.phi.map(|p| p + PI), 2.0 * PI, size[0]), place(cell.theta, PI, size[1]));
        let known = images.iter().position(|i| i.0 == size).unwrap_or(images.len());
        if known == images.len() {
            images.push((size, std::array::from_fn(|_| vec![0.0; size[0] * size[1]])));
        }
        let omega = cell.solid_angle();
        (0..3).for_each(|c| images[known].1[c][j * size[0] + i] += small_light.flux[c] / omega);
    }
    images
}

/// The image with at most `rows` rows, area-exact.
pub fn reduced(image: &SphereImage, rows: usize) -> SphereImage {
    if image.height <= rows {
        return image.clone();
    }
    let width = (image.width * rows).div_ceil(image.height);
    image.resample(Layout::LatLong, width, rows)
}

/// ∫ of the square, all channels.
pub(crate) fn energy(image: &SphereImage) -> f64 {
    Statistics::of(image).energy
}

/// Caps the brightest texels of `image`; their excess is appended to `small lights`.
pub(crate) fn split(mut image: SphereImage, small_lights: &mut Vec<SmallLight>) -> SphereImage {
    for bright in bright_texels(&image, &Statistics::of(&image)) {
        bright.cap(&mut image);
        small_lights.push(bright.small_light);
    }
    image
}

/// Results of one pass over a lat-long image.
pub(crate) struct Statistics {
    /// ∫ L dω.
    pub flux: [f64; 3],
    /// ∫ of the positive parts, all channels.
    positive: f64,
    /// ∫ of the square, all channels.
    pub energy: f64,
    /// Is any texel negative?
    pub negative: bool,
    /// Per row the largest sum over channels of positive parts.
    peaks: Vec<f32>,
}

/// Results of one pass over a row: sums, and the largest and the smallest texel.
#[derive(Clone, Copy, Default)]
struct Row {
    flux: [f64; 3],
    positive: f64,
    square: f64,
    peak: f32,
    least: f32,
}

struct Scan<'a>([&'a [f32]; 3]);

impl Kernel for Scan<'_> {
    type Output = Row;

    #[inline(always)]
    fn run<A: Arch>(self) -> Row {
        // Texels of a step, a register of AVX2.
        const N: usize = 8;
        let mut flux = [[0.0_f64; N]; 3];
        let (mut positive, mut square) = ([0.0_f64; N], [0.0_f64; N]);
        let (mut peak, mut least) = ([0.0_f32; N], [0.0_f32; N]);
        let mut add = |planes: [&[f32; N]; 3]| {
            for k in 0..N {
                let mut bright = 0.0;
                for c in 0..3 {
                    let l = planes[c][k];
                    bright += l.max(0.0);
                    least[k] = least[k].min(l);
                    let l = f64::from(l);
                    flux[c][k] += l;
                    square[k] += l * l;
                }
                positive[k] += f64::from(bright);
                peak[k] = peak[k].max(bright);
            }
        };
        let chunks = self.0.map(|p| p.as_chunks::<N>());
        for k in 0..chunks[0].0.len() {
            add(chunks.each_ref().map(|c| &c.0[k]));
        }
        let rest = chunks.map(|c| {
            let mut last = [0.0; N];
            last[..c.1.len()].copy_from_slice(c.1);
            last
        });
        add(rest.each_ref());
        Row {
            flux: flux.map(|f| f.iter().sum()),
            positive: positive.iter().sum(),
            square: square.iter().sum(),
            peak: peak.iter().fold(0.0, |a, &b| a.max(b)),
            least: least.iter().fold(0.0, |a, &b| a.min(b)),
        }
    }
}

impl Statistics {
    pub(crate) fn of(image: &SphereImage) -> Self {
        let row = |j: usize| {
            let at = j * image.width..(j + 1) * image.width;
            steradian_simd::run(Scan(image.planes.each_ref().map(|p| &p[at.clone()])))
        };
        let rows: Vec<Row> = (0..image.height).into_par_iter().with_min_len(16).map(row).collect();
        let mut all = Self { flux: [0.0; 3], positive: 0.0, energy: 0.0, negative: false, peaks: Vec::new() };
        for (j, row) in rows.iter().enumerate() {
            let omega = image.layout.solid_angle(image.width, image.height, 0, 0, j);
            (0..3).for_each(|c| all.flux[c] += omega * row.flux[c]);
            all.positive += omega * row.positive;
            all.energy += omega * row.square;
            all.negative |= row.least < 0.0;
            all.peaks.push(row.peak);
        }
        all
    }
}

/// A bright texel.
pub(crate) struct BrightTexel {
    /// Index of the texel.
    pub k: usize,
    /// Radiance that stays in the image.
    pub kept: [f32; 3],
    /// Excess that is taken off.
    pub small_light: SmallLight,
}

impl BrightTexel {
    /// Takes the excess off the image; returns the texel as it was.
    pub(crate) fn cap(&self, image: &mut SphereImage) -> [f32; 3] {
        std::array::from_fn(|c| std::mem::replace(&mut image.planes[c][self.k], self.kept[c]))
    }
}

/// The brightest texels.
pub(crate) fn bright_texels(image: &SphereImage, s: &Statistics) -> Vec<BrightTexel> {
    let width = image.width;
    let dimmest = SMALL_LIGHT_CONTRAST * s.positive / (4.0 * PI);
    let omega = |j: usize| image.layout.solid_angle(width, image.height, 0, 0, j);
    let value = |k: usize| image.planes.iter().map(|p| f64::from(p[k]).max(0.0)).sum::<f64>();
    let mut bright: Vec<(usize, f64)> = Vec::new();
    for j in (0..image.height).filter(|&j| f64::from(s.peaks[j]) > dimmest * 0.999) {
        let needed = dimmest.max(SMALL_LIGHT_FLUX * s.positive / omega(j));
        let texels = (j * width..(j + 1) * width).map(|k| (k, value(k)));
        bright.extend(texels.filter(|&(_, v)| v > needed));
    }
    bright.sort_by(|a, b| {
        (b.1 * omega(b.0 / width)).total_cmp(&(a.1 * omega(a.0 / width))).then(a.0.cmp(&b.0))
    });
    bright.truncate(MAX_SMALL_LIGHTS);
    bright.into_iter().map(|(k, v)| bright_texel(image, k, dimmest / v)).collect()
}

/// Splits the texel at `k`, of which the part `keep` stays in the image.
fn bright_texel(image: &SphereImage, k: usize, keep: f64) -> BrightTexel {
    let (i, j) = (k % image.width, k / image.width);
    let cell = Cell::texel(i, j, image.width, image.height);
    let omega = image.layout.solid_angle(image.width, image.height, 0, 0, j);
    let l = image.texel(0, i, j);
    let kept = l.map(|l| if l > 0.0 { (f64::from(l) * keep) as f32 } else { l });
    let flux = std::array::from_fn(|c| f64::from(l[c] - kept[c]) * omega);
    BrightTexel { k, kept, small_light: SmallLight::cell(cell, flux) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use steradian_light::DiskLight;

    #[test]
    fn bright_texels_become_small_lights_and_nothing_is_lost() {
        let mut image =
            SphereImage::from_fn(Layout::LatLong, 128, 64, |d| [1.0 + 0.5 * d.y as f32, 1.0, 0.2]);
        let k = image.index(0, 30, 20);
        image.planes[0][k] = 5000.0;
        image.planes[1][k] = 4000.0;
        let before = image.integral();
        let s = Source::of(Some(image), Vec::new(), 16, &Task::quiet()).unwrap();
        assert_eq!(s.small_lights.len(), 1);
        let after = s.base.as_ref().unwrap().integral();
        for c in 0..3 {
            assert!((after[c] + s.small_lights[0].flux[c] - before[c]).abs() < 1e-5 * before[c]);
        }
        // L_00 is the integral times Y_00.
        let all = s.coefficients(2);
        assert!((all.c[0][0] - before[0] * 0.28209479177387814).abs() < 1e-4 * all.c[0][0]);
    }

    #[test]
    fn a_constant_sky_has_no_small_lights() {
        let image = SphereImage::from_fn(Layout::LatLong, 32, 16, |_| [1.0; 3]);
        let s = Source::of(Some(image), Vec::new(), 8, &Task::quiet()).unwrap();
        assert!(s.small_lights.is_empty());
        assert!((s.base_energy - 12.0 * PI).abs() < 1e-5);
        assert!(s.bands[1..].iter().all(|b| *b < 1e-20 * s.bands[0]), "{:?}", s.bands);
    }

    #[test]
    fn suns_are_small_lights() {
        let disk = DiskLight { direction: DVec3::Y, angular_radius: 0.1, radiance: [2.0, 1.0, 0.0] };
        let lights = Lights { disks: vec![disk], ..Lights::default() };
        let s = Source::new(&lights, 4, &Task::quiet()).unwrap();
        assert!((s.small_lights[0].flux[0] - 2.0 * disk.solid_angle()).abs() < 1e-15);
        assert!(s.coefficients(4).c[0][sh::index(1, -1)] > 0.0);
    }
}
