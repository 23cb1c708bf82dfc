//! Truevision Targa (`.tga`), true-colour 24 and 32 bit and grey 8 bit, plain or run-length coded: TGA File
//! Format Specification 2.0 (1991). Normal maps still come in it. Colour-mapped and 16-bit files are refused.

use crate::image::ReadOptions;
use crate::ldr::Curve;
use crate::{Channel, FormatError, Raster};
use std::path::Path;

struct Header {
    run_length: bool,
    bytes_per_pixel: usize,
    width: usize,
    height: usize,
    right_to_left: bool,
    top_down: bool,
    pixels_at: usize,
}

/// The format has no magic number: the extension must say it.
pub(crate) fn is_tga(name: &Path) -> bool {
    name.extension().is_some_and(|e| e.eq_ignore_ascii_case("tga"))
}

/// Decodes the image in `bytes`; `name` is for messages.
pub(crate) fn decode(name: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Raster, FormatError> {
    let invalid = |why: &str| FormatError::invalid(name, why);
    let h = header(bytes).map_err(invalid)?;
    let k = h.bytes_per_pixel;
    let n = options.limits.image(name, h.width as u64, h.height as u64, k as u64, bytes.len() as u64)?;
    let data = pixels(&bytes[h.pixels_at..], &h, n).ok_or_else(|| invalid("the pixels are truncated"))?;
    let curve = Curve::of(8, options.data);
    // Stored as blue, green, red, alpha.
    let names: &[(&str, usize)] = match k {
        1 => &[("Y", 0)],
        3 => &[("R", 2), ("G", 1), ("B", 0)],
        _ => &[("R", 2), ("G", 1), ("B", 0), ("A", 3)],
    };
    let plane = |&(name, c): &(&str, usize)| {
        let mut plane = vec![0f32; n];
        for (i, p) in data.chunks_exact(k).enumerate() {
            let v = if name == "A" { f32::from(p[c]) / 255.0 } else { curve.get(u16::from(p[c])) };
            plane[h.upright(i)] = v;
        }
        Channel { name: name.into(), data: plane }
    };
    let channels = names.iter().map(plane).collect();
    Ok(Raster { width: h.width, height: h.height, channels, low_range: true, metadata: Vec::new() })
}

impl Header {
    /// Where stored pixel `i` lies in rows from the top.
    fn upright(&self, i: usize) -> usize {
        let (x, y) = (i % self.width, i / self.width);
        let x = if self.right_to_left { self.width - 1 - x } else { x };
        let y = if self.top_down { y } else { self.height - 1 - y };
        y * self.width + x
    }
}

fn header(bytes: &[u8]) -> Result<Header, &'static str> {
    let h = bytes.get(..18).ok_or("the header is truncated")?;
    let u16_at = |i: usize| usize::from(u16::from_le_bytes([h[i], h[i + 1]]));
    let (run_length, grey) = match h[2] {
        2 => (false, false),
        3 => (false, true),
        10 => (true, false),
        11 => (true, true),
        _ => return Err("only true-colour and grey Targa images are read"),
    };
    let bytes_per_pixel = match (grey, h[16]) {
        (true, 8) => 1,
        (false, 24) => 3,
        (false, 32) => 4,
        _ => return Err("only 8-bit grey, 24-bit and 32-bit Targa images are read"),
    };
    if h[1] != 0 {
        return Err("colour-mapped Targa images are not read");
    }
    let pixels_at = 18 + usize::from(h[0]);
    if pixels_at > bytes.len() {
        return Err("the header is truncated");
    }
    Ok(Header {
        run_length,
        bytes_per_pixel,
        width: u16_at(12),
        height: u16_at(14),
        right_to_left: h[17] & 16 != 0,
        top_down: h[17] & 32 != 0,
        pixels_at,
    })
}

/// `n` pixels, expanded. `None` where they end early.
fn pixels(data: &[u8], h: &Header, n: usize) -> Option<Vec<u8>> {
    let k = h.bytes_per_pixel;
    if !h.run_length {
        return Some(data.get(..n * k)?.to_vec());
    }
    let mut out = Vec::with_capacity(n * k);
    let mut at = 0;
    while out.len() < n * k {
        let code = usize::from(*data.get(at)?);
        let count = (code & 127) + 1;
        at += 1;
        if code & 128 != 0 {
            let pixel = data.get(at..at + k)?;
            (0..count).for_each(|_| out.extend_from_slice(pixel));
            at += k;
        } else {
            out.extend_from_slice(data.get(at..at + count * k)?);
            at += count * k;
        }
    }
    out.truncate(n * k);
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tga(kind: u8, bits: u8, descriptor: u8, pixels: &[u8]) -> Result<Raster, FormatError> {
        let mut b = vec![0u8; 18];
        (b[2], b[12], b[14], b[16], b[17]) = (kind, 2, 2, bits, descriptor);
        b.extend_from_slice(pixels);
        decode(Path::new("t.tga"), &b, &ReadOptions { data: true, ..ReadOptions::default() })
    }

    #[test]
    fn plain_runs_and_origins() {
        let p = [0, 0, 51, 0, 0, 102, 0, 0, 153, 0, 0, 255];
        let red = |r: Raster| r.channel("R").unwrap().iter().map(|v| (v * 5.0).round()).collect::<Vec<_>>();
        assert_eq!(red(tga(2, 24, 32, &p).unwrap()), [1., 2., 3., 5.]);
        assert_eq!(red(tga(2, 24, 0, &p).unwrap()), [3., 5., 1., 2.]);
        assert_eq!(red(tga(2, 24, 48, &p).unwrap()), [2., 1., 5., 3.]);
        assert_eq!(red(tga(10, 24, 32, &[130, 0, 0, 51, 0, 0, 0, 255]).unwrap()), [1., 1., 1., 5.]);
        assert!(tga(10, 24, 32, &[130, 0, 0]).is_err());
        assert!(tga(1, 8, 0, &[0; 4]).is_err());
    }

    #[test]
    fn alpha_is_kept() {
        let r = tga(2, 32, 32, &[1, 2, 3, 255].repeat(4)).unwrap();
        assert_eq!(r.channel("A").unwrap(), [1.0; 4]);
    }
}
