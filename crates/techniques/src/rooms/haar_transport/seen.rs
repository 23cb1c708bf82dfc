//! Transport towards a view, T = H t with t_j = ∫_{texel j} V f (n·w)₊ dw: that of all sites for one eye, and
//! that of one site.

use super::keep;
use super::light::transform;
use super::material::Glossy;
use super::sights::Sights;
use super::transport::{Columns, Row, Scale, Seen};
use super::weigh::{self, Place};
use crate::Part;
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use glam::{DVec3, Vec3};
use steradian_parallel::prelude::*;
use steradian_sphere::Frame;
use steradian_sphere::sampling::{R2, hemisphere};

/// Sites that one thread takes at a time.
const BLOCK: usize = 256;
/// Triangles at a silhouette have corners that face away, though points between them do not: sites whose
/// normals are at most about 17° beyond the horizon of the view are taken as seen from just above it.
const BEHIND: f64 = 0.3;
/// Cosine of the view from just above the horizon.
const GRAZING: f64 = 0.02;
/// Sites, each seen from a direction of its own, that stand for all views.
const SAMPLE: usize = 128;

/// What transport of single sites is made from.
#[derive(Clone, Copy)]
pub struct Towards<'a> {
    pub sights: &'a Sights,
    pub matter: &'a Glossy,
    /// Part of each vector that is left out.
    pub precision: f64,
}

/// Rows of some sites, and the squares of their coefficients, summed over the sites.
type Block<R> = (Vec<R>, Vec<f64>);

/// Memory of one thread.
#[derive(Default)]
pub struct Work {
    open: Vec<f32>,
    planes: Vec<Vec<f32>>,
    texels: Vec<f32>,
    scratch: weigh::Scratch,
    steps: [[Vec3; 2]; 6],
}

impl Glossy {
    /// Channels of the transport: one where a tint makes three of it.
    fn channels(&self) -> usize {
        if self.tint.is_some() { 1 } else { 3 }
    }
}

