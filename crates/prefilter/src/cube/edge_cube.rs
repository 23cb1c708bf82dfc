//! Cube maps whose outer texels lie on the edges of the cube.
//!
//! Face coordinates run from −1 to 1 over `size` intervals, with a sample at both ends: neighbouring faces
//! share the samples of their edge, so bilinear lookup is continuous over the whole sphere, reads one face
//! only and needs no border. (Kautz's course notes 2006 show the seams of the ordinary layout.) Faces are in
//! the Khronos order and orientation.

use crate::SmallLight;
use glam::DVec3;
use std::collections::BTreeMap;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_sphere::{Layout, SphereImage};

/// An RGB cube map with shared edges.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EdgeCube {
    size: usize,
    texels: Vec<[f32; 4]>,
}

/// Mean spacing of the samples of a cube of `size` intervals, radians: √(4π/6)/size.
pub fn spacing(size: usize) -> f64 {
    (4.0 * std::f64::consts::PI / 6.0).sqrt() / size as f64
}

/// Relative RMS error of bilinear lookup in a cube of `size` intervals, of a function of these energies by
/// band.
///
/// Linear interpolation of a wave of wavenumber l over spacing h has RMS error (l h)²/√120 of the wave's
/// (from e(x) = ½ x(h − x) l², mean square h⁴/120), and no more than about 1.
pub fn lookup_error(energies: &[f64], size: usize) -> f64 {
    let (all, h) = (energies.iter().sum::<f64>(), spacing(size));
    let wave = |l: usize| (l as f64 * h).powi(4) / 120.0;
    let lost: f64 = energies.iter().enumerate().map(|(l, e)| wave(l).min(1.0) * e).sum();
    if all > 0.0 { (lost / all).sqrt() } else { 0.0 }
}

/// A sample as a point of the integer lattice −size … size on the surface of the cube; a sample that several
/// faces share is one point.
type Lattice = [i64; 3];

fn lattice(size: usize, face: usize, i: usize, j: usize) -> Lattice {
    let n = size as i64;
    let (s, t) = (2 * i as i64 - n, 2 * j as i64 - n);
    match face {
        0 => [n, -t, -s],
        1 => [-n, -t, s],
        2 => [s, n, t],
        3 => [s, -n, -t],
        4 => [s, -t, n],
        _ => [-s, -t, -n],
    }
}

/// Column and row of a lattice point on `face`; `None` where it is not on it.
fn on_face(size: usize, face: usize, [x, y, z]: Lattice) -> Option<(usize, usize)> {
    let n = size as i64;
    let (m, s, t) = match face {
        0 => (x, -z, -y),
        1 => (-x, z, -y),
        2 => (y, x, z),
        3 => (-y, x, -z),
        4 => (z, x, -y),
        _ => (-z, -x, -y),
    };
    (m == n).then_some((((s + n) / 2) as usize, ((t + n) / 2) as usize))
}

/// The unit direction of sample (i, j) of `face`; samples that faces share have bit-identical directions.
pub fn direction(size: usize, face: usize, i: usize, j: usize) -> DVec3 {
    let [x, y, z] = lattice(size, face, i, j);
    DVec3::new(x as f64, y as f64, z as f64).normalize()
}

/// The solid angle of a sample: the integral of its bilinear weight, 2 × 2 Gauss points a cell.
fn solid_angle(size: usize, p: Lattice) -> f64 {
    let n = size as f64;
    let g = 0.5 / 3.0_f64.sqrt();
    let mut sum = 0.0;
    for (i, j) in (0..6).filter_map(|face| on_face(size, face, p)) {
        let inside = |k: usize, step: i64| (0..=size as i64).contains(&(k as i64 + step));
        for (a, b) in
            [(-1, -1), (1, -1), (-1, 1), (1, 1)].into_iter().filter(|&(a, b)| inside(i, a) && inside(j, b))
        {
            for (u, v) in [(0.5 - g, 0.5 - g), (0.5 + g, 0.5 - g), (0.5 - g, 0.5 + g), (0.5 + g, 0.5 + g)] {
                let s = 2.0 * (i as f64 + a as f64 * u) / n - 1.0;
                let t = 2.0 * (j as f64 + b as f64 * v) / n - 1.0;
                sum += 0.25 * (1.0 - u) * (1.0 - v) * 4.0 / (n * n) * (1.0 + s * s + t * t).powf(-1.5);
            }
        }
    }
    sum
}

