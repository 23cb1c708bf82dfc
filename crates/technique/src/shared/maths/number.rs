//! Numbers that kernels read by registers: f32, or 16-bit floats as their bits.

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
