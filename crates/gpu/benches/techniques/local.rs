//! Techniques for local light: milliseconds of every further light at 1920 × 1080.

use super::{common, name, shortest};
use glam::{DVec3, Vec3};
use std::sync::Arc;
use steradian_base::{ParamValues, Task};
use steradian_gpu::scene::Settings;
use steradian_gpu::{Gpu, Renderer};
use steradian_light::PointLight;
use steradian_sphere::Frame;
use steradian_techniques::local::{LocalFrame, LocalLights};
use steradian_techniques::shared::trials::specimens;
use steradian_techniques::{Geometry, Sites, View, locals};

/// `count` lights around the object, not all on one side of it.
fn lights(count: usize) -> LocalLights {
    let place = |k: usize| {
        let d = steradian_prefilter::probe::direction(k, count.max(2));
        Frame::from_normal(DVec3::Y).to_world(d).as_vec3() * 2.5
    };
    let points = (0..count).map(|k| PointLight { position: place(k), intensity: [4.0; 3] }).collect();
    LocalLights { points, ..LocalLights::default() }
}

/// The lights of the two pictures that are compared.
const COUNTS: [usize; 2] = [1, 9];

pub fn measure(gpu: &Gpu, (width, height): (usize, usize)) -> Result<(), Box<dyn std::error::Error>> {
    println!(
        "\nlocal light: GPU ms at {width} x {height}, four samples a pixel, shaded once a pixel and triangle\n\
         {:23} {:8} {:>9} {:>9} {:>9}   reflectance",
        "technique", "path", "1 light", "9 lights", "a light"
    );
    let case = common::case(1, height);
    let geometry = Geometry::new(Arc::new(case.mesh.0.clone()), Sites::Vertices);
    for t in locals() {
        let spec = t.card().specimens[0];
        let material = specimens::material(steradian_brdf::parse(spec)?, t.planes());
        let bake = match t.bake(&material, Some(&geometry), &ParamValues::default(), &Task::quiet()) {
            Ok(bake) => bake,
            Err(e) => {
                println!("{:23} not measured: {e}", t.card().slug);
                continue;
            }
        };
        for path in super::PATHS {
            let mut ms = [f64::NAN; 2];
            for (ms, count) in ms.iter_mut().zip(COUNTS) {
                let (lights, view) = (lights(count), View { eye: Vec3::Z * 3.0, ..common::view(&case) });
                let frame =
                    LocalFrame { lights: &lights, view: &view, mesh: Some(&geometry.mesh), shadowed: false };
                let technique = bake.lit(&frame)?.gpu().ok_or("no text for GPUs")?;
                let settings = Settings::interactive(width, height, path);
                let mut renderer = Renderer::new(gpu, common::scene(&case, technique), &settings)?;
                *ms = shortest(gpu, &mut renderer)?.0.total();
            }
            let each = (ms[1] - ms[0]) / (COUNTS[1] - COUNTS[0]) as f64;
            println!("{:23} {:8} {:9.3} {:9.3} {each:9.4}   {spec}", t.card().slug, name(path), ms[0], ms[1]);
        }
    }
    Ok(())
}
