//! Points where anisotropic reflectance is: cells of a cube about the mirror direction, divided where it
//! needs them.

use crate::math::{around, mirror};
use crate::{Brdf, Lobe};
use glam::{DMat3, DVec3};
use std::f64::consts::FRAC_1_PI;

/// Gauss and Legendre's nodes on (−1, 1) and weights, 3 points.
const GAUSS: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];
/// Initial number of cells along a face's edge; even, so that four of them meet at the mirror direction,
/// where a highlight is narrowest.
const INITIAL_CELLS: i32 = 4;
/// Least width of a ridge that the reflectance declares, half edges of the cube, for which the initial cells
/// are divided: finer ones are left to the test of the integrals, since a ridge all around the sphere would
/// take the number of cells that it is long over wide.
const MIN_RIDGE: f64 = 0.02;
/// Cells are divided where that changes ∫ T² by more than this part of it, or ∫ |T|: with both, albedos of
/// the streaks in the test below are within 3e-3.
const SETTLED: [f64; 2] = [1e-4, 3e-4];
/// Rounds of division at most: the twelfth makes cells of 1.2e-4 half edges of the cube.
const MAX_ROUNDS: usize = 12;
/// Cells from which on none is divided. Each has nine points, so that a view has some 11,000, and each step
/// of its fit evaluates every lobe at all of them.
const MAX_CELLS: usize = 1200;

/// Points of a cell, which follow each other.
pub(super) const POINTS: usize = 9;

/// A square of a face.
#[derive(Debug, Clone, Copy)]
struct Cell {
    /// Normal of the face, and its axes.
    face: [DVec3; 3],
    middle: [f64; 2],
    half: f64,
}

impl Cell {
    fn points(&self) -> [(DVec3, f64); POINTS] {
        let [w, u, v] = self.face;
        std::array::from_fn(|k| {
            let ((x, a), (y, b)) = (GAUSS[k % 3], GAUSS[k / 3]);
            let (x, y) = (self.middle[0] + self.half * x, self.middle[1] + self.half * y);
            let square = 1.0 + x * x + y * y;
            ((w + u * x + v * y) / square.sqrt(), a * b * self.half * self.half / (square * square.sqrt()))
        })
    }

    fn divided(&self) -> [Self; 4] {
        let half = 0.5 * self.half;
        std::array::from_fn(|k| {
            let sign = |bit: usize| if k >> bit & 1 == 1 { half } else { -half };
            Self { middle: [self.middle[0] + sign(0), self.middle[1] + sign(1)], half, ..*self }
        })
    }

    /// May the lobe pass through here with more detail than the cell has points for?
    fn is_coarse_for(&self, lobe: &Lobe) -> bool {
        let [w, u, v] = self.face;
        let d = (w + u * self.middle[0] + v * self.middle[1]).normalize();
        let reach = 1.5 * self.half;
        let (distance, width) = match *lobe {
            Lobe::Axis { axis, width } => (d.dot(axis).clamp(-1.0, 1.0).acos(), 2.0 * width),
            Lobe::Cone { axis, cosine, width } => (
                (d.dot(axis).clamp(-1.0, 1.0).acos() - cosine.clamp(-1.0, 1.0).acos()).abs(),
                width.max(MIN_RIDGE),
            ),
            Lobe::Arc { normal, width } => (d.dot(normal).abs().min(1.0).asin(), width.max(MIN_RIDGE)),
        };
        self.half > width && distance < reach
    }
}

