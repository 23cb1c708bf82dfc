//! The first picture, from nothing but formulas: one scene shaded as engines do, by this library, and by the
//! reference.

use crate::compare::{Answer, Plan, Rendering};
use crate::{Error, Material, Method, Renderer, Scene, Session, Shadows};
use glam::{Affine3A, Vec3};
use std::sync::Arc;
use steradian_light::Lights;
use steradian_render::scenefile::SceneBackground;
use steradian_render::{Cell, Row, Settings, Sheet, ToneMapper};
use steradian_scene::{Camera, Mesh};

/// A clear evening: the sun stands six degrees high, behind the object.
const SKY: &str = "sky:elevation=6,azimuth=190,turbidity=3,ground=0.2/0.18/0.16";
/// Size of the sky's image; the sun is a separate disk.
const SKY_SIZE: (usize, usize) = (256, 128);
/// Floor and object.
const MATERIALS: [&str; 2] = ["ggx:alpha=0.25,f0=0.5/0.52/0.55", "ggx:alpha=0.15,f0=1/0.77/0.34"];
/// A technique as in game engines, and one of this library; each with its panel's heading.
const TECHNIQUES: [(&str, &str); 2] =
    [("split_sum", "Split sum, as game engines shade"), ("shrm_slices", "Reflection map slices, Steradian")];
/// Tolerance of the reference at each sample. Its estimates are cautious: the errors themselves are below the
/// steps of eight bits ([`WITHIN`]).
const TOLERANCE: f64 = 3e-2;
/// Relative error that no pixel of the reference's picture exceeds, as a test measures it.
const WITHIN: f64 = 4e-3;

/// The demo, computed.
pub struct Demo {
    /// The reference's answer, then those of the techniques.
    pub answers: Vec<Answer>,
}

impl Session {
    /// Renders the demo in panels of `width` pixels.
    pub fn demo(&mut self, width: usize) -> Result<Demo, Error> {
        let scene = scene(width, self)?;
        let methods: Vec<Method> =
            TECHNIQUES.iter().map(|(slug, _)| Method::find(slug)).collect::<Result<_, _>>()?;
        // What the panels state are errors of the pictures.
        let plan = Plan { reference_tolerance: TOLERANCE, paths: false, ev: 0.0, certificates: false };
        let shadows = std::mem::replace(&mut self.shadows, Shadows::Lobe);
        self.common_shadows = Some(Arc::default());
        let answers = self.compared(&scene, &methods, &[Renderer::Cpu], &plan);
        (self.shadows, self.common_shadows) = (shadows, None);
        Ok(Demo { answers: answers? })
    }
}

impl Demo {
    /// The sheet of its panels.
    pub fn sheet(&self) -> Sheet {
        sheet(&self.answers)
    }

    /// A reflectance and a technique for it, to suggest as the next command.
    pub fn next(&self) -> (&'static str, &'static str) {
        (MATERIALS[1], TECHNIQUES[1].0)
    }
}

/// A gold knot on a floor of brushed metal, against the sun.
fn scene(width: usize, session: &mut Session) -> Result<Scene, Error> {
    let floor = session.mesh("plane:size=400")?.with_material(0);
    let object = session.mesh("knot")?;
    let (low, high) = object.bounds().ok_or_else(|| Error::failed("a shape without triangles"))?;
    // Its lowest point touches the floor.
    let scale = 0.8 / (high.y - low.y);
    let place = Affine3A::from_scale(Vec3::splat(scale)) * Affine3A::from_translation(Vec3::NEG_Y * low.y);
    let object = object.transformed(&place).with_material(1);
    let materials = MATERIALS.iter().map(|spec| Ok(Material::new(session.brdf(spec)?)));
    let materials = materials.collect::<Result<_, Error>>()?;
    let lights = Lights::of_sky(SKY, SKY_SIZE).map_err(|e| Error::failed(e.to_string()))?;
    let from = Vec3::new(4.2, 1.15, 0.9);
    Ok(Scene {
        camera: Some(Camera::Pinhole { from, at: Vec3::Y * 0.3, up: Vec3::Y, fov_y: 24f32.to_radians() }),
        settings: Settings { interpolate: true, ..Settings::new(width, width * 9 / 16) },
        tone_mapper: ToneMapper::Aces,
        background: SceneBackground::Environment(0.0),
        ..Scene::new(Mesh::merged(&[floor, object]), materials, lights)
    })
}

/// Practice, ours, the truth.
fn sheet(answers: &[Answer]) -> Sheet {
    let [reference, techniques @ ..] = answers else { return Sheet::default() };
    let mut cells: Vec<Option<Cell>> = techniques
        .iter()
        .zip(TECHNIQUES)
        .map(|(a, (_, heading))| Some(panel(a.rendering()?, heading.into())))
        .collect();
    cells.push(reference.rendering().map(|r| panel(r, "The lighting integral itself".into())));
    Sheet {
        title: "Steradian".into(),
        subtitle: "Any reflectance under any environment, prefiltered: a GGX floor of α = 0.25 and gold of α = 0.15 under \
                   an unclipped sun six degrees high; shadows by the same rays in all"
            .into(),
        columns: vec![String::new(); cells.len()],
        rows: vec![Row { label: Vec::new(), cells }],
        text_size: 17.0,
    }
}

fn panel(r: &Rendering, heading: String) -> Cell {
    let number = match &r.errors {
        Some((e, _)) => format!("{:.2} stops off in the mean", e.stops),
        None => format!("adaptive quadrature, within {} %", 100.0 * WITHIN),
    };
    Cell { picture: r.picture.clone(), caption: vec![heading, number] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_is_as_close_as_its_panel_says() {
        let mut session = Session::default();
        let scene = scene(64, &mut session).expect("the demo's scene");
        let case = session.subject(&scene, scene.camera.expect("given")).expect("a subject");
        let [rough, fine] = [TOLERANCE, 1e-4].map(|reference_tolerance| {
            let plan = Plan { reference_tolerance, paths: false, ev: 0.0, certificates: false };
            session.true_picture(&case, &plan).expect("a picture").0.film
        });
        let mut worst = 0.0_f32;
        for i in (0..fine.alpha.len()).filter(|i| fine.alpha[*i] > 0.999) {
            let [a, b] = [&rough, &fine].map(|film| [0, 1, 2].map(|c| film.rgb[c][i]));
            let top = b.into_iter().fold(0.0, f32::max);
            worst = (0..3).map(|c| (a[c] - b[c]).abs() / top).fold(worst, f32::max);
        }
        assert!(worst > 0.1 * WITHIN as f32 && worst <= WITHIN as f32, "{worst}");
    }
}
