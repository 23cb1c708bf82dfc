//! Tables of points as comma-separated values: RFC 4180 (2005), with a header row, UTF-8, line ends of any
//! kind.
//!
//! Columns that nobody asks for pass through unchanged. Every fault names its line.

use crate::atomic::write_atomic;
use crate::image::read_bytes;
use crate::{FormatError, Limits};
use std::collections::HashSet;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Memory that a short field takes: the string and what it points to.
const BYTES_PER_FIELD: u128 = 56;
/// Memory that a row takes beside its fields.
const BYTES_PER_ROW: u128 = 64;

/// A header and rows of text.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CsvTable {
    /// Where the table comes from; for messages.
    pub name: PathBuf,
    /// Names of the columns.
    pub header: Vec<String>,
    /// Rows of as many fields as the header has.
    pub rows: Vec<Vec<String>>,
    /// The line (from 1) that each row begins at.
    pub lines: Vec<usize>,
}

/// Reads the table `path`.
pub fn read_csv(path: &Path, limits: &Limits) -> Result<CsvTable, FormatError> {
    decode_csv(path, &read_bytes(path, limits)?, limits)
}

/// Parses a table of points that lies in memory; `name` is for messages.
pub fn decode_csv(name: &Path, bytes: &[u8], limits: &Limits) -> Result<CsvTable, FormatError> {
    decode_csv_like(name, bytes, limits, "nx,ny,nz,vx,vy,vz")
}

/// Parses a table whose columns are `such_as` these; `name` and they are for messages.
pub fn decode_csv_like(
    name: &Path,
    bytes: &[u8],
    limits: &Limits,
    such_as: &str,
) -> Result<CsvTable, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let line = 1 + bytes[..e.valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        invalid(format!("line {line}: not UTF-8 text"))
    })?;
    let count = |ends: &[u8]| bytes.iter().filter(|b| ends.contains(b)).count() as u128 + 1;
    let needed = count(b",\n\r") * BYTES_PER_FIELD + count(b"\n\r") * BYTES_PER_ROW;
    limits.memory(name, bytes.len() as u128 + needed, bytes.len() as u64)?;
    let mut records = Records { rest: text.strip_prefix('\u{feff}').unwrap_or(text), line: 1, fields: 1 };
    let Some((_, header)) = records.next().transpose().map_err(invalid)? else {
        return Err(invalid(format!("the file is empty; a header row is needed, such as {such_as}")));
    };
    let header: Vec<String> = header.iter().map(|h| h.trim().to_string()).collect();
    check_header(&header, such_as).map_err(invalid)?;
    records.fields = header.len();
    let mut table = CsvTable { name: name.into(), header, ..CsvTable::default() };
    for record in records {
        let (line, row) = record.map_err(invalid)?;
        if row.len() != table.header.len() {
            let why = format!("line {line}: {} fields, but the header has {}", row.len(), table.header.len());
            return Err(invalid(why));
        }
        table.rows.push(row);
        table.lines.push(line);
    }
    Ok(table)
}

fn check_header(header: &[String], such_as: &str) -> Result<(), String> {
    if header.iter().all(|h| h.parse::<f64>().is_ok()) {
        return Err(format!("line 1: numbers where the names of the columns should be, such as {such_as}"));
    }
    let mut seen = HashSet::new();
    for name in header {
        if !name.is_empty() && !seen.insert(name) {
            return Err(format!("line 1: two columns are called '{name}'"));
        }
    }
    Ok(())
}

/// Records of a text: line where each begins, and fields.
struct Records<'a> {
    rest: &'a str,
    line: usize,
    /// How many fields a record should have.
    fields: usize,
}

impl Iterator for Records<'_> {
    type Item = Result<(usize, Vec<String>), String>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if self.rest.is_empty() {
                return None;
            }
            let line = self.line;
            match self.record() {
                // An empty line is no record.
                Ok(fields) if fields.len() == 1 && fields[0].trim().is_empty() => {}
                Ok(fields) => return Some(Ok((line, fields))),
                Err(why) => {
                    self.rest = "";
                    return Some(Err(format!("line {line}: {why}")));
                }
            }
        }
    }
}

