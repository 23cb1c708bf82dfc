//! Times of the transform, in a form that `peers.py` reads; RAYON_NUM_THREADS says on how many threads.
//! `cargo bench -p steradian-sphere --bench transform -- [gl|equirectangular|cube] [image] band…`
//!
//! Three channels of f64 (`image`: of f32 in image precision), basis about the image's pole and coefficients
//! by m, as other libraries have them. Prints grid, band, and
//! milliseconds of synthesis and analysis (each the least of several), and of planning; for `cube`, of synthesis
//! to a cube map of 256² texels a face with errors of 2e-3 and 1e-5.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

use std::hint::black_box;
use std::time::Instant;
use steradian_sphere::Layout;
use steradian_sphere::sh::{ColumnsRgb, Grid, PointSynthesis, Precision, Sample, ShRgb, ShTransform, count};

/// Time on the processor so far in ms of the only thread, where the system tells; it lags by up to a few.
fn on_cpu() -> Option<f64> {
    if rayon::current_num_threads() > 1 {
        return None;
    }
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-6)
}

/// Least of several runs, in milliseconds; of long ones the least of several means without what other programs
/// took.
fn best<R>(mut f: impl FnMut() -> R) -> f64 {
    let mut best = f64::INFINITY;
    let start = Instant::now();
    for run in 0.. {
        let t = Instant::now();
        black_box(f());
        best = best.min(t.elapsed().as_secs_f64() * 1e3);
        if run >= 4 && start.elapsed().as_secs_f64() > 0.2 {
            break;
        }
    }
    let runs = (100.0 / best).ceil();
    for _ in 0..if best > 0.5 { 4 } else { 0 } {
        let Some(before) = on_cpu() else { break };
        for _ in 0..runs as usize {
            black_box(f());
        }
        best = on_cpu().map_or(best, |after| best.min((after - before) / runs));
    }
    best
}

fn time<S: Sample>(name: &str, band: usize, precision: Precision) {
    let (grid, width, height) = match name {
        "gl" => (Grid::GaussLegendre, 2 * band + 2, band + 1),
        _ => (Grid::Equirectangular, 4 * band + 4, 2 * band + 2),
    };
    let c = std::array::from_fn(|k| (0..count(band)).map(|i| ((i * i + k) as f64).sin()).collect());
    let sh = ShRgb { order: band, c };
    let columns = ColumnsRgb::from_sh(&sh);
    let start = Instant::now();
    let plan = ShTransform::with_precision(band, width, height, grid, precision);
    let planning = start.elapsed().as_secs_f64() * 1e3;
    let mut planes: [Vec<S>; 3] = std::array::from_fn(|_| vec![S::from_f64(0.0); width * height]);
    let synthesis = best(|| plan.synthesize_columns(&columns, &[], planes.each_mut().map(Vec::as_mut_slice)));
    let mut back = ColumnsRgb::zero(band);
    let analysis = best(|| plan.analyze_columns(planes.each_ref().map(Vec::as_slice), &mut back));
    println!("{name} {band} {synthesis:.5} {analysis:.5} {planning:.5}");
}

fn time_cube(band: usize) {
    let c = std::array::from_fn(|k| (0..count(band)).map(|i| ((i * i + k) as f64).sin()).collect());
    let columns = ColumnsRgb::from_sh(&ShRgb { order: band, c });
    let [coarse, fine] = [2e-3, 1e-5]
        .map(|error| best(|| PointSynthesis::new(&columns, &[], error).image(Layout::Cube, 256, 256)));
    println!("cube {band} {coarse:.5} {fine:.5} 0");
}

fn main() {
    // On the pool's thread, whose time is taken.
    rayon::scope(|_| run());
}

fn run() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let grid = words.first().map_or("gl", String::as_str);
    let mut bands: Vec<usize> = words.iter().skip(1).filter_map(|w| w.parse().ok()).collect();
    if bands.is_empty() {
        bands = vec![15, 63, 127, 255, 511, 1023];
    }
    for band in bands {
        if grid == "cube" {
            time_cube(band);
        } else if words.iter().any(|w| w == "image") {
            time::<f32>(grid, band, Precision::Image);
        } else {
            time::<f64>(grid, band, Precision::Double);
        }
    }
}
