//! Distant light as its spectrum, with the suns in it known one by one.
//!
//! A sun has no end in frequency, and where the horizon crosses it its outline counts. So what is small and bright is kept
//! as disks beside the spectrum of all: disks and directional lights as they are, and the texels that make the suns and
//! lamps of an image. Such a texel is a row of disks where it is longer than wide. What of the
//! others lies beyond the bands is known in the mean: images are made of edges, whose coefficients fall like l^−3 in
//! the mean square, so that an energy E beyond band L is E/(2L²) for each coefficient there.

use crate::direct::{self, Suns};
use crate::shared::spectrum::Spectrum;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Part};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_light::{DiskLight, Lights};
use steradian_prefilter::source::add_beams;
use steradian_prefilter::{Beam, Source};
use steradian_sphere::sh::{self, ShRgb};

/// Suns hold at least this part of all flux together.
const SUN: f64 = 0.02;
/// The texels that are left hold this part of Σ flux² of all bright texels …
const LEFT: f64 = 1e-3;
/// … or this part, where that takes too many disks.
const LEFT_AT_MOST: f64 = 0.02;
/// Disks that texels become at most; where suns are more than that, they are windows.
const MOST: usize = 72;
/// Angular radius, radians, of the disk that stands for a direction.
const DIRECTION: f64 = 1e-4;
/// A texel becomes at most this many disks in a row …
const LONGEST: f64 = 6.0;
/// … each of which stands for a rectangle at most so many times longer than wide.
const SLIM: f64 = 1.5;

/// Light and its suns.
#[derive(Debug, Clone, PartialEq)]
pub struct Sky {
    /// Everything, suns too.
    pub spectrum: Spectrum,
    /// The strongest first.
    pub suns: Vec<DiskLight>,
    /// Mean square of a coefficient of all but the suns beyond the spectrum's bands, per channel.
    pub beyond: [f64; 3],
}

impl Sky {
    /// Analyses everything in `lights` up to `order`; refuses point lights.
    pub fn bake(slug: &'static str, lights: &Lights, order: usize, task: &Task) -> Result<Self, BakeError> {
        let source = Spectrum::source(slug, lights, order, task)?;
        let order = order.min(source.order());
        let (folded, apart) = direct::split(lights, Suns::Exact);
        let mut suns: Vec<Beam> = apart.disks.iter().map(Beam::from).collect();
        let point = |b: Beam| Beam { radius: DIRECTION, ..b };
        suns.extend(apart.directionals.iter().map(|d| point(Beam::from(d))));
        // The source lists lights first, then its texels.
        let texels = &source.beams[lights.disks.len() + lights.directionals.len()..];
        let rows = source.base.as_ref().map_or(1, |b| b.height);
        let flux = |b: &Beam| b.flux.iter().sum::<f64>();
        let image: f64 = source.base.as_ref().map_or(0.0, |b| b.integral().iter().sum());
        let whole = image + source.beams.iter().map(flux).sum::<f64>();
        let (bright, mut others) = bright(texels, PI / rows as f64, whole);
        suns.extend(bright);
        suns.retain(|b| b.flux.iter().any(|f| *f != 0.0));
        suns.sort_by(|a, b| flux(b).total_cmp(&flux(a)));
        others.extend(folded.disks.iter().map(Beam::from));
        let mut sh = ShRgb { order, c: source.spectrum.c.each_ref().map(|c| c[..sh::count(order)].to_vec()) };
        let beyond = beyond(&source, &sh, &others);
        add_beams(&mut sh, &others);
        add_beams(&mut sh, &suns);
        Ok(Self { spectrum: Spectrum { sh }, suns: suns.iter().map(disk).collect(), beyond })
    }
}

/// A disk of the same flux.
pub fn disk(b: &Beam) -> DiskLight {
    let d = DiskLight { direction: b.direction, angular_radius: b.radius, radiance: [0.0; 3] };
    DiskLight { radiance: b.flux.map(|f| f / d.solid_angle()), ..d }
}

/// The texels that are suns, as disks, and the others; texels are `h` radians high, all light has the flux `whole`.
fn bright(texels: &[Beam], h: f64, whole: f64) -> (Vec<Beam>, Vec<Beam>) {
    let strength = |b: &Beam| b.flux.iter().sum::<f64>();
    let mut sorted = texels.to_vec();
    sorted.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    let all: f64 = sorted.iter().map(|b| strength(b).powi(2)).sum();
    let (mut taken, mut left, mut flux, mut count) = (Vec::new(), all, 0.0, 0);
    for b in &sorted {
        let parts = parts(b, h);
        if left <= LEFT * all || taken.len() + parts.len() > MOST {
            break;
        }
        left -= strength(b).powi(2);
        flux += strength(b);
        count += 1;
        taken.extend(parts);
    }
    if flux < SUN * whole || left > LEFT_AT_MOST * all {
        return (Vec::new(), sorted);
    }
    sorted.drain(..count);
    (taken, sorted)
}

/// A texel of height `h` as disks side by side along its longer side.
fn parts(b: &Beam, h: f64) -> Vec<Beam> {
    let omega = 4.0 * PI * (0.5 * b.radius).sin().powi(2);
    let width = omega / h;
    let n = ((h / width).max(width / h) / SLIM).ceil().clamp(1.0, LONGEST) as usize;
    let (theta, phi) = (b.direction.y.clamp(-1.0, 1.0).acos(), b.direction.z.atan2(b.direction.x));
    let sine = theta.sin().max(1e-6);
    let part = |i: usize| {
        let x = (i as f64 + 0.5) / n as f64 - 0.5;
        let (theta, phi) = if h > width { (theta + x * h, phi) } else { (theta, phi + x * width / sine) };
        let direction = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        (direction, theta.sin())
    };
    let parts: Vec<(DVec3, f64)> = (0..n).map(part).collect();
    let all: f64 = parts.iter().map(|p| p.1).sum();
    let one = |(direction, sine): (DVec3, f64)| {
        let share = sine / all;
        Beam::texel(direction, omega * share, b.flux.map(|f| f * share))
    };
    parts.into_iter().map(one).collect()
}

