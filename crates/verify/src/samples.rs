//! The texels of a level that hypotheses are tried on.

use glam::DVec3;
use std::collections::BTreeSet;
use steradian_prefilter::probe;
use steradian_sphere::SphereImage;

/// Texels of a level by which hypotheses are compared.
#[derive(Default, Clone)]
pub struct Samples {
    /// Face, column, row.
    pub texels: Vec<(usize, usize, usize)>,
    /// Directions of the texels in the file.
    pub directions: Vec<DVec3>,
    pub values: Vec<[f64; 3]>,
    /// Weights that make errors relative, with a floor below which dark samples count less; 0 where the level
    /// is clipped or damaged.
    pub weights: Vec<f64>,
}

/// Texels spread over the map; with eight around each of six circles a level has 120 at most, on each of
/// which every hypothesis is evaluated.
const SPREAD: usize = 72;
/// Radii, in texels, of the circles around its brightest point: doubled, since kernels of all widths are told
/// apart there.
const STEPS_OUT: [f64; 6] = [0.0, 1.0, 2.0, 4.0, 8.0, 16.0];

impl Samples {
    /// Samples of `image`, many of them around its brightest texel; texels for which `sound` is false do not
    /// count, nor do those of `limit` and more.
    pub fn new(image: &SphereImage, sound: &[bool], limit: f64) -> Self {
        let (w, h, faces) = (image.width, image.height, image.layout.faces());
        let all = faces * w * h;
        let mut chosen: BTreeSet<(usize, usize, usize)> = BTreeSet::new();
        if all <= 2 * SPREAD {
            chosen.extend((0..all).map(|k| (k / (w * h), k % w, k / w % h)));
        } else {
            chosen.extend((0..SPREAD).map(|k| image.texel_of(probe::direction(k, SPREAD))));
            let step = (4.0 * std::f64::consts::PI / all as f64).sqrt();
            let centre = brightest(image, sound);
            let side = centre.any_orthonormal_vector();
            let up = centre.cross(side);
            for radius in STEPS_OUT.map(|s| (s * step).min(1.5)) {
                for k in 0..8 {
                    let (s, c) = (std::f64::consts::FRAC_PI_4 * k as f64 + radius).sin_cos();
                    let d = centre * radius.cos() + (c * side + s * up) * radius.sin();
                    chosen.insert(image.texel_of(d.normalize()));
                }
            }
        }
        let mut samples = Self::default();
        for (face, i, j) in chosen {
            if let Some(d) = image.layout.texel_direction(w, h, face, i, j)
                && sound[image.index(face, i, j)]
            {
                samples.texels.push((face, i, j));
                samples.directions.push(d);
                samples.values.push(image.texel(face, i, j).map(f64::from));
            }
        }
        samples.weigh(limit);
        samples
    }

    /// The texels with other values, for example decoded ones.
    pub fn mapped(&self, limit: f64, f: impl Fn(f64) -> f64) -> Self {
        let mut out = Self { values: self.values.iter().map(|v| v.map(&f)).collect(), ..self.clone() };
        out.weigh(f(limit));
        out
    }

    fn weigh(&mut self, limit: f64) {
        let floor = floor(&self.values);
        self.weights = self.values.iter().map(|v| weight(v, floor, limit)).collect();
    }
}

fn size(v: &[f64; 3]) -> f64 {
    v.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
}

/// Values below this weigh less in relative errors: a fifth of the squared mean of the values' roots, which
/// suns hardly raise.
pub fn floor(values: &[[f64; 3]]) -> f64 {
    floor_of(values.iter().map(root).sum::<f64>() / values.len().max(1) as f64)
}

/// [`floor`] by the mean of [`root`].
pub fn floor_of(mean: f64) -> f64 {
    0.2 * mean.powi(2)
}

/// The power of a value whose mean [`floor`] follows.
pub fn root(v: &[f64; 3]) -> f64 {
    size(v).sqrt()
}

/// The weight of an error's square.
pub fn weight(v: &[f64; 3], floor: f64, limit: f64) -> f64 {
    if size(v) >= 0.98 * limit { 0.0 } else { 1.0 / (size(v).powi(2) + floor * floor).max(f64::MIN_POSITIVE) }
}

fn brightest(image: &SphereImage, sound: &[bool]) -> DVec3 {
    let [r, g, b] = &image.planes;
    let sum = |k: usize| if sound[k] { r[k] + g[k] + b[k] } else { f32::NEG_INFINITY };
    let k = (0..r.len()).fold(0, |m, k| if sum(k) > sum(m) { k } else { m });
    let (w, h) = (image.width, image.height);
    image.layout.texel_direction(w, h, k / (w * h), k % w, k / w % h).unwrap_or(DVec3::Y)
}
