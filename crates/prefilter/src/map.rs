//! Filtered images: light convolved with a kernel, evaluated at the texel centres of any layout.
//!
//! Nothing is resampled from another filtered map. In frequency space (Ramamoorthi & Hanrahan 2002, 5.4) where the
//! analysis has all bands that the kernel passes; for sharper kernels only what lies far from each direction, and the
//! texels near it are summed ([`Way::Near`]). The brightest texels are summed exactly where the series would ring.

use crate::sampled::{MAX_ORDER, Sampled, azimuth, beams_at};
use crate::split::Split;
use crate::{Beam, Zonal};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_sphere::sh::{self, ShRgb};
use steradian_sphere::{Layout, SphereImage};

/// How an image was filtered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// Resampled by areas: a mirror.
    Area,
    /// By spherical harmonics.
    Frequency {
        /// Highest band.
        order: usize,
        /// Bright texels and suns that were summed directly.
        beams: usize,
    },
    /// Near texels directly, the rest by spherical harmonics.
    Near {
        /// Highest band of the rest.
        order: usize,
        /// Reach of the direct sum, radians.
        reach: f64,
    },
}

impl Way {
    /// One word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Area => "area",
            Self::Frequency { .. } => "frequency",
            Self::Near { .. } => "near",
        }
    }

    /// Highest band; 0 for a mirror.
    pub fn order(self) -> usize {
        match self {
            Self::Area => 0,
            Self::Frequency { order, .. } | Self::Near { order, .. } => order,
        }
    }
}

/// A filtered image and what is known of it.
#[derive(Debug, Clone)]
pub struct FilteredImage {
    /// ∫ L K at texel centres.
    pub image: SphereImage,
    /// How.
    pub way: Way,
    /// Bound of the relative RMS error by the bands left out.
    pub predicted: f64,
    /// Flux added by raising negative values to zero, relative to all.
    pub clipped: f64,
    /// ∫ L dω · ∫ K dω: what should be in the image.
    pub energy_in: [f64; 3],
    /// ∫ of the image, texel values times solid angles.
    pub energy_out: [f64; 3],
}

/// How far an image is from the sum over all texels, at some of its texels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Deviation {
    /// RMS(error)/RMS(reference).
    pub rms: f64,
    /// Σ error / Σ reference.
    pub bias: f64,
    /// Largest |error|/reference of a channel.
    pub worst: f64,
    /// Texels that were compared.
    pub texels: usize,
}

