//! Measures the time that coefficients about a centre take on one thread, also as a multiple of a million
//! evaluations of f_cos. `cargo bench -p steradian-brdf --bench central`

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

use glam::DVec3;
use std::hint::black_box;
use std::time::Instant;
use steradian_base::Task;
use steradian_brdf::central::{Centre, Lpq, Slices};
use steradian_brdf::{SharedBrdf, parse};

/// Time of this thread on the processor so far, seconds; by the clock where the system does not tell.
fn on_cpu(start: Instant) -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let told = text.and_then(|t| t.split_whitespace().next()?.parse::<f64>().ok());
    told.map_or_else(|| start.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

/// The least time of three runs, seconds.
fn seconds<R>(f: impl Fn() -> R) -> f64 {
    let now = Instant::now();
    let run = |_| {
        let start = on_cpu(now);
        black_box(f());
        on_cpu(now) - start
    };
    (0..3).map(run).fold(f64::INFINITY, f64::min)
}

/// Time of a million evaluations.
fn baseline(brdf: &SharedBrdf) -> f64 {
    let wo = DVec3::new(0.6, 0.0, 0.8);
    seconds(|| {
        let wi = |i: i32| DVec3::new(-0.6, 1e-7 * f64::from(i), 0.8);
        (0..1_000_000).map(|i| brdf.f_cos(black_box(wi(i)), wo)[0]).sum::<f64>()
    })
}

fn main() {
    let task = Task::quiet();
    let slices = [
        ("ggx:alpha=0.2", 64, 48, 8),
        ("microfacet:sigma=0.2", 64, 48, 8),
        ("ggx:alpha=0.02", 16, 255, 16),
        ("sgd:chrome", 16, 48, 8),
    ];
    let projections = [
        ("microfacet:sigma=0.1", 24, 3),
        ("microfacet:sigma=0.2", 12, 2),
        ("ggx:alpha=0.2", 12, 2),
        ("ggx:alpha=0.2", 30, 5),
        ("sgd:chrome", 30, 5),
    ];
    let print = |what: String, time: f64, accuracy: f64, brdf: &SharedBrdf| {
        let millions = time / baseline(brdf);
        println!("| {what} | {:.1} ms | {millions:.2} | {accuracy:.1e} |", 1e3 * time);
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread starts");
    pool.install(|| {
        println!("| what | CPU time | millions of evaluations | estimated error |\n|---|---|---|---|");
        for (spec, n, f, q) in slices {
            let brdf = parse(spec).expect("the spec is right");
            let run = || Slices::even(&*brdf, Centre::Reflection, n, f, q, &task).expect("isotropic");
            print(format!("{spec}: {n} slices, F {f}, Q {q}"), seconds(run), run().accuracy, &brdf);
        }
        for (spec, f, p) in projections {
            let brdf = parse(spec).expect("the spec is right");
            let run = || Lpq::project(&*brdf, Centre::Reflection, f, p, &task).expect("isotropic");
            print(format!("{spec}: ρ̂ to F {f}, P {p}"), seconds(run), run().accuracy, &brdf);
        }
    });
}
