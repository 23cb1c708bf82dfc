//! Radiance of every site once a frame, interpolated at points; `shade.wgsl` sums the same at each of the three sites.

use super::PrtDiffuse;
use super::bake::Light;
use crate::gpu::{Buffer, Entry, Numbers, Uniform, Value};
use crate::shared::transport::{self, PerSite};
use crate::{Bake, GpuTechnique, Points, Radiance, Technique, View};
use half::f16;
use rayon::prelude::*;
use std::f64::consts::PI;
use steradian_sphere::sh::Rotation;

/// The light of a frame, and what each site reflects of it.
#[derive(Default)]
pub struct Frame {
    /// albedo/π · L_i, turned.
    light: Vec<[f32; 3]>,
    radiance: Vec<[f32; 3]>,
}

impl Frame {
    pub(super) fn new(light: &Light, albedo: [f64; 3], transfer: &PerSite, v: &View) -> Self {
        let (n, mono) = match transfer.stride {
            0 => return Self::default(),
            s if s.isqrt().pow(2) == s => (s, true),
            s => (s / 3, false),
        };
        let bands = light.bands(n.isqrt());
        let turned = Rotation::new(bands.order, v.light_rotation.as_dmat3()).apply_rgb(&bands);
        let scaled = |i: usize| [0, 1, 2].map(|c| (turned.c[c][i] * albedo[c] / PI) as f32);
        let light: Vec<[f32; 3]> = (0..n).map(scaled).collect();
        let site = |t: &[f32]| sum(&light, t, mono);
        let radiance = transfer.data.par_chunks_exact(transfer.stride).map(site).collect();
        Self { light, radiance }
    }
}

/// Σ_i L_i t_i, of one vector or of one for each channel.
#[inline(always)]
fn sum(light: &[[f32; 3]], t: &[f32], mono: bool) -> [f32; 3] {
    let mut out = [0.0; 3];
    let n = light.len();
    for (i, l) in light.iter().enumerate() {
        for c in 0..3 {
            out[c] += l[c] * t[if mono { i } else { c * n + i }];
        }
    }
    out
}

pub(super) fn shade(f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    for i in 0..q.len() {
        let value = |s: u32| f.radiance.get(s as usize).copied().unwrap_or_default();
        let l = transport::gather(q, i, value);
        (0..3).for_each(|c| out.rgb[c][i] = l[c]);
    }
}

/// Names of the light's coefficients, up to six bands.
const NAMES: [&str; 36] = [
    "light_0", "light_1", "light_2", "light_3", "light_4", "light_5", "light_6", "light_7", "light_8",
    "light_9", "light_10", "light_11", "light_12", "light_13", "light_14", "light_15", "light_16",
    "light_17", "light_18", "light_19", "light_20", "light_21", "light_22", "light_23", "light_24",
    "light_25", "light_26", "light_27", "light_28", "light_29", "light_30", "light_31", "light_32",
    "light_33", "light_34", "light_35",
];

pub(super) fn uniforms(f: &Frame) -> Vec<Uniform> {
    let value = |l: &[f32; 3]| Value::Vec4([l[0], l[1], l[2], 0.0]);
    NAMES.iter().zip(&f.light).map(|(name, l)| Uniform { name, value: value(l) }).collect()
}

/// The sum over coefficients, written out: members of a uniform block have no index.
fn sum_wgsl(n: usize, mono: bool) -> String {
    let term = |i: usize| {
        let light = format!("technique.{}.xyz", NAMES[i]);
        if mono {
            format!("    l += {light} * fetch_transfer_at(site, {i}u);\n")
        } else {
            let at = |c: usize| format!("fetch_transfer_at(site, {}u)", c * n + i);
            format!("    l += {light} * vec3<f32>({}, {}, {});\n", at(0), at(1), at(2))
        }
    };
    let terms: String = (0..n).map(term).collect();
    format!(
        "// Sum of L_i t_i over {n} coefficients (STAR04 eq. 53).\n\
         fn transferred(site: Site) -> vec3<f32> {{\n    var l = vec3<f32>(0.0);\n{terms}    return l;\n}}\n"
    )
}

pub(super) fn gpu(b: &Bake<PrtDiffuse>, f: &Frame) -> GpuTechnique {
    let (stride, n) = (b.transfer.stride, f.light.len());
    let data = if b.params.halves {
        Numbers::F16(b.transfer.data.iter().map(|x| f16::from_f32(*x)).collect())
    } else {
        Numbers::F32(b.transfer.data.clone())
    };
    GpuTechnique {
        slug: PrtDiffuse::CARD.slug,
        modules: vec![sum_wgsl(n, stride == n).into(), include_str!("shade.wgsl").into()],
        entry: Entry::SITE,
        tables: Vec::new(),
        uniforms: uniforms(f),
        buffers: vec![Buffer { name: "transfer", stride, data }],
    }
}
