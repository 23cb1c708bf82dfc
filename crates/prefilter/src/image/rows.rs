//! Unit directions of an image's rows of texels, and sums of a kernel over directional lights there, many
//! texels at a time.

use crate::light::cell::{nodes_for, step_scale};
use crate::{SmallLight, Zonal};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_parallel::prelude::*;
use steradian_simd::{Arch, Kernel, run};
use steradian_sphere::{Layout, SphereImage};

/// The directions of a row; zero where the layout has none.
#[derive(Default)]
pub(crate) struct Row {
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
    s2: Vec<f32>,
    weights: Vec<f32>,
    sums: [Vec<f64>; 3],
}

impl Row {
    /// `n` directions.
    pub(crate) fn along(&mut self, n: usize, at: impl Fn(usize) -> DVec3) {
        for v in [&mut self.x, &mut self.y, &mut self.z] {
            v.resize(n, 0.0);
        }
        for i in 0..n {
            (self.x[i], self.y[i], self.z[i]) = at(i).into();
        }
    }

    fn fill(&mut self, (layout, width, height): (Layout, usize, usize), row: usize) {
        let (face, j) = (row / height, row % height);
        let at = |i: usize| layout.texel_direction(width, height, face, i, j).unwrap_or(DVec3::ZERO);
        if layout == Layout::Cube {
            for v in [&mut self.x, &mut self.y, &mut self.z] {
                v.resize(width, 0.0);
            }
            // On the plane of its face a row is a line.
            let axis = |d: DVec3| d / d.abs().max_element();
            let (first, last) = (axis(at(0)), axis(at(width - 1)));
            let step = (last - first) / (width - 1).max(1) as f64;
            run(Line { first, step, out: [&mut self.x, &mut self.y, &mut self.z] });
            return;
        }
        self.along(width, at);
    }

    /// Direction of texel `i`.
    pub(crate) fn direction(&self, i: usize) -> Option<DVec3> {
        let d = DVec3::new(self.x[i], self.y[i], self.z[i]);
        (d != DVec3::ZERO).then_some(d)
    }

    /// The sum that [`Row::sums`] computed for channel `c` at texel `i`.
    pub(crate) fn sum(&self, c: usize, i: usize) -> f64 {
        self.sums[c][i]
    }

    /// Σ flux · mean of K over the small light at every texel; disks as if they were points, cells by the
    /// product of two Gauss–Legendre rules, and one by one where that would take too many nodes.
    pub(crate) fn sums(&mut self, small_lights: &[SmallLight], kernel: &dyn Zonal) {
        let n = self.x.len();
        for sum in &mut self.sums {
            sum.clear();
            sum.resize(n, 0.0);
        }
        self.s2.resize(n, 0.0);
        self.weights.resize(n, 0.0);
        let rim = step_scale(kernel);
        for small_light in small_lights {
            let size = small_light.cell.map_or(0.0, |c| c.size());
            let farthest = (0.5 * (kernel.support() + size).min(PI)).sin().powi(2) as f32;
            self.distances(small_light.direction);
            let nearest = self.s2.iter().fold(f32::INFINITY, |m, s2| m.min(*s2));
            if nearest > farthest {
                continue;
            }
            let Some(cell) = small_light.cell else {
                self.add(small_light.flux, 1.0, kernel);
                continue;
            };
            let near = 2.0 * f64::from(nearest).sqrt() - 0.75 * size;
            let ratio = size / kernel.width().max(0.5 * near);
            // Texels at which the cell is integrated on its own: all, or those for which the kernel's rim
            // crosses it.
            let crossed = |s2: &f32| {
                rim.is_finite() && (2.0 * f64::from(*s2).sqrt().asin() - kernel.support()).abs() < size
            };
            let alone: Vec<bool> =
                self.s2.iter().map(|s2| *s2 <= farthest && (ratio > 1.0 || crossed(s2))).collect();
            if ratio <= 1.0 {
                cell.nodes(nodes_for(ratio), &mut |d, w| {
                    self.distances(d);
                    // Beyond every support.
                    self.s2.iter_mut().zip(&alone).filter(|(_, a)| **a).for_each(|(s2, _)| *s2 = 1.0);
                    self.add(small_light.flux, w, kernel);
                });
            }
            for i in (0..n).filter(|i| alone[*i]) {
                if let Some(d) = self.direction(i) {
                    let w = cell.integral(kernel, d, rim) / cell.solid_angle();
                    (0..3).for_each(|c| self.sums[c][i] += w * small_light.flux[c]);
                }
            }
        }
    }

    fn distances(&mut self, from: DVec3) {
        let of = [&self.x, &self.y, &self.z].map(Vec::as_slice);
        run(Squares { of, from, out: &mut self.s2 });
    }

