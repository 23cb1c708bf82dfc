//! Packed texels: shared exponents, short floats, RGBD. Encoders count what does not fit.

use crate::WriteReport;

/// The largest value of RGB9E5: 511/512 · 2¹⁶.
pub const MAX_RGB9E5: f32 = 65408.0;
/// The largest value of an 11-bit float: 2¹⁵ (2 − 2⁻⁶).
pub const MAX_F11: f32 = 65024.0;
/// The largest value of a 10-bit float: 2¹⁵ (2 − 2⁻⁵).
pub const MAX_F10: f32 = 64512.0;

/// `v` within 0 … `max`; what is cut off is counted.
fn fit(v: f32, max: f32, report: &mut WriteReport) -> f32 {
    // NaN becomes 0, as the EXT_texture_shared_exponent specification has it.
    let c = v.max(0.0).min(max);
    if c != v {
        report.clip(v.into(), c.into());
    }
    c
}

/// Counts a value that was not zero and became zero.
fn note_lost(given: f32, code: u32, report: &mut WriteReport) {
    if given > 0.0 && code == 0 {
        report.vanished += 1;
        report.lost += f64::from(given);
    }
}

/// 2^e of a normal number.
#[inline(always)]
fn power(e: i32) -> f64 {
    f64::from_bits(((1023 + e) as u64) << 52)
}

/// `v` ≥ 0 rounded to nearest, ties to even, below 2³²: the sum has no bits for fractions.
#[inline(always)]
fn whole(v: f64) -> u32 {
    const UNIT: f64 = (1_u64 << 52) as f64;
    (v + UNIT).to_bits() as u32
}

/// E5B9G9R9: nine bits a channel, one exponent (Khronos EXT_texture_shared_exponent, section 3.8.x).
pub fn encode_rgb9e5(rgb: [f32; 3], report: &mut WriteReport) -> u32 {
    let rgb = rgb.map(|v| fit(v, MAX_RGB9E5, report));
    let max = rgb[0].max(rgb[1]).max(rgb[2]);
    // ⌊log2⌋ is the stored exponent of an f32; subnormals are far below the format's range.
    let log2 = (max.to_bits() >> 23) as i32 - 127;
    let mut exponent = log2.max(-16) + 16;
    // Halves go up, as the specification has it.
    if (f64::from(max) * power(24 - exponent) + 0.5) as u32 >= 512 {
        exponent += 1;
    }
    let scale = power(24 - exponent);
    let m = rgb.map(|v| (f64::from(v) * scale + 0.5) as u32);
    rgb.iter().zip(m).for_each(|(v, m)| note_lost(*v, m, report));
    m[0] | m[1] << 9 | m[2] << 18 | (exponent as u32) << 27
}

/// The colour of an E5B9G9R9 texel.
pub fn decode_rgb9e5(texel: u32) -> [f32; 3] {
    let unit = f64::from((texel >> 27) as i32 - 24).exp2();
    [0, 9, 18].map(|shift| (f64::from(texel >> shift & 511) * unit) as f32)
}

/// A positive value as a float of five exponent bits (bias 15) and `bits` mantissa bits, rounded to nearest.
fn encode_small(v: f32, bits: u32, max: f32, report: &mut WriteReport) -> u32 {
    let v = fit(v, max, report);
    let exponent = ((v.to_bits() >> 23) as i32 - 127).max(-14);
    // In units of the last place; a mantissa that rounds up carries into the exponent by itself.
    let m = whole(f64::from(v) * power(bits as i32 - exponent));
    // Normal values have m ≥ 2^bits, and with exponent −14 the same formula holds below.
    let code = (((exponent + 14) as u32) << bits) + m;
    note_lost(v, code, report);
    code
}

fn decode_small(code: u32, bits: u32) -> f32 {
    let (e, m) = (code >> bits, code & ((1 << bits) - 1));
    let fraction = f64::from(m) / f64::from(1 << bits);
    match e {
        0 => (fraction * f64::from(-14).exp2()) as f32,
        31 if m == 0 => f32::INFINITY,
        31 => f32::NAN,
        _ => ((1.0 + fraction) * f64::from(e as i32 - 15).exp2()) as f32,
    }
}

/// B10G11R11: 11 bits of red and green, 10 of blue, unsigned floats (Khronos Data Format Specification 1.3,
/// section 10.3 and 10.4).
pub fn encode_r11g11b10([r, g, b]: [f32; 3], report: &mut WriteReport) -> u32 {
    encode_small(r, 6, MAX_F11, report)
        | encode_small(g, 6, MAX_F11, report) << 11
        | encode_small(b, 5, MAX_F10, report) << 22
}

/// The colour of a B10G11R11 texel.
pub fn decode_r11g11b10(texel: u32) -> [f32; 3] {
    [decode_small(texel & 2047, 6), decode_small(texel >> 11 & 2047, 6), decode_small(texel >> 22, 5)]
}

/// A colour as it comes back from a Radiance picture (.hdr).
pub fn round_trip_rgbe(rgb: [f32; 3]) -> [f32; 3] {
    crate::hdr::round_trip(rgb)
}

