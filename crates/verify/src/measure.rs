//! Levels against the light filtered exactly.

use crate::kernel::Kernel;
use crate::samples::{floor_of, root, weight};
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_light::Lights;
use steradian_parallel::prelude::*;
use steradian_prefilter::{Sampled, Zonal, filter_image, mirror_image};
use steradian_sphere::SphereImage;

/// Relative RMS error of the filter that files are compared with: half of that allowed to a correct file.
const EXACT: f64 = 2e-3;

/// Difference between two images.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Error {
    /// RMS(error)/RMS(reference), over solid angle and channels.
    pub rms: f64,
    /// ∫ error / ∫ reference.
    pub bias: f64,
    /// Largest |error|/reference of a channel.
    pub worst: f64,
}

/// Sums over texels: error², reference², error, reference, times solid angle.
type Sums = [f64; 4];

/// Texels that are summed side by side.
const LANES: usize = 4;

impl Error {
    /// Error of `got` against `reference`, whose channels are taken in the order `p` and times `gain`.
    pub fn between(got: &SphereImage, reference: &SphereImage, p: [usize; 3], gain: [f64; 3]) -> Self {
        let [error] = Self::with_gains(got, reference, p, [gain]);
        error
    }

    /// [`Error::between`] for several gains, rows in parallel and added in their order. (Solid angles anew in
    /// each of four passes took 0.4 of the 1.5 processor seconds in which a cube of 512² texels a face was
    /// found right.)
    pub fn with_gains<const N: usize>(
        got: &SphereImage,
        reference: &SphereImage,
        p: [usize; 3],
        gains: [[f64; 3]; N],
    ) -> [Self; N] {
        let (w, h) = (got.width, got.height);
        // All faces are alike.
        let omegas: Vec<Vec<f64>> = (0..h).into_par_iter().map(|j| got.row_solid_angles(0, j)).collect();
        let texels =
            |c: usize, row: usize| (&got.planes[c][row * w..][..w], &reference.planes[p[c]][row * w..][..w]);
        let rows = 0..got.layout.faces() * h;
        let sums = |row: usize| {
            let mut sums: [Sums; N] = [[0.0; 4]; N];
            for c in 0..3 {
                let (got, reference) = texels(c, row);
                for (sums, gain) in sums.iter_mut().zip(&gains) {
                    add(&omegas[row % h], got, reference, gain[c], sums);
                }
            }
            sums
        };
        let of_rows: Vec<[Sums; N]> = rows.clone().into_par_iter().map(sums).collect();
        let all: [Sums; N] = std::array::from_fn(|k| {
            of_rows.iter().fold([0.0; 4], |all, row| std::array::from_fn(|i| all[i] + row[k][i]))
        });
        let least = all.map(|s| (1e-3 * (s[1] / (12.0 * PI)).sqrt()).max(f64::MIN_POSITIVE));
        let worst = |row: usize| {
            let mut worst = [0.0_f64; N];
            for c in 0..3 {
                let (got, reference) = texels(c, row);
                for k in 0..N {
                    for (g, r) in got.iter().zip(reference).filter(|(g, _)| g.is_finite()) {
                        let r = f64::from(*r) * gains[k][c];
                        let (e, of) = ((f64::from(*g) - r).abs(), r.abs().max(least[k]));
                        // Few are worse than all before.
                        if e > worst[k] * of {
                            worst[k] = e / of;
                        }
                    }
                }
            }
            worst
        };
        let of_rows: Vec<[f64; N]> = rows.into_par_iter().map(worst).collect();
        let ratio = |a: f64, b: f64| if b == 0.0 { 0.0 } else { a / b };
        std::array::from_fn(|k| Self {
            rms: ratio(all[k][0], all[k][1]).sqrt(),
            bias: ratio(all[k][2], all[k][3]),
            worst: of_rows.iter().fold(0.0, |worst, row| worst.max(row[k])),
        })
    }
}

