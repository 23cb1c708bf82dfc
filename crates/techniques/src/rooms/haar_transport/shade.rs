//! Radiance of every site once a frame, interpolated at points.

use super::HaarTransport;
use super::choice::{Chosen, choose, not_chosen, on_cube};
use super::fixed::{self, Fixed, Frame};
use super::light::Light;
use super::material::Matter;
use super::params::Params;
use super::seen::Towards;
use super::sights::Transfer;
use super::transport::Transport;
use crate::gpu::{Buffer, Entry, Numbers};
use crate::shared::geometry::transport;
use crate::shared::light::sh_light;
use crate::{Bake, GpuTechnique, Points, Radiance, Technique, View};
use glam::{DVec3, Mat3};
use std::f64::consts::PI;
use steradian_parallel::prelude::*;
use steradian_prefilter::{Lobe, Zonal};
use steradian_sphere::image::Filter;
use steradian_sphere::sh::{self, ShRgb};
use steradian_sphere::{Layout, SphereImage};

/// Estimated relative error of the wavelets of the light that a frame leaves out, as if coefficients were
/// independent, relative to the radiance E of the sites of a white surface: √(Σ_left |L_k|² |B_k|² / Σ E²),
/// with |B_k| the lengths of the columns.
pub(super) fn left_out(light: &Light, t: &Transport, p: &Params) -> f64 {
    if t.side == 0 {
        return 0.0;
    }
    let planes = on_cube(light, t.side, Mat3::IDENTITY);
    let chosen = choose(&planes, &t.norms, p);
    let radiance = arriving(&open(light, Mat3::IDENTITY), t, &chosen);
    let all: f64 = radiance.as_flattened().iter().map(|l| f64::from(*l).powi(2)).sum();
    if all > 0.0 { (not_chosen(&planes, &t.norms, &chosen) / all).sqrt() } else { 0.0 }
}

/// Rows of the map of [`open`]: bilinear lookups in it err by 1e-4 of a sun's maximum.
const OPEN_ROWS: usize = 128;

/// Radiance of an unblocked white surface by its normal, (1/π) ∫ L (n·w)₊ dw, up to band [`sh_light::ORDER`],
/// where under a sun alone 0.6 % of its maximum are missing at the terminator.
fn open(light: &Light, rotation: Mat3) -> SphereImage {
    let k = Lobe::lambert().coefficients(sh_light::ORDER);
    let turned = light.sh.turned(sh_light::ORDER + 1, rotation, [1.0; 3]);
    let mut sh = ShRgb {
        order: sh_light::ORDER,
        c: std::array::from_fn(|c| turned.iter().map(|x| f64::from(x[c])).collect()),
    };
    sh.convolve(&k);
    sh::synthesize(&sh, Layout::LatLong, 2 * OPEN_ROWS, OPEN_ROWS)
}

/// Radiance of white sites: that of unblocked ones less the blocked light, clamped, since the sum of few
/// wavelets may exceed it.
fn arriving(open: &SphereImage, t: &Transport, chosen: &Chosen) -> Vec<[f32; 3]> {
    let mut radiance = t.columns.apply(&chosen.scaling, &chosen.others);
    radiance.par_iter_mut().zip(t.normals.par_iter()).for_each(|(l, n)| {
        let whole = match *n {
            [0.0, 0.0, 0.0] => [0.0; 3],
            n => open.lookup(Filter::Bilinear, DVec3::from(n.map(f64::from))),
        };
        (0..3).for_each(|c| l[c] = (whole[c] - l[c]).max(0.0));
    });
    radiance
}

impl Frame {
    pub(super) fn new(light: &Light, albedo: [f64; 3], t: &Transport, p: &Params, v: &View) -> Self {
        if t.side == 0 {
            return Self::default();
        }
        let planes = on_cube(light, t.side, v.light_rotation);
        let chosen = choose(&planes, &t.norms, p);
        let mut radiance = arriving(&open(light, v.light_rotation), t, &chosen);
        let albedo32 = albedo.map(|a| a as f32);
        radiance.par_iter_mut().for_each(|l| (0..3).for_each(|c| l[c] *= albedo32[c]));
        if t.reflected.stride > 0 {
            let n = p.bands * p.bands;
            let own = if t.reflected.stride > n { [0, n, 2 * n] } else { [0; 3] };
            let sh = light.sh.turned_reflected(p.bands, v.light_rotation, albedo.map(|a| a / PI));
            let rows = t.reflected.data.par_chunks_exact(t.reflected.stride);
            radiance.par_iter_mut().zip(rows).for_each(|(l, row)| {
                for c in 0..3 {
                    l[c] += row[own[c]..own[c] + n].iter().zip(&sh).map(|(t, l)| t * l[c]).sum::<f32>();
                }
            });
        }
        Self { radiance, fixed: Fixed::default() }
    }
}

pub(super) fn shade(b: &Bake<HaarTransport>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    if let (Matter::Glossy(matter), Transfer::Sights(sights)) = (&*b.material, &*b.transfer) {
        let towards = Towards { sights, matter, precision: b.params.precision };
        return fixed::shade(towards, &b.linked, &b.params, f, q, out);
    }
    for i in 0..q.len() {
        let value = |s: u32| f.radiance.get(s as usize).copied().unwrap_or_default();
        let l = transport::gather(q, i, value);
        (0..3).for_each(|c| out.rgb[c][i] = l[c]);
    }
}

/// The sums over wavelets are made once a frame, as in the paper; a GPU interpolates them.
pub(super) fn gpu(_: &Bake<HaarTransport>, f: &Frame) -> GpuTechnique {
    GpuTechnique {
        slug: HaarTransport::CARD.slug,
        modules: vec![include_str!("shade.wgsl").into()],
        entry: Entry::SITE,
        tables: Vec::new(),
        uniforms: Vec::new(),
        buffers: vec![Buffer { name: "radiance", stride: 3, data: Numbers::F32(f.radiance.concat()) }],
    }
}
