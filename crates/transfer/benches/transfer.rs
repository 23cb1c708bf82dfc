//! Diffuse transfer of the Stanford bunny: 1024 rays a vertex, and to tolerances.
#![expect(clippy::print_stdout, reason = "a benchmark reports")]

use std::time::Instant;
use steradian_base::Task;
use steradian_scene::{Mesh, load};
use steradian_testkit::data;
use steradian_transfer::{Scene, Settings, Site, transfer};

/// Seconds of processors that this process has used (Linux; 0 elsewhere): other work on the machine does not
/// count.
fn cpu() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |k: usize| fields.get(k).and_then(|f| f.parse::<f64>().ok()).unwrap_or(0.0);
    (ticks(11) + ticks(12)) / 100.0
}

fn measure(name: &str, mesh: &Mesh, settings: &Settings) {
    let start = Instant::now();
    let Ok(scene) = Scene::new(mesh) else { return };
    let build = start.elapsed().as_secs_f64();
    let sites = Site::vertices(mesh);
    let (start, busy) = (Instant::now(), cpu());
    let Ok(t) = transfer(&scene, &sites, settings, None, &Task::quiet()) else { return };
    let (s, busy) = (start.elapsed().as_secs_f64(), cpu() - busy);
    let open = t.ao.iter().sum::<f32>() / sites.iter().filter(|s| !s.is_absent()).count() as f32;
    println!(
        "{name:32} {s:6.2} s, {busy:6.2} s of processors (tree {build:.2} s), {:6.0} rays a site, {:5.2} Mray/s a core, mean ao {open:.5}, worst error {:.1e}",
        t.rays as f64 / sites.len() as f64,
        t.rays as f64 / busy / 1e6,
        t.worst_error()[0],
    );
}

fn main() {
    let Some(path) = data("meshes/bunny_bun_zipper.ply") else { return };
    let Ok(loaded) = load(&path, &Default::default()) else { return };
    let mesh = loaded.merged();
    println!("{} vertices, {} threads", mesh.positions.len(), rayon::current_num_threads());
    let of = |rays| Settings { rays: Some(rays), ..Settings::default() };
    measure("1024 rays", &mesh, &of(1024));
    for tolerance in if steradian_testkit::full() { &[1e-2, 1e-3][..] } else { &[1e-2] } {
        let tolerance = *tolerance;
        measure(&format!("tolerance {tolerance}"), &mesh, &Settings { tolerance, ..Settings::default() });
    }
    measure("1024 rays, 3 events", &mesh, &Settings { bounces: 3, ..of(1024) });
}
