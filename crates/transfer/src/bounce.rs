//! Light that the mesh reflects to itself: each further scattering event is a gathering of the one before.
//!
//! t⁽ᵏ⁺¹⁾(x) = t(x) + ∫ (1 − V(w)) (n·w)₊ (ρ/π) t⁽ᵏ⁾(x'(w)) dw, x' the point that is hit, ρ its albedo
//! (Sloan, Kautz & Snyder 2002, *Precomputed Radiance Transfer*, section 4). t at a hit is interpolated
//! between the corners of its triangle; surfaces seen from behind are black.

use crate::grid::{direction, offset, place, shift};
use crate::links::faces;
use crate::table::Table;
use crate::{Scene, Settings, Site, Transfer, TransferError, direct, memory};
use steradian_base::Task;
use steradian_parallel::prelude::*;
use steradian_scene::{Hit, Ray};
use steradian_sphere::Frame;

/// Levels of the grid of rays of a site: the first, and the last to which it is refined for a tolerance.
/// Where rays are asked for by number, all gatherings have the grid of that number, of the last level at
/// most.
const LEVELS: std::ops::RangeInclusive<u32> = 5..=8;
/// Random seed, different from that of visibility.
const SEED: u32 = 0x8000_0000;

/// A point that a site sees: its triangle, the weights of the second and third corner, and its share of the
/// site's gathering without albedo, (n·w) dω/π.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Seen {
    triangle: u32,
    u: f32,
    v: f32,
    share: f32,
    /// Colour of the squares of a chessboard, whose sums tell the error.
    odd: bool,
}

struct Gather<'a> {
    scene: &'a Scene<'a>,
    settings: &'a Settings,
    channels: usize,
    table: Table,
}

/// Adds reflections up to the last scattering event to the direct light in `out`.
pub(crate) fn add(
    scene: &Scene<'_>,
    sites: &[Site],
    settings: &Settings,
    out: &mut Transfer,
    task: &Task,
) -> Result<(), TransferError> {
    let channels = settings.channels();
    let gather = Gather { scene, settings, channels, table: Table::new(1, 1, *LEVELS.end()) };
    let vertices = Site::vertices(scene.mesh);
    let own = if vertices == sites {
        out.t.clone()
    } else {
        let plain = Settings { matrices: false, ..settings.clone() };
        direct::direct(scene, &vertices, &plain, None, task)?.t
    };
    let own = spread(&own, settings.bands, channels);
    let mut all = own.clone();
    let first = settings.rays.map_or(*LEVELS.start(), |rays| Settings::level(rays).min(*LEVELS.end()));
    let adapt = settings.rays.is_none();
    // The last event is that at the sites themselves.
    let mut levels = vec![first; vertices.len()];
    for event in 2..settings.bounces {
        let (next, _) = gather.gather(&vertices, &all, &own, &mut levels, adapt && event == 2, task)?;
        let change = next.iter().zip(&all).map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max);
        all = next;
        if change < 1e-2 * settings.tolerance {
            break;
        }
    }
    out.direct = Some(out.t.clone());
    let own = spread(&out.t, settings.bands, channels);
    let mut levels = vec![first; sites.len()];
    let (t, errors) = gather.gather(sites, &all, &own, &mut levels, adapt, task)?;
    for (e, more) in out.error.iter_mut().zip(errors) {
        e[0] = e[0].hypot(2.0 * more);
    }
    (out.t, out.channels) = (t, channels);
    Ok(())
}

/// Repeats a vector for every channel.
fn spread(t: &[f32], bands: usize, channels: usize) -> Vec<f32> {
    t.chunks(bands * bands).flat_map(|t| std::iter::repeat_n(t, channels)).flatten().copied().collect()
}

