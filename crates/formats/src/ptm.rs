//! Polynomial texture maps (`.ptm`), version 1.2: Malzbender, Gelb & Wolters 2001, "Polynomial Texture Maps",
//! and the report that describes the file, Malzbender, Wolters & Gelb 2001, "Polynomial Texture Map (.ptm)
//! File Format", HPL-2001-104.
//!
//! A texel is a biquadratic polynomial of the light's direction, whose components along the surface's tangent
//! and bitangent are (u, v) = (l·t, l·b):
//!
//! ```text
//! L(u, v) = a0 u² + a1 v² + a2 u v + a3 u + a4 v + a5
//! ```
//!
//! The header is text, its words parted by white space: `PTM_1.2`, the kind, width, height, six scales, six
//! biases (a0 to a5 each). After the line feed that ends it come bytes, the bottom row first:
//!
//! | kind | bytes |
//! |---|---|
//! | `PTM_FORMAT_LRGB` | one block of six coefficients a texel, which are luminance; one block of red, green and blue |
//! | `PTM_FORMAT_RGB` | three blocks of six coefficients a texel: red, green, blue |
//!
//! A coefficient is (byte − bias) · scale. The kinds that JPEG compresses, and `PTM_FORMAT_LUM`, are refused
//! by name. Plain data: in what unit the polynomials are (files of the usual fitters span 0 … 255) is the
//! reader's.

use crate::atomic::write_atomic;
use crate::image::{not_empty, read_bytes};
use crate::{FormatError, Limits};
use std::path::Path;
use steradian_parallel::prelude::*;

/// Longest word of a header.
const MAX_WORD: usize = 64;
/// Largest bias that is written: numbers of this size times a scale keep their steps in single precision.
const MAX_BIAS: f64 = (1 << 20) as f64;

/// Coefficients a0 … a5 of u², v², uv, u, v and 1.
pub type PtmCoefficients = [f32; 6];

/// A polynomial texture map. Rows run from the top to the bottom.
#[derive(Debug, Clone, PartialEq)]
pub struct Ptm {
    /// Width in texels.
    pub width: usize,
    /// Height in texels.
    pub height: usize,
    /// What its texels hold.
    pub texels: PtmTexels,
}

/// The texels of a polynomial texture map.
#[derive(Debug, Clone, PartialEq)]
pub enum PtmTexels {
    /// `PTM_FORMAT_LRGB`: a polynomial of luminance, and a colour that it scales.
    Lrgb {
        /// One polynomial a texel.
        luminance: Vec<PtmCoefficients>,
        /// Red, green, blue, as they stand in the file.
        color: Vec<[u8; 3]>,
    },
    /// `PTM_FORMAT_RGB`: a polynomial of red, of green and of blue.
    Rgb([Vec<PtmCoefficients>; 3]),
}

impl PtmTexels {
    /// The name of the kind in a file's header.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Lrgb { .. } => "PTM_FORMAT_LRGB",
            Self::Rgb(_) => "PTM_FORMAT_RGB",
        }
    }

    /// The polynomials by name: luminance, or red, green and blue.
    pub fn polynomials(&self) -> Vec<(&'static str, &[PtmCoefficients])> {
        match self {
            Self::Lrgb { luminance, .. } => vec![("luminance", luminance)],
            Self::Rgb([r, g, b]) => vec![("red", r), ("green", g), ("blue", b)],
        }
    }
}

/// Reads the polynomial texture map `path`.
pub fn read_ptm(path: &Path, limits: &Limits) -> Result<Ptm, FormatError> {
    decode_ptm(path, &read_bytes(path, limits)?, limits)
}

