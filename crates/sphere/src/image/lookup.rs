//! Interpolated lookup that knows no seams.
//!
//! Inside a face this is the plain formula on texel centres. Beyond the border of a face:
//!
//! - lat-long: columns wrap, and a row beyond a pole is the row reflected and turned by half a turn;
//! - octahedral: the net folds back on itself along each edge;
//! - cube and paraboloid: a face's lattice continues on its own plane or paraboloid, the missing texels take
//!   the value that the face which really holds their direction has there, and within half a texel of an edge
//!   the faces that meet are blended, each with weight ½ on the edge and ⅓ in a corner. Taking the
//!   neighbour's texels by adjacency instead, as hardware does, is continuous too, but bent: its error is of
//!   first order in the texel size along every edge, this one's of second order as inside;
//! - sphere and angular map: within two or three texels of the rim, which is a single direction, the value is
//!   a quadratic through the ring around it.

use super::SphereImage;
use crate::layout::{Layout, cube, paraboloid};
use glam::DVec3;

/// How texels are interpolated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Filter {
    /// The texel that contains the direction.
    Nearest,
    /// Between the four nearest texel centres.
    Bilinear,
    /// Catmull & Rom 1974 on 4 × 4 texel centres; interpolates them, and overshoots beside sharp edges.
    #[default]
    CatmullRom,
    /// The same, limited to the range of the four nearest texel centres: no rims beside sharp edges, and no
    /// longer linear in the texels. For pictures that are looked at.
    LimitedCatmullRom,
}

/// Weights along one axis: `first` is the index of the first of `n` taps.
struct Taps {
    first: isize,
    n: usize,
    w: [f64; 4],
}

impl Filter {
    fn taps(self, x: f64) -> Taps {
        let f = (x - 0.5).floor();
        let (t, first) = (x - 0.5 - f, f as isize);
        match self {
            Self::Nearest => Taps { first: x.floor() as isize, n: 1, w: [1.0, 0.0, 0.0, 0.0] },
            Self::Bilinear => Taps { first, n: 2, w: [1.0 - t, t, 0.0, 0.0] },
            Self::CatmullRom | Self::LimitedCatmullRom => Taps { first: first - 1, n: 4, w: catmull_rom(t) },
        }
    }

    /// How far a lookup reaches, in texels along the diagonal.
    fn reach(self) -> f64 {
        match self {
            Self::Nearest => 1.0,
            Self::Bilinear => 1.415,
            Self::CatmullRom | Self::LimitedCatmullRom => 2.83,
        }
    }
}

impl Taps {
    /// The same for a row of `n` texels that has no neighbours.
    fn within(self, n: usize, x: f64) -> Self {
        let fits = self.first >= 0 && self.first as usize + self.n <= n;
        if fits || self.n != 4 || n < 3 {
            return self;
        }
        // Lagrange's parabola through three texels.
        let first = (self.first + 1).clamp(0, n as isize - 3);
        let t = x - 0.5 - first as f64;
        let w = [0.5 * (t - 1.0) * (t - 2.0), t * (2.0 - t), 0.5 * t * (t - 1.0), 0.0];
        Self { first, n: 3, w }
    }
}

/// Weights of the texels at −1, 0, 1, 2 for a position t in [0, 1].
#[inline(always)]
pub(super) fn catmull_rom(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ]
}

/// `v` within the range of `of`.
fn within<const N: usize>(v: f64, of: [f64; N]) -> f64 {
    let low = of.into_iter().fold(f64::INFINITY, f64::min);
    v.max(low).min(of.into_iter().fold(f64::NEG_INFINITY, f64::max))
}

fn add(a: &mut [f64; 3], w: f64, v: [f64; 3]) {
    for c in 0..3 {
        a[c] += w * v[c];
    }
}

impl SphereImage {
    /// The value at unit direction `d`.
    pub fn lookup(&self, filter: Filter, d: DVec3) -> [f32; 3] {
        if filter == Filter::Nearest {
            return self.nearest(d);
        }
        self.lookup_f64(filter, d).map(|v| v as f32)
    }

    pub(crate) fn lookup_f64(&self, filter: Filter, d: DVec3) -> [f64; 3] {
        match self.layout {
            Layout::Cube => self.cube_lookup(filter, d),
            Layout::DualParaboloid => self.paraboloid_lookup(filter, d),
            Layout::SphereMap | Layout::AngularMap | Layout::AngularLattice => self.disc_lookup(filter, d),
            Layout::LatLong | Layout::Octahedral => {
                let p = self.position(d);
                self.interpolate(filter, 0, p.x, p.y)
            }
        }
    }