/// See [`Sky::beyond`]: what the image's own energy exceeds its bands by, and small lights, whose spectrum is flat.
fn beyond(source: &Source, base: &ShRgb, others: &[Beam]) -> [f64; 3] {
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

/// Saves disks: direction, angular radius, radiance.
pub fn save_disks(disks: &[DiskLight], to: &mut TensorFile, name: String) {
    let disk = |d: &DiskLight| {
        let [x, y, z] = d.direction.to_array();
        let [r, g, b] = d.radiance;
        [x, y, z, d.angular_radius, r, g, b]
    };
    if !disks.is_empty() {
        put_f64(to, name, vec![disks.len(), 7], disks.iter().flat_map(disk).collect());
    }
}

/// What [`save_disks`] saved; none where there is no such tensor.
pub fn load_disks(from: &TensorFile, name: &str) -> Result<Vec<DiskLight>, PartError> {
    if !from.tensors.contains_key(name) {
        return Ok(Vec::new());
    }
    let (shape, disks) = get_f64(from, name, 2)?;
    let disk = |d: &[f64; 7]| DiskLight {
        direction: DVec3::new(d[0], d[1], d[2]),
        angular_radius: d[3],
        radiance: [d[4], d[5], d[6]],
    };
    let good = shape[1] == 7 && disks.iter().all(|x| x.is_finite());
    let out: Vec<DiskLight> = disks.as_chunks::<7>().0.iter().map(disk).collect();
    let unit = |d: &DiskLight| (d.direction.length() - 1.0).abs() < 1e-3 && d.angular_radius > 0.0;
    if good && out.iter().all(unit) { Ok(out) } else { Err(PartError::Unexpected(name.to_string())) }
}

impl Part for Sky {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        self.spectrum.save(to, prefix);
        save_disks(&self.suns, to, format!("{prefix}.suns"));
        put_f64(to, format!("{prefix}.beyond"), vec![3], self.beyond.to_vec());
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.beyond");
        let (_, beyond) = get_f64(from, &name, 1)?;
        let beyond = <[f64; 3]>::try_from(beyond).ok().filter(|b| b.iter().all(|x| *x >= 0.0));
        Ok(Self {
            spectrum: Spectrum::load(from, prefix)?,
            suns: load_disks(from, &format!("{prefix}.suns"))?,
            beyond: beyond.ok_or(PartError::Unexpected(name))?,
        })
    }

    fn bytes(&self) -> usize {
        self.spectrum.bytes() + 56 * self.suns.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_light::Environment;
    use steradian_sphere::{Layout, SphereImage};

    /// The sun of a coarse image, near its pole where texels are slim, becomes disks with the flux, the centre and the
    /// second moments of its texels; the spectrum is the image's.
    #[test]
    fn suns_keep_their_outline() {
        let mut image = SphereImage::from_fn(Layout::LatLong, 128, 64, |d| [1.0 + 0.5 * d.x as f32; 3]);
        for (i, j, l) in [(30, 9, 3e4), (31, 9, 2e4), (30, 10, 2e4)] {
            let k = image.index(0, i, j);
            image.planes.iter_mut().for_each(|p| p[k] = l);
        }
        let exact = sh::project(&image, 60);
        let lights = Lights::from(Environment::from_image(image.clone()));
        let sky = Sky::bake("test", &lights, 60, &Task::quiet()).expect("bakes");
        assert!(sky.suns.len() >= 3 && sky.suns.len() <= 12, "{}", sky.suns.len());
        let energy: f64 = exact.c[0].iter().map(|x| x * x).sum();
        let off: f64 = exact.c[0].iter().zip(&sky.spectrum.sh.c[0]).map(|(a, b)| (a - b).powi(2)).sum();
        assert!(off < 2e-4 * energy, "{}", off / energy);
        // Along the texels' height, and across it.
        let flux = |d: &DiskLight| d.radiance[0] * d.solid_angle();
        let theta = |d: &DiskLight| d.direction.y.acos();
        let texel = PI / 64.0;
        assert!(sky.suns.iter().all(|d| theta(d) > 9.0 * texel && theta(d) < 11.0 * texel));
        let row = |j: usize| image.layout.solid_angle(128, 64, 0, 0, j);
        let texels = 5e4 * row(9) + 2e4 * row(10);
        let suns: f64 = sky.suns.iter().map(flux).sum();
        assert!((suns / texels - 1.0).abs() < 0.02, "{}", suns / texels);
        // Along the height of the texels: the mean and the variance of three uniform ones.
        let part = |j: usize| if j == 9 { 5e4 * row(9) / texels } else { 2e4 * row(10) / texels };
        let mean =
            |f: &dyn Fn(&DiskLight) -> f64| sky.suns.iter().map(|d| flux(d) * f(d)).sum::<f64>() / suns;
        let centre = (9.5 * part(9) + 10.5 * part(10)) * texel;
        assert!((mean(&theta) - centre).abs() < 0.02 * texel);
        let wide = mean(&|d| (theta(d) - centre).powi(2) + d.angular_radius.powi(2) / 4.0);
        let wanted = (part(9) * part(10) + 1.0 / 12.0) * texel * texel;
        assert!((wide / wanted - 1.0).abs() < 0.05, "{wide} {wanted}");
    }
}
