//! Positions of each factor's unknowns: the samples of a cube with shared edges, or of a line.

use std::collections::{BTreeMap, BTreeSet};
use steradian_prefilter::edge_cube::{direction, face_position};

/// A sample of a factor and its weight in a lookup.
pub type Tap = (u32, f32);

/// The samples of an [`steradian_prefilter::EdgeCube`]; those that faces share are one unknown.
pub struct CubeGrid {
    size: usize,
    /// Texel to unknown.
    index: Vec<u32>,
    count: usize,
}

impl CubeGrid {
    /// `size` intervals per edge.
    pub fn new(size: usize) -> Self {
        let n = size + 1;
        let mut known = BTreeMap::new();
        let texel = |k: usize| {
            let d = direction(size, k / (n * n), k % n, k / n % n);
            let next = known.len() as u32;
            *known.entry(d.to_array().map(|x| (x + 0.0).to_bits())).or_insert(next)
        };
        let index: Vec<u32> = (0..6 * n * n).map(texel).collect();
        Self { size, index, count: known.len() }
    }

    /// Number of unknowns: 6 size² + 2.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Unknown of texel `k`, texels in the cube's order.
    pub fn unknown(&self, k: usize) -> usize {
        self.index[k] as usize
    }

    /// Number of texels.
    pub fn texels(&self) -> usize {
        self.index.len()
    }

    /// Texels and bilinear weights of a lookup towards `d`; the shader has the same.
    pub fn taps(&self, d: [f32; 3]) -> [Tap; 4] {
        let (face, s, t) = face_position(d);
        let last = self.size as f32;
        let (x, y) = (s.clamp(0.0, 1.0) * last, t.clamp(0.0, 1.0) * last);
        let (i, j) = ((x as usize).min(self.size - 1), (y as usize).min(self.size - 1));
        let (u, v) = (x - i as f32, y - j as f32);
        let n = self.size + 1;
        let at = |a: usize, b: usize| self.index[(face * n + j + b) * n + i + a];
        let (p, q) = (1.0 - u, 1.0 - v);
        [(at(0, 0), p * q), (at(1, 0), u * q), (at(0, 1), p * v), (at(1, 1), u * v)]
    }

    /// Each unknown's neighbours.
    pub fn neighbours(&self) -> Vec<BTreeSet<u32>> {
        let n = self.size + 1;
        let mut out = vec![BTreeSet::new(); self.count];
        for k in 0..self.index.len() {
            let (i, j) = (k % n, k / n % n);
            let mut link = |other: usize| {
                let (a, b) = (self.index[k], self.index[other]);
                out[a as usize].insert(b);
                out[b as usize].insert(a);
            };
            if i + 1 < n {
                link(k + 1);
            }
            if j + 1 < n {
                link(k + n);
            }
        }
        out
    }
}

/// Samples and weights of a lookup at `u` in [0, 1] in a line of `count` samples.
pub fn line_taps(count: usize, u: f32) -> [Tap; 2] {
    let x = u.clamp(0.0, 1.0) * (count - 1) as f32;
    let i = (x as usize).min(count - 2);
    let w = x - i as f32;
    [(i as u32, 1.0 - w), (i as u32 + 1, w)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_prefilter::{EdgeCube, probe};

    #[test]
    fn taps_are_the_cube_s_lookup() {
        let grid = CubeGrid::new(5);
        assert_eq!(grid.count(), 6 * 25 + 2);
        let value = |k: u32| f64::from(k % 17) - 3.0;
        let n = grid.texels();
        let texels = (0..n).map(|k| [value(grid.unknown(k) as u32) as f32, 0.0, 0.0, 1.0]).collect();
        let cube = EdgeCube::from_texels(5, texels).unwrap();
        for k in 0..500 {
            let d = probe::direction(k, 500).as_vec3().to_array();
            let sum: f64 = grid.taps(d).iter().map(|(k, w)| value(*k) * f64::from(*w)).sum();
            assert!((sum - f64::from(cube.sample(d)[0])).abs() < 1e-4);
        }
        // Corners have three neighbours, all others four.
        let three = grid.neighbours().iter().filter(|s| s.len() == 3).count();
        assert_eq!(three, 8);
    }
}
