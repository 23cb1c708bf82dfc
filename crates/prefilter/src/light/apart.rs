//! Small lights apart from what maps hold.
//!
//! An edge of the lobe, as at the horizon, has no end in frequency, and neither has a sun: no maps hold both.
//! So suns ([`SunlitSpectrum`]) are taken out of the light and shaded with the exact reflectance; maps hold
//! what is left, whatever it is.

use super::source::add_small_lights;
use crate::{SmallLight, Sun, SunlitSpectrum};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_sphere::sh::ShRgb;

/// Texels of suns that are no wider than this, radians, and no farther from the strongest of them are merged
/// into one disk.
const NEAR: f64 = 0.02;

/// The suns that are shaded exactly, and the spectrum of all other light.
#[derive(Debug, Clone)]
pub struct Apart {
    /// Suns, shaded with the exact reflectance.
    pub suns: Vec<Sun>,
    /// Spectrum of the light that maps hold.
    pub rest: ShRgb,
    /// Mean square of a coefficient of `rest` beyond its bands, per channel.
    pub beyond: [f64; 3],
}

impl Apart {
    /// In relative errors, the mean square radiance of the light without suns counts as no less than this
    /// part of that of all light.
    pub const LEAST: f64 = 1e-4;

    /// The strongest suns, up to `most`.
    pub fn suns(light: &SunlitSpectrum, most: usize) -> Self {
        let (suns, kept) = light.suns.split_at(most.min(light.suns.len()));
        let mut out = Self { suns: suns.to_vec(), rest: light.spectrum.clone(), beyond: light.beyond };
        out.take(suns);
        out.count_beyond(&kept.iter().map(Sun::small_light).collect::<Vec<_>>());
        out
    }

    /// The strongest suns, up to `most`, where each is one disk of the flux, the centre and the second moment
    /// of its texels. The difference between that disk and the texels' outline stays in `rest`.
    pub fn round_suns(light: &SunlitSpectrum, most: usize) -> Self {
        let mut out = Self { suns: Vec::new(), rest: light.spectrum.clone(), beyond: light.beyond };
        let mut left: Vec<SmallLight> = light.suns.iter().map(Sun::small_light).collect();
        let mut taken = Vec::new();
        while let Some(first) = left.first().copied().filter(|_| taken.len() < most) {
            let angle = |b: &SmallLight| b.direction.angle_between(first.direction);
            let near = |b: &SmallLight| first.radius.max(b.radius).max(angle(b)) <= NEAR;
            let (mut texels, others): (Vec<SmallLight>, Vec<SmallLight>) = left.drain(1..).partition(near);
            let alone = light.suns.iter().find(|s| texels.is_empty() && s.small_light() == first);
            if let Some(sun) = alone {
                taken.push(*sun);
            } else {
                texels.push(first);
                let round = one(&texels);
                out.count_beyond(&texels);
                out.count_beyond(&[round]);
                taken.push(Sun::disk(&round));
            }
            left = others;
        }
        out.count_beyond(&left);
        out.take(&taken);
        out.suns = taken;
        out
    }

    /// This split with further disks taken out of `rest`. They cancel the light that they replace only up to
    /// the highest band of `rest`; beyond, both are added to `beyond`.
    pub fn with(&self, small_lights: &[SmallLight]) -> Self {
        let mut out = self.clone();
        let disks: Vec<Sun> = small_lights.iter().map(Sun::disk).collect();
        out.count_beyond(small_lights);
        out.take(&disks);
        out.suns.extend(disks);
        out
    }

    fn count_beyond(&mut self, small_lights: &[SmallLight]) {
        let last = self.rest.order;
        for b in small_lights {
            let spread = b.spread(last)[last];
            (0..3).for_each(|c| self.beyond[c] += (b.flux[c] * spread).powi(2) / (4.0 * PI));
        }
    }

    fn take(&mut self, suns: &[Sun]) {
        let mut small_lights: Vec<SmallLight> =
            suns.iter().flat_map(|s| s.small_lights(self.rest.order)).collect();
        small_lights.iter_mut().for_each(|b| b.flux = b.flux.map(|f| -f));
        add_small_lights(&mut self.rest, &small_lights);
    }
}

