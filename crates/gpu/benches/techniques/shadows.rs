//! Shadows of local lights: milliseconds of every further light at 1920 × 1080.

use super::{common, name, shortest};
use glam::{Affine3A, Vec3};
use std::sync::Arc;
use steradian_base::Task;
use steradian_gpu::scene::Settings;
use steradian_gpu::{Gpu, Renderer};
use steradian_light::PointLight;
use steradian_scene::shadow::{Blocker, Flat, LightAt, MapOptions, ShadowMaps, ShadowVolumes};
use steradian_scene::{Bvh, Mesh, shapes};
use steradian_techniques::Material;
use steradian_techniques::direct::Direct;
use steradian_techniques::gpu::shadow;

/// The lights of the two pictures that are compared.
const COUNTS: [usize; 2] = [1, 5];
const SPEC: &str = "lambert:albedo=0.6";

/// A knot above a floor.
fn case(height: usize) -> Result<common::Case, Box<dyn std::error::Error>> {
    let mut case = common::case(1, height);
    let (low, high) = case.mesh.0.bounds().ok_or("no triangles")?;
    let size = 4.0 * (high - low).length();
    let below = Affine3A::from_translation(Vec3::new(0.0, low.y - 0.05, 0.0));
    let floor = shapes::by_name(&format!("plane:size={size}"))?.transformed(&below);
    let mesh = Mesh::merged(&[case.mesh.0.clone(), floor]);
    case.mesh = (mesh.clone(), Bvh::build(&mesh));
    case.brdf = steradian_brdf::parse(SPEC)?;
    Ok(case)
}

fn lights(count: usize) -> Direct {
    let place = |k: usize| {
        let (s, c) = (std::f32::consts::TAU * k as f32 / 5.0 + 0.4).sin_cos();
        2.5 * Vec3::new(0.6 * c, 0.8, 0.6 * s)
    };
    let points = (0..count).map(|k| PointLight { position: place(k), intensity: [4.0; 3] }).collect();
    Direct { points, ..Direct::default() }
}

pub fn measure(gpu: &Gpu, (width, height): (usize, usize)) -> Result<(), Box<dyn std::error::Error>> {
    let case = case(height)?;
    let (mesh, bvh) = &case.mesh;
    // For five lights larger maps would exceed 16 million texels.
    let maps = MapOptions { size: 512, ..MapOptions::default() };
    println!(
        "\nshadows: GPU ms at {width} x {height}, four samples a pixel, shaded once a pixel and triangle; point lights over a knot and a\n\
         floor of {} triangles, {SPEC}\n\
         {:8} {:8} {:>9} {:>9} {:>9} {:>14}",
        mesh.triangles.len(),
        "shadows",
        "path",
        "1 light",
        "5 lights",
        "a light",
        "processor's ms"
    );
    let technique = steradian_techniques::find("sh_irradiance").ok_or("no such technique")?;
    let material = Material::new(case.brdf.clone());
    let bake = technique.bake(&case.lights, &material, None, &Default::default(), &Task::quiet())?;
    for how in ["none", "map", "ray", "volume"] {
        // Software adapters trace rays for a block of pixels for each triangle.
        let paths = if gpu.is_software() { &super::PATHS[1..] } else { &super::PATHS };
        for path in paths.iter().copied() {
            let (mut ms, mut cpu) = ([f64::NAN; 2], [f64::NAN; 2]);
            for (k, count) in COUNTS.into_iter().enumerate() {
                let direct = lights(count);
                let places: Vec<_> = direct.points.iter().map(|p| LightAt::Near(p.position)).collect();
                let by: Option<Flat> = match how {
                    "map" => ShadowMaps::new(mesh, bvh, &places, maps).flat(),
                    "ray" => bvh.flat(),
                    "volume" => ShadowVolumes::new(mesh, &places).flat(),
                    _ => None,
                };
                if by.is_none() && how != "none" {
                    return Err(format!("{how} has no form for GPUs").into());
                }
                let technique = match &by {
                    Some(by) => shadow::behind(bake.gpu(), by, 1e-4),
                    None => bake.gpu(),
                };
                let mut scene = common::scene(&case, technique);
                scene.objects[0].brdf = case.brdf.shader();
                scene.direct = direct;
                if let Some(Flat::Volumes(drawn)) = by {
                    scene.volumes = Some(Arc::clone(&drawn));
                }
                let settings = Settings::interactive(width, height, path);
                let mut renderer = Renderer::new(gpu, scene, &settings)?;
                let (timings, processor) = shortest(gpu, &mut renderer)?;
                (ms[k], cpu[k]) = (timings.total(), processor);
            }
            let each = |t: [f64; 2]| (t[1] - t[0]) / (COUNTS[1] - COUNTS[0]) as f64;
            println!(
                "{how:8} {:8} {:9.3} {:9.3} {:9.4} {:14.0}",
                name(path),
                ms[0],
                ms[1],
                each(ms),
                each(cpu)
            );
        }
    }
    Ok(())
}
