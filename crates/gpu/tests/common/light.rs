//! Lights to refilter, and the exact filter to compare with.

#![allow(dead_code, reason = "each binary uses its part")]

use glam::DVec3;
use steradian_base::Task;
use steradian_gpu::refilter::Level;
use steradian_light::{DiskLight, Environment, Lights};
use steradian_prefilter::{EdgeCube, SmallLight, Tree, angular, edge_cube};
use steradian_sphere::{Layout, SphereImage};

/// A graded sky with a bright window whose edges cross a corner of the cube, and a small lamp.
pub fn room_with_window() -> Lights {
    let image = SphereImage::from_fn(Layout::LatLong, 256, 128, |d| {
        let window = if d.dot(DVec3::ONE.normalize()) > 0.95 { 12.0 } else { 0.0 };
        let lamp = if d.dot(DVec3::new(-0.6, 0.0, 0.8)) > 0.995 { 60.0 } else { 0.0 };
        let base = [0.6 + 0.4 * d.y, 0.5 + 0.3 * d.x, 0.7 + 0.2 * d.z * d.x];
        [base[0] + window, base[1] + 0.9 * window + lamp, base[2] + 0.7 * window].map(|x| x as f32)
    });
    Environment { image }.into()
}

/// These lights with a sun.
pub fn with_sun(mut lights: Lights) -> Lights {
    let direction = DVec3::new(0.5, 0.7, -0.45).normalize();
    lights.disks.push(DiskLight { direction, angular_radius: 0.02, radiance: [900.0, 800.0, 500.0] });
    lights
}

/// Hierarchy of the light, suns included.
pub fn tree(lights: &Lights) -> Tree {
    let suns: Vec<SmallLight> = lights.disks.iter().map(SmallLight::from).collect();
    Tree::new(lights.environment.as_ref().map(|e| &e.image), &suns, &Task::quiet()).expect("nobody cancels")
}

/// RMS difference between samples of `cube`, at most `most` of them evenly chosen, and the exact filter,
/// relative to the exact RMS; samples count by their solid angle.
pub fn error(cube: &EdgeCube, level: &Level, tree: &Tree, most: usize) -> Option<f64> {
    let kernel = level.kernel.zonal()?;
    let n = cube.size();
    let all = cube.texels().len();
    let (mut off, mut whole) = (0.0, 0.0);
    for k in 0..most.min(all) {
        // Steps of the golden ratio meet faces, rows and columns evenly.
        let k = if most >= all {
            k
        } else {
            ((k as f64 * 0.618_033_988_749_894_9).fract() * all as f64) as usize
        };
        let (face, j, i) = (k / (n + 1).pow(2), k / (n + 1) % (n + 1), k % (n + 1));
        let d = edge_cube::direction(n, face, i, j);
        let exact = angular::convolve_at(tree, &*kernel, d).map(|x| x * f64::from(level.gain));
        // On the cube the largest coordinate is 1: dω ∝ its cube.
        let weight = d.abs().max_element().powi(3);
        for c in 0..3 {
            off += weight * (f64::from(cube.texels()[k][c]) - exact[c]).powi(2);
            whole += weight * exact[c].powi(2);
        }
    }
    Some((off / whole).sqrt())
}
