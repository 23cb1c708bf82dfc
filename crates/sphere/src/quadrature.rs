//! Quadrature rules on intervals and on the sphere.

/// Nodes in (−1, 1), ascending, and weights of the n-point Gauss–Legendre rule.
///
/// Newton's method on P_n from Tricomi's first approximation (Abramowitz & Stegun 1964, 25.4.29).
pub fn gauss_legendre(n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut x = vec![0.0; n];
    let mut w = vec![0.0; n];
    for i in 0..n.div_ceil(2) {
        let mut z = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut derivative = 1.0;
        for _ in 0..100 {
            let (mut p0, mut p1) = (1.0, z);
            for k in 2..=n {
                let k = k as f64;
                (p0, p1) = (p1, ((2.0 * k - 1.0) * z * p1 - (k - 1.0) * p0) / k);
            }
            derivative = n as f64 * (z * p1 - p0) / (z * z - 1.0);
            let step = p1 / derivative;
            z -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        if n == 1 {
            (z, derivative) = (0.0, 1.0);
        }
        x[i] = -z;
        x[n - 1 - i] = z;
        let weight = 2.0 / ((1.0 - z * z) * derivative * derivative);
        w[i] = weight;
        w[n - 1 - i] = weight;
    }
    (x, w)
}
