//! Times of the transform, in a form that `peers.py` reads; RAYON_NUM_THREADS says on how many threads.
//!
//!     cargo bench -p steradian-sphere --bench transform -- [gl|equirectangular|cube|rotate] [image] [serve] band…
//!
//! Three channels of f64 (`image`: of f32 in image precision), basis about the image's pole and coefficients
//! by m, as other libraries have them. Prints grid, band, and milliseconds of synthesis and analysis (each
//! the least of several), and of planning; for `cube`, of synthesis to a cube map of 256² texels a face with
//! errors of 2e-3 and 1e-5; for `rotate`, of turns of three channels and of one. With `serve`, after the word
//! "ready", both times for every line read, which says how many seconds each may take.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

use std::hint::black_box;
use std::time::Instant;
use steradian_sphere::Layout;
use steradian_sphere::glam::DMat3;
use steradian_sphere::sh::{
    ColumnsRgb, Grid, PointSynthesis, Precision, Rotation, Sample, ShRgb, ShTransform, count,
};

/// Time on the processor so far in ms of the only thread, where the system tells.
fn on_cpu() -> Option<f64> {
    if rayon::current_num_threads() > 1 {
        return None;
    }
    // Linux brings the count up to date when a thread offers its turn to others.
    std::thread::yield_now();
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-6)
}

/// What a sample takes at least, in milliseconds: clocks are not finer.
const SAMPLE: f64 = 2.0;

/// Least of several samples, in milliseconds, without what other programs took; short runs are repeated
/// within one.
fn best<R>(seconds: f64, mut f: impl FnMut() -> R) -> f64 {
    let mut best = f64::INFINITY;
    let (start, mut samples, mut runs) = (Instant::now(), 0, 1);
    while samples < 2 || start.elapsed().as_secs_f64() < seconds {
        let (before, t) = (on_cpu(), Instant::now());
        for _ in 0..runs {
            black_box(f());
        }
        let clock = t.elapsed().as_secs_f64() * 1e3;
        let time = before.and_then(|b| Some(on_cpu()? - b)).unwrap_or(clock);
        if clock < SAMPLE {
            runs *= 2;
        } else {
            best = best.min(time / f64::from(runs));
            samples += 1;
        }
    }
    best
}

/// Times of two things, once or whenever asked.
fn report(name: &str, band: usize, planning: f64, serve: bool, mut times: impl FnMut(f64) -> [f64; 2]) {
    if !serve {
        let [a, b] = times(0.5);
        println!("{name} {band} {a:.5} {b:.5} {planning:.5}");
        return;
    }
    println!("ready");
    for line in std::io::stdin().lines().map_while(Result::ok) {
        let [a, b] = times(line.trim().parse().unwrap_or(0.1));
        println!("{a:.6} {b:.6}");
    }
}

fn time<S: Sample>(name: &str, band: usize, precision: Precision, serve: bool) {
    let (grid, width, height) = match name {
        "gl" => (Grid::GaussLegendre, 2 * band + 2, band + 1),
        _ => (Grid::Equirectangular, 4 * band + 4, 2 * band + 2),
    };
    let c = std::array::from_fn(|k| (0..count(band)).map(|i| ((i * i + k) as f64).sin()).collect());
    let columns = ColumnsRgb::from_sh(&ShRgb { order: band, c });
    let start = Instant::now();
    let plan = ShTransform::with_precision(band, width, height, grid, precision);
    let planning = start.elapsed().as_secs_f64() * 1e3;
    let mut planes: [Vec<S>; 3] = std::array::from_fn(|_| vec![S::from_f64(0.0); width * height]);
    let mut back = ColumnsRgb::zero(band);
    report(name, band, planning, serve, |seconds| {
        let synthesis = best(seconds, || {
            plan.synthesize_columns(&columns, &[], planes.each_mut().map(Vec::as_mut_slice))
        });
        let analysis =
            best(seconds, || plan.analyze_columns(planes.each_ref().map(Vec::as_slice), &mut back));
        [synthesis, analysis]
    });
}

fn time_rotation(band: usize, serve: bool) {
    let c = std::array::from_fn(|k| (0..count(band)).map(|i| ((i * i + k) as f64).sin()).collect());
    let sh = ShRgb { order: band, c };
    let r = DMat3::from_rotation_z(0.3) * DMat3::from_rotation_y(0.7) * DMat3::from_rotation_z(0.2);
    let mut one = vec![0.0; count(band)];
    report("rotate", band, 0.0, serve, |seconds| {
        let three = best(seconds, || Rotation::new(band, r).apply_rgb(&sh));
        [three, best(seconds, || Rotation::new(band, r).apply(&sh.c[0], &mut one))]
    });
}

fn time_cube(band: usize, serve: bool) {
    let c = std::array::from_fn(|k| (0..count(band)).map(|i| ((i * i + k) as f64).sin()).collect());
    let columns = ColumnsRgb::from_sh(&ShRgb { order: band, c });
    report("cube", band, 0.0, serve, |seconds| {
        [2e-3, 1e-5].map(|error| {
            best(seconds, || PointSynthesis::new(&columns, &[], error).image(Layout::Cube, 256, 256))
        })
    });
}

fn main() {
    // On the pool's thread, whose time is taken.
    rayon::scope(|_| run());
}

fn run() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let grid = words.first().map_or("gl", String::as_str);
    let has = |word: &str| words.iter().any(|w| w == word);
    let mut bands: Vec<usize> = words.iter().skip(1).filter_map(|w| w.parse().ok()).collect();
    if bands.is_empty() {
        bands = vec![15, 63, 127, 255, 511, 1023];
    }
    for band in bands {
        if grid == "cube" {
            time_cube(band, has("serve"));
        } else if grid == "rotate" {
            time_rotation(band, has("serve"));
        } else if has("image") {
            time::<f32>(grid, band, Precision::Image, has("serve"));
        } else {
            time::<f64>(grid, band, Precision::Double, has("serve"));
        }
    }
}
