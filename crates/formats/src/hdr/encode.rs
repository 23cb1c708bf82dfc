//! Planes to Radiance pictures.

use super::NEW_RLE;
use crate::image::{Planes, WriteReport};
use std::io::{self, Write};

/// Shortest run that is worth a run code (`color.c`, `MINRUN`).
const MIN_RUN: usize = 4;

/// Writes `planes` (three) with `metadata` as information lines.
pub(crate) fn encode(
    w: &mut dyn Write,
    planes: &Planes<'_>,
    metadata: &[(String, String)],
) -> io::Result<WriteReport> {
    let (width, height) = (planes.width, planes.height);
    let [r, g, b] = planes.rgb();
    w.write_all(b"#?RADIANCE\n")?;
    for (name, value) in metadata {
        writeln!(w, "# {}: {}", one_line(name), one_line(value))?;
    }
    write!(w, "FORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n")?;
    let mut report = WriteReport::default();
    let mut scan = vec![[0u8; 4]; width];
    let mut out = Vec::with_capacity(4 * width + 64);
    for y in 0..height {
        let row = y * width..(y + 1) * width;
        for (p, ((&r, &g), &b)) in
            scan.iter_mut().zip(r[row.clone()].iter().zip(&g[row.clone()]).zip(&b[row]))
        {
            *p = rgbe([r, g, b], &mut report);
        }
        out.clear();
        scan_line(&scan, &mut out);
        w.write_all(&out)?;
    }
    Ok(report)
}

/// A colour as it comes back from a .hdr file.
pub(crate) fn round_trip(rgb: [f32; 3]) -> [f32; 3] {
    let [r, g, b, e] = rgbe(rgb, &mut WriteReport::default());
    if e == 0 {
        return [0.0; 3];
    }
    [r, g, b].map(|m| ((f64::from(m) + 0.5) * 2f64.powi(i32::from(e) - 136)) as f32)
}

/// The pixel whose decoded value, (m + 0.5)·2^(e − 136), lies nearest to `rgb`. Negative values become zero
/// and values beyond the largest exponent become the largest pixel; both are counted.
fn rgbe(rgb: [f32; 3], report: &mut WriteReport) -> [u8; 4] {
    let mut v = rgb.map(f64::from);
    let largest = 255.5 * 2f64.powi(255 - 136);
    for x in &mut v {
        if *x < 0.0 {
            report.clip(*x, 0.0);
            *x = 0.0;
        } else if *x > largest {
            report.clip(*x, largest);
            *x = largest;
        }
    }
    let max = v[0].max(v[1]).max(v[2]);
    // The smallest pixel that is not zero is 0.5·2^−135; half of it rounds down to zero.
    if max < 2f64.powi(-137) {
        v.into_iter().filter(|x| *x > 0.0).for_each(|x| report.vanish(x));
        return [0; 4];
    }
    let e = (exponent(max) + 128).clamp(1, 255);
    let scale = 2f64.powi(136 - e);
    // floor(x·2^(136 − e)) is the step whose middle is nearest.
    let m = v.map(|x| (x * scale).min(255.0) as u8);
    [m[0], m[1], m[2], e as u8]
}

/// e with x = f·2^e, ½ ≤ f < 1, for positive normal x.
fn exponent(x: f64) -> i32 {
    ((x.to_bits() >> 52) & 0x7ff) as i32 - 1022
}

/// One scan line, run-length coded where the width allows.
fn scan_line(scan: &[[u8; 4]], out: &mut Vec<u8>) {
    if !NEW_RLE.contains(&scan.len()) {
        out.extend(scan.iter().flatten());
        return;
    }
    out.extend([2, 2, (scan.len() >> 8) as u8, (scan.len() & 255) as u8]);
    let mut component = vec![0u8; scan.len()];
    for c in 0..4 {
        component.iter_mut().zip(scan).for_each(|(v, p)| *v = p[c]);
        runs(&component, out);
    }
}

/// Codes above 128 repeat a byte, others introduce up to 128 literals.
fn runs(v: &[u8], out: &mut Vec<u8>) {
    let mut i = 0;
    let mut literals = 0;
    let flush = |from: usize, to: usize, out: &mut Vec<u8>| {
        for piece in v[from..to].chunks(128) {
            out.push(piece.len() as u8);
            out.extend(piece);
        }
    };
    while i < v.len() {
        let n = v[i..].iter().take(127).take_while(|&&b| b == v[i]).count();
        if n >= MIN_RUN {
            flush(literals, i, out);
            out.extend([128 + n as u8, v[i]]);
            literals = i + n;
        }
        i += n;
    }
    flush(literals, v.len(), out);
}

fn one_line(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn back(p: [u8; 4]) -> [f64; 3] {
        let s = if p[3] == 0 { 0.0 } else { 2f64.powi(i32::from(p[3]) - 136) };
        [p[0], p[1], p[2]].map(|m| if p[3] == 0 { 0.0 } else { (f64::from(m) + 0.5) * s })
    }

    #[test]
    fn every_pixel_comes_back_as_itself() {
        for e in [1u8, 2, 100, 136, 200, 255] {
            for m in 128..=255u8 {
                let p = [m, m / 2, 0, e];
                let v = back(p).map(|x| x as f32);
                let mut report = WriteReport::default();
                assert_eq!(rgbe(v, &mut report), p);
                assert_eq!(report.clipped, 0);
            }
        }
    }

    #[test]
    fn rounding_is_to_the_nearest() {
        let mut report = WriteReport::default();
        let mut x = 1e-30f32;
        while x < 1e30 {
            let p = rgbe([x, x * 0.37, x * 0.01], &mut report);
            for (got, want) in back(p).iter().zip([x, x * 0.37, x * 0.01]) {
                let step = 2f64.powi(i32::from(p[3]) - 136);
                assert!((got - f64::from(want)).abs() <= 0.5 * step, "{got} {want}");
            }
            x *= 1.37;
        }
        assert_eq!(report.clipped, 0);
        assert_eq!(report.vanished, 0);
        assert_eq!(rgbe([0.0, 2f32.powi(-138), 0.0], &mut report), [0; 4]);
        assert_eq!(report.vanished, 1);
    }

    #[test]
    fn what_clips_is_counted() {
        let mut report = WriteReport::default();
        assert_eq!(rgbe([-1.0, 0.0, f32::MAX], &mut report)[2..], [255, 255]);
        assert_eq!(report.clipped, 2);
        assert!(report.lost > 1.0);
    }

    #[test]
    fn runs_and_literals_alternate() {
        let mut out = Vec::new();
        runs(&[1, 2, 3, 3, 3, 3, 3, 4], &mut out);
        assert_eq!(out, [2, 1, 2, 133, 3, 1, 4]);
        out.clear();
        runs(&[7; 300], &mut out);
        assert_eq!(out, [255, 7, 255, 7, 174, 7]);
    }
}
