//! The ray–triangle test.
//!
//! Woop, Benthin, Wald 2013, Watertight Ray/Triangle Intersection (JCGT 2(1)): space is sheared so that the ray
//! becomes the z axis; the edge functions of the two triangles at a shared edge are then exact negatives of
//! each other, and no ray slips between them. Edge functions that are zero in f32 are computed again in f64.
//! Both sides of a triangle are hit.

use glam::Vec3;

/// A ray in the sheared space of the test.
#[derive(Debug, Clone, Copy)]
pub struct Shear {
    /// Start of the ray.
    pub origin: [f32; 3],
    /// The axes kx, ky, kz: kz is the direction's largest component; kx and ky keep the winding.
    pub k: [usize; 3],
    /// Shears in x and y and the scale in z: d_x/d_z, d_y/d_z, 1/d_z.
    pub s: [f32; 3],
}

impl Shear {
    /// The shear of a ray.
    #[inline]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let d = direction.to_array();
        let a = [d[0].abs(), d[1].abs(), d[2].abs()];
        let kz = if a[0] > a[1] && a[0] > a[2] {
            0
        } else if a[1] > a[2] {
            1
        } else {
            2
        };
        let (mut kx, mut ky) = ((kz + 1) % 3, (kz + 2) % 3);
        if d[kz] < 0.0 {
            std::mem::swap(&mut kx, &mut ky);
        }
        let z = 1.0 / d[kz];
        Self { origin: origin.to_array(), k: [kx, ky, kz], s: [d[kx] * z, d[ky] * z, z] }
    }

    /// Distance and barycentrics (weights of the second and third vertex) of the hit in (0, `t_max`).
    #[inline]
    pub fn hit(&self, [a, b, c]: [[f32; 3]; 3], t_max: f32) -> Option<[f32; 3]> {
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = [self.apply(a), self.apply(b), self.apply(c)];
        let mut u = cx * by - cy * bx;
        let mut v = ax * cy - ay * cx;
        let mut w = bx * ay - by * ax;
        if u == 0.0 || v == 0.0 || w == 0.0 {
            let edge = |p: f32, q: f32, r: f32, s: f32| {
                (f64::from(p) * f64::from(q) - f64::from(r) * f64::from(s)) as f32
            };
            (u, v, w) = (edge(cx, by, cy, bx), edge(ax, cy, ay, cx), edge(bx, ay, by, ax));
        }
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        let t = (u * az + v * bz + w * cz) / det;
        (t > 0.0 && t < t_max && det != 0.0).then(|| [t, v / det, w / det])
    }

    #[inline]
    fn apply(&self, p: [f32; 3]) -> [f32; 3] {
        let [kx, ky, kz] = self.k;
        let z = p[kz] - self.origin[kz];
        let x = p[kx] - self.origin[kx] - self.s[0] * z;
        let y = p[ky] - self.origin[ky] - self.s[1] * z;
        [x, y, self.s[2] * z]
    }
}
