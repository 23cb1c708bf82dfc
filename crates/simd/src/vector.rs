//! Vectors of f64 as wide as the instruction set's registers, for kernels that hold their sums in registers.

/// A register of f64.
pub trait Vector: Copy {
    /// Numbers per register.
    const LANES: usize;
    /// Registers that kernels may count on.
    const REGISTERS: usize;

    /// All lanes the same.
    fn splat(x: f64) -> Self;
    /// The first lanes of a slice.
    ///
    /// # Panics
    /// If the slice is shorter than a register.
    fn load(x: &[f64]) -> Self;
    /// Writes the first lanes of a slice.
    ///
    /// # Panics
    /// If the slice is shorter than a register.
    fn store(self, x: &mut [f64]);
    /// self + b.
    fn add(self, b: Self) -> Self;
    /// self · b.
    fn mul(self, b: Self) -> Self;
    /// self · b + c, fused where the instruction set has it.
    fn fma(self, b: Self, c: Self) -> Self;
    /// Per lane: `yes` where a = b, else self.
    fn replace_if_equal(self, a: Self, b: Self, yes: Self) -> Self;
    /// The sum over the lanes of each of twelve vectors, added to `sums`, which starts with twelve numbers.
    fn add_sums(v: &[Self; 12], sums: &mut [f64; 16]);
}

/// Two lanes without intrinsics: what compilers map to SSE2 and NEON.
#[derive(Clone, Copy)]
pub struct Pair<const FUSED: bool>([f64; 2]);

