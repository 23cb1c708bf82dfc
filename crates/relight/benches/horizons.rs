//! Measures the time, in seconds by the clock, in which the horizons of a height map of 256 × 256 texels are
//! computed at 64 azimuths, and the links along which its texels see each other in 64 directions about the
//! normal. `cargo bench -p steradian-relight`
//!
//! The baseline looks at every crossing of a line with the surface's edges as far as any height can matter.
//! The heights are blocks by formula and, where there are real data (`STERADIAN_DATA`), rocks and stones of a
//! relief of 8 %. Least of five runs.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

use glam::Vec3;
use std::f64::consts::TAU;
use std::time::Instant;
use steradian_formats::{Limits, read_image};
use steradian_relight::height::{Ellipses, HeightField, Horizons, Scattering};

const SIDE: usize = 256;
const AZIMUTHS: usize = 64;
const DIRECTIONS: usize = 64;

/// Waves with flat tops and bottoms.
fn blocks(k: usize) -> f32 {
    let [x, y] = [k % SIDE, k / SIDE].map(|i| TAU * i as f64 / SIDE as f64);
    let wave = (3.0 * x + y).sin() + (5.0 * y - 2.0 * x).cos() + 0.3 * (17.0 * x + 11.0 * y).sin();
    (0.02 * SIDE as f64 * wave.clamp(-1.2, 1.2)) as f32
}

fn fields() -> Vec<(&'static str, HeightField)> {
    let mut all = vec![("blocks", (0..SIDE * SIDE).map(blocks).collect::<Vec<f32>>())];
    if let Some(dir) = steradian_testkit::data("meshes/textures") {
        for name in ["rocks_NM_height.tga", "stones_NM_height.tga"] {
            let raster = read_image(&dir.join(name), &Limits::default()).expect("an image");
            let z = raster.channel("A").expect("height in alpha");
            all.push((name, z.iter().map(|v| 0.08 * SIDE as f32 * v).collect()));
        }
    }
    all.into_iter().map(|(name, z)| (name, HeightField::new(SIDE, SIDE, z).expect("finite"))).collect()
}

/// Least seconds of five runs.
fn least<T>(f: impl Fn() -> T) -> f64 {
    let run = || {
        let start = Instant::now();
        drop(f());
        start.elapsed().as_secs_f64()
    };
    (0..5).map(|_| run()).fold(f64::INFINITY, f64::min)
}

/// Links along directions that are cosine-distributed about the normals.
fn links(field: &HeightField) -> Option<Scattering> {
    let local: Vec<Vec3> = (0..DIRECTIONS)
        .map(|k| {
            let r2 = (k as f32 + 0.5) / DIRECTIONS as f32;
            let (sin, cos) = (2.399_963_3 * k as f32).sin_cos();
            Vec3::new(r2.sqrt() * cos, r2.sqrt() * sin, (1.0 - r2).sqrt())
        })
        .collect();
    let frames: Vec<[Vec3; 3]> = (0..SIDE * SIDE)
        .map(|k| {
            let n = field.normal(k % SIDE, k / SIDE);
            let t = (Vec3::X - n * n.x).normalize();
            [t, n.cross(t), n]
        })
        .collect();
    let along = |texel: usize, k: usize| {
        let ([t, b, n], d) = (frames[texel], local[k]);
        t * d.x + b * d.y + n * d.z
    };
    Scattering::new(field, DIRECTIONS, &along, &|| true)
}

fn main() {
    let phi: Vec<f64> = (0..AZIMUTHS).map(|k| TAU * k as f64 / AZIMUTHS as f64).collect();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    println!("{SIDE} x {SIDE} texels, {AZIMUTHS} azimuths, {threads} threads");
    for (name, field) in fields() {
        let every = least(|| field.slopes_by_every_crossing(&phi));
        let horizons = least(|| Horizons::new(&field, AZIMUTHS, &|| true));
        let ellipses = least(|| Ellipses::new(&field, &|| true));
        let scattering = least(|| links(&field));
        println!(
            "{name:20} every crossing {every:.3} s, horizons {horizons:.3} s, ellipses {ellipses:.3} s, links {scattering:.3} s"
        );
    }
}
