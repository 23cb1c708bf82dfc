//! The blocked part of each texel of a cube, seen from a site: one ray for each texel of a coarse cube, and
//! finer ones where neighbours differ.

use super::cube::{Level, parent};
use glam::Vec3;
use steradian_scene::{Bvh, Ray};
use steradian_sphere::sampling::Pcg32;

/// Side of the coarse cube, whose every texel gets a ray.
const COARSE: usize = 16;
/// Rays of a texel of the finest cube whose neighbours differ.
pub const EDGE: usize = 4;

/// The cubes from coarse to fine.
pub struct Pyramid {
    levels: Vec<(Level, [[Vec3; 2]; 6])>,
}

/// Memory of one thread.
#[derive(Default)]
pub struct Scratch {
    coarse: Vec<f32>,
    fine: Vec<f32>,
    cells: Vec<u32>,
    rays: Vec<Ray>,
    hits: Vec<bool>,
    weights: Vec<f32>,
}

impl Pyramid {
    /// Cubes up to faces of `side` × `side` texels, a power of two.
    pub fn new(side: usize) -> Self {
        let mut sides = vec![side];
        while sides[sides.len() - 1] > COARSE {
            sides.push(sides[sides.len() - 1] / 2);
        }
        let level = |s: &usize| {
            let level = Level::new(*s);
            let steps = level.steps();
            (level, steps)
        };
        Self { levels: sides.iter().rev().map(level).collect() }
    }

    /// The finest cube.
    #[cfg(test)]
    fn finest(&self) -> &Level {
        &self.levels[self.levels.len() - 1].0
    }

    /// The open part of what lies of each texel of the finest cube above the horizon about `n`, in quarters,
    /// for rays from `origin`; texels below the horizon count as open. Deterministic for a given seed.
    pub fn see<'s>(
        &self,
        bvh: &Bvh,
        origin: Vec3,
        n: Vec3,
        seed: u64,
        scratch: &'s mut Scratch,
    ) -> &'s [f32] {
        let Scratch { coarse, fine, cells, rays, hits, .. } = scratch;
        let mut random = Pcg32::new(seed, 0);
        // Below the horizon is the surface itself, which what weighs texels leaves out: directions there are
        // mirrored to just above.
        let mut direction = |level: &Level, c: u32, steps: &[[Vec3; 2]; 6]| {
            let place = [random.next_f64() as f32, random.next_f64() as f32];
            let d = level.point(c as usize, steps, place);
            d - n * (2.0 * d.dot(n).min(0.0))
        };
        for (k, (level, steps)) in self.levels.iter().enumerate() {
            let reach = reach(level.side);
            fine.clear();
            cells.clear();
            if k == 0 {
                fine.resize(level.centre.len(), 1.0);
                let above = |c: &u32| level.centre[*c as usize].dot(n) > -reach;
                cells.extend((0..level.centre.len() as u32).filter(above));
            } else {
                let before = &self.levels[k - 1].0;
                let differs =
                    |c: usize| before.neighbours[c].iter().any(|b| coarse[*b as usize] != coarse[c]);
                // Texels below the horizon do not count, and are left open.
                let refined: Vec<bool> = (0..coarse.len())
                    .map(|c| before.centre[c].dot(n) > -self::reach(before.side) && differs(c))
                    .collect();
                for c in 0..level.centre.len() {
                    let p = parent(c, level.side);
                    fine.push(coarse[p]);
                    if refined[p] && level.centre[c].dot(n) > -reach {
                        cells.push(c as u32);
                    }
                }
            }
            rays.clear();
            rays.extend(cells.iter().map(|c| Ray { origin, direction: direction(level, *c, steps) }));
            hits.clear();
            hits.resize(rays.len(), false);
            bvh.occluded_each(rays, f32::INFINITY, hits);
            for (c, hit) in cells.iter().zip(hits.iter()) {
                fine[*c as usize] = f32::from(u8::from(!hit));
            }
            std::mem::swap(coarse, fine);
        }
        // `coarse` now holds the finest cube.
        let (level, steps) = &self.levels[self.levels.len() - 1];
        let reach = reach(level.side);
        let differs = |c: usize| level.neighbours[c].iter().any(|b| coarse[*b as usize] != coarse[c]);
        cells.clear();
        cells.extend(
            (0..coarse.len() as u32)
                .filter(|c| level.centre[*c as usize].dot(n) > -reach && differs(*c as usize)),
        );
        rays.clear();
        for c in cells.iter() {
            rays.extend((1..EDGE).map(|_| Ray { origin, direction: direction(level, *c, steps) }));
        }
        hits.clear();
        hits.resize(rays.len(), false);
        bvh.occluded_each(rays, f32::INFINITY, hits);
        for (c, hits) in cells.iter().zip(hits.chunks(EDGE - 1)) {
            let open = hits.iter().filter(|h| !**h).count() as f32;
            let own = &mut coarse[*c as usize];
            *own = (*own + open) / EDGE as f32;
        }
        coarse
    }

    /// (1/π) ∫ (1 − V) (n·w)₊ dw over each texel of the finest cube, for rays from `origin`; deterministic
    /// for a given seed. Returns Σ ((1/π) ∫ (n·w)₊ dw)², the squared length that the vector would have if all
    /// were blocked.
    pub fn look(
        &self,
        bvh: &Bvh,
        origin: Vec3,
        n: Vec3,
        seed: u64,
        scratch: &mut Scratch,
        out: &mut [f32],
    ) -> f64 {
        self.see(bvh, origin, n, seed, scratch);
        let Scratch { coarse, weights, .. } = scratch;
        let level = &self.levels[self.levels.len() - 1].0;
        let reach = reach(level.side);
        weights.clear();
        weights
            .extend(level.centre.iter().zip(&level.omega).map(|(d, omega)| cosine(d.dot(n), reach) * omega));
        // The rule is made exact for the open hemisphere: ∫ (n·w)₊ dw = π.
        let sum: f64 = weights.iter().map(|w| f64::from(*w)).sum();
        let scale = (1.0 / sum) as f32;
        for ((to, w), v) in out.iter_mut().zip(weights.iter()).zip(coarse.iter()) {
            *to = w * (1.0 - v) * scale;
        }
        weights.iter().map(|w| f64::from(w * scale).powi(2)).sum()
    }
}

