//! The filter: light convolved with a zonal kernel, as a cube map, to a tolerance.
//!
//! In frequency space (Ramamoorthi & Hanrahan 2002, 5.4): coefficients of the light times those of the
//! kernel, then synthesis; small bright lights are added exactly, direction by direction. Where the order
//! that the tolerance needs is beyond the spectrum, direction by direction as a whole ([`crate::angular`]).

use super::edge_cube::{self, EdgeCube};
use crate::image::{Row, at_points};
use crate::{SmallLight, Source, Tree, Zonal, angular, order, probe};
use glam::DVec3;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_sphere::sh::{self, ShRgb};

/// Cube size: intervals per edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Size {
    /// Given.
    Fixed(usize),
    /// The smallest power of two, from 4 to this, whose interpolation error meets the tolerance.
    UpTo(usize),
}

/// Method by which a map was filtered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CubeMethod {
    /// By spherical harmonics.
    Frequency {
        /// Highest band used.
        order: usize,
    },
    /// By direct summation.
    Angular,
}

/// A filtered map and its estimated errors.
#[derive(Debug, Clone)]
pub struct Filtered {
    /// ∫ L(wi) K(d·wi) dwi over d.
    pub cube: EdgeCube,
    /// Method of filtering.
    pub way: CubeMethod,
    /// Bound of the relative RMS error by the bands left out; of the angular way, about its error.
    pub tail: f64,
    /// Estimate of the relative RMS error of bilinear lookup.
    pub interpolation: f64,
    /// Flux added by clipping negative values to zero, relative to all.
    pub clipped: f64,
}

/// Convolves `source` with `kernel` to relative RMS error `tolerance`. The angular method needs `tree`, and
/// is used only where the tolerance requires it and it is the better one.
pub fn filter(
    source: &Source,
    tree: &Tree,
    kernel: &dyn Zonal,
    size: Size,
    tolerance: f64,
    task: &Task,
) -> Result<Filtered, Cancelled> {
    filter_within(source, tree, kernel, (size, usize::MAX), tolerance, task)
}

/// [`filter`] with at most `direct` directions integrated one by one, each of which may take milliseconds (a
/// kernel of a narrow peak and a wide foot visits ten thousand parts of the light). Where the angular method
/// is needed, the map has no more texels than that; where interpolation between so few would lose more than
/// the bands beyond the spectrum hold, the whole spectrum is used instead.
pub fn filter_within(
    source: &Source,
    tree: &Tree,
    kernel: &dyn Zonal,
    (size, direct): (Size, usize),
    tolerance: f64,
    task: &Task,
) -> Result<Filtered, Cancelled> {
    task.check()?;
    let k = kernel.coefficients(source.order() + 64);
    // The brightest texels are summed apart.
    let squares: Vec<f64> = k.iter().map(|k| k * k).collect();
    let (order, tail) = order::of_source(source, &squares, 0.0, 0.25 * tolerance);
    let most = ((direct as f64 / 6.0).sqrt() as usize).saturating_sub(1).max(4);
    let few = match size {
        Size::Fixed(n) if n > most => None,
        Size::Fixed(n) => Some(Size::Fixed(n)),
        // Sizes are powers of two.
        Size::UpTo(n) => Some(Size::UpTo(n.min(1 << most.ilog2()))),
    };
    let coarse = few.map(|s| resolution(source, &k, s, 0.7 * tolerance));
    let (size, interpolation) = resolution(source, &k, size, 0.7 * tolerance);
    let summed = coarse.filter(|(n, e)| tail > tolerance.max(angular::ERROR) && (*n >= size || *e <= tail));
    if let Some((size, interpolation)) = summed {
        let cube = EdgeCube::try_from_fn(size, task, |d| angular::convolve_at(tree, kernel, d))?;
        return Ok(Filtered {
            cube,
            way: CubeMethod::Angular,
            tail: angular::ERROR,
            interpolation,
            clipped: 0.0,
        });
    }
    task.check()?;
    let (mut cube, clipped) = synthesized(source, &k[..=order], size, !source.negative && !kernel.signed());
    if !source.small_lights.is_empty() {
        cube = add_small_lights(source, kernel, &cube);
    }
    Ok(Filtered { cube, way: CubeMethod::Frequency { order }, tail, interpolation, clipped })
}

/// Cube size, and the relative RMS error of bilinear lookup that it gives.
fn resolution(source: &Source, k: &[f64], size: Size, tolerance: f64) -> (usize, f64) {
    let energy: Vec<f64> = source.bands.iter().zip(k).map(|(b, k)| b * k * k).collect();
    let error = |size: usize| edge_cube::lookup_error(&energy, size);
    match size {
        Size::Fixed(n) => (n.max(1), error(n.max(1))),
        Size::UpTo(n) => {
            let mut size = 4;
            while size < n && error(size) > tolerance {
                size *= 2;
            }
            (size, error(size))
        }
    }
}

