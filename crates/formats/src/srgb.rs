//! The sRGB curve: IEC 61966-2-1 (1999), equations 5 and 8, with the exact joint of the two pieces.

/// Display-referred 0 … 1 to linear.
pub fn srgb_to_linear(v: f32) -> f32 {
    let v = f64::from(v);
    (if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }) as f32
}

/// Linear 0 … 1 to display-referred.
pub fn linear_to_srgb(v: f32) -> f32 {
    let v = f64::from(v);
    (if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curves_are_inverse() {
        for i in 0..=255u8 {
            let v = f32::from(i) / 255.0;
            assert!((linear_to_srgb(srgb_to_linear(v)) - v).abs() < 1e-6);
        }
        assert!((srgb_to_linear(0.5) - 0.214_041_14).abs() < 1e-7);
        assert_eq!(linear_to_srgb(1.0), 1.0);
    }
}