/// Face and face coordinates in [0, 1] of a direction of any length; `shade.wgsl` modules get the same
/// function.
#[inline(always)]
pub fn face_position(d: [f32; 3]) -> (usize, f32, f32) {
    let [x, y, z] = d;
    let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
    let (face, s, t, m) = if ax >= ay && ax >= az {
        if x < 0.0 { (1, z, -y, ax) } else { (0, -z, -y, ax) }
    } else if ay >= az {
        if y < 0.0 { (3, x, -z, ay) } else { (2, x, z, ay) }
    } else if z < 0.0 {
        (5, -x, -y, az)
    } else {
        (4, x, -y, az)
    };
    let scale = 0.5 / m;
    (face, s * scale + 0.5, t * scale + 0.5)
}

impl EdgeCube {
    /// Samples of `f`, in parallel; `size` ≥ 1.
    pub fn from_fn(size: usize, f: impl Fn(DVec3) -> [f64; 3] + Sync) -> Self {
        // A quiet task cannot be cancelled.
        Self::try_from_fn(size, &Task::quiet(), f).unwrap_or_default()
    }

    /// [`EdgeCube::from_fn`] for slow functions: it may be cancelled between rows.
    pub fn try_from_fn(
        size: usize,
        task: &Task,
        f: impl Fn(DVec3) -> [f64; 3] + Sync,
    ) -> Result<Self, Cancelled> {
        let size = size.max(1);
        let n = size + 1;
        let row = |r: usize| {
            task.check()?;
            let texel = |i: usize| {
                let [r, g, b] = f(direction(size, r / n, i, r % n));
                [r as f32, g as f32, b as f32, 1.0]
            };
            Ok((0..n).map(texel).collect::<Vec<_>>())
        };
        let rows: Vec<Vec<[f32; 4]>> =
            (0..6 * n).into_par_iter().map(row).collect::<Result<_, Cancelled>>()?;
        Ok(Self { size, texels: rows.concat() })
    }

    /// Each sample is the mean of `image` over the sample's quadrilateral: the four half-size texels that
    /// meet at it (of two faces on an edge, of three at a corner).
    pub fn from_image(image: &SphereImage, size: usize) -> Self {
        let size = size.max(1);
        let fine = image.resample(Layout::Cube, 2 * size, 2 * size);
        let areas = areas(size);
        let (n, h) = (size + 1, 0.5 / size as f64);
        let mut texels = vec![[0.0; 4]; 6 * n * n];
        texels.par_chunks_mut(n).enumerate().for_each(|(r, row)| {
            let (face, j) = (r / n, r % n);
            for (i, texel) in row.iter_mut().enumerate() {
                let inside = (1..size).contains(&i) && (1..size).contains(&j);
                let [r, g, b] = if inside {
                    mean_of_four(&fine, &areas, [face, i, j])
                } else {
                    mean_around(&fine, direction(size, face, i, j), h)
                };
                *texel = [r as f32, g as f32, b as f32, 1.0];
            }
        });
        Self { size, texels }
    }

    /// A cube from its texels; `None` where their number is not 6 (size + 1)².
    pub fn from_texels(size: usize, texels: Vec<[f32; 4]>) -> Option<Self> {
        (size >= 1 && texels.len() == 6 * (size + 1) * (size + 1)).then_some(Self { size, texels })
    }

    /// Intervals per edge; a face has (size + 1)² samples.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Samples r, g, b, 1, face after face, rows from the top.
    pub fn texels(&self) -> &[[f32; 4]] {
        &self.texels
    }

    /// [`EdgeCube::texels`], moved out.
    pub fn into_texels(self) -> Vec<[f32; 4]> {
        self.texels
    }

    /// Adds a small light: its flux is distributed over the samples by the weights of bilinear lookup, and
    /// divided by their solid angles, so the integral of lookups grows by the flux.
    pub fn add(&mut self, small_light: &SmallLight) {
        let mut shares: BTreeMap<Lattice, f64> = BTreeMap::new();
        let rings = (4.0 * small_light.radius / spacing(self.size)).ceil().clamp(1.0, 64.0) as usize;
        small_light.nodes(rings, 4 * rings, |d, w| {
            for (p, share) in self.shares(d) {
                *shares.entry(p).or_default() += w * share;
            }
        });
        for (p, w) in shares {
            let w = w / solid_angle(self.size, p);
            for (face, (i, j)) in (0..6).filter_map(|f| Some((f, on_face(self.size, f, p)?))) {
                let texel = &mut self.texels[(face * (self.size + 1) + j) * (self.size + 1) + i];
                (0..3).for_each(|c| texel[c] += (small_light.flux[c] * w) as f32);
            }
        }
    }

