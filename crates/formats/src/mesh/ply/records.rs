//! One element after another, from text or bytes.

use super::build::Scratch;
use super::header::{Element, Property, Role, Type};

/// A body of a PLY file.
pub trait Records {
    /// Reads the next element into the scratch.
    fn record(&mut self, element: &Element, out: &mut Scratch) -> Result<(), String>;
    /// Bytes not read yet.
    fn bytes_left(&self) -> usize;
    /// Where we are, for errors.
    fn place(&self) -> String;
    /// All elements are read: a note where there is anything behind them.
    fn finish(&mut self) -> Result<Option<String>, String>;
}

/// A text body: one element a line.
pub struct Ascii<'a> {
    rest: &'a [u8],
    line: usize,
}

impl<'a> Ascii<'a> {
    /// The body after a header of `lines` lines.
    pub fn new(rest: &'a [u8], lines: usize) -> Self {
        Self { rest, line: lines }
    }

    /// The next line that is not blank.
    fn line(&mut self) -> Option<&'a [u8]> {
        while !self.rest.is_empty() {
            let end = self.rest.iter().position(|&b| b == b'\n').unwrap_or(self.rest.len());
            let line = self.rest[..end].trim_ascii();
            self.rest = self.rest.get(end + 1..).unwrap_or_default();
            self.line += 1;
            if !line.is_empty() {
                return Some(line);
            }
        }
        None
    }
}

impl Records for Ascii<'_> {
    fn record(&mut self, element: &Element, out: &mut Scratch) -> Result<(), String> {
        out.clear();
        if element.properties.is_empty() {
            return Ok(());
        }
        let line = self.line().ok_or("the file ends here (truncated?)")?;
        let mut words = line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
        for p in &element.properties {
            let mut next = |ty: Type| number(words.next().ok_or("the line is too short")?, ty);
            let Some(length) = p.length else {
                let value = next(p.item)?;
                out.value(p, value);
                continue;
            };
            let n = list_length(next(length)?)?;
            for _ in 0..n {
                let value = next(p.item)?;
                out.item(p, value)?;
            }
        }
        if words.next().is_some() { Err("the line is too long".into()) } else { Ok(()) }
    }

    fn bytes_left(&self) -> usize {
        self.rest.len()
    }

    fn place(&self) -> String {
        format!(", line {}", self.line)
    }

    fn finish(&mut self) -> Result<Option<String>, String> {
        match self.line() {
            Some(_) => Err(format!("line {}: more data than the header announces", self.line)),
            None => Ok(None),
        }
    }
}

/// A number of a text file. Integers may be written as floats ("255.0").
fn number(word: &[u8], ty: Type) -> Result<f64, String> {
    let text = std::str::from_utf8(word).unwrap_or("?");
    if !ty.is_float()
        && let Ok(i) = text.parse::<i64>()
    {
        return Ok(i as f64);
    }
    let value = if ty == Type::F32 { text.parse::<f32>().map(f64::from) } else { text.parse::<f64>() };
    value.map_err(|_| format!("{:?} is not a number", text.chars().take(40).collect::<String>()))
}

/// A list's length from its number.
fn list_length(n: f64) -> Result<usize, String> {
    if n >= 0.0 && n <= f64::from(u32::MAX) && n.fract() == 0.0 {
        Ok(n as usize)
    } else {
        Err(format!("{n} is not the length of a list"))
    }
}

/// A binary body.
pub struct Binary<'a> {
    rest: &'a [u8],
    big: bool,
}

impl<'a> Binary<'a> {
    /// The body, big endian or not.
    pub fn new(rest: &'a [u8], big: bool) -> Self {
        Self { rest, big }
    }

    fn take(&mut self, n: usize) -> Result<&'a [u8], String> {
        let (head, tail) = self.rest.split_at_checked(n).ok_or("the file ends here (truncated?)")?;
        self.rest = tail;
        Ok(head)
    }

    fn number(&mut self, ty: Type) -> Result<f64, String> {
        let bytes = self.take(ty.size())?;
        Ok(decode(bytes, ty, self.big))
    }

    fn list(&mut self, p: &Property, length: Type, out: &mut Scratch) -> Result<(), String> {
        let n = list_length(self.number(length)?)?;
        let size = p.item.size();
        let bytes = self.take(n.checked_mul(size).ok_or("a list is too long")?)?;
        if p.role != Role::Skip {
            return bytes.chunks_exact(size).try_for_each(|b| out.item(p, decode(b, p.item, self.big)));
        }
        Ok(())
    }
}

impl Records for Binary<'_> {
    fn record(&mut self, element: &Element, out: &mut Scratch) -> Result<(), String> {
        out.clear();
        for p in &element.properties {
            match p.length {
                Some(length) => self.list(p, length, out)?,
                None => {
                    let value = self.number(p.item)?;
                    out.value(p, value);
                }
            }
        }
        Ok(())
    }

    fn bytes_left(&self) -> usize {
        self.rest.len()
    }

    fn place(&self) -> String {
        String::new()
    }

    fn finish(&mut self) -> Result<Option<String>, String> {
        let left = self.rest.len();
        Ok((left > 0).then(|| format!("{left} bytes behind the last element were ignored")))
    }
}

/// The number in exactly `ty.size()` bytes.
fn decode(bytes: &[u8], ty: Type, big: bool) -> f64 {
    let mut raw = [0u8; 8];
    for (i, &b) in bytes.iter().enumerate() {
        raw[if big { bytes.len() - 1 - i } else { i }] = b;
    }
    let [a, b, c, d, ..] = raw;
    match ty {
        Type::I8 => f64::from(a as i8),
        Type::U8 => f64::from(a),
        Type::I16 => f64::from(i16::from_le_bytes([a, b])),
        Type::U16 => f64::from(u16::from_le_bytes([a, b])),
        Type::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
        Type::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
        Type::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
        Type::F64 => f64::from_le_bytes(raw),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_every_type_and_byte_order() {
        assert_eq!(decode(&[0xff], Type::I8, true), -1.0);
        assert_eq!(decode(&[0x01, 0x02], Type::U16, true), 258.0);
        assert_eq!(decode(&[0x01, 0x02], Type::U16, false), 513.0);
        assert_eq!(decode(&(-7i32).to_be_bytes(), Type::I32, true), -7.0);
        assert_eq!(decode(&u32::MAX.to_le_bytes(), Type::U32, false), 4294967295.0);
        assert_eq!(decode(&0.1f32.to_be_bytes(), Type::F32, true), f64::from(0.1f32));
        assert_eq!(decode(&0.1f64.to_be_bytes(), Type::F64, true), 0.1);
    }

    #[test]
    fn text_numbers() {
        assert_eq!(number(b"12", Type::U8), Ok(12.0));
        assert_eq!(number(b"12.0", Type::U8), Ok(12.0));
        assert!(number(b"twelve", Type::F32).is_err());
        assert!(list_length(-1.0).is_err() && list_length(0.5).is_err() && list_length(f64::NAN).is_err());
    }
}
