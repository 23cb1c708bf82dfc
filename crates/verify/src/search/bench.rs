//! A file's levels next to their expected contents: samples, damage, errors as they are.

use crate::Input;
use crate::kernel::Kernel;
use crate::light::{Alteration, Reading};
use crate::measure::{self, Error};
use crate::model::Hypothesis;
use crate::orientation::{self, Orientation};
use crate::report::{Encoding, Fault, Level, Report};
use crate::samples::Samples;
use crate::scale::{Column, Moments};
use crate::texture;
use glam::DMat3;
use std::borrow::Cow;
use std::collections::HashMap;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_sphere::{Layout, SphereImage};

/// Levels with a smaller error may be as their tool made them, unless a cause shows clearly.
pub(super) const SMALL: f64 = 0.02;

/// Levels of a perceptual roughness below this show detail.
const SHARP: f64 = 0.25;
/// Least correlation of a level's detail with that of its light, by the perceptual roughness up to which the
/// light is filtered. Of nine photographs in pairs, 256 × 128, different ones reach 0.32 under a mirror, 0.58
/// at 0.17 and 0.77 at 0.33 and 0.5 (one pair of skies with little but a sun reaches 0.84), and a light that
/// was rotated, made 8 times smaller, or clipped at 1 keeps 0.76 under a mirror.
const LIKENESS: [(f64, f64); 3] = [(0.1, 0.5), (0.25, 0.62), (0.6, 0.8)];
/// Least error of levels of another light.
const OFF: f64 = 0.15;

/// A file's levels, prepared.
pub(super) struct Bench<'a> {
    pub input: &'a Input<'a>,
    pub references: Vec<SphereImage>,
    pub sound: Vec<Vec<bool>>,
    pub limits: Vec<f64>,
    pub samples: Vec<Samples>,
    /// Relative errors of the format's rounding, per level.
    pub rounding: Vec<f64>,
    /// Relative errors of each level as it is.
    pub straight: Vec<f64>,
    /// Damage, limits.
    pub marks: Vec<Fault>,
}

impl<'a> Bench<'a> {
    pub fn new(input: &'a Input<'a>, references: Vec<SphereImage>) -> Self {
        let (mut sound, mut marks, mut limits) = (Vec::new(), Vec::new(), Vec::new());
        let (mut samples, mut rounding, mut straight) = (Vec::new(), Vec::new(), Vec::new());
        // Levels in parallel; findings are joined in their order.
        let levels = input.levels.par_iter().zip(&references).enumerate();
        let looked: Vec<_> = levels
            .map(|(m, (image, reference))| {
                let (fine, fault) = texture::sound(m, image, reference);
                (
                    fine,
                    fault,
                    texture::limited(image),
                    texture::rounding(image, input.step, texture::steps(image)),
                )
            })
            .collect();
        for (m, ((image, reference), (fine, fault, limited, rounded))) in
            input.levels.iter().zip(&references).zip(looked).enumerate()
        {
            marks.extend(fault);
            // A limit that the light itself never exceeds has no effect.
            let most = reference.planes.iter().flatten().fold(0.0f32, |a, v| a.max(*v));
            let limited = limited.filter(|(l, _)| most > 1.02 * l);
            marks.extend(limited.map(|(limit, texels)| Fault::Limited { level: m, limit, texels }));
            let limit = limited.map_or(f64::INFINITY, |l| f64::from(l.0));
            samples.push(Samples::new(image, &fine, limit));
            rounding.push(rounded);
            straight.push(measure::weighted(image, reference, &fine, limit));
            sound.push(fine);
            limits.push(limit);
        }
        Self { input, references, sound, limits, samples, rounding, straight, marks }
    }

    /// Faults that the texels show by themselves: steps of the format, or seams.
    pub fn plain_texture(&self) -> Option<Report> {
        let n = self.input.levels.len();
        let coarse = self.input.levels.iter().map(texture::steps).collect::<Option<Vec<_>>>();
        let within = (0..n).all(|m| self.straight[m] <= SMALL.min(2e-3).hypot(1.4 * self.rounding[m]));
        if let Some(steps) = coarse.filter(|_| within && self.input.step == 0.0) {
            let worst = self.rounding.iter().fold(0.0, |a: f64, b| a.max(*b));
            let mut faults = self.marks.clone();
            faults.extend((worst > SMALL).then_some(Fault::Coarse(steps[0], worst)));
            return Some(self.report(None, faults, None));
        }
        let (inside, border) =
            texture::seams(self.input.levels, &self.references, &self.sound, &self.limits)?;
        let only = border > SMALL && border > 4.0 * inside && inside < SMALL;
        only.then(|| {
            let mut faults = self.marks.clone();
            faults.push(Fault::Seams(border));
            self.report(None, faults, None)
        })
    }

