//! Wavefront OBJ (Wavefront Technologies, Advanced Visualizer Manual, appendix B1) with its material
//! libraries.
//!
//! Read are `v` (with colours), `vt`, `vn`, `f` (negative indices too), `usemtl` and `mtllib`. Groups,
//! objects and smoothing groups leave no trace: the whole file is one part with a material per triangle.
//! Lines, points, curves and surfaces are left out.

mod mtl;
mod vertices;

use super::{MeshData, Part, source::Source, triangulate::triangulate};
use crate::FormatError;
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use vertices::{Corner, Vertices};

/// The file so far.
#[derive(Default)]
struct Reader {
    vertices: Vertices,
    triangles: Vec<[Corner; 3]>,
    /// Material of each triangle; [`NONE`] before the first `usemtl`.
    slots: Vec<u32>,
    current: u32,
    data: MeshData,
    names: HashMap<String, u32>,
    /// What `mtllib` named already.
    libraries: HashSet<String>,
    images: HashMap<String, usize>,
    left_out: u64,
    /// Scratch of one face.
    corners: Vec<Corner>,
    points: Vec<[f32; 3]>,
}

const NONE: u32 = u32::MAX;

/// Its corners, and what each of them may become as a vertex of its own.
const BYTES_PER_TRIANGLE: usize = 3 * 40;

/// Reads an OBJ file.
pub fn read(bytes: &[u8], source: &mut Source) -> Result<MeshData, FormatError> {
    let mut reader = Reader { current: NONE, ..Reader::default() };
    let mut lines = Lines { rest: bytes, number: 0 };
    while let Some((number, line)) = lines.next() {
        reader.line(&line, source).map_err(|why| match why {
            Stop::Line(why) => source.fault(format_args!("line {number}: {why}")),
            Stop::File(error) => error,
        })?;
    }
    reader.finish(source)
}

/// Why reading stops: something in this line, or in a file that it names.
enum Stop {
    Line(String),
    File(FormatError),
}

impl From<String> for Stop {
    fn from(why: String) -> Self {
        Self::Line(why)
    }
}

impl Reader {
    fn line(&mut self, line: &[u8], source: &mut Source) -> Result<(), Stop> {
        let line = line.split(|&b| b == b'#').next().unwrap_or_default().trim_ascii();
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (key, rest) = (&line[..end], line[end..].trim_ascii());
        if matches!(key, b"v" | b"vt" | b"vn") {
            // With a colour, and the growth of the list.
            source.spend(1, 2 * 24).map_err(Stop::File)?;
        }
        match key {
            b"v" => self.vertices.position(rest)?,
            b"vt" => self.vertices.uv(rest)?,
            b"vn" => self.vertices.normal(rest)?,
            b"f" => {
                let before = self.triangles.len();
                self.face(rest)?;
                let made = (self.triangles.len() - before) as u64;
                source.spend(made, BYTES_PER_TRIANGLE).map_err(Stop::File)?;
            }
            b"usemtl" => self.use_material(&String::from_utf8_lossy(rest), source).map_err(Stop::File)?,
            b"mtllib" => self.library(&String::from_utf8_lossy(rest), source).map_err(Stop::File)?,
            b"l" | b"p" | b"curv" | b"surf" => self.left_out += 1,
            _ => {}
        }
        Ok(())
    }

    fn face(&mut self, rest: &[u8]) -> Result<(), String> {
        self.corners.clear();
        for word in words(rest) {
            let corner = self.vertices.corner(word)?;
            self.corners.push(corner);
        }
        if self.corners.len() < 3 {
            return Err(format!("a face of {} corners", self.corners.len()));
        }
        if let &[a, b, c] = self.corners.as_slice() {
            self.triangles.push([a, b, c]);
        } else {
            self.points.clear();
            self.points.extend(self.corners.iter().map(|c| self.vertices.positions[c.position as usize]));
            triangulate(&self.points, |t| self.triangles.push(t.map(|i| self.corners[i])));
        }
        self.slots.resize(self.triangles.len(), self.current);
        Ok(())
    }

    fn use_material(&mut self, name: &str, source: &mut Source) -> Result<(), FormatError> {
        self.current = match self.names.get(name) {
            Some(known) => *known,
            None => mtl::declare(name, &mut self.data, &mut self.names, source)? as u32,
        };
        Ok(())
    }

    /// A material library: one file name, or several. A missing one is noted.
    fn library(&mut self, names: &str, source: &mut Source) -> Result<(), FormatError> {
        if !self.libraries.insert(names.into()) {
            return Ok(());
        }
        let single = source.read_reference(names);
        let read = match single {
            Err(FormatError::Unreadable { .. }) if names.contains(char::is_whitespace) => names
                .split_whitespace()
                .map(|n| source.read_reference(n).map(|b| (n.to_string(), b)))
                .collect::<Result<Vec<_>, _>>(),
            other => other.map(|b| vec![(names.to_string(), b)]),
        };
        match read {
            Ok(files) => {
                for (name, bytes) in files {
                    mtl::read(&name, &bytes, &mut self.data, &mut self.names, &mut self.images, source)?;
                }
                Ok(())
            }
            Err(FormatError::Unreadable { .. }) => {
                source.note(format!("material library {names:?} cannot be read: default materials"));
                Ok(())
            }
            Err(FormatError::Invalid { .. }) if !source.has_folder() => {
                source.note(format!("material library {names:?} is not read: default materials"));
                Ok(())
            }
            Err(e) => Err(e),
        }
    }

    fn finish(mut self, source: &mut Source) -> Result<MeshData, FormatError> {
        if self.left_out > 0 {
            source.note(format!("{} lines, points, curves or surfaces were left out", self.left_out));
        }
        let mut part = Part { materials: self.slots, ..Part::default() };
        self.vertices.unify(&self.triangles, &mut part);
        if part.materials.iter().all(|&s| s == NONE) {
            part.materials.clear();
            self.data.materials.clear();
            self.data.textures.clear();
        } else if part.materials.contains(&NONE) {
            let default = self.data.materials.len() as u32;
            self.data.materials.push(mtl::plain());
            part.materials.iter_mut().filter(|s| **s == NONE).for_each(|s| *s = default);
        }
        self.data.parts.push(part);
        Ok(self.data)
    }
}

/// Words of a line.
fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty())
}

/// The lines of a text; one that ends in a backslash goes on in the next.
struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
}

impl<'a> Lines<'a> {
    /// The number of the (first) line and its text.
    fn next(&mut self) -> Option<(usize, Cow<'a, [u8]>)> {
        let mut line = Cow::Borrowed(self.raw()?);
        let number = self.number;
        while line.trim_ascii_end().ends_with(b"\\") {
            let keep = line.trim_ascii_end().len() - 1;
            let joined = line.to_mut();
            joined.truncate(keep);
            let Some(more) = self.raw() else { break };
            joined.push(b' ');
            joined.extend_from_slice(more);
        }
        Some((number, line))
    }

    fn raw(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|&b| b == b'\n').unwrap_or(self.rest.len());
        let line = &self.rest[..end];
        self.rest = self.rest.get(end + 1..).unwrap_or_default();
        self.number += 1;
        Some(line)
    }
}
