//! Directions at which tables are compared with exact evaluation.

use glam::DVec3;

/// Direction `k` of `n` on a Fibonacci spiral: nearly uniform, deterministic.
pub fn direction(k: usize, n: usize) -> DVec3 {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let y = 1.0 - (2.0 * k as f64 + 1.0) / n as f64;
    let r = (1.0 - y * y).max(0.0).sqrt();
    let (s, c) = (golden * k as f64).sin_cos();
    DVec3::new(r * c, y, r * s)
}

/// Relative RMS difference over pairs (got, exact), all channels together.
pub fn relative_rms(pairs: impl Iterator<Item = ([f64; 3], [f64; 3])>) -> f64 {
    let (mut error, mut energy) = (0.0, 0.0);
    for (got, exact) in pairs {
        for c in 0..3 {
            error += (got[c] - exact[c]).powi(2);
            energy += exact[c].powi(2);
        }
    }
    if energy > 0.0 { (error / energy).sqrt() } else { error.sqrt() }
}