    /// Adds the kernel at the distances, times a flux and a weight.
    fn add(&mut self, flux: [f64; 3], weight: f64, kernel: &dyn Zonal) {
        kernel.fill(&self.s2, &mut self.weights);
        let flux = flux.map(|f| weight * f);
        run(Weighted { weights: &self.weights, flux, sums: self.sums.each_mut().map(Vec::as_mut_slice) });
    }
}

/// Calls `f` with every row's directions and values, on all threads.
pub(crate) fn for_rows(image: &mut SphereImage, f: impl Fn(&mut Row, [&mut [f32]; 3]) + Sync) {
    let (layout, width, height) = (image.layout, image.width, image.height);
    let [r, g, b] = image.planes.each_mut().map(|p| p.par_chunks_mut(width.max(1)));
    r.zip(g).zip(b).enumerate().for_each_init(Row::default, |at, (row, ((r, g), b))| {
        at.fill((layout, width, height), row);
        f(at, [r, g, b]);
    });
}

/// Unit vectors along a line.
struct Line<'a> {
    first: DVec3,
    step: DVec3,
    out: [&'a mut [f64]; 3],
}

impl Kernel for Line<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let ([x, y, z], n) = (self.out, self.first);
        for (i, ((x, y), z)) in x.iter_mut().zip(y).zip(z).enumerate() {
            let i = i as f64;
            let d = [n.x + i * self.step.x, n.y + i * self.step.y, n.z + i * self.step.z];
            let r = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt().recip();
            (*x, *y, *z) = (d[0] * r, d[1] * r, d[2] * r);
        }
    }
}

/// Adds flux times weights to the sums of each channel.
struct Weighted<'a> {
    weights: &'a [f32],
    flux: [f64; 3],
    sums: [&'a mut [f64]; 3],
}

impl Kernel for Weighted<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let [x, y, z] = self.sums;
        for (((w, x), y), z) in self.weights.iter().zip(x).zip(y).zip(z) {
            let w = f64::from(*w);
            *x += self.flux[0] * w;
            *y += self.flux[1] * w;
            *z += self.flux[2] * w;
        }
    }
}

/// sin² of half the angles from a direction.
struct Squares<'a> {
    of: [&'a [f64]; 3],
    from: DVec3,
    out: &'a mut [f32],
}

impl Kernel for Squares<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let ([x, y, z], from) = (self.of, self.from);
        for (out, ((x, y), z)) in self.out.iter_mut().zip(x.iter().zip(y).zip(z)) {
            let d = [x - from.x, y - from.y, z - from.z];
            *out = (0.25 * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2])) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lobe;
    use crate::light::sampled::small_lights_at;

    #[test]
    fn rows_hold_the_directions_and_sums_of_their_texels() {
        let small_lights = [DVec3::new(0.3, 0.8, -0.5), DVec3::new(-0.2, -0.7, 0.1)].map(|d| SmallLight {
            direction: d.normalize(),
            radius: 0.0,
            flux: [3.0, 0.2, 1.0],
            cell: None,
        });
        let small_lights = [
            small_lights[0],
            small_lights[1],
            SmallLight::cell(crate::Cell::texel(3, 2, 9, 6), [0.3, 2.0, 0.0]),
        ];
        for (layout, w, h) in
            [(Layout::Cube, 7, 7), (Layout::Cube, 1, 1), (Layout::LatLong, 8, 4), (Layout::SphereMap, 9, 9)]
        {
            for kernel in [Lobe::ggx(0.2), Lobe::lambert(), Lobe::gaussian(0.5)] {
                let mut image = SphereImage::new(layout, w, h);
                for_rows(&mut image, |row, [r, g, b]| {
                    row.sums(&small_lights, &kernel);
                    for i in 0..w {
                        let Some(d) = row.direction(i) else { continue };
                        let exact = small_lights_at(&small_lights, &kernel, d);
                        for c in 0..3 {
                            assert!((row.sum(c, i) - exact[c]).abs() < 3e-6 * exact[c].max(0.1));
                        }
                        (r[i], g[i], b[i]) = (d.x as f32, d.y as f32, d.z as f32);
                    }
                });
                for k in 0..image.planes[0].len() {
                    let (face, j, i) = (k / (w * h), k / w % h, k % w);
                    let d = layout.texel_direction(w, h, face, i, j).unwrap_or(DVec3::ZERO);
                    let got = image.texel(face, i, j);
                    for c in 0..3 {
                        assert!((f64::from(got[c]) - d[c]).abs() < 1e-7, "{layout:?} {face} {i} {j}");
                    }
                }
            }
        }
    }
}
