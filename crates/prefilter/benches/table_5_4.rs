//! Table 5.4 of Ramamoorthi & Hanrahan 2002: Phong maps in angular and in frequency space, and where they
//! cross. `cargo bench -p steradian-prefilter --bench table_5_4 -- [LIGHT]`
//!
//! 128 rows of light (256 × 128), a map of 128 × 128 texels, one thread. The paper's settings first: the
//! angular way cut at ε = 0.05, orders F = 1 + √(6 s); then all ways to the same relative RMS error of 1e-3,
//! measured against the sum over all texels. The light is analysed anew for every map.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

mod shared;

use shared::{lights, on_one_thread, sampled, seconds};
use steradian_base::Task;
use steradian_light::Lights;
use steradian_prefilter::methods::{self, Method, Model, Problem, Shape};
use steradian_prefilter::{Lobe, Zonal, deviation};
use steradian_sphere::Layout;
use steradian_sphere::sh;

/// Exponent, angular and frequency seconds on a 1.4 GHz Pentium 4, and their ratio as printed.
const PAPER: [(f64, f64, f64, f64); 7] = [
    (8.0, 67.28, 0.081, 830.6),
    (16.0, 38.03, 0.114, 333.6),
    (32.0, 21.80, 0.159, 137.1),
    (64.0, 11.94, 0.227, 52.6),
    (128.0, 7.17, 0.328, 21.9),
    (256.0, 3.55, 0.461, 7.7),
    (512.0, 2.28, 0.686, 3.3),
];
const ROWS: usize = 128;
const MAP: Shape = (Layout::LatLong, 128, 128);
const TOLERANCE: f64 = 1e-3;

fn main() {
    let words = shared::words();
    let spec = words.first().map_or("studio", String::as_str);
    let lights = lights(spec, ROWS);
    on_one_thread(|| {
        papers(&lights);
        let (from, to) = equal_error(&lights);
        println!("\nRH02 5.33 puts the crossover at s* = S_L^(4/3) = {:.0}.", (ROWS as f64).powf(4.0 / 3.0));
        println!("Measured, frequency against direct sum: {from}; against rows: {to}.");
    });
}

/// The paper's own settings.
fn papers(lights: &Lights) {
    println!(
        "RH02 table 5.4 at its own settings: cut at 0.05 of the lobe, F = 1 + sqrt(6 s); ms on one thread"
    );
    println!("| s | paper's ratio | direct sum | by rows | frequency | direct/freq | rows/freq |");
    println!("|---|---|---|---|---|---|---|");
    for (s, _, _, ratio) in PAPER {
        let kernel = Lobe::phong(s);
        let light = sampled(lights, &[], TOLERANCE);
        let task = Task::quiet();
        let direct = seconds(|| methods::truncated_angular(&light, &kernel, MAP, 0.05, &task));
        let rows = seconds(|| methods::lat_long_angular(&light, &kernel, MAP, 0.05, &task));
        let order = 1 + (6.0 * s).sqrt().ceil() as usize;
        let frequency = seconds(|| {
            let mut product = sh::project(&light.image, order);
            product.convolve(&kernel.coefficients(order));
            sh::synthesize(&product, MAP.0, MAP.1, MAP.2)
        });
        println!(
            "| {s} | {ratio} | {:.2} | {:.2} | {:.2} | {:.1} | {:.1} |",
            direct * 1e3,
            rows * 1e3,
            frequency * 1e3,
            direct / frequency,
            rows / frequency
        );
    }
}

/// All methods at the same error; and the exponent at which each angular method first wins.
fn equal_error(lights: &Lights) -> (String, String) {
    println!(
        "\nTo relative RMS error {TOLERANCE}: ms (error measured); the model's choice beside the fastest"
    );
    println!("| s | direct sum | by rows | frequency | engine's way | fastest | model's choice |");
    println!("|---|---|---|---|---|---|---|");
    let (mut direct_wins, mut rows_win) = (None, None);
    for s in (3..=17).map(|k| f64::from(1u32 << k)) {
        let kernel = Lobe::phong(s);
        let ways = [Method::TruncatedAngular, Method::LatLongAngular, Method::Frequency];
        let times = ways.map(|way| time(way, lights, &kernel));
        let fastest = (0..3).min_by(|&a, &b| times[a].0.total_cmp(&times[b].0)).expect("three ways");
        if times[0].0 < times[2].0 {
            direct_wins.get_or_insert(s);
        }
        if times[1].0 < times[2].0 {
            rows_win.get_or_insert(s);
        }
        let problem = Problem::new(ROWS, MAP, &kernel, TOLERANCE);
        let light = sampled(lights, &[&kernel], TOLERANCE);
        let engine = steradian_prefilter::filter_image(&light, &kernel, MAP, TOLERANCE, &Task::quiet());
        let cell = |(t, e): (f64, f64)| format!("{:.2} ({e:.0e})", t * 1e3);
        println!(
            "| {s} | {} | {} | {} | {} to {} | {} | {} |",
            cell(times[0]),
            cell(times[1]),
            cell(times[2]),
            engine.as_ref().map_or("", |e| e.way.name()),
            engine.as_ref().map_or(0, |e| e.way.order()),
            ways[fastest].name(),
            Model::default().choose(&problem).name(),
        );
    }
    let said = |s: Option<f64>| s.map_or("none up to 131072".into(), |s| format!("from s = {s}"));
    (said(direct_wins), said(rows_win))
}

/// Seconds with the preparation of the light, and the error.
fn time(way: Method, lights: &Lights, kernel: &Lobe) -> (f64, f64) {
    // Angular ways need no spectrum of the light.
    let needs: &[&dyn Zonal] = if way == Method::Frequency { &[kernel] } else { &[] };
    let run = || {
        let light = sampled(lights, needs, TOLERANCE);
        let made = way.filter(&light, kernel, MAP, TOLERANCE, &Task::quiet()).expect("nobody cancels");
        (light, made)
    };
    let (light, made) = run();
    (seconds(run), deviation(&light, kernel, &made.image, 200).rms)
}