impl Records<'_> {
    fn record(&mut self) -> Result<Vec<String>, &'static str> {
        let mut fields = Vec::with_capacity(self.fields);
        loop {
            fields.push(if self.rest.starts_with('"') { self.quoted()? } else { self.plain() });
            match self.rest.as_bytes().first() {
                Some(b',') => self.rest = &self.rest[1..],
                Some(b'\r' | b'\n') => {
                    let end = if self.rest.starts_with("\r\n") { 2 } else { 1 };
                    self.rest = &self.rest[end..];
                    self.line += 1;
                    return Ok(fields);
                }
                Some(_) => return Err("text after a closing quote"),
                None => return Ok(fields),
            }
        }
    }

    fn plain(&mut self) -> String {
        let end = self.rest.find([',', '\r', '\n']).unwrap_or(self.rest.len());
        let (field, rest) = self.rest.split_at(end);
        self.rest = rest;
        field.into()
    }

    fn quoted(&mut self) -> Result<String, &'static str> {
        let mut field = String::new();
        let mut rest = &self.rest[1..];
        loop {
            let (piece, after) = rest.split_once('"').ok_or("a quoted field does not end")?;
            field.push_str(piece);
            rest = after;
            match rest.strip_prefix('"') {
                Some(more) => {
                    field.push('"');
                    rest = more;
                }
                None => break,
            }
        }
        self.line += field.matches('\n').count();
        self.rest = rest;
        Ok(field)
    }
}

impl CsvTable {
    /// The index of the column `name`.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|h| h == name)
    }

    /// The index of the column `name`, or an error that names it and those that exist.
    pub fn require(&self, name: &str) -> Result<usize, FormatError> {
        self.column(name).ok_or_else(|| {
            let why = format!("line 1: there is no column '{name}'; there is {}", self.header.join(","));
            FormatError::invalid(&self.name, why)
        })
    }

    /// The finite number in `row`, `column`.
    pub fn number(&self, row: usize, column: usize) -> Result<f64, FormatError> {
        let text = self.rows[row][column].trim();
        let value: Result<f64, _> = text.parse();
        match value {
            Ok(v) if v.is_finite() => Ok(v),
            Ok(_) => Err(self.fault(row, format!("{} is not finite", self.header[column]))),
            Err(_) => {
                let shown: String = text.chars().filter(|c| !c.is_control()).take(40).collect();
                Err(self.fault(row, format!("{} is '{shown}', not a number", self.header[column])))
            }
        }
    }

    /// The columns `names` as vectors, one per row.
    pub fn vectors<const N: usize>(&self, names: [&str; N]) -> Result<Vec<[f64; N]>, FormatError> {
        let mut columns = [0; N];
        for (c, name) in columns.iter_mut().zip(names) {
            *c = self.require(name)?;
        }
        let row = |i: usize| {
            let mut v = [0.0; N];
            for (x, &c) in v.iter_mut().zip(&columns) {
                *x = self.number(i, c)?;
            }
            Ok(v)
        };
        (0..self.rows.len()).map(row).collect()
    }

    /// An error about `row` that names its line.
    pub fn fault(&self, row: usize, why: impl std::fmt::Display) -> FormatError {
        let line = self.lines.get(row).copied().unwrap_or(row + 2);
        FormatError::invalid(&self.name, format!("line {line}: {why}"))
    }

    /// Sets the column `name` to numbers, one per row; each is written with the fewest digits that give it
    /// back. A column of this name is replaced.
    pub fn set_column(&mut self, name: &str, values: impl IntoIterator<Item = f64>) {
        let texts = values.into_iter().map(|v| v.to_string());
        match self.column(name) {
            Some(c) => self.rows.iter_mut().zip(texts).for_each(|(row, t)| row[c] = t),
            None => {
                self.header.push(name.into());
                self.rows.iter_mut().zip(texts).for_each(|(row, t)| row.push(t));
            }
        }
    }

    /// The table as text.
    pub fn text(&self) -> String {
        let mut bytes = Vec::new();
        // Writing to memory cannot fail, and what was read as UTF-8 stays it.
        let _ = self.encode(&mut bytes);
        String::from_utf8(bytes).unwrap_or_default()
    }

    /// Writes the table.
    pub fn encode(&self, w: &mut dyn Write) -> io::Result<()> {
        std::iter::once(&self.header).chain(&self.rows).try_for_each(|row| {
            for (i, field) in row.iter().enumerate() {
                if i > 0 {
                    w.write_all(b",")?;
                }
                write_field(w, field, row.len())?;
            }
            w.write_all(b"\n")
        })
    }
}

