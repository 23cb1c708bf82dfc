//! Appearance of an error: damaged texels, clipped ones, seams, noise, coarse steps.

use crate::measure::weighted;
use crate::report::{Encoding, Fault};
use crate::samples::{floor, weight};
use steradian_formats::{linear_to_srgb, srgb_to_linear};
use steradian_sphere::{Layout, SphereImage};

/// Largest values of formats: halves, RGB9E5, R11G11B10, RGBD, 8 bits.
const LIMITS: [f32; 6] = [65504.0, 65408.0, 65024.0, 64512.0, 255.0, 1.0];

/// A format's largest value, where many texels have it, and the number of these texels.
pub fn limited(image: &SphereImage) -> Option<(f32, usize)> {
    let finite = || image.planes.iter().flatten().filter(|v| v.is_finite());
    let most = finite().fold(0.0f32, |m, v| v.max(m));
    let limit = LIMITS.into_iter().find(|l| (most / l - 1.0).abs() < 1e-6)?;
    let at = |k: usize| image.planes.iter().any(|p| (p[k] / limit - 1.0).abs() < 1e-6);
    let texels = (0..image.planes[0].len()).filter(|k| at(*k)).count();
    // A few texels may hold a small limit by chance, and so may light of a constant 1: neither counts.
    let few = if limit > 255.0 { 0 } else { 3 };
    let even = finite().all(|v| *v > 0.98 * limit);
    (texels > few && !even).then_some((limit, texels))
}

/// Flags of the texels that are finite and not black next to light, with the fault of the remaining ones.
pub fn sound(level: usize, image: &SphereImage, reference: &SphereImage) -> (Vec<bool>, Option<Fault>) {
    let sum = |i: &SphereImage, k: usize| i.planes.iter().map(|p| f64::from(p[k])).sum::<f64>();
    let n = image.planes[0].len();
    let dim =
        0.1 * ((0..n).map(|k| sum(reference, k).max(0.0).sqrt()).sum::<f64>() / n.max(1) as f64).powi(2);
    let (mut invalid, mut black) = (0, 0);
    let fine = |k: usize| {
        let bad = !sum(image, k).is_finite();
        let dark = image.planes.iter().all(|p| p[k] == 0.0) && sum(reference, k) > dim;
        invalid += usize::from(bad);
        black += usize::from(dark);
        !bad && !dark
    };
    let sound: Vec<bool> = (0..n).map(fine).collect();
    if 2 * black > n {
        // A map that is black is not a map with holes.
        return (vec![true; n], None);
    }
    let fault = (invalid + black > 0).then_some(Fault::Damaged { level, invalid, black });
    (sound, fault)
}

/// Is texel `k` at the border of its face?
fn border(image: &SphereImage, k: usize) -> bool {
    let (w, h) = (image.width, image.height);
    let (i, j) = (k % w, k / w % h);
    image.layout == Layout::Cube && (i == 0 || j == 0 || i + 1 == w || j + 1 == h)
}

/// Errors inside the faces and at their borders, over the levels of 8 texels and more.
pub fn seams(
    got: &[SphereImage],
    want: &[SphereImage],
    sound: &[Vec<bool>],
    limits: &[f64],
) -> Option<(f64, f64)> {
    let (mut inside, mut outside): (f64, f64) = (0.0, 0.0);
    for (m, (g, r)) in got.iter().zip(want).enumerate() {
        if g.layout != Layout::Cube || g.width < 8 {
            continue;
        }
        let part = |at: bool| -> Vec<bool> {
            sound[m].iter().enumerate().map(|(k, s)| *s && border(g, k) == at).collect()
        };
        inside = inside.max(weighted(g, r, &part(false), limits[m]));
        outside = outside.max(weighted(g, r, &part(true), limits[m]));
    }
    (outside > 0.0).then_some((inside, outside))
}

/// Do errors change from texel to texel and follow nothing of the light? Correlation of neighbours' relative
/// errors, and of the errors with the reference's own detail.
pub fn is_noise(got: &SphereImage, want: &SphereImage, sound: &[bool]) -> bool {
    let (w, n) = (got.width, got.planes[0].len());
    if n < 96 {
        return false;
    }
    let value = |i: &SphereImage, k: usize| i.planes.each_ref().map(|p| f64::from(p[k]));
    let least = floor(&(0..n).map(|k| value(want, k)).collect::<Vec<_>>());
    let sum = |v: [f64; 3]| v.iter().sum::<f64>();
    let error = |k: usize| {
        if !sound[k] {
            return 0.0;
        }
        let (g, r) = (value(got, k), value(want, k));
        // A few large errors shall not decide.
        ((sum(g) - sum(r)) * weight(&r, least, f64::INFINITY).sqrt()).clamp(-0.5, 0.5)
    };
    let e: Vec<f64> = (0..n).map(error).collect();
    let mean = e.iter().sum::<f64>() / n as f64;
    let variance = e.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n as f64;
    let inner = |k: &usize| k % w + 2 < w && !k.is_multiple_of(w);
    let mut near = (0.0, 0.0);
    let mut detail = (0.0, 0.0, 0.0);
    for k in (0..n).filter(inner) {
        near.0 += (e[k] - mean) * (e[k + 1] - mean);
        near.1 += 1.0;
        let r = |k: usize| sum(value(want, k));
        let d = ((2.0 * r(k) - r(k - 1) - r(k + 1)) * weight(&value(want, k), least, f64::INFINITY).sqrt())
            .clamp(-1.0, 1.0);
        detail.0 += e[k] * d;
        detail.1 += e[k] * e[k];
        detail.2 += d * d;
    }
    let near = near.0 / (near.1 * variance).max(f64::MIN_POSITIVE);
    let detail = detail.0 / (detail.1 * detail.2).sqrt().max(f64::MIN_POSITIVE);
    near.abs() < 0.12 && detail.abs() < 0.15 && mean * mean < 0.1 * variance
}

