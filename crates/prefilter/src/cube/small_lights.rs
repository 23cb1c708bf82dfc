//! Small lights in a cube map: the cheapest of three ways that does not let them ring into the sky around
//! them.
//!
//! A truncated series rings about a sun, and its ripples would show in the sky, which is a thousand times
//! darker. Kernels that fall smoothly to nothing within the bands do not ring: all light goes through the
//! series. Of sharper ones the near part is summed directly at the few texels that it reaches, and the far
//! part, which is smooth, goes through the series ([`Split`]). What has too few bands even for that is summed
//! at every texel. (Summed at every texel of every level, the 256 small lights of a forest took 0.8 of the
//! 2.5 processor seconds of its chain's bake.)

use super::edge_cube::{self, EdgeCube};
use crate::image::Row;
use crate::image::bands::cost;
use crate::kernel::split::Split;
use crate::{SmallLight, Source, Zonal};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_parallel::prelude::*;

/// How the small lights of a source are convolved with a kernel.
pub(super) struct Plan<'a> {
    method: Method<'a>,
    /// Factors of the bands of the small lights' spectrum; none where they are summed at every texel.
    pub factors: Vec<f64>,
    /// Error of what goes through the series, relative to the convolution of everything else.
    pub error: f64,
    /// Largest value that goes through the series, about, in units of the RMS of the convolution of
    /// everything else.
    pub range: f64,
}

/// Where the small lights are added.
enum Method<'a> {
    /// All of their light goes through the series.
    Series,
    /// The near parts of their kernels are summed directly, the far parts go through the series.
    Near(Split<'a>),
    /// They are summed at every texel.
    Direct,
}

/// Reaches of near parts that are tried, times the highest band. (Fewer turns leave too much of the step.)
const TURNS: [f64; 5] = [10.0, 14.0, 20.0, 30.0, 40.0];

/// Part of the tolerance that bands of small lights may take that are left out of the series, were all of
/// them in one place: of the whole kernel, whose ripples would lie over all the sky, and of its far part. (A
/// tenth for both left errors of up to 1.3 % in the darkest texels of a forest's levels; a hundredth for both
/// makes the near part twice as wide for nothing.)
const WHOLE: f64 = 0.01;
const FAR: f64 = 0.1;

/// Texels of a row for which small lights are chosen together.
const RUN: usize = 16;

impl<'a> Plan<'a> {
    /// The cheapest method whose series leaves out at most a small part of `tolerance`. Errors are relative
    /// to the convolution with the source's image alone (its bands times `k`, the kernel's): small lights
    /// fill little of the map.
    pub fn new(source: &Source, kernel: &'a dyn Zonal, k: &[f64], texels: usize, tolerance: f64) -> Self {
        let lights = &source.small_lights;
        let result: f64 = source.base_bands().zip(k).map(|(b, k)| b * k * k).sum();
        let flux = |c: usize| lights.iter().map(|b| b.flux[c].abs()).sum::<f64>();
        let flux2: f64 = (0..3).map(|c| flux(c).powi(2)).sum();
        let direct = Self { method: Method::Direct, factors: Vec::new(), error: 0.0, range: 0.0 };
        if lights.is_empty() {
            return Self { method: Method::Series, ..direct };
        }
        // Least bands whose rest is small with all lights in one place, the worst that they can be; and that
        // rest.
        let needed = |k: &[f64], share: f64| {
            let allowed = (share * tolerance).powi(2) * result;
            let (mut left, mut kept) = (0.0, 0.0);
            for l in (0..k.len()).rev() {
                left += flux2 * (2 * l + 1) as f64 / (4.0 * PI) * k[l] * k[l];
                if left > allowed {
                    return (l <= source.order()).then(|| (l, f64::sqrt(kept / result)));
                }
                kept = left;
            }
            Some((0, 0.0))
        };
        let through = |method: Method<'a>, mut k: Vec<f64>, (order, error): (usize, f64)| {
            k.truncate(order + 1);
            let peak: f64 = k.iter().enumerate().map(|(l, k)| (2 * l + 1) as f64 * k.abs()).sum();
            let range = flux2.sqrt() * peak / (4.0 * PI) / (result / (4.0 * PI)).sqrt();
            Self { method, factors: k, error, range }
        };
        let price = cost::values(lights.len(), texels);
        if let Some(found) = needed(k, WHOLE) {
            return if cost::series(found.0, 0) < price {
                through(Method::Series, k.to_vec(), found)
            } else {
                direct
            };
        }
        for turns in TURNS {
            let split = Split::new(kernel, source.order(), turns);
            let part = 0.25 * split.reach2();
            if part > 0.1 {
                break;
            }
            let far = split.far(k.len() - 1);
            if let Some(found) = needed(&far, FAR) {
                // Each light's kernel at a few nodes; choosing lights costs a fiftieth of a kernel.
                let near = price * (4.0 * part + 0.02);
                let cheap = cost::series(found.0, 0) + near < price;
                return if cheap { through(Method::Near(split), far, found) } else { direct };
            }
        }
        direct
    }

    /// Are the small lights added to every texel of a finished map?
    pub fn is_direct(&self) -> bool {
        matches!(self.method, Method::Direct)
    }

    /// Adds what does not go through the series.
    pub fn add(&self, lights: &[SmallLight], kernel: &dyn Zonal, cube: EdgeCube) -> EdgeCube {
        match &self.method {
            Method::Series => cube,
            Method::Near(split) => add(lights, &split.near(), cube),
            Method::Direct => add(lights, kernel, cube),
        }
    }
}

