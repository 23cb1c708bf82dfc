//! Per lobe two lookups in tables of views and one in the chain, times what is seen there; the `.wgsl` files have the same
//! functions.

use super::GaussianLobes;
use super::bake::Views;
use super::light::Light;
use super::visibility::{self, Blocked, DIFFUSE};
use crate::gpu::{Buffer, Entry, Format, Level, Shape, Table, Uniform, Value};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::points::batch::{self, Point};
use crate::shared::tables::{cube_table, texel_bytes};
use crate::shared::{light::sh_light, maths::harmonics};
use crate::{Bake, GpuTechnique, Points, Radiance, Technique, View};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_brdf::fit::gaussian::LAST;
use steradian_parallel::prelude::*;

/// 1 over the last elevation.
const SCALE: f32 = (1.0 / LAST) as f32;

/// Row `i` + x · (rows − 1) of a table, linear.
#[inline(always)]
fn row(table: &[[f32; 4]], first: usize, count: usize, x: f32) -> [f32; 4] {
    let at = x.clamp(0.0, 1.0) * (count - 1) as f32;
    let k = (at as usize).min(count - 2);
    let w = at - k as f32;
    let (a, b) = (table[first + k], table[first + k + 1]);
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * w)
}

/// r turned by `angle` away from n in the plane of both.
#[inline(always)]
fn mean(p: &Point, sine: f32, angle: f32) -> [f32; 3] {
    let (s, c) = angle.sin_cos();
    // cos a r + sin a (cos θ r − n)/sin θ.
    let s = s / sine.max(1e-4);
    std::array::from_fn(|k| (c + s * p.cos_o) * p.r[k] - s * p.n[k])
}

/// Lookups: one, or three at least.
#[inline(always)]
fn number(taps: f32) -> usize {
    if taps > 1.001 { (taps - 1e-3).ceil().max(3.0) as usize } else { 1 }
}

/// Where lookup k of `taps` lies, of −1 … 1.
#[inline(always)]
fn place(k: usize, taps: usize) -> f32 {
    (2 * k + 1) as f32 / taps as f32 - 1.0
}

/// Its weight.
#[inline(always)]
fn tap(at: f32) -> f32 {
    (-2.0 * at * at).exp()
}

/// The sum of the weights, and by what places are multiplied so that their variance is 1.
#[inline(always)]
fn spread(taps: usize) -> [f32; 2] {
    let (mut all, mut square) = (0.0, 0.0);
    for k in 0..taps {
        let at = place(k, taps);
        all += tap(at);
        square += at * at * tap(at);
    }
    [all, (all / square.max(1e-6)).sqrt()]
}

/// The sine of θ_o, and θ_o over the last elevation.
#[inline(always)]
fn elevation(cos_o: f32) -> [f32; 2] {
    let cosine = cos_o.min(1.0);
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    [sine, sine.atan2(cosine) * SCALE]
}

/// The state of a frame.
#[derive(Default)]
pub struct Frame {
    turn: LightRotation,
    /// ρ_d/π L_i, turned; empty where nothing is blocked or nothing diffuse.
    light: Vec<[f32; 3]>,
    /// Of each site, what of the diffuse part is blocked.
    blocked: Vec<[f32; 3]>,
}

impl Frame {
    pub(super) fn new(b: &Bake<GaussianLobes>, v: &View) -> Self {
        let mut out = Self { turn: LightRotation::new(v.light_rotation), ..Self::default() };
        let irradiance = &b.transfer.irradiance;
        let Some(light) = b.light.sh.as_ref().filter(|_| b.linked.is_diffuse() && irradiance.stride > 0)
        else {
            return out;
        };
        let factor = b.linked.diffuse.map(|d| f64::from(d) / PI);
        out.light = light.turned(DIFFUSE, v.light_rotation, factor);
        let site = |t: &[f32]| {
            let mut sum = [0.0; 3];
            for (l, t) in out.light.iter().zip(t) {
                (0..3).for_each(|c| sum[c] += l[c] * t);
            }
            sum
        };
        out.blocked = irradiance.data.par_chunks_exact(irradiance.stride).map(site).collect();
        out
    }

