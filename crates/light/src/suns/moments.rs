//! Flux and vector flux of lat-long images of constant texels, exactly.

use crate::DiskLight;
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use steradian_numerics::dense;
use steradian_sphere::SphereImage;

/// ∫ L dω and ∫ L ω dω of one channel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moments {
    /// W m⁻² of all directions together.
    pub flux: f64,
    /// Its component along n is the irradiance from the front less that from the back.
    pub vector: DVec3,
}

impl Moments {
    /// Of channel `c` of a disk: E = π L sin²ρ along its direction.
    pub fn of_disk(d: &DiskLight, c: usize) -> Self {
        let flux = d.radiance[c] * d.solid_angle();
        Self { flux, vector: d.direction * (PI * d.radiance[c] * d.angular_radius.sin().powi(2)) }
    }

    /// The difference.
    pub fn minus(&self, other: &Self) -> Self {
        Self { flux: self.flux - other.flux, vector: self.vector - other.vector }
    }

    fn add(&mut self, l: f64, omega: f64, vector: DVec3) {
        self.flux += l * omega;
        self.vector += vector * l;
    }

    /// How far it is from `other`, relative to the flux of `whole`.
    pub fn apart(&self, other: &Self, whole: &Self) -> f64 {
        let d = self.minus(other);
        let off = d.flux.abs().max(d.vector.length());
        if off == 0.0 { 0.0 } else { off / whole.flux.abs().max(f64::MIN_POSITIVE) }
    }
}

/// Integrals over the texels of a lat-long image.
pub struct Grid {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Per row: solid angle, ∫ sin²θ dθ, ∫ y dω of a texel, θ of its centre.
    rows: Vec<[f64; 4]>,
    /// Per column: ∫ cos φ dφ, ∫ sin φ dφ, φ of the centre.
    columns: Vec<[f64; 3]>,
}

impl Grid {
    /// The grid of an image of this size.
    pub fn new(width: usize, height: usize) -> Self {
        let step = TAU / width as f64;
        let theta = |j: usize| PI * j as f64 / height as f64;
        let row = |j: usize| {
            let (a, b) = (theta(j), theta(j + 1));
            let solid = 2.0 * (0.5 * (a + b)).sin() * (0.5 * (b - a)).sin();
            // ∫ sin²θ = ½ (Δ − sin Δ cos(a + b)), ∫ cos θ sin θ = ½ sin Δ sin(a + b).
            let (delta, sum) = (b - a, a + b);
            let across = 0.5 * (delta - delta.sin() * sum.cos());
            [step * solid, across, step * 0.5 * delta.sin() * sum.sin(), 0.5 * sum]
        };
        let column = |i: usize| {
            let phi = (i as f64 + 0.5) * step - PI;
            let chord = 2.0 * (0.5 * step).sin();
            [chord * phi.cos(), chord * phi.sin(), phi]
        };
        Self {
            width,
            height,
            rows: (0..height).map(row).collect(),
            columns: (0..width).map(column).collect(),
        }
    }

    /// Solid angle of a texel.
    pub fn omega(&self, k: usize) -> f64 {
        self.rows[k / self.width][0]
    }

    /// ∫ ω dω over a texel.
    pub fn vector(&self, k: usize) -> DVec3 {
        let (r, c) = (&self.rows[k / self.width], &self.columns[k % self.width]);
        DVec3::new(r[1] * c[0], r[2], r[1] * c[1])
    }

    /// The direction of a texel's centre.
    pub fn direction(&self, k: usize) -> DVec3 {
        let (theta, phi) = (self.rows[k / self.width][3], self.columns[k % self.width][2]);
        DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
    }

    /// sin θ of the row of a texel.
    pub fn sine(&self, k: usize) -> f64 {
        self.rows[k / self.width][3].sin()
    }

    /// The eight texels around one; across a pole the row continues half a turn away.
    pub fn around(&self, k: usize) -> [usize; 8] {
        let (w, i, j) = (self.width, k % self.width, k / self.width);
        let at = |di: usize, up: bool, down: bool| {
            let i = i + w + di - 1;
            if (up && j == 0) || (down && j + 1 == self.height) {
                return j * w + (i + w / 2) % w;
            }
            (j + usize::from(down) - usize::from(up)) * w + i % w
        };
        [
            at(0, false, false),
            at(2, false, false),
            at(1, true, false),
            at(1, false, true),
            at(0, true, false),
            at(2, true, false),
            at(0, false, true),
            at(2, false, true),
        ]
    }

    /// Moments of every channel, row by row.
    pub fn moments(&self, image: &SphereImage) -> [Moments; 3] {
        std::array::from_fn(|c| {
            let mut all = Moments::default();
            for (j, row) in image.planes[c].chunks_exact(self.width).enumerate() {
                let mut part = Moments::default();
                for (i, l) in row.iter().enumerate() {
                    let k = j * self.width + i;
                    part.add(f64::from(*l), self.omega(k), self.vector(k));
                }
                all.flux += part.flux;
                all.vector += part.vector;
            }
            all
        })
    }

    /// Moments of `light(k)` over some texels.
    pub fn moments_of(&self, texels: &[usize], light: impl Fn(usize) -> f64) -> Moments {
        let mut all = Moments::default();
        texels.iter().for_each(|&k| all.add(light(k), self.omega(k), self.vector(k)));
        all
    }

    /// Multiplies each channel by 1 + a₀ + a·ω, so that its moments become `wanted`, to single precision
    /// twice. The largest such change; `None`, and the image as it was, where one would exceed `most`.
    pub fn restore(&self, image: &mut SphereImage, wanted: &[Moments; 3], most: f64) -> Option<f64> {
        let mut largest: f64 = 0.0;
        let mut planes = image.planes.clone();
        for (c, plane) in planes.iter_mut().enumerate() {
            for _ in 0..3 {
                let a = self.factor(plane, &wanted[c])?;
                let change = a[0].abs() + DVec3::new(a[1], a[2], a[3]).length();
                if change.is_nan() || change > most {
                    return None;
                }
                largest = largest.max(change);
                for (k, l) in plane.iter_mut().enumerate() {
                    let d = self.direction(k);
                    *l = (f64::from(*l) * (1.0 + a[0] + a[1] * d.x + a[2] * d.y + a[3] * d.z)) as f32;
                }
            }
        }
        image.planes = planes;
        Some(largest)
    }

    /// a₀ and a: the moments of L (a₀ + a·ω) are what is missing. A black channel that misses nothing
    /// takes 0.
    fn factor(&self, plane: &[f32], wanted: &Moments) -> Option<[f64; 4]> {
        let mut m = [[0.0; 4]; 4];
        let mut now = Moments::default();
        for (k, l) in plane.iter().enumerate() {
            let (l, omega, v, d) = (f64::from(*l), self.omega(k), self.vector(k), self.direction(k));
            now.add(l, omega, v);
            for (row, moment) in m.iter_mut().zip([omega, v.x, v.y, v.z]) {
                row.iter_mut().zip([1.0, d.x, d.y, d.z]).for_each(|(m, b)| *m += l * moment * b);
            }
        }
        let d = wanted.minus(&now);
        let missing = [d.flux, d.vector.x, d.vector.y, d.vector.z];
        if missing == [0.0; 4] {
            return Some([0.0; 4]);
        }
        let x = dense::solve(m.map(Vec::from).into(), missing.map(|x| vec![x]).into(), 1e-9)?;
        Some(std::array::from_fn(|k| x[k][0]))
    }
}
