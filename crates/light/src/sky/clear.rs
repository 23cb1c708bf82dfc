//! The clear sky.

use super::atmosphere::{Air, GROUND, SUN_RADIUS, aerosol_phase, rayleigh_phase};
use super::scattering::{Multiple, Ray, Scattered, scattered};
use super::spectrum::{Spectrum, into_gamut, rgb};
use crate::DiskLight;
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::{Arc, Mutex};
use steradian_parallel::prelude::*;
use steradian_sphere::{Layout, SphereImage, layout::Position};

/// Height of the eye above the ground, metres.
const EYE: f64 = 2.0;

/// A clear sky: Rayleigh and aerosol scattering and ozone over a round earth, 18 wavelengths, single
/// scattering by marching and higher orders after Hillaire 2020.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClearSky {
    /// Elevation of the sun's centre, radians, −5° to 90° (no refraction).
    pub elevation: f64,
    /// Azimuth of the sun, radians from +X towards +Z.
    pub azimuth: f64,
    /// Turbidity (Preetham, Shirley & Smits 1999), 1 (pure air) to 10 (haze).
    pub turbidity: f64,
    /// Diffuse albedo of the ground, linear Rec. 709.
    pub ground: [f64; 3],
}

/// What does not depend on the sun's place.
struct Atmosphere {
    turbidity: f64,
    albedo: f64,
    air: Air,
    multiple: Multiple,
}

impl Atmosphere {
    /// That of the last sky again where it is the same: a sun that moves asks for the same many times a
    /// second, and it is four fifths of what a sky of 256 × 128 texels takes.
    fn of(turbidity: f64, albedo: f64) -> Arc<Self> {
        static LAST: Mutex<Option<Arc<Atmosphere>>> = Mutex::new(None);
        let same = |a: &Arc<Self>| a.turbidity == turbidity && a.albedo == albedo;
        let last = LAST.lock().ok().and_then(|last| last.clone()).filter(same);
        last.unwrap_or_else(|| {
            let air = Air::new(turbidity);
            let multiple = Multiple::new(&air, albedo);
            let new = Arc::new(Self { turbidity, albedo, air, multiple });
            if let Ok(mut last) = LAST.lock() {
                *last = Some(new.clone());
            }
            new
        })
    }
}

impl ClearSky {
    /// Unit direction to the sun.
    pub fn direction(&self) -> DVec3 {
        let (sin, cos) = self.elevation.sin_cos();
        DVec3::new(cos * self.azimuth.cos(), sin, cos * self.azimuth.sin())
    }

    /// The sky's radiance without the sun's disk, and the sun, unclipped (none once it has set).
    ///
    /// Linear Rec. 709 in W sr⁻¹ m⁻² of the visible band: luminance in cd m⁻² is 179 times the RGB's
    /// luminance ([`super::EFFICACY`]). Below the horizon lies the ground, evenly lit by sky and sun.
    pub fn render(&self, width: usize, height: usize) -> (SphereImage, Option<DiskLight>) {
        let atmosphere = Atmosphere::of(self.turbidity, super::luminance(self.ground));
        let Atmosphere { air, multiple, .. } = &*atmosphere;
        let mut image = SphereImage::new(Layout::LatLong, width, height);
        let sun = self.sun(air);
        if width == 0 || height == 0 {
            return (image, sun);
        }
        let above = height.div_ceil(2);
        let [r, g, b] = image.planes.each_mut().map(|p| p[..above * width].par_chunks_mut(width));
        r.zip(g).zip(b).enumerate().for_each(|(j, ((r, g), b))| {
            self.row(air, multiple, [r, g, b], height, j);
        });
        let irradiance = self.horizontal_irradiance(&image, sun);
        for (plane, (e, a)) in image.planes.iter_mut().zip(irradiance.iter().zip(self.ground)) {
            plane[above * width..].fill((e * a / PI) as f32);
        }
        (image, sun)
    }

    /// The sun as seen from the ground: its irradiance over its solid angle.
    fn sun(&self, air: &Air) -> Option<DiskLight> {
        if self.elevation <= -SUN_RADIUS {
            return None;
        }
        let through = air.sunlight(GROUND + EYE, self.elevation.sin());
        let mut disk =
            DiskLight { direction: self.direction(), angular_radius: SUN_RADIUS, radiance: [0.0; 3] };
        let irradiance = into_gamut(rgb(&product(&through, &air.solar)));
        disk.radiance = irradiance.map(|e| e / disk.solid_angle());
        Some(disk)
    }

