//! The sRGB transfer function, IEC 61966-2-1.

/// Encoded value in 0 … 1 of a linear value; values outside are clamped.
#[inline]
pub fn srgb_encode(linear: f32) -> f32 {
    let c = linear.clamp(0.0, 1.0);
    if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}

/// Linear value of an encoded value.
#[inline]
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encode_and_decode_are_inverse_at_every_byte() {
        for k in 0..=255 {
            let v = k as f32 / 255.0;
            assert!((255.0 * srgb_encode(srgb_decode(v)) - k as f32).abs() < 1e-2);
        }
        assert!((srgb_encode(0.18) - 0.461_356).abs() < 1e-5);
    }
}
