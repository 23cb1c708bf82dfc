//! Texel formats of texture containers, and levels in them.

use crate::WriteReport;
use crate::bc6h;
use crate::packed::{MAX_F10, MAX_RGB9E5, decode_r11g11b10, decode_rgb9e5, encode_r11g11b10, encode_rgb9e5};
use half::f16;

/// Texel formats that are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TexelFormat {
    /// Four 16-bit floats.
    Rgba16f,
    /// Four 32-bit floats.
    Rgba32f,
    /// E5B9G9R9: a shared exponent, no sign, no alpha; up to 65408.
    Rgb9e5,
    /// B10G11R11: unsigned short floats, no alpha; up to 64512.
    R11g11b10,
    /// BC6H, unsigned: blocks of 4 × 4 texels in 16 bytes, no alpha; up to 65504.
    Bc6h,
    /// BC6H, signed.
    Bc6hSigned,
}

impl TexelFormat {
    /// Every format.
    pub const ALL: [Self; 6] =
        [Self::Rgba16f, Self::Rgba32f, Self::Rgb9e5, Self::R11g11b10, Self::Bc6h, Self::Bc6hSigned];

    /// The name that commands and file names use.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rgba16f => "rgba16f",
            Self::Rgba32f => "rgba32f",
            Self::Rgb9e5 => "rgb9e5",
            Self::R11g11b10 => "r11g11b10",
            Self::Bc6h => "bc6h",
            Self::Bc6hSigned => "bc6h-signed",
        }
    }

    /// The format of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|f| f.name().eq_ignore_ascii_case(name))
    }

    /// The format of a name; the error lists the known ones.
    pub fn parse(name: &str) -> Result<Self, String> {
        Self::from_name(name)
            .ok_or_else(|| steradian_base::unknown("format", name, &Self::ALL.map(Self::name)))
    }

    /// Is each texel stored by itself?
    pub fn is_plain(self) -> bool {
        !matches!(self, Self::Bc6h | Self::Bc6hSigned)
    }

    /// The largest value that every channel holds; `None` for 32-bit floats.
    pub fn largest(self) -> Option<f32> {
        match self {
            Self::Rgba16f | Self::Bc6h | Self::Bc6hSigned => Some(f16::MAX.to_f32()),
            Self::Rgba32f => None,
            Self::Rgb9e5 => Some(MAX_RGB9E5),
            Self::R11g11b10 => Some(MAX_F10),
        }
    }

    /// Bytes of a texel, or of a block of 4 × 4.
    pub fn bytes(self) -> usize {
        match self {
            Self::Rgba16f => 8,
            Self::Rgba32f => 16,
            Self::Rgb9e5 | Self::R11g11b10 => 4,
            Self::Bc6h | Self::Bc6hSigned => bc6h::BLOCK,
        }
    }

    /// Bytes of an image.
    pub fn image_bytes(self, width: usize, height: usize) -> usize {
        if self.is_plain() { width * height * self.bytes() } else { bc6h::image_bytes(width, height) }
    }

    /// Images of `size`, given as R G B A, as they come back from a file of this format.
    pub fn round_trip(self, rgba: &[f32], size: (usize, usize)) -> Vec<f32> {
        let mut bytes = Vec::new();
        self.encode(rgba, size, &mut bytes, &mut WriteReport::default());
        self.decode(&bytes, size)
    }

    /// Appends images of `size`, given as R G B A; what does not fit is counted.
    pub(crate) fn encode(
        self,
        rgba: &[f32],
        size: (usize, usize),
        out: &mut Vec<u8>,
        report: &mut WriteReport,
    ) {
        if !self.is_plain() {
            let images = rgba.chunks((size.0 * size.1 * 4).max(1));
            images.for_each(|i| bc6h::encode(i, size, self == Self::Bc6hSigned, out, report));
            return;
        }
        out.reserve(rgba.len() / 4 * self.bytes());
        for t in rgba.chunks_exact(4) {
            let rgb = [t[0], t[1], t[2]];
            match self {
                Self::Rgba32f => t.iter().for_each(|v| out.extend(v.to_le_bytes())),
                Self::Rgba16f => t.iter().for_each(|&v| out.extend(half(v, report).to_le_bytes())),
                Self::Rgb9e5 => out.extend(encode_rgb9e5(rgb, report).to_le_bytes()),
                Self::R11g11b10 => out.extend(encode_r11g11b10(rgb, report).to_le_bytes()),
                Self::Bc6h | Self::Bc6hSigned => {}
            }
        }
    }

    /// Texels of images of `size` as R G B A.
    pub(crate) fn decode(self, data: &[u8], size: (usize, usize)) -> Vec<f32> {
        if !self.is_plain() {
            let images = data.chunks_exact(bc6h::image_bytes(size.0, size.1).max(1));
            return images.flat_map(|i| bc6h::decode(i, size, self == Self::Bc6hSigned)).collect();
        }
        let mut out = Vec::with_capacity(data.len() / self.bytes() * 4);
        for t in data.chunks_exact(self.bytes()) {
            let word = || u32::from_le_bytes([t[0], t[1], t[2], t[3]]);
            match self {
                Self::Rgba32f => {
                    out.extend(t.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])));
                }
                Self::Rgba16f => {
                    out.extend(t.chunks_exact(2).map(|b| f16::from_le_bytes([b[0], b[1]]).to_f32()));
                }
                Self::Rgb9e5 => out.extend(decode_rgb9e5(word()).into_iter().chain([1.0])),
                Self::R11g11b10 => out.extend(decode_r11g11b10(word()).into_iter().chain([1.0])),
                Self::Bc6h | Self::Bc6hSigned => {}
            }
        }
        out
    }
}

fn half(v: f32, report: &mut WriteReport) -> f16 {
    let h = f16::from_f32(v);
    if h.is_infinite() {
        let h = f16::MAX.copysign(h);
        report.clip(v.into(), h.into());
        return h;
    }
    if v > 0.0 && h == f16::ZERO {
        report.vanished += 1;
        report.lost += f64::from(v);
    }
    h
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_come_back_to_the_format_s_precision() {
        let rgba: Vec<f32> =
            (0..6 * 64).map(|i| if i % 4 == 3 { 1.0 } else { 1.0 + 0.01 * i as f32 }).collect();
        for (format, step) in [
            (TexelFormat::Rgba32f, 0.0),
            (TexelFormat::Rgba16f, 5e-4),
            (TexelFormat::Rgb9e5, 4e-3),
            (TexelFormat::R11g11b10, 2e-2),
            (TexelFormat::Bc6h, 2e-2),
        ] {
            let back = format.round_trip(&rgba, (4, 4));
            assert_eq!(back.len(), rgba.len());
            let worst = rgba.iter().zip(&back).map(|(a, b)| (a - b).abs() / a).fold(0.0, f32::max);
            assert!(worst <= step && (step == 0.0 || worst > 0.0), "{}: {worst}", format.name());
        }
    }
}