/// Convolves `light` with `kernel` to relative RMS error `tolerance`, at the texel centres of an image.
pub fn filter_image(
    light: &Sampled,
    kernel: &dyn Zonal,
    (layout, width, height): (Layout, usize, usize),
    tolerance: f64,
    task: &Task,
) -> Result<FilteredImage, Cancelled> {
    task.check()?;
    let k = kernel.coefficients(MAX_ORDER + 64);
    let (f, tail) = order(light, &k, &k, 0.05 * tolerance);
    let tail = tail.max(unevenness(&k, light.image.height));
    let shape = (layout, width, height);
    let suns = |d: DVec3| beams_at(light.suns(), kernel, d);
    // A kernel that is not smooth elsewhere gains nothing by being split.
    let split = (tail > 0.25 * tolerance).then(|| Split::new(kernel, light.order()));
    let split = split.and_then(|split| {
        let far = split.far(light.order() + 64);
        let rest = order(light, &far, &k, 0.0).1;
        (rest < tail).then_some((split, far, rest))
    });
    let (mut image, way, predicted) = if let Some((split, far, rest)) = split {
        let mut image = synthesis(light, light.order(), &far, false, shape);
        task.check()?;
        let near = Near::new(light, &split);
        for_texels(&mut image, |d, texel| {
            let (mut sum, weight) = near.sum(d);
            for b in light.sparks() {
                let w = split.far_value(d.dot(b.direction));
                (0..3).for_each(|c| sum[c] += w * b.flux[c]);
            }
            let (weight, suns) = (weight + far[0], suns(d));
            // Far narrower than a texel no weight is left: what it would see is the nearest one.
            let nearest = light.image.nearest(d);
            for (c, t) in texel.into_iter().enumerate() {
                let mean = if weight > 1e-30 { (f64::from(*t) + sum[c]) / weight } else { nearest[c].into() };
                *t = (mean * k[0] + suns[c]) as f32;
            }
        });
        // Between texels that are wide apart beside the kernel all weights are small.
        let apart = PI / light.image.height as f64 / kernel.width();
        let predicted = rest * (1.0 + apart * apart);
        (image, Way::Near { order: light.order(), reach: split.reach() }, predicted)
    } else {
        let texels = layout.faces() * width * height;
        let (f, merged) = with_sparks(light, &k, f, texels, tolerance);
        let mut image = synthesis(light, f, &k, merged, shape);
        let direct: &[Beam] = if merged { &[] } else { light.sparks() };
        task.check()?;
        let weights = Weights::new(light.image.height, &k[..=f]);
        if !(direct.is_empty() && light.suns().is_empty() && weights.is_one()) {
            for_texels(&mut image, |d, texel| {
                let (more, scale, suns) = (beams_at(direct, kernel, d), weights.scale(d), suns(d));
                for (c, t) in texel.into_iter().enumerate() {
                    *t = ((f64::from(*t) + more[c]) * scale + suns[c]) as f32;
                }
            });
        }
        (image, Way::Frequency { order: f, beams: direct.len() + light.suns().len() }, tail)
    };
    task.check()?;
    let positive = light.image.planes.iter().flatten().all(|&v| v >= 0.0);
    let clipped = if positive { clip(&mut image) } else { 0.0 };
    let energy_out = image.integral();
    let energy_in = light.flux().map(|f| f * k[0]);
    Ok(FilteredImage { image, way, predicted, clipped, energy_in, energy_out })
}

/// The light itself as a [`FilteredImage`].
pub fn mirror_image(light: &Sampled, (layout, width, height): (Layout, usize, usize)) -> FilteredImage {
    let image = light.mirror(layout, width, height);
    let energy_out = image.integral();
    let energy_in = light.flux();
    FilteredImage { image, way: Way::Area, predicted: 0.0, clipped: 0.0, energy_in, energy_out }
}

/// Compares `n` texels, spread over the image, with the sum over all texels of the light.
pub fn deviation(light: &Sampled, kernel: &dyn Zonal, image: &SphereImage, n: usize) -> Deviation {
    let k0 = kernel.coefficients(0)[0];
    let all = image.planes[0].len();
    let n = n.min(all);
    let pair = |i: usize| {
        // Steps of the golden ratio meet faces, rows and columns evenly.
        let k = ((i as f64 * 0.618_033_988_749_894_9).fract() * all as f64) as usize;
        let (face, j, i) =
            (k / (image.width * image.height), k / image.width % image.height, k % image.width);
        let d = image.layout.texel_direction(image.width, image.height, face, i, j)?;
        Some((image.texel(face, i, j).map(f64::from), light.brute_force(kernel, k0, d)))
    };
    let pairs: Vec<_> = (0..n).into_par_iter().filter_map(pair).collect();
    summary(&pairs)
}

fn summary(pairs: &[([f64; 3], [f64; 3])]) -> Deviation {
    let (mut error2, mut energy, mut error, mut sum) = (0.0, 0.0, 0.0, 0.0);
    for (got, exact) in pairs.iter().flat_map(|(g, e)| g.iter().zip(e)) {
        error2 += (got - exact).powi(2);
        energy += exact * exact;
        error += got - exact;
        sum += exact;
    }
    let floor = 1e-6 * (energy / (3 * pairs.len()).max(1) as f64).sqrt();
    let relative = |(g, e): (&f64, &f64)| (g - e).abs() / e.abs().max(floor).max(f64::MIN_POSITIVE);
    let worst = pairs.iter().flat_map(|(g, e)| g.iter().zip(e)).map(relative).fold(0.0, f64::max);
    let ratio = |a: f64, b: f64| if b == 0.0 { 0.0 } else { a / b };
    Deviation { rms: ratio(error2, energy).sqrt(), bias: ratio(error, sum), worst, texels: pairs.len() }
}

