//! Any-hit rays on the Stanford bunny and on a torus knot of 100,000 triangles (the workload of visibility
//! precomputation): 256 stratified cosine directions for every fourth vertex, one thread, against obvhs' own
//! traversals in the same run, and against Embree's by `scripts/embree-rays.py`.
#![expect(clippy::print_stdout, reason = "a benchmark reports")]

use glam::{Vec3, Vec3A};
use obvhs::triangle::Triangle;
use obvhs::{BvhBuildParams, bvh2, cwbvh};
use std::f32::consts::TAU;
use std::time::{Duration, Instant};
use steradian_formats::Limits;
use steradian_scene::{Bvh, Mesh, Ray, load, shapes};
use steradian_testkit::data;

/// 16 × 16 strata of the cosine-weighted hemisphere about the normal, turned by a hash of the vertex.
fn rays(mesh: &Mesh) -> Vec<Ray> {
    let offset = 1e-4 * mesh.diagonal();
    let used = mesh.used();
    let mut out = Vec::new();
    for i in (0..mesh.positions.len()).step_by(4).filter(|&i| used[i]) {
        let n = mesh.normals[i];
        let (t, b) = n.any_orthonormal_pair();
        let turn = (i as u32).wrapping_mul(2_654_435_769) as f32 / u32::MAX as f32;
        for k in 0..256u32 {
            let (x, y) = morton(k);
            let (r, phi) = (((x as f32 + 0.5) / 16.0).sqrt(), TAU * ((y as f32 + 0.5) / 16.0 + turn));
            let d = t * (r * phi.cos()) + b * (r * phi.sin()) + n * (1.0 - r * r).sqrt();
            out.push(Ray { origin: mesh.positions[i] + n * offset, direction: d.normalize() });
        }
    }
    out
}

/// The even and the odd bits.
fn morton(k: u32) -> (u32, u32) {
    let even = |k: u32| (0..4).map(|i| (k >> (2 * i) & 1) << i).sum();
    (even(k), even(k >> 1))
}

/// Processor time of this thread on Linux; elapsed time elsewhere.
fn busy() -> Duration {
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = stat.split(' ').next().and_then(|n| n.parse().ok());
    nanoseconds.map_or_else(|| START.get_or_init(Instant::now).elapsed(), Duration::from_nanos)
}

/// [`measure_all`] of a function of one ray.
fn measure(name: &str, rays: &[Ray], baseline: Option<f64>, f: impl Fn(&Ray) -> bool) -> f64 {
    measure_all(name, rays, baseline, || rays.iter().filter(|r| f(r)).count())
}

/// Best of five runs: million rays a second, and the share that is occluded, of which `count` gives the
/// number.
fn measure_all(name: &str, rays: &[Ray], baseline: Option<f64>, mut count: impl FnMut() -> usize) -> f64 {
    let mut best = Duration::MAX;
    let mut occluded = 0;
    for _ in 0..5 {
        let start = busy();
        occluded = count();
        best = best.min(busy() - start);
    }
    let rate = rays.len() as f64 / best.as_secs_f64() / 1e6;
    let share = occluded as f64 / rays.len() as f64;
    let ratio = baseline.map_or(String::new(), |b| format!("  {:.2} × obvhs Bvh2", rate / b));
    println!("{name:28} {rate:7.2} Mray/s  occluded {share:.5}{ratio}");
    rate
}

/// Writes the rays into the folder `STERADIAN_DUMP` for `scripts/embree-rays.py`: counts of vertices,
/// triangles and rays as u32, then positions, indices, and origins and directions, all little-endian.
fn dump(path: &std::path::Path, mesh: &Mesh, rays: &[Ray]) -> std::io::Result<()> {
    let mut bytes = Vec::new();
    for n in [mesh.positions.len(), mesh.triangles.len(), rays.len()] {
        bytes.extend((n as u32).to_le_bytes());
    }
    let mut put = |v: Vec3| v.to_array().iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    mesh.positions.iter().for_each(|p| put(*p));
    let indices: Vec<u8> = mesh.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
    let mut rest = Vec::new();
    for r in rays {
        [r.origin, r.direction].iter().flat_map(|v| v.to_array()).for_each(|x| rest.extend(x.to_le_bytes()));
    }
    bytes.extend(indices);
    bytes.extend(rest);
    std::fs::write(path, bytes)
}