/// Adds a row of a channel; texels that are not finite count nothing.
fn add(omega: &[f64], got: &[f32], reference: &[f32], gain: f64, to: &mut Sums) {
    let mut sums = [[0.0; LANES]; 4];
    let mut each = |omega: &[f64; LANES], got: &[f32; LANES], reference: &[f32; LANES]| {
        for k in 0..LANES {
            let finite = got[k].is_finite();
            let o = if finite { omega[k] } else { 0.0 };
            let r = f64::from(reference[k]) * gain;
            let e = if finite { f64::from(got[k]) - r } else { 0.0 };
            sums[0][k] += o * e * e;
            sums[1][k] += o * r * r;
            sums[2][k] += o * e;
            sums[3][k] += o * r;
        }
    };
    let ((omega, o), (got, g), (reference, r)) =
        (omega.as_chunks::<LANES>(), got.as_chunks::<LANES>(), reference.as_chunks::<LANES>());
    for ((omega, got), reference) in omega.iter().zip(got).zip(reference) {
        each(omega, got, reference);
    }
    let mut last = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    last.0[..o.len()].copy_from_slice(o);
    last.1[..g.len()].copy_from_slice(g);
    last.2[..r.len()].copy_from_slice(r);
    each(&last.0, &last.1, &last.2);
    to.iter_mut().zip(sums).for_each(|(to, s)| *to += s.iter().sum::<f64>());
}

/// Light filtered with kernels.
pub fn filtered(
    lights: &Lights,
    kernels: &[Kernel],
    like: &[SphereImage],
    task: &Task,
) -> Result<Vec<SphereImage>, Cancelled> {
    let zonal: Vec<Option<Box<dyn Zonal>>> = kernels.iter().map(|k| k.zonal()).collect();
    let known: Vec<&dyn Zonal> = zonal.iter().flatten().map(AsRef::as_ref).collect();
    let light = Sampled::new(lights, &known, EXACT, task)?;
    let mut out = Vec::new();
    for (kernel, level) in zonal.iter().zip(like) {
        let shape = (level.layout, level.width, level.height);
        let image = match kernel {
            Some(k) => filter_image(&light, k.as_ref(), shape, EXACT, task)?.image,
            None => mirror_image(&light, shape).image,
        };
        out.push(positive(image, level));
        task.advance(1);
    }
    Ok(out)
}

/// The reference without the negative values that sharp interpolation leaves next to suns, where `image` has
/// none either.
fn positive(mut reference: SphereImage, image: &SphereImage) -> SphereImage {
    if image.planes.iter().flatten().all(|v| *v >= 0.0) {
        reference.planes.iter_mut().flatten().for_each(|v| *v = v.max(0.0));
    }
    reference
}

/// Texels that are summed together.
const BLOCK: usize = 1 << 14;

/// Relative errors of all sound texels below `limit`, weighted as samples are, darkness less.
pub fn weighted(got: &SphereImage, reference: &SphereImage, sound: &[bool], limit: f64) -> f64 {
    let blocks = || (0..sound.len().div_ceil(BLOCK)).into_par_iter();
    let texels = |b: usize| b * BLOCK..sound.len().min((b + 1) * BLOCK);
    let value = |planes: &[&[f32]; 3], k: usize| planes.map(|p| f64::from(p[k]));
    let roots = |b: usize| {
        let (sound, got) = (&sound[texels(b)], got.planes.each_ref().map(|p| &p[texels(b)]));
        let sound = (0..sound.len()).filter(|k| sound[*k]);
        sound.fold((0.0, 0), |(sum, n), k| (sum + root(&value(&got, k)), n + 1))
    };
    let roots: Vec<(f64, usize)> = blocks().map(roots).collect();
    let (sum, n) = roots.iter().fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    let least = floor_of(sum / n.max(1) as f64);
    let sums = |b: usize| {
        let (mut left, mut all) = (0.0, 0.0);
        let sound = &sound[texels(b)];
        let [got, reference] = [got, reference].map(|i| i.planes.each_ref().map(|p| &p[texels(b)]));
        for k in (0..sound.len()).filter(|k| sound[*k]) {
            let (g, r) = (value(&got, k), value(&reference, k));
            let w = weight(&g, least, limit);
            for c in 0..3 {
                left += w * (g[c] - r[c]).powi(2);
                all += w * g[c] * g[c];
            }
        }
        (left, all)
    };
    let sums: Vec<(f64, f64)> = blocks().map(sums).collect();
    let (left, all) = sums.iter().fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
    if all > 0.0 { (left / all).sqrt() } else { f64::from(u8::from(left > 0.0)) }
}

