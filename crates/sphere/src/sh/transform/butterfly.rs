//! Discrete Fourier transforms of two to eight complex numbers, in every lane of a register at once.

use super::kernel::Real;
use steradian_simd::Vector;

/// Real parts and imaginary parts.
pub(in crate::sh) type Pair<V> = [V; 2];

#[inline(always)]
fn add<V: Vector>(a: Pair<V>, b: Pair<V>) -> Pair<V> {
    [a[0].add(b[0]), a[1].add(b[1])]
}

#[inline(always)]
fn sub<V: Vector>(a: Pair<V>, b: Pair<V>) -> Pair<V> {
    [a[0].sub(b[0]), a[1].sub(b[1])]
}

/// a + i b.
#[inline(always)]
fn add_i<V: Vector>(a: Pair<V>, b: Pair<V>) -> Pair<V> {
    [a[0].sub(b[1]), a[1].add(b[0])]
}

/// a − i b.
#[inline(always)]
fn sub_i<V: Vector>(a: Pair<V>, b: Pair<V>) -> Pair<V> {
    [a[0].add(b[1]), a[1].sub(b[0])]
}

/// a · w.
#[inline(always)]
pub(super) fn times<V: Vector>(a: Pair<V>, w: [V::T; 2]) -> Pair<V> {
    let (re, im) = (V::splat(w[0]), V::splat(w[1]));
    [a[1].fnma(im, a[0].mul(re)), a[1].fma(re, a[0].mul(im))]
}

/// y_k = Σ_j x_j e^{−2πi jk/R}; `roots` holds cos and sin of 2πj/R.
#[inline(always)]
#[expect(clippy::manual_memcpy, reason = "these are registers: a call that copies memory would spill them")]
pub(super) fn butterfly<V: Vector<T: Real>, const R: usize>(x: &mut [Pair<V>; R], roots: &[[V::T; 2]; 8]) {
    match R {
        2 => (x[0], x[1]) = (add(x[0], x[1]), sub(x[0], x[1])),
        4 => {
            let y = four([x[0], x[1], x[2], x[3]]);
            for k in 0..4 {
                x[k] = y[k];
            }
        }
        8 => {
            let y = eight([x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7]], V::splat(roots[1][0]));
            for k in 0..8 {
                x[k] = y[k];
            }
        }
        _ => odd(x, roots),
    }
}

#[inline(always)]
fn four<V: Vector>(x: [Pair<V>; 4]) -> [Pair<V>; 4] {
    let (s, d) = (add(x[0], x[2]), sub(x[0], x[2]));
    let (t, e) = (add(x[1], x[3]), sub(x[1], x[3]));
    [add(s, t), sub_i(d, e), sub(s, t), add_i(d, e)]
}

/// `h` is √½.
#[inline(always)]
fn eight<V: Vector>(x: [Pair<V>; 8], h: V) -> [Pair<V>; 8] {
    let a = four([x[0], x[2], x[4], x[6]]);
    let b = four([x[1], x[3], x[5], x[7]]);
    // e^{−iπ/4} b = h (sum, difference), e^{−3iπ/4} b = h (difference, −sum).
    let (s1, d1) = (b[1][0].add(b[1][1]), b[1][1].sub(b[1][0]));
    let (s3, d3) = (b[3][0].add(b[3][1]), b[3][1].sub(b[3][0]));
    [
        add(a[0], b[0]),
        [h.fma(s1, a[1][0]), h.fma(d1, a[1][1])],
        sub_i(a[2], b[2]),
        [h.fma(d3, a[3][0]), h.fnma(s3, a[3][1])],
        sub(a[0], b[0]),
        [h.fnma(s1, a[1][0]), h.fnma(d1, a[1][1])],
        add_i(a[2], b[2]),
        [h.fnma(d3, a[3][0]), h.fma(s3, a[3][1])],
    ]
}

/// For odd R: sums and differences of x_j and x_{R−j} give y_k and y_{R−k} together.
#[inline(always)]
fn odd<V: Vector<T: Real>, const R: usize>(x: &mut [Pair<V>; R], roots: &[[V::T; 2]; 8]) {
    let (first, mut sums, mut differences) = (x[0], *x, *x);
    for j in 1..=R / 2 {
        sums[j] = add(x[j], x[R - j]);
        differences[j] = sub(x[j], x[R - j]);
        x[0] = add(x[0], sums[j]);
    }
    for k in 1..=R / 2 {
        let mut a = first;
        let mut b = [V::splat(V::T::default()); 2];
        for j in 1..=R / 2 {
            let [cos, sin] = roots[j * k % R];
            let (cos, sin) = (V::splat(cos), V::splat(sin));
            for c in 0..2 {
                a[c] = sums[j][c].fma(cos, a[c]);
                b[c] = differences[j][c].fma(sin, b[c]);
            }
        }
        x[k] = sub_i(a, b);
        x[R - k] = add_i(a, b);
    }
}
