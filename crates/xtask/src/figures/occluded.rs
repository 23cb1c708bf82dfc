//! Figures 5, 6 and 7 of Green, Kautz & Durand 2007, *Efficient Reflectance and Visibility Approximations for
//! Environment Map Rendering*: what visibility outside the integral errs by, and materials, on a bunny that
//! stands on a plate.
//!
//! The truth is light that arrives straight, with shadows, reflected by the very lobes that are shaded, by
//! paths: what is told is the error of visibility, beside that of the filtered light, and none of the fit.
//! Pictures compare by the relative RMS error of radiance and by FLIP, both over the pixels of the object.

use super::{Options, light, mesh, percent, save, say};
use anyhow::{Context, Result, anyhow};
use std::sync::Arc;
use steradian_base::{ParamValues, Task};
use steradian_brdf::fit::gaussian::{GaussianFit, GaussianLobe, Plan};
use steradian_brdf::model::lobes::Lobes;
use steradian_brdf::{SharedBrdf, parse};
use steradian_light::Lights;
use steradian_render::metrics::{DEFAULT_PPD, flip_displays};
use steradian_render::tone::auto_exposure;
use steradian_render::{
    Background, BakeShader, Cell, Develop, Display, Errors, Film, Row, Settings, Sheet, Stage, Surface,
    SurfaceMaps, ToneMapper, errors, render,
};
use steradian_scene::{Bvh, Camera, Framing, Mesh};
use steradian_session::{Method, Paths, Scene, Session};
use steradian_techniques::shared::trials::lights::furnace;
use steradian_techniques::{AnyBake, Geometry, Material, Sites, View, find};
use steradian_transfer::{Refinement, refine};

/// Five materials between matte and mirror-like, of the published fits to MERL's measurements.
const FIVE: [&str; 5] = [
    "sgd:green-metallic-paint",
    "sgd:blue-acrylic",
    "sgd:gold-metallic-paint",
    "sgd:nickel",
    "sgd:red-metallic-paint",
];
/// What is done about visibility: name, `visibility`, `visibility_bands`.
const TREATMENTS: [(&str, &str, f64); 8] = [
    ("none", "none", 4.0),
    ("ambient", "ambient", 4.0),
    ("at the mean, 2", "published", 2.0),
    ("at the mean, 3", "published", 3.0),
    ("at the mean, 4", "published", 4.0),
    ("over the lobe, 2", "convolved", 2.0),
    ("over the lobe, 3", "convolved", 3.0),
    ("over the lobe, 4", "convolved", 4.0),
];
/// The treatment of the paper's pictures, and of ours.
const FOUR: [usize; 2] = [4, 7];
/// Widths of the lobes of figure 5, degrees.
const WIDTHS: [f64; 5] = [2.0, 5.0, 10.0, 20.0, 40.0];
/// Pixels a side.
const SIDE: usize = 176;
/// Noise of paths, relative.
const NOISE: f64 = 0.02;
/// Error of the coefficients of visibility.
const PRECISION: f64 = 0.015;
/// The light.
const LIGHT: &str = "environments/latlong/probulator_ennis.hdr";

/// What stands there, and who looks at it.
struct Stand {
    mesh: Arc<Mesh>,
    bvh: Bvh,
    camera: Camera,
    settings: Settings,
    light: String,
    lights: Lights,
}

impl Stand {
    fn new(o: &Options) -> Result<Self> {
        let mesh = mesh::bunny()?;
        let task = Task::quiet();
        let mesh =
            refine(&mesh, None, None, &Refinement { coarsest: 1.0 / 24.0, ..Refinement::default() }, &task)?;
        let camera = Framing { share: 0.98, elevation: 0.35, ..Framing::default() };
        let camera = camera.camera(&mesh.positions).context("an empty mesh")?;
        let (light, lights) = light::of(o, LIGHT)?;
        let side = o.side.unwrap_or(SIDE);
        let bvh = Bvh::build(&mesh);
        let settings = Settings::new(side, side);
        Ok(Self { mesh: Arc::new(mesh), bvh, camera, settings, light, lights })
    }

