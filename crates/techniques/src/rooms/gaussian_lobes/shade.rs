//! Per lobe two lookups in tables of views and one in the chain; `shade.wgsl` has the same functions.

use super::bake::Views;
use super::light::Light;
use crate::gpu::{Entry, Format, Level, Shape, Table, Uniform, Value};
use crate::shared::batch::{self, Point};
use crate::shared::light_rotation::LightRotation;
use crate::shared::tables::{cube_table, texel_bytes};
use crate::{GpuTechnique, Points, Radiance, Technique};
use steradian_brdf::fit::gaussian::LAST;

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

pub(super) fn shade(light: &Light, v: &Views, turn: &LightRotation, q: &Points<'_>, out: &mut Radiance<'_>) {
    let (chain, count) = (&light.chain, v.count());
    batch::shade(q, out, |p: Point| {
        let cosine = p.cos_o.min(1.0);
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let x = sine.atan2(cosine) * SCALE;
        let e = light.irradiance.sample(turn.apply(p.n));
        let mut sum = [0, 1, 2].map(|c| v.diffuse[c] * e[c]);
        for i in 0..v.lobes {
            let [angle, level, sweep, taps] = row(&v.means, i * count, count, x);
            let weight = row(&v.weights, i * count, count, x);
            let (near, far, w) = chain.around(level);
            let taps = number(taps);
            let [all, scale] = spread(taps);
            for k in 0..taps {
                let at = place(k, taps);
                let share = tap(at) / all;
                let d = turn.apply(mean(&p, sine, angle + sweep * scale * at));
                let (l0, l1) = (near.sample(d), far.sample(d));
                (0..3).for_each(|c| sum[c] += weight[c] * share * (l0[c] + (l1[c] - l0[c]) * w));
            }
        }
        sum
    });
}

pub(super) fn gpu(light: &Light, v: &Views, turn: &LightRotation) -> GpuTechnique {
    let line = |name, rows: &[[f32; 4]]| {
        let level = Level { width: rows.len(), height: 1, layers: 1, bytes: texel_bytes(rows.iter()) };
        Table { name, shape: Shape::Line, format: Format::Rgba32Float, level }
    };
    let counts = [v.lobes as f32, v.count() as f32, (v.means.len() - 1) as f32, SCALE];
    let [r, g, b] = v.diffuse;
    GpuTechnique {
        slug: super::GaussianLobes::CARD.slug,
        modules: vec![include_str!("shade.wgsl").into()],
        entry: Entry::PLAIN,
        tables: vec![
            light.chain.table("chain"),
            cube_table("irradiance", &light.irradiance),
            line("means", &v.means),
            line("weights", &v.weights),
        ],
        uniforms: vec![
            turn.uniform(),
            Uniform { name: "counts", value: Value::Vec4(counts) },
            Uniform { name: "diffuse", value: Value::Vec4([r, g, b, 0.0]) },
        ],
        buffers: Vec::new(),
    }
}