impl Towards<'_> {
    /// Memory for [`Towards::row`].
    pub fn work(&self) -> Work {
        let planes = vec![Vec::new(); self.matter.channels()];
        Work { planes, steps: self.sights.cube.steps(), ..Work::default() }
    }

    /// Transport of site `k` towards `wo`, a direction of the world, a row for each channel; `None` where
    /// there is no surface, or it faces away. `squares` gets the squares of all coefficients.
    pub fn row(&self, k: usize, wo: Vec3, w: &mut Work, squares: Option<&mut [f64]>) -> Option<Vec<Row>> {
        let s = self.sights;
        if !s.is_there(k) {
            return None;
        }
        let [n, t] = s.frames.at(k).map(Vec3::as_dvec3);
        let frame = Frame::from_normal_tangent(n, t);
        let mut wo = frame.to_local(wo.as_dvec3().normalize_or_zero());
        // False for NaN too.
        if !(wo.z > -BEHIND && wo != DVec3::ZERO) {
            return None;
        }
        if wo.z < GRAZING {
            let level = wo.truncate().normalize_or(glam::DVec2::X) * (1.0 - GRAZING * GRAZING).sqrt();
            wo = level.extend(GRAZING);
        }
        let place = Place { brdf: &*self.matter.brdf, frame, wo };
        s.open(k, &mut w.open);
        place.weigh(&s.cube, &w.steps, &w.open, &mut w.scratch, &mut w.planes);
        let side = s.cube.side;
        let row = |plane: &mut Vec<f32>| {
            w.texels.clone_from(plane);
            transform(plane, side);
            keep::row(&w.texels, plane, side, self.precision)
        };
        let rows = w.planes.iter_mut().map(row).collect();
        if let Some(squares) = squares {
            for plane in &w.planes {
                squares.iter_mut().zip(plane).for_each(|(s, x)| *s += f64::from(*x).powi(2));
            }
        }
        Some(rows)
    }

    /// Transport of all sites towards `eye`.
    pub fn all(&self, eye: Vec3) -> Seen {
        let (sites, side) = (self.sights.frames.len(), self.sights.cube.side);
        let block = |first: usize| {
            let (mut w, mut squares) = (self.work(), vec![0.0f64; 6 * side * side]);
            let of = first * BLOCK..((first + 1) * BLOCK).min(sites);
            let row =
                |k: usize| self.row(k, eye - self.sights.frames.position(k), &mut w, Some(&mut squares));
            (of.map(row).collect::<Vec<_>>(), squares)
        };
        let blocks: Vec<Block<Option<Vec<Row>>>> =
            (0..sites.div_ceil(BLOCK)).into_par_iter().with_max_len(1).map(block).collect();
        let (mut squares, mut rows) = (vec![0.0; 6 * side * side], vec![Vec::new(); self.matter.channels()]);
        for (some, s) in blocks {
            for site in some {
                let site = site.unwrap_or_else(|| vec![Row::default(); rows.len()]);
                rows.iter_mut().zip(site).for_each(|(all, own)| all.push(own));
            }
            squares.iter_mut().zip(s).for_each(|(a, b)| *a += b);
        }
        let channels = rows.into_par_iter().map(|rows| Columns::new(&rows, side, Scale::Octaves)).collect();
        Seen { channels, norms: lengths(&squares) }
    }

    /// Some sites spread over all of them, each seen from a direction of its own.
    pub fn sample(&self) -> Sample {
        let there: Vec<usize> = (0..self.sights.frames.len()).filter(|k| self.sights.is_there(*k)).collect();
        let texels = 6 * self.sights.cube.side * self.sights.cube.side;
        let count = SAMPLE.min(there.len());
        let block = |b: usize| {
            let (mut w, mut squares) = (self.work(), vec![0.0f64; texels]);
            let row = |i: usize| {
                let k = there[i * there.len() / count];
                let [n, t] = self.sights.frames.at(k).map(Vec3::as_dvec3);
                let wo = Frame::from_normal_tangent(n, t)
                    .to_world(hemisphere::sample(R2::default().point(i as u32)));
                self.row(k, wo.as_vec3(), &mut w, Some(&mut squares))
            };
            let of = b * count / PIECES..(b + 1) * count / PIECES;
            (of.filter_map(row).collect::<Vec<_>>(), squares)
        };
        let blocks: Vec<Block<Vec<Row>>> = (0..PIECES).into_par_iter().map(block).collect();
        let (mut rows, mut squares) = (Vec::new(), vec![0.0; texels]);
        for (some, s) in blocks {
            rows.extend(some);
            squares.iter_mut().zip(s).for_each(|(a, b)| *a += b);
        }
        Sample { rows, norms: lengths(&squares) }
    }
}

/// Pieces of a sample, for as many threads.
const PIECES: usize = 16;

/// Rows of some sites towards some views.
pub struct Sample {
    pub rows: Vec<Vec<Row>>,
    /// As those of [`Seen`].
    pub norms: Vec<f32>,
}

fn lengths(squares: &[f64]) -> Vec<f32> {
    squares.iter().map(|s| s.sqrt() as f32).collect()
}

/// What is known before there is a view: of glossy bakes the lengths of columns over views of all directions,
/// by which the light's wavelets are chosen for points that are seen from elsewhere than from the frame's
/// eye. Diffuse ones have none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Linked {
    pub norms: Vec<f32>,
}

impl Part for Linked {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        if !self.norms.is_empty() {
            put_f32(to, format!("{prefix}.norms"), vec![self.norms.len()], self.norms.clone());
        }
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.norms");
        if !from.tensors.contains_key(&name) {
            return Ok(Self::default());
        }
        Ok(Self { norms: get_f32(from, &name, 1)?.1 })
    }

    fn bytes(&self) -> usize {
        4 * self.norms.len()
    }
}
