//! Milliseconds per room at 1920 × 1080 beside the same device's fill and bandwidth roofs, and frames per second
//! at 512 × 512 under a turning light.
//!
//! Device times come from timestamps around the passes; the smallest of several frames is shown. For context,
//! not for comparison (other scenes, other machines): Green, Kautz & Durand 2007 report 350 fps with shadowing and
//! 1000 fps without; Ramamoorthi & Hanrahan 2002 about 30 fps; Kautz, Sloan & Snyder 2002 give theirs in
//! table 1.

#![allow(clippy::print_stdout, reason = "a benchmark's output")]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{Case, SCENES, case, gpu, scene, view};
use glam::Mat3;
use std::time::Instant;
use steradian_base::Task;
use steradian_gpu::scene::{Backdrop, Depth, Filter, Path, Rate, Scene, Settings, Timings};
use steradian_gpu::{Gpu, GpuError, Renderer};
use steradian_techniques::{AnyBake, Material, View, registry};

const FULL: (usize, usize) = (1920, 1080);

/// What an interactive window would choose: 16-bit samples, their mean as the pixel.
fn interactive((width, height): (usize, usize)) -> Settings {
    Settings { filter: Filter::Mean, depth: Depth::Half, ..Settings::new(width, height) }
}

fn main() {
    let gpu = match gpu() {
        Ok(gpu) => gpu,
        Err(e) => return println!("not measured: {e}"),
    };
    println!("{}{}", gpu.describe(), if gpu.is_software() { ", on the CPU" } else { "" });
    if let Err(e) = measure(gpu) {
        println!("ended: {e}");
    }
}

/// Shape, case and bake.
type Room = (&'static str, Case, Box<dyn AnyBake>);

/// Every room in the first scene of the demo whose material it takes.
fn rooms(side: usize) -> Vec<Room> {
    let first = |t: &&'static dyn steradian_techniques::AnyTechnique| {
        (0..SCENES.len()).find_map(|k| {
            let brdf = steradian_brdf::parse(SCENES[k].brdf).ok()?;
            let case = ((t.card().materials)(&*brdf).is_ok()).then(|| case(k, side))?;
            let bake =
                t.bake(&case.lights, &Material::new(brdf), None, &Default::default(), &Task::quiet()).ok()?;
            Some((SCENES[k].shape, case, bake))
        })
    };
    registry().iter().filter(|t| !t.card().needs.sites).filter_map(first).collect()
}

/// The shortest of some frames, as the device measures it; by the wall's clock where the device has none.
fn shortest(gpu: &Gpu, renderer: &mut Renderer) -> Result<Timings, GpuError> {
    let frames = if gpu.is_software() { 3 } else { 40 };
    let mut best: Option<Timings> = None;
    for _ in 0..frames {
        let start = Instant::now();
        let mut timings = renderer.draw(gpu)?;
        if timings.passes.is_empty() {
            timings.passes.push(("frame (wall)", 1e3 * start.elapsed().as_secs_f64()));
        }
        if best.as_ref().is_none_or(|b| timings.total() < b.total()) {
            best = Some(timings);
        }
    }
    Ok(best.unwrap_or_default())
}

fn passes(t: &Timings) -> String {
    t.passes.iter().map(|(name, ms)| format!("{name} {ms:.3}")).collect::<Vec<_>>().join(", ")
}

fn measure(gpu: &Gpu) -> Result<(), GpuError> {
    let rooms = rooms(FULL.1);
    if std::env::args().any(|a| a == "fps") {
        return live(gpu, rooms);
    }
    roofs(gpu, &rooms[0].1)?;
    println!("\nGPU ms at {} x {}, four samples a pixel, shaded once a pixel and triangle", FULL.0, FULL.1);
    for (shape, case, bake) in &rooms {
        for path in [Path::Raster, Path::Compute] {
            let settings = Settings { path, ..interactive(FULL) };
            let mut renderer = Renderer::new(gpu, scene(case, bake.gpu()), &settings)?;
            let (picture, _) = renderer.render(gpu)?;
            let covered = picture.alpha.iter().sum::<f32>() / picture.alpha.len() as f32;
            let t = shortest(gpu, &mut renderer)?;
            let (slug, name) = (bake.card().slug, format!("{path:?}").to_lowercase());
            let percent = 100.0 * covered;
            println!(
                "{slug:20} {name:8} {:9.3}   ({})   {shape}, coverage {percent:.0} %",
                t.total(),
                passes(&t)
            );
        }
    }
    live(gpu, rooms)
}

fn live(gpu: &Gpu, rooms: Vec<Room>) -> Result<(), GpuError> {
    println!(
        "\nframes per second at 512 x 512, light turned every frame (uniforms only): by the wall's clock, and CPU s a frame"
    );
    for (shape, case, mut bake) in rooms {
        let [pixel, sample] = [Rate::Pixel, Rate::Sample].map(|rate| turning(gpu, &case, &mut *bake, rate));
        let slug = bake.card().slug;
        println!("{slug:20} {}   shaded at every sample {}   {shape}", pixel?, sample?);
    }
    Ok(())
}

/// Seconds that this process has computed on all cores; 0 where the system does not tell.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    // Fields 14 and 15, user and system time in hundredths; the third is the first after the name.
    fields.skip(11).take(2).filter_map(|t| t.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// What the device does at most: a picture of one colour through the same target, and a copy.
fn roofs(gpu: &Gpu, case: &Case) -> Result<(), GpuError> {
    let nothing = |path| Settings { path, ..interactive(FULL) };
    let empty = |path| {
        let backdrop = Backdrop { colour: [0.5; 3], ..Backdrop::default() };
        let scene =
            Scene { objects: Vec::new(), backdrop, camera: case.camera, light_rotation: Mat3::IDENTITY };
        shortest(gpu, &mut Renderer::new(gpu, scene, &nothing(path))?)
    };
    for path in [Path::Raster, Path::Compute] {
        let t = empty(path)?;
        let (name, samples) = (format!("{path:?}").to_lowercase(), 4.0 * (FULL.0 * FULL.1) as f64);
        let rate = samples / (1e6 * t.passes.first().map_or(t.total(), |p| p.1));
        println!(
            "fill roof, {name}: {:.3} ms a picture of one colour ({}); {rate:.2} Gsample/s in its first pass",
            t.total(),
            passes(&t)
        );
    }
    let bytes = if gpu.is_software() { 64 << 20 } else { 1 << 30 };
    println!("bandwidth roof: {:.1} GB/s read and written by a copy", 1e-9 * gpu.copy_bandwidth(bytes)?);
    Ok(())
}

fn turning(gpu: &Gpu, case: &Case, bake: &mut dyn AnyBake, rate: Rate) -> Result<String, GpuError> {
    let settings = Settings { rate, ..interactive((512, 512)) };
    let mut renderer = Renderer::new(gpu, scene(case, bake.gpu()), &settings)?;
    renderer.draw(gpu)?;
    let (start, cpu) = (Instant::now(), cpu_seconds());
    let mut frames = 0;
    while frames < 5 || start.elapsed().as_secs_f64() < 1.5 {
        let light_rotation = Mat3::from_rotation_y(0.05 * frames as f32);
        bake.frame(&View { light_rotation, ..view(case) });
        renderer.update_room(gpu, 0, &bake.gpu())?;
        renderer.set_light_rotation(gpu, light_rotation);
        renderer.draw(gpu)?;
        frames += 1;
    }
    let frames = f64::from(frames);
    let each = (cpu_seconds() - cpu) / frames;
    Ok(format!("{:7.1} fps {each:6.3} s", frames / start.elapsed().as_secs_f64()))
}
