//! A lat-long image as cells on which radiance is a bilinear polynomial of (φ, θ), and their moments.

use super::geometry::{Axis, Rect};
use super::legendre::{N, Row, Square, hats};
use std::f64::consts::{PI, TAU};
use steradian_sphere::SphereImage;

/// Interpolation of texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lookup {
    /// Each texel's value over its exact lat-long cell.
    #[default]
    Constant,
    /// Bilinear in (φ, θ) between texel centres; across the seam, and over the poles from the opposite side.
    Bilinear,
}

/// A block of cells: columns and rows from, to (exclusive).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Block {
    /// Columns.
    pub i: [u32; 2],
    /// Rows.
    pub j: [u32; 2],
}

impl Block {
    /// Number of cells.
    pub fn len(&self) -> usize {
        (self.i[1] - self.i[0]) as usize * (self.j[1] - self.j[0]) as usize
    }

    /// Halves the block along `axis`, or along the other axis where it has only one cell along `axis`. The
    /// block must have two or more cells.
    pub fn halves(&self, axis: Axis) -> [Self; 2] {
        let mut out = [*self; 2];
        let wide = self.i[1] - self.i[0] > 1;
        let tall = self.j[1] - self.j[0] > 1;
        if wide && (axis == Axis::Phi || !tall) {
            let m = u32::midpoint(self.i[0], self.i[1]);
            (out[0].i[1], out[1].i[0]) = (m, m);
        } else {
            let m = u32::midpoint(self.j[0], self.j[1]);
            (out[0].j[1], out[1].j[0]) = (m, m);
        }
        out
    }
}

/// ∫ L P_i(x) P_j(y) dφ dθ over a rectangle, with x and y its coordinates scaled to [−1, 1], per channel.
#[derive(Debug, Clone)]
pub(super) struct Moments {
    /// Indexed `[channel][i][j]`.
    pub m: [Square; 3],
    /// ∫ |L| dφ dθ (for bilinear cells an upper bound of it).
    pub abs: [f64; 3],
    /// A bound of ∫ |L − mean of L| dφ dθ.
    pub spread: [f64; 3],
    /// The brightest texel: its largest channel's magnitude, φ and θ. 0 where there is none to speak of.
    pub peak: [f64; 3],
}

impl Moments {
    /// Moments of zero radiance.
    pub const ZERO: Self = Self { m: [[[0.0; N]; N]; 3], abs: [0.0; 3], spread: [0.0; 3], peak: [0.0; 3] };

    /// No light at all?
    pub fn is_dark(&self) -> bool {
        self.abs == [0.0; 3]
    }
}

/// Radiance at the corners of a rectangle, per channel: (φ0,θ0), (φ1,θ0), (φ0,θ1), (φ1,θ1).
pub(super) type Corners = [[f64; 4]; 3];

/// The image as a grid of cells.
pub(super) struct ImageCells<'a> {
    image: &'a SphereImage,
    lookup: Lookup,
}

impl<'a> ImageCells<'a> {
    /// The cells of a lat-long image.
    pub fn new(image: &'a SphereImage, lookup: Lookup) -> Self {
        Self { image, lookup }
    }

    /// Every cell. Bilinear cells lie between texel centres; the first and last row reach the poles.
    pub fn all(&self) -> Block {
        let rows = match self.lookup {
            Lookup::Constant => self.image.height,
            Lookup::Bilinear => self.image.height + 1,
        };
        Block { i: [0, self.image.width as u32], j: [0, rows as u32] }
    }

    fn phi(&self, i: u32) -> f64 {
        let shift = if self.lookup == Lookup::Bilinear { 0.5 } else { 0.0 };
        ((f64::from(i) + shift) / self.image.width as f64 - 0.5) * TAU
    }

    fn theta(&self, j: u32) -> f64 {
        let h = self.image.height;
        match self.lookup {
            Lookup::Constant => PI * f64::from(j) / h as f64,
            Lookup::Bilinear if j == 0 => 0.0,
            Lookup::Bilinear if j as usize > h => PI,
            Lookup::Bilinear => PI * (f64::from(j) - 0.5) / h as f64,
        }
    }

