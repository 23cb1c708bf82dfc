//! One lookup a resolution about the point's own centre, and the lights that are shaded exactly; `shade.wgsl`
//! has the same functions.

use super::ShrmSlices;
use super::bake::{HEAD, Level, MAX_ORDERS, SliceMaps, extent};
use super::material::place;
use crate::gpu::{Buffer, Entry, Uniform, Value};
use crate::shared::light::exact::{self, TurnedSuns};
use crate::shared::maths::angle::angle;
use crate::shared::maths::harmonics::{MAX_TERMS, frame, globe_uv};
use crate::shared::maths::vector::dot;
use crate::shared::points::batch::{self, Point};
use crate::shared::points::central::tangent;
use crate::shared::shrm::DIRECTIONS;
use crate::shared::tables::bundle::Taps;
use crate::{Bake, GpuTechnique, Points, Radiance, Technique};
use std::borrow::Cow;
use std::f32::consts::{FRAC_1_PI, SQRT_2};
use steradian_brdf::central::Centre;

/// √2 cos qφ and √2 sin qφ for q = 1 … Q from cos φ and sin φ, at q; 1 and 0 at q = 0.
#[inline(always)]
fn azimuths([cos, sin]: [f32; 2], most: usize, a: &mut [[f32; 2]; MAX_ORDERS]) {
    a[0] = [1.0, 0.0];
    let (mut re, mut im) = (SQRT_2, 0.0);
    let (most, mut q) = (most.min(MAX_ORDERS - 1), 1);
    while q <= most {
        (re, im) = (re * cos - im * sin, re * sin + im * cos);
        a[q] = [re, im];
        q += 1;
    }
}

/// The direction to the eye across the normal, and its length, the sine of θ_v.
#[inline(always)]
fn aside(p: &Point) -> ([f32; 3], f32) {
    let side: [f32; 3] = std::array::from_fn(|k| p.wo[k] - p.cos_o * p.n[k]);
    (side, dot(side, side).sqrt())
}

/// The centre at angle γ from n, and the direction of azimuth 0 about it.
#[inline(always)]
fn lean(p: &Point, (side, sine): ([f32; 3], f32), gamma: f32) -> [[f32; 3]; 2] {
    // Seen along the normal, slices do not depend on the azimuth.
    let side = if sine > 1e-6 { side.map(|x| x / sine) } else { frame(p.n)[0] };
    let (sin, cos) = gamma.sin_cos();
    let c = std::array::from_fn(|k| p.n[k] * cos - side[k] * sin);
    [c, std::array::from_fn(|k| side[k] * cos + p.n[k] * sin)]
}

/// The weights of a level's maps: those of its components, linear between elevations, times those of the
/// azimuth.
#[inline(always)]
fn weights(
    level: &Level,
    [u0, u1]: [&[f32]; 2],
    x: f32,
    a: &[[f32; 2]; MAX_ORDERS],
    y: &mut [f32; MAX_TERMS],
) {
    let (u0, u1) = (&u0[..level.q.len()], &u1[..level.q.len()]);
    let mut at = 0;
    for k in 0..level.q.len() {
        let u = u0[k] + (u1[k] - u0[k]) * x;
        let q = level.q[k] as usize;
        if q == 0 {
            y[at] = u;
            at += 1;
        } else {
            let [cos, sin] = a[q];
            y[at] = u * cos;
            y[at + 1] = u * sin;
            at += 2;
        }
    }
}

