//! The registers of AVX2 and AVX-512; those of SSE2, which every x86-64 has, are in `sse.rs`.

use crate::vector::{Double, Single, Vector};
use std::arch::x86_64::*;

/// One register of an x86 instruction set, with the intrinsics that its operations are.
macro_rules! register {
    ($doc:literal, $name:ident, $t:ty, $reg:ty, $lanes:literal, $registers:literal,
     $splat:ident, $load:ident, $store:ident, $add:ident, $sub:ident, $mul:ident, $fma:ident, $fnma:ident,
     $transpose:path, $lane_sums:path, $add_sums:path) => {
        #[doc = $doc]
        /// Only [`crate::run`] names it, after detection of the instruction set, which is what makes the
        /// calls of intrinsics sound.
        #[derive(Clone, Copy)]
        #[repr(transparent)]
        pub struct $name(pub(crate) $reg);

        impl Vector for $name {
            type T = $t;
            const LANES: usize = $lanes;
            const REGISTERS: usize = $registers;

            #[inline(always)]
            fn splat(x: $t) -> Self {
                // SAFETY: see the type.
                Self(unsafe { $splat(x) })
            }
            #[inline(always)]
            fn load(x: &[$t]) -> Self {
                let x = &x[..$lanes];
                // SAFETY: the numbers are there, checked above; features: see the type.
                Self(unsafe { $load(x.as_ptr()) })
            }
            #[inline(always)]
            fn store(self, x: &mut [$t]) {
                let x = &mut x[..$lanes];
                // SAFETY: the numbers are there, checked above; features: see the type.
                unsafe { $store(x.as_mut_ptr(), self.0) }
            }
            #[inline(always)]
            fn add(self, b: Self) -> Self {
                // SAFETY: see the type.
                Self(unsafe { $add(self.0, b.0) })
            }
            #[inline(always)]
            fn view(x: &mut [$t]) -> &mut [Self] {
                // SAFETY: the type is a register of these numbers, and all bits are numbers.
                unsafe { x.align_to_mut().1 }
            }
            #[inline(always)]
            fn sub(self, b: Self) -> Self {
                // SAFETY: see the type.
                Self(unsafe { $sub(self.0, b.0) })
            }
            #[inline(always)]
            fn mul(self, b: Self) -> Self {
                // SAFETY: see the type.
                Self(unsafe { $mul(self.0, b.0) })
            }
            #[inline(always)]
            fn fma(self, b: Self, c: Self) -> Self {
                // SAFETY: see the type.
                Self(unsafe { $fma(self.0, b.0, c.0) })
            }
            #[inline(always)]
            fn fnma(self, b: Self, c: Self) -> Self {
                // SAFETY: see the type.
                Self(unsafe { $fnma(self.0, b.0, c.0) })
            }
            #[inline(always)]
            fn transpose(v: &mut [Self]) {
                $transpose(v)
            }
            #[inline(always)]
            fn lane_sums(v: &mut [Self]) -> Self {
                $lane_sums(v)
            }
            #[inline(always)]
            fn add_sums(v: &[Self; 12], sums: &mut [f64; 16]) {
                $add_sums(v, sums)
            }
        }
    };
}

register!(
    "Four f64 of AVX2 with FMA.",
    Four,
    f64,
    __m256d,
    4,
    16,
    _mm256_set1_pd,
    _mm256_loadu_pd,
    _mm256_storeu_pd,
    _mm256_add_pd,
    _mm256_sub_pd,
    _mm256_mul_pd,
    _mm256_fmadd_pd,
    _mm256_fnmadd_pd,
    Four::across,
    Four::lane_sums,
    Four::add_sums
);
register!(
    "Eight f32 of AVX2 with FMA.",
    EightSingle,
    f32,
    __m256,
    8,
    16,
    _mm256_set1_ps,
    _mm256_loadu_ps,
    _mm256_storeu_ps,
    _mm256_add_ps,
    _mm256_sub_ps,
    _mm256_mul_ps,
    _mm256_fmadd_ps,
    _mm256_fnmadd_ps,
    EightSingle::across,
    EightSingle::lane_sums,
    EightSingle::add_sums
);
register!(
    "Eight f64 of AVX-512.",
    Eight,
    f64,
    __m512d,
    8,
    32,
    _mm512_set1_pd,
    _mm512_loadu_pd,
    _mm512_storeu_pd,
    _mm512_add_pd,
    _mm512_sub_pd,
    _mm512_mul_pd,
    _mm512_fmadd_pd,
    _mm512_fnmadd_pd,
    Eight::across,
    Eight::lane_sums,
    Eight::add_sums
);
register!(
    "Sixteen f32 of AVX-512.",
    Sixteen,
    f32,
    __m512,
    16,
    32,
    _mm512_set1_ps,
    _mm512_loadu_ps,
    _mm512_storeu_ps,
    _mm512_add_ps,
    _mm512_sub_ps,
    _mm512_mul_ps,
    _mm512_fmadd_ps,
    _mm512_fnmadd_ps,
    Sixteen::across,
    Sixteen::lane_sums,
    Sixteen::add_sums
);

