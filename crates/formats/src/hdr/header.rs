//! The text before the pixels: information lines, an empty line, the resolution line.

use crate::color::Primaries;

/// What the pixels mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Space {
    Rgb,
    Xyz,
}

/// Everything that the header says.
#[derive(Debug)]
pub(super) struct Header {
    pub space: Space,
    /// Product of all EXPOSURE lines.
    pub exposure: f64,
    /// Product of all COLORCORR lines.
    pub color_correction: [f64; 3],
    pub primaries: Option<Primaries>,
    pub orientation: Orientation,
    /// Pixels per row of the upright image.
    pub width: u64,
    /// Rows of the upright image.
    pub height: u64,
    /// `NAME=value` lines as pairs, others under "comment".
    pub lines: Vec<(String, String)>,
    /// Where the pixels begin.
    pub pixels_at: usize,
}

/// How scan lines lie in the upright image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Orientation {
    /// Scan lines are rows (otherwise columns).
    pub rows: bool,
    /// Scan lines or pixels run leftwards (−X).
    pub flip_x: bool,
    /// Scan lines or pixels run upwards (+Y).
    pub flip_y: bool,
}

/// Lines longer than this belong to no picture.
const MAX_LINE: usize = 1 << 16;

/// Every program that touches a picture adds a line or two.
const MAX_LINES: usize = 4096;

/// Parses the header; the error is one line.
pub(super) fn parse(bytes: &[u8]) -> Result<Header, String> {
    let mut at = 0;
    let mut header = Header {
        space: Space::Rgb,
        exposure: 1.0,
        color_correction: [1.0; 3],
        primaries: None,
        orientation: Orientation { rows: true, flip_x: false, flip_y: false },
        width: 0,
        height: 0,
        lines: Vec::new(),
        pixels_at: 0,
    };
    let magic = line(bytes, &mut at)?;
    if !magic.starts_with("#?") {
        return Err("not a Radiance picture: it does not begin with '#?'".into());
    }
    loop {
        let text = line(bytes, &mut at)?;
        if text.is_empty() {
            break;
        }
        if header.lines.len() == MAX_LINES {
            return Err(format!("the header has more than {MAX_LINES} lines"));
        }
        header.information(&text)?;
    }
    let resolution = line(bytes, &mut at)?;
    header.resolution(&resolution)?;
    header.pixels_at = at;
    Ok(header)
}

/// The next line without its end; a carriage return before the newline is dropped too.
fn line(bytes: &[u8], at: &mut usize) -> Result<String, String> {
    let rest = &bytes[*at..];
    let end = rest.iter().take(MAX_LINE).position(|&b| b == b'\n').ok_or_else(|| {
        if rest.len() > MAX_LINE { "a header line is too long" } else { "the header is truncated" }
            .to_string()
    })?;
    *at += end + 1;
    let text = &rest[..end];
    Ok(String::from_utf8_lossy(text.strip_suffix(b"\r").unwrap_or(text)).into_owned())
}

impl Header {
    fn information(&mut self, text: &str) -> Result<(), String> {
        let Some((name, value)) = text.split_once('=').filter(|(n, _)| is_name(n)) else {
            self.lines.push(comment(text));
            return Ok(());
        };
        let (name, value) = (name.trim(), value.trim());
        match name {
            "FORMAT" => self.space = format(value)?,
            // Some programs write a line of zeros where they know nothing.
            "EXPOSURE" | "COLORCORR" | "PRIMARIES" if is_zeros(value) => {
                self.lines.push(("ignored".into(), format!("{name}={value}")));
                return Ok(());
            }
            "EXPOSURE" => self.exposure *= numbers::<1>(name, value)?[0],
            "COLORCORR" => {
                let c = numbers::<3>(name, value)?;
                for (a, b) in self.color_correction.iter_mut().zip(c) {
                    *a *= b;
                }
            }
            "PRIMARIES" => self.primaries = Some(primaries(value)?),
            _ => {}
        }
        self.lines.push((name.into(), value.into()));
        Ok(())
    }

    fn resolution(&mut self, text: &str) -> Result<(), String> {
        let fault = || format!("the resolution line is '{}', not like '-Y 512 +X 1024'", shown(text));
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        let [major, n_major, minor, n_minor] = words[..] else { return Err(fault()) };
        let size = |t: &str| t.parse::<u64>().ok().filter(|&n| n < 1 << 32).ok_or_else(fault);
        let (n_major, n_minor) = (size(n_major)?, size(n_minor)?);
        let rows = major.ends_with('Y');
        let (y, x) = if rows { (major, minor) } else { (minor, major) };
        let flip_y = match y {
            "-Y" => false,
            "+Y" => true,
            _ => return Err(fault()),
        };
        let flip_x = match x {
            "+X" => false,
            "-X" => true,
            _ => return Err(fault()),
        };
        self.orientation = Orientation { rows, flip_x, flip_y };
        (self.height, self.width) = if rows { (n_major, n_minor) } else { (n_minor, n_major) };
        Ok(())
    }
}

