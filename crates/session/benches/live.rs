//! Measures how long a window waits for a change: first milliseconds of [`Session::live`] to the rebaked
//! scene, for techniques that need no sites of a mesh, under an image of 2048 × 1024 texels, including the
//! time that its file takes; then milliseconds of pictures under a sun that moves with each of them.
//!
//!     cargo bench -p steradian-session --features gpu --bench live
//!     cargo bench -p steradian-session --features gpu --bench live -- split_sum shrm
//!     cargo bench -p steradian-session --features gpu --bench live -- sky split_sum prt_diffuse     the latter alone
#![allow(clippy::print_stdout)]

use glam::Mat3;
use std::path::Path;
use std::time::Instant;
use steradian_formats::{Raster, WriteOptions, write_image};
use steradian_gpu::scene::Settings;
use steradian_gpu::{Gpu, Renderer as GpuRenderer};
use steradian_light::Lights;
use steradian_session::live::{Following, Live, MovingSky, Names, Turned, rotation};
use steradian_session::{Adjust, Error, Material, Method, Scene, Session};

const FIRST: &str = "ggx:alpha=0.2,f0=1/0.77/0.34";
const SECOND: &str = "ggx:alpha=0.3,f0=1/0.77/0.34";

/// Milliseconds that [`Session::live`] takes for a scene of these materials and lights.
fn time(session: &Session, scene: &Scene, light: &str, before: Option<&Live>) -> Result<(f64, Live), Error> {
    let names = Names { mesh: "teapot".into(), light: light.into() };
    let start = Instant::now();
    let live = session.live(scene, names, before)?;
    Ok((1e3 * start.elapsed().as_secs_f64(), live))
}

/// Milliseconds that [`Session::preview`] takes for the same arguments.
fn preview(session: &Session, scene: &Scene, light: &str, before: &Live) -> Result<f64, Error> {
    let names = Names { mesh: "teapot".into(), light: light.into() };
    let start = Instant::now();
    let live = session.preview(scene, names, before)?;
    Ok(live.map_or(f64::NAN, |_| 1e3 * start.elapsed().as_secs_f64()))
}

fn main() -> Result<(), Error> {
    let mut asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let all = asked.len();
    asked.retain(|a| a != "sky");
    if asked.len() == all {
        rebakes(&asked)?;
    }
    match Gpu::open() {
        Ok(gpu) => moving(&gpu, &asked),
        Err(e) => {
            println!("a moving sky was not measured: {e}");
            Ok(())
        }
    }
}

/// Size of the pictures under a moving sun.
const SIZE: [usize; 2] = [640, 400];
/// Number of steps of the sun.
const STEPS: usize = 12;

/// The sky of step `k`.
fn sky(k: usize) -> String {
    format!("sky:elevation={},azimuth={}", 20 + 2 * k, 40 + 5 * k)
}

/// A scene with its renderer, as a window in motion has it.
struct Drawn {
    live: Live,
    renderer: GpuRenderer,
}

impl Drawn {
    fn new(gpu: &Gpu, live: Live) -> Result<Self, Error> {
        let scene = live.gpu(live.camera(), SIZE[1], Mat3::IDENTITY);
        let settings = Settings::interactive(SIZE[0], SIZE[1], gpu.preferred_path());
        let mut renderer = GpuRenderer::new(gpu, scene, &settings)?;
        renderer.render(gpu)?;
        Ok(Self { live, renderer })
    }

    /// A picture under the light turned by a few degrees.
    fn turn(&mut self, gpu: &Gpu) -> Result<(), Error> {
        let rotation = rotation(5.0);
        self.renderer.set_light_rotation(gpu, rotation);
        for (k, turned) in self.live.turned(self.live.camera(), rotation).into_iter().enumerate() {
            match turned {
                Turned::Uniforms(u) => self.renderer.update_uniforms(gpu, k, &u)?,
                Turned::Technique(t) => self.renderer.set_technique(gpu, k, *t)?,
            }
        }
        self.renderer.render(gpu)?;
        Ok(())
    }