/// Sums by way of [`Vector::transpose`].
macro_rules! transposed_sums {
    ($($name:ident),*) => {$(
        impl $name {
            #[inline(always)]
            fn lane_sums(v: &mut [Self]) -> Self {
                Self::across(v);
                let mut sum = v[0];
                for k in 1..Self::LANES {
                    sum = sum.add(v[k]);
                }
                sum
            }
        }
    )*};
}

transposed_sums!(Four, Eight);

mod short;
mod sse;
pub use sse::{FourSingle, Lanes as SseLanes, Pair, TwoDouble};

/// Sums over the lanes of twelve vectors, which `sums` finds in four at a time.
macro_rules! sums_in_fours {
    ($($name:ident),*) => {$(
        impl $name {
            #[inline(always)]
            fn add_sums(v: &[Self; 12], sums: &mut [f64; 16]) {
                let four: [Four; 3] = Self::sums(v);
                for k in 0..3 {
                    Four::load(&sums[4 * k..]).add(four[k]).store(&mut sums[4 * k..]);
                }
            }
        }
    )*};
}

sums_in_fours!(Four, EightSingle, Eight, Sixteen);

impl Four {
    #[inline(always)]
    fn across(v: &mut [Self]) {
        // SAFETY: see the type.
        unsafe {
            let (a, b) = (_mm256_unpacklo_pd(v[0].0, v[1].0), _mm256_unpackhi_pd(v[0].0, v[1].0));
            let (c, d) = (_mm256_unpacklo_pd(v[2].0, v[3].0), _mm256_unpackhi_pd(v[2].0, v[3].0));
            v[0] = Self(_mm256_permute2f128_pd::<0x20>(a, c));
            v[1] = Self(_mm256_permute2f128_pd::<0x20>(b, d));
            v[2] = Self(_mm256_permute2f128_pd::<0x31>(a, c));
            v[3] = Self(_mm256_permute2f128_pd::<0x31>(b, d));
        }
    }

    /// The sum over the lanes of each.
    #[inline(always)]
    fn sums(v: &[Self; 12]) -> [Self; 3] {
        [Self::sums_of_four(&v[..4]), Self::sums_of_four(&v[4..8]), Self::sums_of_four(&v[8..])]
    }

    #[inline(always)]
    fn sums_of_four(v: &[Self]) -> Self {
        let (a, b, c, d) = (v[0], v[1], v[2], v[3]);
        // SAFETY: see the type.
        unsafe {
            let (a, b) = (_mm256_hadd_pd(a.0, b.0), _mm256_hadd_pd(c.0, d.0));
            let low = _mm256_permute2f128_pd::<0x20>(a, b);
            Self(_mm256_add_pd(low, _mm256_permute2f128_pd::<0x31>(a, b)))
        }
    }
}

impl EightSingle {
    /// In each half the sums over its lanes of a, b, c and d.
    #[inline(always)]
    fn quarter(v: &[Self]) -> __m256 {
        // SAFETY: see the type.
        unsafe { _mm256_hadd_ps(_mm256_hadd_ps(v[0].0, v[1].0), _mm256_hadd_ps(v[2].0, v[3].0)) }
    }

    #[inline(always)]
    fn lane_sums(v: &mut [Self]) -> Self {
        let (a, b) = (Self::quarter(v), Self::quarter(&v[4..]));
        // SAFETY: see the type.
        Self(unsafe {
            _mm256_add_ps(_mm256_permute2f128_ps::<0x20>(a, b), _mm256_permute2f128_ps::<0x31>(a, b))
        })
    }

