//! Small lights apart from what maps hold.
//!
//! An edge of the lobe, as at the horizon, has no end in frequency, and neither has a sun: no maps hold both. Where a
//! tolerance is asked for, small disks are taken out of the light ([`Pursuit`]) and shaded with the exact reflectance;
//! maps hold what is left, whatever it is, so that nothing is lost by it.

use super::scaled::{Scaled, both};
use crate::shared::spectrum::Spectrum;
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_light::DiskLight;
use steradian_prefilter::source::add_beams;
use steradian_prefilter::{Beam, Pursuit};

/// Angular radius of the disks, radians: a little less than the sun's, below what the highest band resolves.
const RADIUS: f64 = 0.004;
/// Bands that maps hold easily …
const EASY: f64 = 24.0;
/// … and views, radians, beyond which slices are hard.
const HARD: f64 = 0.9;

/// Disks, and the light without them.
pub struct Apart {
    /// With the exact reflectance.
    pub disks: Vec<DiskLight>,
    /// By maps.
    pub rest: Spectrum,
}

/// Where disks would help these slices most, up to `most` of them.
pub fn pursue(light: &Spectrum, scaled: &Scaled<'_>, most: usize, task: &Task) -> Result<Pursuit, Cancelled> {
    Pursuit::new(&light.sh, &weights(scaled, light.sh.order), RADIUS, most, task)
}

/// The energy of the lobes at hard views, by band and for each coefficient, without the easy bands.
fn weights(scaled: &Scaled<'_>, order: usize) -> Vec<f64> {
    let s = scaled.s;
    let hard = |i: &usize| scaled.counts(*i) && (s.azimuth == 0 || scaled.angle(*i) > HARD);
    let mut w = vec![0.0; order + 1];
    for i in (0..scaled.len()).filter(hard) {
        for q in 0..=s.azimuth {
            for (c, row) in s.row(i, q).into_iter().enumerate() {
                let share = both(q) * scaled.share(i, c) / scaled.scale[i][c].powi(2);
                w.iter_mut().zip(row).for_each(|(w, k)| *w += share * k * k);
            }
        }
    }
    // What lies beyond the slices' own bands is like their last ones.
    let last = w.get(s.order).copied().unwrap_or(0.0);
    w.iter_mut().skip(s.order + 1).for_each(|w| *w = last);
    for (l, w) in w.iter_mut().enumerate() {
        let x = (l as f64 / EASY).powi(4);
        *w *= x / ((1.0 + x) * (2 * l + 1) as f64);
    }
    w
}

impl Apart {
    /// The whole light in maps.
    pub fn nothing(light: &Spectrum) -> Self {
        Self { disks: Vec::new(), rest: light.clone() }
    }

    /// The largest part of the flux of `light` that one disk holds.
    pub fn brightest(&self, light: &Spectrum) -> f64 {
        let whole: f64 = light.sh.c.iter().map(|c| c[0] * (4.0 * PI).sqrt()).sum();
        let flux = |d: &DiskLight| d.radiance.iter().sum::<f64>() * d.solid_angle();
        self.disks.iter().map(flux).fold(0.0, f64::max) / whole.max(f64::MIN_POSITIVE)
    }

    /// The first `count` disks taken out.
    pub fn new(light: &Spectrum, found: &Pursuit, count: usize) -> Self {
        let mut beams = found.beams(&light.sh, count);
        let disk = |b: &Beam| {
            let d = DiskLight { direction: b.direction, angular_radius: b.radius, radiance: [0.0; 3] };
            DiskLight { radiance: b.flux.map(|f| f / d.solid_angle()), ..d }
        };
        let disks = beams.iter().map(disk).collect();
        beams.iter_mut().for_each(|b| b.flux = b.flux.map(|f| -f));
        let mut rest = light.clone();
        add_beams(&mut rest.sh, &beams);
        Self { disks, rest }
    }
}