    /// The lattice of one face, continued beyond its border, at (x, y).
    pub(crate) fn interpolate(&self, filter: Filter, face: usize, x: f64, y: f64) -> [f64; 3] {
        let (tx, ty) = (filter.taps(x), filter.taps(y));
        if filter == Filter::LimitedCatmullRom {
            return self.limited(face, &tx, &ty);
        }
        let mut out = [0.0; 3];
        let fits = |t: &Taps, n: usize| t.first >= 0 && t.first as usize + t.n <= n;
        if fits(&tx, self.width) && fits(&ty, self.height) {
            let (i, j) = (tx.first as usize, ty.first as usize);
            for b in 0..ty.n {
                let k = self.index(face, i, j + b);
                for (plane, out) in self.planes.iter().zip(&mut out) {
                    let row = &plane[k..k + tx.n];
                    let sum: f64 = row.iter().zip(tx.w).map(|(&v, w)| w * f64::from(v)).sum();
                    *out += ty.w[b] * sum;
                }
            }
            return out;
        }
        for b in 0..ty.n {
            for a in 0..tx.n {
                let w = tx.w[a] * ty.w[b];
                if w != 0.0 {
                    add(&mut out, w, self.fetch(filter, face, tx.first + a as isize, ty.first + b as isize));
                }
            }
        }
        out
    }

    /// Limited row by row, then between the rows. Limiting the sum to the range of the four texels instead
    /// would jump where the four change, since what lies in the range of one four need not lie in that of the
    /// next.
    fn limited(&self, face: usize, tx: &Taps, ty: &Taps) -> [f64; 3] {
        let cubic = |w: &[f64; 4], v: [[f64; 3]; 4]| {
            std::array::from_fn(|c| {
                let sum: f64 = (0..4).map(|k| w[k] * v[k][c]).sum();
                within(sum, [v[1][c], v[2][c]])
            })
        };
        let texel = |a: usize, b: usize| {
            self.fetch(Filter::LimitedCatmullRom, face, tx.first + a as isize, ty.first + b as isize)
        };
        cubic(&ty.w, std::array::from_fn(|b| cubic(&tx.w, std::array::from_fn(|a| texel(a, b)))))
    }

    fn texel_f64(&self, face: usize, i: usize, j: usize) -> [f64; 3] {
        self.texel(face, i, j).map(f64::from)
    }

    /// The value that stands for lattice point (i, j) of a face, inside it or beyond its border.
    pub(super) fn fetch(&self, filter: Filter, face: usize, i: isize, j: isize) -> [f64; 3] {
        let (w, h) = (self.width as isize, self.height as isize);
        if (0..w).contains(&i) && (0..h).contains(&j) {
            return self.texel_f64(face, i as usize, j as usize);
        }
        match self.layout {
            Layout::LatLong => self.latlong_fetch(i, j),
            Layout::Octahedral => {
                let (i, j) = if (0..w).contains(&i) { (i, j) } else { (reflect(i, w), h - 1 - j) };
                let (i, j) = if (0..h).contains(&j) { (i, j) } else { (w - 1 - i, reflect(j, h)) };
                self.texel_f64(0, i.clamp(0, w - 1) as usize, j.clamp(0, h - 1) as usize)
            }
            Layout::Cube | Layout::DualParaboloid => {
                let s = (2 * i + 1) as f64 / w as f64 - 1.0;
                let t = (2 * j + 1) as f64 / h as f64 - 1.0;
                let d = if self.layout == Layout::Cube {
                    cube::vector(face, s, t)
                } else {
                    paraboloid::direction(face, s, -t)
                };
                let p = self.position(d.unwrap_or(DVec3::Z));
                self.clamped(filter, p.face, p.x, p.y)
            }
            Layout::SphereMap | Layout::AngularMap | Layout::AngularLattice => {
                self.texel_f64(face, i.clamp(0, w - 1) as usize, j.clamp(0, h - 1) as usize)
            }
        }
    }

    fn latlong_fetch(&self, i: isize, j: isize) -> [f64; 3] {
        let (w, h) = (self.width as isize, self.height as isize);
        let column =
            |i: isize, j: isize| self.texel_f64(0, i.rem_euclid(w) as usize, j.clamp(0, h - 1) as usize);
        if (0..h).contains(&j) {
            return column(i, j);
        }
        let j = reflect(j, h);
        let (a, b) = (column(i + w / 2, j), column(i + (w + 1) / 2, j));
        std::array::from_fn(|c| 0.5 * (a[c] + b[c]))
    }

    /// A face without its surroundings: near its border parabolas through the last three texels instead of
    /// cubics, and for lookups that must not overshoot, bilinear with the border texels repeated.
    fn clamped(&self, filter: Filter, face: usize, x: f64, y: f64) -> [f64; 3] {
        let filter = if filter == Filter::LimitedCatmullRom { Filter::Bilinear } else { filter };
        let (tx, ty) = (filter.taps(x).within(self.width, x), filter.taps(y).within(self.height, y));
        let index = |v: isize, n: usize| v.clamp(0, n as isize - 1) as usize;
        let mut out = [0.0; 3];
        for b in 0..ty.n {
            for a in 0..tx.n {
                let i = index(tx.first + a as isize, self.width);
                let j = index(ty.first + b as isize, self.height);
                add(&mut out, tx.w[a] * ty.w[b], self.texel_f64(face, i, j));
            }
        }
        out
    }