    #[inline(always)]
    fn across(v: &mut [Self]) {
        // SAFETY: see the type.
        unsafe {
            for k in [0, 4] {
                let (a, b, c, d) = (v[k].0, v[k + 1].0, v[k + 2].0, v[k + 3].0);
                let (ab, cd) = (_mm256_unpacklo_ps(a, b), _mm256_unpacklo_ps(c, d));
                v[k] = Self(_mm256_shuffle_ps::<0x44>(ab, cd));
                v[k + 1] = Self(_mm256_shuffle_ps::<0xee>(ab, cd));
                let (ab, cd) = (_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d));
                v[k + 2] = Self(_mm256_shuffle_ps::<0x44>(ab, cd));
                v[k + 3] = Self(_mm256_shuffle_ps::<0xee>(ab, cd));
            }
            for k in 0..4 {
                let (low, high) = (v[k].0, v[k + 4].0);
                v[k] = Self(_mm256_permute2f128_ps::<0x20>(low, high));
                v[k + 4] = Self(_mm256_permute2f128_ps::<0x31>(low, high));
            }
        }
    }

    /// The sums over halves of a, then of b. Horizontal additions are three instructions each; here and in
    /// [`Self::quarters`] there is one shuffle, since the other is a blend.
    #[inline(always)]
    fn halves(a: Self, b: Self) -> Self {
        // SAFETY: see the type.
        Self(unsafe {
            _mm256_add_ps(_mm256_blend_ps::<0xf0>(a.0, b.0), _mm256_permute2f128_ps::<0x21>(a.0, b.0))
        })
    }

    /// In each half the sums over its halves of a, then of b.
    #[inline(always)]
    fn quarters(a: Self, b: Self) -> __m256 {
        // SAFETY: see the type.
        unsafe { _mm256_add_ps(_mm256_blend_ps::<0xcc>(a.0, b.0), _mm256_shuffle_ps::<0x4e>(a.0, b.0)) }
    }

    /// The sum over the lanes of each.
    #[inline(always)]
    fn sums(v: &[Self; 12]) -> [Four; 3] {
        let a = Self::quarters(Self::halves(v[0], v[4]), Self::halves(v[1], v[5]));
        let b = Self::quarters(Self::halves(v[2], v[6]), Self::halves(v[3], v[7]));
        let c = Self::quarters(Self::halves(v[8], v[10]), Self::halves(v[9], v[11]));
        // SAFETY: see the type.
        unsafe {
            let ab = _mm256_add_ps(_mm256_shuffle_ps::<0x88>(a, b), _mm256_shuffle_ps::<0xdd>(a, b));
            let (low, high) = (_mm256_castps256_ps128(c), _mm256_extractf128_ps::<1>(c));
            let c = _mm_add_ps(_mm_shuffle_ps::<0x88>(low, high), _mm_shuffle_ps::<0xdd>(low, high));
            [
                Four(_mm256_cvtps_pd(_mm256_castps256_ps128(ab))),
                Four(_mm256_cvtps_pd(_mm256_extractf128_ps::<1>(ab))),
                Four(_mm256_cvtps_pd(c)),
            ]
        }
    }
}

impl Eight {
    #[inline(always)]
    fn across(v: &mut [Self]) {
        // SAFETY: see the type.
        unsafe {
            for k in [0, 2, 4, 6] {
                let (a, b) = (v[k].0, v[k + 1].0);
                v[k] = Self(_mm512_unpacklo_pd(a, b));
                v[k + 1] = Self(_mm512_unpackhi_pd(a, b));
            }
            // Quarters of registers, four by four.
            for k in [0, 1] {
                let (a, b, c, d) = (v[k].0, v[k + 2].0, v[k + 4].0, v[k + 6].0);
                let (ab, cd) = (_mm512_shuffle_f64x2::<0x88>(a, b), _mm512_shuffle_f64x2::<0x88>(c, d));
                v[k] = Self(_mm512_shuffle_f64x2::<0x88>(ab, cd));
                v[k + 4] = Self(_mm512_shuffle_f64x2::<0xdd>(ab, cd));
                let (ab, cd) = (_mm512_shuffle_f64x2::<0xdd>(a, b), _mm512_shuffle_f64x2::<0xdd>(c, d));
                v[k + 2] = Self(_mm512_shuffle_f64x2::<0x88>(ab, cd));
                v[k + 6] = Self(_mm512_shuffle_f64x2::<0xdd>(ab, cd));
            }
        }
    }

    /// Lane pairs summed: (a₀₁, b₀₁, a₂₃, b₂₃, a₄₅, b₄₅, a₆₇, b₆₇).
    #[inline(always)]
    fn pairs(a: Self, b: Self) -> Self {
        // SAFETY: see the type.
        Self(unsafe { _mm512_add_pd(_mm512_unpacklo_pd(a.0, b.0), _mm512_unpackhi_pd(a.0, b.0)) })
    }

