//! Measures milliseconds of a refilter per method and level; also the error of every level and the device's
//! bandwidth roof.
//!
//! A GGX chain of six levels from 256² (`STERADIAN_SIZE` takes another size), and the Gaussians of
//! `gaussian_lobes`, of a sunny sky, or of the image that `STERADIAN_ENVIRONMENT` names; the smallest of
//! several runs, by the device's own clock where it has one. Errors are relative RMS over samples of the
//! level against direct summation on the CPU. `STERADIAN_KEEP=FOLDER` keeps each chain as a cross of its
//! faces next to the exact one.

#![allow(clippy::print_stdout, reason = "a benchmark's output")]

#[path = "../tests/common/light.rs"]
mod light;

use std::path::Path;
use steradian_formats::{Raster, WriteOptions, write_image};
use steradian_gpu::refilter::{Level, Method, Plan, Refilter, Surroundings, ggx_levels};
use steradian_gpu::{Gpu, GpuError};
use steradian_light::{Environment, Lights};
use steradian_prefilter::{EdgeCube, Tree, angular};
use steradian_techniques::gpu::Kernel;

const WAYS: [Method; 4] = [Method::Convolution, Method::Box, Method::Paraboloid, Method::Frequency];
/// Samples of a level that are compared.
const PROBES: usize = 400;

fn main() {
    let gpu = match Gpu::open() {
        Ok(gpu) => gpu,
        Err(e) => return println!("not measured: {e}"),
    };
    println!("{}{}", gpu.describe(), if gpu.is_software() { ", on the CPU" } else { "" });
    let lights = match lights() {
        Ok(lights) => lights,
        Err(e) => return println!("not measured: {e}"),
    };
    if let Err(e) = measure(&gpu, &lights) {
        println!("ended: {e}");
    }
}

fn lights() -> Result<Lights, Box<dyn std::error::Error>> {
    if let Some(path) = std::env::var_os("STERADIAN_ENVIRONMENT") {
        let loaded = steradian_light::load::load(Path::new(&path), &Default::default())?;
        return Ok(loaded.into_environment().into());
    }
    let sky = steradian_light::sky::by_name("sky:elevation=20,azimuth=140,turbidity=3", 512, 256)?;
    Ok(Lights { disks: sky.sun.into_iter().collect(), ..Environment { image: sky.image }.into() })
}

fn measure(gpu: &Gpu, lights: &Lights) -> Result<(), GpuError> {
    let size = std::env::var("STERADIAN_SIZE").ok().and_then(|s| s.parse().ok()).unwrap_or(256);
    let bytes = if gpu.is_software() { 64 << 20 } else { 1 << 30 };
    let roof = gpu.copy_bandwidth(bytes)?;
    println!("bandwidth roof: {:.1} GB/s read and written by a copy", 1e-9 * roof);
    let tree = light::tree(lights);
    let light = Surroundings::from_lights(gpu, lights)?;
    let mut first = None;
    let chains = [("GGX", ggx_levels(size, 6)), ("Gaussians, from a degree", gaussian_levels(size))];
    for ((name, levels), way) in chains.iter().flat_map(|c| WAYS.map(|way| (c, way))) {
        let plan = Plan::new(way, levels)?;
        let mut refilter = Refilter::new(gpu, plan)?;
        let times = fastest(gpu, &mut refilter, &light)?;
        let total: f64 = times.iter().map(|t| t.2).sum();
        let first = *first.get_or_insert(total);
        let reads: u64 = refilter.plan().reads().iter().map(|r| r.2).sum();
        println!(
            "\n{name}, {way:?}: {total:.3} ms, {:.2} of the first; about {:.1} M texels read, {:.1} GB/s of them",
            total / first,
            1e-6 * reads as f64,
            16e-6 * reads as f64 / total
        );
        report(gpu, &refilter, &times, &tree)?;
    }
    Ok(())
}

/// The chain of `gaussian_lobes` (Green, Kautz & Durand 2007): the light, then Gaussians whose widths double.
fn gaussian_levels(size: u32) -> Vec<Level> {
    let level = |k: i32| {
        let kernel = match k {
            0 => Kernel::Mirror,
            _ => Kernel::Gaussian { sigma: 1f64.to_radians() * f64::from(1 << (k - 1)) },
        };
        Level { size: (size >> (k / 2)).max(16), kernel, gain: 1.0 }
    };
    (0..8).map(level).collect()
}

