//! Eight f32 at a time, for kernels that test lanes and branch on the outcome, where compilers do not find
//! the vector form of plain loops.

/// Eight lanes of f32. Every instruction set gives the same bits.
pub trait Lanes: Copy {
    /// The eight numbers.
    fn load(x: &[f32; 8]) -> Self;
    /// Eight times the same number.
    fn splat(x: f32) -> Self;
    /// The lanes as an array.
    fn store(self) -> [f32; 8];
    /// Sum.
    fn add(self, b: Self) -> Self;
    /// Difference.
    fn sub(self, b: Self) -> Self;
    /// Product.
    fn mul(self, b: Self) -> Self;
    /// Quotient.
    fn div(self, b: Self) -> Self;
    /// The smaller; `b` where they are equal or either is NaN.
    fn min(self, b: Self) -> Self;
    /// The larger; `b` where they are equal or either is NaN.
    fn max(self, b: Self) -> Self;
    /// Bit i: is lane i less than that of `b`?
    fn lt(self, b: Self) -> u32;
    /// Bit i: is lane i less than that of `b`, or equal?
    fn le(self, b: Self) -> u32;
    /// Bit i: does lane i equal that of `b`?
    fn eq(self, b: Self) -> u32;
}

/// Plain loops.
#[cfg(any(test, not(target_arch = "x86_64")))]
#[derive(Clone, Copy)]
pub struct Plain([f32; 8]);

#[cfg(any(test, not(target_arch = "x86_64")))]
impl Plain {
    #[inline(always)]
    fn zip(self, b: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], b.0[i])))
    }

    #[inline(always)]
    fn test(self, b: Self, f: impl Fn(&f32, &f32) -> bool) -> u32 {
        (0..8).fold(0, |m, i| m | u32::from(f(&self.0[i], &b.0[i])) << i)
    }
}

#[cfg(any(test, not(target_arch = "x86_64")))]
impl Lanes for Plain {
    #[inline(always)]
    fn load(x: &[f32; 8]) -> Self {
        Self(*x)
    }
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; 8])
    }
    #[inline(always)]
    fn store(self) -> [f32; 8] {
        self.0
    }
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        self.zip(b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        self.zip(b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        self.zip(b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        self.zip(b, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        self.zip(b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        self.zip(b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn lt(self, b: Self) -> u32 {
        self.test(b, f32::lt)
    }
    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        self.test(b, f32::le)
    }
    #[inline(always)]
    fn eq(self, b: Self) -> u32 {
        self.test(b, f32::eq)
    }
}

#[cfg(target_arch = "x86_64")]
pub use avx::Avx;

#[cfg(target_arch = "x86_64")]
mod avx {
    use super::Lanes;
    use std::arch::x86_64::*;

    /// One register of AVX. Values exist only in kernels that [`crate::run`] calls where AVX2 was detected,
    /// which is what makes the calls below sound: the type is reachable through [`crate::Arch`] alone.
    #[derive(Clone, Copy)]
    pub struct Avx(__m256);

    /// Calls of intrinsics that take registers only.
    macro_rules! registers {
        ($($name:ident = $intrinsic:ident),*) => { $(
            #[inline(always)]
            fn $name(self, b: Self) -> Self {
                // SAFETY: see the type.
                Self(unsafe { $intrinsic(self.0, b.0) })
            }
        )* };
    }

    macro_rules! comparisons {
        ($($name:ident = $predicate:ident),*) => { $(
            #[inline(always)]
            fn $name(self, b: Self) -> u32 {
                // SAFETY: see the type.
                (unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<$predicate>(self.0, b.0)) }) as u32
            }
        )* };
    }

    impl Lanes for Avx {
        #[inline(always)]
        fn load(x: &[f32; 8]) -> Self {
            // SAFETY: see the type; the reference covers the eight numbers that are read.
            Self(unsafe { _mm256_loadu_ps(x.as_ptr()) })
        }
        #[inline(always)]
        fn splat(x: f32) -> Self {
            // SAFETY: see the type.
            Self(unsafe { _mm256_set1_ps(x) })
        }
        #[inline(always)]
        fn store(self) -> [f32; 8] {
            let mut out = [0.0; 8];
            // SAFETY: see the type; the array has room for the eight numbers that are written.
            unsafe { _mm256_storeu_ps(out.as_mut_ptr(), self.0) };
            out
        }
        registers!(
            add = _mm256_add_ps,
            sub = _mm256_sub_ps,
            mul = _mm256_mul_ps,
            div = _mm256_div_ps,
            min = _mm256_min_ps,
            max = _mm256_max_ps
        );
        comparisons!(lt = _CMP_LT_OQ, le = _CMP_LE_OQ, eq = _CMP_EQ_OQ);
    }
}