    /// A bake under a treatment of visibility.
    fn bake(&self, brdf: &SharedBrdf, treatment: usize, lights: &Lights) -> Result<Box<dyn AnyBake>> {
        let technique = find("gaussian_lobes").context("no technique gaussian_lobes")?;
        let (_, visibility, bands) = TREATMENTS[treatment];
        let mut values: ParamValues =
            [("visibility_bands", bands), ("precision", PRECISION)].into_iter().collect();
        values.0.insert("visibility".into(), visibility.into());
        let geometry =
            technique.needs_sites(&values).then(|| Geometry::new(self.mesh.clone(), Sites::Vertices));
        let material = Material::new(brdf.clone());
        technique
            .bake(lights, &material, geometry.as_ref(), &values, &Task::quiet())
            .map_err(|e| anyhow!("{e}"))
    }

    /// The picture of a bake of another reflectance, without a certificate: it is held against the truth
    /// here.
    fn film(&self, bake: &dyn AnyBake, brdf: &SharedBrdf) -> Result<Film> {
        let material = Material::new(brdf.clone());
        let mut bake = bake.preview(None, Some(&material), &Task::quiet()).map_err(|e| anyhow!("{e}"))?;
        let (Camera::Pinhole { from, .. } | Camera::Orthographic { from, .. }) = self.camera;
        bake.frame(&View { eye: from, forward: self.camera.axes()[2], ..View::default() });
        let shader = Arc::new(BakeShader(bake));
        let surfaces = [Surface { shader, base_colour: None, maps: SurfaceMaps::default() }];
        let stage = Stage {
            mesh: &self.mesh,
            bvh: &self.bvh,
            surfaces: &surfaces,
            background: &Background::Colour([0.0; 3]),
            camera: self.camera,
        };
        Ok(render(&stage, &self.settings, &Task::quiet())?)
    }

    /// The picture by paths of so many scattering events.
    fn traced(&self, brdf: &SharedBrdf, bounces: u32) -> Result<Film> {
        let material = steradian_session::Material::new(brdf.clone()).with(Method::Path);
        let mut scene = Scene::new((*self.mesh).clone(), vec![material], self.lights.clone());
        (scene.camera, scene.settings) = (Some(self.camera), self.settings);
        let mut session = Session::new();
        session.paths = Paths { bounces, noise: NOISE };
        let mut film = session.render(&scene)?.even_if_missed().0.film;
        // Behind the object the light is seen, and of the object's edges a part.
        for (i, alpha) in film.alpha.iter().enumerate() {
            film.rgb.iter_mut().for_each(|p| p[i] *= if *alpha < 1.0 { 0.0 } else { 1.0 });
        }
        Ok(film)
    }
}

/// A reference and how pictures of it are shown.
struct Truth {
    truth: Film,
    display: Display,
    develop: Develop,
}

impl Truth {
    fn new(truth: Film) -> Self {
        let ev = auto_exposure(&truth, |i| truth.alpha[i]);
        let develop = Develop { ev, mapper: ToneMapper::Aces };
        Self { display: develop.film(&truth), truth, develop }
    }

    fn covered(&self, i: usize) -> bool {
        self.truth.alpha[i] >= 1.0
    }

    /// Relative RMS error, and FLIP in the mean of the object's pixels.
    fn of(&self, film: &Film) -> (Errors, f64) {
        let mut shown = film.clone();
        for i in 0..film.len() {
            if !self.covered(i) {
                shown.rgb.iter_mut().for_each(|p| p[i] = 0.0);
            }
        }
        let map = flip_displays(&self.display, &self.develop.film(&shown), DEFAULT_PPD).map;
        let (mut sum, mut count) = (0.0, 0.0);
        for (_, d) in map.iter().enumerate().filter(|(i, _)| self.covered(*i)) {
            sum += f64::from(*d);
            count += 1.0;
        }
        (errors(film, &self.truth, |i| self.covered(i)), sum / f64::max(count, 1.0))
    }

    fn cell(&self, film: &Film, caption: Vec<String>) -> Option<Cell> {
        Some(Cell { picture: self.develop.film(film), caption })
    }
}

fn plus(a: &Film, b: &Film) -> Film {
    let mut sum = a.clone();
    for (to, from) in sum.rgb.iter_mut().zip(&b.rgb) {
        to.iter_mut().zip(from).for_each(|(x, y)| *x += y);
    }
    sum
}

fn lobes(fit: GaussianFit) -> SharedBrdf {
    Arc::new(Lobes::new("lobes:fit".into(), fit))
}

/// The glossy and the diffuse part of a fit.
fn parts(fit: &GaussianFit) -> [SharedBrdf; 2] {
    let (mut glossy, mut diffuse) = (fit.clone(), fit.clone());
    glossy.diffuse = [0.0; 3];
    diffuse.views.iter_mut().flatten().for_each(|l| l.weight = [0.0; 3]);
    [lobes(glossy), lobes(diffuse)]
}

