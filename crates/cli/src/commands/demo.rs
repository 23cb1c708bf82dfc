//! `steradian demo`: the first picture, from nothing but formulas.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::report::{answer_json, cell};
use clap::Args;
use glam::Vec3;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Instant;
use steradian_light::Lights;
use steradian_render::scenefile::SceneBackground;
use steradian_render::{Cell, Row, Settings, Sheet, ToneMapper};
use steradian_scene::Camera;
use steradian_session::compare::{Answer, Plan};
use steradian_session::{self as session, Material, Method, Renderer, check_output};

/// Options of `steradian demo`.
#[derive(Debug, Args)]
pub struct Options {
    /// The contact sheet
    #[arg(short, long, value_name = "OUT.png", default_value = "steradian-demo.png")]
    output: PathBuf,
    /// Side of each picture in pixels
    #[arg(long, value_name = "N", default_value_t = 160, value_parser = clap::value_parser!(u16).range(32..=2048))]
    size: u16,
}

/// One row of the sheet.
struct Scene {
    material: &'static str,
    place: &'static str,
    shape: &'static str,
    sky: &'static str,
    brdf: &'static str,
    /// Techniques beside the reference.
    techniques: &'static [&'static str],
    /// Where the camera stands as seen from the shape: azimuth from +X towards +Z and elevation, degrees.
    view: (f32, f32),
    /// Distance in bounding radii.
    distance: f32,
    /// Blur of the background, degrees.
    blur: f64,
    /// Exposure value on top of the automatic one.
    ev: f32,
}

impl Scene {
    fn methods(&self) -> Result<Vec<Method>, Failure> {
        Ok(self.techniques.iter().map(|slug| Method::find(slug)).collect::<Result<_, _>>()?)
    }
}

static SCENES: [Scene; 5] = [
    Scene {
        material: "clay",
        place: "clear sky",
        shape: "teapot",
        sky: "sky:elevation=38,azimuth=15,turbidity=2.5,ground=0.2/0.17/0.13",
        brdf: "lambert:albedo=0.65/0.4/0.28",
        techniques: &["sh_irradiance", "diffuse_map"],
        view: (75.0, 4.0),
        distance: 3.4,
        blur: 2.0,
        ev: 0.1,
    },
    Scene {
        material: "gold",
        place: "studio",
        shape: "knot",
        sky: "studio",
        brdf: "ggx:alpha=0.2,f0=1.0/0.77/0.34",
        techniques: &["split_sum", "shrm", "shrm_slices"],
        view: (75.0, 10.0),
        distance: 3.2,
        blur: 2.0,
        ev: 0.1,
    },
    Scene {
        material: "fibres",
        place: "clear sky",
        shape: "torus",
        sky: "sky:elevation=38,azimuth=15,turbidity=2.5,ground=0.2/0.17/0.13",
        brdf: "kajiya-kay:s=32,scale=0.6/0.4/0.25",
        techniques: &["shrm", "shrm_slices"],
        view: (75.0, 30.0),
        distance: 3.2,
        blur: 2.0,
        ev: 0.1,
    },
    Scene {
        material: "chrome",
        place: "evening sky",
        shape: "teapot",
        sky: "sky:elevation=7,azimuth=140,turbidity=4,ground=0.16/0.14/0.12",
        brdf: "ggx:alpha=0.04,f0=0.9/0.92/0.94",
        techniques: &["mirror_map", "split_sum"],
        view: (75.0, 4.0),
        distance: 3.4,
        blur: 2.0,
        ev: -0.2,
    },
    Scene {
        material: "blue gloss",
        place: "noon sky",
        shape: "torus",
        sky: "sky:elevation=62,azimuth=40,turbidity=2.5,ground=0.12/0.13/0.1",
        brdf: "phong:n=60,scale=1.2/2.9/9",
        techniques: &["phong_diffuse_maps"],
        view: (75.0, 14.0),
        distance: 3.2,
        blur: 2.0,
        ev: 0.0,
    },
];

/// Size of the skies' images.
const SKY_SIZE: (usize, usize) = (256, 128);
/// Relative error of the reference at each sample: below what eight bits show.
const TOLERANCE: f64 = 1e-2;