/// Decodes a polynomial texture map that lies in memory; `name` is for messages. Every coefficient is finite.
pub fn decode_ptm(name: &Path, bytes: &[u8], limits: &Limits) -> Result<Ptm, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    not_empty(name, bytes)?;
    let head = Header::of(bytes).map_err(invalid)?;
    // Coefficients of four bytes, and a colour of three.
    let (planes, bytes_per_texel) = if head.rgb { (18, 18) } else { (7, 9) };
    let n = limits.image(name, head.width, head.height, planes, bytes.len() as u64)?;
    let body = &bytes[head.end..];
    let needed = n as u128 * bytes_per_texel;
    if (body.len() as u128) < needed {
        return Err(invalid(format!("truncated: {} bytes of texels, {needed} are needed", body.len())));
    }
    if body.len() as u128 > needed {
        return Err(invalid(format!("{} bytes follow its texels", body.len() as u128 - needed)));
    }
    let width = head.width as usize;
    let values = head.values().map_err(invalid)?;
    let polynomials = |block: &[u8]| -> Vec<PtmCoefficients> {
        let mut all = Vec::with_capacity(n);
        for row in block.chunks_exact(6 * width).rev() {
            let texels = row.as_chunks::<6>().0.iter();
            all.extend(
                texels.map(|t| -> PtmCoefficients { std::array::from_fn(|k| values[k][usize::from(t[k])]) }),
            );
        }
        all
    };
    let texels = if head.rgb {
        PtmTexels::Rgb([0, 1, 2].map(|c| polynomials(&body[6 * n * c..6 * n * (c + 1)])))
    } else {
        let (coefficients, colors) = body.split_at(6 * n);
        let mut color = Vec::with_capacity(n);
        for row in colors.chunks_exact(3 * width).rev() {
            color.extend_from_slice(row.as_chunks::<3>().0);
        }
        PtmTexels::Lrgb { luminance: polynomials(coefficients), color }
    };
    Ok(Ptm { width, height: head.height as usize, texels })
}

struct Header {
    rgb: bool,
    width: u64,
    height: u64,
    scale: [f32; 6],
    bias: [f64; 6],
    /// Where the texels begin.
    end: usize,
}

impl Header {
    fn of(bytes: &[u8]) -> Result<Self, String> {
        let mut words = Words { bytes, at: 0 };
        match words.next("version")? {
            "PTM_1.2" => {}
            v if v.starts_with("PTM_") => return Err(format!("is of version {}; PTM_1.2 is read", shown(v))),
            _ => return Err("does not begin with PTM_1.2 as a polynomial texture map does".into()),
        }
        let rgb = match words.next("kind")? {
            "PTM_FORMAT_RGB" => true,
            "PTM_FORMAT_LRGB" => false,
            kind => {
                let kind = shown(kind);
                return Err(format!("is a {kind}; PTM_FORMAT_LRGB and PTM_FORMAT_RGB are read"));
            }
        };
        let width = words.size("width")?;
        let height = words.size("height")?;
        let mut scale = [0.0; 6];
        for (k, s) in scale.iter_mut().enumerate() {
            // Zero where the number is too small for single precision, infinite where it is too large.
            *s = words.number("scale", k)? as f32;
            if !s.is_finite() || *s == 0.0 {
                return Err(format!("the scale of a{k} is {s}, and no coefficient can be read with it"));
            }
        }
        let mut bias = [0.0; 6];
        for (k, b) in bias.iter_mut().enumerate() {
            *b = words.number("bias", k)?;
            if !b.is_finite() {
                return Err(format!("the bias of a{k} is {b}, and no coefficient can be read with it"));
            }
        }
        Ok(Self { rgb, width, height, scale, bias, end: words.end_of_line()? })
    }

    /// The value of every byte of every coefficient.
    fn values(&self) -> Result<[[f32; 256]; 6], String> {
        let mut all = [[0.0; 256]; 6];
        for (k, values) in all.iter_mut().enumerate() {
            for (byte, v) in values.iter_mut().enumerate() {
                *v = coefficient(byte as f64, self.bias[k], self.scale[k]);
                if !v.is_finite() {
                    return Err(format!("its scale and bias make a{k} infinite"));
                }
            }
        }
        Ok(all)
    }
}

fn coefficient(byte: f64, bias: f64, scale: f32) -> f32 {
    ((byte - bias) * f64::from(scale)) as f32
}

