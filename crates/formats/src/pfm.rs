//! Portable float maps (`.pfm`): Debevec's `PF` (colour) and `Pf` (grey). Rows run from the bottom to the
//! top; a negative scale says little endian. The scale's size says how many units a value stands for, so
//! values are multiplied by it.

use crate::image::Planes;
use crate::{Channel, FormatError, Limits, Raster};
use std::io::{self, Write};
use std::path::Path;

/// Does `bytes` begin like a PFM?
pub(crate) fn is_pfm(bytes: &[u8]) -> bool {
    matches!(bytes, [b'P', b'F' | b'f', c, ..] if c.is_ascii_whitespace())
}

struct Header {
    names: &'static [&'static str],
    width: u64,
    height: u64,
    scale: f32,
    pixels_at: usize,
}

/// Decodes the map in `bytes`; `name` is for messages.
pub(crate) fn decode(name: &Path, bytes: &[u8], limits: &Limits) -> Result<Raster, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    let h = header(bytes).map_err(invalid)?;
    let k = h.names.len();
    let n = limits.image(name, h.width, h.height, k as u64, bytes.len() as u64)?;
    let (width, height) = (h.width as usize, h.height as usize);
    let data = &bytes[h.pixels_at..];
    if data.len() < 4 * k * n {
        let why = format!("truncated: {} bytes of pixels, {} are needed", data.len(), 4 * k * n);
        return Err(invalid(why));
    }
    let read = |b: [u8; 4]| if h.scale < 0.0 { f32::from_le_bytes(b) } else { f32::from_be_bytes(b) };
    let mut planes = vec![vec![0f32; n]; k];
    for (i, row) in data.chunks_exact(4 * k * width).take(height).enumerate() {
        let start = (height - 1 - i) * width;
        for (x, pixel) in row.chunks_exact(4 * k).enumerate() {
            for (plane, v) in planes.iter_mut().zip(pixel.chunks_exact(4)) {
                plane[start + x] = read([v[0], v[1], v[2], v[3]]) * h.scale.abs();
            }
        }
    }
    let channels =
        h.names.iter().zip(planes).map(|(name, data)| Channel { name: (*name).into(), data }).collect();
    Ok(Raster { width, height, channels, ..Raster::default() })
}

fn header(bytes: &[u8]) -> Result<Header, String> {
    let names: &[&str] = if bytes.starts_with(b"PF") { &["R", "G", "B"] } else { &["Y"] };
    let mut at = 2;
    let width = word(bytes, &mut at)?;
    let height = word(bytes, &mut at)?;
    let scale = word(bytes, &mut at)?;
    // Exactly one white space parts the header from the pixels; "\r\n" would be two, and is not written by
    // anyone.
    let pixels_at = at + 1;
    if pixels_at > bytes.len() {
        return Err("the header is truncated".into());
    }
    let size = |t: &str| t.parse::<u64>().ok().filter(|&n| n < 1 << 32);
    let (Some(width), Some(height)) = (size(width), size(height)) else {
        return Err("the header's size is not two whole numbers".into());
    };
    let scale = scale.parse::<f32>().ok().filter(|s| s.is_finite() && *s != 0.0);
    let scale = scale.ok_or("the header's scale is not a number other than zero")?;
    Ok(Header { names, width, height, scale, pixels_at })
}

/// The next word; `at` ends at the white space after it.
fn word<'a>(bytes: &'a [u8], at: &mut usize) -> Result<&'a str, String> {
    let truncated = || "the header is truncated".to_string();
    let start = *at + bytes[*at..].iter().position(|b| !b.is_ascii_whitespace()).ok_or_else(truncated)?;
    let length = bytes[start..].iter().take(64).position(u8::is_ascii_whitespace).ok_or_else(truncated)?;
    *at = start + length;
    std::str::from_utf8(&bytes[start..*at]).map_err(|_| "the header is not text".into())
}

/// Writes a little-endian map, grey where one plane serves as all three.
pub(crate) fn encode(w: &mut dyn Write, planes: &Planes<'_>) -> io::Result<()> {
    let (width, height) = (planes.width, planes.height);
    let rgb = planes.rgb();
    let (magic, planes) = if planes.grey { ("Pf", &rgb[..1]) } else { ("PF", &rgb[..]) };
    write!(w, "{magic}\n{width} {height}\n-1.0\n")?;
    let mut row = Vec::with_capacity(4 * planes.len() * width);
    for y in (0..height).rev() {
        row.clear();
        for i in y * width..(y + 1) * width {
            planes.iter().for_each(|p| row.extend(p[i].to_le_bytes()));
        }
        w.write_all(&row)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(head: &str, values: &[f32], big: bool) -> Result<Raster, FormatError> {
        let mut b = head.as_bytes().to_vec();
        values.iter().for_each(|v| b.extend(if big { v.to_be_bytes() } else { v.to_le_bytes() }));
        decode(Path::new("t.pfm"), &b, &Limits::default())
    }

    #[test]
    fn rows_run_upwards_and_both_endians_scale() {
        let r = read("Pf\n2 2\n-2.0\n", &[1., 2., 3., 4.], false).unwrap();
        assert_eq!(r.channel("Y").unwrap(), [6., 8., 2., 4.]);
        let r = read("PF 1 1 1\n", &[1., 2., 3.], true).unwrap();
        assert_eq!(r.into_rgb().unwrap(), [[1.], [2.], [3.]]);
    }

    #[test]
    fn faults_are_named() {
        let why = |h: &str| read(h, &[1.0], false).unwrap_err().to_string();
        assert!(why("PF\n1 1\n-1\n").contains("truncated: 4 bytes"));
        assert!(why("PF\n0 1\n-1\n").contains("empty"));
        assert!(why("PF\n1 1\n0\n").contains("scale"));
        assert!(why("PF\nx 1\n1\n").contains("size"));
        assert!(why("PF\n2147483648 2147483648\n-1\n").contains("beyond the limit"));
    }
}