fn caption((e, flip): &(Errors, f64)) -> Vec<String> {
    vec![format!("FLIP {flip:.3}"), format!("RMS {}", percent(e.relative_rms))]
}

/// Figure 5: the error by the width of a lobe, and what reflections between surfaces add.
pub fn widths(o: &Options) -> Result<()> {
    let stand = Stand::new(o)?;
    let bakes = bakes(&stand)?;
    say(&format!(
        "GKD07 figure 5: a bunny on a plate under {}, one round lobe of weight 1; relative RMS error, FLIP; {} vertices",
        stand.light,
        stand.mesh.positions.len()
    ));
    let head: Vec<String> = TREATMENTS.iter().map(|t| format!("{:>17}", t.0)).collect();
    say(&format!("{:>5} {} {:>17}", "sigma", head.join(" "), "four reflections"));
    let mut rows = Vec::new();
    for degrees in WIDTHS {
        let lobe = GaussianLobe { sigma: degrees.to_radians(), weight: [1.0; 3], ..GaussianLobe::default() };
        let fit = GaussianFit::isotropic([0.0; 3], vec![vec![lobe]; 2]);
        let brdf = lobes(fit);
        let truth = Truth::new(stand.traced(&brdf, 1)?);
        let films: Vec<Film> = bakes.iter().map(|b| stand.film(&**b, &brdf)).collect::<Result<_>>()?;
        let mut all: Vec<(Errors, f64)> = films.iter().map(|f| truth.of(f)).collect();
        all.push(truth.of(&stand.traced(&brdf, 4)?));
        let text = |(e, flip): &(Errors, f64)| format!("{:>9} {flip:>7.4}", percent(e.relative_rms));
        say(&format!("{degrees:>4}° {}", all.iter().map(text).collect::<Vec<_>>().join(" ")));
        let mut cells = vec![truth.cell(&truth.truth, vec!["by paths".into()])];
        for k in [0, 1, FOUR[0], FOUR[1]] {
            cells.push(truth.cell(&films[k], caption(&all[k])));
        }
        let [open, seen] = [0, FOUR[1]].map(|k| even(&*bakes[k]));
        let (open, seen) = (open?, seen?);
        cells.push(weights(&stand.film(&*seen, &brdf)?, &stand.film(&*open, &brdf)?));
        rows.push(Row { label: vec![format!("{degrees}°")], cells });
    }
    let columns = [
        "direct light by paths",
        "none",
        "ambient",
        "4 bands, at the mean",
        "4 bands, over the lobe",
        "its visibility",
    ];
    let sheet = Sheet {
        title: "Visibility outside the integral, by the width of the lobe".into(),
        subtitle: format!("under {}; differences from direct light with shadows", stand.light),
        columns: columns.map(String::from).into(),
        rows,
        text_size: 12.5,
    };
    save(o, "gkd07-5.png", &sheet.draw())
}

/// A bake under constant light.
fn even(bake: &dyn AnyBake) -> Result<Box<dyn AnyBake>> {
    bake.preview(Some(&furnace()), None, &Task::quiet()).map_err(|e| anyhow!("{e}"))
}

/// What lobes see, as a picture: under constant light, what is shaded over what is shaded without visibility.
fn weights(seen: &Film, open: &Film) -> Option<Cell> {
    let mut film = seen.clone();
    for c in 0..3 {
        for (x, o) in film.rgb[c].iter_mut().zip(&open.rgb[c]) {
            *x = if *o > 0.0 { *x / o } else { 0.0 };
        }
    }
    let picture = Develop { ev: 0.0, mapper: ToneMapper::Linear }.film(&film);
    Some(Cell { picture, caption: vec!["weights".into()] })
}

/// A bake under every treatment, of any material.
fn bakes(stand: &Stand) -> Result<Vec<Box<dyn AnyBake>>> {
    let brdf = parse("lambert")?;
    (0..TREATMENTS.len()).map(|k| stand.bake(&brdf, k, &stand.lights)).collect()
}

/// The materials' specs.
fn specs(o: &Options) -> Vec<String> {
    if o.brdfs.is_empty() { FIVE.map(String::from).into() } else { o.brdfs.clone() }
}

fn name(spec: &str) -> String {
    spec.rsplit([',', ':']).next().unwrap_or(spec).to_owned()
}