/// The source's bands times those of a kernel on a cube, clamped at zero where `clip`, and the relative flux
/// that clamping added.
fn synthesized(source: &Source, k: &[f64], size: usize, clip: bool) -> (EdgeCube, f64) {
    let n = size + 1;
    let direction = |i: usize| edge_cube::direction(size, i / (n * n), i % n, i / n % n);
    let directions: Vec<DVec3> = (0..6 * n * n).into_par_iter().map(direction).collect();
    let count = sh::count(k.len() - 1);
    let used = ShRgb { order: k.len() - 1, c: source.spectrum.c.each_ref().map(|c| c[..count].to_vec()) };
    let [r, g, b] = at_points(&used, k, &directions);
    let texels = (0..directions.len()).map(|i| [r[i], g[i], b[i], 1.0]).collect();
    let cube = EdgeCube::from_texels(size, texels).unwrap_or_default();
    if clip { clipped(&cube) } else { (cube, 0.0) }
}

fn clipped(cube: &EdgeCube) -> (EdgeCube, f64) {
    let (mut added, mut all) = (0.0, 0.0);
    let mut texels = cube.texels().to_vec();
    for x in texels.iter_mut().flat_map(|t| &mut t[..3]) {
        all += f64::from(x.max(0.0));
        if *x < 0.0 {
            added -= f64::from(*x);
            *x = 0.0;
        }
    }
    let cube = EdgeCube::from_texels(cube.size(), texels).unwrap_or_default();
    (cube, if all > 0.0 { added / all } else { 0.0 })
}

/// Texels' cells a row of the cube at a time, disks one by one.
fn add_small_lights(source: &Source, kernel: &dyn Zonal, cube: &EdgeCube) -> EdgeCube {
    let n = cube.size() + 1;
    let (cells, disks): (Vec<SmallLight>, Vec<SmallLight>) =
        source.small_lights.iter().partition(|b| b.cell.is_some());
    let mut texels = cube.texels().to_vec();
    texels.par_chunks_mut(n).enumerate().for_each_init(Row::default, |row, (r, texels)| {
        let at = |i: usize| edge_cube::direction(n - 1, r / n, i, r % n);
        row.along(n, at);
        row.sums(&cells, kernel);
        for (i, t) in texels.iter_mut().enumerate() {
            let sum = disks_at(&disks, kernel, at(i));
            (0..3).for_each(|c| t[c] += (sum[c] + row.sum(c, i)) as f32);
        }
    });
    EdgeCube::from_texels(n - 1, texels).unwrap_or_default()
}

fn disks_at(disks: &[SmallLight], kernel: &dyn Zonal, d: DVec3) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let beyond = (kernel.support().min(3.2)).cos();
    for b in disks {
        let x = d.dot(b.direction);
        // A disk beyond the support by more than its radius gives nothing (chord ≤ angle).
        if x < beyond - 2.0 * b.radius {
            continue;
        }
        let scale = kernel.width().max((2.0 * (1.0 - x)).max(0.0).sqrt());
        let v = b.mean(scale, |wi| [kernel.value(d.dot(wi))])[0];
        (0..3).for_each(|c| sum[c] += b.flux[c] * v);
    }
    sum
}

/// Relative RMS difference between lookups of `cube` and exact evaluation at `n` directions.
pub fn measured(cube: &EdgeCube, tree: &Tree, kernel: &dyn Zonal, n: usize) -> f64 {
    let pair = |k: usize| {
        let d = probe::direction(k, n);
        let [r, g, b, _] = cube.sample(d.as_vec3().to_array());
        ([r, g, b].map(f64::from), angular::convolve_at(tree, kernel, d))
    };
    let pairs: Vec<_> = (0..n).into_par_iter().map(pair).collect();
    probe::relative_rms(pairs.into_iter())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lobe;
    use steradian_sphere::{Layout, SphereImage};

    /// Light of eight texels round the equator and a lobe far narrower than its bands: integrated direction
    /// by direction if there are few enough directions, else by the whole spectrum.
    #[test]
    fn sums_direction_by_direction_have_a_bound() {
        let image = SphereImage::from_fn(Layout::LatLong, 64, 32, |d| {
            [if (8.0 * d.z.atan2(d.x)).sin() > 0.5 { 9.0 } else { 1.0 }; 3]
        });
        let task = Task::quiet();
        let tree = Tree::new(Some(&image), &[], &task).expect("nobody cancels");
        let source = Source::of(Some(image), Vec::new(), 16, &task).expect("nobody cancels");
        let kernel = Lobe::ggx(0.02);
        let within = |direct| {
            let size = (Size::UpTo(8), direct);
            filter_within(&source, &tree, &kernel, size, 1e-3, &task).expect("nobody cancels")
        };
        let all = within(usize::MAX);
        assert_eq!((all.way, all.cube.size()), (CubeMethod::Angular, 8));
        // With six directions a face's edge the map loses more than the bands beyond the spectrum hold.
        assert_eq!(within(200).way, CubeMethod::Frequency { order: 16 });
        let of_bands = filter_within(&source, &tree, &kernel, (Size::Fixed(8), 200), 1e-3, &task);
        let of_bands = of_bands.expect("nobody cancels");
        assert_eq!((of_bands.way, of_bands.cube.size()), (CubeMethod::Frequency { order: 16 }, 8));
    }
}
