//! Directions drawn in proportion to distant light: texels by |L| dω, and disks.

use glam::DVec3;
use std::f64::consts::{PI, TAU};
use steradian_light::{DiskLight, Environment, Lights};
use steradian_sphere::SphereImage;

/// Distant light that can be drawn from. The image is piecewise constant over its exact texels.
#[derive(Debug, Clone)]
pub(super) struct Sampler<'a> {
    lights: &'a Lights,
    image: Option<ImageDistribution<'a>>,
    /// Probability of the image, then of each disk; empty where all is dark.
    chances: Vec<f64>,
}

/// A lat-long image with the running sums of |L| dω.
#[derive(Debug, Clone)]
struct ImageDistribution<'a> {
    image: &'a SphereImage,
    /// ∑ over texels up to and with this one, rows from the top.
    sums: Vec<f64>,
}

/// The brightness by which lights are weighed.
fn brightness(v: [f64; 3]) -> f64 {
    v[0].abs() + v[1].abs() + v[2].abs()
}

impl<'a> ImageDistribution<'a> {
    fn new(e: &'a Environment) -> Self {
        let image = &e.image;
        let mut sum = 0.0;
        let mut sums = Vec::with_capacity(image.width * image.height);
        for j in 0..image.height {
            let solid_angle = row_solid_angle(image, j);
            for i in 0..image.width {
                sum += brightness(image.texel(0, i, j).map(f64::from)) * solid_angle;
                sums.push(sum);
            }
        }
        Self { image, sums }
    }

    fn power(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }

    /// The texel that holds part `u` of the power, and a uniform direction in it.
    fn sample(&self, u: f64, v: glam::DVec2) -> DVec3 {
        let at = u * self.power();
        let k = self.sums.partition_point(|s| *s <= at).min(self.sums.len() - 1);
        let (w, h) = (self.image.width, self.image.height);
        let (i, j) = (k % w, k / w);
        let (y0, y1) = ((PI * j as f64 / h as f64).cos(), (PI * (j + 1) as f64 / h as f64).cos());
        let phi = ((i as f64 + v.x) / w as f64 - 0.5) * TAU;
        let y = y0 + (y1 - y0) * v.y;
        let r = (1.0 - y * y).max(0.0).sqrt();
        DVec3::new(r * phi.cos(), y, r * phi.sin())
    }

    /// Radiance and density of [`Self::sample`] at `d`.
    fn at(&self, d: DVec3) -> ([f64; 3], f64) {
        let l = self.image.nearest(d).map(f64::from);
        let power = self.power();
        (l, if power > 0.0 { brightness(l) / power } else { 0.0 })
    }
}

/// Solid angle of a texel of row j.
pub(super) fn row_solid_angle(image: &SphereImage, j: usize) -> f64 {
    row_solid_angle_of(image.width, image.height, j)
}

/// Solid angle of a texel of row `j`, in an image of that width and height.
pub(super) fn row_solid_angle_of(width: usize, height: usize, j: usize) -> f64 {
    let edge = |j: usize| (PI * j as f64 / height as f64).cos();
    (edge(j) - edge(j + 1)) * TAU / width as f64
}

impl<'a> Sampler<'a> {
    /// For all distant light that has an extent.
    pub fn new(lights: &'a Lights) -> Self {
        let image =
            lights.environment.as_ref().map(|e| ImageDistribution::new(e)).filter(|t| t.power() > 0.0);
        let mut chances = vec![image.as_ref().map_or(0.0, ImageDistribution::power)];
        chances.extend(lights.disks.iter().map(|d| brightness(d.radiance) * d.solid_angle()));
        let total: f64 = chances.iter().sum();
        if total > 0.0 {
            chances.iter_mut().for_each(|c| *c /= total);
        } else {
            chances.clear();
        }
        Self { lights, image, chances }
    }

    /// A direction; `None` where all is dark.
    pub fn sample(&self, mut u: f64, v: glam::DVec2) -> Option<DVec3> {
        let last = self.chances.iter().rposition(|c| *c > 0.0)?;
        for (k, &chance) in self.chances.iter().enumerate() {
            if u < chance || k == last {
                let u = (u / chance).clamp(0.0, 1.0);
                return match (k, &self.image) {
                    (0, Some(image)) => Some(image.sample(u, v)),
                    (0, None) => None,
                    _ => Some(in_disk(&self.lights.disks[k - 1], v)),
                };
            }
            u -= chance;
        }
        None
    }

    /// Radiance from direction `d`, and the density of [`Self::sample`] there, per steradian.
    pub fn at(&self, d: DVec3) -> ([f64; 3], f64) {
        let (mut l, mut pdf) = match &self.image {
            Some(image) => {
                let (l, pdf) = image.at(d);
                (l, pdf * self.chances[0])
            }
            None => ([0.0; 3], 0.0),
        };
        for (k, disk) in self.lights.disks.iter().enumerate() {
            // |d − c|² = 2(1 − cos) keeps small angles accurate.
            let chord = 2.0 * (0.5 * disk.angular_radius).sin();
            if (d - disk.direction.normalize_or_zero()).length_squared() <= chord * chord {
                for c in 0..3 {
                    l[c] += disk.radiance[c];
                }
                if let Some(chance) = self.chances.get(k + 1) {
                    pdf += chance / disk.solid_angle().max(f64::MIN_POSITIVE);
                }
            }
        }
        (l, pdf)
    }
}

/// A uniform direction within a disk.
fn in_disk(disk: &DiskLight, v: glam::DVec2) -> DVec3 {
    let axis = disk.direction.normalize_or(DVec3::Y);
    let (a, b) = axis.any_orthonormal_pair();
    let s = (0.5 * disk.angular_radius).sin();
    let lost = 2.0 * s * s * v.x;
    let r = (lost * (2.0 - lost)).max(0.0).sqrt();
    let (sin, cos) = (TAU * v.y).sin_cos();
    axis * (1.0 - lost) + a * (r * cos) + b * (r * sin)
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;
    use steradian_sphere::Layout;

    /// E[1/p] over samples of p is the solid angle of the support; E[g/p] = ∫ g.
    #[test]
    fn the_density_is_that_of_the_samples() {
        let mut image = SphereImage::new(Layout::LatLong, 16, 8);
        for (k, v) in image.planes[1].iter_mut().enumerate() {
            *v = 1.0 + (k % 5) as f32;
        }
        let mut lights = Lights::from(Environment { image });
        lights.disks.push(DiskLight { direction: DVec3::X, angular_radius: 0.3, radiance: [40.0; 3] });
        let sampler = Sampler::new(&lights);
        let mut random = Random::new(1, 2, 3);
        let n = 200_000;
        let (mut sum, mut squares) = ([0.0; 2], [0.0; 2]);
        for _ in 0..n {
            let d = sampler.sample(random.next(), random.pair()).expect("there is light");
            assert!((d.length() - 1.0).abs() < 1e-12);
            let (_, pdf) = sampler.at(d);
            for (c, g) in [1.0, d.x * d.x].into_iter().enumerate() {
                sum[c] += g / pdf;
                squares[c] += (g / pdf) * (g / pdf);
            }
        }
        for (c, truth) in [4.0 * PI, 4.0 * PI / 3.0].into_iter().enumerate() {
            let mean = sum[c] / f64::from(n);
            let sigma = ((squares[c] / f64::from(n) - mean * mean) / f64::from(n)).sqrt();
            assert!((mean - truth).abs() < 4.0 * sigma, "{mean} {truth} {sigma}");
        }
    }
}
