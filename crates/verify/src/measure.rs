//! Levels against the light filtered exactly.

use crate::kernel::Kernel;
use crate::samples::{floor, weight};
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_light::Lights;
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

impl Error {
    /// Error of `got` against `reference`, whose channels are taken in the order `p` and times `gain`.
    pub fn between(got: &SphereImage, reference: &SphereImage, p: [usize; 3], gain: [f64; 3]) -> Self {
        let (mut e2, mut r2, mut e1, mut r1, mut worst) = (0.0, 0.0, 0.0, 0.0, 0.0f64);
        let w = got.width;
        let each = |visit: &mut dyn FnMut(f64, f64, f64)| {
            for row in 0..got.layout.faces() * got.height {
                let omega = got.row_solid_angles(row / got.height, row % got.height);
                for (c, i) in (0..3).flat_map(|c| (0..w).map(move |i| (c, i))) {
                    let g = f64::from(got.planes[c][row * w + i]);
                    let r = f64::from(reference.planes[p[c]][row * w + i]) * gain[c];
                    if g.is_finite() {
                        visit(omega[i], g - r, r);
                    }
                }
            }
        };
        each(&mut |o, e, r| {
            e2 += o * e * e;
            r2 += o * r * r;
            e1 += o * e;
            r1 += o * r;
        });
        let least = 1e-3 * (r2 / (12.0 * PI)).sqrt();
        each(&mut |_, e, r| worst = worst.max(e.abs() / r.abs().max(least).max(f64::MIN_POSITIVE)));
        let ratio = |a: f64, b: f64| if b == 0.0 { 0.0 } else { a / b };
        Self { rms: ratio(e2, r2).sqrt(), bias: ratio(e1, r1), worst }
    }
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

/// Relative errors of all sound texels below `limit`, weighted as samples are, darkness less.
pub fn weighted(got: &SphereImage, reference: &SphereImage, sound: &[bool], limit: f64) -> f64 {
    let value = |image: &SphereImage, k: usize| image.planes.each_ref().map(|p| f64::from(p[k]));
    let values: Vec<[f64; 3]> = (0..sound.len()).filter(|k| sound[*k]).map(|k| value(got, k)).collect();
    let least = floor(&values);
    let (mut left, mut all) = (0.0, 0.0);
    for k in (0..sound.len()).filter(|k| sound[*k]) {
        let (g, r) = (value(got, k), value(reference, k));
        let w = weight(&g, least, limit);
        for c in 0..3 {
            left += w * (g[c] - r[c]).powi(2);
            all += w * g[c] * g[c];
        }
    }
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