    /// The rectangle of a block.
    pub fn rect(&self, b: &Block) -> Rect {
        Rect { phi: b.i.map(|i| self.phi(i)), theta: b.j.map(|j| self.theta(j)) }
    }

    /// Texel value for constant cells; for bilinear ones the value at grid point (i, j), where row 0 is the
    /// pole: the mean of the first row's texel and its opposite.
    fn value(&self, channel: usize, i: usize, j: usize) -> f64 {
        let (w, h) = (self.image.width, self.image.height);
        let plane = &self.image.planes[channel];
        let texel = |i: usize, j: usize| f64::from(plane[j * w + i % w]);
        match self.lookup {
            Lookup::Constant => texel(i, j),
            Lookup::Bilinear if j == 0 || j > h => {
                let row = if j == 0 { 0 } else { h - 1 };
                // With an odd width no texel is exactly opposite: the two nearest are averaged.
                let opposite = 0.5 * (texel(i + w / 2, row) + texel(i + w.div_ceil(2), row));
                0.5 * (texel(i, row) + opposite)
            }
            Lookup::Bilinear => texel(i, j - 1),
        }
    }

    /// Radiance at the corners of `part` of cell (i, j).
    pub fn corners(&self, i: u32, j: u32, part: &Rect) -> Corners {
        let (i, j) = (i as usize, j as usize);
        std::array::from_fn(|c| match self.lookup {
            Lookup::Constant => [self.value(c, i, j); 4],
            Lookup::Bilinear => {
                let v = |a, b| self.value(c, i + a, j + b);
                let v = [v(0, 0), v(1, 0), v(0, 1), v(1, 1)];
                let (p, t) = (
                    [self.phi(i as u32), self.phi(i as u32 + 1)],
                    [self.theta(j as u32), self.theta(j as u32 + 1)],
                );
                let at = |phi: f64, theta: f64| {
                    bilinear(&v, (phi - p[0]) / (p[1] - p[0]), (theta - t[0]) / (t[1] - t[0]))
                };
                let [a, b] = part.phi;
                let [d, e] = part.theta;
                [at(a, d), at(b, d), at(a, e), at(b, e)]
            }
        })
    }

    /// Moment weights of a block's grid lines along one axis: `edges` from −1 to 1.
    fn weights(&self, edges: &[f64]) -> Vec<Row> {
        let n = edges.len() - 1;
        let points = if self.lookup == Lookup::Bilinear { n + 1 } else { n };
        let mut out = vec![[0.0; N]; points];
        for k in 0..n {
            let [fall, rise] = hats(edges[k], edges[k + 1]);
            let right = if self.lookup == Lookup::Bilinear { k + 1 } else { k };
            for d in 0..N {
                out[k][d] += fall[d];
                out[right][d] += rise[d];
            }
        }
        out
    }

    /// Moments of a block, summed from the image.
    pub fn moments(&self, b: &Block) -> Moments {
        let rect = self.rect(b);
        let scaled = |x: f64, [a, e]: [f64; 2]| 2.0 * (x - a) / (e - a) - 1.0;
        let edges_x: Vec<f64> = (b.i[0]..=b.i[1]).map(|i| scaled(self.phi(i), rect.phi)).collect();
        let edges_y: Vec<f64> = (b.j[0]..=b.j[1]).map(|j| scaled(self.theta(j), rect.theta)).collect();
        let (wx, wy) = (self.weights(&edges_x), self.weights(&edges_y));
        let [dx, dy] = rect.size();
        let scale = 0.25 * dx * dy;
        let mut out = Moments::ZERO;
        for c in 0..3 {
            let value = |k: usize, l: usize| self.value(c, b.i[0] as usize + k, b.j[0] as usize + l);
            let m = &mut out.m[c];
            for (l, wy) in wy.iter().enumerate() {
                let mut row = [0.0; N];
                let mut abs = 0.0;
                for (k, wx) in wx.iter().enumerate() {
                    let v = value(k, l);
                    abs += v.abs() * wx[0];
                    if v.abs() > out.peak[0] {
                        out.peak = [v.abs(), k as f64, l as f64];
                    }
                    for i in 0..N {
                        row[i] += v * wx[i];
                    }
                }
                out.abs[c] += scale * abs * wy[0];
                for i in 0..N {
                    for j in 0..N {
                        m[i][j] += scale * row[i] * wy[j];
                    }
                }
            }
            let mean = m[0][0] / (dx * dy);
            for (l, wy) in wy.iter().enumerate() {
                let row: f64 = wx.iter().enumerate().map(|(k, wx)| (value(k, l) - mean).abs() * wx[0]).sum();
                out.spread[c] += scale * row * wy[0];
            }
        }
        out.peak = self.placed(b, out.peak);
        out
    }