/// `# name: value`, as the writer makes it, is a pair; anything else is a comment.
fn comment(text: &str) -> (String, String) {
    let text = text.trim_start_matches(['#', ' ']).trim_end();
    match text.split_once(": ").filter(|(n, _)| is_name(n)) {
        Some((name, value)) => (name.into(), value.into()),
        None => ("comment".into(), text.into()),
    }
}

fn is_name(text: &str) -> bool {
    let t = text.trim();
    !t.is_empty() && !t.starts_with('#') && t.chars().all(|c| c.is_ascii_alphanumeric() || "_-.".contains(c))
}

fn format(value: &str) -> Result<Space, String> {
    match value {
        "32-bit_rle_rgbe" => Ok(Space::Rgb),
        "32-bit_rle_xyze" => Ok(Space::Xyz),
        _ => Err(format!("FORMAT is '{}'; 32-bit_rle_rgbe and 32-bit_rle_xyze are read", shown(value))),
    }
}

/// Nothing but zeros?
fn is_zeros(value: &str) -> bool {
    !value.is_empty() && value.split_ascii_whitespace().all(|w| w.parse() == Ok(0.0))
}

/// Exactly `N` positive finite numbers.
fn numbers<const N: usize>(name: &str, value: &str) -> Result<[f64; N], String> {
    let v: Vec<f64> = value.split_ascii_whitespace().map_while(|w| w.parse().ok()).collect();
    let ok = v.len() == N && v.iter().all(|x| x.is_finite() && *x > 0.0);
    let what = if N == 1 { "a positive number".into() } else { format!("{N} positive numbers") };
    let fault = || format!("{name} is '{}', not {what}", shown(value));
    if ok { v.try_into().map_err(|_| fault()) } else { Err(fault()) }
}

fn primaries(value: &str) -> Result<Primaries, String> {
    let v: Vec<f64> = value.split_ascii_whitespace().map_while(|w| w.parse().ok()).collect();
    let ok = v.len() == 8 && v.iter().all(|x| x.is_finite());
    if !ok {
        return Err(format!("PRIMARIES is '{}', not 8 chromaticities", shown(value)));
    }
    Ok(Primaries([[v[0], v[1]], [v[2], v[3]], [v[4], v[5]], [v[6], v[7]]]))
}

/// A foreign text short and printable enough for an error line.
fn shown(text: &str) -> String {
    text.chars().take(40).map(|c| if c.is_control() { '?' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(lines: &str, resolution: &str) -> Result<Header, String> {
        parse(format!("#?RADIANCE\n{lines}\n{resolution}\n").as_bytes())
    }

    #[test]
    fn factors_accumulate() {
        let h =
            header("EXPOSURE=2\nEXPOSURE= 0.25\nCOLORCORR=1 2 4\nCOLORCORR=2 2 2\n", "-Y 3 +X 5").unwrap();
        assert_eq!(h.exposure, 0.5);
        assert_eq!(h.color_correction, [2.0, 4.0, 8.0]);
        assert_eq!((h.width, h.height), (5, 3));
    }

    #[test]
    fn zeros_say_nothing() {
        let h = header("EXPOSURE=0\nPRIMARIES=0 0 0 0 0 0 0 0\nCOLORCORR=0 0 0\n", "-Y 3 +X 5").unwrap();
        assert_eq!((h.exposure, h.color_correction, h.primaries), (1.0, [1.0; 3], None));
        assert_eq!(h.lines[0], ("ignored".to_string(), "EXPOSURE=0".to_string()));
    }

    #[test]
    fn eight_orientations() {
        for (text, rows, flip_x, flip_y) in [
            ("-Y 2 +X 3", true, false, false),
            ("-Y 2 -X 3", true, true, false),
            ("+Y 2 +X 3", true, false, true),
            ("+Y 2 -X 3", true, true, true),
            ("+X 3 -Y 2", false, false, false),
            ("-X 3 -Y 2", false, true, false),
            ("+X 3 +Y 2", false, false, true),
            ("-X 3 +Y 2", false, true, true),
        ] {
            let h = header("", text).unwrap();
            assert_eq!(h.orientation, Orientation { rows, flip_x, flip_y }, "{text}");
            assert_eq!((h.width, h.height), (3, 2), "{text}");
        }
    }

    #[test]
    fn faults_are_named() {
        assert!(header("FORMAT=16-bit\n", "-Y 1 +X 1").unwrap_err().contains("FORMAT is '16-bit'"));
        assert!(header("EXPOSURE=-1\n", "-Y 1 +X 1").unwrap_err().contains("EXPOSURE"));
        assert!(header("EXPOSURE=NaN\n", "-Y 1 +X 1").unwrap_err().contains("EXPOSURE"));
        assert!(header("COLORCORR=1 2\n", "-Y 1 +X 1").unwrap_err().contains("COLORCORR"));
        for r in ["-Y 1 +Y 1", "-Y -1 +X 1", "-Y 99999999999 +X 1", "512 512", "-Z 1 +X 1"] {
            assert!(header("", r).unwrap_err().contains("resolution"), "{r}");
        }
        assert!(parse(b"#?RADIANCE\nFORMAT=32").unwrap_err().contains("truncated"));
    }
}
