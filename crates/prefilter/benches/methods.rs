//! The named ways side by side: time, work, error against the sum over all texels, steps across edges; and as
//! a picture. `cargo bench -p steradian-prefilter --bench methods -- [LIGHT [EXPONENT [SHEET.png]]]`
//!
//! 256 rows of light, a cube of 64² texels a face, tolerance 1e-3, one thread; the default is the studio
//! under Phong's N = 225. The sheet holds crosses of 128² texels a face, and below each its difference from
//! the sum over all texels.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

mod shared;

use shared::{lights, on_one_thread, sampled, seconds};
use std::path::Path;
use steradian_base::Task;
use steradian_formats::{Raster, WriteOptions, write_image};
use steradian_prefilter::methods::{Method, Shape};
use steradian_prefilter::{Lobe, Sampled, Zonal, deviation};
use steradian_sphere::layout::Position;
use steradian_sphere::{Layout, SphereImage};

const TOLERANCE: f64 = 1e-3;

fn main() {
    let words = shared::words();
    let spec = words.first().map_or("studio", String::as_str);
    let s = words.get(1).and_then(|w| w.parse().ok()).unwrap_or(225.0);
    let kernel = Lobe::phong(s);
    let light = sampled(&lights(spec, 256), &[&kernel as &dyn Zonal], TOLERANCE);
    on_one_thread(|| table(&light, &kernel, spec, s));
    if let Some(path) = words.get(2) {
        sheet(&light, &kernel, Path::new(path));
    }
}

fn table(light: &Sampled, kernel: &Lobe, spec: &str, s: f64) {
    const SHAPE: Shape = (Layout::Cube, 64, 64);
    println!("{spec}, Phong {s}, cube of 64² a face, one thread");
    println!("| way | ms | kernels | taps | rms error | worst texel | edge step |");
    println!("|---|---|---|---|---|---|---|");
    let exact = Method::Frequency.filter(light, kernel, SHAPE, 1e-5, &Task::quiet()).expect("nobody cancels");
    for method in Method::ALL {
        let run = || method.filter(light, kernel, SHAPE, TOLERANCE, &Task::quiet()).expect("nobody cancels");
        // The sum over all texels is its own error, and long: once, on a part.
        let part: Shape = (Layout::Cube, 8, 8);
        let (t, made) = if method == Method::Brute {
            let small = || method.filter(light, kernel, part, TOLERANCE, &Task::quiet());
            (seconds(small) * 64.0, exact.clone())
        } else {
            (seconds(run), run())
        };
        let e = deviation(light, kernel, &made.image, 400);
        let texels = (light.image.planes[0].len() * 6 * 64 * 64) as u64;
        let (kernels, taps) =
            if method == Method::Brute { (texels, texels) } else { (made.cost.kernel, made.cost.taps) };
        let (rms, worst) = if method == Method::Brute { (0.0, 0.0) } else { (e.rms, e.worst) };
        println!(
            "| {} | {:.1} | {kernels} | {taps} | {rms:.1e} | {worst:.1e} | {:.1e} |",
            method.name(),
            t * 1e3,
            edge_step(&made.image, &exact.image)
        );
    }
}

/// The steps between neighbours across the edges of the cube that the exact map does not have: their RMS over
/// that of the map.
fn edge_step(cube: &SphereImage, truth: &SphereImage) -> f64 {
    let n = cube.width;
    let (mut steps, mut count) = (0.0, 0.0);
    for (face, k, end) in (0..6).flat_map(|f| (1..n - 1).flat_map(move |k| (0..4).map(move |e| (f, k, e)))) {
        let at = |depth: f64| {
            let u = if end % 2 == 0 { depth / n as f64 } else { 1.0 - depth / n as f64 };
            let v = (k as f64 + 0.5) / n as f64;
            let (x, y) = if end < 2 { (u, v) } else { (v, u) };
            Layout::Cube.direction(1, 1, Position { face, x, y }).expect("cubes are full")
        };
        let (here, there) = (at(0.5), beyond(at(0.5), at(0.0)));
        for c in 0..3 {
            let step = |i: &SphereImage| f64::from(i.nearest(here)[c]) - f64::from(i.nearest(there)[c]);
            steps += (step(cube) - step(truth)).powi(2);
            count += 1.0;
        }
    }
    let values = || truth.planes.iter().flatten().map(|&v| f64::from(v).powi(2));
    (steps / count / (values().sum::<f64>() / values().count() as f64)).sqrt()
}

/// The mirror image of `d` about the direction `edge`.
fn beyond(d: glam::DVec3, edge: glam::DVec3) -> glam::DVec3 {
    (2.0 * d.dot(edge) * edge - d).normalize()
}

/// Crosses of all ways, four in a row, differences below them.
fn sheet(light: &Sampled, kernel: &Lobe, path: &Path) {
    const N: usize = 96;
    let (w, h) = (4 * N + 12, 6 * N + 24);
    let (columns, rows) = (4, 2);
    let mut raster = vec![vec![1.0_f32; columns * w * rows * h]; 3];
    let all = |m: Method| {
        let exact = if m == Method::Brute { Method::Frequency } else { m };
        let tolerance = if m == Method::Brute { 1e-5 } else { TOLERANCE };
        exact
            .filter(light, kernel, (Layout::Cube, N, N), tolerance, &Task::quiet())
            .expect("nobody cancels")
            .image
    };
    let truth = all(Method::Brute);
    let mut sorted: Vec<f32> = truth.planes[1].clone();
    sorted.sort_by(f32::total_cmp);
    let white = sorted[sorted.len() * 97 / 100].max(1e-9);
    for (k, method) in Method::ALL.into_iter().enumerate() {
        let image = all(method);
        for (row, of_error) in [(0, false), (1, true)] {
            let (x0, y0) = ((k % columns) * w, (k / columns) * h + row * (3 * N + 12));
            for (c, plane) in raster.iter_mut().enumerate() {
                for (face, (fx, fy)) in
                    [(2, 1), (0, 1), (1, 0), (1, 2), (1, 1), (3, 1)].into_iter().enumerate()
                {
                    for t in 0..N * N {
                        let at = face * N * N + t;
                        let (a, b) = (image.planes[c][at], truth.planes[c][at]);
                        let v = if of_error { 0.5 + 2.5 * (a - b) / white } else { a / white };
                        let (x, y) = (x0 + fx * N + t % N, y0 + fy * N + t / N);
                        plane[y * columns * w + x] = v.clamp(0.0, 1.0);
                    }
                }
            }
        }
    }
    let planes: [Vec<f32>; 3] = raster.try_into().expect("three planes");
    let raster = Raster::rgb(columns * w, rows * h, planes);
    write_image(path, &raster, &WriteOptions::default()).expect("the sheet can be written");
    println!("wrote {}", path.display());
}
