//! Tables instead of coefficients, and back: views, sets of local directions, the texture of elevations.
//!
//! Ramamoorthi & Hanrahan 2002, 5.6.2 "Conversion between SHRMs and explicit forms". Back it goes by least
//! squares, which is integration where the directions are a quadrature.

use super::combine::{combine, least_squares};
use super::global::{Global, harmonics, is_complete, local_maps, places};
use super::{CoefficientMaps, Grid, Key};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_sphere::sh;

/// Planes of linear RGB on a grid of central directions, one for each direction of the viewer.
pub type Planes = Vec<[Vec<f32>; 3]>;

/// The twelve views of Cabral, Olano & Nemec 1999: vertices of an icosahedron. A spherical 5-design: with it,
/// fits up to P = 2 are integrals.
pub fn icosahedron() -> [DVec3; 12] {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    std::array::from_fn(|k| {
        let (s, t) = (if k & 1 == 0 { 1.0 } else { -1.0 }, if k & 2 == 0 { golden } else { -golden });
        match k / 4 {
            0 => DVec3::new(0.0, s, t),
            1 => DVec3::new(s, t, 0.0),
            _ => DVec3::new(t, 0.0, s),
        }
        .normalize()
    })
}

/// T × T directions (θ, φ): θ = π(i + ½)/T outermost, φ = 2π(j + ½)/T − π.
pub fn set(t: usize) -> Vec<[f64; 2]> {
    let step = |k: usize| (k as f64 + 0.5) / t as f64;
    (0..t * t).map(|k| [PI * step(k / t), 2.0 * PI * step(k % t) - PI]).collect()
}

/// The direction of (θ, φ) about z.
fn direction([theta, phi]: [f64; 2]) -> DVec3 {
    let (s, c) = theta.sin_cos();
    DVec3::new(s * phi.cos(), s * phi.sin(), c)
}

/// Reflection maps of far viewers in global unit directions (5.35).
pub fn views(global: &Global, directions: &[DVec3]) -> Planes {
    let matrix: Vec<Vec<f64>> = directions.iter().map(|d| harmonics(global.p, *d)).collect();
    combine(&matrix, &global.planes)
}

/// Global maps up to P from views, by least squares. `None` where there are too few directions, or the planes
/// are not one a direction, each of the grid's size.
pub fn from_views(grid: Grid, views: &[[Vec<f32>; 3]], directions: &[DVec3], p: usize) -> Option<Global> {
    let matrix: Vec<Vec<f64>> = directions.iter().map(|d| harmonics(p, *d)).collect();
    Some(Global { grid, p, planes: combine(&fit(grid, views, &matrix, None)?, views) })
}

/// Reflection maps of a set of local directions (θ_o, φ_o), each of which is fixed in every texel's frame
/// (5.10). `None` unless the maps are those of [`super::pairs`] of `p`.
pub fn local(maps: &CoefficientMaps, p: usize, directions: &[[f64; 2]]) -> Option<Planes> {
    is_complete(maps, p).then(|| combine(&local_matrix(p, directions), &maps.planes))
}

/// y_pq of local directions, in the order of the maps.
fn local_matrix(p: usize, directions: &[[f64; 2]]) -> Vec<Vec<f64>> {
    let places = places(p);
    let row = |d: &[f64; 2]| {
        let y = harmonics(p, direction(*d));
        places.iter().map(|at| y[*at]).collect()
    };
    directions.iter().map(row).collect()
}

/// Local maps up to P from those of a set of local directions, by least squares with weights (1 if there are
/// none). `None` where the directions do not tell the terms apart, or planes do not fit.
pub fn from_local(
    grid: Grid,
    planes: &[[Vec<f32>; 3]],
    directions: &[[f64; 2]],
    weights: Option<&[f64]>,
    p: usize,
) -> Option<CoefficientMaps> {
    let matrix: Vec<Vec<f64>> = directions.iter().map(|d| harmonics(p, direction(*d))).collect();
    Some(local_maps(grid, p, combine(&fit(grid, planes, &matrix, weights)?, planes)))
}

/// Kautz & McCool's texture of elevations θ_o (5.25): Σ_p B_p0 f_p0(θ_o), without the terms that depend on
/// azimuth. `None` unless the first maps are those with q = 0 of p = 0 … P.
pub fn texture_3d(maps: &CoefficientMaps, p: usize, elevations: &[f64]) -> Option<Planes> {
    let zonal = (0..=p).all(|term| maps.keys.get(term) == Some(&Key { term, q: 0 }));
    (zonal && maps.planes.len() > p).then(|| combine(&zonal_matrix(p, elevations), &maps.planes[..=p]))
}

fn zonal_matrix(p: usize, elevations: &[f64]) -> Vec<Vec<f64>> {
    elevations.iter().map(|t| sh::legendre(0, p, t.cos(), t.sin())).collect()
}

/// Maps with q = 0 of p = 0 … P from a texture of elevations, by least squares with weights (1 if there are
/// none).
pub fn from_texture_3d(
    grid: Grid,
    planes: &[[Vec<f32>; 3]],
    elevations: &[f64],
    weights: Option<&[f64]>,
    p: usize,
) -> Option<CoefficientMaps> {
    let fit = fit(grid, planes, &zonal_matrix(p, elevations), weights)?;
    Some(CoefficientMaps {
        grid,
        keys: (0..=p).map(|term| Key { term, q: 0 }).collect(),
        planes: combine(&fit, planes),
    })
}

/// The fit's matrix; `None` where the planes do not match the grid.
fn fit(
    grid: Grid,
    planes: &[[Vec<f32>; 3]],
    matrix: &[Vec<f64>],
    weights: Option<&[f64]>,
) -> Option<Vec<Vec<f64>>> {
    let fits = planes.len() == matrix.len() && planes.iter().flatten().all(|p| p.len() == grid.texels());
    if fits { least_squares(matrix, weights) } else { None }
}