    /// What of the diffuse part is blocked at point `i`.
    #[inline(always)]
    fn blocked(&self, q: &Points<'_>, i: usize) -> [f32; 3] {
        let mut sum = [0.0; 3];
        let unknown = q.site.index.iter().any(|s| s.is_empty()) || q.site.weight.iter().any(|s| s.is_empty());
        if self.blocked.is_empty() || unknown {
            return sum;
        }
        let [u, v] = q.site.weight.map(|w| w[i]);
        for (index, w) in q.site.index.iter().zip([1.0 - u - v, u, v]) {
            let site = self.blocked.get(index[i] as usize).copied().unwrap_or_default();
            (0..3).for_each(|c| sum[c] += w * site[c]);
        }
        sum
    }

    pub(super) fn uniforms(&self) -> Vec<Uniform> {
        let mut all = vec![self.turn.uniform()];
        all.extend(sh_light::uniforms(&self.light));
        all
    }
}

pub(super) fn shade(b: &Bake<GaussianLobes>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    let (light, v, blocked) = (&b.light, &b.linked, &b.transfer);
    match blocked.bands() {
        0 => run::<0>(light, v, blocked, f, q, out),
        1 => run::<1>(light, v, blocked, f, q, out),
        2 => run::<2>(light, v, blocked, f, q, out),
        3 => run::<3>(light, v, blocked, f, q, out),
        _ => run::<4>(light, v, blocked, f, q, out),
    }
}

/// With as many bands of visibility.
fn run<const BANDS: usize>(
    light: &Light,
    v: &Views,
    blocked: &Blocked,
    f: &Frame,
    q: &Points<'_>,
    out: &mut Radiance<'_>,
) {
    let (chain, count, turn) = (&light.chain, v.count(), &f.turn);
    batch::shade(q, out, |p: Point| {
        let [sine, x] = elevation(p.cos_o);
        let seen = visibility::at::<BANDS>(&blocked.visibility, q, p.index);
        let e = light.irradiance.sample(turn.apply(p.n));
        let mut sum = [0, 1, 2].map(|c| v.diffuse[c] * e[c]);
        if BANDS > 0 {
            let less = f.blocked(q, p.index);
            (0..3).for_each(|c| sum[c] = (sum[c] - less[c]).max(0.0));
        }
        for i in 0..v.lobes {
            let [angle, level, sweep, taps] = row(&v.means, i * count, count, x);
            let weight = row(&v.weights, i * count, count, x);
            let zonal = if v.zonal.is_empty() { [1.0; 4] } else { row(&v.zonal, i * count, count, x) };
            let (near, far, w) = chain.around(level);
            let taps = number(taps);
            let [all, scale] = spread(taps);
            for k in 0..taps {
                let at = place(k, taps);
                let d = mean(&p, sine, angle + sweep * scale * at);
                let seen = visibility::ratio::<BANDS>(&seen, p.n, zonal, d).clamp(0.0, 1.0);
                let share = tap(at) / all * seen;
                let d = turn.apply(d);
                let (l0, l1) = (near.sample(d), far.sample(d));
                (0..3).for_each(|c| sum[c] += weight[c] * share * (l0[c] + (l1[c] - l0[c]) * w));
            }
        }
        sum
    });
}

/// Of each lobe towards `wo`: the direction of its mean, the zonal coefficients of visibility there, and its weight.
pub(super) fn looks(v: &Views, n: DVec3, wo: DVec3) -> Vec<([f32; 3], [f32; 4], f64)> {
    let r = (2.0 * n.dot(wo) * n - wo).as_vec3().to_array();
    let cos_o = n.dot(wo) as f32;
    let p = Point { n: n.as_vec3().to_array(), wo: wo.as_vec3().to_array(), r, cos_o, index: 0 };
    let ([sine, x], count) = (elevation(cos_o), v.count());
    let lobe = |i: usize| {
        let [angle, ..] = row(&v.means, i * count, count, x);
        let weight = row(&v.weights, i * count, count, x);
        let zonal = if v.zonal.is_empty() { [1.0; 4] } else { row(&v.zonal, i * count, count, x) };
        (mean(&p, sine, angle), zonal, weight.iter().map(|w| f64::from(*w)).sum())
    };
    (0..v.lobes).map(lobe).collect()
}

