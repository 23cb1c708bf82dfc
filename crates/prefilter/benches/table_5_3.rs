//! Table 5.3 of Ramamoorthi & Hanrahan 2002, its row for radially symmetric reflectance: how costs grow.
//! `cargo bench -p steradian-prefilter --bench table_5_3`
//!
//! Angular W S_L² S_B², frequency F S_B² (with S_L ~ S_B), rows against rows F S_L S_B. Printed is the
//! measured exponent p of time ~ x^p between two settings, of S_L, S_B and Phong's s in turn (W ~ 1/s and F ~
//! √s).

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

mod shared;

use shared::{lights, on_one_thread, sampled, seconds};
use steradian_base::Task;
use steradian_prefilter::methods;
use steradian_prefilter::{Lobe, Zonal};
use steradian_sphere::{Layout, sh};

const EPSILON: f64 = 0.01;

/// One setting: rows of light and map, exponent.
#[derive(Clone, Copy)]
struct Setting {
    light: usize,
    map: usize,
    s: f64,
}

/// A name, a way, and the exponents of S_L, S_B and s that table 5.3 gives it.
type Row = (&'static str, fn(Setting) -> f64, [&'static str; 3]);

fn main() {
    let ways: [Row; 3] = [
        ("direct sum, W S_L² S_B²", direct, ["2", "2", "-1"]),
        ("by rows, F S_L S_B", rows, ["1", "1", "0 (W rows times F)"]),
        ("frequency, F S_L² + F S_B²", frequency, ["≤ 2", "≤ 2", "0.5"]),
    ];
    on_one_thread(|| {
        println!("RH02 table 5.3, 1D BRDF: exponent of the time, expected and measured");
        println!("| way | S_L: 128 → 256 | S_B: 128 → 256 | s: 64 → 512 |");
        println!("|---|---|---|---|");
        let start = Setting { light: 128, map: 128, s: 64.0 };
        let ends = [
            (Setting { light: 256, ..start }, 2.0),
            (Setting { map: 256, ..start }, 2.0),
            (Setting { s: 512.0, ..start }, 8.0),
        ];
        for (name, way, expected) in ways {
            let base = way(start);
            let cells: Vec<String> = ends
                .iter()
                .zip(expected)
                .map(|(&(end, ratio), e)| format!("{e}: {:.2}", (way(end) / base).ln() / f64::ln(ratio)))
                .collect();
            println!("| {name} | {} |", cells.join(" | "));
        }
    });
}

fn direct(x: Setting) -> f64 {
    let light = sampled(&lights("studio", x.light), &[], EPSILON);
    let shape = (Layout::LatLong, x.map, x.map);
    seconds(|| methods::truncated_angular(&light, &Lobe::phong(x.s), shape, EPSILON, &Task::quiet()))
}

fn rows(x: Setting) -> f64 {
    let light = sampled(&lights("studio", x.light), &[], EPSILON);
    let shape = (Layout::LatLong, x.map, x.map);
    seconds(|| methods::lat_long_angular(&light, &Lobe::phong(x.s), shape, EPSILON, &Task::quiet()))
}

/// The bare transform pair at F = 1 + √(6 s).
fn frequency(x: Setting) -> f64 {
    let environment = lights("studio", x.light).environment.expect("a studio is an image");
    let image = &environment.image;
    let order = 1 + (6.0 * x.s).sqrt().ceil() as usize;
    seconds(|| {
        let mut product = sh::project(image, order);
        product.convolve(&Lobe::phong(x.s).coefficients(order));
        sh::synthesize(&product, Layout::LatLong, x.map, x.map)
    })
}
