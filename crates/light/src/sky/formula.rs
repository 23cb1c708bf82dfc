//! Skies of one line: overcast, furnace, and the studio.

use glam::DVec3;
use std::f64::consts::PI;
use steradian_parallel::prelude::*;
use steradian_sphere::{Layout, SphereImage};

/// A lat-long image of `f`, averaged over `n`² points per texel (spread evenly in its two angles).
fn fill(width: usize, height: usize, n: usize, f: impl Fn(DVec3) -> [f64; 3] + Sync) -> SphereImage {
    let mut image = SphereImage::new(Layout::LatLong, width, height);
    if width == 0 {
        return image;
    }
    let azimuths: Vec<(f64, f64)> =
        (0..width * n).map(|i| (2.0 * PI * (i as f64 + 0.5) / (width * n) as f64 - PI).sin_cos()).collect();
    let [r, g, b] = image.planes.each_mut().map(|p| p.par_chunks_mut(width));
    r.zip(g).zip(b).enumerate().for_each(|(j, ((r, g), b))| {
        let rows: Vec<(f64, f64)> =
            (0..n).map(|k| (PI * ((j * n + k) as f64 + 0.5) / (height * n) as f64).sin_cos()).collect();
        for i in 0..width {
            let (mut sum, mut weight) = ([0.0; 3], 0.0);
            for (sin, cos) in &rows {
                for (sin_phi, cos_phi) in &azimuths[i * n..(i + 1) * n] {
                    let v = f(DVec3::new(sin * cos_phi, *cos, sin * sin_phi));
                    sum.iter_mut().zip(v).for_each(|(s, v)| *s += sin * v);
                    weight += sin;
                }
            }
            [r[i], g[i], b[i]] = sum.map(|s| (s / weight) as f32);
        }
    });
    image
}

/// The same radiance from everywhere.
pub(super) fn furnace(radiance: [f64; 3], width: usize, height: usize) -> SphereImage {
    let mut image = SphereImage::new(Layout::LatLong, width, height);
    image.planes.iter_mut().zip(radiance).for_each(|(p, v)| p.fill(v as f32));
    image
}

/// The CIE standard overcast sky (Moon & Spencer 1942; CIE S 011): L(γ) = L_z (1 + 2 sin γ)/3 at elevation γ,
/// horizontal irradiance 7π/9 L_z, over a diffuse ground of the given albedo.
pub(super) fn overcast(zenith: f64, ground: [f64; 3], width: usize, height: usize) -> SphereImage {
    let below = ground.map(|a| a * 7.0 / 9.0 * zenith);
    fill(width, height, 1, |d| if d.y >= 0.0 { [zenith * (1.0 + 2.0 * d.y) / 3.0; 3] } else { below })
}

/// A rectangular light seen from the origin: where it stands, how wide and high it is (tangents of half
/// angles), how soft its edge, and its radiance.
struct SoftBox {
    towards: DVec3,
    half: [f64; 2],
    edge: f64,
    radiance: [f64; 3],
}

/// Placed by eye, as a photographer lights a product.
const BOXES: [SoftBox; 6] = [
    // Key, front left.
    SoftBox {
        towards: DVec3::new(-0.75, 0.6, 0.7),
        half: [0.42, 0.5],
        edge: 0.06,
        radiance: [13.0, 12.4, 11.6],
    },
    // Fill, front right, large and dim.
    SoftBox {
        towards: DVec3::new(0.95, 0.25, 0.55),
        half: [0.35, 0.6],
        edge: 0.12,
        radiance: [2.6, 2.8, 3.1],
    },
    // Overhead.
    SoftBox { towards: DVec3::new(0.05, 1.0, 0.1), half: [0.6, 0.38], edge: 0.08, radiance: [6.0, 6.0, 6.0] },
    // Rim strips, behind on either side.
    SoftBox {
        towards: DVec3::new(-0.85, 0.25, -0.75),
        half: [0.09, 0.75],
        edge: 0.03,
        radiance: [9.0, 10.0, 11.5],
    },
    SoftBox {
        towards: DVec3::new(0.8, 0.3, -0.85),
        half: [0.12, 0.8],
        edge: 0.03,
        radiance: [12.0, 11.0, 9.6],
    },
    // Low kicker, front.
    SoftBox {
        towards: DVec3::new(0.25, -0.35, 1.0),
        half: [0.5, 0.07],
        edge: 0.03,
        radiance: [2.0, 2.0, 2.1],
    },
];

impl SoftBox {
    /// The box with its axes: towards it, to its right, and up.
    fn placed(&self) -> (&Self, [DVec3; 3]) {
        let n = self.towards.normalize();
        let up = if n.y.abs() < 0.95 { DVec3::Y } else { DVec3::Z };
        let right = up.cross(n).normalize();
        (self, [n, right, n.cross(right)])
    }

    fn radiance(&self, [n, right, up]: [DVec3; 3], d: DVec3) -> [f64; 3] {
        let cos = d.dot(n);
        let (x, y) = (d.dot(right), d.dot(up));
        let inside = |x: f64, half: f64| {
            let t = ((half - x.abs()) / self.edge + 0.5).clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        };
        if cos <= 0.05 || x.abs() > cos * (self.half[0] + self.edge) {
            return [0.0; 3];
        }
        let (x, y) = (x / cos, y / cos);
        // A little brighter in the middle, as behind cloth.
        let hot = 1.0 - 0.25 * ((x / self.half[0]).powi(2) + (y / self.half[1]).powi(2)).min(2.0) / 2.0;
        let k = hot * inside(x, self.half[0]) * inside(y, self.half[1]);
        self.radiance.map(|v| v * k)
    }
}

/// A photographer's studio: a key, a fill, an overhead light, two rim strips and a kicker as soft boxes,
/// before a backdrop that runs from a dark floor through a lit horizon to a dim ceiling.
pub(super) fn studio(scale: f64, width: usize, height: usize) -> SphereImage {
    let boxes = BOXES.each_ref().map(SoftBox::placed);
    fill(width, height, 2, |d| {
        let y = d.y;
        let wall = 0.10 + 0.42 * (-(y / 0.28).powi(2)).exp() * (0.75 + 0.25 * -d.z);
        let floor = if y < 0.0 { 0.16 * (1.0 - (1.0 + y).powi(3)) } else { 0.0 };
        let mut sum = [0.98, 1.0, 1.04].map(|tint| tint * (wall + floor));
        for (light, axes) in &boxes {
            sum.iter_mut().zip(light.radiance(*axes, d)).for_each(|(s, v)| *s += v);
        }
        sum.map(|v| scale * v)
    })
}