    /// A peak at grid point (k, l) of a block → at its (φ, θ): a texel's centre, within the block.
    fn placed(&self, b: &Block, [v, k, l]: [f64; 3]) -> [f64; 3] {
        let (i, j) = (b.i[0] + k as u32, b.j[0] + l as u32);
        match self.lookup {
            Lookup::Constant => {
                [v, 0.5 * (self.phi(i) + self.phi(i + 1)), 0.5 * (self.theta(j) + self.theta(j + 1))]
            }
            Lookup::Bilinear => [v, self.phi(i), self.theta(j)],
        }
    }
}

/// Bilinear interpolation of corner values at u, v in [0, 1].
pub(super) fn bilinear(v: &[f64; 4], u: f64, w: f64) -> f64 {
    (v[0] + (v[1] - v[0]) * u) * (1.0 - w) + (v[2] + (v[3] - v[2]) * u) * w
}

/// Moments of bilinear radiance over one rectangle. Its rule is Gauss–Legendre's, whose error is in
/// proportion to ∫|L| alone: no spread.
pub(super) fn corner_moments(corners: &Corners, rect: &Rect) -> Moments {
    let [dx, dy] = rect.size();
    let area = dx * dy;
    let mut out = Moments::ZERO;
    for (c, v) in corners.iter().enumerate() {
        let m = &mut out.m[c];
        m[0][0] = area * 0.25 * (v[0] + v[1] + v[2] + v[3]);
        m[1][0] = area / 12.0 * (v[1] + v[3] - v[0] - v[2]);
        m[0][1] = area / 12.0 * (v[2] + v[3] - v[0] - v[1]);
        m[1][1] = area / 36.0 * (v[0] + v[3] - v[1] - v[2]);
        out.abs[c] = area * v.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::geometry::Chart;
    use super::*;
    use glam::DVec3;
    use steradian_sphere::Layout;

    #[test]
    fn cells_read_the_image_as_lookups_do() {
        let world = Chart { x: DVec3::X, y: DVec3::Y, z: DVec3::Z };
        for (w, h) in [(8, 4), (7, 5), (1, 1), (2, 3)] {
            let mut image = SphereImage::new(Layout::LatLong, w, h);
            for (c, plane) in image.planes.iter_mut().enumerate() {
                for (k, v) in plane.iter_mut().enumerate() {
                    *v = ((k * 37 + c * 11) % 17) as f32;
                }
            }
            for lookup in [Lookup::Constant, Lookup::Bilinear] {
                let cells = ImageCells::new(&image, lookup);
                let all = cells.all();
                for j in 0..all.j[1] {
                    for i in 0..all.i[1] {
                        let rect = cells.rect(&Block { i: [i, i + 1], j: [j, j + 1] });
                        for (u, v) in [(0.3, 0.6), (0.9, 0.1), (0.5, 0.99)] {
                            let phi = rect.phi[0] + u * rect.size()[0];
                            let theta = rect.theta[0] + v * rect.size()[1];
                            let d = world.direction(phi, theta);
                            let looked = match lookup {
                                Lookup::Constant => image.nearest(d),
                                Lookup::Bilinear => image.bilinear(d),
                            };
                            for (c, corners) in cells.corners(i, j, &rect).iter().enumerate() {
                                let mine = bilinear(corners, u, v);
                                assert!(
                                    (mine - f64::from(looked[c])).abs() < 1e-4,
                                    "{w}x{h} {lookup:?} {i} {j}"
                                );
                            }
                        }
                    }
                }
            }
        }
    }
}
