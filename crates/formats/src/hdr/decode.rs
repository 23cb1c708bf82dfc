//! Radiance pictures to planes.

use super::NEW_RLE;
use super::header::{Header, Orientation, Space, parse};
use crate::color::{self, RADIANCE, REC709};
use crate::{FormatError, Limits, Raster};
use std::path::Path;

/// Lumens per watt of white light in Radiance (`color.h`, `WHTEFFICACY`).
const WHTEFFICACY: f64 = 179.0;

/// Decodes the picture in `bytes`; `name` is for messages.
pub(crate) fn decode(name: &Path, bytes: &[u8], limits: &Limits) -> Result<Raster, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    let header = parse(bytes).map_err(invalid)?;
    let n = limits.image(name, header.width, header.height, 3, bytes.len() as u64)?;
    let (width, height) = (header.width as usize, header.height as usize);
    let mut planes = [vec![0f32; n], vec![0f32; n], vec![0f32; n]];
    let scale = scale_tables(&header);
    let (lines, length) = if header.orientation.rows { (height, width) } else { (width, height) };
    let mut input = Input { bytes, at: header.pixels_at };
    let mut scan = vec![[0u8; 4]; length];
    for j in 0..lines {
        scan_line(&mut input, &mut scan).map_err(|fault| invalid(fault.describe(j, lines, input.at)))?;
        place(&scan, j, header.orientation, width, height, &scale, &mut planes);
    }
    let mut raster = Raster::rgb(width, height, planes);
    raster.metadata.clone_from(&header.lines);
    to_rec709(&mut raster, &header).map_err(invalid)?;
    Ok(raster)
}

/// What may be wrong with a scan line.
enum Fault {
    Truncated,
    Length(usize),
    Overrun,
    NothingToRepeat,
}

impl Fault {
    fn describe(&self, line: usize, lines: usize, at: usize) -> String {
        let what = match self {
            Self::Truncated => format!("truncated: scan line {} of {lines} is incomplete", line + 1),
            Self::Length(n) => format!("scan line {} of {lines} says that it has {n} pixels", line + 1),
            Self::Overrun => format!("a run goes beyond scan line {} of {lines}", line + 1),
            Self::NothingToRepeat => format!("scan line {} of {lines} begins by repeating a pixel", line + 1),
        };
        format!("{what} (byte {at})")
    }
}

struct Input<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Input<'_> {
    fn take(&mut self, n: usize) -> Result<&[u8], Fault> {
        let piece = self.bytes.get(self.at..).and_then(|b| b.get(..n)).ok_or(Fault::Truncated)?;
        self.at += n;
        Ok(piece)
    }

    fn byte(&mut self) -> Result<u8, Fault> {
        Ok(self.take(1)?[0])
    }

    fn pixel(&mut self) -> Result<[u8; 4], Fault> {
        let b = self.take(4)?;
        Ok([b[0], b[1], b[2], b[3]])
    }
}

/// One scan line of any of the three kinds (`color.c`, `freadcolrs`).
fn scan_line(input: &mut Input<'_>, scan: &mut [[u8; 4]]) -> Result<(), Fault> {
    if !NEW_RLE.contains(&scan.len()) {
        return old_run_length(input, scan, 0);
    }
    let first = input.pixel()?;
    if first[0] != 2 || first[1] != 2 || first[2] & 128 != 0 {
        input.at -= 4;
        return old_run_length(input, scan, 0);
    }
    let length = usize::from(first[2]) << 8 | usize::from(first[3]);
    if length != scan.len() {
        return Err(Fault::Length(length));
    }
    (0..4).try_for_each(|component| new_run_length(input, scan, component))
}

/// The new kind: each component on its own, codes above 128 repeat one byte, others introduce literals.
fn new_run_length(input: &mut Input<'_>, scan: &mut [[u8; 4]], component: usize) -> Result<(), Fault> {
    let mut j = 0;
    while j < scan.len() {
        let code = usize::from(input.byte()?);
        let n = if code > 128 { code & 127 } else { code };
        let target = scan.get_mut(j..j + n).ok_or(Fault::Overrun)?;
        if code > 128 {
            let value = input.byte()?;
            target.iter_mut().for_each(|p| p[component] = value);
        } else {
            let literals = input.take(n)?;
            target.iter_mut().zip(literals).for_each(|(p, &v)| p[component] = v);
        }
        j += n;
    }
    Ok(())
}

