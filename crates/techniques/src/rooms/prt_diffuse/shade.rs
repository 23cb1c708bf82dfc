//! Radiance of every site once a frame, interpolated at points; `shade.wgsl` computes the sums at each of the
//! three sites instead.

use super::PrtDiffuse;
use super::normals::{HARMONICS, difference};
use super::sums::{Form, GroupRadiance, Sums};
use crate::gpu::{Buffer, Entry, Uniform};
use crate::shared::geometry::grouped::GROUP;
use crate::shared::geometry::transport;
use crate::shared::light::sh_light;
use crate::{Bake, GpuTechnique, Points, Radiance, Technique, View};
use std::f64::consts::PI;
use steradian_simd::{Arch, Kernel, Single, Vector, run};

/// The light of a frame, and the radiance that each site reflects of it.
#[derive(Default)]
pub struct Frame {
    form: Form,
    /// albedo/π · L_i, rotated: of direct light, and of the light that surfaces reflect.
    light: [Vec<[f32; 3]>; 2],
    radiance: Vec<GroupRadiance>,
    /// Group by group: radiance as harmonics of the normal, where vectors for other normals were baked.
    by_normal: Vec<[GroupRadiance; HARMONICS]>,
}

impl Frame {
    /// Computes the sums in the memory of the frame before: new memory is cleared page by page, which takes
    /// about as long as the sums.
    pub(super) fn update(&mut self, b: &Bake<PrtDiffuse>, v: &View) {
        let (bands, vectors) = (b.params.bands, &*b.transfer);
        if vectors.is_empty() {
            *self = Self::default();
            return;
        }
        let form = Form::of(bands, vectors.stride(), b.params.by_normal());
        let factor = b.material.0.map(|a| a / PI);
        self.form = form;
        self.light = [
            b.light.turned(bands, v.light_rotation, factor),
            b.light.turned_reflected(bands, v.light_rotation, factor),
        ];
        let groups = vectors.len().div_ceil(GROUP);
        let sums = Sums { form, light: &self.light, vectors, first: 0 };
        self.radiance.resize(groups, [[0.0; GROUP]; 3]);
        sums.write(&mut self.radiance, 1, 0);
        self.by_normal.resize(if form.normals { groups } else { 0 }, [[[0.0; GROUP]; 3]; HARMONICS]);
        if form.normals {
            let plain = Form { reflected: 0, ..form };
            for k in 0..HARMONICS {
                let first = form.by_normal() + k * form.n;
                Sums { form: plain, first, ..sums }.write(self.by_normal.as_flattened_mut(), HARMONICS, k);
            }
        }
    }
}

pub(super) fn shade(f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    if f.form.normals && q.chart[0].len() == q.len() {
        for i in 0..q.len() {
            let (plain, more) = (interpolated(f, q, i), bumped(f, q, i));
            (0..3).for_each(|c| out.rgb[c][i] = plain[c] + more[c]);
        }
    } else {
        run(AtPoints { f, q, out });
    }
}

#[inline(always)]
fn interpolated(f: &Frame, q: &Points<'_>, i: usize) -> [f32; 3] {
    let of = |l: &GroupRadiance, s: u32| [0, 1, 2].map(|c| l[c][s as usize % GROUP]);
    transport::gather(q, i, |s| f.radiance.get(s as usize / GROUP).map(|l| of(l, s)).unwrap_or_default())
}

/// Radiance of the shading normal less that of the geometric normal, which is stored in `chart`.
fn bumped(f: &Frame, q: &Points<'_>, i: usize) -> [f32; 3] {
    let own = [0, 1, 2].map(|k| q.chart[k][i]);
    let d = difference(q.n.map(|c| c[i]), own);
    transport::gather(q, i, |s| {
        let mut sum = [0.0; 3];
        for (d, l) in d.iter().zip(f.by_normal.get(s as usize / GROUP).into_iter().flatten()) {
            (0..3).for_each(|c| sum[c] += d * l[c][s as usize % GROUP]);
        }
        sum
    })
}

/// Points of any triangles, and those that are the sites of a group in their order, whose radiance is copied.
struct AtPoints<'a, 'q, 'o> {
    f: &'a Frame,
    q: &'a Points<'q>,
    out: &'a mut Radiance<'o>,
}

impl Kernel for AtPoints<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let Self { f, q, out } = self;
        for first in (0..q.len()).step_by(GROUP) {
            if let Some(l) = group_at(f, q, first) {
                let zero = A::F32::splat(0.0);
                let mut lane = 0;
                while lane < GROUP {
                    let at = first + lane;
                    // Whether a view is in front is decided by products that are rounded each, as everywhere
                    // else.
                    let mut facing = zero;
                    for k in 0..3 {
                        facing = facing.add(A::F32::load(&q.n[k][at..]).mul(A::F32::load(&q.wo[k][at..])));
                    }
                    for c in 0..3 {
                        facing.if_positive(A::F32::load(&l[c][lane..]), zero).store(&mut out.rgb[c][at..]);
                    }
                    lane += A::F32::LANES;
                }
            } else {
                for i in first..q.len().min(first + GROUP) {
                    let l = interpolated(f, q, i);
                    for c in 0..3 {
                        out.rgb[c][i] = l[c];
                    }
                }
            }
        }
    }
}

/// Radiance of a group, if the points from `first` on are its sites.
#[inline(always)]
fn group_at<'a>(f: &'a Frame, q: &Points<'_>, first: usize) -> Option<&'a GroupRadiance> {
    let sites = q.site.index[0].get(first..first + GROUP)?;
    let (u, v) = (q.site.weight[0].get(first..first + GROUP)?, q.site.weight[1].get(first..first + GROUP)?);
    let (from, mut other) = (sites[0], sites[0] % GROUP as u32);
    for i in 0..GROUP {
        // The sign of a zero does not count.
        other |= (sites[i] ^ from.wrapping_add(i as u32)) | ((u[i].to_bits() | v[i].to_bits()) << 1);
    }
    if other == 0 { f.radiance.get(from as usize / GROUP) } else { None }
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

/// WGSL text of the radiance that a bumped normal adds, Σ_i L_i Σ_k d_k T_ki.
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
        buffers: vec![Buffer { name: "transfer", stride: b.transfer.stride(), data: b.transfer.by_site() }],
    }
}