/// Distance, about half a texel's side, over which the cosine varies around a texel's centre.
pub fn reach(side: usize) -> f32 {
    1.0 / side as f32
}

/// The mean of max(x, 0) over cosines from x − e to x + e.
#[inline(always)]
fn cosine(x: f32, e: f32) -> f32 {
    if x >= e {
        x
    } else if x <= -e {
        0.0
    } else {
        (x + e) * (x + e) / (4.0 * e)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_scene::{Mesh, shapes};

    fn sum(out: &[f32]) -> f64 {
        out.iter().map(|x| f64::from(*x)).sum()
    }

    /// On a plane at the foot of a wall of infinite height the form factor is 1/2; under a ball of angular
    /// radius θ it is sin²θ.
    #[test]
    fn walls_and_disks_block_their_form_factors() {
        let pyramid = Pyramid::new(64);
        let (mut scratch, mut out) = (Scratch::default(), vec![0.0; 6 * 64 * 64]);
        let corner = [[0.5, -1e4, -1e4], [0.5, 1e4, -1e4], [0.5, 1e4, 1e4], [0.5, -1e4, 1e4]];
        let wall = Mesh {
            positions: corner.map(Vec3::from).to_vec(),
            normals: vec![Vec3::NEG_X; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let bvh = Bvh::build(&wall);
        pyramid.look(&bvh, Vec3::ZERO, Vec3::Y, 3, &mut scratch, &mut out);
        assert!((sum(&out) - 0.5).abs() < 1e-3, "{}", sum(&out));
        let ball = shapes::icosphere(5);
        let bvh = Bvh::build(&ball);
        for height in [1.5f32, 3.0, 6.0] {
            pyramid.look(&bvh, Vec3::new(0.0, -height, 0.0), Vec3::Y, 7, &mut scratch, &mut out);
            let expected = f64::from(height).powi(-2);
            assert!((sum(&out) - expected).abs() < 2e-3, "{height}: {} {expected}", sum(&out));
        }
    }

    /// Nothing in the way blocks nothing; in a shell all is blocked, and each texel has its part of the
    /// cosine.
    #[test]
    fn blocked_are_nothing_in_the_open_and_the_cosine_in_a_shell() {
        let pyramid = Pyramid::new(32);
        let (mut scratch, mut out) = (Scratch::default(), vec![0.0; 6 * 32 * 32]);
        let bvh = Bvh::build(&shapes::icosphere(2));
        let n = Vec3::new(0.3, 0.8, -0.5).normalize();
        let open = pyramid.look(&bvh, n * 2.0, n, 1, &mut scratch, &mut out);
        assert!(out.iter().all(|x| *x == 0.0));
        let shut = pyramid.look(&bvh, Vec3::ZERO, n, 1, &mut scratch, &mut out);
        assert!((sum(&out) - 1.0).abs() < 1e-6);
        assert_eq!(open, shut);
        assert!((out.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>() / shut - 1.0).abs() < 1e-6);
        let level = pyramid.finest();
        for (k, t) in out.iter().enumerate() {
            let expected = level.centre[k].dot(n).max(0.0) * level.omega[k] / std::f32::consts::PI;
            assert!((t - expected).abs() < 2e-5, "{k}: {t} {expected}");
        }
    }
}
