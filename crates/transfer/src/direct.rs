//! Visibility and direct light: one site at a time, in blocks.

use crate::store::Store;
use crate::table::Table;
use crate::visibility::{Blocked, Effort, Scratch, Seen};
use crate::{Scene, Settings, Site, TransferError};
use steradian_base::Task;
use steradian_parallel::prelude::*;
use steradian_sphere::Frame;
use steradian_sphere::sh::{self, Rotation};

/// Sites of a block, which is computed, stored and reported as one.
pub const BLOCK: usize = 64;

/// Visibility and unoccluded cosine of sites.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Direct {
    /// Bands of `t`.
    pub bands: usize,
    /// Bands of `v`.
    pub wide: usize,
    /// ∫ V (n·w) y_i dw, `bands`² a site, world axes.
    pub t: Vec<f32>,
    /// ∫ V y_i dw over n·w > 0, `wide`² a site.
    pub v: Vec<f32>,
    /// Estimated standard errors of a coefficient of `t` and of `v`, at most over the coefficients.
    pub error: Vec<[f32; 2]>,
    /// Sites from which nothing is visible.
    pub enclosed: Vec<u32>,
    /// Rays that were cast.
    pub rays: u64,
}

/// Results of one block, in the order of its sites.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Block {
    /// t, v and the two errors of each site.
    pub values: Vec<f32>,
    pub enclosed: Vec<u32>,
    pub rays: u64,
}

/// Data common to all sites.
struct Plan<'a> {
    scene: &'a Scene<'a>,
    settings: &'a Settings,
    table: Table,
    effort: Effort,
    /// Kernels of the clamped cosine and of the hemisphere.
    kernels: [Vec<f64>; 2],
    /// Largest magnitude of a harmonic of `t` and of `v`.
    magnitude: [f64; 2],
}

/// No harmonic of a band exceeds √((2l+1)/4π) (Unsöld's theorem).
fn magnitude(bands: usize) -> f64 {
    ((2 * bands - 1) as f64 / (4.0 * std::f64::consts::PI)).sqrt()
}

/// Visibility and direct light of `sites`.
pub(crate) fn direct(
    scene: &Scene<'_>,
    sites: &[Site],
    settings: &Settings,
    store: Option<&Store>,
    task: &Task,
) -> Result<Direct, TransferError> {
    let (bands, wide) = (settings.bands, settings.wide());
    let magnitude = [magnitude(bands), magnitude(wide)];
    // Two standard errors stay within it.
    let effort = match settings.rays {
        Some(rays) => Effort::Level(Settings::level(rays)),
        None => Effort::Error(0.5 * settings.shares()[0] / magnitude[0].max(magnitude[1])),
    };
    let table = Table::new(bands, wide, settings.table_level());
    let kernels = [sh::zonal::cosine(bands - 1), sh::zonal::phong(wide - 1, 0.0)];
    let plan = Plan { scene, settings, table, effort, kernels, magnitude };
    task.begin("visibility", sites.len() as u64);
    let block = |(k, sites): (usize, &[Site])| -> Result<Block, TransferError> {
        task.check()?;
        let block = match store.and_then(|s| s.read(k as u64)).and_then(Block::from_bytes) {
            Some(block) => block,
            None => {
                let block = plan.block((k * BLOCK) as u32, sites);
                if let Some(store) = store {
                    store.write(k as u64, &block.to_bytes())?;
                }
                block
            }
        };
        task.advance(sites.len() as u64);
        Ok(block)
    };
    let blocks: Result<Vec<Block>, TransferError> =
        sites.par_chunks(BLOCK).enumerate().with_max_len(1).map(block).collect();
    task.end();
    Ok(joined(&blocks?, bands, wide))
}

fn joined(blocks: &[Block], bands: usize, wide: usize) -> Direct {
    let mut out = Direct { bands, wide, ..Direct::default() };
    let (cosine, plain) = (bands * bands, wide * wide);
    for b in blocks {
        for site in b.values.chunks_exact(cosine + plain + 2) {
            out.t.extend_from_slice(&site[..cosine]);
            out.v.extend_from_slice(&site[cosine..cosine + plain]);
            out.error.push([site[cosine + plain], site[cosine + plain + 1]]);
        }
        out.enclosed.extend_from_slice(&b.enclosed);
        out.rays += b.rays;
    }
    out
}

impl Plan<'_> {
    fn block(&self, first: u32, sites: &[Site]) -> Block {
        let mut out = Block::default();
        let mut scratch = Scratch::default();
        for (k, site) in sites.iter().enumerate() {
            self.site(first + k as u32, site, &mut scratch, &mut out);
        }
        out
    }

    /// The blocked part is summed about the normal, rotated to world axes, and subtracted from the closed
    /// form of the open hemisphere.
    fn site(&self, index: u32, site: &Site, scratch: &mut Scratch, out: &mut Block) {
        let (cosine, plain) = (self.settings.bands.pow(2), self.settings.wide().pow(2));
        let start = out.values.len();
        out.values.resize(start + cosine + plain + 2, 0.0);
        if site.is_absent() {
            return;
        }
        let n = site.n.as_dvec3().normalize();
        let frame = Frame::from_normal(n).matrix();
        let origin = site.p + site.n * self.settings.offset;
        let bvh = &self.scene.bvh;
        let seen: Seen = scratch.look(bvh, origin, frame.as_mat3(), index, self.effort, &self.table);
        out.rays += seen.rays as u64;
        let row = &mut out.values[start..];
        row[cosine + plain] = (seen.error[0] * self.magnitude[0]) as f32;
        row[cosine + plain + 1] = (seen.error[1] * self.magnitude[1]) as f32;
        if seen.enclosed {
            out.enclosed.push(index);
            return;
        }
        let mut local = vec![0.0f64; cosine + plain];
        steradian_simd::dispatch(|| sum(&self.table, &scratch.blocked, cosine, &mut local));
        let mut world = vec![0.0f64; cosine.max(plain)];
        for (k, bands) in [(0, self.settings.bands), (1, self.settings.wide())] {
            let (from, count) = ([0, cosine][k], bands * bands);
            let local = &local[from..from + count];
            world[..count].fill(0.0);
            if !scratch.blocked.is_empty() {
                Rotation::new(bands - 1, frame).apply(local, &mut world[..count]);
            }
            let mut y = vec![0.0; count];
            sh::eval(bands - 1, n, &mut y);
            for (i, to) in row[from..from + count].iter_mut().enumerate() {
                *to = (self.kernels[k][i.isqrt()] * y[i] - world[i]) as f32;
            }
        }
    }
}

/// Σ share · row.
#[inline(always)]
fn sum(table: &Table, blocked: &[Blocked], cosine: usize, out: &mut [f64]) {
    let (with, without) = out.split_at_mut(cosine);
    for b in blocked {
        let row = table.row(b.level, b.cell);
        for (to, x) in with.iter_mut().zip(&row[..cosine]) {
            *to += f64::from(b.share[0] * x);
        }
        for (to, x) in without.iter_mut().zip(&row[cosine..]) {
            *to += f64::from(b.share[1] * x);
        }
    }
}
