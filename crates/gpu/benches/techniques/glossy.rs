//! Shadowed glossy reflections by Gaussian lobes alone, as Green, Kautz & Durand (2007) time them: a metal
//! has no diffuse part.

use super::{PATHS, common, name, shortest};
use glam::Vec3;
use std::sync::Arc;
use steradian_base::{ParamValues, Task};
use steradian_brdf::SharedBrdf;
use steradian_gpu::scene::{Backdrop, Scene, Settings};
use steradian_gpu::{Gpu, Renderer};
use steradian_scene::{Bvh, Camera, Mesh, shapes};
use steradian_techniques::{Geometry, Material, Sites};

/// Pictures of as many pixels a side.
const SIDE: usize = 1024;
/// Knots of as many vertices as the paper's models; its frames a second.
const MESHES: [(&str, f64); 2] = [("knot:segments=512", 350.0), ("knot:segments=304", 1000.0)];
/// Treatments of visibility, with bands.
const SEEN: [(&str, f64); 5] =
    [("none", 4.0), ("ambient", 4.0), ("published", 2.0), ("published", 3.0), ("published", 4.0)];

pub fn measure(gpu: &Gpu) -> Result<(), Box<dyn std::error::Error>> {
    println!(
        "\ngaussian_lobes: GPU ms of the pass that shades, {SIDE} x {SIDE}, one sample a pixel, K = 3, N = 15\n\
         {:19} {:>8} {:12} {:8} {:>9} {:>9}   the paper's frame",
        "shape", "vertices", "visibility", "path", "shading", "all"
    );
    let brdf = steradian_brdf::parse("ggx:alpha=0.15,f0=1/0.77/0.34")?;
    for (shape, rate) in MESHES {
        let mesh = Arc::new(shapes::by_name(shape)?);
        for seen in SEEN {
            rows(gpu, &mesh, &brdf, seen, |what| {
                println!("{shape:19} {:8} {what}   {:.2} ms", mesh.positions.len(), 1e3 / rate);
            })?;
        }
    }
    Ok(())
}

fn rows(
    gpu: &Gpu,
    mesh: &Arc<Mesh>,
    brdf: &SharedBrdf,
    (visibility, bands): (&str, f64),
    row: impl Fn(String),
) -> Result<(), Box<dyn std::error::Error>> {
    let case = common::Case {
        mesh: ((**mesh).clone(), Bvh::build(mesh)),
        camera: Camera::Pinhole { from: Vec3::new(0.5, 0.7, 2.7), at: Vec3::ZERO, up: Vec3::Y, fov_y: 0.65 },
        ..common::case(1, SIDE)
    };
    let technique = steradian_techniques::find("gaussian_lobes").ok_or("no such technique")?;
    // The bake's precision is of no account to the time that shading takes.
    let mut params: ParamValues = [("visibility_bands", bands), ("precision", 0.03)].into_iter().collect();
    params.0.insert("visibility".into(), visibility.into());
    let geometry = Geometry::new(mesh.clone(), Sites::Vertices);
    let bake = technique.bake(
        &case.lights,
        &Material::new(brdf.clone()),
        Some(&geometry),
        &params,
        &Task::quiet(),
    )?;
    for path in PATHS {
        let settings = Settings { scale: 1, ..Settings::interactive(SIDE, SIDE, path) };
        let scene = Scene { backdrop: Backdrop::default(), ..common::scene(&case, bake.gpu()) };
        let mut renderer = Renderer::new(gpu, scene, &settings)?;
        let (t, _) = shortest(gpu, &mut renderer)?;
        // On the raster path surfaces are shaded as they are drawn, in the first pass.
        let pass = t.passes.iter().find(|p| p.0 == "shading").or(t.passes.first());
        let shading = pass.map_or(f64::NAN, |p| p.1);
        let what = if visibility == "published" { format!("{bands} bands") } else { visibility.into() };
        row(format!("{what:12} {:8} {shading:9.3} {:9.3}", name(path), t.total()));
    }
    Ok(())
}
