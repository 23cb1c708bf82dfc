//! The integral of f_cos over each open texel of a cube.

use super::cube::Level;
use super::visibility::reach;
use glam::{DVec3, Vec3};
use std::f64::consts::{FRAC_PI_2, PI};
use steradian_brdf::{Brdf, Lobe};
use steradian_sphere::Frame;

/// Directions that are evaluated at once.
const BATCH: usize = 2048;
/// A cell is divided while its side is more than this part of the length over which a lobe varies there.
const FINE: f64 = 0.5;
/// That length at the angle a from a lobe is this part of a, and the lobe's width at least: tails fall like a
/// power of the angle.
const TAIL: f64 = 0.5;
/// Smallest cell, in texels: 8e-6 radians at 64 texels a side.
const SMALLEST: f32 = 1.0 / 4096.0;
/// Half of the diagonal of a square of side 1, and a little.
const HALF_DIAGONAL: f64 = 0.71;

/// Memory of one thread.
#[derive(Default)]
pub struct Scratch {
    wi: Vec<DVec3>,
    /// Texel and weight of each direction.
    of: Vec<(u32, f32)>,
    f: Vec<[f64; 3]>,
    cells: Vec<[f32; 3]>,
}

/// A lobe: all directions at an angle from an axis.
struct Ridge {
    axis: DVec3,
    angle: f64,
    width: f64,
    /// Cosines to the axis between which a texel is divided.
    near: [f64; 2],
}

impl Ridge {
    /// `None` where no texel of `side` radians needs to be divided.
    fn of(lobe: &Lobe, side: f64) -> Option<Self> {
        let (axis, angle, width) = match *lobe {
            Lobe::Axis { axis, width } => (axis, 0.0, width),
            Lobe::Cone { axis, cosine, width } => (axis, cosine.clamp(-1.0, 1.0).acos(), width),
            Lobe::Arc { normal, width } => (normal, FRAC_PI_2, width),
        };
        if side <= FINE * width {
            return None;
        }
        let far = side * (1.0 / (FINE * TAIL) + HALF_DIAGONAL);
        let near = [(angle + far).min(PI).cos(), (angle - far).max(0.0).cos()];
        Some(Self { axis, angle, width, near })
    }

    /// Is a cell of `side` radians around the unit direction `d` small enough?
    fn is_fine(&self, d: DVec3, side: f64) -> bool {
        let chord = 0.5 * self.axis.distance(d);
        let off = (2.0 * chord.min(1.0).asin() - self.angle).abs() - HALF_DIAGONAL * side;
        side <= FINE * (TAIL * off).max(self.width)
    }
}

/// A reflectance seen from one place.
pub struct Place<'a> {
    pub brdf: &'a dyn Brdf,
    pub frame: Frame,
    /// Local direction to the viewer, above the horizon.
    pub wo: DVec3,
}

impl Place<'_> {
    /// T_j = V_j ∫_{texel j} f_cos(w, wo) dw for each texel of `cube`, whose open part is V_j, into as many
    /// channels as `out` has. Texels are evaluated at their centres, those near a narrow lobe in cells that
    /// it hardly varies over, and those on the horizon in four.
    pub fn weigh(
        &self,
        cube: &Level,
        steps: &[[Vec3; 2]; 6],
        open: &[f32],
        scratch: &mut Scratch,
        out: &mut [Vec<f32>],
    ) {
        let side = 2.0 / cube.side as f64;
        let ridges: Vec<Ridge> = self.brdf.lobes(self.wo).iter().filter_map(|l| Ridge::of(l, side)).collect();
        let (reach, n) = (reach(cube.side), self.frame.n.as_vec3());
        let mut cells = std::mem::take(&mut scratch.cells);
        out.iter_mut().for_each(|plane| {
            plane.clear();
            plane.resize(open.len(), 0.0);
        });
        for (k, v) in open.iter().enumerate() {
            let (centre, height) = (cube.centre[k], cube.centre[k].dot(n));
            if *v == 0.0 || height <= -reach {
                continue;
            }
            let wi = self.frame.to_local(centre.as_dvec3());
            let near = |r: &Ridge| (r.near[0]..=r.near[1]).contains(&r.axis.dot(wi));
            if height >= reach && !ridges.iter().any(near) {
                self.push(wi, (k as u32, v * cube.omega[k]), scratch, out);
                continue;
            }
            // Corner and side, in texels; those on the horizon start with four.
            cells.clear();
            if height >= reach {
                cells.push([0.0, 0.0, 1.0]);
            } else {
                cells.extend([[0.0, 0.0, 0.5], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5], [0.5, 0.5, 0.5]]);
            }
            let [right, down] = steps[k / (cube.side * cube.side)];
            while let Some([x, y, size]) = cells.pop() {
                let half = 0.5 * size;
                let p = (cube.corner[k] + right * (x + half) + down * (y + half)).as_dvec3();
                let length = p.length();
                let wi = self.frame.to_local(p / length);
                let angle = side * f64::from(size);
                if size > SMALLEST && !ridges.iter().all(|r| r.is_fine(wi, angle)) {
                    let corner = |(i, j): (f32, f32)| [x + i * half, y + j * half, half];
                    cells.extend([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(corner));
                    continue;
                }
                // The solid angle of a small square of the plane at distance 1.
                let omega = angle * angle / length.powi(3);
                self.push(wi, (k as u32, v * omega as f32), scratch, out);
            }
        }
        self.evaluate(scratch, out);
        scratch.cells = cells;
    }

    #[inline]
    fn push(&self, wi: DVec3, of: (u32, f32), scratch: &mut Scratch, out: &mut [Vec<f32>]) {
        scratch.wi.push(wi);
        scratch.of.push(of);
        if scratch.wi.len() == BATCH {
            self.evaluate(scratch, out);
        }
    }

    /// Evaluates the directions that have come together.
    fn evaluate(&self, scratch: &mut Scratch, out: &mut [Vec<f32>]) {
        let Scratch { wi, of, f, .. } = scratch;
        f.clear();
        f.resize(wi.len(), [0.0; 3]);
        self.brdf.f_cos_batch(wi, self.wo, f);
        for ((k, weight), f) in of.iter().zip(f.iter()) {
            for (plane, f) in out.iter_mut().zip(f) {
                plane[*k as usize] += weight * *f as f32;
            }
        }
        wi.clear();
        of.clear();
    }
}