impl Gather<'_> {
    /// `own` plus the light that `sites` gather of the vertices' vectors `from`, with the standard errors of
    /// the gathering. Where `adapt` is set, grids are refined until these errors are within their share of
    /// the tolerance.
    fn gather(
        &self,
        sites: &[Site],
        from: &[f32],
        own: &[f32],
        levels: &mut [u32],
        adapt: bool,
        task: &Task,
    ) -> Result<(Vec<f32>, Vec<f32>), TransferError> {
        let width = self.channels * self.settings.bands.pow(2);
        memory("interreflection", 12 * width as u64 * sites.len() as u64, task, "take fewer bands")?;
        task.begin("interreflection", sites.len() as u64);
        let mut out = own.to_vec();
        let mut errors = vec![0.0f32; sites.len()];
        let blocks = out.par_chunks_mut(width * direct::BLOCK).zip(errors.par_chunks_mut(direct::BLOCK));
        let blocks = blocks.zip(levels.par_chunks_mut(direct::BLOCK)).zip(sites.par_chunks(direct::BLOCK));
        let done =
            blocks.enumerate().with_max_len(1).try_for_each(|(b, (((out, errors), levels), sites))| {
                task.check()?;
                let mut work = Work::default();
                for (k, site) in sites.iter().enumerate().filter(|(_, s)| !s.is_absent()) {
                    let seed = SEED | (b * direct::BLOCK + k) as u32;
                    let row = &mut out[k * width..][..width];
                    errors[k] = self.site(site, seed, from, &mut levels[k], adapt, row, &mut work);
                }
                task.advance(sites.len() as u64);
                Ok(())
            });
        task.end();
        done.map(|()| (out, errors))
    }

    fn site(
        &self,
        site: &Site,
        seed: u32,
        from: &[f32],
        level: &mut u32,
        adapt: bool,
        row: &mut [f32],
        work: &mut Work,
    ) -> f32 {
        loop {
            self.look(site, seed, *level, work);
            let mut sums = [vec![0.0f64; row.len()], vec![0.0f64; row.len()]];
            for s in &work.seen {
                self.add(s, from, &mut sums[usize::from(s.odd)]);
            }
            let squares: f64 = sums[0].iter().zip(&sums[1]).map(|(a, b)| (a - b) * (a - b)).sum();
            let error = (squares / row.len() as f64).sqrt();
            if adapt && error > 0.5 * self.settings.shares()[1] && *level < *LEVELS.end() {
                *level += 1;
                continue;
            }
            for (k, to) in row.iter_mut().enumerate() {
                *to = (f64::from(*to) + sums[0][k] + sums[1][k]) as f32;
            }
            return error as f32;
        }
    }

    /// Finds the front faces of the mesh that a site sees.
    fn look(&self, site: &Site, seed: u32, level: u32, work: &mut Work) {
        let frame = Frame::from_normal(site.n.as_dvec3().normalize()).matrix().as_mat3();
        let origin = site.p + site.n * self.settings.offset;
        let (scale, shift) = (1.0 / (1u32 << level) as f32, shift(seed, level));
        let ray = |cell: u32| {
            let [x, y] = place(cell);
            let [u, v] = offset(shift, [x, y]);
            Ray { origin, direction: frame * direction((x as f32 + u) * scale, (y as f32 + v) * scale) }
        };
        work.rays.clear();
        work.rays.extend((0..1u32 << (2 * level)).map(ray));
        work.hits.clear();
        work.hits.resize(work.rays.len(), None);
        self.scene.bvh.closest_each(&work.rays, f32::INFINITY, &mut work.hits);
        work.seen.clear();
        for (cell, (hit, ray)) in work.hits.iter().zip(&work.rays).enumerate() {
            let Some(hit) = hit.filter(|h| faces(self.scene.mesh, h, ray.direction)) else { continue };
            let share = self.table.weight(level, cell as u32)[0] / std::f32::consts::PI;
            let [x, y] = place(cell as u32);
            work.seen.push(Seen { triangle: hit.triangle, u: hit.u, v: hit.v, share, odd: (x + y) % 2 == 1 });
        }
    }

    fn add(&self, s: &Seen, from: &[f32], sum: &mut [f64]) {
        let mesh = self.scene.mesh;
        let n = self.settings.bands.pow(2);
        let width = self.channels * n;
        let slot = mesh.material(s.triangle as usize) as usize;
        let Some(albedo) = self.settings.albedo.get(slot).or(self.settings.albedo.last()) else { return };
        let rows = mesh.triangles[s.triangle as usize].map(|v| &from[v as usize * width..][..width]);
        let weights = [1.0 - s.u - s.v, s.u, s.v];
        for c in 0..self.channels {
            let w = weights.map(|w| f64::from(w * s.share) * albedo[c]);
            for i in c * n..(c + 1) * n {
                sum[i] += (0..3).map(|k| w[k] * f64::from(rows[k][i])).sum::<f64>();
            }
        }
    }
}

/// Buffers of one thread.
#[derive(Default)]
struct Work {
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    seen: Vec<Seen>,
}