    /// The four samples around `d` and their bilinear weights.
    fn shares(&self, d: DVec3) -> [(Lattice, f64); 4] {
        let (face, s, t) = face_position(d.as_vec3().to_array());
        let at = |s: f32| {
            let x = f64::from(s.clamp(0.0, 1.0)) * self.size as f64;
            let i = (x as usize).min(self.size - 1);
            (i, x - i as f64)
        };
        let ((i, u), (j, v)) = (at(s), at(t));
        std::array::from_fn(|k| {
            let (a, b) = (k % 2, k / 2);
            let w = if a == 1 { u } else { 1.0 - u } * if b == 1 { v } else { 1.0 - v };
            (lattice(self.size, face, i + a, j + b), w)
        })
    }

    /// Bilinear lookup in a direction of any length; finite for any finite direction.
    #[inline(always)]
    pub fn sample(&self, d: [f32; 3]) -> [f32; 4] {
        let (face, s, t) = face_position(d);
        let last = self.size as f32;
        let (x, y) = (s.clamp(0.0, 1.0) * last, t.clamp(0.0, 1.0) * last);
        let (i, j) = ((x as usize).min(self.size - 1), (y as usize).min(self.size - 1));
        let (u, v) = (x - i as f32, y - j as f32);
        let k = (face * (self.size + 1) + j) * (self.size + 1) + i;
        let t = &self.texels[k..k + self.size + 3];
        let (a, b, c, d) = (t[0], t[1], t[self.size + 1], t[self.size + 2]);
        std::array::from_fn(|c4| {
            let top = a[c4] + (b[c4] - a[c4]) * u;
            let bottom = c[c4] + (d[c4] - c[c4]) * u;
            top + (bottom - top) * v
        })
    }
}

/// Solid angles of the texels of a quarter of a face, 2 `size` texels wide.
fn areas(size: usize) -> Vec<f64> {
    let area = |k: usize| Layout::Cube.solid_angle(2 * size, 2 * size, 0, k % size, k / size);
    (0..size * size).into_par_iter().map(area).collect()
}

/// [`mean_around`] a sample inside a face.
fn mean_of_four(fine: &SphereImage, areas: &[f64], [face, i, j]: [usize; 3]) -> [f64; 3] {
    let size = fine.width / 2;
    let nearer = |k: usize| k.min(fine.width - 1 - k);
    let (mut sum, mut area) = ([0.0; 3], 0.0);
    for (i, j) in [(2 * i - 1, 2 * j - 1), (2 * i, 2 * j - 1), (2 * i - 1, 2 * j), (2 * i, 2 * j)] {
        let w = areas[nearer(j) * size + nearer(i)];
        let l = fine.texel(face, i, j);
        (0..3).for_each(|c| sum[c] += w * f64::from(l[c]));
        area += w;
    }
    sum.map(|s| s / area)
}