/// Words of a header.
struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Words<'a> {
    fn next(&mut self, what: &str) -> Result<&'a str, String> {
        let rest = &self.bytes[self.at..];
        let begin = rest.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(rest.len());
        let word = &rest[begin..];
        let length = word.iter().take(MAX_WORD + 1).position(u8::is_ascii_whitespace);
        // The last word of a header is followed by a line feed, so that none ends with the file.
        let length = match length {
            Some(n) => n,
            None if word.len() <= MAX_WORD => return Err(format!("is cut in its header, at the {what}")),
            None => return Err(format!("the {what} in its header is longer than {MAX_WORD} bytes")),
        };
        self.at += begin + length;
        std::str::from_utf8(&word[..length]).map_err(|_| format!("the {what} in its header is not text"))
    }

    fn size(&mut self, what: &str) -> Result<u64, String> {
        let word = self.next(what)?;
        word.parse().map_err(|_| format!("the {what} is '{}', not a number of texels", shown(word)))
    }

    fn number(&mut self, what: &str, k: usize) -> Result<f64, String> {
        let word = self.next(what)?;
        word.parse().map_err(|_| format!("the {what} of a{k} is '{}', not a number", shown(word)))
    }

    /// Where the texels begin: behind the next line feed, before which only white space may stand.
    fn end_of_line(&self) -> Result<usize, String> {
        let rest = &self.bytes[self.at..];
        match rest.iter().position(|b| !matches!(b, b' ' | b'\t' | b'\r')) {
            Some(n) if rest[n] == b'\n' => Ok(self.at + n + 1),
            Some(_) => Err("no line feed ends its header after the six biases".into()),
            None => Err("is cut at the end of its header".into()),
        }
    }
}

/// The beginning of a word, as a message quotes it.
fn shown(word: &str) -> String {
    word.chars().filter(|c| !c.is_control()).take(40).collect()
}

/// A polynomial texture map to be written, coefficient by coefficient. Rows run from the top to the bottom.
#[derive(Debug, Clone)]
pub struct PtmPlanes<'a> {
    /// Width in texels.
    pub width: usize,
    /// Height in texels.
    pub height: usize,
    /// a0 … a5 of luminance, or of red, of green and of blue.
    pub polynomials: Vec<[&'a [f32]; 6]>,
    /// The colour that luminance scales.
    pub color: Option<&'a [[u8; 3]]>,
}

/// Writes a polynomial texture map. Each coefficient gets the scale and the bias that its range over all
/// texels asks for; the six scales are returned, and no coefficient changes by more than half of its scale
/// (and the rounding of single precision).
pub fn write_ptm(path: &Path, ptm: &Ptm) -> Result<[f32; 6], FormatError> {
    let polynomials: Vec<&[PtmCoefficients]> = ptm.texels.polynomials().into_iter().map(|p| p.1).collect();
    let color = match &ptm.texels {
        PtmTexels::Lrgb { color, .. } => Some(&color[..]),
        PtmTexels::Rgb(_) => None,
    };
    let lengths = polynomials.iter().map(|p| p.len()).collect();
    let value = |channel: usize, k: usize, texel: usize| polynomials[channel][texel][k];
    write(path, Sides { width: ptm.width, height: ptm.height, lengths, color }, &value)
}

/// [`write_ptm`] of planes.
pub fn write_ptm_planes(path: &Path, ptm: &PtmPlanes<'_>) -> Result<[f32; 6], FormatError> {
    let all = &ptm.polynomials;
    let kind = if ptm.color.is_some() { 1 } else { 3 };
    if all.len() != kind {
        let why = format!("{} polynomials a texel where its kind has {kind}", all.len());
        return Err(FormatError::Unwritable { path: path.into(), why });
    }
    let lengths = all.iter().flatten().map(|p| p.len()).collect();
    let value = |channel: usize, k: usize, texel: usize| all[channel][k][texel];
    write(path, Sides { width: ptm.width, height: ptm.height, lengths, color: ptm.color }, &value)
}

/// What a map is beside its coefficients.
struct Sides<'a> {
    width: usize,
    height: usize,
    /// Texels of every plane of coefficients.
    lengths: Vec<usize>,
    color: Option<&'a [[u8; 3]]>,
}

/// Rows that are turned into bytes at a time, on all cores.
const ROWS: usize = 64;