/// The largest value of RGBD of eight bits.
pub const MAX_RGBD: f32 = 255.0;

/// RGBD of eight bits: value = rgb / a, where a is as large as the colour allows. Values reach 255.
pub fn encode_rgbd(rgb: [f32; 3], report: &mut WriteReport) -> [u8; 4] {
    let rgb = rgb.map(|v| fit(v, MAX_RGBD, report));
    let max = rgb[0].max(rgb[1]).max(rgb[2]);
    // ⌊255/max⌋ keeps rgb · a ≤ 1.
    let a = if max > 1.0 { (255.0 / max).floor().clamp(1.0, 255.0) } else { 255.0 };
    let m = rgb.map(|v| (v * a).round().min(255.0) as u8);
    rgb.iter().zip(m).for_each(|(v, m)| note_lost(*v, m.into(), report));
    [m[0], m[1], m[2], a as u8]
}

/// The colour of an RGBD texel; a = 0 counts as 1/255.
pub fn decode_rgbd([r, g, b, a]: [u8; 4]) -> [f32; 3] {
    [r, g, b].map(|v| f32::from(v) / f32::from(a.max(1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values() -> impl Iterator<Item = f32> {
        (0..4000).map(|k| (k as f32 * 0.008 - 16.0).exp2() * (1.0 + (k % 7) as f32 / 9.0))
    }

    #[test]
    fn shared_exponents_come_back_within_half_a_step() {
        for v in values().filter(|v| *v <= MAX_RGB9E5) {
            let mut r = WriteReport::default();
            let got = decode_rgb9e5(encode_rgb9e5([v, 0.25 * v, 0.0], &mut r));
            // The largest channel has at least 256 steps.
            assert!((got[0] - v).abs() <= v / 511.0 * 1.001 || v < 6.2e-5, "{v}: {got:?}");
            assert!((got[1] - 0.25 * v).abs() <= v / 511.0 * 1.001 || v < 6.2e-5, "{v}: {got:?}");
            assert_eq!((got[2], r.clipped), (0.0, 0));
        }
    }

    #[test]
    fn every_code_of_the_packed_formats_comes_back() {
        let mut r = WriteReport::default();
        for code in 0..31 << 6 {
            let texel = code | code << 11 | (code >> 1) << 22;
            assert_eq!(encode_r11g11b10(decode_r11g11b10(texel), &mut r), texel);
        }
        for exponent in 0..32u32 {
            for m in 256..512 {
                let texel = m | (511 - m) << 9 | 7 << 18 | exponent << 27;
                assert_eq!(encode_rgb9e5(decode_rgb9e5(texel), &mut r), texel);
            }
        }
        assert_eq!(r, WriteReport::default());
    }

    #[test]
    fn known_codes() {
        let mut r = WriteReport::default();
        // 1.0 is 256 · 2^(16 − 24).
        assert_eq!(encode_rgb9e5([1.0, 0.5, 0.0], &mut r), 256 | 128 << 9 | 16 << 27);
        assert_eq!(encode_r11g11b10([1.0, 2.0, 0.5], &mut r), 15 << 6 | 16 << 17 | 14 << 27);
        assert_eq!(decode_r11g11b10(0x3ff << 22 | 31 << 6)[0], f32::INFINITY);
        assert_eq!(encode_rgbd([0.5, 1.0, 0.0], &mut r), [128, 255, 0, 255]);
        assert_eq!(encode_rgbd([10.0, 5.0, 0.0], &mut r), [250, 125, 0, 25]);
        assert_eq!(r, WriteReport::default());
    }

    #[test]
    fn what_does_not_fit_is_counted() {
        let mut r = WriteReport::default();
        assert_eq!(decode_rgb9e5(encode_rgb9e5([1e6, -1.0, 0.0], &mut r))[0], MAX_RGB9E5);
        assert_eq!((r.clipped, r.vanished), (2, 0));
        assert!((r.lost - (1e6 - 65408.0 + 1.0)).abs() < 1e-6);
        let mut r = WriteReport::default();
        assert_eq!(decode_r11g11b10(encode_r11g11b10([1e6, 1e6, 1e6], &mut r)), [MAX_F11, MAX_F11, MAX_F10]);
        encode_r11g11b10([1e-9, 1.0, 1.0], &mut r);
        assert_eq!((r.clipped, r.vanished), (3, 1));
        let mut r = WriteReport::default();
        assert_eq!(decode_rgbd(encode_rgbd([300.0, 100.0, 0.001], &mut r))[0], 255.0);
        assert_eq!((r.clipped, r.vanished), (1, 1));
    }

    #[test]
    fn rgbd_keeps_the_colour_to_one_step() {
        for v in values().filter(|v| *v < 255.0) {
            let mut r = WriteReport::default();
            let got = decode_rgbd(encode_rgbd([v, 0.5 * v, 0.25 * v], &mut r));
            let step = (v.max(1.0) / 127.0).max(1.0 / 255.0);
            assert!((got[0] - v).abs() <= 0.51 * step, "{v}: {got:?}");
        }
    }
}
