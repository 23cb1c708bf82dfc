//! Registers without intrinsics: what compilers map to NEON, and what the tests compare the others with.

use crate::vector::{Double, Short, Single, Vector};

/// N lanes without intrinsics.
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
    type Short = PlainShort<FUSED>;

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
    fn store_whole(self, x: &mut [u32]) {
        x[..4].copy_from_slice(&self.0.map(|x| x as u32));
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

/// Eight i16 without intrinsics.
#[derive(Clone, Copy)]
pub struct PlainShort<const FUSED: bool>([i16; 8]);

impl<const FUSED: bool> Short for PlainShort<FUSED> {
    type Single = Plain<f32, 4, FUSED>;

    #[inline(always)]
    fn splat(x: i16) -> Self {
        Self([x; 8])
    }
    #[inline(always)]
    fn load(x: &[i16]) -> Self {
        let mut v = [0; 8];
        v.copy_from_slice(&x[..8]);
        Self(v)
    }
    #[inline(always)]
    fn add(mut self, b: Self) -> Self {
        for k in 0..8 {
            self.0[k] = self.0[k].wrapping_add(b.0[k]);
        }
        self
    }
    #[inline(always)]
    fn fraction(mut self, b: Self) -> Self {
        for k in 0..8 {
            self.0[k] = ((i32::from(self.0[k]) * i32::from(b.0[k]) + (1 << 14)) >> 15) as i16;
        }
        self
    }
    #[inline(always)]
    fn pairs(self, b: Self) -> Self::Single {
        let product = |k: usize| i32::from(self.0[k]) * i32::from(b.0[k]);
        let pair = |k: usize| product(2 * k).wrapping_add(product(2 * k + 1)) as f32;
        Plain([pair(0), pair(1), pair(2), pair(3)])
    }
}