/// Writes the map of which `value` gives a coefficient by channel, power and texel.
fn write(
    path: &Path,
    of: Sides<'_>,
    value: &(impl Fn(usize, usize, usize) -> f32 + Sync),
) -> Result<[f32; 6], FormatError> {
    let refuse = |why: String| FormatError::Unwritable { path: path.into(), why };
    let Sides { width, height, lengths, color } = of;
    let n = width.checked_mul(height).filter(|n| *n > 0);
    let n = n.ok_or_else(|| refuse(format!("{width} x {height} texels are no map")))?;
    if lengths.iter().any(|l| *l != n) || color.is_some_and(|c| c.len() != n) {
        return Err(refuse(format!("its planes do not hold {width} x {height} texels each")));
    }
    let channels = if color.is_some() { 1 } else { 3 };
    let steps: Vec<Option<Step>> = (0..6usize)
        .into_par_iter()
        .with_max_len(1)
        .map(|k| Step::of((0..channels).flat_map(|c| (0..n).map(move |t| value(c, k, t)))))
        .collect();
    if let Some(k) = steps.iter().position(|s| s.is_none()) {
        return Err(refuse(format!("a{k} is not finite, or too large to be written")));
    }
    let steps: [Step; 6] = std::array::from_fn(|k| steps[k].unwrap_or_default());
    let kind = if color.is_some() { "PTM_FORMAT_LRGB" } else { "PTM_FORMAT_RGB" };
    write_atomic(path, |w| {
        write!(w, "PTM_1.2\n{kind}\n{width}\n{height}\n")?;
        let line = |words: [String; 6]| words.join(" ") + "\n";
        w.write_all(line(steps.map(|s| s.scale.to_string())).as_bytes())?;
        w.write_all(line(steps.map(|s| s.bias.to_string())).as_bytes())?;
        for channel in 0..channels {
            let row = |y: usize| -> Vec<u8> {
                let mut bytes = vec![0; 6 * width];
                for (k, step) in steps.iter().enumerate() {
                    for (x, byte) in bytes[k..].iter_mut().step_by(6).enumerate() {
                        *byte = step.byte(value(channel, k, y * width + x));
                    }
                }
                bytes
            };
            for end in (1..=height).rev().step_by(ROWS) {
                let rows: Vec<Vec<u8>> = (end.saturating_sub(ROWS)..end).into_par_iter().map(row).collect();
                rows.iter().rev().try_for_each(|row| w.write_all(row))?;
            }
        }
        if let Some(color) = color {
            color.chunks_exact(width).rev().try_for_each(|row| w.write_all(row.as_flattened()))?;
        }
        Ok(())
    })?;
    Ok(steps.map(|s| s.scale))
}

/// How a coefficient becomes a byte.
#[derive(Debug, Clone, Copy, Default)]
struct Step {
    scale: f32,
    bias: i32,
}

impl Step {
    /// The step for a range of values; `None` where they are not finite or would not be once read.
    fn of(values: impl Iterator<Item = f32>) -> Option<Self> {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in values {
            if !v.is_finite() {
                return None;
            }
            (low, high) = (low.min(f64::from(v)), high.max(f64::from(v)));
        }
        let step = if low == high {
            // One value, exactly: the bytes 0 and 1 where zero is the bias, or 1 for what is negative.
            let scale = if low == 0.0 { 1.0 } else { low.abs() as f32 };
            Self { scale, bias: i32::from(low < 0.0) }
        } else {
            let largest = low.abs().max(high.abs());
            let wanted = ((high - low) / 255.0).max(largest / MAX_BIAS).max(f64::from(f32::MIN_POSITIVE));
            let mut scale = wanted as f32;
            if f64::from(scale) < wanted {
                scale = scale.next_up();
            }
            Self { scale, bias: (-low / f64::from(scale)).round() as i32 }
        };
        let finite = |byte: f64| coefficient(byte, f64::from(step.bias), step.scale).is_finite();
        (finite(0.0) && finite(255.0)).then_some(step)
    }

