//! OBJ's three lists of vertex data, and the one list that they become.

use super::words;
use crate::mesh::Part;
use std::collections::HashMap;

/// Indices of one corner of a face; [`ABSENT`] where it names none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Corner {
    /// Into the positions.
    pub position: u32,
    /// Into the texture coordinates.
    pub uv: u32,
    /// Into the normals.
    pub normal: u32,
}

const ABSENT: u32 = u32::MAX;

/// The lists.
#[derive(Default)]
pub struct Vertices {
    /// `v`.
    pub positions: Vec<[f32; 3]>,
    colors: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
}

impl Vertices {
    /// `v x y z [w]` or `v x y z [w] r g b`.
    pub fn position(&mut self, rest: &[u8]) -> Result<(), String> {
        let (v, n) = numbers::<7>(rest)?;
        if n < 3 {
            return Err("a position needs three numbers".into());
        }
        if n >= 6 {
            self.colors.resize(self.positions.len(), [1.0; 3]);
            self.colors.push([v[n - 3], v[n - 2], v[n - 1]]);
        }
        self.positions.push([v[0], v[1], v[2]]);
        Ok(())
    }

    /// `vt u [v [w]]`; v is turned over.
    pub fn uv(&mut self, rest: &[u8]) -> Result<(), String> {
        let (v, n) = numbers::<3>(rest)?;
        if n < 1 {
            return Err("a texture coordinate needs a number".into());
        }
        self.uvs.push([v[0], 1.0 - v[1]]);
        Ok(())
    }

    /// `vn x y z`.
    pub fn normal(&mut self, rest: &[u8]) -> Result<(), String> {
        let (v, n) = numbers::<3>(rest)?;
        if n < 3 {
            return Err("a normal needs three numbers".into());
        }
        self.normals.push(v);
        Ok(())
    }

    /// `v`, `v/t`, `v//n` or `v/t/n`; counted from 1, or backwards from the latest if negative.
    pub fn corner(&self, word: &[u8]) -> Result<Corner, String> {
        let mut fields = word.split(|&b| b == b'/');
        let mut index = |count: usize, what: &str| match fields.next() {
            None | Some(b"") => Ok(ABSENT),
            Some(field) => resolve(field, count, what),
        };
        let corner = Corner {
            position: index(self.positions.len(), "vertex")?,
            uv: index(self.uvs.len(), "texture coordinate")?,
            normal: index(self.normals.len(), "normal")?,
        };
        if corner.position == ABSENT || fields.next().is_some() {
            return Err(format!("{:?} is not a corner of a face", String::from_utf8_lossy(word)));
        }
        Ok(corner)
    }

    /// One vertex for every combination of indices that occurs. Where faces name positions only, these are
    /// the vertices as they stand, used or not.
    pub fn unify(self, triangles: &[[Corner; 3]], part: &mut Part) {
        let corners = || triangles.iter().flatten();
        let with_uv = corners().any(|c| c.uv != ABSENT);
        let with_normal = corners().any(|c| c.normal != ABSENT);
        let mut colors = self.colors;
        if !colors.is_empty() {
            colors.resize(self.positions.len(), [1.0; 3]);
        }
        if !with_uv && !with_normal {
            part.triangles = triangles.iter().map(|t| t.map(|c| c.position)).collect();
            (part.positions, part.colors) = (self.positions, colors);
            return;
        }
        let mut numbers: HashMap<Corner, u32> = HashMap::new();
        let mut made: Vec<Corner> = Vec::new();
        let mut find = |c: Corner| {
            *numbers.entry(c).or_insert_with(|| {
                made.push(c);
                made.len() as u32 - 1
            })
        };
        part.triangles = triangles.iter().map(|t| t.map(&mut find)).collect();
        let corners = || made.iter();
        part.positions = corners().map(|c| self.positions[c.position as usize]).collect();
        if !colors.is_empty() {
            part.colors = corners().map(|c| colors[c.position as usize]).collect();
        }
        if with_uv {
            part.uvs = corners().map(|c| self.uvs.get(c.uv as usize).copied().unwrap_or_default()).collect();
        }
        if with_normal {
            let normal = |c: &Corner| self.normals.get(c.normal as usize).copied().unwrap_or_default();
            part.normals = corners().map(normal).collect();
        }
    }
}

/// A one-based or negative index into a list of `count`.
fn resolve(field: &[u8], count: usize, what: &str) -> Result<u32, String> {
    let text = String::from_utf8_lossy(field);
    let i: i64 = text.parse().map_err(|_| format!("{text:?} is not an index"))?;
    let zero_based = if i > 0 { i - 1 } else { i.saturating_add(count as i64) };
    if i == 0 || zero_based < 0 || zero_based >= count as i64 || zero_based >= i64::from(ABSENT) {
        return Err(format!("{what} index {i} after {count} of them"));
    }
    Ok(zero_based as u32)
}

/// Up to `N` finite numbers and how many there were.
fn numbers<const N: usize>(rest: &[u8]) -> Result<([f32; N], usize), String> {
    let mut out = [0.0; N];
    let mut n = 0;
    for word in words(rest).take(N) {
        let value: Option<f32> = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
        out[n] = value.ok_or_else(|| format!("{:?} is not a number", String::from_utf8_lossy(word)))?;
        if !out[n].is_finite() {
            return Err(format!("{:?} is not finite", String::from_utf8_lossy(word)));
        }
        n += 1;
    }
    Ok((out, n))
}