    fn cube_face(&self, filter: Filter, face: usize, d: DVec3) -> [f64; 3] {
        let (s, t) = cube::project(face, d);
        self.interpolate(
            filter,
            face,
            0.5 * (s + 1.0) * self.width as f64,
            0.5 * (t + 1.0) * self.height as f64,
        )
    }

    /// Weight 1 for the face that holds `d`; for the others 1 on the shared edge, falling to 0 at half a
    /// texel.
    fn cube_lookup(&self, filter: Filter, d: DVec3) -> [f64; 3] {
        let main = cube::face(d);
        let a = d.abs();
        let m = a.max_element();
        let strip = 1.0 / self.width.min(self.height) as f64;
        let mut out = self.cube_face(filter, main, d);
        if [a.x, a.y, a.z].iter().filter(|&&v| m - v < strip * m).count() < 2 {
            return out;
        }
        let mut total = 1.0;
        for axis in 0..3 {
            let face = 2 * axis + usize::from(d[axis] < 0.0);
            let w = 1.0 - (1.0 - a[axis] / m) / strip;
            if face != main && w > 0.0 {
                add(&mut out, w, self.cube_face(filter, face, d));
                total += w;
            }
        }
        out.map(|v| v / total)
    }

    /// Each hemisphere's share goes from 1 to 0 within half a texel of the rim, on both sides of it.
    fn paraboloid_lookup(&self, filter: Filter, d: DVec3) -> [f64; 3] {
        let face = |f: usize| {
            let (s, t) = paraboloid::project(f, d);
            let (x, y) = (0.5 * (s + 1.0) * self.width as f64, 0.5 * (1.0 - t) * self.height as f64);
            self.interpolate(filter, f, x, y)
        };
        // Near the rim r = 1 − z to first order, and half a texel is 1/n.
        let share = 0.5 + 0.5 * d.z * self.width.min(self.height) as f64;
        if share >= 1.0 {
            return face(0);
        }
        if share <= 0.0 {
            return face(1);
        }
        let (front, back) = (face(0), face(1));
        std::array::from_fn(|c| share * front[c] + (1.0 - share) * back[c])
    }

    /// Outside the cap around the rim's direction plainly; inside, with q the distance from the rim's
    /// direction in units of the cap's radius, f and f' the values on the ring at this azimuth and opposite,
    /// and m the ring's mean (for the cubic extrapolated inwards): m + q (f − f')/2 + q² ((f + f')/2 − m).
    fn disc_lookup(&self, filter: Filter, d: DVec3) -> [f64; 3] {
        let (w, h) = (self.width as f64, self.height as f64);
        let o = self.layout.offset();
        let r0 = (1.0 - 2.0 * (filter.reach() + o) / w.min(h)).max(0.25);
        let at = |r: f64, cos: f64, sin: f64| {
            self.interpolate(filter, 0, 0.5 * (r * cos + 1.0) * w + o, 0.5 * (1.0 - r * sin) * h + o)
        };
        let p = self.position(d);
        let (s, t) = (2.0 * (p.x - o) / w - 1.0, 1.0 - 2.0 * (p.y - o) / h);
        let r = s.hypot(t);
        if r <= r0 || r.is_nan() {
            return self.interpolate(filter, 0, p.x, p.y);
        }
        // Angles from the rim's direction.
        let angle = |r: f64| {
            if self.layout != Layout::SphereMap {
                std::f64::consts::PI * (1.0 - r)
            } else {
                2.0 * r.min(1.0).acos()
            }
        };
        let rho = d.x.hypot(d.y);
        let q = rho.atan2(if self.layout != Layout::SphereMap { d.z } else { -d.z }) / angle(r0);
        let (cos, sin) = (s / r, t / r);
        let (here, there) = (at(r0, cos, sin), at(r0, -cos, -sin));
        let mean = |r: f64| {
            let mut mean = [0.0; 3];
            for k in 0..16 {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / 16.0).sin_cos();
                add(&mut mean, 1.0 / 16.0, at(r, cos, sin));
            }
            mean
        };
        let mut middle = mean(r0);
        if filter == Filter::CatmullRom && r0 > 0.5 {
            // A ring's mean is f + O(α²): two of them extrapolate to the middle.
            let r1 = r0 - 4.0 / w.min(h);
            let (a0, a1) = (angle(r0).powi(2), angle(r1).powi(2));
            let outer = mean(r1);
            middle = std::array::from_fn(|c| middle[c] - (outer[c] - middle[c]) * a0 / (a1 - a0));
        }
        std::array::from_fn(|c| {
            let (odd, even) = (0.5 * (here[c] - there[c]), 0.5 * (here[c] + there[c]));
            let v = middle[c] + q * odd + q * q * (even - middle[c]);
            if filter == Filter::LimitedCatmullRom { within(v, [here[c], there[c], middle[c]]) } else { v }
        })
    }
}

/// Index beyond [0, n) mirrored at the border.
fn reflect(i: isize, n: isize) -> isize {
    if i < 0 { -1 - i } else { 2 * n - 1 - i }
}
