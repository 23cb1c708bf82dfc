//! SSE2's registers, which every x86-64 has. In plain loops over arrays the kernels gave the same bits, but
//! compilers took five times as long to find the vectors in them (the shading of view tables: 25 s for 5).

use super::{Double, Single, Vector};
use crate::lanes;
use std::arch::x86_64::*;

register!(
    "Two f64 of SSE2.",
    TwoDouble,
    f64,
    __m128d,
    2,
    16,
    _mm_set1_pd,
    _mm_loadu_pd,
    _mm_storeu_pd,
    _mm_add_pd,
    _mm_sub_pd,
    _mm_mul_pd,
    add_product_double,
    less_product_double,
    TwoDouble::across,
    TwoDouble::lane_sums,
    TwoDouble::add_sums
);
register!(
    "Four f32 of SSE2.",
    FourSingle,
    f32,
    __m128,
    4,
    16,
    _mm_set1_ps,
    _mm_loadu_ps,
    _mm_storeu_ps,
    _mm_add_ps,
    _mm_sub_ps,
    _mm_mul_ps,
    add_product_single,
    less_product_single,
    FourSingle::across,
    FourSingle::lane_sums,
    FourSingle::add_sums
);

/// ab + c and c − ab, rounded twice.
macro_rules! products {
    ($reg:ty, $add:ident, $less:ident, $plus:ident, $minus:ident, $times:ident) => {
        /// # Safety
        /// None beyond x86-64: the macro above calls what needs it.
        #[inline(always)]
        unsafe fn $add(a: $reg, b: $reg, c: $reg) -> $reg {
            // SAFETY: x86-64 has SSE2.
            unsafe { $plus($times(a, b), c) }
        }
        /// # Safety
        /// As above.
        #[inline(always)]
        unsafe fn $less(a: $reg, b: $reg, c: $reg) -> $reg {
            // SAFETY: x86-64 has SSE2.
            unsafe { $minus(c, $times(a, b)) }
        }
    };
}

products!(__m128, add_product_single, less_product_single, _mm_add_ps, _mm_sub_ps, _mm_mul_ps);
products!(__m128d, add_product_double, less_product_double, _mm_add_pd, _mm_sub_pd, _mm_mul_pd);

transposed_sums!(TwoDouble, FourSingle);

/// Lane after lane, as plain loops would.
macro_rules! sums_by_lane {
    ($($name:ident),*) => {$(
        impl $name {
            #[inline(always)]
            fn add_sums(v: &[Self; 12], sums: &mut [f64; 16]) {
                let mut lanes = [Default::default(); Self::LANES];
                for c in 0..12 {
                    v[c].store(&mut lanes);
                    for k in 0..Self::LANES {
                        sums[c] += f64::from(lanes[k]);
                    }
                }
            }
        }
    )*};
}

sums_by_lane!(TwoDouble, FourSingle);

impl TwoDouble {
    #[inline(always)]
    fn across(v: &mut [Self]) {
        let (a, b) = (v[0].0, v[1].0);
        // SAFETY: x86-64 has SSE2.
        unsafe {
            v[0] = Self(_mm_unpacklo_pd(a, b));
            v[1] = Self(_mm_unpackhi_pd(a, b));
        }
    }
}

impl FourSingle {
    #[inline(always)]
    fn across(v: &mut [Self]) {
        let (a, b, c, d) = (v[0].0, v[1].0, v[2].0, v[3].0);
        // SAFETY: x86-64 has SSE2.
        unsafe {
            let (ab, cd) = (_mm_unpacklo_ps(a, b), _mm_unpacklo_ps(c, d));
            v[0] = Self(_mm_movelh_ps(ab, cd));
            v[1] = Self(_mm_movehl_ps(cd, ab));
            let (ab, cd) = (_mm_unpackhi_ps(a, b), _mm_unpackhi_ps(c, d));
            v[2] = Self(_mm_movelh_ps(ab, cd));
            v[3] = Self(_mm_movehl_ps(cd, ab));
        }
    }
}

