//! Suns that are taken out of the light and shaded with the exact reflectance: disks, and single texels of
//! the image.

use crate::SmallLight;
use glam::DVec3;
use steradian_light::{CellLight, DiskLight};
use steradian_sphere::quadrature::gauss_legendre;

/// A small light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sun {
    /// A disk.
    Disk(DiskLight),
    /// A texel.
    Cell(CellLight),
}

impl Sun {
    /// Numbers that describe a sun.
    pub const NUMBERS: usize = 12;

    /// A disk of a small light's flux.
    pub fn disk(b: &SmallLight) -> Self {
        let d = DiskLight { direction: b.direction, angular_radius: b.radius, radiance: [0.0; 3] };
        Self::Disk(DiskLight { radiance: b.flux.map(|f| f / d.solid_angle()), ..d })
    }

    /// The disk of its flux and solid angle about its centre.
    pub fn small_light(&self) -> SmallLight {
        match self {
            Self::Disk(d) => SmallLight::from(d),
            Self::Cell(c) => {
                let omega = c.solid_angle();
                SmallLight::texel(c.centre(), omega, c.radiance.map(|l| l * omega))
            }
        }
    }

    /// Small lights that together have the sun's coefficients in spherical harmonics up to `order`: for a
    /// disk, itself; for a texel, directions at the nodes of a product rule, whose error falls faster than
    /// any power of their number once they resolve the highest band.
    pub fn small_lights(&self, order: usize) -> Vec<SmallLight> {
        let Self::Cell(c) = self else { return vec![self.small_light()] };
        // A wave turns by order × half of the side between the middle and the end.
        let [rows, columns] = c.halves().map(|side| {
            let n = 3 + (0.75 * order as f64 * side).ceil() as usize;
            let (x, w) = gauss_legendre(n);
            x.into_iter().zip(w).collect::<Vec<_>>()
        });
        let [a, b] = c.theta;
        let mut out = Vec::with_capacity(rows.len() * columns.len());
        for (x, wx) in &rows {
            let theta = 0.5 * (a + b) + 0.5 * (b - a) * x;
            for (y, wy) in &columns {
                let omega = wx * wy * 0.5 * (b - a) * c.half * theta.sin();
                let flux = c.radiance.map(|l| l * omega);
                let direction = c.direction(theta, c.half * y);
                out.push(SmallLight { direction, radius: 0.0, flux, cell: None });
            }
        }
        out
    }

    /// ∫ L dω, all channels.
    pub fn strength(&self) -> f64 {
        self.small_light().flux.iter().sum()
    }

    /// A texel: pole, meridian, θ from and to, half azimuth, radiance. A disk: its centre for the pole, its
    /// radius for the second θ, 0 for the azimuth.
    pub fn numbers(&self) -> [f64; Self::NUMBERS] {
        let (p, m, theta, half, l) = match self {
            Self::Disk(d) => (d.direction, DVec3::ZERO, [0.0, d.angular_radius], 0.0, d.radiance),
            Self::Cell(c) => (c.pole, c.meridian, c.theta, c.half, c.radiance),
        };
        [p.x, p.y, p.z, m.x, m.y, m.z, theta[0], theta[1], half, l[0], l[1], l[2]]
    }

    /// The sun of [`Sun::numbers`]; `None` where they are not those of one.
    pub fn from_numbers(v: &[f64; Self::NUMBERS]) -> Option<Self> {
        let unit = |d: DVec3| (d.length() - 1.0).abs() < 1e-3;
        let pole = DVec3::from_slice(&v[..3]);
        let (theta, half, radiance) = ([v[6], v[7]], v[8], [v[9], v[10], v[11]]);
        let sound = v.iter().all(|x| x.is_finite()) && unit(pole) && theta[0] >= 0.0 && theta[1] > theta[0];
        if half == 0.0 {
            let disk = DiskLight { direction: pole, angular_radius: theta[1], radiance };
            return sound.then_some(Self::Disk(disk));
        }
        let meridian = DVec3::from_slice(&v[3..6]);
        let whole = std::f64::consts::PI * (1.0 + 1e-12);
        let sound = sound && unit(meridian) && theta[1] <= whole && half > 0.0 && half <= whole;
        sound.then_some(Self::Cell(CellLight { pole, meridian, theta, half, radiance }))
    }
}