/// The smallest order whose bound of the relative RMS error is at most `limit` (or all bands), and that bound.
///
/// What bands above F hold is at most max_{l>F}|k_l|² (∫base² − Σ_{l≤F} base_l²) of the image that the samples stand
/// for (Ramamoorthi & Hanrahan 2002, eq. 5.19 in spirit). The sum over samples holds more: its spectrum repeats
/// mirrored about l = rows, and very sharp kernels see that.
///
/// Errors are relative to the result of the kernel `whole`, of which `k` may be a part, without the brightest texels:
/// they fill little of the map.
fn order(light: &Sampled, k: &[f64], whole: &[f64], limit: f64) -> (usize, f64) {
    let source = &light.source;
    let (top, rows) = (source.order(), light.image.height);
    let bands = light.base_bands();
    let result: f64 = whole.iter().zip(&bands).map(|(k, b)| k * k * b).sum();
    if result <= 0.0 {
        return (0, 0.0);
    }
    let last = k[k.len().saturating_sub(16)..].iter().fold(0.0, |m: f64, k| m.max(k.abs()));
    let mixed = bands.iter().sum::<f64>() / rows as f64;
    // above[l]: energy of bands above l that the image itself does not have.
    let mut repeated = 0.0;
    let mut above = vec![0.0; top + 1];
    for l in (0..=3 * rows).rev() {
        if l <= top {
            above[l] = repeated;
        }
        if l >= rows {
            // Beyond 2 · rows the repetitions along the rings of all latitudes mix.
            let mirrored = (2 * rows).checked_sub(l).and_then(|l| bands.get(l));
            let energy = bands.get(l).or(mirrored).copied().unwrap_or(if l > 2 * rows { mixed } else { 0.0 });
            repeated += k.get(l).map_or(last, |k| k.abs()).powi(2) * energy;
        }
    }
    let mut peak = vec![0.0_f64; k.len()];
    for l in (1..k.len()).rev() {
        peak[l - 1] = peak[l].max(k[l].abs());
    }
    let mut left = source.base_energy;
    let mut tail = 0.0;
    for l in 0..=top {
        left = (left - bands[l]).max(0.0);
        tail = ((peak[l].powi(2) * left + above[l]) / result).sqrt();
        if tail <= limit {
            return (l, tail);
        }
    }
    (top, tail)
}

/// About how much Σ K Ω varies with the direction, by the kernel's bands at the sampling frequency: a sharp kernel
/// meets some texels and misses others. (Ways that divide by the sum as it is do not care.)
fn unevenness(k: &[f64], rows: usize) -> f64 {
    let at = (2 * rows).min(k.len().saturating_sub(16));
    4.0 * k[at..].iter().take(16).fold(0.0, |m: f64, k| m.max(k.abs())) / k[0].abs().max(f64::MIN_POSITIVE)
}

/// Should the bright texels go through the series as well? The order that this takes, if it costs less than
/// summing them directly; else `f` and no.
fn with_sparks(light: &Sampled, k: &[f64], f: usize, texels: usize, tolerance: f64) -> (usize, bool) {
    let mut flux2 = 0.0;
    for c in 0..3 {
        flux2 += light.sparks().iter().map(|b| b.flux[c].abs()).sum::<f64>().powi(2);
    }
    if flux2 == 0.0 {
        return (f, true);
    }
    let result: f64 = light.base_bands().iter().zip(k).map(|(b, k)| b * k * k).sum();
    // All bright texels in one place is the worst that they can be: flux² Σ_{l>F} (2l+1)/4π k_l².
    let allowed = (0.01 * tolerance).powi(2) * result;
    let mut left = 0.0;
    let mut needed = k.len();
    for l in (0..k.len()).rev() {
        left += flux2 * (2 * l + 1) as f64 / (4.0 * PI) * k[l] * k[l];
        if left > allowed {
            break;
        }
        needed = l;
    }
    // Nanoseconds, roughly: a kernel evaluation for each texel, against their coefficients and a longer synthesis.
    let (sparks, n) = (light.sparks().len() as f64, needed as f64);
    let direct = 12.0 * texels as f64 * sparks;
    let series = 0.5 * (n.powi(3) - (f as f64).powi(3)) + 3.0 * sparks * n * n;
    if needed <= MAX_ORDER && series <= direct { (needed.max(f), true) } else { (f, false) }
}

