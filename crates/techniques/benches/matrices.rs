//! Techniques with transfer matrices on a mesh of about 100 000 vertices, one core: vertices a second, bytes,
//! and what compression loses of what is shaded.
//!
//!     cargo bench -p steradian-techniques --bench matrices [-- WORDS]
//!
//! prints the rows whose names hold the words, or all.
//!
//! *Frame* is the light of a frame through all that is stored, *shading* every vertex from a view of its own;
//! their sum is what a turning light and a moving viewer cost. The baseline is the matrices of `prt_glossy`
//! in single precision. Seconds are those of the processor: other work on the machine does not count.
#![expect(clippy::print_stdout, reason = "a benchmark reports")]

use glam::{Mat3, Vec2, Vec3};
use std::sync::{Arc, OnceLock};
use std::time::Instant;
use steradian_base::{ParamValues, Task};
use steradian_scene::{Mesh, load, shapes};
use steradian_techniques::shared::trials::lights;
use steradian_techniques::{AnyBake, Geometry, Material, PointsBuf, Radiance, Sites, View, find};
use steradian_testkit::data;

/// Technique, parameters, reflectance, the printed label, and what its paper says, a million vertices a
/// second. The first case of a reflectance is the baseline of those that follow.
type Case = (&'static str, &'static [(&'static str, f64)], &'static str, &'static str, &'static str);

const PHONG: &str = "phong:n=10";
const MATTE: &str = "lambert:albedo=0.5";
const COLOURED: &str = "lambert:albedo=0.8/0.5/0.3";
const METAL: &str = "ggx:alpha=0.4,f0=0.9";
const BRUSHED: &str = "ashikhmin-shirley:nu=24,nv=8";

/// Kautz, Sloan & Snyder 2002, table 1: Tyra, 100,000 vertices, view and light free, with transfer, 2.08
/// frames a second on a Pentium 4 of 2.2 GHz.
const TYRA: &str = "0.208";

const CASES: [Case; 11] = [
    ("prt_diffuse", &[], MATTE, "direct light, f32", ""),
    ("prt_diffuse", &[("halves", 1.0)], MATTE, "direct light, f16", ""),
    ("prt_diffuse", &[("bounces", 2.0)], COLOURED, "direct light, and reflected in three channels, f32", ""),
    (
        "prt_diffuse",
        &[("bounces", 2.0), ("halves", 1.0)],
        COLOURED,
        "direct light, and reflected in three channels, f16",
        "",
    ),
    ("prt_glossy", &[("halves", 0.0)], PHONG, "matrices, f32 (baseline)", ""),
    ("prt_glossy", &[], PHONG, "matrices, f16", ""),
    ("clustered_pca", &[], PHONG, "256 clusters, 8 components", ""),
    ("clustered_pca", &[("components", 4.0)], PHONG, "256 clusters, 4 components", ""),
    ("matrix_radiance_transfer", &[], METAL, "64 clusters, 8 components", ""),
    ("prt_brdf", &[], BRUSHED, "any reflectance with transfer, f32", TYRA),
    ("prt_brdf", &[("halves", 1.0)], BRUSHED, "any reflectance with transfer, f16", TYRA),
];

/// The full matrices that memory is compared with: 25 × 25 numbers in single precision.
const FULL: usize = 2500;

/// Seconds of processors that this process has used (Linux; elsewhere seconds on the clock).
fn cpu() -> f64 {
    static START: OnceLock<Instant> = OnceLock::new();
    let stat = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    match stat.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok()) {
        Some(ns) => ns * 1e-9,
        None => START.get_or_init(Instant::now).elapsed().as_secs_f64(),
    }
}

fn mesh() -> (String, Mesh) {
    let loaded = data("meshes/dragon_vrip_res2.ply.gz").and_then(|p| load(&p, &Default::default()).ok());
    match loaded {
        Some(l) => ("dragon".into(), l.merged()),
        None => ("torus".into(), shapes::torus(0.7, 0.3, 226)),
    }
}

/// Every vertex, seen from 20° to 70° off its normal.
fn points(mesh: &Mesh) -> PointsBuf {
    let mut q = PointsBuf::with_capacity(mesh.positions.len());
    for (k, (n, p)) in mesh.normals.iter().zip(&mesh.positions).enumerate() {
        let t = n.any_orthonormal_vector();
        let turn = 2.4 * k as f32;
        let theta = 0.35 + 0.87 * (0.618 * k as f32).fract();
        let side = t * turn.cos() + n.cross(t) * turn.sin();
        q.push(*n, t, *n * theta.cos() + side * theta.sin(), *p);
        q.locate(Vec2::ZERO, [k as u32; 3], [0.0; 2]);
    }
    q
}

/// Seconds of a run: the least mean over some tenths of a second, since the kernel counts in steps of
/// milliseconds.
fn quickest(mut run: impl FnMut()) -> f64 {
    let mean = |_| {
        let (start, mut runs) = (cpu(), 0);
        while runs == 0 || cpu() - start < 0.2 {
            run();
            runs += 1;
        }
        (cpu() - start) / f64::from(runs)
    };
    (0..7).map(mean).fold(f64::INFINITY, f64::min)
}

/// Does the command line select rows of this name?
fn wanted(what: &str) -> bool {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    words.iter().all(|w| what.contains(w.as_str()))
}

fn rms(a: &[Vec<f32>; 3], b: &[Vec<f32>; 3]) -> f64 {
    let square = |x: f32| f64::from(x).powi(2);
    let pairs = a.iter().zip(b).flat_map(|(a, b)| a.iter().zip(b));
    let (off, all) = pairs.fold((0.0, 0.0), |s, (a, b)| (s.0 + square(a - b), s.1 + square(*b)));
    (off / all).sqrt()
}

fn main() {
    let (name, mesh) = mesh();
    let q = points(&mesh);
    println!("{name}: {} vertices, five bands, smooth sky, {}", q.len(), steradian_simd::isa().name());
    let geometry = Geometry::new(Arc::new(mesh), Sites::Vertices);
    let mut baseline: Option<(&str, [Vec<f32>; 3], f64)> = None;
    println!(
        "| technique | Mvertex/s: frame | shading | both | the paper's | times the baseline | bytes/site | full f32 over that | RMS against full |\n|---|---|---|---|---|---|---|---|---|"
    );
    for (slug, params, spec, what, paper) in
        CASES.into_iter().filter(|c| wanted(&format!("{}: {}", c.0, c.3)))
    {
        let material = Material::new(steradian_brdf::parse(spec).expect("a spec"));
        let all = params.iter().copied().chain([("precision", 0.02)]);
        let params: ParamValues = all.collect();
        let technique = find(slug).expect("a technique");
        let mut bake: Box<dyn AnyBake> = technique
            .bake(&lights::smooth(), &material, Some(&geometry), &params, &Task::quiet())
            .expect("bakes");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
        let mut run = || {
            let mut turn = 0.0;
            let frame = quickest(|| {
                turn += 0.1;
                bake.frame(&View { light_rotation: Mat3::from_axis_angle(Vec3::Y, turn), ..View::default() });
            });
            bake.frame(&View::default());
            let shading = quickest(|| bake.shade(&q.as_points(), &mut Radiance::of(&mut rgb)));
            [frame, shading]
        };
        let [frame, shading] = match &pool {
            Ok(pool) => pool.install(&mut run),
            Err(_) => run(),
        };
        let rate = |s: f64| q.len() as f64 / s / 1e6;
        let (_, full, before) = match &baseline {
            Some(known) if known.0 == spec => known,
            _ => &*baseline.insert((spec, rgb.clone(), frame + shading)),
        };
        println!(
            "| {slug}: {what} | {:.1} | {:.1} | {:.1} | {paper} | {:.2} | {:.0} | {:.1} | {:.4} |",
            rate(frame),
            rate(shading),
            rate(frame + shading),
            before / (frame + shading),
            bake.bytes() as f64 / q.len() as f64,
            (FULL * q.len()) as f64 / bake.bytes() as f64,
            rms(&rgb, full),
        );
    }
    if wanted("rows of hats without compression") {
        let seconds = without_compression(&q);
        let rate = q.len() as f64 / seconds / 1e6;
        println!(
            "rows of hats without compression: {rate:.1} Mvertex/s (with it about 10 times as many by STAR04, 7.5)"
        );
    }
}

/// Matrix radiance transfer without compression, of one channel of reflectance (Lehtinen & Kautz 2003): every
/// vertex has a matrix of 8 × 8 hats by 25 coefficients, of which the four rows around the view are
/// multiplied with light of three channels. Seconds of a frame.
fn without_compression(q: &PointsBuf) -> f64 {
    const ROWS: usize = 64;
    let matrices: Vec<[f32; 25]> =
        (0..q.len() * ROWS).map(|k| [((k % 977) as f32 + 1.0) * 1e-3; 25]).collect();
    let light: [[f32; 25]; 3] = [[0.5; 25], [0.4; 25], [0.3; 25]];
    let mut out = vec![[0.0f32; 3]; q.len()];
    quickest(|| {
        for (k, out) in out.iter_mut().enumerate() {
            let of = |d: &[Vec<f32>; 3]| Vec3::new(d[0][k], d[1][k], d[2][k]);
            let (n, t, wo) = (of(&q.n), of(&q.t), of(&q.wo));
            let at = Vec2::new(wo.dot(t), wo.dot(n.cross(t))) / (1.0 + wo.dot(n).max(0.0));
            let place = (at * 0.5 + 0.5) * 7.0;
            let corner = place.floor().clamp(Vec2::ZERO, Vec2::splat(6.0));
            let f = place - corner;
            let first = k * ROWS + corner.y as usize * 8 + corner.x as usize;
            let hats = [
                (0, (1.0 - f.x) * (1.0 - f.y)),
                (1, f.x * (1.0 - f.y)),
                (8, (1.0 - f.x) * f.y),
                (9, f.x * f.y),
            ];
            let mut row = [0.0f32; 25];
            for (hat, w) in hats {
                row.iter_mut().zip(&matrices[first + hat]).for_each(|(r, m)| *r += w * m);
            }
            *out = light.map(|l| {
                let mut sums = [0.0f32; 5];
                row.iter().zip(&l).enumerate().for_each(|(i, (r, l))| sums[i % 5] += r * l);
                sums.iter().sum()
            });
        }
        std::hint::black_box(&out);
    })
}
