//! Milliseconds per technique at 1920 × 1080, with the device's fill and bandwidth roofs, those of a local
//! light and its shadows, those of shadowed glossy reflections on meshes of 100 000 and 35 000 vertices, and
//! frames per second at 512 × 512 under a turning light.
//!
//!     cargo bench -p steradian-gpu --bench techniques                 all
//!     cargo bench -p steradian-gpu --bench techniques -- frame        the first: `frame`, `local`, `shadows`, `glossy`, `fps`
//!     cargo bench -p steradian-gpu --bench techniques -- frame small  at 480 × 270, for software adapters
//!
//! Device times come from timestamps around the passes; the smallest of several frames is shown. The
//! processor's time a frame is shown too: on a software adapter, which shares its cores, it is the relevant
//! one. The papers' figures are printed for context, not for comparison: other scenes, other machines, other
//! parts of the work.

#![allow(clippy::print_stdout, reason = "a benchmark's output")]

#[path = "../../tests/common/mod.rs"]
mod common;
mod glossy;
mod local;
mod shadows;

use common::{Case, SCENES, case, gpu, scene, view};
use glam::Mat3;
use std::time::Instant;
use steradian_base::Task;
use steradian_gpu::scene::{Backdrop, Path, Rate, Scene, Settings, Timings};
use steradian_gpu::{Gpu, GpuError, Renderer};
use steradian_techniques::{AnyBake, Material, View, registry};

/// Figures from the papers, in their words where it matters.
const PAPERS: &str = "\
For context, from the papers (other scenes and machines):
  Green, Kautz & Durand 2007, fig. 5: 100K vertices, shadowed, 350 Hz on an NVidia 8800; sec. 6, fig. 6: 'about 1000 frames
    per second' on the same card, shadowed glossy reflections only, without the diffuse part 'or drawing to the screen'
  Ramamoorthi & Hanrahan 2002, fig. 5.1 and sec. 5.7: 'approximately 30 frames per second', a reflection map of
    64 x 64 x 6 computed in software each frame
  Kautz, Sloan & Snyder 2002, table 1: 2.2 GHz P4, Radeon 8500, 720 x 760, 25 coefficients; frames per second without
    transfer / with it / light fixed / view fixed: teapot (152413 vertices) 2 / 1.64 / 9.5 / 48.9, head (50060)
    5.24 / 4.18 / 25.3 / 130, Buddha (49990) 4.05 / 3.22 / 15.6 / 127, bird (48668) 6.04 / 4.74 / 28.4 / 128,
    Tyra (100000) 2.62 / 2.08 / 9.9 / 71.5";

const PATHS: [Path; 2] = [Path::Raster, Path::Compute];

/// A part of the benchmark by its name.
type Part<'a> = (&'static str, &'a dyn Fn() -> Result<(), Box<dyn std::error::Error>>);

fn main() {
    let gpu = match gpu() {
        Ok(gpu) => gpu,
        Err(e) => return println!("not measured: {e}"),
    };
    println!("{}{}", gpu.describe(), if gpu.is_software() { ", on the CPU" } else { "" });
    let asked = |what: &str| std::env::args().any(|a| a == what);
    let size = if asked("small") { (480, 270) } else { (1920, 1080) };
    let all = !["frame", "local", "shadows", "glossy", "fps"].iter().any(|part| asked(part));
    let parts: [Part<'_>; 5] = [
        ("frame", &|| Ok(measure(gpu, size)?)),
        ("local", &|| local::measure(gpu, size)),
        ("shadows", &|| shadows::measure(gpu, size)),
        ("glossy", &|| glossy::measure(gpu)),
        ("fps", &|| Ok(live(gpu)?)),
    ];
    for (part, run) in parts {
        if (all || asked(part))
            && let Err(e) = run()
        {
            println!("{part} ended: {e}");
        }
    }
    println!("\n{PAPERS}");
}