/// `fn hidden(b, zonal, d)`: Σ A_l b_lm y_lm(d), written out for as many bands.
fn hidden(bands: usize) -> String {
    let n = bands * bands;
    let band = |l: usize| {
        let terms: Vec<String> = (l * l..(l + 1) * (l + 1)).map(|k| format!("b[{k}] * y[{k}]")).collect();
        let factor = ["", "zonal.x * ", "zonal.y * ", "zonal.z * "][l];
        format!("{factor}({})", terms.join(" + "))
    };
    let sum: Vec<String> = (0..bands).map(band).collect();
    format!(
        "{}alias Blocked = array<f32, {n}>;\n\n\
         // What is blocked at a point.\n\
         fn blocked_at(site: Site) -> Blocked {{\n    var b: Blocked;\n    for (var k = 0u; k < {n}u; k += 1u) {{\n        \
         b[k] = fetch_blocked_at(site, k);\n    }}\n    return b;\n}}\n\n\
         // Sum of A_l b_lm y_lm(d).\n\
         fn hidden(b: Blocked, zonal: vec4<f32>, d: vec3<f32>) -> f32 {{\n    let y = harmonics(d);\n    return {};\n}}\n",
        harmonics::wgsl(bands - 1),
        sum.join(" + ")
    )
}

/// `fn hidden_diffuse(site)`: what of the diffuse part is blocked.
fn hidden_diffuse(diffuse: bool) -> String {
    let mut terms = String::new();
    if diffuse {
        for i in 0..DIFFUSE * DIFFUSE {
            terms +=
                &format!("    l += {} * fetch_blocked_irradiance_at(site, {i}u);\n", sh_light::uniform(i));
        }
    }
    format!(
        "fn hidden_diffuse(site: Site) -> vec3<f32> {{\n    var l = vec3<f32>(0.0);\n{terms}    return l;\n}}\n"
    )
}

pub(super) fn gpu(b: &Bake<GaussianLobes>, f: &Frame) -> GpuTechnique {
    let (light, v, blocked) = (&b.light, &b.linked, &b.transfer);
    let line = |name, rows: &[[f32; 4]]| {
        let level = Level { width: rows.len(), height: 1, layers: 1, bytes: texel_bytes(rows.iter()) };
        Table { name, shape: Shape::Line, format: Format::Rgba32Float, level }
    };
    let counts = [v.lobes as f32, v.count() as f32, (v.means.len() - 1) as f32, SCALE];
    let [red, green, blue] = v.diffuse;
    let mut tables = vec![
        light.chain.table("chain"),
        cube_table("irradiance", &light.irradiance),
        line("means", &v.means),
        line("weights", &v.weights),
    ];
    let mut uniforms = f.uniforms();
    uniforms.push(Uniform { name: "counts", value: Value::Vec4(counts) });
    uniforms.push(Uniform { name: "diffuse", value: Value::Vec4([red, green, blue, 0.0]) });
    let (mut modules, mut buffers) = (Vec::new(), Vec::new());
    let bands = blocked.bands();
    let entry = if bands == 0 {
        modules.push(include_str!("open.wgsl").into());
        Entry::PLAIN
    } else {
        modules.push(hidden(bands).into());
        modules.push(hidden_diffuse(!f.light.is_empty()).into());
        let open = ["", include_str!("ambient.wgsl"), include_str!("published.wgsl")][bands.min(2)];
        let open = open.replace("THIRD", if bands > 3 { "0.21875" } else { "0.0" });
        modules.push(open.into());
        let zonal = if v.zonal.is_empty() { "vec4<f32>(1.0)" } else { "fetch_zonal(at)" };
        modules.push(format!("fn zonal_at(at: f32) -> vec4<f32> {{\n    return {zonal};\n}}\n").into());
        if !v.zonal.is_empty() {
            tables.push(line("zonal", &v.zonal));
        }
        let per = |name, s: &crate::shared::geometry::transport::PerSite| {
            Buffer::new(name, s.stride, s.data.clone())
        };
        buffers.push(per("blocked", &blocked.visibility));
        if !f.light.is_empty() {
            buffers.push(per("blocked_irradiance", &blocked.irradiance));
        }
        Entry::SITE
    };
    modules.push(include_str!("shade.wgsl").into());
    modules.push(if bands == 0 { include_str!("plain.wgsl") } else { include_str!("site.wgsl") }.into());
    GpuTechnique { slug: GaussianLobes::CARD.slug, modules, entry, tables, uniforms, buffers }
}
