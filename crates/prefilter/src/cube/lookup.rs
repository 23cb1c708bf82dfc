//! Lookups of many directions in cubes at once: first the places of all, by arithmetic without branches that
//! compilers vectorise; then the four texels of each.

use super::EdgeCube;

/// Faces and face coordinates of `N` directions, as [`super::edge_cube::face_position`] gives them one by
/// one.
#[derive(Debug, Clone, Copy)]
pub struct Places<const N: usize> {
    face: [i32; N],
    s: [f32; N],
    t: [f32; N],
}

/// Cells of several directions in cubes of some sizes: index of the first texel, and position within the cell
/// in 0 … 1.
#[derive(Debug, Clone, Copy)]
pub struct LookupCells<const N: usize> {
    first: [i32; N],
    u: [f32; N],
    v: [f32; N],
}

impl<const N: usize> Places<N> {
    /// The cells of directions of any length, given as one array per component.
    #[inline(always)]
    pub fn new(d: &[[f32; N]; 3]) -> Self {
        let mut out = Self { face: [0; N], s: [0.0; N], t: [0.0; N] };
        for k in 0..N {
            let (x, y, z) = (d[0][k], d[1][k], d[2][k]);
            let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
            let (by_x, by_y) = ((ax >= ay) & (ax >= az), ay >= az);
            let m = if by_x {
                ax
            } else if by_y {
                ay
            } else {
                az
            };
            let s = if by_x {
                if x < 0.0 { z } else { -z }
            } else if by_y {
                x
            } else if z < 0.0 {
                -x
            } else {
                x
            };
            let t = if by_x {
                -y
            } else if by_y {
                if y < 0.0 { -z } else { z }
            } else {
                -y
            };
            let (first, along) = if by_x {
                (0, x)
            } else if by_y {
                (2, y)
            } else {
                (4, z)
            };
            let scale = 0.5 / m;
            out.face[k] = first + i32::from(along < 0.0);
            out.s[k] = (s * scale + 0.5).clamp(0.0, 1.0);
            out.t[k] = (t * scale + 0.5).clamp(0.0, 1.0);
        }
        out
    }

    /// Cells that hold the places: place k in a cube of `size[k]` intervals.
    #[inline(always)]
    pub fn cells(&self, size: &[f32; N]) -> LookupCells<N> {
        let mut out = LookupCells { first: [0; N], u: [0.0; N], v: [0.0; N] };
        for k in 0..N {
            let n = size[k] as i32;
            let (x, y) = (self.s[k] * size[k], self.t[k] * size[k]);
            let (i, j) = ((x as i32).min(n - 1), (y as i32).min(n - 1));
            (out.u[k], out.v[k]) = (x - i as f32, y - j as f32);
            out.first[k] = (self.face[k] * (n + 1) + j) * (n + 1) + i;
        }
        out
    }
}

impl<const N: usize> LookupCells<N> {
    /// The bilinear lookup of place `k` in a cube of its size; zeros in a smaller one.
    #[inline(always)]
    pub fn sample(&self, cube: &EdgeCube, k: usize) -> [f32; 4] {
        let first = self.first[k] as usize;
        let pair = |from: usize| cube.texels().get(from..).and_then(|t| t.first_chunk::<2>());
        let (Some([a, b]), Some([c, d])) = (pair(first), pair(first + cube.size() + 1)) else {
            return [0.0; 4];
        };
        let (u, v) = (self.u[k], self.v[k]);
        let mut out = [0.0; 4];
        for i in 0..4 {
            let top = a[i] + (b[i] - a[i]) * u;
            let bottom = c[i] + (d[i] - c[i]) * u;
            out[i] = top + (bottom - top) * v;
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probe;

    #[test]
    fn lookups_side_by_side_are_those_one_by_one() {
        let cubes = [3, 8].map(|n| EdgeCube::from_fn(n, |d| [d.x.sin(), d.y * d.z, d.z]));
        let mut directions: Vec<[f32; 3]> =
            (0..4000).map(|k| probe::direction(k, 4000).as_vec3().to_array()).collect();
        for x in [-1.0, -0.5, 0.0, 1.0] {
            for y in [-1.0, 0.0, 0.5, 1.0] {
                directions.extend([[x, y, 1.0], [x, 1.0, y], [-1.0, x, y], [x, y, -1.0], [2.0 * x, -2.0, y]]);
            }
        }
        for both in directions.as_chunks::<2>().0 {
            let places = Places::new(&[0, 1, 2].map(|c| [both[0][c], both[1][c]]));
            let cells = places.cells(&[3.0, 8.0]);
            for k in 0..2 {
                assert_eq!(cells.sample(&cubes[k], k), cubes[k].sample(both[k]), "{both:?}");
            }
        }
    }

    #[test]
    fn directions_that_are_none_are_harmless() {
        let cube = EdgeCube::from_fn(4, |d| d.to_array());
        for d in [[f32::NAN; 3], [0.0; 3], [f32::INFINITY, 0.0, 0.0], [f32::MAX; 3]] {
            let cells = Places::new(&d.map(|x| [x])).cells(&[4.0]);
            _ = cells.sample(&cube, 0);
        }
    }
}
