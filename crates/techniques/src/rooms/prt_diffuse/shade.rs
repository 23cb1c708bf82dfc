//! Radiance of every site once a frame, interpolated at points; `shade.wgsl` sums the same at each of the three sites.

use super::PrtDiffuse;
use super::normals::{HARMONICS, difference};
use super::sums::{Form, Sums};
use crate::gpu::{Buffer, Entry, Numbers, Uniform};
use crate::shared::geometry::transport;
use crate::shared::light::sh_light;
use crate::{Bake, GpuTechnique, Points, Radiance, Technique, View};
use half::f16;
use std::f64::consts::PI;

/// The light of a frame, and what each site reflects of it.
#[derive(Default)]
pub struct Frame {
    form: Form,
    /// albedo/π · L_i, turned: of what arrives straight, and of what is reflected.
    light: [Vec<[f32; 3]>; 2],
    radiance: Vec<[f32; 3]>,
    /// By site: radiance as harmonics of the normal, where it is known for others than the site's own.
    by_normal: Vec<[[f32; 3]; HARMONICS]>,
}

impl Frame {
    pub(super) fn new(b: &Bake<PrtDiffuse>, v: &View) -> Self {
        let (bands, transfer) = (b.params.bands, &b.transfer);
        if transfer.stride == 0 {
            return Self::default();
        }
        let form = Form::of(bands, transfer.stride, b.params.by_normal());
        let factor = b.material.0.map(|a| a / PI);
        let light = [
            b.light.turned(bands, v.light_rotation, factor),
            b.light.turned_reflected(bands, v.light_rotation, factor),
        ];
        let sites = transfer.data.len() / transfer.stride;
        let sums = Sums { form, light: &light, data: &transfer.data, stride: transfer.stride, first: 0 };
        let mut radiance = vec![[0.0; 3]; sites];
        sums.write(&mut radiance, 1, 0);
        let mut by_normal = Vec::new();
        if form.normals {
            by_normal = vec![[[0.0; 3]; HARMONICS]; sites];
            let plain = Form { reflected: 0, ..form };
            for k in 0..HARMONICS {
                let first = form.by_normal() + k * form.n;
                Sums { form: plain, first, ..sums }.write(by_normal.as_flattened_mut(), HARMONICS, k);
            }
        }
        Self { form, light, radiance, by_normal }
    }
}

pub(super) fn shade(f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    for i in 0..q.len() {
        let value = |s: u32| f.radiance.get(s as usize).copied().unwrap_or_default();
        let mut l = transport::gather(q, i, value);
        // The surface's own normal stands in the chart.
        if f.form.normals && q.chart[0].len() == q.len() {
            let own = [0, 1, 2].map(|k| q.chart[k][i]);
            let d = difference(q.n.map(|c| c[i]), own);
            let value = |s: u32| {
                let by_normal = f.by_normal.get(s as usize).copied().unwrap_or_default();
                [0, 1, 2].map(|c| d.iter().zip(&by_normal).map(|(d, l)| d * l[c]).sum())
            };
            let more = transport::gather(q, i, value);
            (0..3).for_each(|c| l[c] += more[c]);
        }
        (0..3).for_each(|c| out.rgb[c][i] = l[c]);
    }
}

pub(super) fn uniforms(f: &Frame) -> Vec<Uniform> {
    let mut all = sh_light::uniforms(&f.light[0]);
    if f.form.reflected > 0 {
        all.extend(sh_light::reflected_uniforms(&f.light[1]));
    }
    all
}

/// The sum over coefficients, written out: members of a uniform block have no index.
fn sum_wgsl(form: Form) -> String {
    let mut terms = String::new();
    let mut add = |light: fn(usize) -> String, at: [usize; 3]| {
        for i in 0..form.n {
            let t = at.map(|first| format!("fetch_transfer_at(site, {}u)", first + i));
            let t = if at[0] == at[1] { t[0].clone() } else { format!("vec3<f32>({})", t.join(", ")) };
            terms += &format!("    l += {} * {t};\n", light(i));
        }
    };
    let n = form.n;
    add(sh_light::uniform, [0; 3]);
    match form.reflected {
        0 => {}
        1 => add(sh_light::reflected_uniform, [n; 3]),
        _ => add(sh_light::reflected_uniform, [n, 2 * n, 3 * n]),
    }
    format!(
        "// Sum of L_i t_i over {n} coefficients (STAR04 eq. 53).\n\
         fn transferred(site: Site) -> vec3<f32> {{\n    var l = vec3<f32>(0.0);\n{terms}    return l;\n}}\n"
    )
}

/// What a bumped normal gets more, Σ_i L_i Σ_k d_k T_ki.
fn bumped_wgsl(form: Form) -> String {
    let (n, first) = (form.n, form.by_normal());
    let mut terms = String::new();
    for i in 0..n {
        terms += &format!("    l += {} * bumped_number(site, {i}u, d);\n", sh_light::uniform(i));
    }
    format!(
        "fn bumped_number(site: Site, i: u32, d: array<f32, {HARMONICS}>) -> f32 {{
    var each = d;
    var sum = 0.0;
    for (var k = 0u; k < {HARMONICS}u; k++) {{
        sum += each[k] * fetch_transfer_at(site, {first}u + k * {n}u + i);
    }}
    return sum;
}}

fn bumped(site: Site, n: vec3<f32>) -> vec3<f32> {{
    let d = normal_difference(n, site.n);
    var l = vec3<f32>(0.0);
{terms}    return l;
}}
"
    )
}

pub(super) fn gpu(b: &Bake<PrtDiffuse>, f: &Frame) -> GpuTechnique {
    let stride = b.transfer.stride;
    let data = if b.params.halves {
        Numbers::F16(b.transfer.data.iter().map(|x| f16::from_f32(*x)).collect())
    } else {
        Numbers::F32(b.transfer.data.clone())
    };
    let mut modules = vec![sum_wgsl(f.form).into()];
    if f.form.normals {
        modules.push(include_str!("normals.wgsl").into());
        modules.push(bumped_wgsl(f.form).into());
        modules.push(include_str!("bumped.wgsl").into());
    } else {
        modules.push(include_str!("shade.wgsl").into());
    }
    GpuTechnique {
        slug: PrtDiffuse::CARD.slug,
        modules,
        entry: Entry::SITE,
        tables: Vec::new(),
        uniforms: uniforms(f),
        buffers: vec![Buffer { name: "transfer", stride, data }],
    }
}
