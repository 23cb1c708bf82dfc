//! Dual paraboloid (Heidrich & Seidel 1998): (s, t) = (x, y)/(1 + |z|); front +Z is face 0, back −Z face 1.

use glam::DVec3;

/// 1 − cos θ at the rim.
pub const RIM: f64 = 1.0;

/// (2s, 2t, ±(1 − ρ²))/(1 + ρ²), ρ² = s² + t²; ρ > 1 continues into the other hemisphere.
pub fn direction(face: usize, s: f64, t: f64) -> Option<DVec3> {
    let sign = match face {
        0 => 1.0,
        1 => -1.0,
        _ => return None,
    };
    let r2 = s * s + t * t;
    Some(DVec3::new(2.0 * s, 2.0 * t, sign * (1.0 - r2)) / (1.0 + r2))
}

/// (s, t) on a face, whichever hemisphere `d` is in.
pub fn project(face: usize, d: DVec3) -> (f64, f64) {
    let k = 1.0 / (1.0 + if face == 0 { d.z } else { -d.z });
    (d.x * k, d.y * k)
}

/// Face, s and t (upwards).
pub fn position(d: DVec3) -> (usize, f64, f64) {
    let face = usize::from(d.z < 0.0);
    let (s, t) = project(face, d);
    (face, s, t)
}

/// 1 − cos θ = 2r²/(1 + r²): ∫ 2c/(1 + c² + y²) dy = 2c/q · [atan(y/q)], q² = 1 + c².
pub fn edge(c: f64, a: f64, b: f64) -> f64 {
    let q = (1.0 + c * c).sqrt();
    // atan(b/q) − atan(a/q) without cancellation.
    2.0 * c / q * (q * (b - a)).atan2(q * q + a * b)
}
