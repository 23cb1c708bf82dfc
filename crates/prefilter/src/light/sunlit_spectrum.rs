//! Spectrum of distant light, with a list of the suns in it.
//!
//! A sun has no end in frequency, and its outline counts where the horizon crosses it and where the lobe is
//! not much wider than its texels. So small bright lights are listed in addition to the spectrum of all
//! light: disks, directional lights, and the texels that make the suns and lamps of an image, constant over
//! their cells.
//!
//! Of all other light only the energy E beyond the highest band L is kept, to estimate the error of leaving
//! it out. Images are made of edges, whose coefficients fall like l^−3 in the mean square, so that each
//! coefficient beyond L has E/(2L²).

use super::source::{MAX_HEIGHT, add_small_lights, reduced};
use crate::{SmallLight, Source, Sun};
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_light::{CellLight, DiskLight, Lights};
use steradian_sphere::sh::{self, ShRgb};

/// Texels count as suns only if they hold at least this part of all flux together.
const SUN: f64 = 0.02;
/// Texels are taken as suns, the brightest first, until the bright texels that remain hold this part of Σ
/// flux² of all bright texels …
const LEFT: f64 = 1e-3;
/// … or, where that takes more than [`MOST`] texels, at most this part.
const LEFT_AT_MOST: f64 = 0.02;
/// Most texels that are suns; an image that needs more has large bright areas, as windows are, and none.
const MOST: usize = 72;
/// Angular radius, radians, of the disk that represents a directional light.
const DIRECTION: f64 = 1e-4;

/// Light and its suns.
#[derive(Debug, Clone, PartialEq)]
pub struct SunlitSpectrum {
    /// Everything, suns too.
    pub spectrum: ShRgb,
    /// The strongest first.
    pub suns: Vec<Sun>,
    /// Mean square of a coefficient of all but the suns beyond the spectrum's bands, per channel.
    pub beyond: [f64; 3],
}

impl SunlitSpectrum {
    /// Analyses the distant light of `lights` up to `order`.
    pub fn new(lights: &Lights, order: usize, task: &Task) -> Result<Self, Cancelled> {
        let source = Source::new(lights, order, task)?;
        let order = order.min(source.order());
        let (disks, sky): (Vec<DiskLight>, Vec<DiskLight>) =
            lights.disks.iter().partition(|d| d.angular_radius <= DiskLight::WIDEST_SUN);
        let mut suns: Vec<Sun> = disks.into_iter().map(Sun::Disk).collect();
        let point = |b: SmallLight| Sun::disk(&SmallLight { radius: DIRECTION, ..b });
        suns.extend(lights.directionals.iter().map(|d| point(SmallLight::from(d))));
        // The source lists lights first, then its texels.
        let small = lights.disks.len() + lights.directionals.len();
        let flux = |b: &SmallLight| b.flux.iter().sum::<f64>();
        let image: f64 = source.base.as_ref().map_or(0.0, |b| b.integral().iter().sum());
        let whole = image + source.small_lights.iter().map(flux).sum::<f64>();
        let size = source.base.as_ref().map_or([1; 2], |b| [b.width, b.height]);
        let (bright, mut others) = bright(&source.small_lights[small..], size, whole);
        suns.extend(bright);
        suns.retain(|s| s.strength() != 0.0);
        suns.sort_by(|a, b| b.strength().total_cmp(&a.strength()));
        others.extend(sky.iter().map(SmallLight::from));
        let base = ShRgb { order, c: source.spectrum.c.each_ref().map(|c| c[..sh::count(order)].to_vec()) };
        let beyond = beyond(&source, &base, &others);
        // The spectrum is projected from the image itself, whose texels are constant over their cells.
        let environment = lights.environment.as_ref();
        let image = environment.map(|e| sh::project(&reduced(&e.image, MAX_HEIGHT), order));
        let mut sh = image.unwrap_or_else(|| ShRgb::zero(order));
        add_small_lights(&mut sh, &source.small_lights[..small]);
        Ok(Self { spectrum: sh, suns, beyond })
    }
}

/// Splits bright texels into suns and others. `size` is the number of columns and rows of the image, `whole`
/// the flux of all light.
fn bright(texels: &[SmallLight], size: [usize; 2], whole: f64) -> (Vec<Sun>, Vec<SmallLight>) {
    let strength = |b: &SmallLight| b.flux.iter().sum::<f64>();
    let mut sorted = texels.to_vec();
    sorted.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    let all: f64 = sorted.iter().map(|b| strength(b).powi(2)).sum();
    let (mut taken, mut left, mut flux) = (Vec::new(), all, 0.0);
    for b in &sorted {
        if left <= LEFT * all || taken.len() == MOST {
            break;
        }
        left -= strength(b).powi(2);
        flux += strength(b);
        taken.push(cell(b, size));
    }
    if flux < SUN * whole || left > LEFT_AT_MOST * all {
        return (Vec::new(), sorted);
    }
    sorted.drain(..taken.len());
    (taken, sorted)
}

