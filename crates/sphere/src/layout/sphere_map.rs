//! Mirror ball seen by a distant camera that looks along −Z: r = sin(θ/2), θ the angle from +Z. The map is
//! area-preserving: dω = 4 ds dt.

use glam::DVec3;

/// 1 − cos θ at the rim.
pub const RIM: f64 = 2.0;

/// The camera's ray reflected at the normal (s, t, √(1 − r²)): (2 n_z s, 2 n_z t, 2 n_z² − 1). Beyond the rim
/// the point at 2 − r on the opposite side.
pub fn direction(s: f64, t: f64) -> DVec3 {
    let r = s.hypot(t);
    let k = if r > 1.0 { -((2.0 - r).max(0.0)) / r } else { 1.0 };
    let (s, t) = (s * k, t * k);
    let nz2 = (1.0 - s * s - t * t).max(0.0);
    let nz = nz2.sqrt();
    DVec3::new(2.0 * nz * s, 2.0 * nz * t, 2.0 * nz2 - 1.0)
}

/// (s, t), t upwards; −Z, which every point of the rim shows, is put at its right.
pub fn position(d: DVec3) -> (f64, f64) {
    // r = sin(θ/2), and cos(θ/2) = √((1 + z)/2); the sine of θ comes from x and y, which are exact near −Z.
    let rho = d.x.hypot(d.y);
    if rho == 0.0 {
        return (if d.z < 0.0 { 1.0 } else { 0.0 }, 0.0);
    }
    let r = (0.5 * rho.atan2(d.z)).sin();
    (d.x / rho * r, d.y / rho * r)
}

/// 1 − cos θ = 2r²: ∫ 2c dy.
pub fn edge(c: f64, a: f64, b: f64) -> f64 {
    2.0 * c * (b - a)
}
