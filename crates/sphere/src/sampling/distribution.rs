//! Piecewise-constant densities: on the line, and over the texels of a lat-long image.

use crate::layout::Position;
use crate::{Layout, SphereImage};
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// A density on [0, 1) that is constant on n equal pieces.
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution1d {
    /// Running sums of the pieces' probabilities: n + 1 values from 0 to 1.
    cdf: Vec<f64>,
    /// Of parts of [0, 1] of length 1/n the index of the first sum that is not in an earlier one, so that
    /// sums are found without a search through all of them (Chen & Asau 1974); then their number.
    starts: Vec<u32>,
    /// Sum of the weights that it was made of.
    total: f64,
}

impl Distribution1d {
    /// Proportional to `weights` (negative and NaN count as 0); uniform where all are 0.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Self {
        let mut cdf = vec![0.0];
        let mut sum = 0.0;
        for w in weights {
            sum += w.max(0.0);
            cdf.push(sum);
        }
        if cdf.len() == 1 {
            cdf.push(0.0);
        }
        let n = cdf.len() - 1;
        for (k, c) in cdf.iter_mut().enumerate() {
            *c = if sum > 0.0 { *c / sum } else { k as f64 / n as f64 };
        }
        let mut starts = vec![0; n + 2];
        for c in &cdf {
            starts[part(*c, n) + 1] += 1;
        }
        for k in 0..=n {
            starts[k + 1] += starts[k];
        }
        Self { cdf, starts, total: sum }
    }

    /// Number of pieces.
    pub fn len(&self) -> usize {
        self.cdf.len() - 1
    }

    /// Never: there is at least one piece.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Sum of the weights.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// Probability of piece `k`.
    pub fn probability(&self, k: usize) -> f64 {
        self.cdf[k + 1] - self.cdf[k]
    }

    /// The piece that `u` in [0, 1) falls in, and where in it, in [0, 1).
    pub fn sample(&self, u: f64) -> (usize, f64) {
        // The first piece that ends beyond u; pieces of probability 0 are never that. Sums in earlier parts
        // are below u, those in later ones above.
        let part = part(u, self.len());
        let [first, end] = [self.starts[part], self.starts[part + 1]].map(|k| k as usize);
        let k = first + self.cdf[first..end].partition_point(|&c| c <= u);
        let k = k.clamp(1, self.len()) - 1;
        let p = self.probability(k);
        (k, if p > 0.0 { ((u - self.cdf[k]) / p).clamp(0.0, 1.0 - f64::EPSILON) } else { 0.0 })
    }

    /// The `u` that gives place `f` in piece `k`.
    pub fn invert(&self, k: usize, f: f64) -> f64 {
        self.cdf[k] + f * self.probability(k)
    }
}

/// The part of [0, 1], of length 1/n, that `x` lies in; all from 1 on is the last, part n. It never falls as
/// `x` rises.
fn part(x: f64, n: usize) -> usize {
    ((x * n as f64) as usize).min(n)
}

/// Directions with a density proportional to an image's brightness, constant per lat-long texel, with exact
/// solid angles.
#[derive(Debug, Clone, PartialEq)]
pub struct SphereDistribution {
    rows: Distribution1d,
    columns: Vec<Distribution1d>,
    /// Heights of the borders of rows, as 1 − y.
    borders: Vec<f64>,
}

impl SphereDistribution {
    /// The distribution of the mean of the three channels of a lat-long image; `None` for other layouts and
    /// empty images. Dark images give the uniform density.
    pub fn new(image: &SphereImage) -> Option<Self> {
        if image.layout != Layout::LatLong || image.width == 0 || image.height == 0 {
            return None;
        }
        let brightness = |k: usize| image.planes.iter().map(|p| f64::from(p[k]).max(0.0)).sum::<f64>();
        let columns: Vec<_> = (0..image.height)
            .map(|j| Distribution1d::new((0..image.width).map(|i| brightness(image.index(0, i, j)))))
            .collect();
        let omega = |j: usize| image.layout.solid_angle(image.width, image.height, 0, 0, j);
        let rows = Distribution1d::new(columns.iter().enumerate().map(|(j, c)| c.total() * omega(j)));
        let rows = if rows.total() > 0.0 { rows } else { Distribution1d::new((0..image.height).map(omega)) };
        let border = |k: usize| 2.0 * (0.5 * PI * k as f64 / image.height as f64).sin().powi(2);
        Some(Self { rows, columns, borders: (0..=image.height).map(border).collect() })
    }

    /// Heights of a row's upper and lower border, as 1 − y.
    fn row(&self, j: usize) -> (f64, f64) {
        (self.borders[j], self.borders[j + 1])
    }

    /// A direction and its density per steradian; within a texel it is uniform over the solid angle.
    pub fn sample(&self, u: DVec2) -> (DVec3, f64) {
        let (_, d, pdf) = self.sample_texel(u);
        (d, pdf)
    }

    /// [`SphereDistribution::sample`], and before it the texel's index in a plane of the image.
    pub fn sample_texel(&self, u: DVec2) -> (usize, DVec3, f64) {
        let (j, fy) = self.rows.sample(u.x);
        let (i, fx) = self.columns[j].sample(u.y);
        let (a, b) = self.row(j);
        let versine = a + fy * (b - a);
        let phi = TAU * ((i as f64 + fx) / self.columns[j].len() as f64 - 0.5);
        let r = (versine * (2.0 - versine)).max(0.0).sqrt();
        let (s, c) = phi.sin_cos();
        let texel = j * self.columns[j].len() + i;
        (texel, DVec3::new(r * c, 1.0 - versine, r * s), self.density(i, j))
    }

    /// Density of texel (i, j).
    fn density(&self, i: usize, j: usize) -> f64 {
        let (a, b) = self.row(j);
        let omega = TAU / self.columns[j].len() as f64 * (b - a);
        self.rows.probability(j) * self.columns[j].probability(i) / omega
    }

    fn position(&self, d: DVec3) -> Position {
        Layout::LatLong.position(self.columns[0].len(), self.rows.len(), d)
    }

    fn texel(&self, p: &Position) -> (usize, usize) {
        ((p.x as usize).min(self.columns[0].len() - 1), (p.y as usize).min(self.rows.len() - 1))
    }

    /// Texel of a direction, and where in it.
    fn locate(&self, d: DVec3) -> (usize, usize, f64, f64) {
        let p = self.position(d);
        let (i, j) = self.texel(&p);
        let (a, b) = self.row(j);
        let versine = if d.y > 0.0 { (d.x * d.x + d.z * d.z) / (1.0 + d.y) } else { 1.0 - d.y };
        (i, j, p.x - i as f64, (versine - a) / (b - a))
    }

    /// Density of unit direction `d`, per steradian.
    pub fn pdf(&self, d: DVec3) -> f64 {
        self.pdf_at(&self.position(d))
    }

    /// Density, per steradian, at a position in an image of the distribution's size
    /// ([`SphereImage::position`]).
    pub fn pdf_at(&self, p: &Position) -> f64 {
        let (i, j) = self.texel(p);
        self.density(i, j)
    }

    /// The inverse of [`SphereDistribution::sample`].
    pub fn invert(&self, d: DVec3) -> DVec2 {
        let (i, j, fx, fy) = self.locate(d);
        DVec2::new(self.rows.invert(j, fy), self.columns[j].invert(i, fx))
    }
}
