//! A chain of cubes from sharp to blurred, packed into one atlas: level 0 at the left, all further levels in
//! a column to its right; levels of one size (a stack) in rows. Cubes with shared edges never read over their
//! border, so levels may touch and may have any size.

use crate::Part;
use crate::gpu::{Format, Level, Shape, Table};
use crate::shared::tables;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use steradian_prefilter::EdgeCube;
use steradian_prefilter::edge_cube::spacing;

/// Cubes from sharp to blurred.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain(Vec<EdgeCube>);

impl Chain {
    /// A chain of at least one cube; `None` for none.
    pub fn new(levels: Vec<EdgeCube>) -> Option<Self> {
        (!levels.is_empty()).then_some(Self(levels))
    }

    /// `cube` and its halves down to `least` intervals: box filtering by the spacing of each level (K06). A
    /// level's lookup has a standard deviation of half its spacing: 1/4 of the finer one's square from that
    /// level, 1/8 from the taps, 1/6 of its own from its interpolation.
    pub fn halved(cube: &EdgeCube, least: usize) -> Self {
        let mut levels = vec![cube.clone()];
        while let Some(fine) = levels.last()
            && fine.size() / 2 >= least.max(1)
        {
            let half = half(fine);
            levels.push(half);
        }
        Self(levels)
    }

    /// The cubes.
    pub fn levels(&self) -> &[EdgeCube] {
        &self.0
    }

    /// Number of the most blurred level.
    #[inline(always)]
    pub fn last(&self) -> f32 {
        (self.0.len() - 1) as f32
    }

    /// The two levels around a fractional level, and the weight of the second.
    #[inline(always)]
    pub fn around(&self, level: f32) -> (&EdgeCube, &EdgeCube, f32) {
        let last = self.0.len() - 1;
        let l = level.clamp(0.0, last as f32);
        let a = (l as usize).min(last);
        (&self.0[a], &self.0[(a + 1).min(last)], l - a as f32)
    }

    /// Position of each level in the atlas: x, y, size.
    pub fn places(&self) -> Vec<[u32; 3]> {
        let x = self.0[0].size() as u32 + 1;
        if self.0.iter().all(|c| c.size() as u32 + 1 == x) {
            // Levels of one size go in rows: in a single column, many would exceed the largest height of
            // textures.
            let row = (self.0.len() as f64).sqrt().ceil() as u32;
            return (0..self.0.len() as u32).map(|k| [k % row * x, k / row * x, x - 1]).collect();
        }
        let mut y = 0;
        let place = |(k, c): (usize, &EdgeCube)| {
            let n = c.size() as u32;
            if k == 0 {
                return [0, 0, n];
            }
            y += n + 1;
            [x, y - n - 1, n]
        };
        self.0.iter().enumerate().map(place).collect()
    }

    /// The chain as a GPU table.
    pub fn table(&self, name: &'static str) -> Table {
        let places = self.places();
        let width = places.iter().map(|p| p[0] + p[2] + 1).max().unwrap_or(1) as usize;
        let height = places.iter().map(|p| p[1] + p[2] + 1).max().unwrap_or(1) as usize;
        let mut texels = vec![[0.0f32; 4]; 6 * width * height];
        for (cube, p) in self.0.iter().zip(&places) {
            let n = cube.size() + 1;
            for (r, row) in cube.texels().chunks_exact(n).enumerate() {
                let at = (r / n * height + p[1] as usize + r % n) * width + p[0] as usize;
                texels[at..at + n].copy_from_slice(row);
            }
        }
        let level = Level { width, height, layers: 6, bytes: tables::texel_bytes(texels.iter()) };
        Table { name, shape: Shape::EdgeCubeChain(places), format: Format::Rgba32Float, level }
    }
}

/// Half as many intervals: each sample the mean of 3 × 3 lookups half a spacing apart, weighted 1 2 1.
fn half(fine: &EdgeCube) -> EdgeCube {
    let step = 0.5 * spacing(fine.size());
    EdgeCube::from_fn(fine.size() / 2, |d| {
        let (a, b) = d.any_orthonormal_pair();
        let mut sum = [0.0; 3];
        for (i, u) in [1.0, 2.0, 1.0].iter().enumerate() {
            for (j, v) in [1.0, 2.0, 1.0].iter().enumerate() {
                let at = d + a * (step * (i as f64 - 1.0)) + b * (step * (j as f64 - 1.0));
                let l = fine.sample(at.as_vec3().to_array());
                (0..3).for_each(|c| sum[c] += u * v / 16.0 * f64::from(l[c]));
            }
        }
        sum
    })
}

impl Part for Chain {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        put_f64(to, format!("{prefix}.levels"), vec![1], vec![self.0.len() as f64]);
        for (k, c) in self.0.iter().enumerate() {
            tables::save_cube(c, to, format!("{prefix}.level{k:02}"));
        }
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.levels");
        let (_, count) = get_f64(from, &name, 1)?;
        let count = match count[..] {
            [n] if (1.0..=100.0).contains(&n) => n as usize,
            _ => return Err(PartError::Unexpected(name)),
        };
        let cube = |k| tables::load_cube(from, &format!("{prefix}.level{k:02}"));
        let levels = (0..count).map(cube).collect::<Result<Vec<_>, _>>()?;
        Self::new(levels).ok_or(PartError::Unexpected(name))
    }

    fn bytes(&self) -> usize {
        self.0.iter().map(tables::cube_bytes).sum()
    }
}
