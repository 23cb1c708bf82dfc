//! The chain that engines load, from a light with a sun, and the irradiance cube: seconds and error per
//! level. `cargo bench -p steradian-prefilter --bench chain -- [LIGHT]`
//!
//! 1024 rows of light (2048 × 1024; by default a sky with a sun of radiance 5e4 painted into it), GGX at the
//! alphas of a five-level chain of 256² texels a face, on one thread. Errors are against the sum over all
//! texels at 200 texels a level; brute force is that sum in double precision, timed at a few texels and
//! scaled.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

mod shared;

use glam::DVec3;
use shared::{lights, on_one_thread, sampled, seconds};
use steradian_base::Task;
use steradian_formats::{Raster, TextureLevels, WriteOptions, write_image, write_ktx2};
use steradian_light::{Environment, Lights, load};
use steradian_prefilter::{Lobe, Sampled, Zonal, deviation, filter_image, mirror_image};
use steradian_sphere::{Layout, SphereImage};

const ROWS: usize = 1024;
const TOLERANCE: f64 = 2e-3;
/// 1 − √(1 − m/4), squared.
const ALPHAS: [f64; 4] = [0.017949, 0.085786, 0.25, 1.0];

fn main() {
    let words = shared::words();
    let lights = words.first().map_or_else(sunny, |spec| lights(spec, ROWS));
    on_one_thread(|| {
        let folder = std::env::temp_dir().join(format!("steradian-chain-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("the system has a folder for temporary files");
        chain(&lights, &folder);
        std::fs::remove_dir_all(&folder).expect("the folder was just made");
    });
    println!(
        "\nPeers on another machine (AMD Zen 4; 2048 x 1024 with a sun; CPU s, load included): cmgen 7.08,"
    );
    println!(
        "cmft 5.92 (Phong, 9 mips), glTF-IBL-Sampler 13.6; relative RMS error per level 2 to 29 %. Irradiance cube:"
    );
    println!("cmgen 13.84, glTF-IBL-Sampler 13.0, cmft through 5-band SH 0.24 (error 1.9 %, worst 17 %).");
}

/// A sky with a sun of 5e4 over its 0.53 degrees, in the corner of a cube.
fn sunny() -> Lights {
    let sky = lights("sky", ROWS).environment.expect("a sky is an image");
    let mut image = sky.image.clone();
    let (sun, cos) = (DVec3::new(0.55, 0.62, 0.56).normalize(), 0.2665_f64.to_radians().cos());
    let (w, h) = (image.width, image.height);
    for k in 0..w * h {
        let part = |n: usize| {
            let at = |i: usize, n: usize| i as f64 + (n as f64 + 0.5) / 4.0;
            let p = steradian_sphere::layout::Position { face: 0, x: at(k % w, n % 4), y: at(k / w, n / 4) };
            let d = image.layout.direction(w, h, p).unwrap_or(DVec3::Y);
            f32::from(u8::from(d.dot(sun) > cos)) / 16.0
        };
        let covered: f32 = (0..16).map(part).sum();
        for (c, l) in [5e4, 4.65e4, 4.1e4].into_iter().enumerate() {
            image.planes[c][k] += covered * (l - image.planes[c][k]);
        }
    }
    Lights::from(Environment { image })
}

fn chain(lights: &Lights, folder: &std::path::Path) {
    let image = &lights.environment.as_ref().expect("the light is an image").image;
    let file = folder.join("light.hdr");
    let raster = Raster::rgb(image.width, image.height, image.planes.clone());
    write_image(&file, &raster, &WriteOptions::default()).expect("the folder is writable");
    let reading = seconds(|| load::load(&file, &load::LoadOptions::default()).expect("just written"));
    let lobes = ALPHAS.map(Lobe::ggx);
    let kernels: Vec<&dyn Zonal> = lobes.iter().map(|l| l as _).collect();
    let analysis = seconds(|| sampled(lights, &kernels, TOLERANCE));
    let light = sampled(lights, &kernels, TOLERANCE);
    println!("read {:.0} ms, analysis to band {} {:.0} ms", reading * 1e3, light.order(), analysis * 1e3);
    println!("| level | alpha | ms | way | order | bound | rms | bias | worst | brute force / this |");
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let shape = |n: usize| (Layout::Cube, n, n);
    let mirror = seconds(|| mirror_image(&light, shape(256)));
    println!("| 0 | mirror | {:.1} | area | - | - | - | - | - | - |", mirror * 1e3);
    let mut all = reading + analysis + mirror;
    let mut images = vec![mirror_image(&light, shape(256)).image];
    for (m, lobe) in lobes.iter().enumerate() {
        let (t, image) = level(&light, lobe, &format!("{} | {:.3}", m + 1, ALPHAS[m]), shape(128 >> m));
        all += t;
        images.push(image);
    }
    let writing = seconds(|| write(&images, folder));
    println!("write {:.0} ms; all {:.0} ms", writing * 1e3, (all + writing) * 1e3);
    let lambert = Lobe::lambert();
    let analysis = seconds(|| sampled(lights, &[&lambert], TOLERANCE));
    let light = sampled(lights, &[&lambert], TOLERANCE);
    let (t, image) = level(&light, &lambert, "irradiance | -", shape(256));
    let writing = seconds(|| write(std::slice::from_ref(&image), folder));
    println!("irradiance, read and written: {:.0} ms", (reading + analysis + t + writing) * 1e3);
}

/// One level, measured and printed.
fn level(light: &Sampled, lobe: &Lobe, name: &str, shape: (Layout, usize, usize)) -> (f64, SphereImage) {
    let run = || filter_image(light, lobe, shape, TOLERANCE, &Task::quiet()).expect("nobody cancels");
    let (t, made) = (seconds(run), run());
    let e = deviation(light, lobe, &made.image, 200);
    let brute = seconds(|| light.brute_force(lobe, DVec3::new(0.4, 0.8, -0.2).normalize()));
    let texels = (6 * shape.1 * shape.2) as f64;
    println!(
        "| {name} | {:.1} | {} | {} | {:.1e} | {:.1e} | {:+.1e} | {:.1e} | {:.0} |",
        t * 1e3,
        made.way.name(),
        made.way.order(),
        made.predicted,
        e.rms,
        e.bias,
        e.worst,
        brute * texels / t
    );
    (t, made.image)
}

fn write(images: &[SphereImage], folder: &std::path::Path) {
    let level = |image: &SphereImage| {
        let [r, g, b] = &image.planes;
        r.iter().zip(g).zip(b).flat_map(|((r, g), b)| [*r, *g, *b, 1.0]).collect()
    };
    let n = images[0].width;
    let levels = images.iter().map(level).collect();
    let t = TextureLevels { width: n, height: n, faces: 6, levels, metadata: Vec::new() };
    write_ktx2(&folder.join("map.ktx2"), &t, false).expect("the folder is writable");
}
