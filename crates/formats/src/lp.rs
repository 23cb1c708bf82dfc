//! Light positions of a set of photographs for reflectance transformation imaging (`.lp`), as the fitters of
//! polynomial texture maps (Malzbender, Gelb & Wolters 2001) read them and Cultural Heritage Imaging's
//! RTIBuilder writes them.
//!
//! Text: the first line is the number of photographs, and each line after it is one of them, a file's name
//! and the position x, y, z of its light, parted by white space. The last three words of a line are the
//! position, so that names may contain spaces. Lines without a word are none. Plain data: positions are as
//! given (most files hold unit vectors), and the axes are the reader's.

use crate::atomic::write_atomic;
use crate::image::{not_empty, read_bytes};
use crate::{FormatError, Limits};
use std::path::Path;

/// Memory that a light takes beside its name.
const BYTES_PER_LIGHT: u128 = (size_of::<LightPosition>() + 16) as u128;

/// A photograph and the position of its light.
#[derive(Debug, Clone, PartialEq)]
pub struct LightPosition {
    /// The photograph's name as it stands in the file; it may hold folders.
    pub file: String,
    /// x, y, z: finite, and not all zero.
    pub position: [f64; 3],
}

/// Reads the list of light positions `path`.
pub fn read_lp(path: &Path, limits: &Limits) -> Result<Vec<LightPosition>, FormatError> {
    decode_lp(path, &read_bytes(path, limits)?, limits)
}

/// Parses a list of light positions that lies in memory; `name` is for messages. A file may end without a
/// line feed, so that a cut within the last number passes where what is left of it is a number.
pub fn decode_lp(name: &Path, bytes: &[u8], limits: &Limits) -> Result<Vec<LightPosition>, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    not_empty(name, bytes)?;
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let line = 1 + bytes[..e.valid_up_to()].iter().filter(|b| **b == b'\n').count();
        invalid(format!("line {line}: not UTF-8 text"))
    })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text.lines().enumerate().filter(|(_, l)| !trimmed(l).is_empty());
    let (at, first) = lines.next().ok_or_else(|| invalid("the file is empty".into()))?;
    let first = trimmed(first);
    let count: usize = first.parse().map_err(|_| {
        let first = shown(first);
        invalid(format!("line {}: '{first}' where the number of lights should be", at + 1))
    })?;
    let found = lines.clone().count();
    if count != found {
        return Err(invalid(format!("claims {count} lights and has {found} lines of them")));
    }
    if count == 0 {
        return Err(invalid("holds no light".into()));
    }
    limits.memory(name, bytes.len() as u128 + count as u128 * BYTES_PER_LIGHT, bytes.len() as u64)?;
    let mut lights = Vec::with_capacity(count);
    for (at, line) in lines {
        let light = LightPosition::of(line).map_err(|why| invalid(format!("line {}: {why}", at + 1)))?;
        lights.push(light);
    }
    Ok(lights)
}

/// The line, from 1, that light `k` of a list stands on.
pub fn line_of_light(list: &str, k: usize) -> Option<usize> {
    let mut lines = list.lines().enumerate().filter(|(_, l)| !trimmed(l).is_empty());
    lines.nth(k + 1).map(|(at, _)| at + 1)
}

impl LightPosition {
    fn of(line: &str) -> Result<Self, String> {
        let mut rest = trimmed(line);
        let mut position = [0.0; 3];
        for (v, axis) in position.iter_mut().zip(["x", "y", "z"]).rev() {
            let (before, word) = rest
                .rsplit_once(|c: char| c.is_ascii_whitespace())
                .ok_or("a line is a file's name and the position x y z of its light")?;
            *v = word.parse().map_err(|_| format!("{axis} is '{}', not a number", shown(word)))?;
            rest = trimmed(before);
        }
        let file = rest.to_string();
        let light = Self { file, position };
        light.check()?;
        Ok(light)
    }

    fn check(&self) -> Result<(), String> {
        if let Some(v) = self.position.iter().find(|v| !v.is_finite()) {
            return Err(format!("a position that is {v} is none"));
        }
        let [x, y, z] = self.position;
        match x * x + y * y + z * z {
            0.0 if x == 0.0 && y == 0.0 && z == 0.0 => Err("a light at (0, 0, 0) has no direction".into()),
            l if l.is_normal() => Ok(()),
            _ => Err(format!("({x:e}, {y:e}, {z:e}) is too small or too large to have a direction")),
        }
    }
}

fn trimmed(text: &str) -> &str {
    text.trim_matches(|c: char| c.is_ascii_whitespace())
}

/// The beginning of a word, as a message quotes it.
fn shown(word: &str) -> String {
    word.chars().filter(|c| !c.is_control()).take(40).collect()
}

