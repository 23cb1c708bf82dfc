//! Small lights apart from what maps hold.
//!
//! An edge of the lobe, as at the horizon, has no end in frequency, and neither has a sun: no maps hold both. Suns are
//! known with the light ([`Sky`]); where a tolerance needs more, small disks are taken out of what else there is
//! ([`Pursuit`]). All are shaded with the exact reflectance, and maps hold what is left, whatever it is.

use super::scaled::{Scaled, both};
use crate::shared::meter::Meter;
use crate::shared::sky::{Sky, disk};
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
#[derive(Clone)]
pub struct Apart {
    /// With the exact reflectance.
    pub disks: Vec<DiskLight>,
    /// By maps.
    pub rest: Spectrum,
    /// Mean square of a coefficient of the rest beyond its bands, per channel.
    pub beyond: [f64; 3],
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
    /// The strongest suns, up to `most`.
    pub fn suns(light: &Sky, most: usize) -> Self {
        let (disks, kept) = light.suns.split_at(most.min(light.suns.len()));
        let taken: Vec<Beam> = disks.iter().map(Beam::from).collect();
        let mut out = Self { disks: disks.to_vec(), rest: light.spectrum.clone(), beyond: light.beyond };
        out.take(taken);
        let last = out.rest.sh.order;
        for sun in kept.iter().map(Beam::from) {
            out.add_beyond(&sun, last);
        }
        out
    }

    /// Where more disks would help these slices most, up to `most` of them.
    pub fn pursue(&self, scaled: &Scaled<'_>, most: usize, task: &Task) -> Result<Pursuit, Cancelled> {
        Pursuit::new(&self.rest.sh, &weights(scaled, self.rest.sh.order), RADIUS, most, task)
    }

    /// The first `count` disks of those found taken out too. Beyond the bands that are known these disks and the light
    /// that they stand for do not cancel.
    pub fn with(&self, found: &Pursuit, count: usize) -> Self {
        let beams = found.beams(&self.rest.sh, count);
        let mut out = self.clone();
        out.disks.extend(beams.iter().map(disk));
        let last = out.rest.sh.order;
        beams.iter().for_each(|b| out.add_beyond(b, last));
        out.take(beams);
        out
    }

    /// How maps see the rest.
    pub fn meter(&self) -> Meter {
        Meter::with_beyond(&self.rest, self.beyond)
    }

    fn add_beyond(&mut self, b: &Beam, last: usize) {
        let spread = b.spread(last)[last];
        (0..3).for_each(|c| self.beyond[c] += (b.flux[c] * spread).powi(2) / (4.0 * PI));
    }

    fn take(&mut self, mut beams: Vec<Beam>) {
        beams.iter_mut().for_each(|b| b.flux = b.flux.map(|f| -f));
        add_beams(&mut self.rest.sh, &beams);
    }
}
