//! The coefficients of transport towards a view that are kept.
//!
//! A sun may stand in the tail of a lobe as well as in its peak, so that what is left out should be small
//! beside what is there: the limit is on Σ c²/t̄, with t̄ the mean of t over the texels that the wavelet of
//! coefficient c covers, relative to Σ t, which is the same sum over all of a vector. Wavelets that t hardly
//! varies over fall away wherever they are.

use super::transport::Row;

/// The row of a site: `texels` are t, `all` their wavelets, and `precision` the square root of the part of
/// Σ t that may be left out.
pub fn row(texels: &[f32], all: &[f32], side: usize, precision: f64) -> Row {
    let sum: f64 = texels.iter().map(|t| f64::from(*t)).sum();
    largest(all, &keys(texels, all, side), side, precision * precision * sum)
}

/// |c|/√t̄ of each coefficient; 0 where there is nothing.
fn keys(texels: &[f32], all: &[f32], side: usize) -> Vec<f32> {
    let mut keys = vec![0.0; all.len()];
    let faces = texels.chunks_exact(side * side).zip(all.chunks_exact(side * side));
    for ((texels, all), keys) in faces.zip(keys.chunks_exact_mut(side * side)) {
        let (mut sums, mut size) = (texels.to_vec(), side);
        while size > 1 {
            let half = size / 2;
            let area = ((side / half) * (side / half)) as f32;
            let mut next = Vec::with_capacity(half * half);
            for (j, i) in (0..half).flat_map(|j| (0..half).map(move |i| (j, i))) {
                let at = 2 * j * size + 2 * i;
                let sum = sums[at] + sums[at + 1] + sums[at + size] + sums[at + size + 1];
                next.push(sum);
                let scale = if sum > 0.0 { (area / sum).sqrt() } else { 0.0 };
                for (x, y) in [(half + i, j), (i, half + j), (half + i, half + j)] {
                    keys[y * side + x] = all[y * side + x].abs() * scale;
                }
            }
            (sums, size) = (next, half);
        }
    }
    keys
}

/// The coefficients of the largest `keys`, in the order of their indices, such that the squares of the other
/// ones' add up to `left` at most. One pass sums squares by magnitude, eight steps an octave, and only the
/// step at which the limit lies is sorted.
pub fn largest(all: &[f32], keys: &[f32], side: usize, left: f64) -> Row {
    // Of a mantissa of 23: the three that are left are eight steps an octave.
    const DROPPED_BITS: u32 = 20;
    let face = side * side;
    let step = |x: f32| (x.to_bits() >> DROPPED_BITS) as usize;
    // Sides are powers of two; keys are not negative.
    let others = || (0u32..).zip(keys).filter(|(k, x)| *k as usize & (face - 1) != 0 && **x > 0.0);
    let mut squares = vec![0.0f64; 1 << (31 - DROPPED_BITS)];
    others().for_each(|(_, x)| squares[step(*x)] += f64::from(*x).powi(2));
    let (mut out, mut last) = (0.0, squares.len());
    for (k, s) in squares.iter().enumerate() {
        if out + s > left {
            last = k;
            break;
        }
        out += s;
    }
    let mut there: Vec<f32> = others().map(|(_, x)| *x).filter(|x| step(*x) == last).collect();
    there.sort_unstable_by(f32::total_cmp);
    let least = there.iter().find(|x| {
        out += f64::from(**x).powi(2);
        out > left
    });
    let least = least.copied().unwrap_or(f32::INFINITY);
    Row {
        scaling: std::array::from_fn(|f| all[f * face]),
        kept: others().filter(|(_, x)| **x >= least).map(|(k, _)| (k, all[k as usize])).collect(),
    }
}