/// Adds cells a run of texels at a time, disks one by one.
fn add(lights: &[SmallLight], kernel: &dyn Zonal, cube: EdgeCube) -> EdgeCube {
    let n = cube.size() + 1;
    let widest = lights.iter().map(|b| b.cell.map_or(b.radius, |c| c.size())).fold(0.0, f64::max);
    let mut texels = cube.into_texels();
    texels.par_chunks_mut(n).enumerate().for_each_init(Row::default, |row, (r, texels)| {
        for (k, texels) in texels.chunks_mut(RUN).enumerate() {
            let at = |i: usize| edge_cube::direction(n - 1, r / n, k * RUN + i, r % n);
            let (first, middle, last) = (at(0), at(texels.len() / 2), at(texels.len() - 1));
            let reach =
                kernel.support() + widest + middle.angle_between(first).max(middle.angle_between(last));
            let least = reach.min(PI).cos();
            let near = lights.iter().filter(|b| middle.dot(b.direction) >= least);
            let (cells, disks): (Vec<SmallLight>, Vec<SmallLight>) = near.partition(|b| b.cell.is_some());
            if !cells.is_empty() {
                row.along(texels.len(), at);
                row.sums(&cells, kernel);
            }
            for (i, t) in texels.iter_mut().enumerate() {
                let sum = disks_at(&disks, kernel, at(i));
                let cells = |c: usize| if cells.is_empty() { 0.0 } else { row.sum(c, i) };
                (0..3).for_each(|c| t[c] += (sum[c] + cells(c)) as f32);
            }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::sampled::small_lights_at;
    use crate::{CubeMethod, GgxMirror, Size, Tree, filter};
    use steradian_base::Task;
    use steradian_sphere::{Layout, SphereImage};

    /// Whatever the way, a map is that of the rest of the light and the sum over its small lights, within a
    /// part of the tolerance of the rest.
    #[test]
    fn every_way_gives_the_sum() {
        let image = SphereImage::from_fn(Layout::LatLong, 256, 128, |d| {
            let lamp = |at: DVec3, l: f32| if d.angle_between(at.normalize()) < 0.02 { l } else { 0.0 };
            let (a, b) = (lamp(DVec3::new(0.3, 0.8, -0.5), 9e3), lamp(DVec3::new(-0.7, 0.1, 0.4), 4e2));
            [1.0 + 0.5 * d.y as f32 + a, 1.0 + 0.3 * d.x as f32 + a + b, 0.4 + b]
        });
        let sun = SmallLight {
            direction: DVec3::new(-0.1, 0.5, 0.8).normalize(),
            radius: 0.0047,
            flux: [5.0, 4.0, 3.0],
            cell: None,
        };
        let (task, tolerance) = (Task::quiet(), 0.01);
        let tree = Tree::new(Some(&image), &[sun], &task).expect("nobody cancels");
        let source = Source::of(Some(image), vec![sun], 255, &task).expect("nobody cancels");
        assert!(source.small_lights.len() > 4 && source.small_lights.iter().any(|b| b.cell.is_none()));
        // The same bands of it, by the energy of the whole light; not raised to zero where their series
        // rings: only the sum is.
        let rest = Source::prepared(source.base.clone(), Vec::new(), 255);
        let rest = Source { negative: true, bands: source.bands.clone(), ..rest };
        let mut ways = Vec::new();
        for (alpha, size) in [(0.0123, 256), (0.05, 64), (0.3, 64), (0.3, 4), (1.0, 16)] {
            let kernel = GgxMirror::new(alpha);
            let of = |source: &Source| {
                filter(source, &tree, &kernel, Size::Fixed(size), tolerance, &task).expect("quiet")
            };
            let (got, rest) = (of(&source), of(&rest));
            assert!(matches!(got.way, CubeMethod::Frequency { .. }));
            let n = size + 1;
            let (mut off, mut all) = (0.0, 0.0);
            for (k, (got, rest)) in got.cube.texels().iter().zip(rest.cube.texels()).enumerate() {
                let d = edge_cube::direction(size, k / (n * n), k % n, k / n % n);
                let small = small_lights_at(&source.small_lights, &kernel, d);
                for c in 0..3 {
                    let exact = (f64::from(rest[c]) + small[c]).max(0.0);
                    let e = f64::from(got[c]) - exact;
                    off += e * e;
                    all += f64::from(rest[c]).powi(2);
                    assert!(e.abs() < 0.02 * exact, "alpha {alpha}, {d}: {} {exact}", got[c]);
                }
            }
            let off = (off / all).sqrt();
            assert!(off < 0.2 * tolerance, "alpha {alpha}, {size}: {off:e}");
            let k = kernel.coefficients(2 * 255 + 64);
            ways.push(match Plan::new(&source, &kernel, &k, 6 * n * n, tolerance).method {
                Method::Series => "series",
                Method::Near(_) => "near",
                Method::Direct => "direct",
            });
        }
        for way in ["series", "near", "direct"] {
            assert!(ways.contains(&way), "{ways:?}");
        }
    }
}
