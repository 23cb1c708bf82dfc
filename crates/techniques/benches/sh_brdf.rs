//! Measures shading with any reflectance by spherical harmonics, for comparison with the rows of Kautz, Sloan
//! & Snyder 2002, table 1 (Tyra, 100,000 vertices, 2.2 GHz Pentium 4 and Radeon 8500): a million vertices a
//! second on one core, and the times of tables. `cargo bench -p steradian-techniques --bench sh_brdf [--
//! WORDS]`: rows whose names hold the words, or all.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

use glam::{Mat3, Vec2, Vec3};
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;
use steradian_base::{ParamValues, Task};
use steradian_scene::shapes;
use steradian_techniques::shared::material::view_table::ViewTable;
use steradian_techniques::shared::trials::lights;
use steradian_techniques::{AnyBake, Geometry, Material, PointsBuf, Radiance, Sites, View, find};

const VERTICES: usize = 102_400;
const SPEC: &str = "ashikhmin-shirley:nu=24,nv=8";
const COLOURED: &str = "ashikhmin-shirley:nu=24,nv=8,rs=0.9/0.6/0.3,rd=0.1/0.2/0.3";

/// Best seconds of the runs of one second, fifteen at least: a shared machine is left alone for some of them.
fn best(mut f: impl FnMut()) -> f64 {
    let (begun, mut runs, mut least) = (Instant::now(), 0, f64::INFINITY);
    while runs < 15 || begun.elapsed().as_secs_f64() < 1.0 {
        let t = Instant::now();
        f();
        least = least.min(t.elapsed().as_secs_f64());
        runs += 1;
    }
    least
}

fn vertices() -> (PointsBuf, Geometry) {
    let mut q = PointsBuf::with_capacity(VERTICES);
    let mut normals = Vec::with_capacity(VERTICES);
    for k in 0..VERTICES {
        let n = steradian_prefilter::probe::direction(k, VERTICES).as_vec3();
        let t = Vec3::Y.cross(n).try_normalize().unwrap_or(Vec3::X);
        let wo = (n + 0.7 * Vec3::new(0.3, -0.5, 0.6)).normalize();
        q.push(n, t, wo, n);
        q.locate(Vec2::ZERO, [k as u32; 3], [0.0; 2]);
        normals.push(n);
    }
    let (p, n) = (Arc::from(normals.as_slice()), Arc::from(normals.as_slice()));
    (q, Geometry::new(Arc::new(shapes::icosphere(1)), Sites::Points { p, n }))
}

fn bake(spec: &str, fix: &str, halves: bool, bands: f64, geometry: &Geometry) -> Box<dyn AnyBake> {
    let half = f64::from(u8::from(halves));
    let mut params: ParamValues = [("bands", bands), ("lights", 0.0), ("halves", half)].into_iter().collect();
    params.0.insert("fix".into(), fix.into());
    let material = Material::new(steradian_brdf::parse(spec).expect("a spec"));
    let technique = find("sh_brdf").expect("a technique");
    technique.bake(&lights::smooth(), &material, Some(geometry), &params, &Task::quiet()).expect("bakes")
}

fn row(what: &str, paper: Option<f64>, seconds: impl FnOnce() -> f64) {
    if !wanted(what) {
        return;
    }
    let seconds = seconds();
    let rate = VERTICES as f64 / seconds * 1e-6;
    let beside = paper.map_or(String::new(), |p| format!("{p:>8.2} {:>8.0} x", rate / p));
    println!("{what:<58} {rate:>9.1} {beside}");
}

/// Does the command line select rows of this name?
fn wanted(what: &str) -> bool {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    words.iter().all(|w| what.contains(w.as_str()))
}

fn main() {
    let (q, geometry) = vertices();
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
    println!("{:<58} {:>9} {:>8}", "one core, 102,400 vertices", "Mvertex/s", "KSS02");
    let mut shade = |spec: &str, fix: &str, halves: bool, bands: f64| {
        let b = bake(spec, fix, halves, bands, &geometry);
        best(|| b.shade(&q.as_points(), black_box(&mut Radiance::of(&mut rgb))))
    };
    for (bands, paper) in [(3.0, None), (4.0, None), (5.0, Some(0.262)), (6.0, None), (10.0, None)] {
        let what = format!("view and light free, one channel, {bands} bands");
        row(&what, paper, || shade(SPEC, "nothing", false, bands));
    }
    row("view and light free, three channels, 5 bands", Some(0.262), || {
        shade(COLOURED, "nothing", false, 5.0)
    });
    row("light fixed, 5 bands", Some(0.99), || shade(SPEC, "light", false, 5.0));
    row("light fixed, 5 bands, 16-bit numbers", Some(0.99), || shade(SPEC, "light", true, 5.0));
    row("view fixed, light turned, 5 bands", Some(7.15), || {
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        let mut b = bake(SPEC, "view", false, 5.0, &geometry);
        let mut angle = 0.0;
        one.install(|| {
            best(|| {
                angle += 0.1;
                b.frame(&View {
                    light_rotation: Mat3::from_rotation_y(angle),
                    eye: 5.0 * Vec3::X,
                    ..View::default()
                });
            })
        })
    });

    println!("\n{:<58} {:>9}", "tables of 25 coefficients, 128 x 128, all cores", "s");
    let specs = [
        SPEC,
        COLOURED,
        "ggx:alpha=0.1,f0=0.9",
        "ward:ax=0.05,ay=0.3,rs=0.5,rd=0.2",
        "sgd:alum-bronze",
        "poulin-fournier:n=20,d=3,h=0.3",
    ];
    for spec in specs.into_iter().filter(|s| wanted(s)) {
        let brdf = steradian_brdf::parse(spec).expect("a spec");
        let t = Instant::now();
        black_box(ViewTable::bake(&*brdf, 5, 128, &Task::quiet()).expect("nobody cancels"));
        println!("{spec:<58} {:>9.2}", t.elapsed().as_secs_f64());
    }
}
