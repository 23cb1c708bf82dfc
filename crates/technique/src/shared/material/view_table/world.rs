//! Shading with data per site for a static view, KSS02 section 4: the reflectance looked up at each site and
//! rotated to world axes.

use super::kernel::{Block, LightLanes, Sink, turned};
use super::vectors::{SIDE, Vectors, read};
use super::{SiteFrames, ViewTable};
use glam::Vec3;
use steradian_parallel::prelude::*;
use steradian_simd::{Arch, Kernel, Vector};
use steradian_sphere::sh::Exchange;

/// Reflectance of all sites towards one viewer, turned to the world: sixteen sites a block, by channel and
/// coefficient.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WorldViews {
    sites: usize,
    channels: usize,
    count: usize,
    data: Vec<f32>,
    facing: Vec<bool>,
}

impl WorldViews {
    /// Towards a viewer at `eye`.
    pub fn new(table: &ViewTable, frames: &SiteFrames, eye: Vec3) -> Self {
        let (channels, count) = (table.channels, table.bands * table.bands);
        let blocks = frames.len().div_ceil(SIDE);
        let mut data = vec![0.0; blocks * SIDE * channels * count];
        let mut facing = vec![false; blocks * SIDE];
        let exchange = Exchange::new(0);
        let each = data.par_chunks_mut(SIDE * channels * count).zip(facing.par_chunks_mut(SIDE));
        each.enumerate().for_each(|(k, (to, facing))| {
            let exchange = &exchange;
            steradian_simd::run(Towards { table, frames, eye, exchange, first: SIDE * k, to, facing });
        });
        Self { sites: frames.len(), channels, count, data, facing }
    }

    /// Radiance of every site under a light (times the table's tint): scalar products alone.
    pub fn radiance(&self, light: &LightLanes, out: &mut Vec<[f32; 3]>) {
        out.clear();
        out.resize(self.facing.len(), [0.0; 3]);
        if light.coefficients().len() == self.count {
            steradian_simd::run(Products { views: self, light: light.coefficients(), out });
        }
        out.truncate(self.sites);
    }

    /// The numbers site by site, then channel, then coefficient, for GPUs; zeros where a site faces away.
    pub fn numbers(&self) -> Vec<f32> {
        let each = self.channels * self.count;
        let one = |s: usize| {
            let (block, lane) = (s / SIDE, s % SIDE);
            let seen = self.facing[s];
            (0..each).map(move |k| (seen, (block * each + k) * SIDE + lane))
        };
        (0..self.sites).flat_map(one).map(|(seen, k)| if seen { self.data[k] } else { 0.0 }).collect()
    }
}

struct Towards<'a> {
    table: &'a ViewTable,
    frames: &'a SiteFrames,
    eye: Vec3,
    exchange: &'a Exchange,
    first: usize,
    to: &'a mut [f32],
    facing: &'a mut [bool],
}

impl Kernel for Towards<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let view = |v: &'_ [Vec<f32>; 3]| read::<A>([&v[0], &v[1], &v[2]], self.first, self.frames.len());
        let p = view(&self.frames.p);
        let mut wo: Vectors = [[0.0; SIDE]; 3];
        for i in 0..SIDE {
            let d: [f32; 3] = std::array::from_fn(|k| self.eye[k] - p[k][i]);
            let scale = 1.0 / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt().max(1e-30);
            (0..3).for_each(|k| wo[k][i] = scale * d[k]);
        }
        let b = Block::new::<A>(self.table, &view(&self.frames.n), &view(&self.frames.t), &wo);
        self.facing.copy_from_slice(b.facing());
        turned::<A>(self.table, self.exchange, &b, &mut Keep(self.to));
    }
}

/// Keeps coefficients in blocks.
struct Keep<'a>(&'a mut [f32]);

impl Sink for Keep<'_> {
    #[inline(always)]
    fn take<V: Vector<T = f32>>(&mut self, c: usize, lane: usize, f: &[V]) {
        for (i, v) in f.iter().enumerate() {
            v.store(&mut self.0[(c * f.len() + i) * SIDE + lane..]);
        }
    }
}

struct Products<'a> {
    views: &'a WorldViews,
    light: &'a [[f32; 3]],
    out: &'a mut [[f32; 3]],
}

impl Kernel for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let v = self.views;
        let each = SIDE * v.channels * v.count;
        let blocks = v.data.chunks_exact(each).zip(v.facing.chunks_exact(SIDE));
        for ((block, facing), out) in blocks.zip(self.out.chunks_exact_mut(SIDE)) {
            let mut sums = [[0.0f32; SIDE]; 3];
            let mut lane = 0;
            while lane < SIDE {
                let mut sum = [A::F32::splat(0.0); 3];
                for (i, l) in self.light.iter().enumerate() {
                    for k in 0..3 {
                        let c = if v.channels == 1 { 0 } else { k };
                        let f = A::F32::load(&block[(c * v.count + i) * SIDE + lane..]);
                        sum[k] = f.fma(A::F32::splat(l[k]), sum[k]);
                    }
                }
                (0..3).for_each(|k| sum[k].store(&mut sums[k][lane..]));
                lane += A::F32::LANES;
            }
            for (i, o) in out.iter_mut().enumerate() {
                *o = if facing[i] { [sums[0][i], sums[1][i], sums[2][i]] } else { [0.0; 3] };
            }
        }
    }
}
