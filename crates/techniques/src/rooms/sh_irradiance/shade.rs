//! nᵀMn over batches; `shade.wgsl` has the same functions.

use super::bake::Quadric;
use crate::gpu::{Uniform, Value};
use crate::{GpuRoom, Points, Radiance};
use glam::{Mat3, Mat4};

/// The matrices of a frame: M turned with the light.
#[derive(Default)]
pub struct Turned([Mat4; 3]);

impl Turned {
    pub(super) fn new(q: &Quadric, rotation: Mat3) -> Self {
        let r = Mat4::from_mat3(rotation);
        Self(q.0.map(|m| r * m * r.transpose()))
    }
}

/// nᵀMn, M symmetric.
#[inline(always)]
fn quadric(m: &Mat4, n: [f32; 3]) -> f32 {
    let [x, y, z] = n;
    let a = m.to_cols_array_2d();
    let square = a[0][0] * x * x + a[1][1] * y * y + a[2][2] * z * z;
    let cross = a[0][1] * x * y + a[0][2] * x * z + a[1][2] * y * z;
    let linear = a[0][3] * x + a[1][3] * y + a[2][3] * z;
    square + 2.0 * (cross + linear) + a[3][3]
}

pub(super) fn shade(f: &Turned, q: &Points<'_>, out: &mut Radiance<'_>) {
    steradian_simd::dispatch(|| {
        for (m, out) in f.0.iter().zip(&mut out.rgb) {
            plane(m, q, out);
        }
    });
}

#[inline(always)]
fn plane(m: &Mat4, q: &Points<'_>, out: &mut [f32]) {
    let len = out.len();
    let [nx, ny, nz] = q.n.map(|s| &s[..len]);
    let [vx, vy, vz] = q.wo.map(|s| &s[..len]);
    for i in 0..len {
        let facing = nx[i] * vx[i] + ny[i] * vy[i] + nz[i] * vz[i];
        let l = quadric(m, [nx[i], ny[i], nz[i]]);
        out[i] = if facing > 0.0 { l } else { 0.0 };
    }
}

pub(super) fn gpu(f: &Turned) -> GpuRoom {
    let uniform = |name, m: &Mat4| Uniform { name, value: Value::Mat4(m.to_cols_array_2d()) };
    let [r, g, b] = &f.0;
    GpuRoom {
        slug: "sh_irradiance",
        wgsl: include_str!("shade.wgsl"),
        tables: Vec::new(),
        uniforms: vec![uniform("red", r), uniform("green", g), uniform("blue", b)],
        buffers: Vec::new(),
    }
}
