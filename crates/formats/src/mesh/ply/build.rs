//! From elements to a mesh.

use super::header::{Element, Property, Role, Type};
use crate::FormatError;
use crate::mesh::{MeshData, Part, source::Source, triangulate::triangulate};

/// What one element holds.
#[derive(Default)]
pub struct Scratch {
    slots: [f64; 11],
    corners: Vec<f64>,
    /// Items of lists that may still be read.
    allowed: u64,
}

impl Scratch {
    /// Sets how many items the lists of the elements that follow may have in all.
    pub fn allow(&mut self, items: u64) {
        self.allowed = items;
    }

    /// Makes room for the next element.
    pub fn clear(&mut self) {
        self.corners.clear();
    }

    /// A single value.
    pub fn value(&mut self, p: &Property, value: f64) {
        if let Role::Slot(i) = p.role {
            self.slots[i] = match p.item {
                Type::U8 if i >= 8 => value / 255.0,
                Type::U16 if i >= 8 => value / 65535.0,
                _ => value,
            };
        }
    }

    /// An item of a list.
    pub fn item(&mut self, p: &Property, value: f64) -> Result<(), String> {
        if p.role != Role::Skip {
            self.allowed = self.allowed.checked_sub(1).ok_or("its lists exceed the memory limit")?;
            self.corners.push(value);
        }
        Ok(())
    }
}

/// The mesh so far.
#[derive(Default)]
pub struct Builder {
    scratch: Scratch,
    part: Part,
    /// Corners of all polygons and strips with their counts and kinds: triangles need every position first.
    corners: Vec<u32>,
    polygons: Vec<(u32, bool)>,
    has: [bool; 11],
}

/// In the corner list: a strip starts anew.
const RESTART: u32 = u32::MAX;

impl Builder {
    /// The element being read.
    pub fn scratch(&mut self) -> &mut Scratch {
        &mut self.scratch
    }

    /// Announces an element and allocates for it.
    pub fn reserve(&mut self, e: &Element, source: &mut Source) -> Result<(), FormatError> {
        for p in &e.properties {
            if let Role::Slot(i) = p.role {
                self.has[i] = true;
            }
        }
        if e.name == "vertex" {
            if !(self.has[0] && self.has[1] && self.has[2]) {
                return Err(source.fault("element vertex lacks x, y or z"));
            }
            source.spend(e.count, 44)?;
            self.part.positions.reserve_exact(e.count as usize);
        } else if e.properties.iter().any(|p| matches!(p.role, Role::Polygon | Role::Strip)) {
            source.spend(e.count, 40)?;
            self.polygons.reserve_exact(e.count as usize);
            self.corners.reserve(3 * e.count as usize);
        }
        Ok(())
    }

    /// Takes the element in the scratch.
    pub fn take(&mut self, e: &Element) -> Result<(), String> {
        if e.name == "vertex" { self.vertex() } else { self.polygon(e) }
    }

    fn vertex(&mut self) -> Result<(), String> {
        let s = self.scratch.slots.map(|v| v as f32);
        if s[..3].iter().any(|v| !v.is_finite()) {
            return Err("the position is not finite".into());
        }
        self.part.positions.push([s[0], s[1], s[2]]);
        // A normal or texture coordinate that is not a number is one that is missing.
        let finite = |v: &[f32]| v.iter().all(|x| x.is_finite());
        if self.has_all(3..6) {
            self.part.normals.push(if finite(&s[3..6]) { [s[3], s[4], s[5]] } else { [0.0; 3] });
        }
        if self.has_all(6..8) {
            self.part.uvs.push(if finite(&s[6..8]) { [s[6], 1.0 - s[7]] } else { [0.0; 2] });
        }
        if self.has_all(8..11) {
            self.part.colors.push(if finite(&s[8..11]) { [s[8], s[9], s[10]] } else { [0.0; 3] });
        }
        Ok(())
    }

    fn has_all(&self, range: std::ops::Range<usize>) -> bool {
        self.has[range].iter().all(|&h| h)
    }

    fn polygon(&mut self, e: &Element) -> Result<(), String> {
        let Some(strip) = e.properties.iter().find_map(|p| match p.role {
            Role::Polygon => Some(false),
            Role::Strip => Some(true),
            _ => None,
        }) else {
            return Ok(());
        };
        for &c in &self.scratch.corners {
            if strip && c == -1.0 {
                self.corners.push(RESTART);
            } else if c >= 0.0 && c < f64::from(RESTART) && c.fract() == 0.0 {
                self.corners.push(c as u32);
            } else {
                return Err(format!("{c} is not a vertex index"));
            }
        }
        self.polygons.push((self.scratch.corners.len() as u32, strip));
        Ok(())
    }

    /// Cuts the polygons into triangles.
    pub fn finish(mut self, source: &mut Source) -> Result<MeshData, FormatError> {
        let n = self.part.positions.len() as u32;
        if let Some(bad) = self.corners.iter().find(|&&c| c >= n && c != RESTART) {
            return Err(source.fault(format_args!("vertex index {bad} in a file of {n} vertices")));
        }
        if n == 0 {
            return Err(source.fault("contains no vertices"));
        }
        source.spend(self.corners.len() as u64, 12)?;
        let (mut at, mut points) = (0, Vec::new());
        let triangles = &mut self.part.triangles;
        for &(len, strip) in &self.polygons {
            let corners = &self.corners[at..at + len as usize];
            at += len as usize;
            if strip {
                corners.split(|&c| c == RESTART).for_each(|s| cut_strip(s, triangles));
            } else if let &[a, b, c] = corners {
                triangles.push([a, b, c]);
            } else {
                points.clear();
                points.extend(corners.iter().map(|&c| self.part.positions[c as usize]));
                triangulate(&points, |t| triangles.push(t.map(|i| corners[i])));
            }
        }
        Ok(MeshData { parts: vec![self.part], ..MeshData::default() })
    }
}

/// The triangles of a strip; every other one is wound the other way.
fn cut_strip(strip: &[u32], triangles: &mut Vec<[u32; 3]>) {
    for (i, w) in strip.windows(3).enumerate() {
        let (a, b, c) = (w[0], w[1], w[2]);
        if a != b && b != c && c != a {
            triangles.push(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
        }
    }
}
