//! Rows against rows: on a lat-long image the kernel between two rows depends on the difference of azimuth
//! only.
//!
//! The angular sum of Ramamoorthi & Hanrahan 2002, 5.32, with the structure that a lat-long map gives it.
//! Over a row, Σ_i L_i K(θ, θ_j, φ − φ_i) is a periodic convolution, hence a product of Fourier coefficients
//! (Driscoll & Healy 1994 separate the sphere so):
//!
//! ```text
//! B(θ, φ) = Σ_m e^{imφ} Σ_j Ω_j κ_m(θ, θ_j) L̂_m(θ_j),   κ_m = 1/n Σ_q K(θ, θ_j, 2πq/n) cos(2πmq/n)
//! ```
//!
//! A kernel of band F has azimuthal frequencies up to F, and near the poles up to F sin θ and a little more,
//! so that n ≈ 2 F sin θ samples of it do. The cost is that of S² row pairs times F, not S⁴ W: the angular
//! way at its best. L̂_m is the exact discrete spectrum of the row at any m, so the sum over all texels is
//! met to the tolerance.

use super::table::Table;
use super::{Card, Cost, Made, Shape, band_limit, reach};
use crate::light::sampled::small_lights_at;
use crate::{Sampled, Zonal};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_sphere::fft::{Complex, Fft};
use steradian_sphere::{Layout, SphereImage};

pub(super) const CARD: Card = Card {
    name: "lat-long-angular",
    source: "Ramamoorthi & Hanrahan 2002, 5.32, by rows; Driscoll & Healy 1994",
    equation: "B(θ, φ) = Σ_m e^{imφ} Σ_j Ω_j κ_m(θ, θ_j) L̂_m(θ_j)",
    exact_when: "ε → 0",
};

/// Row against row; the kernel is cut where the part `epsilon` of it is left in angle or in frequency.
///
/// Other layouts are looked up, bicubic, in a lat-long map of at least four rows per band.
pub fn lat_long_angular(
    light: &Sampled,
    kernel: &dyn Zonal,
    (layout, width, height): Shape,
    epsilon: f64,
    task: &Task,
) -> Result<Made, Cancelled> {
    let plan = Plan::new(light, kernel, epsilon);
    let (w, h) = plan.size((layout, width, height));
    task.begin("filtering row by row", h.div_ceil(2) as u64);
    let (map, mut cost) = plan.map(light, kernel, (w, h), task)?;
    task.end();
    let mut image = if layout == Layout::LatLong {
        map
    } else {
        cost.taps += 16 * (layout.faces() * width * height) as u64;
        SphereImage::from_fn(layout, width, height, |d| map.bicubic(d))
    };
    if !light.suns().is_empty() {
        let suns = SphereImage::from_fn(layout, width, height, |d| {
            small_lights_at(light.suns(), kernel, d).map(|v| v as f32)
        });
        for (plane, suns) in image.planes.iter_mut().zip(&suns.planes) {
            plane.iter_mut().zip(suns).for_each(|(v, s)| *v += s);
        }
    }
    Ok(Made { image, cost })
}

struct Plan {
    band: usize,
    k0: f64,
    reach: f64,
}

/// (re, im) of frequencies 0 … band of red, green, blue and where needed 1: six or eight runs of band + 1.
type Spectrum = Vec<f64>;

/// Bytes that [`lat_long_angular`] works in: eight numbers a band for every row of the light and of the map,
/// and the map.
pub fn lat_long_bytes(light: &Sampled, kernel: &dyn Zonal, shape: Shape, epsilon: f64) -> u64 {
    let plan = Plan::new(light, kernel, epsilon);
    let (w, h) = plan.size(shape);
    (8 * 8 * (plan.band + 1) * (light.image.height + h) + 12 * w * h) as u64
}

impl Plan {
    fn new(light: &Sampled, kernel: &dyn Zonal, epsilon: f64) -> Self {
        // At that frequency Gaussians of the width are at 1e-30, GGX at 1e-5; a kernel sharper than a
        // sixteenth of a row is truncated.
        let k =
            kernel.coefficients((12.0 / kernel.width()).min(16.0 * light.image.height as f64) as usize + 256);
        Self { band: band_limit(&k, epsilon).max(4), k0: k[0], reach: reach(kernel, epsilon) }
    }

    /// Columns and rows of the map that is filtered.
    fn size(&self, (layout, width, height): Shape) -> (usize, usize) {
        if layout == Layout::LatLong {
            return (width, height);
        }
        let texels = (layout.faces() * width * height) as f64;
        let rows = (4 * self.band).max(16).max((0.5 * texels).sqrt() as usize);
        (2 * rows, rows)
    }