pub(super) fn shade(b: &Bake<ShrmSlices>, shown: &TurnedSuns, q: &Points<'_>, out: &mut Radiance<'_>) {
    let s = &b.linked;
    let (turn, elevations) = (&shown.turn, s.elevations());
    let last = (elevations - 1) as f32;
    let most = s.levels.iter().filter_map(|l| l.q.last()).max().map_or(0, |q| *q as usize);
    batch::shade(q, out, |p: Point| {
        let strands = s.centre == Centre::Tangent;
        let t = if strands { tangent(q, &p) } else { [0.0; 3] };
        let side = aside(&p);
        let part = if strands {
            dot(t, p.wo).clamp(-1.0, 1.0).acos() * FRAC_1_PI
        } else {
            // The angle is computed from the sine too: the cosine alone, rounded, determines it only to 3e-4
            // near the normal.
            place(angle(side.1.min(1.0), p.cos_o.min(1.0)))
        };
        let x = part * last;
        let i = (x as usize).min(elevations - 2);
        let u = x - i as f32;
        let r0 = &s.curve[i * s.stride..(i + 1) * s.stride];
        let r1 = &s.curve[(i + 1) * s.stride..(i + 2) * s.stride];
        let head: [f32; HEAD] = std::array::from_fn(|k| r0[k] + (r1[k] - r0[k]) * u);
        let [c, zero] = if strands { [t, p.n] } else { lean(&p, side, head[0]) };
        let (c, zero) = (turn.apply(c), turn.apply(zero));
        let axes = frame(c);
        let phi = [dot(axes[0], zero), dot(axes[1], zero)];
        let uv = globe_uv(c);
        let mut a = [[0.0; 2]; MAX_ORDERS];
        azimuths(phi, most, &mut a);
        let (mut sum, mut from) = ([0.0f32; 3], HEAD);
        for level in &s.levels {
            let mut y = [0.0; MAX_TERMS];
            weights(level, [&r0[from..], &r1[from..]], u, &a, &mut y);
            from += level.q.len();
            let [rows, columns] = extent(&level.maps);
            let l = level.maps.sum(Taps::globe(rows, columns, uv), &y);
            (0..3).for_each(|k| sum[k] += l[k]);
        }
        std::array::from_fn(|k| head[k + 1] * sum[k])
    });
    shown.add(b.material.brdf.as_ref(), q, out);
}

/// Numbers of a level in the buffer `levels`.
const STRIDE: usize = 8;

/// For each level rows, columns, components, where its texels begin in two parts, the first column of its
/// weights and its maps.
fn levels(s: &SliceMaps) -> Buffer {
    let (mut at, mut from) = (0usize, HEAD);
    let level = |l: &Level| {
        let [rows, columns] = extent(&l.maps);
        let begin = [at / 65536, at % 65536];
        let all = [rows, columns, l.q.len(), begin[0], begin[1], from, l.maps.terms(), 0];
        at += l.maps.texels().len();
        from += l.q.len();
        all.map(|x| x as f32)
    };
    let mut data: Vec<f32> = s.levels.iter().flat_map(level).collect();
    if data.is_empty() {
        data.extend([0.0; STRIDE]);
    }
    Buffer::new("levels", STRIDE, data)
}

/// The curve, and q of each component as one more elevation.
fn curve(s: &SliceMaps) -> Buffer {
    let mut data = s.curve.clone();
    data.extend([0.0; HEAD]);
    data.extend(s.levels.iter().flat_map(|l| &l.q).map(|q| *q as f32));
    Buffer::new("curve", s.stride, data)
}

pub(super) fn gpu(b: &Bake<ShrmSlices>, shown: &TurnedSuns) -> GpuTechnique {
    let s = &b.linked;
    let mut maps: Vec<f32> = s.levels.iter().flat_map(|l| l.maps.texels().iter().copied()).collect();
    if maps.is_empty() {
        // Without any light; buffers must not be empty.
        maps.push(0.0);
    }
    let counts = [s.levels.len(), s.elevations() - 1, s.centre.number() as usize, 0];
    let modules = DIRECTIONS.into_iter().chain([include_str!("shade.wgsl")]).map(Cow::from).collect();
    let technique = GpuTechnique {
        slug: ShrmSlices::CARD.slug,
        modules,
        entry: Entry::PLAIN,
        tables: Vec::new(),
        uniforms: vec![
            Uniform { name: "orders", value: Value::Vec4(counts.map(|x| x as f32)) },
            shown.turn.uniform(),
        ],
        buffers: vec![curve(s), levels(s), Buffer::new("maps", 1, maps)],
    };
    exact::gpu(technique, &s.suns, b.material.brdf.as_ref())
}
