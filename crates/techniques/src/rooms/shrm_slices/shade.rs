//! Two lookups about the point's own centre, one per neighbouring slice; `shade.wgsl` has the same functions.

use super::bake::Stack;
use super::material::{CANDIDATES, place};
use crate::gpu::{Buffer, Format, Level, Shape, Table, Uniform, Value};
use crate::shared::batch::{self, Point};
use crate::shared::bundle::{Grid, Taps};
use crate::shared::harmonics::{MAX_TERMS, dot, frame, globe_uv};
use crate::shared::kernels::word;
use crate::shared::strands::tangent;
use crate::shared::tables::texel_bytes;
use crate::shared::turn::Turn;
use crate::{GpuRoom, Points, Radiance, Technique};
use std::f32::consts::{FRAC_1_PI, SQRT_2};
use steradian_brdf::central::Centre;

/// 1, √2 cos qφ and √2 sin qφ for q = 1 … Q from cos φ and sin φ.
#[inline(always)]
fn azimuths([cos, sin]: [f32; 2], terms: usize, w: &mut [f32; MAX_TERMS]) {
    w[0] = 1.0;
    let (mut re, mut im) = (SQRT_2, 0.0);
    for q in 1..=terms / 2 {
        (re, im) = (re * cos - im * sin, re * sin + im * cos);
        w[2 * q - 1] = re;
        w[2 * q] = im;
    }
}

/// The centre at angle γ from n, and the direction of azimuth 0 about it.
#[inline(always)]
fn lean(p: &Point, gamma: f32) -> [[f32; 3]; 2] {
    let side: [f32; 3] = std::array::from_fn(|k| p.wo[k] - p.cos_o * p.n[k]);
    let square = dot(side, side);
    // Seen along the normal, slices do not depend on the azimuth.
    let side = if square > 1e-12 { side.map(|x| x / square.sqrt()) } else { frame(p.n)[0] };
    let (sin, cos) = gamma.sin_cos();
    let c = std::array::from_fn(|k| p.n[k] * cos - side[k] * sin);
    [c, std::array::from_fn(|k| side[k] * cos + p.n[k] * sin)]
}

pub(super) fn shade(s: &Stack, turn: &Turn, q: &Points<'_>, out: &mut Radiance<'_>) {
    let last = (CANDIDATES - 1) as f32;
    batch::shade(q, out, |p: Point| {
        let strands = s.centre == Centre::Tangent;
        let t = if strands { tangent(q, &p) } else { [0.0; 3] };
        let part =
            if strands { dot(t, p.wo).clamp(-1.0, 1.0).acos() * FRAC_1_PI } else { place(p.cos_o.acos()) };
        let x = part * last;
        let i = (x as usize).min(CANDIDATES - 2);
        let (a, b, u) = (s.curve[i], s.curve[i + 1], x - i as f32);
        let curve: [f32; 4] = std::array::from_fn(|k| a[k] + (b[k] - a[k]) * u);
        let [c, zero] = if strands { [t, p.n] } else { lean(&p, curve[0]) };
        let (c, zero) = (turn.apply(c), turn.apply(zero));
        let axes = frame(c);
        let phi = [dot(axes[0], zero), dot(axes[1], zero)];
        let uv = globe_uv(c);
        let node = s.before[i] as usize;
        let (m0, m1) = (&s.maps[node], &s.maps[node + 1]);
        let (p0, p1) = (s.places[node] as f32, s.places[node + 1] as f32);
        let w = (x - p0) / (p1 - p0);
        let mut y = [0.0; MAX_TERMS];
        azimuths(phi, m0.terms().max(m1.terms()), &mut y);
        let taps = |g: Grid| match g {
            Grid::Globe { rows, columns } => Taps::globe(rows, columns, uv),
            Grid::Cube { size } => Taps::cube(size, c),
        };
        let (l0, l1) = (m0.sum(taps(m0.grid()), &y), m1.sum(taps(m1.grid()), &y));
        std::array::from_fn(|k| curve[k + 1] * (l0[k] + (l1[k] - l0[k]) * w))
    });
}

/// rows, columns, terms, place and, in two parts, where the texels of each node begin.
fn nodes(s: &Stack) -> Buffer {
    let mut at = 0usize;
    let node = |(m, place): (&crate::shared::bundle::Bundle, &u32)| {
        let (rows, columns) = match m.grid() {
            Grid::Globe { rows, columns } => (rows, columns),
            Grid::Cube { size } => (size, size),
        };
        let begin = [at / 65536, at % 65536].map(|x| x as f32);
        at += m.texels().len();
        [rows as f32, columns as f32, m.terms() as f32, *place as f32, begin[0], begin[1]]
    };
    let data = s.maps.iter().zip(&s.places).flat_map(node).collect();
    Buffer { name: "nodes", stride: 6, data }
}

pub(super) fn gpu(s: &Stack, turn: &Turn) -> GpuRoom {
    let level = Level { width: s.curve.len(), height: 1, layers: 1, bytes: texel_bytes(s.curve.iter()) };
    let curve = Table { name: "curve", shape: Shape::Line, format: Format::Rgba32Float, level };
    let maps = s.maps.iter().flat_map(|m| m.texels().iter().copied()).collect();
    let orders = [s.maps.len() as f32, (CANDIDATES - 1) as f32, word(s.centre) as f32, 0.0];
    GpuRoom {
        slug: super::ShrmSlices::CARD.slug,
        wgsl: concat!(
            include_str!("../../shared/harmonics.wgsl"),
            include_str!("../../shared/strands.wgsl"),
            include_str!("shade.wgsl")
        ),
        tables: vec![curve],
        uniforms: vec![Uniform { name: "orders", value: Value::Vec4(orders) }, turn.uniform()],
        buffers: vec![nodes(s), Buffer { name: "maps", stride: 1, data: maps }],
    }
}
