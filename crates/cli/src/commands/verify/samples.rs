//! The texels of a level that fits look at.

use glam::DVec3;
use std::collections::BTreeSet;
use steradian_prefilter::probe;
use steradian_sphere::SphereImage;

/// Texels of a level that are looked at.
#[derive(Default)]
pub struct Samples {
    /// Face, column, row.
    pub texels: Vec<(usize, usize, usize)>,
    pub directions: Vec<DVec3>,
    pub values: Vec<[f64; 3]>,
    /// Of relative errors, with a floor below which darkness counts less; 0 where the level is clipped.
    pub weights: Vec<f64>,
    /// The value at which the level is clipped, and how many texels.
    pub clipped: Option<(f32, usize)>,
    /// The largest value of each channel.
    pub largest: [f64; 3],
}

/// Largest values of formats: halves, RGB9E5, R11G11B10, RGBD.
const LIMITS: [f32; 5] = [65504.0, 65408.0, 65024.0, 64512.0, 255.0];

/// The value that a format's limit gave many texels, and how many.
fn clipped(image: &SphereImage) -> Option<(f32, usize)> {
    let counted = LIMITS.map(|limit| {
        let at = |k: usize| image.planes.iter().any(|p| (p[k] / limit - 1.0).abs() < 1e-6);
        (limit, (0..image.planes[0].len()).filter(|k| at(*k)).count())
    });
    let most = image.planes.iter().map(|p| largest(p)).fold(0.0, f64::max);
    // The limit is the largest value, and not of a single texel that happens to hold it.
    let known = counted.into_iter().filter(|(l, n)| *n > 0 && most < f64::from(*l) * (1.0 + 1e-6));
    known.max_by_key(|c| c.1).filter(|(l, n)| *l > 255.0 || *n > 3)
}

/// Texels spread over the map, and steps outwards from its brightest point.
const SPREAD: usize = 96;
const STEPS: [f64; 9] = [0.0, 1.0, 2.0, 3.0, 5.0, 8.0, 13.0, 21.0, 34.0];

impl Samples {
    /// Samples of `image`, many of them around `bright`.
    pub fn new(image: &SphereImage, bright: Option<DVec3>) -> Self {
        let (w, h, faces) = (image.width, image.height, image.layout.faces());
        let all = faces * w * h;
        let mut chosen: BTreeSet<(usize, usize, usize)> = BTreeSet::new();
        if all <= 2 * SPREAD {
            chosen.extend((0..all).map(|k| (k / (w * h), k % w, k / w % h)));
        } else {
            chosen.extend((0..SPREAD).map(|k| image.texel_of(probe::direction(k, SPREAD))));
            let step = (4.0 * std::f64::consts::PI / all as f64).sqrt();
            let centre = bright.unwrap_or_else(|| brightest(image));
            let side = centre.any_orthonormal_vector();
            let up = centre.cross(side);
            for radius in STEPS.map(|s| (s * step).min(1.5)) {
                for k in 0..8 {
                    let (s, c) = (std::f64::consts::FRAC_PI_4 * k as f64 + radius).sin_cos();
                    let d = centre * radius.cos() + (c * side + s * up) * radius.sin();
                    chosen.insert(image.texel_of(d.normalize()));
                }
            }
        }
        let mut samples = Self {
            clipped: clipped(image),
            largest: image.planes.each_ref().map(|p| largest(p)),
            ..Self::default()
        };
        for (face, i, j) in chosen {
            if let Some(d) = image.layout.texel_direction(w, h, face, i, j) {
                samples.texels.push((face, i, j));
                samples.directions.push(d);
                samples.values.push(image.texel(face, i, j).map(f64::from));
            }
        }
        let size = |v: &[f64; 3]| v.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let n = samples.values.len().max(1) as f64;
        // The mean of small powers: suns do not lift the floor.
        let mean = (samples.values.iter().map(|v| size(v).sqrt()).sum::<f64>() / n).powi(2);
        let limit = samples.clipped.map_or(f64::INFINITY, |c| 0.98 * f64::from(c.0));
        let weight = |v: &[f64; 3]| {
            if size(v) >= limit {
                0.0
            } else {
                1.0 / (size(v).powi(2) + (0.2 * mean).powi(2)).max(f64::MIN_POSITIVE)
            }
        };
        samples.weights = samples.values.iter().map(weight).collect();
        samples
    }
}

fn largest(plane: &[f32]) -> f64 {
    plane.iter().fold(0.0, |m, v| f64::from(*v).max(m))
}

fn brightest(image: &SphereImage) -> DVec3 {
    let [r, g, b] = &image.planes;
    let sum = |k: usize| r[k] + g[k] + b[k];
    let k = (0..r.len()).fold(0, |m, k| if sum(k) > sum(m) { k } else { m });
    let (w, h) = (image.width, image.height);
    image.layout.texel_direction(w, h, k / (w * h), k % w, k / w % h).unwrap_or(DVec3::Y)
}