impl<const FUSED: bool> Vector for Pair<FUSED> {
    const LANES: usize = 2;
    const REGISTERS: usize = 16;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self([x; 2])
    }
    #[inline(always)]
    fn load(x: &[f64]) -> Self {
        Self([x[0], x[1]])
    }
    #[inline(always)]
    fn store(self, x: &mut [f64]) {
        x[..2].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self([self.0[0] + b.0[0], self.0[1] + b.0[1]])
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self([self.0[0] * b.0[0], self.0[1] * b.0[1]])
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        if FUSED {
            Self([self.0[0].mul_add(b.0[0], c.0[0]), self.0[1].mul_add(b.0[1], c.0[1])])
        } else {
            self.mul(b).add(c)
        }
    }
    #[inline(always)]
    fn replace_if_equal(self, a: Self, b: Self, yes: Self) -> Self {
        Self(std::array::from_fn(|k| if a.0[k] == b.0[k] { yes.0[k] } else { self.0[k] }))
    }
    #[inline(always)]
    fn add_sums(v: &[Self; 12], sums: &mut [f64; 16]) {
        for (s, v) in sums.iter_mut().zip(v) {
            *s += v.0[0] + v.0[1];
        }
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) mod x86 {
    use super::Vector;
    use std::arch::x86_64::*;

    /// Four lanes of AVX2 with FMA. Only [`crate::run`] names it, after detection.
    #[derive(Clone, Copy)]
    pub struct Four(__m256d);

    impl Vector for Four {
        const LANES: usize = 4;
        const REGISTERS: usize = 16;

        #[inline(always)]
        fn splat(x: f64) -> Self {
            // SAFETY: only kernels that `run` dispatched after detecting AVX2 and FMA come here.
            Self(unsafe { _mm256_set1_pd(x) })
        }
        #[inline(always)]
        fn load(x: &[f64]) -> Self {
            let x = &x[..4];
            // SAFETY: four numbers are there, checked above; features as in `splat`.
            Self(unsafe { _mm256_loadu_pd(x.as_ptr()) })
        }
        #[inline(always)]
        fn store(self, x: &mut [f64]) {
            let x = &mut x[..4];
            // SAFETY: four numbers are there, checked above; features as in `splat`.
            unsafe { _mm256_storeu_pd(x.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn add(self, b: Self) -> Self {
            // SAFETY: as in `splat`.
            Self(unsafe { _mm256_add_pd(self.0, b.0) })
        }
        #[inline(always)]
        fn mul(self, b: Self) -> Self {
            // SAFETY: as in `splat`.
            Self(unsafe { _mm256_mul_pd(self.0, b.0) })
        }
        #[inline(always)]
        fn fma(self, b: Self, c: Self) -> Self {
            // SAFETY: as in `splat`.
            Self(unsafe { _mm256_fmadd_pd(self.0, b.0, c.0) })
        }
        #[inline(always)]
        fn replace_if_equal(self, a: Self, b: Self, yes: Self) -> Self {
            // SAFETY: as in `splat`.
            Self(unsafe { _mm256_blendv_pd(self.0, yes.0, _mm256_cmp_pd::<_CMP_EQ_OQ>(a.0, b.0)) })
        }
        #[inline(always)]
        fn add_sums(v: &[Self; 12], sums: &mut [f64; 16]) {
            for (v, s) in v.chunks_exact(4).zip(sums.chunks_exact_mut(4)) {
                // SAFETY: as in `splat`.
                let sum = unsafe {
                    let (a, b) = (_mm256_hadd_pd(v[0].0, v[1].0), _mm256_hadd_pd(v[2].0, v[3].0));
                    let low = _mm256_permute2f128_pd::<0x20>(a, b);
                    Self(_mm256_add_pd(low, _mm256_permute2f128_pd::<0x31>(a, b)))
                };
                Self::load(s).add(sum).store(s);
            }
        }
    }

    /// Eight lanes of AVX-512. Only [`crate::run`] names it, after detection.
    #[derive(Clone, Copy)]
    pub struct Eight(__m512d);

    impl Eight {
        /// Lane pairs summed: (a₀₁, b₀₁, a₂₃, b₂₃, a₄₅, b₄₅, a₆₇, b₆₇).
        #[inline(always)]
        fn pairs(a: Self, b: Self) -> Self {
            // SAFETY: as in `splat`.
            Self(unsafe { _mm512_add_pd(_mm512_unpacklo_pd(a.0, b.0), _mm512_unpackhi_pd(a.0, b.0)) })
        }

        /// Sums of four vectors over either half: (a, b, c, d of the low half, then of the high half).
        #[inline(always)]
        fn halves(a: Self, b: Self, c: Self, d: Self) -> Self {
            let (p, q) = (Self::pairs(a, b), Self::pairs(c, d));
            // SAFETY: as in `splat`.
            unsafe {
                let low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
                let high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
                let x = _mm512_permutex2var_pd(p.0, low, q.0);
                Self(_mm512_add_pd(x, _mm512_permutex2var_pd(p.0, high, q.0)))
            }
        }
    }

    impl Vector for Eight {
        const LANES: usize = 8;
        const REGISTERS: usize = 32;

        #[inline(always)]
        fn splat(x: f64) -> Self {
            // SAFETY: only kernels that `run` dispatched after detecting AVX-512 come here.
            Self(unsafe { _mm512_set1_pd(x) })
        }
        #[inline(always)]
        fn load(x: &[f64]) -> Self {
            let x = &x[..8];
            // SAFETY: eight numbers are there, checked above; features as in `splat`.
            Self(unsafe { _mm512_loadu_pd(x.as_ptr()) })
        }
        #[inline(always)]
        fn store(self, x: &mut [f64]) {
            let x = &mut x[..8];
            // SAFETY: eight numbers are there, checked above; features as in `splat`.
            unsafe { _mm512_storeu_pd(x.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn add(self, b: Self) -> Self {
            // SAFETY: as in `splat`.
            Self(unsafe { _mm512_add_pd(self.0, b.0) })
        }
        #[inline(always)]
        fn mul(self, b: Self) -> Self {
            // SAFETY: as in `splat`.
            Self(unsafe { _mm512_mul_pd(self.0, b.0) })
        }
        #[inline(always)]
        fn fma(self, b: Self, c: Self) -> Self {
            // SAFETY: as in `splat`.
            Self(unsafe { _mm512_fmadd_pd(self.0, b.0, c.0) })
        }
        #[inline(always)]
        fn replace_if_equal(self, a: Self, b: Self, yes: Self) -> Self {
            // SAFETY: as in `splat`.
            Self(unsafe { _mm512_mask_mov_pd(self.0, _mm512_cmp_pd_mask::<_CMP_EQ_OQ>(a.0, b.0), yes.0) })
        }
        #[inline(always)]
        fn add_sums(v: &[Self; 12], sums: &mut [f64; 16]) {
            for (v, s) in v.chunks_exact(4).zip(sums.chunks_exact_mut(4)) {
                let h = Self::halves(v[0], v[1], v[2], v[3]);
                // SAFETY: as in `splat`.
                let sum =
                    unsafe { _mm256_add_pd(_mm512_castpd512_pd256(h.0), _mm512_extractf64x4_pd::<1>(h.0)) };
                Four(sum).add(Four::load(s)).store(s);
            }
        }
    }
}