fn synthesis(
    light: &Sampled,
    order: usize,
    k: &[f64],
    sparks: bool,
    (layout, width, height): (Layout, usize, usize),
) -> SphereImage {
    let mut product: ShRgb = light.spectrum(order, sparks);
    product.convolve(&k[..=product.order]);
    sh::synthesize(&product, layout, width, height)
}

/// Calls `f(d, texel)` for every texel in use, rows in parallel.
fn for_texels(image: &mut SphereImage, f: impl Fn(DVec3, [&mut f32; 3]) + Sync) {
    let (layout, width, height) = (image.layout, image.width, image.height);
    let [r, g, b] = image.planes.each_mut().map(|p| p.par_chunks_mut(width.max(1)));
    r.zip(g).zip(b).enumerate().for_each(|(row, ((r, g), b))| {
        for (i, ((r, g), b)) in r.iter_mut().zip(g).zip(b).enumerate() {
            if let Some(d) = layout.texel_direction(width, height, row / height, i, row % height) {
                f(d, [r, g, b]);
            }
        }
    });
}

/// Σ K Ω over all texels, which depends on the latitude only: what divides the sum over texels.
struct Weights {
    /// ∫K / Σ K Ω in equal steps of θ from 0 to π.
    table: Vec<f64>,
}

impl Weights {
    fn new(rows: usize, k: &[f64]) -> Self {
        // c_l = Σ Ω P_l(cos θ_j); then Σ K Ω = Σ (2l+1)/4π k_l c_l P_l(cos θ).
        let mut c = vec![0.0; k.len()];
        for j in 0..rows {
            let theta = PI * (j as f64 + 0.5) / rows as f64;
            let omega = 4.0 * PI * theta.sin() * (0.5 * PI / rows as f64).sin();
            legendre(theta.cos(), k.len(), |l, p| c[l] += omega * p);
        }
        let steps = 4 * k.len() + 16;
        let weight = |i: usize| {
            let mut sum = 0.0;
            let x = (PI * i as f64 / steps as f64).cos();
            legendre(x, k.len(), |l, p| sum += (2 * l + 1) as f64 / (4.0 * PI) * k[l] * c[l] * p);
            if sum > 0.0 { k[0] / sum } else { 1.0 }
        };
        Self { table: (0..=steps).map(weight).collect() }
    }

    fn is_one(&self) -> bool {
        self.table.iter().all(|w| (w - 1.0).abs() < 1e-7)
    }

    fn scale(&self, d: DVec3) -> f64 {
        let x = d.x.hypot(d.z).atan2(d.y) / PI * (self.table.len() - 1) as f64;
        let i = (x as usize).min(self.table.len() - 2);
        self.table[i] + (self.table[i + 1] - self.table[i]) * (x - i as f64)
    }
}

/// Calls `f(l, P_l(x))` for l < n.
fn legendre(x: f64, n: usize, mut f: impl FnMut(usize, f64)) {
    let (mut before, mut p) = (0.0, 1.0);
    for l in 0..n {
        f(l, p);
        let m = l as f64;
        (before, p) = (p, ((2.0 * m + 1.0) * x * p - m * before) / (m + 1.0));
    }
}

/// Sums over the texels around a direction.
struct Near<'a> {
    image: &'a SphereImage,
    split: &'a Split<'a>,
    columns: Vec<[f64; 2]>,
    /// sin θ, cos θ and solid angle of each row.
    rows: Vec<[f64; 3]>,
}