/// The solid-angle weighted mean of the texels of `fine` that meet at the sample in direction `d`.
fn mean_around(fine: &SphereImage, d: DVec3, h: f64) -> [f64; 3] {
    // In coordinates where the largest component is ±1, the texel centres lie h away along each axis; the
    // offsets along the axes that are ±1 themselves must go inwards.
    let p = d / d.abs().max_element();
    let on = p.to_array().map(|x| x.abs() > 1.0 - 1e-9);
    let (mut sum, mut area) = ([0.0; 3], 0.0);
    for major in (0..3).filter(|&k| on[k]) {
        let others = [(major + 1) % 3, (major + 2) % 3];
        for corner in 0..4 {
            let mut q = p.to_array();
            let mut outside = false;
            for (bit, &k) in others.iter().enumerate() {
                let step = if corner >> bit & 1 == 1 { h } else { -h };
                outside |= on[k] && step * q[k] > 0.0;
                q[k] += step;
            }
            if outside {
                continue;
            }
            let at = fine.layout.position(fine.width, fine.height, DVec3::from_array(q).normalize());
            let clamp = |x: f64| (x.max(0.0) as usize).min(fine.width - 1);
            let (i, j) = (clamp(at.x), clamp(at.y));
            let w = fine.layout.solid_angle(fine.width, fine.height, at.face, i, j);
            let l = fine.texel(at.face, i, j);
            (0..3).for_each(|c| sum[c] += w * f64::from(l[c]));
            area += w;
        }
    }
    sum.map(|s| if area > 0.0 { s / area } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn f(d: DVec3) -> [f64; 3] {
        [1.0 + d.x * d.y, d.z, (d.x - 0.5 * d.z).exp()]
    }

    #[test]
    fn lookup_at_samples_gives_the_samples() {
        let cube = EdgeCube::from_fn(8, f);
        for face in 0..6 {
            for (i, j) in [(0, 0), (8, 8), (3, 5), (8, 0), (0, 4)] {
                let d = direction(8, face, i, j);
                let got = cube.sample(d.as_vec3().to_array());
                for c in 0..3 {
                    assert!((f64::from(got[c]) - f(d)[c]).abs() < 1e-5);
                }
            }
        }
    }

    #[test]
    fn interpolation_errors_fall_with_the_square_of_the_spacing() {
        let error = |size| {
            let cube = EdgeCube::from_fn(size, f);
            let mut worst = 0.0_f64;
            for k in 0..2000 {
                let d = crate::probe::direction(k, 2000);
                worst = worst.max((f64::from(cube.sample(d.as_vec3().to_array())[2]) - f(d)[2]).abs());
            }
            worst
        };
        let ratio = error(16) / error(32);
        assert!((3.5..5.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn samples_inside_a_face_are_the_mean_of_four_texels() {
        let fine = SphereImage::from_fn(Layout::Cube, 12, 12, |d| {
            [1.0 + d.x as f32, (2.0 * d.y).exp() as f32, (d.z + 0.3 * d.x) as f32]
        });
        let areas = areas(6);
        for (face, k) in (0..6).flat_map(|face| (0..25).map(move |k| (face, k))) {
            let (i, j) = (1 + k % 5, 1 + k / 5);
            let got = mean_of_four(&fine, &areas, [face, i, j]);
            let want = mean_around(&fine, direction(6, face, i, j), 0.5 / 6.0);
            assert!((0..3).all(|c| (got[c] - want[c]).abs() < 1e-12), "{face} {i} {j}: {got:?} {want:?}");
        }
    }

    #[test]
    fn lookup_is_continuous_across_edges() {
        let cube = EdgeCube::from_fn(4, |d| [(9.0 * d.x).sin(), d.y, (7.0 * d.z * d.x).cos()]);
        for k in 0..50 {
            let a = -1.0 + k as f32 / 25.0;
            for (p, q) in
                [([1.0, a, 1.0 - 1e-6], [1.0 - 1e-6, a, 1.0]), ([a, 1.0, -1.0 + 1e-6], [a, 1.0 - 1e-6, -1.0])]
            {
                let (p, q) = (cube.sample(p), cube.sample(q));
                assert!((0..3).all(|c| (p[c] - q[c]).abs() < 1e-4), "{p:?} {q:?}");
            }
        }
    }

    #[test]
    fn samples_share_the_sphere_and_small_lights_keep_their_flux() {
        let mut all = std::collections::BTreeSet::new();
        for k in 0..6 * 81 {
            all.insert(lattice(8, k / 81, k % 81 % 9, k % 81 / 9));
        }
        assert_eq!(all.len(), 6 * 64 + 2);
        let sum: f64 = all.iter().map(|p| solid_angle(8, *p)).sum();
        assert!((sum - 4.0 * std::f64::consts::PI).abs() < 1e-4, "{sum}");
        for (direction, radius) in
            [(DVec3::new(1.0, 1.0, 1.0), 0.0), (DVec3::new(1.0, 0.2, 0.99), 0.1), (DVec3::Y, 0.6)]
        {
            let mut cube = EdgeCube::from_fn(16, |_| [0.0; 3]);
            cube.add(&SmallLight {
                direction: direction.normalize(),
                radius,
                flux: [2.0, 1.0, 0.0],
                cell: None,
            });
            let n = 200_000;
            let mut flux = 0.0;
            for k in 0..n {
                let d = crate::probe::direction(k, n).as_vec3().to_array();
                flux += f64::from(cube.sample(d)[0]) * 4.0 * std::f64::consts::PI / f64::from(n as u32);
            }
            assert!((flux - 2.0).abs() < 4e-3, "{radius}: {flux}");
        }
    }

    #[test]
    fn resampling_keeps_the_integral() {
        let image = SphereImage::from_fn(Layout::LatLong, 64, 32, |d| f(d).map(|x| x as f32));
        let cube = EdgeCube::from_image(&image, 16);
        let mut sum = [0.0; 3];
        let n = 20_000;
        for k in 0..n {
            let v = cube.sample(crate::probe::direction(k, n).as_vec3().to_array());
            (0..3).for_each(|c| sum[c] += f64::from(v[c]) * 4.0 * std::f64::consts::PI / n as f64);
        }
        for (a, b) in sum.iter().zip(image.integral()) {
            assert!((a - b).abs() < 2e-3 * b.abs().max(1.0), "{sum:?} {:?}", image.integral());
        }
    }
}