    /// One row of texels above the horizon: scattering at a few azimuths from the sun, interpolated; the
    /// phase functions at each texel.
    fn row(&self, air: &Air, multiple: &Multiple, out: [&mut [f32]; 3], height: usize, j: usize) {
        // Cubics between them are 2e-4 off at most, between 9 of them 1.4e-3 (suns from −3° to 40°).
        const AZIMUTHS: usize = 33;
        let width = out[0].len();
        let mu = (PI * (j as f64 + 0.5) / height as f64).cos().max(0.0);
        let sin = (1.0 - mu * mu).sqrt();
        let (mu_s, sin_s) = self.elevation.sin_cos();
        let nodes: Vec<[f64; 9]> = (0..AZIMUTHS)
            .map(|i| {
                let nu = mu * mu_s + sin * sin_s * (PI * i as f64 / (AZIMUTHS - 1) as f64).cos();
                let ray = Ray { r: GROUND + EYE, mu, mu_s, nu };
                colours(&scattered(air, multiple, ray), &air.solar)
            })
            .collect();
        let [r, g, b] = out;
        for i in 0..width {
            let phi = -PI + 2.0 * PI * (i as f64 + 0.5) / width as f64 - self.azimuth;
            let nu = mu * mu_s + sin * sin_s * phi.cos();
            // The angle to the sun's azimuth, 0 to π.
            let delta = (phi + PI).rem_euclid(2.0 * PI) - PI;
            let c = interpolate(&nodes, delta.abs() / PI * (AZIMUTHS - 1) as f64);
            let (pr, pm) = (rayleigh_phase(nu), aerosol_phase(nu));
            let rgb = into_gamut(std::array::from_fn(|k| pr * c[k] + pm * c[3 + k] + c[6 + k]));
            [r[i], g[i], b[i]] = rgb.map(|v| v as f32);
        }
    }

    /// Irradiance of a horizontal surface by the sky above the horizon and the sun, RGB.
    fn horizontal_irradiance(&self, image: &SphereImage, sun: Option<DiskLight>) -> [f64; 3] {
        let (width, height) = (image.width, image.height);
        let mut e = [0.0; 3];
        for j in 0..height.div_ceil(2) {
            let at = Position { face: 0, x: 0.5, y: j as f64 + 0.5 };
            let y = Layout::LatLong.direction(width, height, at).map_or(0.0, |d| d.y.max(0.0));
            let w = y * Layout::LatLong.solid_angle(width, height, 0, 0, j);
            for (e, plane) in e.iter_mut().zip(&image.planes) {
                *e += w * plane[j * width..(j + 1) * width].iter().map(|v| f64::from(*v)).sum::<f64>();
            }
        }
        if let Some(sun) = sun {
            let k = sun.solid_angle() * sun.direction.y.max(0.0);
            e.iter_mut().zip(sun.radiance).for_each(|(e, l)| *e += k * l);
        }
        e
    }
}

fn product(a: &Spectrum, b: &Spectrum) -> Spectrum {
    std::array::from_fn(|k| a[k] * b[k])
}

/// RGB of the three parts under the sun.
fn colours(s: &Scattered, solar: &Spectrum) -> [f64; 9] {
    let parts = [&s.rayleigh, &s.aerosol, &s.multiple].map(|p| rgb(&product(p, solar)));
    std::array::from_fn(|k| parts[k / 3][k % 3])
}

/// Catmull–Rom between nodes of a function that is even at both ends.
fn interpolate(nodes: &[[f64; 9]], x: f64) -> [f64; 9] {
    let last = nodes.len() as isize - 1;
    let i = (x.floor() as isize).clamp(0, last - 1);
    let t = x - i as f64;
    let at = |k: isize| {
        let k = k.abs();
        &nodes[if k > last { 2 * last - k } else { k } as usize]
    };
    let (a, b, c, d) = (at(i - 1), at(i), at(i + 1), at(i + 2));
    std::array::from_fn(|k| {
        let (a, b, c, d) = (a[k], b[k], c[k], d[k]);
        b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)))
    })
}