    /// The report, including the best hypothesis where that deviates from the expected one.
    pub fn report(
        &self,
        found: Option<(&Hypothesis, &[SphereImage])>,
        faults: Vec<Fault>,
        reading: Option<Reading>,
    ) -> Report {
        let level = |m: usize| {
            let (image, reference, expected) =
                (&self.input.levels[m], &self.references[m], self.input.expected[m]);
            let shape = (image.layout, image.width, image.height);
            let as_it_is = self.straight[m];
            let Some((h, exact)) = found else {
                let gain = self.gain(m);
                let [error, error_as_found] =
                    Error::with_gains(image, reference, [0, 1, 2], [[1.0; 3], gain]);
                return Level {
                    layout: shape.0,
                    width: shape.1,
                    height: shape.2,
                    expected,
                    found: expected,
                    scale: gain,
                    expected_residual: as_it_is,
                    residual: as_it_is,
                    error,
                    error_as_found,
                };
            };
            let mut back = h.orientation.undo(image);
            if h.encoding != Encoding::Linear {
                let f = function(h.encoding);
                back.planes.iter_mut().flatten().for_each(|v| *v = f(f64::from(*v)) as f32);
            }
            Level {
                layout: shape.0,
                width: shape.1,
                height: shape.2,
                expected,
                found: h.kernels[m],
                scale: h.score.factors[m],
                expected_residual: as_it_is,
                residual: h.score.levels[m],
                error: Error::between(image, reference, [0, 1, 2], [1.0; 3]),
                error_as_found: Error::between(&back, &exact[m], h.channels, h.score.factors[m]),
            }
        };
        let orientation = found.map_or(Orientation::Axes(DMat3::IDENTITY), |f| f.0.orientation.clone());
        Report {
            levels: (0..self.input.levels.len()).into_par_iter().map(level).collect(),
            orientation,
            faults,
            reading,
        }
    }

    /// The samples with an encoding undone.
    pub fn decoded(&self, encoding: Encoding) -> Cow<'_, [Samples]> {
        if encoding == Encoding::Linear {
            return Cow::Borrowed(&self.samples);
        }
        let levels = self.samples.iter().zip(&self.limits);
        levels.map(|(s, l)| s.mapped(*l, function(encoding))).collect()
    }

    /// The factor of least squares on each channel of a level as it is.
    pub fn gain(&self, m: usize) -> [f64; 3] {
        let s = &self.samples[m];
        let x: Column =
            s.texels.iter().map(|t| self.references[m].texel(t.0, t.1, t.2).map(f64::from)).collect();
        let [a, b] = Moments::halves(s, &x);
        a.plus(&b).gains([0, 1, 2])
    }

    /// Does the sharpest level share no detail with the light, whatever its turn and its blur? `false` where
    /// there is no sharp level, or no detail.
    pub fn other_light(&self, task: &Task) -> Result<bool, Cancelled> {
        let roughness = |m: usize| self.input.expected[m].roughness().unwrap_or(f64::INFINITY);
        let levels = 0..self.input.levels.len();
        let Some(m) = levels.clone().min_by(|a, b| roughness(*a).total_cmp(&roughness(*b))) else {
            return Ok(false);
        };
        if roughness(m) >= SHARP || self.straight[m] < OFF {
            return Ok(false);
        }
        let level = &self.input.levels[m];
        // Turns move every texel, and detail is compared in few texels.
        let file = small(level);
        let mut maps: HashMap<usize, orientation::Map<'_>> = HashMap::new();
        let mut like = |reference: &SphereImage, r: f64| {
            let least = LIKENESS.into_iter().find(|(most, _)| r < *most).map_or(f64::INFINITY, |l| l.1);
            let reference = small(reference);
            let side = orientation::side(&reference);
            let map = maps.entry(side).or_insert_with(|| orientation::Map::new(&file, side));
            map.detail(&reference).map(|l| l >= least)
        };
        let seen: Vec<bool> = levels.filter_map(|k| like(&self.references[k], roughness(k))).collect();
        if seen.is_empty() || seen.contains(&true) {
            return Ok(false);
        }
        // Single texels of small lamps are another light at first sight.
        for factor in [2, 4, 8] {
            let light = Alteration::Reduced { factor, means: false }.of(self.input.lights);
            let mirror = measure::filtered(&light, &[Kernel::NONE], std::slice::from_ref(level), task)?;
            if mirror.iter().any(|x| like(x, 0.0) == Some(true)) {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// The image, reduced to a few times the texels in which detail is compared, where it has more.
fn small(image: &SphereImage) -> Cow<'_, SphereImage> {
    let rows = 4 * orientation::SIDE;
    match image.layout {
        Layout::Cube if image.width > rows => Cow::Owned(image.resample(Layout::Cube, rows, rows)),
        Layout::LatLong if image.height > 2 * rows => {
            Cow::Owned(image.resample(Layout::LatLong, 4 * rows, 2 * rows))
        }
        _ => Cow::Borrowed(image),
    }
}

/// Function from file values to linear ones.
fn function(e: Encoding) -> fn(f64) -> f64 {
    match e {
        Encoding::Linear => |v| v,
        Encoding::Encoded => |v| texture::decode(v.max(0.0)),
        Encoding::Decoded => |v| texture::encode(v.max(0.0)),
    }
}