    /// A bake in place of the one before.
    fn replace(&mut self, gpu: &Gpu, live: Live) -> Result<(), Error> {
        let scene = live.gpu(live.camera(), SIZE[1], Mat3::IDENTITY);
        self.renderer.set_direct(gpu, scene.direct)?;
        for (k, object) in scene.objects.into_iter().enumerate() {
            self.renderer.set_technique(gpu, k, object.technique)?;
        }
        self.renderer.set_backdrop(gpu, scene.backdrop)?;
        self.renderer.render(gpu)?;
        self.live = live;
        Ok(())
    }
}

/// Mean and largest.
fn summary(ms: &[f64]) -> String {
    let mean = ms.iter().sum::<f64>() / ms.len().max(1) as f64;
    format!("{mean:6.0} {:6.0}", ms.iter().copied().fold(0.0, f64::max))
}

/// Milliseconds from a moved sun to the picture under it: by preview bakes, and by filters on the GPU, for
/// which the picture never waits.
fn moving(gpu: &Gpu, asked: &[String]) -> Result<(), Error> {
    println!(
        "\nmilliseconds a picture of {} x {} under a sun that moves, mean and largest",
        SIZE[0], SIZE[1]
    );
    println!("{}", gpu.describe());
    println!(
        "{:26} {:>9} {:>9} {:>13} {:>15} {:>16} {:>9}",
        "technique", "standing", "turned", "by previews", "filtered, 8 ms", "pictures behind", "at once"
    );
    let mut session = Session::new();
    for t in steradian_techniques::registry() {
        let card = t.card();
        if card.needs.view || !(asked.is_empty() || asked.iter().any(|a| a == card.slug)) {
            continue;
        }
        let takes = |spec: &&&str| session.brdf(spec).is_ok_and(|b| (card.materials)(&*b).is_ok());
        let Some(spec) = [FIRST, "lambert:albedo=0.5", "phong:n=40"].iter().find(takes).copied() else {
            continue;
        };
        let material = Material::new(session.brdf(spec)?).with(Method::Technique(*t));
        let mut scene = Scene::of("teapot", Some(spec), "studio", &mut session)?;
        scene.materials = vec![material];
        let mut at = |k: usize| -> Result<(Scene, Names), Error> {
            scene.lights = session_light(k)?;
            Ok((scene.clone(), Names { mesh: "teapot".into(), light: sky(k) }))
        };
        let (first, names) = at(0)?;
        let live = session.live(&first, names, None)?;
        let mut shown = Drawn::new(gpu, live)?;
        let start = Instant::now();
        shown.renderer.render(gpu)?;
        let standing = 1e3 * start.elapsed().as_secs_f64();
        let start = Instant::now();
        shown.turn(gpu)?;
        let turned = 1e3 * start.elapsed().as_secs_f64();
        let mut previews = Vec::new();
        for k in 1..=STEPS {
            let start = Instant::now();
            let (next, names) = at(k)?;
            let Some(live) = session.preview(&next, names, &shown.live)? else { break };
            shown.replace(gpu, live)?;
            previews.push(1e3 * start.elapsed().as_secs_f64());
        }
        print!("{:26} {standing:9.0} {turned:9.0} {:>13}", card.slug, summary(&previews));
        match filtered(gpu, &mut shown)? {
            Some((ms, behind, at_once)) => println!(" {:>15} {behind:16} {at_once:9.0}", summary(&ms)),
            None => println!(" {:>15}", "not filtered"),
        }
    }
    Ok(())
}

/// The lights of step `k` at the resolution of previews.
fn session_light(k: usize) -> Result<Lights, Error> {
    Lights::of_sky(&sky(k), (256, 128)).map_err(Error::usage)
}

