//! Registers of whole numbers of 16 bits.

use super::{EightSingle, FourSingle, Sixteen};
use crate::vector::Short;
use std::arch::x86_64::*;

macro_rules! short {
    ($doc:literal, $name:ident, $reg:ty, $lanes:literal, $single:ident, $splat:ident, $load:ident, $add:ident,
     $pairs:ident, $convert:ident, $fraction:expr) => {
        #[doc = $doc]
        #[derive(Clone, Copy)]
        #[repr(transparent)]
        pub struct $name($reg);

        impl Short for $name {
            type Single = $single;

            #[inline(always)]
            fn splat(x: i16) -> Self {
                // SAFETY: the instruction set is there, see above.
                Self(unsafe { $splat(x) })
            }
            #[inline(always)]
            fn load(x: &[i16]) -> Self {
                let x = &x[..$lanes];
                // SAFETY: the instruction set is there; as many numbers are read as the slice has.
                Self(unsafe { $load(x.as_ptr().cast()) })
            }
            #[inline(always)]
            fn add(self, b: Self) -> Self {
                // SAFETY: the instruction set is there.
                Self(unsafe { $add(self.0, b.0) })
            }
            #[inline(always)]
            fn fraction(self, b: Self) -> Self {
                // SAFETY: the instruction set is there.
                Self(unsafe { $fraction(self.0, b.0) })
            }
            #[inline(always)]
            fn pairs(self, b: Self) -> $single {
                // SAFETY: the instruction set is there.
                $single(unsafe { $convert($pairs(self.0, b.0)) })
            }
        }
    };
}

/// SSE2 has no such instruction: of the product's 32 bits those from the 15th on, and the 14th added to
/// round.
#[inline(always)]
unsafe fn fraction(a: __m128i, b: __m128i) -> __m128i {
    // SAFETY: SSE2 is part of x86-64.
    unsafe {
        let (high, low) = (_mm_mulhi_epi16(a, b), _mm_mullo_epi16(a, b));
        let whole = _mm_add_epi16(_mm_slli_epi16::<1>(high), _mm_srli_epi16::<15>(low));
        _mm_add_epi16(whole, _mm_and_si128(_mm_srli_epi16::<14>(low), _mm_set1_epi16(1)))
    }
}

short!(
    "Eight i16.",
    EightShort,
    __m128i,
    8,
    FourSingle,
    _mm_set1_epi16,
    _mm_loadu_si128,
    _mm_add_epi16,
    _mm_madd_epi16,
    _mm_cvtepi32_ps,
    fraction
);
short!(
    "Sixteen i16.",
    SixteenShort,
    __m256i,
    16,
    EightSingle,
    _mm256_set1_epi16,
    _mm256_loadu_si256,
    _mm256_add_epi16,
    _mm256_madd_epi16,
    _mm256_cvtepi32_ps,
    _mm256_mulhrs_epi16
);
short!(
    "Thirty-two i16.",
    ThirtyTwoShort,
    __m512i,
    32,
    Sixteen,
    _mm512_set1_epi16,
    _mm512_loadu_si512,
    _mm512_add_epi16,
    _mm512_madd_epi16,
    _mm512_cvtepi32_ps,
    _mm512_mulhrs_epi16
);