impl Double for TwoDouble {
    #[inline(always)]
    fn replace_if_equal(self, a: Self, b: Self, yes: Self) -> Self {
        // SAFETY: x86-64 has SSE2.
        Self(unsafe {
            let same = _mm_cmpeq_pd(a.0, b.0);
            _mm_or_pd(_mm_and_pd(same, yes.0), _mm_andnot_pd(same, self.0))
        })
    }
}

impl Single for FourSingle {
    type Double = TwoDouble;
    type Short = super::short::EightShort;

    #[inline(always)]
    fn narrow(a: TwoDouble, b: TwoDouble) -> Self {
        // SAFETY: x86-64 has SSE2.
        Self(unsafe { _mm_movelh_ps(_mm_cvtpd_ps(a.0), _mm_cvtpd_ps(b.0)) })
    }

    /// Bits of the exponent and the digits go where those of f32 are; the exponent is then off by 112.
    #[inline(always)]
    fn load_half(x: &[u16]) -> Self {
        let x = &x[..Self::LANES];
        // SAFETY: the numbers are there, checked above, and x86-64 has SSE2.
        Self(unsafe {
            let bits = _mm_unpacklo_epi16(_mm_loadl_epi64(x.as_ptr().cast()), _mm_setzero_si128());
            let size = _mm_slli_epi32::<13>(_mm_and_si128(bits, _mm_set1_epi32(0x7fff)));
            let size = _mm_mul_ps(_mm_castsi128_ps(size), _mm_set1_ps(f32::from_bits((127 + 112) << 23)));
            let sign = _mm_slli_epi32::<16>(_mm_and_si128(bits, _mm_set1_epi32(0x8000)));
            _mm_or_ps(size, _mm_castsi128_ps(sign))
        })
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        // SAFETY: x86-64 has SSE2.
        Self(unsafe { _mm_div_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: x86-64 has SSE2.
        Self(unsafe { _mm_sqrt_ps(self.0) })
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        // SAFETY: x86-64 has SSE2.
        Self(unsafe { _mm_min_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn truncate(self) -> Self {
        // SAFETY: x86-64 has SSE2.
        Self(unsafe { _mm_cvtepi32_ps(_mm_cvttps_epi32(self.0)) })
    }
    #[inline(always)]
    fn store_whole(self, x: &mut [u32]) {
        let x = &mut x[..Self::LANES];
        // SAFETY: the numbers are there, checked above; features: x86-64 has SSE2.
        unsafe { _mm_storeu_si128(x.as_mut_ptr().cast(), _mm_cvttps_epi32(self.0)) }
    }
    #[inline(always)]
    fn if_positive(self, yes: Self, no: Self) -> Self {
        // SAFETY: x86-64 has SSE2.
        Self(unsafe {
            let positive = _mm_cmpgt_ps(self.0, _mm_setzero_ps());
            _mm_or_ps(_mm_and_ps(positive, yes.0), _mm_andnot_ps(positive, no.0))
        })
    }
}

/// Two registers for one.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Pair<V>([V; 2]);

impl<V: Vector> Pair<V> {
    #[inline(always)]
    fn each(self, b: Self, f: impl Fn(V, V) -> V) -> Self {
        Self([f(self.0[0], b.0[0]), f(self.0[1], b.0[1])])
    }
}

impl<V: Vector> Vector for Pair<V> {
    type T = V::T;
    const LANES: usize = 2 * V::LANES;
    const REGISTERS: usize = V::REGISTERS / 2;

    #[inline(always)]
    fn splat(x: V::T) -> Self {
        Self([V::splat(x); 2])
    }
    #[inline(always)]
    fn load(x: &[V::T]) -> Self {
        let (a, b) = x[..Self::LANES].split_at(V::LANES);
        Self([V::load(a), V::load(b)])
    }
    #[inline(always)]
    fn store(self, x: &mut [V::T]) {
        let (a, b) = x[..Self::LANES].split_at_mut(V::LANES);
        self.0[0].store(a);
        self.0[1].store(b);
    }
    #[inline(always)]
    fn view(x: &mut [V::T]) -> &mut [Self] {
        // SAFETY: the type is two registers of these numbers, and all bits are numbers.
        unsafe { x.align_to_mut().1 }
    }
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        self.each(b, V::add)
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        self.each(b, V::sub)
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        self.each(b, V::mul)
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        Self([self.0[0].fma(b.0[0], c.0[0]), self.0[1].fma(b.0[1], c.0[1])])
    }
    #[inline(always)]
    fn fnma(self, b: Self, c: Self) -> Self {
        Self([self.0[0].fnma(b.0[0], c.0[0]), self.0[1].fnma(b.0[1], c.0[1])])
    }
    /// The four squares by themselves; then those off the diagonal change places.
    #[inline(always)]
    fn transpose(v: &mut [Self]) {
        let n = V::LANES;
        let mut square = [v[0].0[0]; 4];
        for (first, half) in [(0, 0), (0, 1), (n, 0), (n, 1)] {
            for k in 0..n {
                square[k] = v[first + k].0[half];
            }
            V::transpose(&mut square[..n]);
            for k in 0..n {
                v[first + k].0[half] = square[k];
            }
        }
        for k in 0..n {
            (v[k].0[1], v[n + k].0[0]) = (v[n + k].0[0], v[k].0[1]);
        }
    }
    #[inline(always)]
    fn lane_sums(v: &mut [Self]) -> Self {
        Self::transpose(v);
        let mut sum = v[0];
        for v in &v[1..Self::LANES] {
            sum = sum.add(*v);
        }
        sum
    }
    #[inline(always)]
    fn add_sums(v: &[Self; 12], sums: &mut [f64; 16]) {
        for half in 0..2 {
            V::add_sums(&v.map(|v| v.0[half]), sums);
        }
    }
}

/// Eight f32 in two registers.
#[derive(Clone, Copy)]
pub struct Lanes(__m128, __m128);

/// Operations lane by lane.
macro_rules! registers {
    ($($name:ident = $intrinsic:ident),*) => { $(
        #[inline(always)]
        fn $name(self, b: Self) -> Self {
            // SAFETY: x86-64 has SSE2.
            unsafe { Self($intrinsic(self.0, b.0), $intrinsic(self.1, b.1)) }
        }
    )* };
}

/// Comparisons, a bit a lane.
macro_rules! comparisons {
    ($($name:ident = $intrinsic:ident),*) => { $(
        #[inline(always)]
        fn $name(self, b: Self) -> u32 {
            // SAFETY: x86-64 has SSE2.
            let half = |a, b| unsafe { _mm_movemask_ps($intrinsic(a, b)) } as u32;
            half(self.0, b.0) | half(self.1, b.1) << 4
        }
    )* };
}

impl lanes::Lanes for Lanes {
    #[inline(always)]
    fn load(x: &[f32; 8]) -> Self {
        Self(FourSingle::load(&x[..4]).0, FourSingle::load(&x[4..]).0)
    }
    #[inline(always)]
    fn splat(x: f32) -> Self {
        let half = FourSingle::splat(x).0;
        Self(half, half)
    }
    #[inline(always)]
    fn store(self) -> [f32; 8] {
        let mut out = [0.0; 8];
        FourSingle(self.0).store(&mut out[..4]);
        FourSingle(self.1).store(&mut out[4..]);
        out
    }
    registers!(
        add = _mm_add_ps,
        sub = _mm_sub_ps,
        mul = _mm_mul_ps,
        div = _mm_div_ps,
        min = _mm_min_ps,
        max = _mm_max_ps
    );
    comparisons!(lt = _mm_cmplt_ps, le = _mm_cmple_ps, eq = _mm_cmpeq_ps);
}
