//! Numbers that kernels read by registers: f32, or 16-bit floats as their bits.

use steradian_simd::Single;

/// A number that a register of f32 is filled from.
pub trait Number: Copy {
    /// The first lanes of a slice, which is as long at least; 16-bit floats are finite.
    fn load<V: Single>(x: &[Self]) -> V;
    /// This one.
    fn single(self) -> f32;
    /// Writes a register to the first lanes of a slice; what 16-bit floats take is below 65520 in size.
    fn store<V: Single>(v: V, to: &mut [Self]);
}

impl Number for f32 {
    #[inline(always)]
    fn load<V: Single>(x: &[f32]) -> V {
        V::load(x)
    }
    #[inline(always)]
    fn single(self) -> f32 {
        self
    }
    #[inline(always)]
    fn store<V: Single>(v: V, to: &mut [f32]) {
        v.store(to);
    }
}

impl Number for u16 {
    #[inline(always)]
    fn load<V: Single>(x: &[u16]) -> V {
        V::load_half(x)
    }
    #[inline(always)]
    fn single(self) -> f32 {
        half::f16::from_bits(self).to_f32()
    }
    #[inline(always)]
    fn store<V: Single>(v: V, to: &mut [u16]) {
        v.store_half(to);
    }
}