/// sRGB's curve from linear values.
pub fn encode(v: f64) -> f64 {
    linear_to_srgb(v as f32).into()
}

/// The inverse of the encoding.
pub fn decode(v: f64) -> f64 {
    srgb_to_linear(v as f32).into()
}

/// Are all values whole numbers of 1/255, linear or encoded?
pub fn steps(image: &SphereImage) -> Option<Encoding> {
    let values = || image.planes.iter().flatten().map(|v| f64::from(*v));
    if !values().all(|v| (0.0..=1.0001).contains(&v)) {
        return None;
    }
    let whole = |f: &dyn Fn(f64) -> f64| {
        values().all(|v| {
            let x = 255.0 * f(v);
            (x - x.round()).abs() < 1e-3
        })
    };
    if whole(&|v| v) {
        Some(Encoding::Linear)
    } else if whole(&encode) {
        Some(Encoding::Encoded)
    } else {
        None
    }
}

/// Bits of mantissa that red, green and blue use, where these are as few as those of packed floats (6, 6 and
/// 5 in B10G11R11); `None` of others, and of images too plain to tell.
fn mantissas(image: &SphereImage) -> Option<[i32; 3]> {
    const MAX_BITS: u32 = 6;
    let used = |v: &f32| f32::MANTISSA_DIGITS - 1 - (v.to_bits() | 1 << 23).trailing_zeros();
    let most = image.planes.each_ref().map(|p| p.iter().map(used).max().unwrap_or(0));
    let [low, high] = [most.iter().min(), most.iter().max()].map(|n| n.copied().unwrap_or(0));
    (high <= MAX_BITS && low >= MAX_BITS - 1).then(|| most.map(|n| n as i32))
}

/// The weighted relative error that rounding to steps makes. `step` of floats that are divided by their
/// largest channel.
pub fn rounding(image: &SphereImage, step: f64, steps: Option<Encoding>) -> f64 {
    let floats = if step == 0.0 && steps.is_none() { mantissas(image) } else { None };
    if step == 0.0 && steps.is_none() && floats.is_none() {
        return 0.0;
    }
    let n = image.planes[0].len();
    let value = |k: usize| image.planes.each_ref().map(|p| f64::from(p[k]));
    let least = floor(&(0..n).map(value).collect::<Vec<_>>());
    let (mut left, mut all) = (0.0, 0.0);
    for v in (0..n).map(value) {
        let w = weight(&v, least, f64::INFINITY);
        let largest = v.iter().fold(1.0, |m: f64, v| m.max(*v));
        for (c, v) in v.into_iter().enumerate() {
            let unit = match (steps, floats) {
                (Some(Encoding::Encoded), _) => {
                    decode(encode(v) + 0.5 / 255.0) - decode(encode(v) - 0.5 / 255.0)
                }
                (Some(_), _) => 1.0 / 255.0,
                (None, Some(bits)) => v.max(f64::MIN_POSITIVE).log2().floor().exp2() * 2f64.powi(-bits[c]),
                (None, None) => step * largest,
            };
            left += w * unit * unit / 12.0;
            all += w * v * v;
        }
    }
    if all > 0.0 { (left / all).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_sphere::Layout;

    /// Packed floats of 6, 6 and 5 bits of mantissa show themselves, with the error that rounding to them
    /// made.
    #[test]
    fn packed_floats_tell_what_they_lost() {
        let exact = SphereImage::from_fn(Layout::Cube, 32, 32, |d| {
            let v = 1.3 + d.y + 0.4 * (7.0 * d.x).sin();
            [v, 2.0 * v, 0.1 * v].map(|v| v as f32)
        });
        assert_eq!(rounding(&exact, 0.0, None), 0.0);
        let mut packed = exact.clone();
        for (plane, bits) in packed.planes.iter_mut().zip([6u32, 6, 5]) {
            let half = 1 << (22 - bits);
            plane.iter_mut().for_each(|v| *v = f32::from_bits((v.to_bits() + half) & !(2 * half - 1)));
        }
        let n = exact.planes[0].len();
        let value = |image: &SphereImage, k: usize| image.planes.each_ref().map(|p| f64::from(p[k]));
        let least = floor(&(0..n).map(|k| value(&packed, k)).collect::<Vec<_>>());
        let (mut off, mut all) = (0.0, 0.0);
        for k in 0..n {
            let (a, b) = (value(&packed, k), value(&exact, k));
            let w = weight(&a, least, f64::INFINITY);
            off += (0..3).map(|c| w * (a[c] - b[c]).powi(2)).sum::<f64>();
            all += (0..3).map(|c| w * a[c] * a[c]).sum::<f64>();
        }
        let (told, true_error) = (rounding(&packed, 0.0, None), (off / all).sqrt());
        assert!((told / true_error - 1.0).abs() < 0.1, "{told} {true_error}");
    }
}
