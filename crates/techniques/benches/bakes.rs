//! Measures default bakes, stage by stage, in seconds and as a multiple of a baseline: the transform of the
//! light alone (spherical harmonics to band 255 of a lat-long image of 512 rows), which every bake needs.
//! `cargo bench -p steradian-techniques --bench bakes`
//!
//! The light is a sky with a small sun, 1024 × 512. Times are by the clock, on all cores, the least of three
//! runs.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

use std::hint::black_box;
use std::sync::{Arc, Mutex};
use std::time::Instant;
use steradian_base::{ParamValues, Progress, Task};
use steradian_light::{Environment, Lights};
use steradian_sphere::{Layout, SphereImage, sh};
use steradian_techniques::shared::trials::lights;
use steradian_techniques::{Material, find};

const ROWS: usize = 512;
const ORDER: usize = 255;
const BAKES: [(&str, &str); 9] = [
    ("split_sum", "ggx:alpha=0.1"),
    ("split_sum", "ggx:alpha=0.5"),
    ("shrm", "ggx:alpha=0.1"),
    ("shrm", "ggx:alpha=0.25"),
    ("shrm", "microfacet:sigma=0.2"),
    ("shrm_slices", "ggx:alpha=0.1"),
    ("shrm_slices", "ggx:alpha=0.25"),
    ("shrm_slices", "ggx:alpha=0.5"),
    ("shrm_slices", "microfacet:sigma=0.2"),
];

/// Stages that have begun, with their seconds once they are over.
#[derive(Default)]
struct Stages(Mutex<Vec<(String, Instant, Option<f64>)>>);

impl Progress for Stages {
    fn begin(&self, label: &str, _: u64) {
        let mut all = self.0.lock().expect("nobody panics in between");
        all.push((label.to_string(), Instant::now(), None));
    }

    fn advance(&self, _: u64) {}

    fn end(&self) {
        let mut all = self.0.lock().expect("nobody panics in between");
        if let Some(stage) = all.iter_mut().rev().find(|s| s.2.is_none()) {
            stage.2 = Some(stage.1.elapsed().as_secs_f64());
        }
    }
}

impl Stages {
    /// Seconds by label, in the order in which they began.
    fn sums(&self) -> Vec<(String, f64)> {
        let mut out: Vec<(String, f64)> = Vec::new();
        for (label, _, seconds) in self.0.lock().expect("nobody panics in between").iter() {
            let seconds = seconds.unwrap_or(0.0);
            match out.iter_mut().find(|o| o.0 == *label) {
                Some(o) => o.1 += seconds,
                None => out.push((label.clone(), seconds)),
            }
        }
        out
    }
}

/// The fastest of three runs: its seconds, and what `run` returned.
fn quickest<R>(run: impl Fn() -> R) -> (f64, R) {
    let one = |_| {
        let start = Instant::now();
        let made = black_box(run());
        (start.elapsed().as_secs_f64(), made)
    };
    (0..3).map(one).min_by(|a, b| a.0.total_cmp(&b.0)).expect("three runs")
}

fn sunny() -> Lights {
    let small = lights::smooth().environment.expect("an image").image.clone();
    let mut image = small.resample(Layout::LatLong, 2 * ROWS, ROWS);
    let sun = 120 * image.width + 700;
    image.planes.iter_mut().for_each(|p| p[sun] = 5e4);
    Environment { image }.into()
}

fn main() {
    let light = sunny();
    let image: SphereImage = light.environment.as_ref().expect("an image").image.clone();
    let (baseline, _) = quickest(|| sh::project(&image, ORDER));
    println!("baseline: the light's harmonics to band {ORDER}: {:.1} ms\n", 1e3 * baseline);
    println!("| technique | reflectance | ms | times the baseline | stages, ms |\n|---|---|---|---|---|");
    for (slug, spec) in BAKES {
        let technique = find(slug).expect("a technique");
        let material = Material::new(steradian_brdf::parse(spec).expect("a spec"));
        let run = || {
            let stages = Arc::new(Stages::default());
            let task = Task::quiet().with_progress(stages.clone());
            technique.bake(&light, &material, None, &ParamValues::default(), &task).expect("bakes");
            stages.sums()
        };
        let (seconds, stages) = quickest(run);
        let stages: Vec<String> = stages.iter().map(|(l, s)| format!("{l} {:.0}", 1e3 * s)).collect();
        let times = seconds / baseline;
        println!("| {slug} | {spec} | {:.0} | {times:.0} | {} |", 1e3 * seconds, stages.join(", "));
    }
}