pub fn run(o: Options, context: &mut Context) -> Outcome {
    check_output(&o.output, &["png"])?;
    let start = Instant::now();
    let side = usize::from(o.size);
    let mut rows = Vec::new();
    for scene in &SCENES {
        context.say(format_args!("{} in {} …", scene.material, scene.place));
        let place = place(scene, side, context)?;
        let plan = Plan { reference_tolerance: TOLERANCE, ev: scene.ev };
        let answers = context.compare(&place, &scene.methods()?, &[Renderer::Cpu], &plan)?;
        rows.push((vec![scene.material.into(), scene.place.into()], answers));
    }
    context.write_display(&o.output, &sheet(&rows).draw(), Vec::new())?;
    finish(&o, &rows, start, context)
}

fn place(scene: &Scene, side: usize, context: &mut Context) -> Result<session::Scene, Failure> {
    let mesh = context.mesh(scene.shape)?;
    let (low, high) = mesh.bounds().ok_or_else(|| Failure::failed("a shape without triangles"))?;
    let (azimuth, elevation) = (scene.view.0.to_radians(), scene.view.1.to_radians());
    let away = Vec3::new(elevation.cos() * azimuth.cos(), elevation.sin(), elevation.cos() * azimuth.sin());
    let at = 0.5 * (low + high);
    let from = at + away * (0.5 * (high - low).length() * scene.distance);
    let materials = vec![Material::new(context.brdf(scene.brdf)?)];
    Ok(session::Scene {
        camera: Some(Camera::Pinhole { from, at, up: Vec3::Y, fov_y: 28f32.to_radians() }),
        settings: Settings::new(side, side),
        tone_mapper: ToneMapper::Aces,
        background: SceneBackground::Environment(scene.blur.to_radians()),
        ..session::Scene::new(mesh, materials, Lights::of_sky(scene.sky, SKY_SIZE)?)
    })
}

fn sheet(rows: &[(Vec<String>, Vec<Answer>)]) -> Sheet {
    let most = rows.iter().map(|r| r.1.len()).max().unwrap_or(1);
    let columns = vec![String::new(); most];
    let cells = |answers: &[Answer]| {
        let mut cells: Vec<_> = answers.iter().map(|a| cell(a, true)).collect();
        if cells.len() < most {
            cells.push(difference(answers));
        }
        cells.resize(most, None);
        cells
    };
    Sheet {
        title: "Steradian".into(),
        subtitle:
            "environment lighting of any reflectance: each technique beside the reference, with its error"
                .into(),
        columns,
        rows: rows
            .iter()
            .map(|(label, answers)| Row { label: label.clone(), cells: cells(answers) })
            .collect(),
        text_size: 14.0,
    }
}

/// Where the technique that comes nearest to the reference differs from it.
fn difference(answers: &[Answer]) -> Option<Cell> {
    let shown = answers.iter().filter_map(Answer::rendering);
    let shown = shown.filter_map(|r| Some((r, r.errors.as_ref()?.0.relative_rms)));
    let (nearest, _) = shown.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let caption = vec!["difference (FLIP)".into(), format!("of {}", nearest.label.replace('_', " "))];
    Some(Cell { picture: nearest.difference.clone()?, caption })
}

fn finish(o: &Options, rows: &[(Vec<String>, Vec<Answer>)], start: Instant, context: &Context) -> Outcome {
    let seconds = start.elapsed().as_secs_f64();
    if context.common.json {
        let scenes: Vec<Value> = rows
            .iter()
            .map(|(label, answers)| {
                json!({"scene": label.join(", "), "techniques": answers.iter().map(answer_json).collect::<Vec<_>>()})
            })
            .collect();
        let name = o.output.file_name().map(|n| n.to_string_lossy());
        return context.print_json(json!({"output": name, "seconds": seconds, "scenes": scenes}));
    }
    context.say(format_args!("{}: {} scenes in {seconds:.1} s", o.output.display(), rows.len()));
    if let Some((scene, slug)) = best(rows) {
        context.say(format_args!(
            "next: steradian render {} --environment {} --brdf {} --technique {slug} -o {}.png",
            scene.shape, scene.sky, scene.brdf, scene.shape
        ));
    }
    Ok(())
}

/// The second scene and the technique that comes nearest to the reference in it.
fn best(rows: &[(Vec<String>, Vec<Answer>)]) -> Option<(&'static Scene, &str)> {
    let (scene, (_, answers)) = SCENES.iter().zip(rows).nth(1)?;
    let nearest = answers.iter().filter_map(error_of).min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((scene, nearest.1))
}

/// A technique's error and name.
fn error_of(a: &Answer) -> Option<(f64, &str)> {
    let r = a.rendering()?;
    Some((r.errors.as_ref()?.0.relative_rms, r.label.as_str()))
}
