//! Wigner's small d matrices.

use super::basis::{BIG, LIMIT, SMALL, Scaled};

/// d^l_{m'm}(β) = ⟨l m'| exp(−iβ J_y) |l m⟩ (Wigner 1931; signs of Sakurai and Edmonds' successors:
/// d^1_{10} = −sin β/√2, d^l_{m'm} = (−1)^{m−m'} d^l_{mm'} = d^l_{−m,−m'}). Row m' + l, column m + l of a
/// (2l+1)² row-major matrix.
///
/// For each column the quarter |m| ≤ m' follows by descent in m' from the closed form at m' = l (the
/// three-term recursion of J_z and J_±; Varshalovich et al. 1988, 4.8.1), which never leaves the oscillating
/// region downwards and so is stable; an extended exponent prevents underflow. O(l²).
pub fn wigner_d(l: usize, beta: f64) -> Vec<f64> {
    let side = 2 * l + 1;
    let mut d = vec![0.0; side * side];
    let (sin, cos) = beta.sin_cos();
    let signed = l as isize;
    for n in -signed..=signed {
        quarter_column(l, n, beta, sin, cos, |m, v| {
            // v = d_{n m}; its mirror images fill the other quarters.
            let sign = if (m - n) % 2 == 0 { 1.0 } else { -1.0 };
            let mut put = |row: isize, column: isize, v: f64| {
                d[(row + signed) as usize * side + (column + signed) as usize] = v;
            };
            put(n, m, v);
            put(m, n, sign * v);
            put(-m, -n, v);
            put(-n, -m, sign * v);
        });
    }
    d
}

/// Hands d_{n m} for m = l down to |n| to `put`.
fn quarter_column(l: usize, n: isize, beta: f64, sin: f64, cos: f64, mut put: impl FnMut(isize, f64)) {
    let mut now = seed(l, n, beta);
    let mut above = 0.0;
    let mut m = l as isize;
    put(m, now.value());
    if sin == 0.0 {
        // β a multiple of π: only m = ±n survives.
        while m > n.abs() {
            m -= 1;
            let diagonal = if cos > 0.0 { m == n } else { m == -n };
            put(m, if diagonal { polar(l, n, cos) } else { 0.0 });
        }
        return;
    }
    let root = |m: isize| (((l as isize + m) * (l as isize - m + 1)) as f64).sqrt();
    while m > n.abs() {
        let b = 2.0 * (m as f64 * cos - n as f64) / sin;
        let next = (b * now.v - root(m + 1) * above) / root(m);
        above = now.v;
        now.v = next;
        if now.scale < 0 && now.v.abs() > LIMIT {
            now = Scaled { v: now.v * SMALL, scale: now.scale + 1 };
            above *= SMALL;
        }
        m -= 1;
        put(m, now.value());
    }
}

/// d_{n,±n} at β = 0 (1) and π ((−1)^{l−n}).
fn polar(l: usize, n: isize, cos: f64) -> f64 {
    if cos > 0.0 || (l as isize - n) % 2 == 0 { 1.0 } else { -1.0 }
}

/// d_{n l} = √C(2l, l+n) cos^{l+n}(β/2) sin^{l−n}(β/2).
fn seed(l: usize, n: isize, beta: f64) -> Scaled {
    let (s, c) = (0.5 * beta).sin_cos();
    let mut value = Scaled { v: 1.0, scale: 0 };
    let mut times = |factor: f64| {
        value.v *= factor;
        if value.v.abs() < SMALL * LIMIT && value.v != 0.0 {
            value = Scaled { v: value.v * BIG, scale: value.scale - 1 };
        }
    };
    // √C(2l, k) c^{2l−k} s^k with k = l − n: as k factors √((2l−j)/(j+1))·s·c, the rest cosines (or, counted
    // from the other side, sines), so that no partial product overflows.
    let up = (l as isize + n) as usize;
    let down = (l as isize - n) as usize;
    let (few, many) = (up.min(down), up.max(down));
    let rest = if up >= down { c } else { s };
    for j in 0..few {
        times(((2 * l - j) as f64 / (j + 1) as f64).sqrt() * s * c);
    }
    for _ in 0..many - few {
        times(rest);
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn band_one_and_two_are_the_tables() {
        for b in [0.0_f64, 0.4, 1.9, -0.7, std::f64::consts::PI] {
            let (s, c) = b.sin_cos();
            let h = std::f64::consts::FRAC_1_SQRT_2;
            let (p, q) = ((1.0 + c) / 2.0, (1.0 - c) / 2.0);
            // Rows m' = −1, 0, 1; columns m = −1, 0, 1.
            let one = [p, s * h, q, -s * h, c, s * h, q, -s * h, p];
            for (a, e) in wigner_d(1, b).iter().zip(one) {
                assert!((a - e).abs() < 1e-15, "{b}: {a} {e}");
            }
            let d = wigner_d(2, b);
            let at = |m: isize, n: isize| d[((m + 2) * 5 + n + 2) as usize];
            for (a, e) in [
                (at(2, 2), p * p),
                (at(2, 1), -s * p),
                (at(2, 0), 0.375_f64.sqrt() * s * s),
                (at(2, -2), q * q),
                (at(1, 1), 0.5 * (2.0 * c * c + c - 1.0)),
                (at(1, 0), -1.5_f64.sqrt() * s * c),
                (at(1, -1), 0.5 * (-2.0 * c * c + c + 1.0)),
                (at(0, 0), 1.5 * c * c - 0.5),
            ] {
                assert!((a - e).abs() < 1e-15, "{b}: {a} {e}");
            }
        }
    }

    #[test]
    fn the_matrix_is_orthogonal_at_any_angle() {
        for (l, beta) in [(40, 0.01), (40, 1.3), (200, 3.0), (301, 1e-6), (300, 0.4)] {
            let d = wigner_d(l, beta);
            let n = 2 * l + 1;
            for (i, j) in
                [(0, 0), (0, 1), (l, l), (l, l + 2), (n - 1, n - 1), (3 * l / 2, 3 * l / 2), (l / 3, l)]
            {
                let dot: f64 = (0..n).map(|k| d[i * n + k] * d[j * n + k]).sum();
                let delta = if i == j { 1.0 } else { 0.0 };
                assert!((dot - delta).abs() < 1e-11, "{l} {beta} {i} {j} {dot}");
            }
        }
    }

    /// d^l_{00} = P_l(cos β), and the angles add.
    #[test]
    fn legendre_in_the_middle_and_angles_add() {
        let l = 1500;
        let beta = 0.9_f64;
        let d = wigner_d(l, beta);
        let p = crate::sh::legendre(0, l, beta.cos(), beta.sin())[l]
            / ((2 * l + 1) as f64 / 4.0 / std::f64::consts::PI).sqrt();
        assert!((d[l * (2 * l + 1) + l] - p).abs() < 1e-11);
        let (a, b, ab) = (wigner_d(30, 0.5), wigner_d(30, 1.1), wigner_d(30, 1.6));
        for (i, j) in [(0, 3), (30, 31), (44, 12), (60, 60)] {
            let sum: f64 = (0..61).map(|k| a[i * 61 + k] * b[k * 61 + j]).sum();
            assert!((sum - ab[i * 61 + j]).abs() < 1e-13);
        }
    }
}