/// Flat pixels and the old kind: a pixel (1, 1, 1, n) repeats the one before n times; each one that follows
/// directly counts 256 times as much (`color.c`, `oldreadcolrs`).
fn old_run_length(input: &mut Input<'_>, scan: &mut [[u8; 4]], start: usize) -> Result<(), Fault> {
    let mut j = start;
    let mut shift = 0;
    while j < scan.len() {
        let pixel = input.pixel()?;
        if pixel[..3] != [1, 1, 1] {
            scan[j] = pixel;
            (j, shift) = (j + 1, 0);
            continue;
        }
        let Some(before) = j.checked_sub(1) else { return Err(Fault::NothingToRepeat) };
        // Four repeats in a row already count beyond any image.
        let n = if shift > 24 { usize::from(pixel[3] > 0) << 32 } else { usize::from(pixel[3]) << shift };
        let value = scan[before];
        let end = j.checked_add(n).ok_or(Fault::Overrun)?;
        scan.get_mut(j..end).ok_or(Fault::Overrun)?.fill(value);
        (j, shift) = (end, shift + 8);
    }
    Ok(())
}

/// 2^(e − 136) over exposure and colour correction, per component and exponent; e = 0 gives zero.
fn scale_tables(header: &Header) -> [[f32; 256]; 3] {
    header.color_correction.map(|c| {
        let unit = match header.space {
            Space::Rgb => 1.0,
            Space::Xyz => 1.0 / WHTEFFICACY,
        };
        let by = unit / (header.exposure * c);
        std::array::from_fn(|e| if e == 0 { 0.0 } else { (by * 2f64.powi(e as i32 - 136)) as f32 })
    })
}

/// Puts scan line `j` where it belongs in the upright planes.
fn place(
    scan: &[[u8; 4]],
    j: usize,
    o: Orientation,
    width: usize,
    height: usize,
    scale: &[[f32; 256]; 3],
    planes: &mut [Vec<f32>; 3],
) {
    let value = |p: &[u8; 4], c: usize| (f32::from(p[c]) + 0.5) * scale[c][usize::from(p[3])];
    let (x, y) = if o.rows { (0, j) } else { (j, 0) };
    let x0 = if o.flip_x { width - 1 - x } else { x };
    let y0 = if o.flip_y { height - 1 - y } else { y };
    let (step, backwards) = if o.rows { (1, o.flip_x) } else { (width, o.flip_y) };
    let start = y0 * width + x0;
    for (c, plane) in planes.iter_mut().enumerate() {
        for (i, p) in scan.iter().enumerate() {
            let at = if backwards { start - i * step } else { start + i * step };
            plane[at] = value(p, c);
        }
    }
}

