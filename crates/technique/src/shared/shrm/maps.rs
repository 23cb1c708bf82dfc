//! CoefficientMaps of a chosen expansion.

use super::Expansion;
use crate::BakeError;
use crate::shared::maths::harmonics;
use crate::shared::tables::bundle::{Bundle, Grid};
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_prefilter::shrm::{self, CoefficientMaps, Plan, Term, global};
use steradian_sphere::sh::{self, ColumnsRgb, ShRgb, count, zonal};

/// Intervals from pole to pole of the diffuse part's map, and its highest band.
const DIFFUSE: (usize, usize) = (48, 24);

/// The light up to `order`, by columns.
pub fn columns(light: &ShRgb, order: usize) -> ColumnsRgb {
    let order = order.min(light.order);
    let c = light.c.each_ref().map(|c| c[..count(order)].to_vec());
    ColumnsRgb::from_world(&ShRgb { order, c })
}

/// The bundle of prefiltered maps.
pub fn bundle(slug: &'static str, maps: &CoefficientMaps) -> Result<Bundle, BakeError> {
    let grid = Grid::Globe { rows: maps.grid.rows(), columns: maps.grid.columns() };
    let planes: Vec<[&[f32]; 3]> =
        maps.planes.iter().map(|p| [p[0].as_slice(), p[1].as_slice(), p[2].as_slice()]).collect();
    let why =
        || format!("{} maps are more than {}: ask for lower orders", planes.len(), harmonics::MAX_TERMS);
    Bundle::from_planes(grid, &planes).ok_or_else(|| BakeError::Material { slug, why: why() })
}

/// A grid of square texels at the equator.
pub fn grid(size: usize) -> shrm::Grid {
    shrm::Grid::new(size + 1, 2 * size)
}

/// B_pq for all terms of [`harmonics::Harmonics`], in their order.
pub fn local_maps(slug: &'static str, e: &Expansion, size: usize, task: &Task) -> Result<Bundle, BakeError> {
    let light = &e.apart.rest;
    let pairs: Vec<_> = shrm::pairs(e.lpq.p).into_iter().filter(|(_, q)| *q <= e.q).collect();
    let terms: Vec<_> = pairs.iter().map(|&(p, q)| Term { q, k: e.lpq.row(p, q) }).collect();
    let order = e.f.min(light.order);
    let plan = Plan::new(order, e.q, grid(size));
    bundle(slug, &plan.maps(&columns(light, order), &terms, task)?)
}

/// B̂_pq (5.14) as cubes of `size` intervals per edge, for all terms of [`harmonics::Harmonics`] of order P,
/// in their order; where q = 0 alone is left B_p0, which no frame turns.
pub fn global_maps(slug: &'static str, e: &Expansion, size: usize, task: &Task) -> Result<Bundle, BakeError> {
    let light = &e.apart.rest;
    let order = e.f.min(light.order);
    let columns = columns(light, order);
    let term = |(p, q): (usize, usize)| Term { q, k: e.lpq.row(p, q) };
    let made = |terms: &[Term<'_>], p: usize| {
        Ok::<_, BakeError>(global::coefficients(&columns, order, terms, p, task)?)
    };
    let cube = |c: &ColumnsRgb| global::cube(c, size);
    let mut cubes = Vec::new();
    if e.q == 0 {
        for p in 0..=e.lpq.p {
            cubes.extend(made(&[term((p, 0))], 0)?.iter().map(cube));
        }
    } else {
        let pairs = shrm::pairs(e.lpq.p);
        let terms: Vec<_> = pairs.iter().copied().map(term).collect();
        let coefficients = made(&terms, e.lpq.p)?;
        let both = |(p, q): (usize, usize)| {
            let q = q as isize;
            [q, -q].into_iter().take(if q == 0 { 1 } else { 2 }).map(move |q| sh::index(p, q))
        };
        cubes.extend(pairs.into_iter().flat_map(both).map(|k| cube(&coefficients[k])));
    }
    let terms = cubes.len();
    let mut texels = vec![0.0; Grid::Cube { size }.texels() * 3 * terms];
    for (k, cube) in cubes.iter().enumerate() {
        for (to, from) in texels.chunks_exact_mut(3 * terms).zip(cube.texels()) {
            (0..3).for_each(|c| to[c * terms + k] = from[c]);
        }
    }
    let why = || format!("{terms} maps are more than {}: ask for a lower P", harmonics::MAX_TERMS);
    let made = Bundle::new(Grid::Cube { size }, terms, texels);
    made.ok_or_else(|| BakeError::Material { slug, why: why() })
}

/// Radiance of a Lambertian part over n; `None` without one.
pub fn diffuse_map(slug: &'static str, e: &Expansion, task: &Task) -> Result<Option<Bundle>, BakeError> {
    let (light, albedo) = (&e.apart.rest, e.diffuse);
    if albedo == [0.0; 3] {
        return Ok(None);
    }
    let (size, order) = (DIFFUSE.0, DIFFUSE.1.min(light.order));
    // y_l0 at its pole is √((2l + 1)/4π), and B = Σ_l A_l/π L'_l0 y_l0(0).
    let pole = |l: usize| ((2 * l + 1) as f64 / (4.0 * PI)).sqrt();
    let cosine = zonal::cosine(order);
    let k = albedo.map(|a| (0..=order).map(|l| a * cosine[l] / PI * pole(l)).collect::<Vec<_>>());
    let term = Term { q: 0, k: k.each_ref().map(Vec::as_slice) };
    let maps = Plan::new(order, 0, grid(size)).maps(&columns(light, order), &[term], task)?;
    bundle(slug, &maps).map(Some)
}
