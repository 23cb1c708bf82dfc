//! The open texels of a cube around each site, in runs: what a view weighs with the reflectance.

use super::HaarTransport;
use super::cube::Level;
use super::params::Params;
use super::transport::{MOST_SITES, Seen, Transport};
use super::visibility::{EDGE, Pyramid, Scratch};
use crate::shared::geometry::transport::sites;
use crate::shared::material::view_table::SiteFrames;
use crate::tensors::{PartError, TensorFile};
use crate::{BakeError, Geometry, Part, Technique};
use glam::Vec3;
use std::sync::{Arc, Mutex, PoisonError};
use steradian_base::Task;
use steradian_brdf::SharedBrdf;
use steradian_formats::{Tensor, TensorData};
use steradian_parallel::prelude::*;
use steradian_transfer::{BLOCK, Scene, Settings, Site};

/// Longest run.
const LONGEST: usize = 1 << 13;

/// The geometry's factor.
pub enum Transfer {
    /// Transport of diffuse sites, whatever the view.
    Diffuse(Transport),
    /// What sites see, for transport towards a view.
    Sights(Box<Sights>),
}

/// Visibility of all sites.
pub struct Sights {
    /// The cube.
    pub cube: Level,
    /// Places of the sites; normals are zero where there is no surface.
    pub frames: SiteFrames,
    /// Index of the first run of each site, and of the end of the last one.
    starts: Vec<u32>,
    /// Texels in a row that are equally open, face after face, row after row: (length − 1) · 8 + open
    /// quarters.
    runs: Vec<u16>,
    /// The last transport that was made, for all frames of the bakes that share these sites.
    last: Mutex<Option<Last>>,
}

/// Transport towards an eye.
struct Last {
    eye: Vec3,
    brdf: SharedBrdf,
    seen: Arc<Seen>,
}

/// Runs of some sites, and the end of each site's among them.
type Block = (Vec<u16>, Vec<usize>);

/// Runs of a site.
fn runs(open: &[f32]) -> impl Iterator<Item = u16> + '_ {
    let chunks = open.chunk_by(|a, b| quarters(*a) == quarters(*b)).flat_map(|run| run.chunks(LONGEST));
    chunks.map(|run| ((run.len() - 1) as u16) << 3 | quarters(run[0]))
}

fn quarters(open: f32) -> u16 {
    (open * EDGE as f32).round() as u16
}

/// Texels of a run, and the part of them that is open.
fn run(r: u16) -> (usize, f32) {
    ((r >> 3) as usize + 1, f32::from(r & 7) / EDGE as f32)
}

impl Sights {
    /// Casts the rays of all sites.
    pub fn new(g: &Geometry, p: &Params, task: &Task) -> Result<Self, BakeError> {
        let slug = HaarTransport::CARD.slug;
        let all = sites(slug, g)?;
        let refused = |why: String| BakeError::Geometry { slug, why };
        if all.len() > MOST_SITES {
            return Err(refused(format!("takes {MOST_SITES} sites at most, not {}", all.len())));
        }
        // A run for every texel of half of the sphere at most, and less than a tenth of that in all.
        let need = all.len() as u64 * (36 + 2 * (3 * p.side() * p.side()) as u64 / 10);
        if need > task.max_memory() {
            return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
        }
        let scene = Scene::new(&g.mesh).map_err(|e| refused(e.to_string()))?;
        let pyramid = Pyramid::new(p.side());
        let offset = Settings::default().offset;
        task.begin("visibility", all.len() as u64);
        let block = |(b, sites): (usize, &[Site])| {
            task.check()?;
            let (mut scratch, mut found, mut ends) = (Scratch::default(), Vec::new(), Vec::new());
            for (k, site) in sites.iter().enumerate() {
                if !site.is_absent() {
                    let (origin, seed) = (site.p + site.n * offset, (b * BLOCK + k) as u64);
                    found.extend(runs(pyramid.see(&scene.bvh, origin, site.n, seed, &mut scratch)));
                }
                ends.push(found.len());
            }
            task.advance(sites.len() as u64);
            Ok((found, ends))
        };
        let blocks: Result<Vec<Block>, BakeError> =
            all.par_chunks(BLOCK).enumerate().with_max_len(1).map(block).collect();
        task.end();
        let (mut starts, mut runs) = (vec![0u32], Vec::new());
        for (found, ends) in blocks? {
            let before = runs.len();
            for end in ends {
                let end = u32::try_from(before + end);
                starts.push(end.map_err(|_| refused("has too many sites in detailed shadows".into()))?);
            }
            runs.extend(found);
        }
        let (cube, frames) = (Level::new(p.side()), SiteFrames::new(slug, g)?);
        Ok(Self { cube, frames, starts, runs, last: Mutex::new(None) })
    }