impl<'a> Near<'a> {
    fn new(light: &'a Sampled, split: &'a Split<'a>) -> Self {
        let image = &light.image;
        let (width, height) = (image.width, image.height);
        let row = |j: usize| {
            let (s, c) = (PI * (j as f64 + 0.5) / height as f64).sin_cos();
            [s, c, image.layout.solid_angle(width, height, 0, 0, j)]
        };
        let columns = (0..width).map(|i| azimuth(i, width)).collect();
        Self { image, split, columns, rows: (0..height).map(row).collect() }
    }

    /// Σ L K χ Ω and Σ K χ Ω.
    fn sum(&self, d: DVec3) -> ([f64; 3], f64) {
        let (width, height) = (self.columns.len(), self.rows.len());
        let theta = d.y.clamp(-1.0, 1.0).acos();
        let rho = d.x.hypot(d.z);
        let centre = (0.5 + d.z.atan2(d.x) / (2.0 * PI)) * width as f64 - 0.5;
        let reach = self.split.reach() / PI * height as f64;
        let y = theta / PI * height as f64 - 0.5;
        let first = (y - reach).ceil().max(0.0) as usize;
        let last = ((y + reach).floor().max(0.0) as usize).min(height - 1);
        let (mut sum, mut weight) = ([0.0; 3], 0.0);
        for j in first..=last {
            let [s, c, omega] = self.rows[j];
            // chord² = (ρ − s)² + (y − c)² + 4 ρ s sin²(Δφ/2)
            let apart = (rho - s).powi(2) + (d.y - c).powi(2);
            let room = (self.split.reach2() - apart) / (4.0 * rho * s).max(1e-300);
            if room < 0.0 {
                continue;
            }
            let half = if room >= 1.0 { width as f64 } else { room.sqrt().asin() / PI * width as f64 };
            let (from, to) = if 2.0 * half + 1.0 >= width as f64 {
                (0, width as i64 - 1)
            } else {
                ((centre - half).ceil() as i64, (centre + half).floor() as i64)
            };
            for i in from..=to {
                let i = i.rem_euclid(width as i64) as usize;
                let [cos, sin] = self.columns[i];
                let c2 = (d.x - s * cos).powi(2) + (d.y - c).powi(2) + (d.z - s * sin).powi(2);
                if c2 >= self.split.reach2() {
                    continue;
                }
                let w = self.split.near(c2) * omega;
                weight += w;
                let k = j * width + i;
                (0..3).for_each(|c| sum[c] += w * f64::from(self.image.planes[c][k]));
            }
        }
        (sum, weight)
    }
}