type Times = Vec<(&'static str, Option<usize>, f64)>;

/// The shortest time of each pass.
fn fastest(gpu: &Gpu, refilter: &mut Refilter, light: &Surroundings) -> Result<Times, GpuError> {
    let mut best: Times = Vec::new();
    for _ in 0..if gpu.is_software() { 2 } else { 20 } {
        refilter.set_light(light.clone());
        let times = refilter.profile(gpu)?;
        if best.is_empty() {
            best = times;
        } else {
            best.iter_mut().zip(times).for_each(|(b, t)| b.2 = b.2.min(t.2));
        }
    }
    Ok(best)
}

fn report(gpu: &Gpu, refilter: &Refilter, times: &Times, tree: &Tree) -> Result<(), GpuError> {
    let of = |level: Option<usize>| times.iter().filter(|t| t.1 == level).map(|t| t.2).sum::<f64>();
    let mut names: Vec<_> = times.iter().filter(|t| t.1.is_none()).map(|t| (t.0, 0.0)).collect();
    let mut seen = Vec::new();
    names.retain(|n| {
        !seen.contains(&n.0) && {
            seen.push(n.0);
            true
        }
    });
    for n in &mut names {
        n.1 = times.iter().filter(|t| t.1.is_none() && t.0 == n.0).map(|t| t.2).sum();
    }
    let names: Vec<_> =
        names.iter().map(|(n, ms)| format!("{} {ms:.3}", n.trim_start_matches("refilter_"))).collect();
    println!("  shared      {:9.3} ms   ({})", of(None), names.join(", "));
    let cubes = refilter.read(gpu)?;
    for (k, (level, cube)) in refilter.plan().levels().iter().zip(&cubes).enumerate() {
        let error = match light::error(cube, level, tree, PROBES) {
            Some(e) => format!("error {:.3} % RMS", 100.0 * e),
            None => String::new(),
        };
        println!("  {:4}² {:9.3} ms   {error:22} {:?}", level.size, of(Some(k)), level.kernel);
        if let Some(folder) = std::env::var_os("STERADIAN_KEEP") {
            let exact = level.kernel.zonal().filter(|_| level.size <= 64).map(|kernel| {
                EdgeCube::from_fn(level.size as usize, |d| angular::convolve_at(tree, &*kernel, d))
            });
            let name = format!("{:?}-{k}.png", refilter.plan().method()).to_lowercase();
            keep(&Path::new(&folder).join(name), [Some(cube), exact.as_ref()]);
        }
    }
    Ok(())
}

/// Crosses of faces, one next to the other: -X +Z +X -Z with +Y above and -Y below +Z; the first cube's mean
/// is a third of white.
fn keep(path: &Path, cubes: [Option<&EdgeCube>; 2]) {
    const PLACES: [(usize, usize); 6] = [(2, 1), (0, 1), (1, 0), (1, 2), (1, 1), (3, 1)];
    let n = cubes[0].map_or(1, |c| c.size() + 1);
    let count = cubes.iter().flatten().count();
    let (width, height) = (4 * n * count, 3 * n);
    let all = cubes[0].map_or(&[][..], |c| c.texels());
    let mean = all.iter().map(|t| (t[0] + t[1] + t[2]) / 3.0).sum::<f32>() / all.len() as f32;
    let mut planes: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; width * height]);
    for (side, cube) in cubes.iter().flatten().enumerate() {
        for (k, t) in cube.texels().iter().enumerate() {
            let (x, y) = PLACES[k / (n * n)];
            let at = (y * n + k / n % n) * width + (4 * side + x) * n + k % n;
            (0..3).for_each(|c| planes[c][at] = (t[c] / (2.0 * mean + t[c])).max(0.0));
        }
    }
    let raster = Raster::rgb(width, height, planes);
    if let Err(e) = write_image(path, &raster, &WriteOptions::default()) {
        println!("{}: {e}", path.display());
    }
}