    fn byte(self, value: f32) -> u8 {
        let steps = f64::from(value) / f64::from(self.scale) + f64::from(self.bias);
        // Rounded without a call, which counts for photographs of many megapixels.
        (steps.clamp(0.0, 255.0) + 0.5) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_testkit::Mutator;

    const NAME: &str = "a.ptm";

    fn read(bytes: &[u8]) -> Result<Ptm, FormatError> {
        decode_ptm(Path::new(NAME), bytes, &Limits::default())
    }

    fn refused(bytes: &[u8], part: &str) {
        let e = read(bytes).expect_err(part);
        let text = e.to_string();
        assert!(text.starts_with("a.ptm: ") && text.contains(part) && e.exit_code() == 3, "{text}");
        assert_eq!(text.lines().count(), 1, "{text}");
    }

    const LRGB: &str = "PTM_1.2\nPTM_FORMAT_LRGB\n2\n2\n2 1 0.5 0.25 -1 16 \n10 0 0 128 255 0 \n";

    /// Two by two texels; the top left one is the third of the file.
    fn lrgb() -> Vec<u8> {
        let mut bytes = LRGB.as_bytes().to_vec();
        bytes.extend(0u8..24);
        bytes.extend(100u8..112);
        bytes
    }

    #[test]
    fn luminance_and_colour_of_a_small_file() {
        let ptm = read(&lrgb()).expect("valid");
        let PtmTexels::Lrgb { luminance, color } = &ptm.texels else { panic!("a polynomial of luminance") };
        assert_eq!((ptm.width, ptm.height, ptm.texels.kind()), (2, 2, "PTM_FORMAT_LRGB"));
        // The bytes 12 … 17 of the upper row, and 0 … 5 of the lower.
        assert_eq!(luminance[0], [4.0, 13.0, 7.0, -28.25, 239.0, 272.0]);
        assert_eq!(luminance[2], [-20.0, 1.0, 1.0, -31.25, 251.0, 80.0]);
        assert_eq!(luminance[3][0], -8.0);
        assert_eq!(color[..], [[106, 107, 108], [109, 110, 111], [100, 101, 102], [103, 104, 105]]);
    }

    #[test]
    fn red_green_and_blue_of_a_small_file() {
        // One line for width and height, one for scales and biases, as the format allows; ends of Windows.
        let mut bytes = b"PTM_1.2\r\nPTM_FORMAT_RGB\r\n1 2\r\n1 1 1 1 1 2 0 0 0 0 0 3\r\n".to_vec();
        bytes.extend(0u8..36);
        let ptm = read(&bytes).expect("valid");
        let PtmTexels::Rgb([r, g, b]) = &ptm.texels else { panic!("three polynomials") };
        assert_eq!((ptm.width, ptm.height), (1, 2));
        assert_eq!(r[..], [[6.0, 7.0, 8.0, 9.0, 10.0, 16.0], [0.0, 1.0, 2.0, 3.0, 4.0, 4.0]]);
        assert_eq!(g[1], [12.0, 13.0, 14.0, 15.0, 16.0, 28.0]);
        assert_eq!(b[0], [30.0, 31.0, 32.0, 33.0, 34.0, 64.0]);
        // A first byte that is white space is a byte all the same.
        let at = bytes.len() - 36;
        bytes[at..at + 2].copy_from_slice(b"\n ");
        let PtmTexels::Rgb([r, ..]) = read(&bytes).expect("valid").texels else {
            panic!("three polynomials")
        };
        assert_eq!(r[1][..2], [10.0, 32.0]);
    }

    fn with(from: &str, to: &str) -> Vec<u8> {
        let texels = &lrgb()[LRGB.len()..];
        [LRGB.replacen(from, to, 1).as_bytes(), texels].concat()
    }

    #[test]
    fn files_that_are_not_as_they_should_be() {
        refused(b"", "empty");
        refused(&with("PTM_1.2", "PTM_1.1"), "version PTM_1.1");
        refused(&with("PTM_1.2", "P6"), "does not begin with PTM_1.2");
        for kind in ["LUM", "JPEG_RGB", "JPEG_LRGB", "JPEGLS_RGB", "JPEGLS_LRGB"] {
            refused(&with("LRGB", kind), &format!("is a PTM_FORMAT_{kind}; "));
        }
        refused(&with("\n2\n2\n", "\n2\ntwo\n"), "the height is 'two', not a number of texels");
        refused(&with("\n2\n2\n", "\n-2\n2\n"), "the width is '-2'");
        refused(&with("\n2\n2\n", "\n0\n2\n"), "the image is empty");
        refused(&with("\n2\n2\n", "\n65536\n32768\n"), "decoding needs");
        refused(&with("\n2\n2\n", "\n2147483648\n1\n"), "pixels a side");
        refused(&with("\n2\n2\n", "\n18446744073709551616\n1\n"), "not a number of texels");
        refused(&with("\n2\n2\n", "\n100\n100\n"), "truncated: 36 bytes of texels, 90000 are needed");
        refused(&with("0.25", "NaN"), "the scale of a3 is NaN");
        refused(&with("0.25", "inf"), "the scale of a3 is inf");
        refused(&with("0.25", "0"), "the scale of a3 is 0");
        refused(&with("0.25", "1e-60"), "the scale of a3 is 0");
        refused(&with("0.25", "1e38"), "make a3 infinite");
        refused(&with("0.25", "x"), "the scale of a3 is 'x', not a number");
        refused(&with("128", "nan"), "the bias of a3 is NaN");
        refused(&with("128", "1e300"), "make a3 infinite");
        refused(&with("128", &"1".repeat(65)), "longer than 64 bytes");
        refused(&with(" 0 \n", " 0 7\n"), "no line feed ends its header");
        refused(&[&lrgb()[..], &[0, 0]].concat(), "2 bytes follow its texels");
        let few = Limits { max_memory: 111, ..Limits::default() };
        let e = decode_ptm(Path::new(NAME), &lrgb(), &few).expect_err("28 bytes a texel");
        assert!(e.to_string().contains("`max-memory`"), "{e}");
    }

    #[test]
    fn cut_at_every_byte() {
        let bytes = lrgb();
        for n in 0..bytes.len() {
            let e = read(&bytes[..n]).expect_err("cut").to_string();
            let parts = ["cut", "truncated", "empty"];
            assert!(parts.iter().any(|p| e.contains(p)) && e.lines().count() == 1, "{n}: {e}");
        }
    }

    #[test]
    fn damaged_copies_are_finite_or_refused() {
        let bytes = lrgb();
        let mut damage = Mutator::new(12);
        let mut valid = 0;
        for _ in 0..20_000 {
            match read(&damage.damage(&bytes, &bytes)) {
                Ok(ptm) => {
                    valid += 1;
                    let n = ptm.width * ptm.height;
                    for (_, p) in ptm.texels.polynomials() {
                        assert!(p.len() == n && p.iter().flatten().all(|v| v.is_finite()));
                    }
                }
                Err(e) => assert_eq!(e.to_string().lines().count(), 1, "{e}"),
            }
        }
        assert!(valid > 100, "{valid} of the copies are valid");
    }

    /// Numbers from a fixed seed, of very different ranges by coefficient.
    fn some(seed: u64, n: usize) -> Vec<PtmCoefficients> {
        let ranges =
            [(0.0, 1.0), (-3e-6, 2e-6), (-200.0, 255.0), (1000.0, 1000.5), (-7e20, -1e20), (5.0, 5.0)];
        let mut random = Mutator::new(seed);
        let mut one =
            |(low, high): (f64, f64)| (low + (high - low) * random.below(1000) as f64 / 999.0) as f32;
        let mut all: Vec<_> = (0..n).map(|_| ranges.map(&mut one)).collect();
        (all[0], all[n - 1]) = (ranges.map(|r| r.0 as f32), ranges.map(|r| r.1 as f32));
        all
    }

    fn round_trip(ptm: &Ptm) -> ([f32; 6], Ptm, Vec<u8>) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(NAME);
        let steps = write_ptm(&path, ptm).expect("written");
        let back = read_ptm(&path, &Limits::default()).expect("valid");
        (steps, back, std::fs::read(&path).expect("readable"))
    }

