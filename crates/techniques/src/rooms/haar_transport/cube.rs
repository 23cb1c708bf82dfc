//! The cube that wavelets live on: texels' directions and solid angles, and which texels are neighbours.

use glam::Vec3;
use steradian_sphere::Layout;
use steradian_sphere::layout::Position;

/// Texels of the faces of one side, face after face, rows from the top.
pub struct Level {
    /// Texels a side.
    pub side: usize,
    /// Directions of the centres, and of the corner that comes first in rows with the steps to the next ones:
    /// a point of texel k is `corner + x · right + y · down`, not unit.
    pub corner: Vec<Vec3>,
    /// Unit directions of the centres.
    pub centre: Vec<Vec3>,
    /// Solid angles.
    pub omega: Vec<f32>,
    /// The four texels that share a side with each one, across the cube's edges too.
    pub neighbours: Vec<[u32; 4]>,
}

/// The steps from one texel to the next one on a face, along rows and columns, for faces at distance 1.
fn steps(face: usize, side: usize) -> [Vec3; 2] {
    let at = |x: f64, y: f64| plane(face, side, x, y);
    [at(1.0, 0.0) - at(0.0, 0.0), at(0.0, 1.0) - at(0.0, 0.0)]
}

/// A point of a face, in texels, on the cube of half side 1.
fn plane(face: usize, side: usize, x: f64, y: f64) -> Vec3 {
    let d = Layout::Cube.direction(side, side, Position { face, x, y }).unwrap_or_default();
    let axis = match face / 2 {
        0 => d.x,
        1 => d.y,
        _ => d.z,
    };
    (d / axis.abs()).as_vec3()
}

impl Level {
    /// The cube with faces of `side` × `side` texels.
    pub fn new(side: usize) -> Self {
        let texels = || (0..6 * side * side).map(|k| (k / (side * side), k % side, k / side % side));
        let direction = |face: usize, x: f64, y: f64| {
            Layout::Cube.direction(side, side, Position { face, x, y }).unwrap_or_default()
        };
        let index = |face: usize, x: f64, y: f64| {
            let p = Layout::Cube.position(side, side, direction(face, x, y));
            let cell = |v: f64| (v.max(0.0) as usize).min(side - 1);
            (p.face * side * side + cell(p.y) * side + cell(p.x)) as u32
        };
        let neighbours = |(face, i, j): (usize, usize, usize)| {
            let (x, y) = (i as f64 + 0.5, j as f64 + 0.5);
            [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)].map(|(u, v)| index(face, x + u, y + v))
        };
        let omega = |(face, i, j)| Layout::Cube.solid_angle(side, side, face, i, j) as f32;
        Self {
            side,
            corner: texels().map(|(f, i, j)| plane(f, side, i as f64, j as f64)).collect(),
            centre: texels()
                .map(|(f, i, j)| direction(f, i as f64 + 0.5, j as f64 + 0.5).as_vec3())
                .collect(),
            omega: texels().map(omega).collect(),
            neighbours: texels().map(neighbours).collect(),
        }
    }

    /// The unit direction of a point of texel `k`, (0, 0) to (1, 1).
    #[inline]
    pub fn point(&self, k: usize, steps: &[[Vec3; 2]; 6], [x, y]: [f32; 2]) -> Vec3 {
        let [right, down] = steps[k / (self.side * self.side)];
        (self.corner[k] + right * x + down * y).normalize()
    }

    /// The steps of all faces.
    pub fn steps(&self) -> [[Vec3; 2]; 6] {
        std::array::from_fn(|face| steps(face, self.side))
    }
}

/// The texel of the next coarser level that holds texel `k` of faces of `side`.
pub fn parent(k: usize, side: usize) -> usize {
    let (face, i, j) = (k / (side * side), k % side, k / side % side);
    let half = side / 2;
    face * half * half + (j / 2) * half + i / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_fill_the_sphere_and_neighbours_are_near() {
        for side in [4, 16] {
            let level = Level::new(side);
            let sum: f64 = level.omega.iter().map(|o| f64::from(*o)).sum();
            assert!((sum - 4.0 * std::f64::consts::PI).abs() < 1e-5);
            let steps = level.steps();
            for k in 0..level.centre.len() {
                assert!(level.point(k, &steps, [0.5; 2]).distance(level.centre[k]) < 1e-6);
                let own = &level.neighbours[k];
                for n in own {
                    assert_ne!(*n as usize, k);
                    let far = level.centre[k].angle_between(level.centre[*n as usize]);
                    assert!(far < 2.3 / side as f32, "{far}");
                    // Neighbourhood is mutual.
                    assert!(level.neighbours[*n as usize].contains(&(k as u32)));
                }
            }
        }
        let (fine, coarse) = (Level::new(8), Level::new(4));
        for (k, d) in fine.centre.iter().enumerate() {
            assert!(d.angle_between(coarse.centre[parent(k, 8)]) < 0.35);
        }
    }
}