/// The texel whose centre a small light has.
fn cell(b: &SmallLight, [width, height]: [usize; 2]) -> Sun {
    let (theta, phi) = (b.direction.y.clamp(-1.0, 1.0).acos(), b.direction.z.atan2(b.direction.x));
    let at = |share: f64, n: usize| ((share * n as f64) as usize).min(n - 1);
    let cell = CellLight::texel(at(0.5 + phi / (2.0 * PI), width), at(theta / PI, height), width, height);
    Sun::Cell(CellLight { radiance: b.flux.map(|f| f / cell.solid_angle()), ..cell })
}

/// [`SunlitSpectrum::beyond`]: from the part of the image's energy that its bands do not hold, and from
/// `others`, small lights with a flat spectrum.
fn beyond(source: &Source, base: &ShRgb, others: &[SmallLight]) -> [f64; 3] {
    let last = base.order.max(1);
    let mut out = [0.0; 3];
    if let Some(image) = &source.base {
        for (c, out) in out.iter_mut().enumerate() {
            let row = |j: usize| {
                let omega = image.layout.solid_angle(image.width, image.height, 0, 0, j);
                let texels = &image.planes[c][j * image.width..(j + 1) * image.width];
                omega * texels.iter().map(|l| f64::from(*l).powi(2)).sum::<f64>()
            };
            let energy: f64 = (0..image.height).map(row).sum();
            let known: f64 = base.c[c].iter().map(|x| x * x).sum();
            *out = (energy - known).max(0.0) / (2 * last * last) as f64;
        }
    }
    for b in others {
        let spread = b.spread(last)[last];
        (0..3).for_each(|c| out[c] += (b.flux[c] * spread).powi(2) / (4.0 * PI));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_light::Environment;
    use steradian_sphere::{Layout, SphereImage};

    /// The sun of a coarse image, near its pole where texels are narrow, keeps its outline; the spectrum is
    /// that of the image, and without the suns that of the image without them.
    #[test]
    fn suns_keep_their_outline() {
        let mut image = SphereImage::from_fn(Layout::LatLong, 128, 64, |d| [1.0 + 0.5 * d.x as f32; 3]);
        let sky = image.clone();
        let texels = [(30, 9, 3e4), (31, 9, 2e4), (30, 10, 2e4)];
        for (i, j, l) in texels {
            let k = image.index(0, i, j);
            image.planes.iter_mut().for_each(|p| p[k] = l);
        }
        let light = |image: &SphereImage| {
            let lights = Lights::from(Environment::from_image(image.clone()));
            SunlitSpectrum::new(&lights, 60, &Task::quiet()).expect("not cancelled")
        };
        let made = light(&image);
        assert_eq!(made.suns.len(), 3);
        let off = |a: &ShRgb, b: &ShRgb| -> f64 {
            let d: f64 = a.c[0].iter().zip(&b.c[0]).map(|(a, b)| (a - b).powi(2)).sum();
            (d / b.c[0].iter().map(|x| x * x).sum::<f64>()).sqrt()
        };
        let exact = sh::project(&image, 60);
        assert!(off(&made.spectrum, &exact) < 1e-12);
        for sun in &made.suns {
            let Sun::Cell(c) = sun else { panic!("{sun:?}") };
            let seen = texels.iter().any(|(i, j, l)| {
                let cell = CellLight::texel(*i, *j, 128, 64);
                (cell.centre() - c.centre()).length() < 1e-12
                    && (c.radiance[0] / f64::from(*l) - 1.0).abs() < 0.1
            });
            assert!(seen, "{c:?}");
        }
        let mut rest = made.spectrum.clone();
        for sun in &made.suns {
            let mut small_lights = sun.small_lights(60);
            small_lights.iter_mut().for_each(|b| b.flux = b.flux.map(|f| -f));
            add_small_lights(&mut rest, &small_lights);
        }
        let mut capped = sky;
        for (i, j, _) in texels {
            let k = capped.index(0, i, j);
            let sun = made.suns.iter().find_map(|s| match s {
                Sun::Cell(c) if (c.centre() - CellLight::texel(i, j, 128, 64).centre()).length() < 1e-9 => {
                    Some(c)
                }
                _ => None,
            });
            let taken = sun.map_or(0.0, |c| c.radiance[0]) as f32;
            capped.planes.iter_mut().for_each(|p| p[k] = image.planes[0][k] - taken);
        }
        let left = off(&rest, &sh::project(&capped, 60));
        assert!(left < 1e-5, "{left}");
        for sun in &made.suns {
            assert_eq!(Sun::from_numbers(&sun.numbers()).as_ref(), Some(sun));
        }
    }
}
