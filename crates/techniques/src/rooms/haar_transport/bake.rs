//! The geometry's factor: what sites see, or the transport of their blocked light.

use super::HaarTransport;
use super::light::transform;
use super::material::Matter;
use super::params::Params;
use super::sights::{Sights, Transfer};
use super::transport::{Columns, MOST_SITES, Row, Scale, Transport};
use super::visibility::{Pyramid, Scratch};
use crate::shared::geometry::transport::{self, PerSite};
use crate::shared::light::sh_light::Albedo;
use crate::{BakeError, Geometry, Technique};
use steradian_base::Task;
use steradian_parallel::prelude::*;
use steradian_transfer::{BLOCK, Scene, Settings};

/// Rows of some sites, and the squares of their coefficients, summed over the sites.
type Block = (Vec<Row>, Vec<f64>);

/// What the sites of `g` see, or the transport of their blocked light.
pub(super) fn transfer(g: &Geometry, m: &Matter, p: &Params, task: &Task) -> Result<Transfer, BakeError> {
    match m {
        Matter::Lambert(albedo) => Ok(Transfer::Diffuse(diffuse(g, albedo, p, task)?)),
        Matter::Glossy(_) => Ok(Transfer::Sights(Box::new(Sights::new(g, p, task)?))),
    }
}

/// Transport of blocked light from all sites of `g`.
fn diffuse(g: &Geometry, m: &Albedo, p: &Params, task: &Task) -> Result<Transport, BakeError> {
    let slug = HaarTransport::CARD.slug;
    let sites = transport::sites(slug, g)?;
    if sites.len() > MOST_SITES {
        let why = format!("takes {MOST_SITES} sites at most, not {}", sites.len());
        return Err(BakeError::Geometry { slug, why });
    }
    let side = p.side();
    let texels = 6 * side * side;
    // A few hundred coefficients of 8 bytes a site; rows and columns are in memory at the same time.
    let need = sites.len() as u64 * 300 * 16 + texels as u64 * 64;
    if need > task.max_memory() {
        return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
    }
    let scene = Scene::new(&g.mesh).map_err(|e| BakeError::Geometry { slug, why: e.to_string() })?;
    let pyramid = Pyramid::new(side);
    let offset = Settings::default().offset;
    task.begin("visibility", sites.len() as u64);
    let block = |(b, sites): (usize, &[steradian_transfer::Site])| {
        task.check()?;
        let (mut scratch, mut all) = (Scratch::default(), vec![0.0; texels]);
        let mut squares = vec![0.0f64; texels];
        let mut rows = Vec::with_capacity(sites.len());
        for (k, site) in sites.iter().enumerate() {
            if site.is_absent() {
                rows.push(Row::default());
                continue;
            }
            let seed = (b * BLOCK + k) as u64;
            let whole =
                pyramid.look(&scene.bvh, site.p + site.n * offset, site.n, seed, &mut scratch, &mut all);
            transform(&mut all, side);
            squares.iter_mut().zip(&all).for_each(|(s, x)| *s += f64::from(*x).powi(2));
            // Shadows far from their occluder are narrow, but under a sun as dark as near ones: the error
            // allowed is relative to the geometric mean of the blocked and of the whole vector's square
            // length.
            let own: f64 = all.iter().map(|x| f64::from(*x).powi(2)).sum();
            rows.push(Row::of(&all, side, p.precision * p.precision * (own * whole).sqrt()));
        }
        task.advance(sites.len() as u64);
        Ok((rows, squares))
    };
    let blocks: Result<Vec<Block>, BakeError> =
        sites.par_chunks(BLOCK).enumerate().with_max_len(1).map(block).collect();
    task.end();
    let (mut rows, mut squares) = (Vec::with_capacity(sites.len()), vec![0.0; texels]);
    for (some, s) in blocks? {
        rows.extend(some);
        squares.iter_mut().zip(s).for_each(|(a, b)| *a += b);
    }
    let norms = squares.iter().map(|s| s.sqrt() as f32).collect();
    let normal = |s: &steradian_transfer::Site| if s.is_absent() { [0.0; 3] } else { s.n.to_array() };
    let normals = sites.iter().map(normal).collect();
    let reflected = reflected(g, m, p, task)?;
    Ok(Transport { side, normals, columns: Columns::new(&rows, side, Scale::Even), norms, reflected })
}

/// Vectors of the light that the mesh reflects to each site.
fn reflected(g: &Geometry, m: &Albedo, p: &Params, task: &Task) -> Result<PerSite, BakeError> {
    if p.bounces == 1 {
        return Ok(PerSite::default());
    }
    let settings =
        Settings { bands: p.bands, tolerance: 5e-3, bounces: p.bounces as u32, ..Settings::default() };
    let t = transport::bake(HaarTransport::CARD.slug, g, m.0, settings, task)?;
    Ok(transport::reflected(&t))
}