/// Shape, case and bake.
type Technique = (&'static str, Case, Box<dyn AnyBake>);

/// Every technique in the scenes of the demo whose material it takes.
fn techniques(side: usize) -> impl Iterator<Item = Technique> {
    let techniques = registry().iter().filter(|t| !t.card().needs.sites);
    techniques.flat_map(move |t| {
        (0..SCENES.len()).filter_map(move |k| {
            let brdf = steradian_brdf::parse(SCENES[k].brdf).ok()?;
            let case = ((t.card().materials)(&*brdf).is_ok()).then(|| case(k, side))?;
            let material = Material::new(brdf);
            let bake = t.bake(&case.lights, &material, None, &Default::default(), &Task::quiet()).ok()?;
            Some((SCENES[k].shape, case, bake))
        })
    })
}

/// Every technique in the first such scene.
fn in_first_scenes(side: usize) -> impl Iterator<Item = Technique> {
    let mut last = "";
    techniques(side)
        .filter(move |(_, _, bake)| std::mem::replace(&mut last, bake.card().slug) != bake.card().slug)
}

/// The shortest of some frames, as the device measures it (by the wall's clock where the device has none),
/// and the processor's milliseconds a frame.
fn shortest(gpu: &Gpu, renderer: &mut Renderer) -> Result<(Timings, f64), GpuError> {
    let frames = if gpu.is_software() { 5 } else { 40 };
    let cpu = cpu_ms();
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
    Ok((best.unwrap_or_default(), (cpu_ms() - cpu) / f64::from(frames)))
}

fn passes(t: &Timings) -> String {
    t.passes.iter().map(|(name, ms)| format!("{name} {ms:.3}")).collect::<Vec<_>>().join(", ")
}

fn name(path: Path) -> String {
    format!("{path:?}").to_lowercase()
}

fn measure(gpu: &Gpu, (width, height): (usize, usize)) -> Result<(), GpuError> {
    roofs(gpu, (width, height))?;
    println!("\nGPU ms at {width} x {height}, four samples a pixel, shaded once a pixel and triangle");
    for (shape, case, bake) in in_first_scenes(height) {
        for path in PATHS {
            let settings = Settings::interactive(width, height, path);
            let mut renderer = Renderer::new(gpu, scene(&case, bake.gpu()), &settings)?;
            let (picture, _) = renderer.render(gpu)?;
            let covered = 100.0 * picture.alpha.iter().sum::<f32>() / picture.alpha.len() as f32;
            let (t, cpu) = shortest(gpu, &mut renderer)?;
            let (slug, name, total) = (bake.card().slug, name(path), t.total());
            println!(
                "{slug:20} {name:8} {total:9.3}   ({})   processor {cpu:.0} ms   {shape}, coverage {covered:.0} %",
                passes(&t)
            );
        }
    }
    Ok(())
}

fn live(gpu: &Gpu) -> Result<(), GpuError> {
    let preferred = gpu.preferred_path();
    println!(
        "\nframes at 512 x 512, light turned every frame: per second by the wall's clock, and processor ms a frame;\n\
         the path chosen here is {}",
        name(preferred)
    );
    for (shape, case, mut bake) in techniques(512) {
        print!("{:20}", bake.card().slug);
        for path in PATHS {
            print!(" {} {}", name(path), turning(gpu, &case, &mut *bake, (path, Rate::Pixel))?);
        }
        println!(
            "   at every sample {}   {shape}",
            turning(gpu, &case, &mut *bake, (preferred, Rate::Sample))?
        );
    }
    Ok(())
}

/// Milliseconds that this process has computed on all cores; 0 where the system does not tell.
fn cpu_ms() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    // Fields 14 and 15, user and system time in hundredths; the third is the first after the name.
    fields.skip(11).take(2).filter_map(|t| t.parse::<f64>().ok()).sum::<f64>() * 10.0
}

/// Upper bounds of the device: a picture of one colour through the same target, and a copy.
fn roofs(gpu: &Gpu, (width, height): (usize, usize)) -> Result<(), GpuError> {
    for path in PATHS {
        let backdrop = Backdrop { colour: [0.5; 3], ..Backdrop::default() };
        let camera = steradian_scene::Camera::Orthographic {
            from: glam::Vec3::Z,
            at: glam::Vec3::ZERO,
            up: glam::Vec3::Y,
            height: 1.0,
        };
        let scene = Scene {
            objects: Vec::new(),
            direct: Default::default(),
            volumes: None,
            backdrop,
            camera,
            light_rotation: Mat3::IDENTITY,
        };
        let mut renderer = Renderer::new(gpu, scene, &Settings::interactive(width, height, path))?;
        let (t, cpu) = shortest(gpu, &mut renderer)?;
        let rate = 4.0 * (width * height) as f64 / (1e6 * t.passes.first().map_or(t.total(), |p| p.1));
        println!(
            "fill roof, {}: {:.3} ms a picture of one colour ({}); {rate:.2} Gsample/s in its first pass; processor {cpu:.0} ms",
            name(path),
            t.total(),
            passes(&t)
        );
    }
    let bytes = if gpu.is_software() { 64 << 20 } else { 1 << 30 };
    println!("bandwidth roof: {:.1} GB/s read and written by a copy", 1e-9 * gpu.copy_bandwidth(bytes)?);
    Ok(())
}

/// Frames per second and processor time a frame.
fn turning(
    gpu: &Gpu,
    case: &Case,
    bake: &mut dyn AnyBake,
    (path, rate): (Path, Rate),
) -> Result<String, GpuError> {
    let settings = Settings { rate, ..Settings::interactive(512, 512, path) };
    let mut renderer = Renderer::new(gpu, scene(case, bake.gpu()), &settings)?;
    renderer.draw(gpu)?;
    let (start, cpu) = (Instant::now(), cpu_ms());
    let mut frames = 0;
    while frames < 5 || start.elapsed().as_secs_f64() < 0.8 {
        let light_rotation = Mat3::from_rotation_y(0.05 * frames as f32);
        bake.frame(&View { light_rotation, ..view(case) });
        match bake.gpu_frame() {
            Some(uniforms) => renderer.update_uniforms(gpu, 0, &uniforms)?,
            None => renderer.set_technique(gpu, 0, bake.gpu())?,
        }
        renderer.set_light_rotation(gpu, light_rotation);
        renderer.draw(gpu)?;
        frames += 1;
    }
    let frames = f64::from(frames);
    let each = (cpu_ms() - cpu) / frames;
    Ok(format!("{:6.1} fps {each:5.0} ms", frames / start.elapsed().as_secs_f64()))
}