    /// The sum over the lanes of each.
    #[inline(always)]
    fn sums(v: &[Self; 12]) -> [Four; 3] {
        [Self::sums_of_four(&v[..4]), Self::sums_of_four(&v[4..8]), Self::sums_of_four(&v[8..])]
    }

    #[inline(always)]
    fn sums_of_four(v: &[Self]) -> Four {
        let (a, b, c, d) = (v[0], v[1], v[2], v[3]);
        let (p, q) = (Self::pairs(a, b), Self::pairs(c, d));
        // SAFETY: see the type.
        unsafe {
            let low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
            let high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
            let x = _mm512_permutex2var_pd(p.0, low, q.0);
            let halves = _mm512_add_pd(x, _mm512_permutex2var_pd(p.0, high, q.0));
            let low = _mm512_castpd512_pd256(halves);
            Four(_mm256_add_pd(low, _mm512_extractf64x4_pd::<1>(halves)))
        }
    }
}

impl Sixteen {
    /// In each quarter the sums over its lanes of a, b, c and d.
    #[inline(always)]
    fn quarter(v: &[Self]) -> __m512 {
        // SAFETY: see the type.
        unsafe {
            let pair =
                |a: __m512, b: __m512| _mm512_add_ps(_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
            let (ab, cd) = (pair(v[0].0, v[1].0), pair(v[2].0, v[3].0));
            _mm512_add_ps(_mm512_shuffle_ps::<0x44>(ab, cd), _mm512_shuffle_ps::<0xee>(ab, cd))
        }
    }

    #[inline(always)]
    fn lane_sums(v: &mut [Self]) -> Self {
        let [a, b, c, d] =
            [Self::quarter(v), Self::quarter(&v[4..]), Self::quarter(&v[8..]), Self::quarter(&v[12..])];
        // SAFETY: see the type.
        unsafe {
            let halve = |a: __m512, b: __m512| {
                _mm512_add_ps(_mm512_shuffle_f32x4::<0x88>(a, b), _mm512_shuffle_f32x4::<0xdd>(a, b))
            };
            Self(halve(halve(a, b), halve(c, d)))
        }
    }

    #[inline(always)]
    fn across(v: &mut [Self]) {
        // SAFETY: see the type.
        unsafe {
            for k in [0, 4, 8, 12] {
                let (a, b, c, d) = (v[k].0, v[k + 1].0, v[k + 2].0, v[k + 3].0);
                let (ab, cd) = (_mm512_unpacklo_ps(a, b), _mm512_unpacklo_ps(c, d));
                v[k] = Self(_mm512_shuffle_ps::<0x44>(ab, cd));
                v[k + 1] = Self(_mm512_shuffle_ps::<0xee>(ab, cd));
                let (ab, cd) = (_mm512_unpackhi_ps(a, b), _mm512_unpackhi_ps(c, d));
                v[k + 2] = Self(_mm512_shuffle_ps::<0x44>(ab, cd));
                v[k + 3] = Self(_mm512_shuffle_ps::<0xee>(ab, cd));
            }
            // Quarters of registers, four by four.
            for k in 0..4 {
                let (a, b, c, d) = (v[k].0, v[k + 4].0, v[k + 8].0, v[k + 12].0);
                let (ab, cd) = (_mm512_shuffle_f32x4::<0x88>(a, b), _mm512_shuffle_f32x4::<0x88>(c, d));
                v[k] = Self(_mm512_shuffle_f32x4::<0x88>(ab, cd));
                v[k + 8] = Self(_mm512_shuffle_f32x4::<0xdd>(ab, cd));
                let (ab, cd) = (_mm512_shuffle_f32x4::<0xdd>(a, b), _mm512_shuffle_f32x4::<0xdd>(c, d));
                v[k + 4] = Self(_mm512_shuffle_f32x4::<0x88>(ab, cd));
                v[k + 12] = Self(_mm512_shuffle_f32x4::<0xdd>(ab, cd));
            }
        }
    }

    #[inline(always)]
    fn half(self) -> EightSingle {
        // SAFETY: see the type.
        EightSingle(unsafe {
            _mm256_add_ps(_mm512_castps512_ps256(self.0), _mm512_extractf32x8_ps::<1>(self.0))
        })
    }

    /// The sum over the lanes of each.
    #[inline(always)]
    fn sums(v: &[Self; 12]) -> [Four; 3] {
        let mut halves = [v[0].half(); 12];
        for k in 1..12 {
            halves[k] = v[k].half();
        }
        EightSingle::sums(&halves)
    }
}

impl Double for Four {
    #[inline(always)]
    fn replace_if_equal(self, a: Self, b: Self, yes: Self) -> Self {
        // SAFETY: see the type.
        Self(unsafe { _mm256_blendv_pd(self.0, yes.0, _mm256_cmp_pd::<_CMP_EQ_OQ>(a.0, b.0)) })
    }
}

impl Double for Eight {
    #[inline(always)]
    fn replace_if_equal(self, a: Self, b: Self, yes: Self) -> Self {
        // SAFETY: see the type.
        Self(unsafe { _mm512_mask_mov_pd(self.0, _mm512_cmp_pd_mask::<_CMP_EQ_OQ>(a.0, b.0), yes.0) })
    }
}

impl Single for EightSingle {
    type Double = Four;
    type Short = short::SixteenShort;

