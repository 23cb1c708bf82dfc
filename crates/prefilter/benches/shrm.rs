//! Measures spherical harmonic reflection maps, for comparison with Ramamoorthi & Hanrahan 2002, table 5.5:
//! creation from 128 rows of light, and 100 explicit maps. `cargo bench -p steradian-prefilter --bench shrm
//! -- [LIGHT]`
//!
//! Plans are reused, and the coefficients of the reflectance are given. The output is the processor time on
//! one thread and the least time by the clock on two.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

mod shared;

use shared::{lights, on_one_thread, seconds};
use std::hint::black_box;
use std::time::Instant;
use steradian_base::Task;
use steradian_prefilter::shrm::resolution::Frequencies;
use steradian_prefilter::shrm::{CoefficientMaps, Grid, Plan, Term, explicit, global, pairs};
use steradian_prefilter::{Lobe, Zonal};
use steradian_sphere::SphereImage;
use steradian_sphere::sh::{self, ColumnsRgb, Precision, ShTransform};

fn main() {
    let words = shared::words();
    let lights = lights(words.first().map_or("studio", String::as_str), 128);
    let image = &lights.environment.as_ref().expect("the light is an image").image;
    println!("ms: one thread (processor), two threads (clock, least of many)");
    println!(
        "| F, P | maps | analysis | maps of it | both | 100 explicit maps | global | both by the paper |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (f, p, paper) in [(24, 3, "1550"), (12, 2, "720"), (7, 2, "670"), (5, 2, "640"), (60, 3, "")] {
        for (rows, columns) in [(128, 128), (128, 256)] {
            let bench = Bench::new(f, p, Grid::new(rows, columns));
            let planes = image.planes.each_ref().map(Vec::as_slice);
            let analysis = times(|| bench.analyze(planes));
            let light = bench.analyze(planes);
            let maps = times(|| bench.maps(&light));
            let both = times(|| bench.maps(&bench.analyze(planes)));
            let made = bench.maps(&light);
            let set = explicit::set(10);
            let hundred = times(|| explicit::local(&made, p, &set));
            let turned = times(|| global::from_local(&made, p));
            println!(
                "| {f}, {p} | {} of {columns} × {rows} | {analysis} | {maps} | {both} | {hundred} | {turned} | {paper} |",
                made.planes.len()
            );
        }
    }
    rotations();
    resolutions(image);
}

struct Bench {
    transform: ShTransform,
    plan: Plan,
    terms: Vec<(usize, Vec<f64>)>,
}

impl Bench {
    fn new(f: usize, p: usize, grid: Grid) -> Self {
        let kernel = |(p, q)| (q, (0..=f).map(|l| ((l + p) as f64).cos()).collect());
        Self {
            transform: ShTransform::with_precision(f, 256, 128, sh::Grid::Equirectangular, Precision::Double),
            plan: Plan::new(f, p, grid),
            terms: pairs(p).into_iter().map(kernel).collect(),
        }
    }

    fn analyze(&self, planes: [&[f32]; 3]) -> ColumnsRgb {
        let mut columns = ColumnsRgb::default();
        self.transform.analyze_columns(planes, &mut columns);
        columns
    }

    fn maps(&self, light: &ColumnsRgb) -> CoefficientMaps {
        let terms: Vec<Term<'_>> = self.terms.iter().map(|(q, k)| Term { q: *q, k: [k; 3] }).collect();
        self.plan.maps(light, &terms, &Task::quiet()).expect("nobody cancels")
    }
}

/// One thread's processor time, and the clock's with two, ms.
fn times<R: Send>(f: impl Fn() -> R + Sync) -> String {
    let one = on_one_thread(|| seconds(&f));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("two threads start");
    let two = pool.install(|| {
        let mut best = f64::INFINITY;
        let begin = Instant::now();
        while begin.elapsed().as_secs_f64() < 0.3 {
            let now = Instant::now();
            black_box(f());
            best = best.min(now.elapsed().as_secs_f64());
        }
        best
    });
    format!("{:.2}, {:.2}", one * 1e3, two * 1e3)
}

/// The paper's S ≈ 10 F (5.5.2): the error that bilinear interpolation adds to maps of Phong lobes,
/// predicted.
fn resolutions(image: &SphereImage) {
    println!(
        "\nbilinear error of a map of Phong's lobe to its order F = 1 + sqrt(6 s), relative RMS, predicted"
    );
    for s in [8.0, 32.0, 128.0] {
        let order = 1 + f64::sqrt(6.0 * s).ceil() as usize;
        let mut light = ColumnsRgb::default();
        ShTransform::new(order, image.width, image.height, sh::Grid::Equirectangular)
            .analyze_columns(image.planes.each_ref().map(Vec::as_slice), &mut light);
        let norm = |(l, k): (usize, f64)| k * ((2 * l + 1) as f64 / (4.0 * std::f64::consts::PI)).sqrt();
        let k: Vec<f64> = Lobe::phong(s).coefficients(order).into_iter().enumerate().map(norm).collect();
        let frequencies = Frequencies::new(&light.band_energies(), &[Term { q: 0, k: [&k; 3] }]);
        let own = 100.0 * frequencies.error(Grid::new(10 * order, 10 * order));
        let wide = 100.0 * frequencies.error(Grid::new(10 * order, 20 * order));
        let grid = frequencies.grid(0.012);
        println!(
            "s = {s}, F = {order}: 10 F × 10 F {own:.2} %, 20 F × 10 F {wide:.2} %; 1.2 % takes {} × {}",
            grid.columns(),
            grid.rows()
        );
    }
    println!("all its energy in band F, white in m:");
    for order in [6, 12, 24] {
        let bands: Vec<[f64; 3]> = (0..=order).map(|l| [f64::from(u8::from(l == order)); 3]).collect();
        let k = vec![1.0; order + 1];
        let frequencies = Frequencies::new(&bands, &[Term { q: 0, k: [&k; 3] }]);
        let own = 100.0 * frequencies.error(Grid::new(10 * order, 10 * order));
        let wide = 100.0 * frequencies.error(Grid::new(10 * order, 20 * order));
        println!("F = {order}: 10 F × 10 F {own:.2} %, 20 F × 10 F {wide:.2} %");
    }
}

/// High orders, whose rotations are not kept.
fn rotations() {
    println!("\nlarge maps, one term with q = 1 (two maps), one thread");
    for (order, rows) in [(127, 512), (511, 512), (1023, 512)] {
        let grid = Grid::new(rows, 2 * rows);
        let plan = Plan::new(order, 1, grid);
        let light = ColumnsRgb::zero(order);
        let k = vec![1.0; order + 1];
        let t = on_one_thread(|| seconds(|| plan.maps(&light, &[Term { q: 1, k: [&k; 3] }], &Task::quiet())));
        println!("order {order}, {} × {rows}: {:.1} ms", 2 * rows, t * 1e3);
    }
}
