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
    /// The numbers from the first that is aligned to a register, as registers.
    fn view(x: &mut [Self::T]) -> &mut [Self];
    /// self + b.
    fn add(self, b: Self) -> Self;
    /// self − b.
    fn sub(self, b: Self) -> Self;
    /// self · b.
    fn mul(self, b: Self) -> Self;
    /// self · b + c, fused where the instruction set has it.
    fn fma(self, b: Self, c: Self) -> Self;
    /// c − self · b, fused where the instruction set has it.
    fn fnma(self, b: Self, c: Self) -> Self;
    /// Lane k of vector i becomes lane i of vector k; as many vectors as lanes.
    fn transpose(v: &mut [Self]);
    /// Lane k is the sum over the lanes of vector k; as many vectors as lanes, which are overwritten.
    ///
    /// # Panics
    /// If there are fewer.
    fn lane_sums(v: &mut [Self]) -> Self;
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
    /// The first lanes of a slice of finite half-precision numbers, as their bits.
    ///
    /// # Panics
    /// If the slice is shorter than a register.
    fn load_half(x: &[u16]) -> Self;
    /// self / b.
    fn div(self, b: Self) -> Self;
    /// The square root.
    fn sqrt(self) -> Self;
    /// The smaller; `b` where they are equal or either is NaN.
    fn min(self, b: Self) -> Self;
    /// Towards zero to a whole number; of numbers below 2^31 in size.
    fn truncate(self) -> Self;
    /// Per lane: `yes` where self > 0, `no` elsewhere and where self is NaN.
    fn if_positive(self, yes: Self, no: Self) -> Self;
}

/// N lanes without intrinsics: what compilers map to SSE2 and NEON.
#[derive(Clone, Copy)]
#[repr(transparent)]
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
            fn view(x: &mut [$t]) -> &mut [Self] {
                // SAFETY: the type is an array of these numbers.
                unsafe { x.align_to_mut().1 }
            }
            #[inline(always)]
            fn sub(mut self, b: Self) -> Self {
                for k in 0..$n {
                    self.0[k] -= b.0[k];
                }
                self
            }
            #[inline(always)]
            fn fnma(mut self, b: Self, c: Self) -> Self {
                for k in 0..$n {
                    let product = -self.0[k];
                    self.0[k] =
                        if FUSED { product.mul_add(b.0[k], c.0[k]) } else { product * b.0[k] + c.0[k] };
                }
                self
            }
            #[inline(always)]
            fn transpose(v: &mut [Self]) {
                for i in 0..$n {
                    for k in 0..i {
                        (v[i].0[k], v[k].0[i]) = (v[k].0[i], v[i].0[k]);
                    }
                }
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
            fn lane_sums(v: &mut [Self]) -> Self {
                Self::transpose(v);
                let mut sum = v[0];
                for k in 1..$n {
                    sum = sum.add(v[k]);
                }
                sum
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
plain!(f64, 4);
plain!(f32, 4);
plain!(f32, 8);

impl<const FUSED: bool> Double for Plain<f64, 2, FUSED> {
    #[inline(always)]
    fn replace_if_equal(mut self, a: Self, b: Self, yes: Self) -> Self {
        for k in 0..2 {
            self.0[k] = if a.0[k] == b.0[k] { yes.0[k] } else { self.0[k] };
        }
        self
    }
}

/// A finite number of half precision: its exponent is off by 112.
#[inline(always)]
fn single(bits: u16) -> f32 {
    let bits = u32::from(bits);
    let size = f32::from_bits((bits & 0x7fff) << 13) * f32::from_bits((127 + 112) << 23);
    f32::from_bits(size.to_bits() | (bits & 0x8000) << 16)
}

impl<const FUSED: bool> Single for Plain<f32, 4, FUSED> {
    type Double = Plain<f64, 2, FUSED>;

    #[inline(always)]
    fn load_half(x: &[u16]) -> Self {
        let x = &x[..4];
        Self([single(x[0]), single(x[1]), single(x[2]), single(x[3])])
    }
    #[inline(always)]
    fn div(mut self, b: Self) -> Self {
        for k in 0..4 {
            self.0[k] /= b.0[k];
        }
        self
    }
    #[inline(always)]
    fn sqrt(mut self) -> Self {
        for k in 0..4 {
            self.0[k] = self.0[k].sqrt();
        }
        self
    }
    #[inline(always)]
    fn min(mut self, b: Self) -> Self {
        for k in 0..4 {
            self.0[k] = if self.0[k] < b.0[k] { self.0[k] } else { b.0[k] };
        }
        self
    }
    #[inline(always)]
    fn truncate(mut self) -> Self {
        for k in 0..4 {
            self.0[k] = self.0[k] as i32 as f32;
        }
        self
    }
    #[inline(always)]
    fn if_positive(mut self, yes: Self, no: Self) -> Self {
        for k in 0..4 {
            self.0[k] = if self.0[k] > 0.0 { yes.0[k] } else { no.0[k] };
        }
        self
    }

    #[inline(always)]
    fn narrow(a: Self::Double, b: Self::Double) -> Self {
        Self([a.0[0] as f32, a.0[1] as f32, b.0[0] as f32, b.0[1] as f32])
    }
}