    fn map(
        &self,
        light: &Sampled,
        kernel: &dyn Zonal,
        (w, h): (usize, usize),
        task: &Task,
    ) -> Result<(SphereImage, Cost), Cancelled> {
        let spectra = self.analyze(&light.image, &Fft::new(light.image.width));
        task.check()?;
        let table = Table::new(kernel, self.reach);
        let rings = Rings::new(self.band);
        let outer = |j: usize| {
            task.check()?;
            task.advance(1);
            Ok(self.rows(light, &table, &rings, &spectra, (j, h)))
        };
        let pairs: Result<Vec<_>, Cancelled> = (0..h.div_ceil(2)).into_par_iter().map(outer).collect();
        let pairs = pairs?;
        let cost = pairs.iter().map(|p| p.1).fold(Cost::default(), |a, b| a + b);
        let mut image = SphereImage::new(Layout::LatLong, w, h);
        let fft = Fft::new(w);
        for (j, ([north, south], _)) in pairs.into_iter().enumerate() {
            self.synthesize(&north, &fft, j, &mut image);
            self.synthesize(&south, &fft, h - 1 - j, &mut image);
        }
        Ok((image, cost))
    }

    /// Σ_i L e^{−imφ} of each row times the solid angle of its texels; φ counts from the left edge.
    fn analyze(&self, image: &SphereImage, fft: &Fft) -> Vec<Spectrum> {
        let (width, height) = (image.width, image.height);
        let phases = phases(self.band, -PI / width as f64);
        let ones = vec![1.0; width];
        let row = |j: usize| {
            let omega = image.layout.solid_angle(width, height, 0, 0, j);
            let mut out = Vec::with_capacity(8 * (self.band + 1));
            let colours = image.planes.iter().map(|p| &p[j * width..(j + 1) * width]);
            let rows = colours.chain(self.uneven(width).then_some(&ones[..]));
            let mut rings: Vec<_> =
                rows.flatten().map(|&l| Complex::new(omega * f64::from(l), 0.0)).collect();
            fft.forward(&mut rings, &mut Vec::new());
            for ring in rings.chunks_exact(width) {
                let shifted = |m: usize| ring[m % width] * phases[m];
                out.extend((0..=self.band).map(|m| shifted(m).re));
                out.extend((0..=self.band).map(|m| shifted(m).im));
            }
            out
        };
        (0..height).into_par_iter().map(row).collect()
    }

    /// Rows j and h − 1 − j of the map, to which rows i and h − 1 − i of the light have the same kernels.
    fn rows(
        &self,
        light: &Sampled,
        table: &Table,
        rings: &Rings,
        spectra: &[Spectrum],
        (j, h): (usize, usize),
    ) -> ([Spectrum; 2], Cost) {
        let (width, height) = (light.image.width, spectra.len());
        let theta = PI * (j as f64 + 0.5) / h as f64;
        let step = PI / height as f64;
        let first = ((theta - self.reach) / step - 0.5).ceil().max(0.0) as usize;
        let last = (((theta + self.reach) / step - 0.5).floor().max(0.0) as usize).min(height - 1);
        let zero = vec![0.0; spectra[0].len()];
        let mut out = [zero.clone(), zero];
        let (mut weight, mut cost, mut work) = (0.0, Cost::default(), Work::default());
        for i in (first..=last).step_by(ROWS) {
            let others: Vec<f64> = (i..=last).take(ROWS).map(|i| (i as f64 + 0.5) * step).collect();
            cost.kernel += rings.kappa(table, self.band, theta, &others, &mut work);
            for (run, i) in work.kappa.iter().zip(i..=last) {
                weight += run[0] * width as f64 * light.image.layout.solid_angle(width, height, 0, 0, i);
                add(&spectra[i], run, self.band, &mut out[0]);
                add(&spectra[height - 1 - i], run, self.band, &mut out[1]);
                cost.taps += 4 * run.len() as u64;
            }
        }
        let scale = if weight > 0.0 { self.k0 / weight } else { 0.0 };
        out.iter_mut().flatten().for_each(|v| *v *= scale);
        (out, cost)
    }

    /// Does Σ K Ω vary along a row of `width` texels? Only kernels that resolve them see that.
    fn uneven(&self, width: usize) -> bool {
        self.band >= width
    }