/// Measures pictures that leave 8 ms to the filters: their milliseconds, the largest number of pictures by
/// which the light lags, and the milliseconds of a picture that waits for the light.
fn filtered(gpu: &Gpu, shown: &mut Drawn) -> Result<Option<(Vec<f64>, usize, f64)>, Error> {
    if shown.live.light_tables().is_err() {
        return Ok(None);
    }
    let mut following = Following::new(gpu, &shown.live)?;
    let place = (shown.live.camera(), SIZE[1]);
    let (mut ms, mut behind, mut late) = (Vec::new(), 0, 0);
    let mut k = 0;
    // The speed of the device is measured on the first pictures.
    while k < 4 * STEPS || following.is_busy() {
        let start = Instant::now();
        if k < 4 * STEPS {
            let sky = MovingSky::new(gpu, &sky(k % STEPS))?;
            following.set_sky(gpu, &mut shown.renderer, &shown.live, &sky, place)?;
        }
        late = if following.step(gpu, &shown.renderer, 8.0, Mat3::IDENTITY)? { 0 } else { late + 1 };
        shown.renderer.render(gpu)?;
        if k >= STEPS {
            ms.push(1e3 * start.elapsed().as_secs_f64());
            behind = behind.max(late);
        }
        k += 1;
    }
    let start = Instant::now();
    let sky = MovingSky::new(gpu, &sky(0))?;
    following.set_sky(gpu, &mut shown.renderer, &shown.live, &sky, place)?;
    while following.is_busy() {
        following.step(gpu, &shown.renderer, f64::INFINITY, Mat3::IDENTITY)?;
    }
    shown.renderer.render(gpu)?;
    Ok(Some((ms, behind, 1e3 * start.elapsed().as_secs_f64())))
}

/// A sky as an OpenEXR file of 2048 × 1024 texels.
fn image_2k(folder: &Path) -> Result<String, Error> {
    let failed = |e: String| Error::failed(e);
    let sky = Lights::of_sky("sky:elevation=30", (2048, 1024)).map_err(|e| failed(e.to_string()))?;
    let image = &sky.environment.as_ref().ok_or_else(|| failed("no sky".into()))?.image;
    let path = folder.join("sky.exr");
    let raster = Raster::rgb(image.width, image.height, image.planes.clone());
    write_image(&path, &raster, &WriteOptions::default()).map_err(|e| failed(e.to_string()))?;
    Ok(path.display().to_string())
}

/// Milliseconds until scenes are baked.
fn rebakes(asked: &[String]) -> Result<(), Error> {
    let mut session = Session::new();
    let (first, second) = (session.brdf(FIRST)?, session.brdf(SECOND)?);
    let (sky, studio) =
        (session.light("sky", &Adjust::default())?, session.light("studio", &Adjust::default())?);
    let mut scene = Scene::of("teapot", Some(FIRST), "studio", &mut session)?;
    let folder = tempfile::tempdir().map_err(|e| Error::failed(e.to_string()))?;
    let image = image_2k(folder.path())?;
    println!("milliseconds until the scene is baked; lights of 1024 x 512 texels, and a file of 2048 x 1024");
    println!(
        "{:26} {:>9} {:>11} {:>9} {:>14} {:>9} {:>9} {:>9} {:>9}",
        "technique", "at first", "other alpha", "preview", "other light", "preview", "again", "2k", "preview"
    );
    for t in steradian_techniques::registry() {
        let card = t.card();
        if card.needs.sites
            || (card.materials)(&*first).is_err()
            || !(asked.is_empty() || asked.iter().any(|a| a == card.slug))
        {
            continue;
        }
        scene.materials = vec![Material::new(first.clone()).with(Method::Technique(*t))];
        scene.lights = studio.clone();
        let (cold, a) = time(&session, &scene, "studio", None)?;
        scene.materials = vec![Material::new(second.clone()).with(Method::Technique(*t))];
        let early = preview(&session, &scene, "studio", &a)?;
        let (alpha, b) = time(&session, &scene, "studio", Some(&a))?;
        scene.lights = sky.clone();
        let early_light = preview(&session, &scene, "sky", &b)?;
        let (light, c) = time(&session, &scene, "sky", Some(&b))?;
        let (again, _) = time(&session, &scene, "sky", Some(&c))?;
        let start = Instant::now();
        scene.lights = session.light(&image, &Adjust::default())?;
        let read = 1e3 * start.elapsed().as_secs_f64();
        let early_2k = read + preview(&session, &scene, "2k", &c)?;
        let (baked, _) = time(&session, &scene, "2k", Some(&c))?;
        let at_2k = read + baked;
        println!(
            "{:26} {cold:9.0} {alpha:11.0} {early:9.0} {light:14.0} {early_light:9.0} {again:9.1} {at_2k:9.0} {early_2k:9.0}",
            card.slug
        );
    }
    Ok(())
}