/// Figure 6: materials.
pub fn materials(o: &Options) -> Result<()> {
    let stand = Stand::new(o)?;
    let bake = stand.bake(&parse("lambert")?, FOUR[1], &stand.lights)?;
    let (mut columns, mut cells) = (Vec::new(), Vec::new());
    for spec in specs(o) {
        let fit = GaussianFit::new(&*parse(&spec)?, Plan::default(), &Task::quiet())?;
        let (bytes, film) = (fit.bytes(), stand.film(&*bake, &lobes(fit))?);
        let ev = auto_exposure(&film, |i| film.alpha[i]);
        let picture = Develop { ev, mapper: ToneMapper::Aces }.film(&film);
        say(&format!("GKD07 figure 6: {spec}: {bytes} bytes"));
        columns.push(name(&spec));
        cells.push(Some(Cell { picture, caption: vec![format!("{bytes} bytes")] }));
    }
    let sheet = Sheet {
        title: "Materials of a kilobyte".into(),
        subtitle: format!(
            "under {}; K = 3, N = 15, stretched lobes, visibility of 4 bands over the lobe",
            stand.light
        ),
        columns,
        rows: vec![Row { label: Vec::new(), cells }],
        text_size: 12.5,
    };
    save(o, "gkd07-6.png", &sheet.draw())
}

/// Figure 7, and a question of Kautz's course notes: do glossy reflections need self-shadowing? The diffuse
/// part is shadowed alike in all pictures: only the glossy one's visibility differs.
pub fn shadows(o: &Options) -> Result<()> {
    let stand = Stand::new(o)?;
    let bakes = bakes(&stand)?;
    say(&format!(
        "GKD07 figure 7: a bunny on a plate under {}; relative RMS error, FLIP; the diffuse part shadowed in all",
        stand.light
    ));
    let head: Vec<String> = TREATMENTS.iter().map(|t| format!("{:>17}", t.0)).collect();
    say(&format!("{:<22} {} {:>8}", "material", head.join(" "), "glossy"));
    let mut rows = Vec::new();
    for spec in specs(o) {
        let brdf = parse(&spec)?;
        let fit = GaussianFit::new(&*brdf, Plan::default(), &Task::quiet())?;
        let [glossy, diffuse] = parts(&fit);
        let whole = lobes(fit);
        let truth = Truth::new(stand.traced(&whole, 1)?);
        let matte = stand.film(&*bakes[FOUR[1]], &diffuse)?;
        let shiny: Vec<Film> = bakes.iter().map(|b| stand.film(&**b, &glossy)).collect::<Result<_>>()?;
        let films: Vec<Film> = shiny.iter().map(|f| plus(f, &matte)).collect();
        let all: Vec<(Errors, f64)> = films.iter().map(|f| truth.of(f)).collect();
        let total = |f: &Film| -> f64 { f.rgb.iter().flatten().map(|x| f64::from(*x)).sum() };
        let share = total(&shiny[FOUR[1]]) / total(&films[FOUR[1]]).max(f64::MIN_POSITIVE);
        let text = |(e, flip): &(Errors, f64)| format!("{:>9} {flip:>7.4}", percent(e.relative_rms));
        let line: Vec<String> = all.iter().map(text).collect();
        say(&format!("{:<22} {} {:>8}", name(&spec), line.join(" "), percent(share)));
        let mut cells = vec![truth.cell(&truth.truth, vec!["by paths".into()])];
        for k in [0, 1, 5, 6, 7] {
            cells.push(truth.cell(&films[k], caption(&all[k])));
        }
        for k in [1, FOUR[1]] {
            let at = |b: &dyn AnyBake| stand.film(&*even(b)?, &glossy);
            cells.push(weights(&at(&*bakes[k])?, &at(&*bakes[0])?));
        }
        rows.push(Row { label: vec![name(&spec)], cells });
    }
    let columns =
        ["direct light by paths", "none", "ambient", "2 bands", "3 bands", "4 bands", "ambient", "4 bands"];
    let sheet = Sheet {
        title: "Do glossy reflections need self-shadowing?".into(),
        subtitle: format!(
            "under {}; visibility over the lobe; the diffuse part is shadowed in all; right: weights of the glossy part",
            stand.light
        ),
        columns: columns.map(String::from).into(),
        rows,
        text_size: 12.5,
    };
    save(o, "gkd07-7.png", &sheet.draw())
}
