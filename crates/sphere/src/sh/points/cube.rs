//! The directions of a cube map's texels as angles.

use std::f64::consts::{FRAC_PI_2, PI};

/// (θ, φ) of all texel centres of a cube map, from an eighth of them.
pub(crate) struct CubeAngles {
    size: usize,
    /// Of column i of a side face: φ from the face's axis.
    column: Vec<f64>,
    /// Of texel (i, j) of a side face: π/2 − θ of the upper half; row-major, first quadrant by distance from
    /// the face's axis.
    height: Vec<f64>,
    /// Of texel (i, j) of a polar face: angle from the pole, and about it.
    polar: Vec<[f64; 2]>,
}

impl CubeAngles {
    pub(crate) fn new(size: usize) -> Self {
        let half = size.div_ceil(2);
        // Distances from the middle, as `fold` counts them.
        let a: Vec<f64> = (0..half).map(|q| (2 * q + 1 - size % 2) as f64 / size as f64).collect();
        let quadrant = || (0..half * half).map(|k| (a[k % half], a[k / half]));
        let mut polar = vec![[0.0; 2]; half * half];
        // The other side of the diagonal mirrors this one.
        for j in 0..half {
            for i in j..half {
                let about = if a[j] > 0.0 { a[j].atan2(a[i]) } else { 0.0 };
                let from_pole = a[i].hypot(a[j]).atan();
                polar[i * half + j] = [from_pole, FRAC_PI_2 - about];
                polar[j * half + i] = [from_pole, about];
            }
        }
        Self {
            size,
            column: a.iter().map(|a| a.atan()).collect(),
            height: quadrant().map(|(a, b)| (b / (1.0 + a * a).sqrt()).atan()).collect(),
            polar,
        }
    }

    /// Distance from the middle in texels, rounded down, and whether before it.
    fn fold(&self, i: usize) -> (usize, bool) {
        let twice = 2 * i + 1;
        (twice.abs_diff(self.size) / 2, twice < self.size)
    }

    /// (θ, φ) of row j of a face in the order +X −X +Y −Y +Z −Z.
    pub(crate) fn row(&self, face: usize, j: usize, row: &mut [[f64; 2]]) {
        let half = self.size.div_ceil(2);
        let (b, up) = self.fold(j);
        let sign = |negative: bool| if negative { -1.0 } else { 1.0 };
        if face == 2 || face == 3 {
            // +Y: x to the right, z downwards; −Y: z upwards.
            let about_sign = sign(up != (face == 3));
            for (a, [from_pole, about]) in self.polar[b * half..(b + 1) * half].iter().enumerate() {
                let theta = if face == 2 { *from_pole } else { PI - from_pole };
                row[half - 1 - a] = [theta, about_sign * (PI - about)];
                row[self.size - half + a] = [theta, about_sign * about];
            }
        } else {
            // φ grows to the left on all sides but is measured from each face's axis.
            let axis = [0.0, PI, 0.0, 0.0, FRAC_PI_2, -FRAC_PI_2][face];
            let heights = &self.height[b * half..(b + 1) * half];
            for (a, (height, column)) in heights.iter().zip(&self.column).enumerate() {
                let theta = FRAC_PI_2 - sign(!up) * height;
                row[half - 1 - a] = [theta, axis + column];
                row[self.size - half + a] = [theta, axis - column];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::angles;
    use super::*;
    use crate::Layout;

    #[test]
    fn cube_angles_are_those_of_the_layout() {
        for size in [1, 2, 3, 7, 8] {
            let cube = CubeAngles::new(size);
            for face in 0..6 {
                for j in 0..size {
                    let mut row = vec![[0.0; 2]; size];
                    cube.row(face, j, &mut row);
                    for i in 0..size {
                        let d = Layout::Cube.texel_direction(size, size, face, i, j).expect("a texel");
                        let ([a, b], [theta, phi]) = (row[i], angles(d));
                        let turn = (b - phi) / (2.0 * PI);
                        let pole = d.x.hypot(d.z) < 1e-12;
                        assert!((a - theta).abs() < 1e-12, "{size} {face} {i} {j}: {a} {theta}");
                        assert!(
                            pole || (turn - turn.round()).abs() < 1e-12,
                            "{size} {face} {i} {j}: {b} {phi}"
                        );
                    }
                }
            }
        }
    }
}