/// Quotes only where needed; a lone empty field would read as an empty line.
fn write_field(w: &mut dyn Write, field: &str, fields: usize) -> io::Result<()> {
    if field.contains([',', '"', '\n', '\r']) || (fields == 1 && field.trim().is_empty()) {
        write!(w, "\"{}\"", field.replace('"', "\"\""))
    } else {
        w.write_all(field.as_bytes())
    }
}

/// Writes the table to `path`, whole or not at all.
pub fn write_csv(path: &Path, table: &CsvTable) -> Result<(), FormatError> {
    write_atomic(path, |w| table.encode(w))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<CsvTable, FormatError> {
        decode_csv(Path::new("p.csv"), text.as_bytes(), &Limits::default())
    }

    fn text(table: &CsvTable) -> String {
        let mut out = Vec::new();
        table.encode(&mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn strange_columns_pass_through() {
        let source = "id,x,y,note\na, 1 ,2e-3,\"a \"\"b\"\", c\"\n,-0.5,7,\n";
        let mut t = parse(source).unwrap();
        assert_eq!(t.vectors(["x", "y"]).unwrap(), [[1.0, 0.002], [-0.5, 7.0]]);
        assert_eq!(text(&t), source);
        t.set_column("r", [0.1, 1e300]);
        t.set_column("x", [3.0, f64::MIN_POSITIVE]);
        let back = parse(&text(&t)).unwrap();
        assert_eq!(back.vectors(["x", "r"]).unwrap(), [[3.0, 0.1], [f64::MIN_POSITIVE, 1e300]]);
    }

    #[test]
    fn line_ends_marks_and_empty_lines_are_tolerated() {
        let t = parse("\u{feff}x,y\r\n1,2\r\n\r\n3,\"4\"").unwrap();
        assert_eq!(t.vectors(["y", "x"]).unwrap(), [[2.0, 1.0], [4.0, 3.0]]);
        assert_eq!(t.lines, [2, 4]);
    }

    #[test]
    fn faults_name_their_line() {
        let why = |s: &str| parse(s).and_then(|t| t.vectors(["x"]).map(|_| ())).unwrap_err().to_string();
        assert_eq!(why("x\n1\ntwo\n"), "p.csv: line 3: x is 'two', not a number");
        assert_eq!(why("x\n\"1\n\"\nNaN"), "p.csv: line 4: x is not finite");
        assert_eq!(why("x,y\n1\n"), "p.csv: line 2: 1 fields, but the header has 2");
        assert_eq!(why("a\n1\n"), "p.csv: line 1: there is no column 'x'; there is a");
        assert!(why("1,2\n").contains("names of the columns"));
        assert!(why("x,x\n1,1\n").contains("two columns"));
        assert!(why("x\n\"1\n").contains("does not end"));
        assert!(why("x\n\"1\"2\n").contains("after a closing quote"));
        assert!(why("").contains("empty"));
        let bytes = decode_csv(Path::new("p"), b"x\n\xff\n", &Limits::default());
        assert_eq!(bytes.unwrap_err().to_string(), "p: line 2: not UTF-8 text");
    }
}