    #[test]
    fn what_is_written_is_read_within_half_a_step() {
        let (width, height) = (5, 3);
        let color = (0..15).map(|i| [i, 255 - i, 7]).collect();
        let maps = [
            PtmTexels::Lrgb { luminance: some(1, 15), color },
            PtmTexels::Rgb([some(2, 15), some(3, 15), some(4, 15)]),
        ];
        for texels in maps {
            let ptm = Ptm { width, height, texels };
            let (steps, back, bytes) = round_trip(&ptm);
            assert_eq!((back.width, back.height, back.texels.kind()), (5, 3, ptm.texels.kind()));
            if let (PtmTexels::Lrgb { color: a, .. }, PtmTexels::Lrgb { color: b, .. }) =
                (&ptm.texels, &back.texels)
            {
                assert_eq!(a, b);
            }
            for ((_, a), (_, b)) in ptm.texels.polynomials().into_iter().zip(back.texels.polynomials()) {
                for (a, b) in a.iter().zip(b) {
                    for k in 0..6 {
                        let most = 0.5 * steps[k] + a[k].abs() * f32::EPSILON;
                        assert!((a[k] - b[k]).abs() <= most, "a{k}: {} {} by {}", a[k], b[k], steps[k]);
                    }
                    // One value only, and it comes back exactly.
                    assert_eq!(b[5], 5.0);
                }
            }
            let planes: Vec<[Vec<f32>; 6]> = (ptm.texels.polynomials().into_iter())
                .map(|(_, p)| std::array::from_fn(|k| p.iter().map(|t| t[k]).collect()))
                .collect();
            let polynomials = planes.iter().map(|p| std::array::from_fn(|k| &p[k][..])).collect();
            let color = match &ptm.texels {
                PtmTexels::Lrgb { color, .. } => Some(&color[..]),
                PtmTexels::Rgb(_) => None,
            };
            let of = PtmPlanes { width, height, polynomials, color };
            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join(NAME);
            assert_eq!(write_ptm_planes(&path, &of).expect("written"), steps);
            assert_eq!(std::fs::read(&path).expect("readable"), bytes);
            assert!(write_ptm_planes(&path, &PtmPlanes { polynomials: Vec::new(), ..of }).is_err());
            // A step is the 255th part of the range, where numbers of single precision are as fine.
            assert!((steps[0] * 255.0 - 1.0).abs() < 1e-6 && steps[3] < 2e-3, "{steps:?}");
        }
    }

