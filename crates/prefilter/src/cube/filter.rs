//! The filter: light convolved with a zonal kernel, as a cube map, to a tolerance.
//!
//! In frequency space (Ramamoorthi & Hanrahan 2002, 5.4): coefficients of the light times those of the
//! kernel, then synthesis; what a series would blur of small bright lights is added exactly, direction by
//! direction (`small_lights.rs`). Where the order that the tolerance needs is beyond the spectrum,
//! direction by direction as a whole ([`crate::angular`]).

use super::edge_cube::{self, EdgeCube};
use super::small_lights::Plan;
use crate::image::at_points;
use crate::{Source, Tree, Zonal, angular, order, probe};
use glam::DVec3;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_sphere::sh::ShRgb;

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
    // The tails of kernels with a kink at the horizon fall as a power of the band.
    let top = if source.small_lights.is_empty() { source.order() } else { 2 * source.order() };
    let k = kernel.coefficients(top + 64);
    // Small lights are looked at apart.
    let squares: Vec<f64> = k.iter().map(|k| k * k).collect();
    let (order, tail) = order::of_source(source, &squares, 0.0, SERIES * tolerance);
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
    let texels = 6 * (size + 1) * (size + 1);
    let small = Plan::new(source, kernel, &k, texels, tolerance);
    let cube = synthesized(source, &k[..=order], &small, size, tolerance);
    let lights = &source.small_lights;
    let (cube, clipped) = if source.negative || kernel.signed() {
        (small.add(lights, kernel, cube), 0.0)
    } else if small.is_direct() {
        let (cube, clipped) = clip(cube);
        (small.add(lights, kernel, cube), clipped)
    } else {
        // Parts of small lights in the series are nothing without the other parts.
        clip(small.add(lights, kernel, cube))
    };
    let way = CubeMethod::Frequency { order: order.max(small.factors.len().saturating_sub(1)) };
    Ok(Filtered { cube, way, tail: tail + small.error, interpolation, clipped })
}

/// Part of the tolerance that bands left out may take.
const SERIES: f64 = 0.25;

/// Bands that an analysis of the light needs, so that [`filter`] leaves out no more than it may; `source` is
/// one of fewer bands, and its own are returned where another analysis would gain little. At most `most`.
pub fn bands(source: &Source, kernel: &dyn Zonal, tolerance: f64, most: usize) -> usize {
    let squares: Vec<f64> = kernel.coefficients(most + 64).iter().map(|k| k * k).collect();
    let bands = |part: f64| order::of_analysis(source, &squares, part * tolerance).min(most);
    if bands(2.0 * SERIES) <= source.order() { source.order() } else { bands(SERIES) }
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

/// Largest error of [`synthesized`], relative to the range of the function.
const SYNTHESIS: f64 = 1e-5;

/// The source's bands times those of a kernel on a cube, small lights as planned.
fn synthesized(source: &Source, k: &[f64], small: &Plan<'_>, size: usize, tolerance: f64) -> EdgeCube {
    let n = size + 1;
    let direction = |i: usize| edge_cube::direction(size, i / (n * n), i % n, i / n % n);
    let directions: Vec<DVec3> = (0..6 * n * n).into_par_iter().map(direction).collect();
    let order = k.len().max(small.factors.len()) - 1;
    let mut sum = ShRgb::zero(order);
    for (c, sum) in sum.c.iter_mut().enumerate() {
        for (from, factors) in [(&source.spectrum, k), (&source.small_spectrum, &small.factors)] {
            for (l, factor) in factors.iter().enumerate() {
                let at = l * l..(l + 1) * (l + 1);
                sum[at.clone()].iter_mut().zip(&from.c[c][at]).for_each(|(s, x)| *s += factor * x);
            }
        }
    }
    // What small lights leave in the series is many times brighter than the rest.
    let error = (0.1 * tolerance / small.range.max(1.0)).min(SYNTHESIS);
    let [r, g, b] = at_points(&sum, &vec![1.0; order + 1], &directions, error);
    let texels = (0..directions.len()).map(|i| [r[i], g[i], b[i], 1.0]).collect();
    EdgeCube::from_texels(size, texels).unwrap_or_default()
}

/// The cube with its negative texels raised to zero, and the relative flux that this added.
fn clip(cube: EdgeCube) -> (EdgeCube, f64) {
    let (mut added, mut all) = (0.0, 0.0);
    let size = cube.size();
    let mut texels = cube.into_texels();
    for x in texels.iter_mut().flat_map(|t| &mut t[..3]) {
        all += f64::from(x.max(0.0));
        if *x < 0.0 {
            added -= f64::from(*x);
            *x = 0.0;
        }
    }
    let cube = EdgeCube::from_texels(size, texels).unwrap_or_default();
    (cube, if all > 0.0 { added / all } else { 0.0 })
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

    /// Where few bands of a light are known, so many are asked for that those which a tolerance needs are
    /// among them; where it would gain little, no more.
    #[test]
    fn an_analysis_has_the_bands_that_a_filter_uses() {
        let image = SphereImage::from_fn(Layout::LatLong, 256, 128, |d| {
            [1.0 + (if (9.0 * d.x).sin() > 0.3 { 3.0 } else { 0.0 }), 0.5 + (5.0 * d.y).sin() as f32, 1.0]
        });
        let task = Task::quiet();
        let source = |order| Source::of(Some(image.clone()), Vec::new(), order, &task).expect("quiet");
        let (few, many) = (source(31), source(400));
        for alpha in [0.01, 0.03, 0.1, 0.5] {
            let kernel = Lobe::ggx(alpha);
            let squares: Vec<f64> = kernel.coefficients(464).iter().map(|k| k * k).collect();
            let (used, _) = order::of_source(&many, &squares, 0.0, SERIES * 0.01);
            let enough = bands(&few, &kernel, 0.01, 400);
            let (_, tail) = order::of_source(&source(enough), &squares, 0.0, SERIES * 0.01);
            assert!(enough >= used && tail <= SERIES * 0.01 || enough == 31 && tail <= 2.0 * SERIES * 0.01);
            assert!(enough == 400 || enough < 3 * used.max(31), "{alpha}: {used} {enough}");
        }
    }
}
