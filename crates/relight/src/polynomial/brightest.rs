//! Values of polynomials, and the directions under which they are largest: normals.

use super::{TERMS, terms};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4};
use std::sync::LazyLock;

/// The value under a light of unit direction `l`.
pub fn evaluate<const N: usize>(a: &[f64; N], l: DVec3) -> f64 {
    a.iter().zip(terms::<N>(l)).map(|(a, t)| a * t).sum()
}

/// The direction of the light above the surface under which a texel is brightest, by any basis; `None` for a
/// constant. Of the biquadratic it is [`normal`]; of harmonics, which may have several maxima, the best of
/// three searches in halved steps from the brightest of 97 directions that lie apart.
pub fn brightest<const N: usize>(a: &[f64; N]) -> Option<DVec3> {
    if let Ok(six) = <&[f64; TERMS]>::try_from(a.as_slice()) {
        return normal(six);
    }
    let size = a[1..].iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if size == 0.0 || !size.is_finite() {
        return None;
    }
    // Seen in the disk of the sine of half the angle, where the rim is the horizon.
    let direction = |p: DVec2| {
        let z = 1.0 - 2.0 * p.length_squared();
        (2.0 * (1.0 - p.length_squared()).max(0.0).sqrt() * p).extend(z)
    };
    let value = |p: DVec2| evaluate(a, direction(p));
    let start = |k: usize| {
        let r = FRAC_1_SQRT_2 * (k as f64 / 96.0).sqrt();
        r * DVec2::from_angle(2.399_963_229_728_653 * k as f64)
    };
    let mut starts: Vec<(f64, DVec2)> = (0..97).map(start).map(|p| (value(p), p)).collect();
    starts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut tried: Vec<DVec2> = Vec::new();
    let mut found = (f64::MIN, DVec2::ZERO);
    for (mut best, mut at) in starts {
        if tried.len() == 3 || tried.iter().any(|p| p.distance(at) < 0.2) {
            continue;
        }
        tried.push(at);
        let mut step = 0.08;
        while step > 1e-5 {
            let turn = |k: i32| DVec2::from_angle(FRAC_PI_4 * f64::from(k));
            let around = (0..8).map(|k| (at + step * turn(k)).clamp_length_max(FRAC_1_SQRT_2));
            let next = around.map(|p| (value(p), p)).max_by(|a, b| a.0.total_cmp(&b.0));
            match next {
                Some((v, p)) if v > best => (best, at) = (v, p),
                _ => step *= 0.5,
            }
        }
        if best > found.0 {
            found = (best, at);
        }
    }
    let at = found.1;
    Some(direction(at))
}

/// The direction of the light under which a texel is brightest, which Malzbender, Gelb & Wolters take for its
/// normal, or `None` for a constant. Where the polynomial has no maximum within the unit disk, the brightest
/// point of its rim: found among 64 and refined by Newton's steps.
pub fn normal(a: &[f64; TERMS]) -> Option<DVec3> {
    let [uu, vv, uv, u, v, _] = *a;
    let size = a[..5].iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if size == 0.0 || !size.is_finite() {
        return None;
    }
    let determinant = 4.0 * uu * vv - uv * uv;
    if uu + vv < 0.0 && determinant > 1e-12 * size * size {
        let top = DVec2::new(uv * v - 2.0 * vv * u, uv * u - 2.0 * uu * v) / determinant;
        if top.length_squared() <= 1.0 {
            return Some(top.extend((1.0 - top.length_squared()).max(0.0).sqrt()));
        }
    }
    // On the rim: L(φ) = (uu + vv)/2 + (uu − vv)/2 cos 2φ + uv/2 sin 2φ + u cos φ + v sin φ.
    let (even, odd) = (0.5 * (uu - vv), 0.5 * uv);
    let mut best = (f64::NEG_INFINITY, 0);
    for (k, [c, s, c2, s2]) in RIM.iter().enumerate() {
        let value = even * c2 + odd * s2 + u * c + v * s;
        if value >= best.0 {
            best = (value, k);
        }
    }
    let mut phi = RIM_STEP * best.1 as f64;
    for _ in 0..8 {
        let (s, c) = phi.sin_cos();
        let (s2, c2) = (2.0 * s * c, c * c - s * s);
        let slope = 2.0 * (odd * c2 - even * s2) + v * c - u * s;
        let bend = -4.0 * (even * c2 + odd * s2) - u * c - v * s;
        if bend >= 0.0 {
            break;
        }
        let change = (slope / bend).clamp(-RIM_STEP, RIM_STEP);
        phi -= change;
        // Newton's error is squared by each step: the next would be below rounding.
        if change.abs() < 1e-9 {
            break;
        }
    }
    Some(DVec3::new(phi.cos(), phi.sin(), 0.0))
}

/// Directions of the rim that are tried, and how far they are apart.
const RIM_TRIED: usize = 64;
const RIM_STEP: f64 = std::f64::consts::TAU / RIM_TRIED as f64;

/// Cosine and sine of φ and of 2φ of each.
static RIM: LazyLock<[[f64; 4]; RIM_TRIED]> = LazyLock::new(|| {
    std::array::from_fn(|k| {
        let phi = RIM_STEP * k as f64;
        let ((s, c), (s2, c2)) = (phi.sin_cos(), (2.0 * phi).sin_cos());
        [c, s, c2, s2]
    })
});