/// Nine irradiance coefficients against the light's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients {
    /// The factor that fits best.
    pub scale: f64,
    /// Relative RMS error as they are.
    pub rms: f64,
    /// Relative RMS error after multiplication by the factor.
    pub fitted_rms: f64,
}

impl Coefficients {
    /// Compares nine coefficients with those that are expected.
    pub fn compare(got: &[[f64; 3]], want: &[[f64; 3]]) -> Self {
        let pairs = || got.iter().flatten().zip(want.iter().flatten());
        let (gw, ww) = pairs().fold((0.0, 0.0), |(a, b), (g, w)| (a + g * w, b + w * w));
        let scale = if ww > 0.0 { gw / ww } else { 1.0 };
        let error = |s: f64| {
            let sum: f64 = pairs().map(|(g, w)| (g - s * w).powi(2)).sum();
            if ww > 0.0 { (sum / ww).sqrt() } else { 0.0 }
        };
        Self { scale, rms: error(1.0), fitted_rms: error(scale) / scale.abs().max(f64::MIN_POSITIVE) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_sphere::Layout;

    /// Sums by rows, several gains together, are those over all texels one by one; texels that are not finite
    /// count nothing.
    #[test]
    fn sums_by_rows_are_those_over_all_texels() {
        for (layout, w, h) in [(Layout::Cube, 7, 7), (Layout::LatLong, 10, 5), (Layout::Octahedral, 6, 6)] {
            let reference = SphereImage::from_fn(layout, w, h, |d| {
                [2.0 + d.x as f32, (2.0 * d.y).exp() as f32, 0.1 + (5.0 * d.z).sin().max(0.0) as f32]
            });
            let mut got = reference.clone();
            for (k, v) in got.planes.iter_mut().flatten().enumerate() {
                *v = 1.1 * *v + 0.05 * (k as f32 * 1.7).sin();
            }
            got.planes[1][8] = f32::NAN;
            let (p, gains) = ([1, 0, 2], [[1.0; 3], [1.1, 0.9, 1.2]]);
            for (error, gain) in Error::with_gains(&got, &reference, p, gains).iter().zip(gains) {
                assert_eq!(*error, Error::between(&got, &reference, p, gain));
                let all = |f: &dyn Fn(f64, f64, f64) -> f64| {
                    let mut all = Vec::new();
                    for k in 0..got.planes[0].len() {
                        let omega = layout.solid_angle(w, h, k / (w * h), k % w, k / w % h);
                        for c in 0..3 {
                            let r = f64::from(reference.planes[p[c]][k]) * gain[c];
                            let g = f64::from(got.planes[c][k]);
                            all.extend(g.is_finite().then(|| f(omega, g - r, r)));
                        }
                    }
                    all
                };
                let sum = |f: &dyn Fn(f64, f64, f64) -> f64| all(f).iter().sum::<f64>();
                let r2 = sum(&|o, _, r| o * r * r);
                assert!((error.rms - (sum(&|o, e, _| o * e * e) / r2).sqrt()).abs() < 1e-12);
                assert!((error.bias - sum(&|o, e, _| o * e) / sum(&|o, _, r| o * r)).abs() < 1e-12);
                let least = 1e-3 * (r2 / (12.0 * PI)).sqrt();
                let worst = all(&|_, e, r| e.abs() / r.abs().max(least)).into_iter().fold(0.0, f64::max);
                assert!((error.worst - worst).abs() < 1e-12 * worst);
            }
        }
    }
}