/// XYZ and foreign primaries become Rec. 709.
fn to_rec709(raster: &mut Raster, header: &Header) -> Result<(), String> {
    let matrix = match (header.space, header.primaries) {
        (Space::Xyz, _) => color::xyz_to_rec709(),
        (Space::Rgb, Some(p)) if !p.close(&REC709) && !p.close(&RADIANCE) => p.to_rec709(),
        _ => return Ok(()),
    };
    let matrix = matrix.ok_or("PRIMARIES span no colour space")?;
    color::transform(raster, &matrix);
    raster.metadata.push(("converted".into(), "to linear Rec. 709".into()));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode_text(head: &str, pixels: &[u8]) -> Result<Raster, FormatError> {
        let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n{head}\n").into_bytes();
        bytes.extend_from_slice(pixels);
        decode(Path::new("t.hdr"), &bytes, &Limits::default())
    }

    #[test]
    fn pixels_decode_at_the_middle_of_their_step() {
        let r = decode_text(
            "\n-Y 1 +X 3",
            &[&b"\n"[..], &[255, 128, 0, 136, 9, 9, 9, 0, 4, 4, 4, 1]].concat()[1..],
        );
        // The header's last newline is written by the helper.
        let r = r.unwrap();
        assert_eq!(r.channel("R").unwrap(), [255.5, 0.0, 4.5 * 2f32.powi(-135)]);
        assert_eq!(r.channel("G").unwrap(), [128.5, 0.0, 4.5 * 2f32.powi(-135)]);
        assert_eq!(r.channel("B").unwrap(), [0.5, 0.0, 4.5 * 2f32.powi(-135)]);
    }

    #[test]
    fn old_runs_shift_by_eight_bits() {
        // One pixel, then 1 + 1·256 repeats of it, then another pixel.
        let data = [10, 20, 30, 136, 1, 1, 1, 1, 1, 1, 1, 1, 7, 7, 7, 136];
        let r = decode_text("\n-Y 1 +X 259", &data).unwrap();
        let red = r.channel("R").unwrap();
        assert!(red[..258].iter().all(|&v| v == 10.5));
        assert_eq!(red[258], 7.5);
    }

    #[test]
    fn new_runs_are_per_component() {
        let mut data = vec![2, 2, 0, 8];
        data.extend([128 + 8, 5]); // R: run
        data.extend([8, 0, 1, 2, 3, 4, 5, 6, 7]); // G: literals
        data.extend([4, 1, 1, 1, 1, 128 + 4, 2]); // B: both
        data.extend([128 + 8, 136]);
        let r = decode_text("\n-Y 1 +X 8", &data).unwrap();
        assert_eq!(r.channel("R").unwrap(), [5.5; 8]);
        assert_eq!(r.channel("G").unwrap(), [0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5]);
        assert_eq!(r.channel("B").unwrap(), [1.5, 1.5, 1.5, 1.5, 2.5, 2.5, 2.5, 2.5]);
    }

    #[test]
    fn orientations_turn_upright() {
        // Upright: rows (0 1 2) (3 4 5).
        let order = |v: [u8; 6]| v.map(|m| [m, m, m, 136]).concat();
        for (text, v) in [
            ("-Y 2 +X 3", [0, 1, 2, 3, 4, 5]),
            ("-Y 2 -X 3", [2, 1, 0, 5, 4, 3]),
            ("+Y 2 +X 3", [3, 4, 5, 0, 1, 2]),
            ("+Y 2 -X 3", [5, 4, 3, 2, 1, 0]),
            ("+X 3 -Y 2", [0, 3, 1, 4, 2, 5]),
            ("-X 3 -Y 2", [2, 5, 1, 4, 0, 3]),
            ("+X 3 +Y 2", [3, 0, 4, 1, 5, 2]),
            ("-X 3 +Y 2", [5, 2, 4, 1, 3, 0]),
        ] {
            // Mantissas 1 would read as repeats: shift them by 10.
            let r = decode_text(&format!("\n{text}"), &order(v.map(|m| m + 10))).unwrap();
            assert_eq!(r.channel("G").unwrap(), [10.5, 11.5, 12.5, 13.5, 14.5, 15.5], "{text}");
        }
    }

    #[test]
    fn exposure_and_correction_divide() {
        let r =
            decode_text("EXPOSURE=2\nEXPOSURE=4\nCOLORCORR=1 2 0.5\n\n-Y 1 +X 1", &[7, 7, 7, 136]).unwrap();
        let got: Vec<f32> = ["R", "G", "B"].map(|c| r.channel(c).unwrap()[0]).into();
        assert_eq!(got, [7.5 / 8.0, 7.5 / 16.0, 7.5 / 4.0]);
    }

    #[test]
    fn xyz_is_photometric() {
        // XYZ of D65 white with Y = 179·1.
        let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n".to_vec();
        bytes.extend([170, 179, 195, 136]);
        let r = decode(Path::new("t"), &bytes, &Limits::default()).unwrap();
        let want = color::apply(&color::xyz_to_rec709().unwrap(), [170.5 / 179., 179.5 / 179., 195.5 / 179.]);
        for (c, w) in ["R", "G", "B"].iter().zip(want) {
            let g = f64::from(r.channel(c).unwrap()[0]);
            assert!((g - w).abs() < 1e-5 && (g - 1.0).abs() < 0.02, "{c} {g} {w}");
        }
    }

    #[test]
    fn faults_are_named() {
        let why = |res: &str, data: &[u8]| decode_text(&format!("\n{res}"), data).unwrap_err().to_string();
        assert!(why("-Y 2 +X 1", &[1, 2, 3, 4]).contains("truncated: scan line 2 of 2"));
        assert!(why("-Y 1 +X 2", &[1, 1, 1, 2]).contains("begins by repeating"));
        assert!(why("-Y 1 +X 2", &[3, 1, 1, 2, 1, 1, 1, 9]).contains("beyond scan line 1"));
        assert!(why("-Y 1 +X 8", &[2, 2, 0, 9]).contains("says that it has 9 pixels"));
        assert!(why("-Y 1 +X 8", &[2, 2, 0, 8, 128 + 9, 1]).contains("beyond scan line"));
    }
}
