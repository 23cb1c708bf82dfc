//! Measures shading with `gaussian_lobes` (Green, Kautz & Durand 2007): millions of points a second on one
//! core, without visibility and with 1 to 4 bands of it. Three lobes at 15 elevations; 102,400 points of a
//! torus of 102,152 triangles, each seen from an elevation of its own; where visibility counts, every point
//! takes its three corners' numbers.
//!
//!     cargo bench -p steradian-techniques --bench gaussian_lobes [-- WORDS]
//!
//! The baseline is `lambert`: one lookup in one filtered map, the least that any point costs. Seconds are
//! those of the processor: other work on the machine does not count.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

use glam::{Vec2, Vec3};
use std::hint::black_box;
use std::sync::Arc;
use steradian_base::{ParamValues, Task};
use steradian_scene::{Mesh, shapes};
use steradian_techniques::shared::trials::lights;
use steradian_techniques::{Geometry, Material, PointsBuf, Radiance, Sites, View, find};

const POINTS: usize = 102_400;
const RUNS: u32 = 20;
const SPECS: [&str; 4] =
    ["lambert", "sgd:gold-metallic-paint", "sgd:red-phenolic", "ggx:alpha=0.25,f0=0.9/0.6/0.3"];
const CASES: [(&str, &str); 7] = [
    ("gaussian_lobes", ""),
    ("gaussian_lobes", "visibility=ambient"),
    ("gaussian_lobes", "visibility=published,visibility_bands=2"),
    ("gaussian_lobes", "visibility=published,visibility_bands=3"),
    ("gaussian_lobes", "visibility=published,visibility_bands=4"),
    ("gaussian_lobes", "visibility=convolved,visibility_bands=4"),
    ("gaussian_lobes", "shape=stretched"),
];

/// Seconds of processors that this process has used (Linux; 0 elsewhere).
fn cpu() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    stat.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(0.0) * 1e-9
}

/// Does the command line select rows of this name?
fn wanted(what: &str) -> bool {
    std::env::args().skip(1).filter(|a| !a.starts_with("--")).all(|w| what.contains(w.as_str()))
}

/// Centres of triangles, seen from 5° to 80° off their normals.
fn points(mesh: &Mesh) -> PointsBuf {
    let mut q = PointsBuf::with_capacity(POINTS);
    for k in 0..POINTS {
        let corners = mesh.triangles[k % mesh.triangles.len()];
        let sum = |all: &[Vec3]| corners.iter().map(|c| all[*c as usize]).sum::<Vec3>();
        let (n, p) = (sum(&mesh.normals).normalize(), sum(&mesh.positions) / 3.0);
        let t = n.any_orthonormal_vector();
        let turn = 2.4 * k as f32;
        let theta = 0.09 + 1.3 * (0.618 * k as f32).fract();
        let side = t * turn.cos() + n.cross(t) * turn.sin();
        q.push(n, t, n * theta.cos() + side * theta.sin(), p);
        q.locate(Vec2::ZERO, corners, [1.0 / 3.0; 2]);
    }
    q
}

fn main() {
    let mesh = Arc::new(shapes::torus(0.7, 0.3, 226));
    let q = points(&mesh);
    let geometry = Geometry::new(mesh, Sites::Vertices);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().expect("a pool");
    println!("{POINTS} points, smooth sky, {}\n", steradian_simd::isa().name());
    println!("| reflectance | technique | parameters | Mpoint/s |\n|---|---|---|---|");
    for spec in SPECS {
        let material = Material::new(steradian_brdf::parse(spec).expect("a spec"));
        for (slug, body) in CASES.into_iter().filter(|c| wanted(&format!("{spec} {}", c.1))) {
            let technique = find(slug).expect("a technique");
            let precise = if body.contains("visibility") { ",precision=0.02" } else { "" };
            let params =
                ParamValues::parse(&format!("{body}{precise}"), technique.params()).expect("parameters");
            let task = Task::quiet();
            let mut bake =
                technique.bake(&lights::smooth(), &material, Some(&geometry), &params, &task).expect("bakes");
            let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
            let seconds = one.install(|| {
                bake.frame(&View::default());
                // The clock has steps of 4 ms.
                let mut run = || {
                    let start = cpu();
                    for _ in 0..RUNS {
                        bake.shade(&q.as_points(), black_box(&mut Radiance::of(&mut rgb)));
                    }
                    (cpu() - start) / f64::from(RUNS)
                };
                (0..7).map(|_| run()).fold(f64::INFINITY, f64::min)
            });
            println!("| {spec} | {slug} | {body} | {:.1} |", POINTS as f64 / seconds / 1e6);
        }
    }
}