/// Writes a list of light positions, each number with the fewest digits that give it back.
pub fn write_lp(path: &Path, lights: &[LightPosition]) -> Result<(), FormatError> {
    let refuse = |why: String| FormatError::Unwritable { path: path.into(), why };
    if lights.is_empty() {
        return Err(refuse("there is no light".into()));
    }
    for (i, light) in lights.iter().enumerate() {
        light.check().map_err(|why| refuse(format!("light {i}: {why}")))?;
        let name = &light.file;
        if name.is_empty() || trimmed(name) != name || name.contains(char::is_control) {
            let name = shown(name);
            let why =
                format!("light {i}: '{name}' is empty, begins or ends with a space, or is of several lines");
            return Err(refuse(why));
        }
    }
    write_atomic(path, |w| {
        writeln!(w, "{}", lights.len())?;
        lights
            .iter()
            .try_for_each(|LightPosition { file, position: [x, y, z] }| writeln!(w, "{file} {x} {y} {z}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_testkit::Mutator;

    fn read(text: impl AsRef<[u8]>) -> Result<Vec<LightPosition>, FormatError> {
        decode_lp(Path::new("a.lp"), text.as_ref(), &Limits::default())
    }

    fn light(file: &str, position: [f64; 3]) -> LightPosition {
        LightPosition { file: file.into(), position }
    }

    #[test]
    fn names_may_have_spaces() {
        let text = "\u{feff}3\r\nimages/a 01.jpg 0.5 -0.25 0.75\r\n\r\nb.tif\t0  0 1\r\n  two  words 1 2 3 -4e-2 5 6";
        let lights = [
            light("images/a 01.jpg", [0.5, -0.25, 0.75]),
            light("b.tif", [0.0, 0.0, 1.0]),
            light("two  words 1 2 3", [-0.04, 5.0, 6.0]),
        ];
        assert_eq!(read(text).expect("valid"), lights);
    }

    #[test]
    fn faults_name_their_line() {
        let why = |text: &str| read(text).expect_err(text).to_string();
        assert_eq!(why(""), "a.lp: the file is empty");
        assert_eq!(why("\n \n"), "a.lp: the file is empty");
        let list = "2\n\na 0 0 1\nb 0 1 1\n";
        assert_eq!([0, 1, 2].map(|k| line_of_light(list, k)), [Some(3), Some(4), None]);
        assert_eq!(why("0\n"), "a.lp: holds no light");
        assert_eq!(why("a.jpg 0 0 1\n"), "a.lp: line 1: 'a.jpg 0 0 1' where the number of lights should be");
        assert_eq!(why("-1\na 0 0 1\n"), "a.lp: line 1: '-1' where the number of lights should be");
        assert_eq!(why("2\na 0 0 1\n"), "a.lp: claims 2 lights and has 1 lines of them");
        assert_eq!(why("1\na 0 0 1\nb 0 0 1\n"), "a.lp: claims 1 lights and has 2 lines of them");
        assert_eq!(why("2147483648\na 0 0 1\n"), "a.lp: claims 2147483648 lights and has 1 lines of them");
        assert_eq!(why("1\n\na 0 up 1\n"), "a.lp: line 3: y is 'up', not a number");
        assert_eq!(why("1\na 0 NaN 1\n"), "a.lp: line 2: a position that is NaN is none");
        assert_eq!(why("1\na 0 -inf 1\n"), "a.lp: line 2: a position that is -inf is none");
        assert_eq!(why("1\na 0 -0 0\n"), "a.lp: line 2: a light at (0, 0, 0) has no direction");
        assert!(why("1\na 1e-200 0 0\n").contains("too small or too large"));
        assert!(why("1\na 1e200 0 0\n").contains("too small or too large"));
        assert!(why("1\n0 0 1\n").contains("line 2: a line is a file's name"));
        assert_eq!(read(b"1\n\xff 0 0 1\n").expect_err("bytes").to_string(), "a.lp: line 2: not UTF-8 text");
        let few = Limits { max_memory: 20, ..Limits::default() };
        let e = decode_lp(Path::new("a.lp"), b"1\na 0 0 1\n", &few).expect_err("memory");
        assert!(e.to_string().contains("`max-memory`"), "{e}");
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.lp");
        let lights = [light("a b.jpg", [0.1, -1e-30, 2.0 / 3.0]), light("ü/c.png", [1e100, 0.0, -0.0])];
        write_lp(&path, &lights).expect("written");
        assert_eq!(read_lp(&path, &Limits::default()).expect("valid"), lights);
        let one = [light("a.jpg", [0.0, 0.5, -1.0])];
        write_lp(&path, &one).expect("written");
        assert_eq!(std::fs::read_to_string(&path).expect("text"), "1\na.jpg 0 0.5 -1\n");
        let up = [0.0, 0.0, 1.0];
        for bad in [
            light("", up),
            light(" a", up),
            light("a\nb", up),
            light("a", [0.0; 3]),
            light("a", [f64::NAN, 0.0, 1.0]),
        ] {
            let e = write_lp(&path, &[bad]).expect_err("refused");
            assert!(e.exit_code() == 1 && e.to_string().lines().count() == 1, "{e}");
        }
        assert!(write_lp(&path, &[]).is_err());
    }

    #[test]
    fn cut_at_every_byte_and_damaged() {
        let text = "2\nimages/a 01.jpg 0.5 -0.25 0.75\nb.jpg 0 0.6 0.8\n";
        // The last number may lose digits; what is lost before it is missed.
        let most = text.len() - "0.8\n".len();
        for n in 0..text.len() {
            let result = read(&text[..n]);
            assert!(n > most || result.is_err(), "cut at {n}: {result:?}");
        }
        let mut damage = Mutator::new(3);
        let mut valid = 0;
        for _ in 0..20_000 {
            match read(damage.damage(text.as_bytes(), text.as_bytes())) {
                Ok(lights) => {
                    valid += 1;
                    assert!(lights.iter().all(|l| l.check().is_ok() && !l.file.is_empty()));
                }
                Err(e) => assert_eq!(e.to_string().lines().count(), 1, "{e}"),
            }
        }
        assert!(valid > 100, "{valid} of the copies are valid");
    }
}
