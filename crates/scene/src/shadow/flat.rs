//! Blockers as rows of numbers.

/// What blocks light, as rows of numbers of single precision; rows and triangles are numbered in them.
#[derive(Debug, Clone, PartialEq)]
pub enum Flat {
    /// A hierarchy of boxes in the order of a traversal that needs no stack.
    Rays {
        /// Lower corner, a number, upper corner, a number. Where the first number is positive, a ray that misses the box goes on at
        /// that row, else at the next one; where it is −n, the box holds n triangles from that of the second number on.
        boxes: Vec<[f32; 8]>,
        /// Three corners.
        triangles: Vec<[f32; 9]>,
    },
    /// Depth maps ([`super::ShadowMaps`]).
    Maps {
        /// Of each light: direction or position, and 1 for a position; columns of the axes (x and y of the map and towards the light),
        /// with the middle's x and y and half a side behind them; texels of a side, the number of the first texel (a cube's six
        /// faces follow each other), and 1 where the next row is a wider map of the same light.
        lights: Vec<[f32; 20]>,
        /// Depths, row after row.
        depths: Vec<f32>,
        /// Texels of a side of the square whose comparisons are averaged.
        taps: usize,
    },
}

impl Flat {
    /// Rows that single precision can number.
    pub(crate) const MOST: usize = 1 << 24;
}