    #[test]
    fn values_on_the_steps_are_written_as_they_are() {
        let t = |a: f32| [a, -a, 0.0, 255.0 - a, -3.5, 1e-30];
        let luminance = vec![t(0.0), t(255.0), t(17.0), t(100.0)];
        let ptm =
            Ptm { width: 4, height: 1, texels: PtmTexels::Lrgb { luminance, color: vec![[1, 2, 3]; 4] } };
        let (_, back, bytes) = round_trip(&ptm);
        assert_eq!(back, ptm);
        let head =
            b"PTM_1.2\nPTM_FORMAT_LRGB\n4\n1\n1 1 1 1 3.5 0.000000000000000000000000000001\n0 255 0 0 1 0\n";
        let texels =
            [[0, 255, 0, 255, 0, 1], [255, 0, 0, 0, 0, 1], [17, 238, 0, 238, 0, 1], [100, 155, 0, 155, 0, 1]];
        let whole = [&head[..], texels.as_flattened(), &[1, 2, 3].repeat(4)].concat();
        assert!(bytes == whole, "{}", String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn extremes_of_single_precision() {
        let of = |values: &[f32]| {
            let luminance = values.iter().map(|v| [*v; 6]).collect();
            let texels = PtmTexels::Lrgb { luminance, color: vec![[0; 3]; values.len()] };
            Ptm { width: values.len(), height: 1, texels }
        };
        for values in [&[0.0, 1e-44][..], &[-1e-45, 1e-45], &[-1e38, 1e38], &[1.0, 1.0 + f32::EPSILON]] {
            let ptm = of(values);
            let (steps, back, _) = round_trip(&ptm);
            for (a, b) in values.iter().zip(back.texels.polynomials()[0].1) {
                assert!((a - b[0]).abs() <= 0.5 * steps[0] + a.abs() * f32::EPSILON, "{a} {b:?} {steps:?}");
            }
        }
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(NAME);
        let why = |ptm: &Ptm| {
            let e = write_ptm(&path, ptm).expect_err("refused");
            assert!(e.exit_code() == 1 && !path.exists(), "{e}");
            e.to_string()
        };
        assert!(why(&of(&[0.0, f32::NAN])).contains("a0 is not finite"));
        assert!(why(&of(&[f32::MIN, f32::INFINITY])).contains("a0 is not finite"));
        assert!(why(&of(&[f32::MAX])).contains("too large"));
        assert!(why(&of(&[])).contains("0 x 1 texels"));
        assert!(why(&Ptm { height: 2, ..of(&[1.0]) }).contains("1 x 2 texels each"));
    }
}
