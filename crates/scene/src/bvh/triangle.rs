//! The ray–triangle test, eight triangles at a time.
//!
//! Woop, Benthin, Wald 2013, Watertight Ray/Triangle Intersection (JCGT 2(1)): space is sheared so that the ray
//! becomes the z axis; the edge functions of the two triangles at a shared edge are then exact negatives of
//! each other, and no ray slips between them. Edge functions that are zero in f32 are computed again in f64.
//! Both sides of a triangle are hit.

use super::LANES;
use glam::Vec3;

/// One number for each triangle of a block.
pub type Lane = [f32; LANES];

/// Up to eight triangles, structure of arrays; absent ones are NaN and never hit.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub struct Block {
    /// Vertex, axis, triangle.
    pub corners: [[Lane; 3]; 3],
    /// Index of each in the mesh.
    pub ids: [u32; LANES],
}

impl Block {
    /// A block without triangles.
    pub const EMPTY: Self = Self { corners: [[[f32::NAN; LANES]; 3]; 3], ids: [u32::MAX; LANES] };
}

/// A ray in the sheared space of the test.
#[derive(Debug, Clone, Copy)]
pub struct Shear {
    origin: [f32; 3],
    /// The axes kx, ky, kz: kz is the direction's largest component; kx and ky keep the winding.
    k: [usize; 3],
    /// Shears in x and y and the scale in z: d_x/d_z, d_y/d_z, 1/d_z.
    s: [f32; 3],
}

/// The edge functions and the heights of the corners of a block in sheared space.
struct Sheared {
    /// x and y of the three corners.
    xy: [[Lane; 2]; 3],
    /// z of the three corners.
    z: [Lane; 3],
}

impl Shear {
    /// The shear of a ray.
    #[inline(always)]
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

    #[inline(always)]
    fn apply(&self, b: &Block) -> Sheared {
        let [kx, ky, kz] = self.k;
        let o = [self.origin[kx], self.origin[ky], self.origin[kz]];
        let mut out = Sheared { xy: [[[0.0; LANES]; 2]; 3], z: [[0.0; LANES]; 3] };
        for v in 0..3 {
            let c = &b.corners[v];
            for i in 0..LANES {
                let z = c[kz][i] - o[2];
                out.xy[v][0][i] = (c[kx][i] - o[0]) - self.s[0] * z;
                out.xy[v][1][i] = (c[ky][i] - o[1]) - self.s[1] * z;
                out.z[v][i] = self.s[2] * z;
            }
        }
        out
    }

    /// For each triangle: distance in (0, `t_max`) or NaN, and the barycentric weights of its corners.
    #[inline(always)]
    pub fn hit(&self, b: &Block, t_max: f32) -> (Lane, [Lane; 3]) {
        let Sheared { xy: [[ax, ay], [bx, by], [cx, cy]], z: [az, bz, cz] } = self.apply(b);
        let (mut u, mut v, mut w) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let mut zero = false;
        for i in 0..LANES {
            u[i] = cx[i] * by[i] - cy[i] * bx[i];
            v[i] = ax[i] * cy[i] - ay[i] * cx[i];
            w[i] = bx[i] * ay[i] - by[i] * ax[i];
            zero |= (u[i] == 0.0) | (v[i] == 0.0) | (w[i] == 0.0);
        }
        if zero {
            for i in 0..LANES {
                u[i] = edge(cx[i], by[i], cy[i], bx[i]);
                v[i] = edge(ax[i], cy[i], ay[i], cx[i]);
                w[i] = edge(bx[i], ay[i], by[i], ax[i]);
            }
        }
        let mut t = [f32::NAN; LANES];
        for i in 0..LANES {
            let inside = ((u[i] >= 0.0) & (v[i] >= 0.0) & (w[i] >= 0.0))
                | ((u[i] <= 0.0) & (v[i] <= 0.0) & (w[i] <= 0.0));
            let inverse = 1.0 / (u[i] + v[i] + w[i]);
            // Weights first: the product of an area and a height could leave the range of f32.
            (u[i], v[i], w[i]) = (u[i] * inverse, v[i] * inverse, w[i] * inverse);
            let d = u[i] * az[i] + v[i] * bz[i] + w[i] * cz[i];
            t[i] = if inside & (d > 0.0) & (d < t_max) { d } else { f32::NAN };
        }
        (t, [u, v, w])
    }

    /// Is any of the triangles hit in (0, `t_max`)?
    #[inline(always)]
    pub fn any(&self, b: &Block, t_max: f32) -> bool {
        let (t, _) = self.hit(b, t_max);
        let mut any = false;
        for t in t {
            any |= !t.is_nan();
        }
        any
    }
}

/// p·q − r·s without the rounding of f32.
#[inline(always)]
fn edge(p: f32, q: f32, r: f32, s: f32) -> f32 {
    (f64::from(p) * f64::from(q) - f64::from(r) * f64::from(s)) as f32
}
