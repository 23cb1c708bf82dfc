//! Vectors as wide as the instruction set's registers, for kernels that hold their sums in registers.

/// A register of numbers.
pub trait Vector: Copy {
    /// What its lanes hold.
    type T: Copy;
    /// Numbers per register.
    const LANES: usize;
    /// Registers that kernels may count on.
    const REGISTERS: usize;

    /// All lanes the same.
    fn splat(x: Self::T) -> Self;
    /// The first lanes of a slice.
    ///
    /// # Panics
    /// If the slice is shorter than a register.
    fn load(x: &[Self::T]) -> Self;
    /// Writes the first lanes of a slice.
    ///
    /// # Panics
    /// If the slice is shorter than a register.
    fn store(self, x: &mut [Self::T]);
    /// self + b.
    fn add(self, b: Self) -> Self;
    /// self · b.
    fn mul(self, b: Self) -> Self;
    /// self · b + c, fused where the instruction set has it.
    fn fma(self, b: Self, c: Self) -> Self;
    /// The sum over the lanes of each of twelve vectors, added to `sums`, which starts with twelve numbers.
    fn add_sums(v: &[Self; 12], sums: &mut [f64; 16]);
}

/// A register of f64.
pub trait Double: Vector<T = f64> {
    /// Per lane: `yes` where a = b, else self.
    fn replace_if_equal(self, a: Self, b: Self, yes: Self) -> Self;
}

/// A register of f32, which holds as many numbers as two of f64.
pub trait Single: Vector<T = f32> {
    /// The register of f64.
    type Double: Double;

    /// The lanes of `a`, then those of `b`, rounded.
    fn narrow(a: Self::Double, b: Self::Double) -> Self;
}

/// N lanes without intrinsics: what compilers map to SSE2 and NEON.
#[derive(Clone, Copy)]
pub struct Plain<T, const N: usize, const FUSED: bool>([T; N]);

macro_rules! plain {
    ($t:ty, $n:literal) => {
        impl<const FUSED: bool> Vector for Plain<$t, $n, FUSED> {
            type T = $t;
            const LANES: usize = $n;
            const REGISTERS: usize = if cfg!(target_arch = "aarch64") { 32 } else { 16 };

            #[inline(always)]
            fn splat(x: $t) -> Self {
                Self([x; $n])
            }
            #[inline(always)]
            fn load(x: &[$t]) -> Self {
                let mut v = [0.0; $n];
                v.copy_from_slice(&x[..$n]);
                Self(v)
            }
            #[inline(always)]
            fn store(self, x: &mut [$t]) {
                x[..$n].copy_from_slice(&self.0);
            }
            #[inline(always)]
            fn add(mut self, b: Self) -> Self {
                for k in 0..$n {
                    self.0[k] += b.0[k];
                }
                self
            }
            #[inline(always)]
            fn mul(mut self, b: Self) -> Self {
                for k in 0..$n {
                    self.0[k] *= b.0[k];
                }
                self
            }
            #[inline(always)]
            fn fma(mut self, b: Self, c: Self) -> Self {
                for k in 0..$n {
                    self.0[k] =
                        if FUSED { self.0[k].mul_add(b.0[k], c.0[k]) } else { self.0[k] * b.0[k] + c.0[k] };
                }
                self
            }
            #[inline(always)]
            fn add_sums(v: &[Self; 12], sums: &mut [f64; 16]) {
                for c in 0..12 {
                    for k in 0..$n {
                        sums[c] += f64::from(v[c].0[k]);
                    }
                }
            }
        }
    };
}

plain!(f64, 2);
plain!(f32, 4);

impl<const FUSED: bool> Double for Plain<f64, 2, FUSED> {
    #[inline(always)]
    fn replace_if_equal(mut self, a: Self, b: Self, yes: Self) -> Self {
        for k in 0..2 {
            self.0[k] = if a.0[k] == b.0[k] { yes.0[k] } else { self.0[k] };
        }
        self
    }
}

impl<const FUSED: bool> Single for Plain<f32, 4, FUSED> {
    type Double = Plain<f64, 2, FUSED>;

    #[inline(always)]
    fn narrow(a: Self::Double, b: Self::Double) -> Self {
        Self([a.0[0] as f32, a.0[1] as f32, b.0[0] as f32, b.0[1] as f32])
    }
}

