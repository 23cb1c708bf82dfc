//! Common code of the benches: lights, and times on one thread.

#![allow(dead_code, reason = "each bench uses a part")]

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;
use steradian_base::Task;
use steradian_light::{Environment, Lights, load, sky};
use steradian_prefilter::{Sampled, Zonal};

/// Time of this thread on the processor so far in ns, where the system tells; it lags by up to a few
/// milliseconds.
fn on_cpu() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split_whitespace().next()?.parse().ok()
}

/// Time of one run on this thread's processor, seconds: the least mean of three batches of 30 ms or more.
/// Where the system does not tell, time by the clock.
pub fn seconds<R>(mut f: impl FnMut() -> R) -> f64 {
    let now = Instant::now();
    let clock = || on_cpu().unwrap_or_else(|| now.elapsed().as_secs_f64() * 1e9);
    let mut best = f64::INFINITY;
    for _ in 0..3 {
        let (start, mut runs) = (clock(), 0);
        while clock() - start < 3e7 {
            black_box(f());
            runs += 1;
        }
        best = best.min((clock() - start) * 1e-9 / f64::from(runs));
        if best > 1.0 {
            break;
        }
    }
    best
}

/// Runs `f` on a pool of one thread.
pub fn on_one_thread<R: Send>(f: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread starts").install(f)
}

/// The light of a formula (`studio`, `sky`, …) or a file, as a lat-long image of `rows` rows and suns in
/// addition.
pub fn lights(spec: &str, rows: usize) -> Lights {
    if sky::is_name(spec) {
        let made = sky::by_name(spec, 2 * rows, rows).expect("the spec is right");
        let mut lights = Lights::from(Environment { image: made.image });
        lights.disks.extend(made.sun);
        return lights;
    }
    let loaded = load::load(Path::new(spec), &load::LoadOptions::default()).expect("the light is readable");
    let image = loaded.into_environment().image;
    let image = if image.height == rows { image } else { image.resample(image.layout, 2 * rows, rows) };
    Lights::from(Environment { image })
}

/// The light prepared for `kernels`.
pub fn sampled(lights: &Lights, kernels: &[&dyn Zonal], tolerance: f64) -> Sampled {
    Sampled::new(lights, kernels, tolerance, &Task::quiet()).expect("nobody cancels")
}

/// Arguments that are not options of cargo's.
pub fn words() -> Vec<String> {
    std::env::args().skip(1).filter(|a| !a.starts_with("--bench")).collect()
}