fn main() {
    let bunny = data("meshes/bunny_bun_zipper.ply").and_then(|p| load(&p, &Limits::default()).ok());
    if let Some(loaded) = bunny {
        compare("bunny", &loaded.merged());
    }
    compare("knot", &shapes::knot(2, 3, 0.56, 0.28, 0.16, 365));
}

fn compare(name: &str, mesh: &Mesh) {
    let rays = rays(mesh);
    let triangles: Vec<Triangle> = (0..mesh.triangles.len())
        .map(|i| {
            let [v0, v1, v2] = mesh.corners(i).map(Vec3A::from);
            Triangle { v0, v1, v2 }
        })
        .collect();
    if let Some(folder) = std::env::var_os("STERADIAN_DUMP")
        && let Err(e) = dump(&std::path::Path::new(&folder).join(format!("{name}.rays")), mesh, &rays)
    {
        println!("cannot write the rays: {e}");
    }
    println!(
        "{name}: {} triangles, {} rays, {}",
        mesh.triangles.len(),
        rays.len(),
        steradian_simd::isa().name()
    );
    let start = Instant::now();
    let ours = Bvh::build(mesh);
    println!(
        "build: ours {:.0} ms, {:.1} MB",
        1e3 * start.elapsed().as_secs_f64(),
        ours.bytes() as f64 / 1e6
    );
    let (params, mut time) = (BvhBuildParams::medium_build(), Duration::ZERO);
    let two = bvh2::builder::build_bvh2_from_tris(&triangles, params, &mut time);
    println!("build: obvhs Bvh2 {:.0} ms", 1e3 * time.as_secs_f64());
    let mut time = Duration::ZERO;
    let eight = cwbvh::builder::build_cwbvh_from_tris(&triangles, params, &mut time);
    println!("build: obvhs CwBvh {:.0} ms", 1e3 * time.as_secs_f64());
    let ordered = |ids: &[u32]| -> Vec<Triangle> { ids.iter().map(|&i| triangles[i as usize]).collect() };
    let (two_t, eight_t) = (ordered(&two.primitive_indices), ordered(&eight.primitive_indices));
    let theirs = |r: &Ray| obvhs::ray::Ray::new_inf(Vec3A::from(r.origin), Vec3A::from(r.direction));
    let base = measure("obvhs Bvh2 any hit", &rays, None, |r| {
        !two.ray_traverse_miss(theirs(r), |r, id| two_t[id].intersect(r))
    });
    measure("obvhs CwBvh any hit", &rays, Some(base), |r| {
        !eight.ray_traverse_miss(theirs(r), |r, id| eight_t[id].intersect(r))
    });
    measure("ours, any hit", &rays, Some(base), |r| ours.occluded(r, f32::INFINITY));
    let mut hits = vec![false; rays.len()];
    measure_all("ours, any hit, in batches", &rays, Some(base), || {
        ours.occluded_each(&rays, f32::INFINITY, &mut hits);
        hits.iter().filter(|h| **h).count()
    });
    measure("ours, closest hit", &rays, Some(base), |r| ours.closest(r, f32::INFINITY).is_some());
    let start = Instant::now();
    let blocked = ours.occluded_many(&rays, f32::INFINITY).iter().filter(|b| **b).count();
    let rate = rays.len() as f64 / start.elapsed().as_secs_f64() / 1e6;
    println!(
        "ours, batch on all cores     {rate:7.2} Mray/s  occluded {:.5}",
        blocked as f64 / rays.len() as f64
    );
}