    /// Σ_m of the spectrum at the columns of row `j`.
    fn synthesize(&self, spectrum: &Spectrum, fft: &Fft, j: usize, image: &mut SphereImage) {
        let (width, n) = (image.width, self.band + 1);
        let phases = phases(self.band, PI / width as f64);
        let mut rings = vec![Complex::default(); spectrum.len() / (2 * n) * width];
        for (runs, ring) in spectrum.chunks_exact(2 * n).zip(rings.chunks_exact_mut(width)) {
            for m in 0..n {
                let twice = if m == 0 { 1.0 } else { 2.0 };
                let value = Complex::new(twice * runs[m], twice * runs[n + m]);
                ring[m % width] += value * phases[m];
            }
        }
        fft.inverse(&mut rings, &mut Vec::new());
        let (colours, weights) = rings.split_at(3 * width);
        let weights = (!weights.is_empty()).then_some(weights);
        for (plane, ring) in image.planes.iter_mut().zip(colours.chunks_exact(width)) {
            let row = &mut plane[j * width..(j + 1) * width];
            for (i, (v, z)) in row.iter_mut().zip(ring).enumerate() {
                let weight = weights.map_or(1.0, |w| w[i].re / self.k0);
                *v = if weight > 0.0 { (z.re / weight) as f32 } else { 0.0 };
            }
        }
    }
}

/// e^{i m angle}.
fn phases(band: usize, angle: f64) -> Vec<Complex> {
    (0..=band).map(|m| Complex::cis(m as f64 * angle)).collect()
}

/// to += κ · spectrum, channel by channel.
fn add(spectrum: &[f64], kappa: &[f64], band: usize, to: &mut [f64]) {
    for (from, to) in spectrum.chunks_exact(band + 1).zip(to.chunks_exact_mut(band + 1)) {
        for ((t, f), k) in to.iter_mut().zip(from).zip(kappa) {
            *t += k * f;
        }
    }
}

/// FFTs of the sizes that kernels between rows need.
struct Rings {
    plans: BTreeMap<usize, Ring>,
}

struct Ring {
    fft: Fft,
    /// sin²(Δφ/2) of half the samples.
    half2: Vec<f64>,
}

/// Rows whose kernels are transformed together: two in every lane.
const ROWS: usize = 16;

/// κ_m of some rows, and scratch.
#[derive(Default)]
struct Work {
    kappa: [Vec<f64>; ROWS],
    rings: Vec<Complex>,
    scratch: Vec<f64>,
}

impl Rings {
    fn new(band: usize) -> Self {
        let (mut plans, mut n) = (BTreeMap::new(), 16);
        while plans.last_key_value().is_none_or(|(&n, _)| n < 2 * band + 4) {
            for n in [n, n + n / 2] {
                let half2 = (0..=n / 2).map(|q| (PI * q as f64 / n as f64).sin().powi(2)).collect();
                plans.insert(n, Ring { fft: Fft::new(n), half2 });
            }
            n *= 2;
        }
        Self { plans }
    }

    /// κ_m between row `theta` and others, and how often the kernel was evaluated.
    fn kappa(&self, table: &Table, band: usize, theta: f64, others: &[f64], work: &mut Work) -> u64 {
        // P_l^m(cos θ) is negligible for m beyond l sin θ and a little more.
        let sine = theta.sin().min(others.iter().fold(0.0, |m: f64, t| m.max(t.sin())));
        let highest = (band as f64 * sine + 2.5 * (band as f64).cbrt() + 4.0).min(band as f64) as usize;
        let Some((&n, plan)) = self.plans.range(2 * highest + 2..).next() else { return 0 };
        work.rings.clear();
        work.rings.resize(others.len().div_ceil(2) * n, Complex::default());
        let mut count = 0;
        for (k, other) in others.iter().enumerate() {
            // Two real kernels are one complex ring.
            let ring = &mut work.rings[k / 2 * n..][..n];
            // chord² = 4 sin²((θ − θ')/2) + 4 sin θ sin θ' sin²(Δφ/2)
            let (base, swing) =
                (4.0 * (0.5 * (theta - other)).sin().powi(2), 4.0 * theta.sin() * other.sin());
            for (q, half2) in plan.half2.iter().enumerate() {
                let chord2 = base + swing * half2;
                if chord2 >= table.reach2 {
                    break;
                }
                count += 1;
                let value = table.at(chord2) / n as f64;
                for q in [q, (n - q) % n] {
                    if k % 2 == 0 { ring[q].re = value } else { ring[q].im = value }
                }
            }
        }
        plan.fft.forward(&mut work.rings, &mut work.scratch);
        // All rings are even: their spectra are real.
        for (k, kappa) in work.kappa.iter_mut().enumerate().take(others.len()) {
            let ring = &work.rings[k / 2 * n..][..=highest];
            kappa.clear();
            kappa.extend(ring.iter().map(|z| if k % 2 == 0 { z.re } else { z.im }));
        }
        count
    }
}
