//! BC6H: 4 × 4 texels of three half floats in 16 bytes, unsigned or signed (Khronos Data Format Specification
//! 1.3, section 20.2; Microsoft, *BC6H format*). No alpha: it reads as 1.
//!
//! Bit patterns of positive halves are nearly logarithmic, and blocks interpolate them: the encoder makes the
//! sum of squared differences of the patterns small, thus the relative error of every channel.

mod decode;
mod encode;
mod fit;
mod modes;
#[cfg(test)]
mod tests;

use crate::WriteReport;
use half::f16;
use steradian_parallel::prelude::*;

/// Bytes of a block.
pub(crate) const BLOCK: usize = 16;

/// Bytes of one image.
pub(crate) fn image_bytes(width: usize, height: usize) -> usize {
    width.div_ceil(4) * height.div_ceil(4) * BLOCK
}

/// Appends the blocks of an image, given as R G B A; blocks over the right and lower edge repeat the last
/// texels. What halves cannot hold, and negative values where there is no sign, are counted.
pub(crate) fn encode(
    rgba: &[f32],
    (width, height): (usize, usize),
    signed: bool,
    out: &mut Vec<u8>,
    report: &mut WriteReport,
) {
    if width == 0 || height == 0 {
        return;
    }
    let mut lost = WriteReport::default();
    let codes: Vec<[i32; 3]> =
        rgba.chunks_exact(4).map(|t| std::array::from_fn(|c| code(t[c], signed, &mut lost))).collect();
    report.merge(lost);
    let row = |j: usize| -> Vec<u8> {
        let texel = |i: usize, k: usize| {
            let (x, y) = ((4 * i + k % 4).min(width - 1), (4 * j + k / 4).min(height - 1));
            codes.get(y * width + x).copied().unwrap_or_default()
        };
        (0..width.div_ceil(4))
            .flat_map(|i| encode::block(&std::array::from_fn(|k| texel(i, k)), signed).to_le_bytes())
            .collect()
    };
    let rows: Vec<Vec<u8>> = (0..height.div_ceil(4)).into_par_iter().map(row).collect();
    rows.iter().for_each(|r| out.extend_from_slice(r));
}

/// The bits of the nearest half, with their sign.
fn code(v: f32, signed: bool, report: &mut WriteReport) -> i32 {
    if v < 0.0 && !signed {
        report.clip(v.into(), 0.0);
        return 0;
    }
    let h = f16::from_f32(v.abs());
    if h.is_infinite() {
        report.clip(v.abs().into(), f16::MAX.into());
    }
    if v != 0.0 && h == f16::ZERO {
        report.vanished += 1;
        report.lost += f64::from(v.abs());
    }
    let magnitude = i32::from(h.min(f16::MAX).to_bits());
    if v < 0.0 { -magnitude } else { magnitude }
}

/// The texels of an image as R G B A; `data` must be as long as [`image_bytes`] says.
pub(crate) fn decode(data: &[u8], (width, height): (usize, usize), signed: bool) -> Vec<f32> {
    let mut out = vec![0.0; width * height * 4];
    let across = width.div_ceil(4);
    let strips = out.par_chunks_mut((16 * width).max(1)).zip(data.par_chunks((across * BLOCK).max(1)));
    strips.for_each(|(strip, blocks)| {
        for (i, bytes) in blocks.chunks_exact(BLOCK).enumerate() {
            let mut le = [0; BLOCK];
            le.copy_from_slice(bytes);
            let texels = decode::block(u128::from_le_bytes(le), signed);
            for (k, rgb) in texels.iter().enumerate() {
                let (x, y) = (4 * i + k % 4, k / 4);
                let at = 4 * (y * width + x);
                if let Some(t) = strip.get_mut(at..at + 4).filter(|_| x < width) {
                    let [r, g, b] = rgb.map(|h| f16::from_bits(h).to_f32());
                    t.copy_from_slice(&[r, g, b, 1.0]);
                }
            }
        }
    });
    out
}
