//! A table and light in whole numbers of 16 bits, whose products with two neighbours each are summed by one
//! instruction without any conversion.

use super::look::Look;
use super::vectors::SIDE;
use crate::shared::tables::aligned::Aligned;
use steradian_simd::{Arch, Short, Single, Vector};

/// The largest integer. (−2^15 is excluded: the sum of two of its squares overflows 32 bits.)
const LARGEST: f32 = 32767.0;

/// Numbers of a channel of a texel: whole registers of 32.
pub(super) const fn stride(count: usize) -> usize {
    count.next_multiple_of(32)
}

/// The largest integer in a table. Interpolation between four texels may exceed it by eight, as weights and
/// products are rounded, and must stay below 2^15.
const LARGEST_TEXEL: f32 = LARGEST - 8.0;

/// `all` rounded to integers of magnitude up to `most`, and the factor that scales them back: the largest
/// magnitude over `most`.
fn whole<'a>(all: impl Iterator<Item = &'a f32> + Clone, most: f32) -> (impl Iterator<Item = i16>, f32) {
    let largest = all.clone().fold(0.0f32, |m, x| m.max(x.abs()));
    let scale = if largest > 0.0 { largest / most } else { 1.0 };
    (all.map(move |x| (x / scale).round().clamp(-most, most) as i16), scale)
}

/// Light rounded to integers, and the factor that scales them back.
pub(super) fn shortened(light: &[f32]) -> (Vec<i16>, f32) {
    let (numbers, scale) = whole(light.iter(), LARGEST);
    (numbers.collect(), scale)
}

/// The first table of a reflectance.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shorts {
    pub(super) data: Aligned<i16>,
    pub(super) scale: f32,
}

impl Shorts {
    /// Rounds channels of `count` numbers, each padded with zeros to `from` numbers.
    pub(super) fn new(data: &[f32], from: usize, count: usize) -> Self {
        let (mut numbers, scale) = whole(data.iter(), LARGEST_TEXEL);
        let mut out = Aligned::zeros(data.len() / from * stride(count));
        for to in out.chunks_exact_mut(stride(count)) {
            for (k, x) in numbers.by_ref().take(from).enumerate() {
                if k < count {
                    to[k] = x;
                }
            }
        }
        Self { data: out, scale }
    }
}

/// The weights of texels over 2^15, in whole numbers; 1 is 32767. (Of weights without the power of a cosine.)
#[inline(always)]
pub(super) fn shares<A: Arch>(look: &Look) -> [[i16; SIDE]; 4] {
    let mut out = [[0; SIDE]; 4];
    for k in 0..4 {
        let mut whole = [0; SIDE];
        let mut lane = 0;
        while lane < SIDE {
            let w = A::F32::load(&look.weights[k][lane..]);
            w.fma(A::F32::splat(LARGEST), A::F32::splat(0.5)).store_whole(&mut whole[lane..]);
            lane += A::F32::LANES;
        }
        for i in 0..SIDE {
            out[k][i] = whole[i] as i16;
        }
    }
    out
}

/// Factor that sums need where texels are weighted with [`shares`].
pub(super) const SHARE: f32 = 32768.0 / LARGEST;

/// The sums of point `i` over coefficients, still in lanes: C of a channel of light, in rows of P numbers in
/// the table, of so many channels there. `light` holds that of the point's site.
#[inline(always)]
pub(super) fn sums<A: Arch, const C: usize, const P: usize, const CHANNELS: usize>(
    texels: &[i16],
    [texel, size]: [usize; 2],
    shares: &[[i16; SIDE]; 4],
    i: usize,
    light: &[i16],
) -> [A::F32; 3] {
    type S<A> = <<A as Arch>::F32 as Single>::Short;
    let both = 2 * CHANNELS * P;
    let (near, far) = (texel * CHANNELS * P, (texel + size) * CHANNELS * P);
    let (near, far) = (&texels[near..near + both], &texels[far..far + both]);
    // P numbers are read from the beginning of each channel; storage goes on that far behind the last channel
    // of the last site.
    let light = &light[..2 * C + P];
    let w: [S<A>; 4] = [
        Short::splat(shares[0][i]),
        Short::splat(shares[1][i]),
        Short::splat(shares[2][i]),
        Short::splat(shares[3][i]),
    ];
    let mut sum = [A::F32::splat(0.0); 3];
    for c in 0..CHANNELS {
        let mut j = c * P;
        while j < (c + 1) * P {
            let right = j + CHANNELS * P;
            let top =
                S::<A>::load(&near[j..]).fraction(w[0]).add(S::<A>::load(&near[right..]).fraction(w[1]));
            let low = S::<A>::load(&far[j..]).fraction(w[2]).add(S::<A>::load(&far[right..]).fraction(w[3]));
            let (f, at) = (top.add(low), j - c * P);
            // Numbers of the view beyond its coefficients are zero.
            if CHANNELS == 1 {
                sum[0] = sum[0].add(f.pairs(S::<A>::load(&light[at..])));
                sum[1] = sum[1].add(f.pairs(S::<A>::load(&light[C + at..])));
                sum[2] = sum[2].add(f.pairs(S::<A>::load(&light[2 * C + at..])));
            } else {
                sum[c] = sum[c].add(f.pairs(S::<A>::load(&light[c * C + at..])));
            }
            j += 2 * A::F32::LANES;
        }
    }
    sum
}