/// One register of an x86 instruction set, with the intrinsics that its operations are.
#[cfg(target_arch = "x86_64")]
macro_rules! register {
    ($doc:literal, $name:ident, $t:ty, $reg:ty, $lanes:literal, $registers:literal,
     $splat:ident, $load:ident, $store:ident, $add:ident, $mul:ident, $fma:ident, $sums:path) => {
        #[doc = $doc]
        /// Only [`crate::run`] names it, after detection of the instruction set, which is what makes the calls
        /// of intrinsics sound.
        #[derive(Clone, Copy)]
        pub struct $name(pub(super) $reg);

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
            fn add_sums(v: &[Self; 12], sums: &mut [f64; 16]) {
                for c in [0, 4, 8] {
                    let sum = $sums(v[c], v[c + 1], v[c + 2], v[c + 3]);
                    Four::load(&sums[c..]).add(sum).store(&mut sums[c..]);
                }
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
pub(crate) mod x86 {
    use super::{Double, Single, Vector};
    use std::arch::x86_64::*;

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
        _mm256_mul_pd,
        _mm256_fmadd_pd,
        Four::sums
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
        _mm256_mul_ps,
        _mm256_fmadd_ps,
        EightSingle::sums
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
        _mm512_mul_pd,
        _mm512_fmadd_pd,
        Eight::sums
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
        _mm512_mul_ps,
        _mm512_fmadd_ps,
        Sixteen::sums
    );

    impl Four {
        /// The sum over the lanes of each.
        #[inline(always)]
        fn sums(a: Self, b: Self, c: Self, d: Self) -> Self {
            // SAFETY: see the type.
            unsafe {
                let (a, b) = (_mm256_hadd_pd(a.0, b.0), _mm256_hadd_pd(c.0, d.0));
                let low = _mm256_permute2f128_pd::<0x20>(a, b);
                Self(_mm256_add_pd(low, _mm256_permute2f128_pd::<0x31>(a, b)))
            }
        }
    }

    impl EightSingle {
        /// The sum over the lanes of each.
        #[inline(always)]
        fn sums(a: Self, b: Self, c: Self, d: Self) -> Four {
            // SAFETY: see the type.
            unsafe {
                let all = _mm256_hadd_ps(_mm256_hadd_ps(a.0, b.0), _mm256_hadd_ps(c.0, d.0));
                let sum = _mm_add_ps(_mm256_castps256_ps128(all), _mm256_extractf128_ps::<1>(all));
                Four(_mm256_cvtps_pd(sum))
            }
        }
    }

    impl Eight {
        /// Lane pairs summed: (a₀₁, b₀₁, a₂₃, b₂₃, a₄₅, b₄₅, a₆₇, b₆₇).
        #[inline(always)]
        fn pairs(a: Self, b: Self) -> Self {
            // SAFETY: see the type.
            Self(unsafe { _mm512_add_pd(_mm512_unpacklo_pd(a.0, b.0), _mm512_unpackhi_pd(a.0, b.0)) })
        }

        /// The sum over the lanes of each.
        #[inline(always)]
        fn sums(a: Self, b: Self, c: Self, d: Self) -> Four {
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
        #[inline(always)]
        fn half(self) -> EightSingle {
            // SAFETY: see the type.
            EightSingle(unsafe {
                _mm256_add_ps(_mm512_castps512_ps256(self.0), _mm512_extractf32x8_ps::<1>(self.0))
            })
        }

        /// The sum over the lanes of each.
        #[inline(always)]
        fn sums(a: Self, b: Self, c: Self, d: Self) -> Four {
            EightSingle::sums(a.half(), b.half(), c.half(), d.half())
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

        #[inline(always)]
        fn narrow(a: Four, b: Four) -> Self {
            // SAFETY: see the type.
            Self(unsafe { _mm256_set_m128(_mm256_cvtpd_ps(b.0), _mm256_cvtpd_ps(a.0)) })
        }
    }

    impl Single for Sixteen {
        type Double = Eight;

        #[inline(always)]
        fn narrow(a: Eight, b: Eight) -> Self {
            // SAFETY: see the type.
            Self(unsafe {
                let low = _mm512_castps256_ps512(_mm512_cvtpd_ps(a.0));
                _mm512_insertf32x8::<1>(low, _mm512_cvtpd_ps(b.0))
            })
        }
    }
}