    #[inline(always)]
    fn narrow(a: Four, b: Four) -> Self {
        // SAFETY: see the type.
        Self(unsafe { _mm256_set_m128(_mm256_cvtpd_ps(b.0), _mm256_cvtpd_ps(a.0)) })
    }

    #[inline(always)]
    fn load_half(x: &[u16]) -> Self {
        let x = &x[..Self::LANES];
        // SAFETY: the numbers are there, checked above; features: see the type.
        Self(unsafe { _mm256_cvtph_ps(_mm_loadu_si128(x.as_ptr().cast())) })
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        // SAFETY: see the type.
        Self(unsafe { _mm256_div_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: see the type.
        Self(unsafe { _mm256_sqrt_ps(self.0) })
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        // SAFETY: see the type.
        Self(unsafe { _mm256_min_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn truncate(self) -> Self {
        // SAFETY: see the type.
        Self(unsafe { _mm256_cvtepi32_ps(_mm256_cvttps_epi32(self.0)) })
    }
    #[inline(always)]
    fn store_whole(self, x: &mut [u32]) {
        let x = &mut x[..Self::LANES];
        // SAFETY: the numbers are there, checked above; features: see the type.
        unsafe { _mm256_storeu_si256(x.as_mut_ptr().cast(), _mm256_cvttps_epi32(self.0)) }
    }
    #[inline(always)]
    fn if_positive(self, yes: Self, no: Self) -> Self {
        // SAFETY: see the type.
        unsafe {
            let zero = _mm256_setzero_ps();
            Self(_mm256_blendv_ps(no.0, yes.0, _mm256_cmp_ps::<_CMP_GT_OQ>(self.0, zero)))
        }
    }
}

impl Single for Sixteen {
    type Double = Eight;
    type Short = short::ThirtyTwoShort;

    #[inline(always)]
    fn narrow(a: Eight, b: Eight) -> Self {
        // SAFETY: see the type.
        Self(unsafe {
            let low = _mm512_castps256_ps512(_mm512_cvtpd_ps(a.0));
            _mm512_insertf32x8::<1>(low, _mm512_cvtpd_ps(b.0))
        })
    }

    #[inline(always)]
    fn load_half(x: &[u16]) -> Self {
        let x = &x[..Self::LANES];
        // SAFETY: the numbers are there, checked above; features: see the type.
        Self(unsafe { _mm512_cvtph_ps(_mm256_loadu_si256(x.as_ptr().cast())) })
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        // SAFETY: see the type.
        Self(unsafe { _mm512_div_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: see the type.
        Self(unsafe { _mm512_sqrt_ps(self.0) })
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        // SAFETY: see the type.
        Self(unsafe { _mm512_min_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn truncate(self) -> Self {
        // SAFETY: see the type.
        Self(unsafe { _mm512_cvtepi32_ps(_mm512_cvttps_epi32(self.0)) })
    }
    #[inline(always)]
    fn store_whole(self, x: &mut [u32]) {
        let x = &mut x[..Self::LANES];
        // SAFETY: the numbers are there, checked above; features: see the type.
        unsafe { _mm512_storeu_si512(x.as_mut_ptr().cast(), _mm512_cvttps_epi32(self.0)) }
    }
    #[inline(always)]
    fn if_positive(self, yes: Self, no: Self) -> Self {
        // SAFETY: see the type.
        unsafe {
            let zero = _mm512_setzero_ps();
            Self(_mm512_mask_mov_ps(no.0, _mm512_cmp_ps_mask::<_CMP_GT_OQ>(self.0, zero), yes.0))
        }
    }
}