    /// Is there a surface at site `k`?
    pub fn is_there(&self, k: usize) -> bool {
        k < self.frames.len() && self.starts[k] < self.starts[k + 1]
    }

    /// The open part of each texel around site `k`, which is there.
    pub fn open(&self, k: usize, to: &mut Vec<f32>) {
        to.clear();
        for r in &self.runs[self.starts[k] as usize..self.starts[k + 1] as usize] {
            let (texels, open) = run(*r);
            to.resize(to.len() + texels, open);
        }
    }

    /// The transport towards `eye` that was made last, or `make`s it. Frames of several threads may make it
    /// at the same time: nothing waits here for a loop over threads.
    pub fn towards(&self, eye: Vec3, brdf: &SharedBrdf, make: impl FnOnce() -> Seen) -> Arc<Seen> {
        let last = || self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let kept = |l: &Last| (l.eye == eye && Arc::ptr_eq(&l.brdf, brdf)).then(|| l.seen.clone());
        if let Some(seen) = last().as_ref().and_then(kept) {
            return seen;
        }
        let seen = Arc::new(make());
        *last() = Some(Last { eye, brdf: brdf.clone(), seen: seen.clone() });
        seen
    }
}

impl Part for Sights {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        self.frames.save(to, prefix);
        let pairs = self.runs.chunks(2);
        let pair = |p: &[u16]| u32::from(p[0]) | u32::from(p.get(1).copied().unwrap_or(0)) << 16;
        let side = vec![self.cube.side as u32];
        for (n, v) in [("side", side), ("starts", self.starts.clone()), ("runs", pairs.map(pair).collect())] {
            let tensor = Tensor { shape: vec![v.len()], data: TensorData::U32(v) };
            to.tensors.insert(format!("{prefix}.{n}"), tensor);
        }
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let unexpected = |n: &str| PartError::Unexpected(format!("{prefix}.{n}"));
        let words = |n: &str| match from.tensors.get(&format!("{prefix}.{n}")) {
            Some(Tensor { shape, data: TensorData::U32(v) }) if *shape == [v.len()] => Ok(v.clone()),
            _ => Err(unexpected(n)),
        };
        let frames = SiteFrames::load(from, prefix)?;
        let side = match *words("side")? {
            [side] if side.is_power_of_two() && (4..=128).contains(&side) => side as usize,
            _ => return Err(unexpected("side")),
        };
        let (starts, pairs) = (words("starts")?, words("runs")?);
        let rising = starts.first() == Some(&0) && starts.windows(2).all(|w| w[0] <= w[1]);
        let count = starts.last().map_or(0, |e| *e as usize);
        if !rising || starts.len() != frames.len() + 1 || pairs.len() != count.div_ceil(2) {
            return Err(unexpected("starts"));
        }
        let mut runs: Vec<u16> = pairs.iter().flat_map(|p| [*p as u16, (*p >> 16) as u16]).collect();
        runs.truncate(count);
        let fills = |w: &[u32]| {
            let own = &runs[w[0] as usize..w[1] as usize];
            let texels: usize = own.iter().map(|r| run(*r).0).sum();
            own.is_empty() || texels == 6 * side * side && own.iter().all(|r| run(*r).1 <= 1.0)
        };
        if !starts.windows(2).all(fills) {
            return Err(unexpected("runs"));
        }
        Ok(Self { cube: Level::new(side), frames, starts, runs, last: Mutex::new(None) })
    }

    fn bytes(&self) -> usize {
        self.frames.bytes() + 4 * self.starts.len() + 2 * self.runs.len()
    }
}

impl Part for Transfer {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        match self {
            Self::Diffuse(t) => t.save(to, prefix),
            Self::Sights(s) => s.save(to, prefix),
        }
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        if from.tensors.contains_key(&format!("{prefix}.runs")) {
            return Ok(Self::Sights(Box::new(Sights::load(from, prefix)?)));
        }
        Ok(Self::Diffuse(Transport::load(from, prefix)?))
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Diffuse(t) => t.bytes(),
            Self::Sights(s) => s.bytes(),
        }
    }
}
