//! One light, many kernels: an array of cubes from one spectrum, as three-dimensional prefiltered maps need
//! them (Kautz & McCool 2000; Kautz, Vázquez, Heidrich & Seidel 2000).

use super::edge_cube::{self, EdgeCube};
use crate::Source;
use crate::light::polar;
use glam::DVec3;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_sphere::sh::{ColumnsRgb, PointSynthesis};

/// Error of synthesis relative to the range of each map.
const SYNTHESIS: f64 = 1e-5;

/// Convolutions of one light with several kernels.
#[derive(Debug, Clone, PartialEq)]
pub struct CubeArray {
    /// One map per kernel, all of one size.
    pub cubes: Vec<EdgeCube>,
    /// Flux added by clipping negative values to zero, relative to all.
    pub clipped: f64,
}

/// ∫ L(wi) K_j(d·wi) dwi over d for every kernel j, given by its coefficients k_0 … k_F; F is at most the
/// source's order. Small lights are part of the spectrum: kernels without energy beyond band F do not ring
/// about them. Negative sums are set to zero where the light is not negative.
pub fn cube_array(
    source: &Source,
    kernels: &[Vec<f64>],
    size: usize,
    task: &Task,
) -> Result<CubeArray, Cancelled> {
    let size = size.max(1);
    let order = kernels.iter().map(|k| k.len().saturating_sub(1)).max().unwrap_or(0).min(source.order());
    task.check()?;
    // Exchanging the poles twice changes nothing.
    let columns = ColumnsRgb::from_sh(&polar::to_world(&source.coefficients(order)));
    let n = size + 1;
    let directions: Vec<DVec3> = (0..6 * n * n)
        .into_par_iter()
        .map(|k| edge_cube::direction(size, k / (n * n), k % n, k / n % n))
        .collect();
    let mut planes: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; directions.len()]);
    let (mut cubes, mut added, mut all) = (Vec::with_capacity(kernels.len()), 0.0, 0.0);
    task.begin("prefilter", kernels.len() as u64);
    for k in kernels {
        task.check()?;
        let k = &k[..k.len().min(order + 1)];
        let [r, g, b] = &mut planes;
        PointSynthesis::new(&columns, k, SYNTHESIS).at(&directions, [r, g, b]);
        if !source.negative {
            for x in planes.iter_mut().flatten() {
                all += f64::from(x.max(0.0));
                added -= f64::from(x.min(0.0));
                *x = x.max(0.0);
            }
        }
        let texel = |i| [planes[0][i], planes[1][i], planes[2][i], 1.0];
        let texels = (0..directions.len()).map(texel).collect();
        cubes.push(EdgeCube::from_texels(size, texels).unwrap_or_default());
        task.advance(1);
    }
    task.end();
    Ok(CubeArray { cubes, clipped: if all > 0.0 { added / all } else { 0.0 } })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Power, Size, Tree, Zonal, filter};
    use steradian_light::{DiskLight, Environment, Lights};
    use steradian_sphere::{Layout, SphereImage};

    /// The stack equals maps that are filtered one at a time.
    #[test]
    fn a_stack_is_its_maps() {
        let image = SphereImage::from_fn(Layout::LatLong, 64, 32, |d| {
            [1.0 + d.x as f32, if d.y > 0.7 { 4.0 } else { 0.2 }, (2.0 * d.z).exp() as f32]
        });
        let direction = DVec3::new(0.3, 0.8, -0.5).normalize();
        let sun = DiskLight { direction, angular_radius: 0.02, radiance: [300.0, 200.0, 100.0] };
        let lights = Lights { disks: vec![sun], ..Environment { image }.into() };
        let task = Task::quiet();
        let source = Source::new(&lights, 60, &task).unwrap();
        let tree = Tree::new(source.base.as_ref(), &source.small_lights, &task).unwrap();
        let kernels = [Power { n: 10.0 }, Power { n: 80.0 }];
        let made = cube_array(&source, &kernels.map(|k| k.coefficients(60)), 10, &task).unwrap();
        for (k, cube) in kernels.iter().zip(&made.cubes) {
            let one = filter(&source, &tree, k, Size::Fixed(10), 1e-4, &task).unwrap().cube;
            let peak = one.texels().iter().map(|t| t[0]).fold(0.0, f32::max);
            for (a, b) in cube.texels().iter().zip(one.texels()) {
                assert!((0..3).all(|c| (a[c] - b[c]).abs() < 2e-3 * peak), "{}: {a:?} {b:?}", k.n);
            }
        }
        assert!(made.clipped < 1e-3, "{}", made.clipped);
    }
}