/// Directions of the frame in which `wo` has no y, with the roots of their solid angles: enough of them for ∫
/// T² and ∫ T, T the reflectance's f·cos less that of a diffuse part.
pub(super) fn rule(brdf: &dyn Brdf, diffuse: [f64; 3], wo: DVec3, lobes: &[Lobe]) -> (Vec<DVec3>, Vec<f64>) {
    // The middle of a face is the mirror direction, where four cells meet.
    let w = mirror(wo);
    let (u, v) = around(w);
    let faces = [[w, u, v], [-w, v, u], [u, v, w], [-u, w, v], [v, w, u], [-v, u, w]];
    let half = f64::from(INITIAL_CELLS).recip();
    let place = |k: i32| f64::from(2 * k + 1) * half - 1.0;
    let grid =
        || (0..INITIAL_CELLS * INITIAL_CELLS).map(|k| [place(k % INITIAL_CELLS), place(k / INITIAL_CELLS)]);
    let first = faces.iter().flat_map(|f| grid().map(|middle| Cell { face: *f, middle, half }));
    let mut cells: Vec<Cell> = Vec::new();
    let mut todo: Vec<Cell> = first.collect();
    while let Some(cell) = todo.pop() {
        if lobes.iter().any(|l| cell.is_coarse_for(l)) {
            todo.extend(cell.divided());
        } else {
            cells.push(cell);
        }
    }
    // ∫ T² and ∫ |T| of a cell.
    let mut values = [[0.0; 3]; POINTS];
    let mut integrals = |cell: &Cell| -> [f64; 2] {
        let points = cell.points();
        brdf.f_cos_batch(&points.map(|p| p.0), wo, &mut values);
        let mut sum = [0.0; 2];
        for ((d, solid), f) in points.iter().zip(&values) {
            for c in (0..3).filter(|c| f[*c].is_finite()) {
                let t = f[c] - diffuse[c] * FRAC_1_PI * d.z.max(0.0);
                sum[0] += solid * t * t;
                sum[1] += solid * t.abs();
            }
        }
        sum
    };
    let mut tried: Vec<(Cell, [f64; 2])> = cells.iter().map(|c| (*c, integrals(c))).collect();
    let mut total = [0, 1].map(|i| tried.iter().map(|t| t.1[i]).sum::<f64>());
    let mut done: Vec<Cell> = Vec::new();
    for _ in 0..MAX_ROUNDS {
        let mut next = Vec::new();
        for (cell, whole) in std::mem::take(&mut tried) {
            let parts = cell.divided().map(|c| (c, integrals(&c)));
            let change = [0, 1].map(|i| parts.iter().map(|p| p.1[i]).sum::<f64>() - whole[i]);
            let matters = (0..2).any(|i| change[i].abs() > SETTLED[i] * total[i]);
            (0..2).for_each(|i| total[i] += change[i]);
            if matters && done.len() + next.len() < MAX_CELLS {
                next.extend(parts);
            } else {
                done.push(cell);
            }
        }
        tried = next;
        if tried.is_empty() {
            break;
        }
    }
    done.extend(tried.iter().map(|t| t.0));
    let turn = DMat3::from_rotation_z(-wo.y.atan2(wo.x));
    done.iter().flat_map(Cell::points).map(|(d, solid)| (turn * d, solid.sqrt())).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::spherical;
    use crate::{albedo, parse};

    /// ∫ f·cos by the rule against the albedo by another quadrature, for narrow streaks too; and the sphere's
    /// area.
    #[test]
    fn albedos_of_anisotropic_reflectance() {
        for spec in [
            "ggx:ax=0.1,ay=0.4",
            "ggx:ax=0.02,ay=0.5",
            "ward:ax=0.05,ay=0.3",
            "ashikhmin-shirley:nu=10,nv=1000",
        ] {
            let brdf = parse(spec).expect(spec);
            for (theta, phi) in [(0.0, 0.0), (0.5, 0.3), (1.1, 1.4), (1.4, 2.5), (1.55, 0.8)] {
                let wo = spherical(theta, phi);
                let (d, root) = rule(&*brdf, [0.0; 3], wo, &brdf.lobes(wo));
                let turn = DMat3::from_rotation_z(wo.y.atan2(wo.x));
                let got: f64 = d.iter().zip(&root).map(|(d, r)| brdf.f_cos(turn * *d, wo)[1] * r * r).sum();
                let want = albedo::directional(&*brdf, wo, 1e-6)[1];
                println!("{spec} {theta} {phi}: {} points, {:.5}", d.len(), got / want);
                assert!((got / want - 1.0).abs() < 3e-3, "{spec} {theta} {phi}: {got} {want}");
                let sphere: f64 = root.iter().map(|r| r * r).sum();
                assert!((sphere / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-4, "{sphere}");
            }
        }
    }
}
