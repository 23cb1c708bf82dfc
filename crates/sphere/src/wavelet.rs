//! Orthonormal Haar wavelets on square maps (nonstandard decomposition), such as the faces of a cube.
//!
//! One step takes each 2 × 2 block to its scaled mean and three differences; the means fill the upper left
//! quarter, where the next step goes on (Stollnitz, DeRose & Salesin 1995, "Wavelets for computer graphics: a
//! primer", part 1, nonstandard construction). With the factor ½ per step the basis is orthonormal: sums of
//! squares and inner products stay (Parseval), which is what lets products of light and transport be summed
//! over wavelet coefficients (Ng, Ramamoorthi & Hanrahan 2003).

/// Why a map has no Haar transform.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a Haar transform takes 2^k x 2^k values; {len} values are not {side} x {side} with a power of two")]
pub struct NotSquare {
    /// Values given.
    pub len: usize,
    /// Side given.
    pub side: usize,
}

/// Transforms `side` × `side` values in rows in place; `side` is a power of two. The coefficient 0 is the sum
/// over `side`; at level s (1, 2, 4 … side/2) the square [s, 2s) × [0, s) holds horizontal, [0, s) × [s, 2s)
/// vertical and [s, 2s) × [s, 2s) diagonal differences of blocks of `side/s` texels.
pub fn haar_forward(data: &mut [f32], side: usize) -> Result<(), NotSquare> {
    check(data, side)?;
    let mut block = vec![0.0; side * side];
    let mut n = side;
    while n > 1 {
        let half = n / 2;
        for j in 0..half {
            for i in 0..half {
                let at = 2 * j * side + 2 * i;
                let (a, b, c, d) = (data[at], data[at + 1], data[at + side], data[at + side + 1]);
                block[j * n + i] = 0.5 * (a + b + c + d);
                block[j * n + half + i] = 0.5 * (a - b + c - d);
                block[(half + j) * n + i] = 0.5 * (a + b - c - d);
                block[(half + j) * n + half + i] = 0.5 * (a - b - c + d);
            }
        }
        for j in 0..n {
            data[j * side..j * side + n].copy_from_slice(&block[j * n..(j + 1) * n]);
        }
        n = half;
    }
    Ok(())
}

/// The inverse of [`haar_forward`].
pub fn haar_inverse(data: &mut [f32], side: usize) -> Result<(), NotSquare> {
    check(data, side)?;
    let mut block = vec![0.0; side * side];
    let mut n = 2;
    while n <= side {
        let half = n / 2;
        for j in 0..half {
            for i in 0..half {
                let (m, h) = (data[j * side + i], data[j * side + half + i]);
                let (v, d) = (data[(half + j) * side + i], data[(half + j) * side + half + i]);
                let at = 2 * j * n + 2 * i;
                block[at] = 0.5 * (m + h + v + d);
                block[at + 1] = 0.5 * (m - h + v - d);
                block[at + n] = 0.5 * (m + h - v - d);
                block[at + n + 1] = 0.5 * (m - h - v + d);
            }
        }
        for j in 0..n {
            data[j * side..j * side + n].copy_from_slice(&block[j * n..(j + 1) * n]);
        }
        n *= 2;
    }
    Ok(())
}

fn check(data: &[f32], side: usize) -> Result<(), NotSquare> {
    let square = side.is_power_of_two() && side.checked_mul(side) == Some(data.len());
    if square { Ok(()) } else { Err(NotSquare { len: data.len(), side }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(n: usize, mut state: u32) -> Vec<f32> {
        let mut next = || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        (0..n).map(|_| next()).collect()
    }

    fn dot(a: &[f32], b: &[f32]) -> f64 {
        a.iter().zip(b).map(|(&a, &b)| f64::from(a) * f64::from(b)).sum()
    }

    #[test]
    fn inner_products_stay_and_the_inverse_inverts() {
        for side in [1, 2, 8, 64] {
            let (a, b) = (noise(side * side, 1), noise(side * side, 2));
            let (mut x, mut y) = (a.clone(), b.clone());
            haar_forward(&mut x, side).expect("square");
            haar_forward(&mut y, side).expect("square");
            assert!((dot(&a, &b) / dot(&x, &y) - 1.0).abs() < 1e-5);
            assert!((dot(&a, &a) / dot(&x, &x) - 1.0).abs() < 1e-5);
            haar_inverse(&mut x, side).expect("square");
            assert!(a.iter().zip(&x).all(|(a, x)| (a - x).abs() < 1e-5));
        }
    }

    #[test]
    fn constants_have_one_coefficient() {
        let mut x = vec![3.0f32; 256];
        haar_forward(&mut x, 16).expect("square");
        assert!((x[0] - 48.0).abs() < 1e-4 && x[1..].iter().all(|v| v.abs() < 1e-5));
    }

    #[test]
    fn other_shapes_are_refused() {
        assert!(haar_forward(&mut [0.0; 9], 3).is_err());
        assert!(haar_inverse(&mut [0.0; 8], 2).is_err());
        assert!(haar_forward(&mut [], 0).is_err());
        assert!(haar_forward(&mut [], usize::MAX).is_err());
    }
}