/// Raises negative values to zero; the flux that this adds, relative to all.
fn clip(image: &mut SphereImage) -> f64 {
    if image.planes.iter().flatten().all(|&v| v >= 0.0) {
        return 0.0;
    }
    let before: f64 = image.integral().iter().sum();
    image.planes.iter_mut().flatten().for_each(|v| *v = v.max(0.0));
    let after: f64 = image.integral().iter().sum();
    if after > 0.0 { (after - before) / after } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lobe;
    use steradian_light::{DiskLight, Environment, Lights};

    /// Smooth light, a window and a spark.
    fn lights() -> Lights {
        let mut image = SphereImage::from_fn(Layout::LatLong, 128, 64, |d| {
            let window = if d.z > 0.8 && d.y.abs() < 0.3 { 6.0 } else { 0.0 };
            [1.0 + 0.8 * d.x as f32, 0.3 + window, 0.1 + (d.y as f32).max(0.0)]
        });
        let k = image.index(0, 90, 20);
        (0..3).for_each(|c| image.planes[c][k] = 20_000.0);
        Lights::from(Environment { image })
    }

    #[test]
    fn every_kernel_and_width_is_the_sum_over_texels() {
        let lights = lights();
        for w in [0.01_f64, 0.02, 0.05, 0.15, 0.5, 1.0] {
            // Compact kernels narrower than half a texel see one texel or none.
            let compact = w.max(0.03);
            let n = 2.0 / (compact * compact);
            for kernel in [
                Lobe::ggx(w),
                Lobe::beckmann(compact),
                Lobe::charlie(w.max(0.15)),
                Lobe::blinn_phong(n),
                Lobe::phong(n),
                Lobe::gaussian(compact),
            ] {
                let light = Sampled::new(&lights, &[&kernel], 2e-3, &Task::quiet()).unwrap();
                for (layout, a, b) in [(Layout::Cube, 12, 12), (Layout::LatLong, 30, 15)] {
                    let got = filter_image(&light, &kernel, (layout, a, b), 2e-3, &Task::quiet()).unwrap();
                    assert!(got.image.planes.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
                    let e = deviation(&light, &kernel, &got.image, 40);
                    assert!(e.rms < 1e-3 && e.bias.abs() < 1e-3, "{kernel:?}: {e:?} {:?}", got.way);
                    assert!(e.worst < 1e-2, "{kernel:?}: {e:?} {:?}", got.way);
                }
            }
        }
    }

    #[test]
    fn a_constant_stays_and_a_sun_is_its_lobe() {
        let constant = SphereImage::from_fn(Layout::LatLong, 32, 16, |_| [2.0, 1.0, 0.0]);
        let mut lights = Lights::from(Environment { image: constant });
        let kernel = Lobe::ggx(0.2);
        let run = |lights: &Lights| {
            let light = Sampled::new(lights, &[&kernel], 1e-3, &Task::quiet()).unwrap();
            filter_image(&light, &kernel, (Layout::Cube, 8, 8), 1e-3, &Task::quiet()).unwrap()
        };
        let got = run(&lights);
        assert!(got.image.planes[0].iter().all(|v| (v - 2.0).abs() < 1e-4));
        assert!((got.energy_out[0] / got.energy_in[0] - 1.0).abs() < 1e-4);
        lights.disks.push(DiskLight { direction: DVec3::Y, angular_radius: 0.005, radiance: [1e4; 3] });
        let with = run(&lights);
        let flux = lights.disks[0].solid_angle() * 1e4;
        for (face, i, j) in [(2, 4, 4), (0, 3, 0)] {
            let d = Layout::Cube.texel_direction(8, 8, face, i, j).unwrap();
            let more = f64::from(with.image.texel(face, i, j)[0] - got.image.texel(face, i, j)[0]);
            let expected = flux * kernel.value(d.y);
            assert!((more - expected).abs() < 1e-3 * expected, "{more} {expected}");
        }
    }

    #[test]
    fn mirrors_keep_the_flux() {
        let mut lights = lights();
        lights.disks.push(DiskLight { direction: DVec3::X, angular_radius: 0.05, radiance: [100.0; 3] });
        let light = Sampled::new(&lights, &[], 1e-3, &Task::quiet()).unwrap();
        let m = mirror_image(&light, (Layout::Cube, 16, 16));
        for c in 0..3 {
            let ratio = m.energy_out[c] / m.energy_in[c];
            assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
        }
    }

    #[test]
    fn turning_the_light_turns_the_map() {
        let kernel = Lobe::ggx(0.1);
        let run = |image: SphereImage| {
            let lights = Lights::from(Environment { image });
            let light = Sampled::new(&lights, &[&kernel], 1e-3, &Task::quiet()).unwrap();
            filter_image(&light, &kernel, (Layout::LatLong, 32, 16), 1e-3, &Task::quiet()).unwrap().image
        };
        let image = lights().environment.unwrap().image.clone();
        let mut turned = image.clone();
        // 32 columns of 128 are 8 of 32.
        turned.planes.iter_mut().for_each(|p| p.chunks_exact_mut(128).for_each(|r| r.rotate_left(32)));
        let (mut a, b) = (run(image), run(turned));
        a.planes.iter_mut().for_each(|p| p.chunks_exact_mut(32).for_each(|r| r.rotate_left(8)));
        for (x, y) in a.planes.iter().flatten().zip(b.planes.iter().flatten()) {
            assert!((x - y).abs() < 1e-4 * x.max(1.0), "{x} {y}");
        }
    }
}
