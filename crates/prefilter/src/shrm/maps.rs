//! The maps themselves.

use super::Grid;
use glam::DVec3;

/// Identifies a map: the term that it belongs to, as an index into those given to [`super::Plan::maps`], and
/// q with its sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Key {
    /// Place of the term.
    pub term: usize,
    /// +q: multiplied by √2 cos qφ_o when shading; −q: by √2 sin qφ_o; 0: by 1.
    pub q: i32,
}

/// B_q(α, β) of every term, in the order of the terms, +q before −q: planes of linear RGB, row-major over
/// [`Grid`].
#[derive(Debug, Clone, PartialEq)]
pub struct CoefficientMaps {
    /// Where the texels stand.
    pub grid: Grid,
    /// The key of each map.
    pub keys: Vec<Key>,
    /// Red, green and blue of each map, `grid.texels()` long.
    pub planes: Vec<[Vec<f32>; 3]>,
}

impl CoefficientMaps {
    /// The place of the map of a term and signed q.
    pub fn place(&self, term: usize, q: i32) -> Option<usize> {
        self.keys.iter().position(|k| *k == Key { term, q })
    }

    /// Bilinear lookup of a map in central direction `c`, relative to [`super::frame`] of `c`.
    pub fn sample(&self, map: usize, c: DVec3) -> [f64; 3] {
        let near = self.grid.bilinear(c);
        std::array::from_fn(|k| near.iter().map(|(at, w)| w * f64::from(self.planes[map][k][*at])).sum())
    }

    /// Bytes of all texels as f32.
    pub fn bytes(&self) -> usize {
        self.planes.len() * 3 * self.grid.texels() * size_of::<f32>()
    }
}

/// cos and sin factors a_q(φ): 1, √2 cos qφ or √2 sin |q|φ.
pub fn azimuth(q: i32, phi: f64) -> f64 {
    let turn = f64::from(q.unsigned_abs()) * phi;
    match q {
        0 => 1.0,
        q if q > 0 => std::f64::consts::SQRT_2 * turn.cos(),
        _ => std::f64::consts::SQRT_2 * turn.sin(),
    }
}