/// The disk of the flux, the centre and the second moment of `parts`, which are near each other.
fn one(parts: &[SmallLight]) -> SmallLight {
    let weight = |b: &SmallLight| b.flux.iter().sum::<f64>();
    let all: f64 = parts.iter().map(weight).sum();
    let direction = parts.iter().map(|b| weight(b) * b.direction).sum::<DVec3>().normalize();
    // A disk's own second moment about its centre is half of its radius squared.
    let moment = |b: &SmallLight| b.direction.angle_between(direction).powi(2) + 0.5 * b.radius.powi(2);
    let second = parts.iter().map(|b| weight(b) * moment(b)).sum::<f64>() / all;
    let flux = std::array::from_fn(|c| parts.iter().map(|b| b.flux[c]).sum());
    SmallLight { direction, radius: (2.0 * second).sqrt(), flux, cell: None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;
    use steradian_base::Task;
    use steradian_light::{DiskLight, Environment, Lights};
    use steradian_sphere::{Layout, SphereImage};

    fn sky() -> Lights {
        let radiance = |d: DVec3| {
            let up = (0.5 + 0.5 * (2.0 * d.y).tanh()) as f32;
            let side = (3.0 * (d.dot(DVec3::new(0.6, 0.5, 0.62)) - 1.0)).exp() as f32;
            [0.15 + 0.35 * up + 2.0 * side, 0.12 + 0.5 * up + 1.7 * side, 0.1 + 0.9 * up + 1.2 * side]
        };
        Lights::from(Environment { image: SphereImage::from_fn(Layout::LatLong, 256, 128, radiance) })
    }

    /// A sun in two halves becomes one disk of their flux about their middle; a texel elsewhere stays a sun
    /// of its own, or in the light; and disks and `rest` add up to the light.
    #[test]
    fn parts_of_a_sun_become_one_disk() {
        let up = |angle: f64| DMat3::from_rotation_x(angle) * DVec3::Y;
        let sun = |angle, radiance| DiskLight { direction: up(angle), angular_radius: 0.005, radiance };
        let disks = vec![sun(0.5, [3e4, 2e4, 1e4]), sun(0.51, [1e4, 2e4, 3e4]), sun(-1.0, [1e3; 3])];
        let light = Lights { disks: disks.clone(), ..sky() };
        let whole = SunlitSpectrum::new(&light, 40, &Task::quiet()).expect("not cancelled");
        let [one, two] = [1, 9].map(|most| Apart::round_suns(&whole, most));
        assert_eq!((one.suns.len(), two.suns.len()), (1, 2));
        let Sun::Disk(disk) = &one.suns[0] else { panic!("a disk") };
        // Two like disks 0.01 apart: each is 0.005 off the middle.
        assert!((disk.direction - up(0.505)).length() < 1e-9);
        assert!((disk.angular_radius - (2.0f64 * (0.005 * 0.005 * 1.5)).sqrt()).abs() < 1e-6);
        let flux = |d: &DiskLight| d.radiance.map(|l| l * d.solid_angle());
        for c in 0..3 {
            let parts = flux(&disks[0])[c] + flux(&disks[1])[c];
            assert!((flux(disk)[c] / parts - 1.0).abs() < 1e-9);
        }
        let mut again = two.rest.clone();
        add_small_lights(&mut again, &two.suns.iter().map(Sun::small_light).collect::<Vec<_>>());
        let off = again.c[0].iter().zip(&whole.spectrum.c[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9 * whole.spectrum.c[0][0], "{off}");
        // The low bands of `rest` are those of the sky alone.
        let alone = SunlitSpectrum::new(&sky(), 40, &Task::quiet()).expect("not cancelled");
        let near = |k: usize| (two.rest.c[1][k] - alone.spectrum.c[1][k]).abs();
        assert!((0..16).all(|k| near(k) < 1e-3 * alone.spectrum.c[1][0]));
        assert!(one.beyond[0] > two.beyond[0] * 0.999);
    }
}
