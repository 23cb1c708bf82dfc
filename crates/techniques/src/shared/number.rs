//! Numbers that kernels read by registers: f32, or 16-bit floats as their bits.

use half::f16;
use steradian_simd::Single;

/// A number that a register of f32 is filled from.
pub trait Number: Copy {
    /// The first lanes of a slice, which is as long at least; 16-bit floats are finite.
    fn load<V: Single>(x: &[Self]) -> V;
}

impl Number for f32 {
    #[inline(always)]
    fn load<V: Single>(x: &[f32]) -> V {
        V::load(x)
    }
}

impl Number for u16 {
    #[inline(always)]
    fn load<V: Single>(x: &[u16]) -> V {
        V::load_half(x)
    }
}

/// A finite 16-bit float, exactly: its exponent is off by 112. (Conversions that ask which instructions there are took half
/// of the time of shading by clusters.)
#[inline(always)]
pub fn single(x: f16) -> f32 {
    let bits = u32::from(x.to_bits());
    let size = f32::from_bits((bits & 0x7fff) << 13) * f32::from_bits((127 + 112) << 23);
    f32::from_bits(size.to_bits() | (bits & 0x8000) << 16)
}
