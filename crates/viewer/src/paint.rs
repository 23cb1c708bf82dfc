//! Pictures of a live scene, by a GPU, developed for a display.

use crate::Error;
use glam::Mat3;
use std::sync::Arc;
use std::time::Instant;
use steradian_gpu::scene::{Path, Rate, Settings};
use steradian_gpu::{Gpu, GpuError, Renderer};
use steradian_render::metrics::difference_picture;
use steradian_render::tone::luminance;
use steradian_render::{Develop, Display, Film, ToneMapper};
use steradian_scene::Camera;
use steradian_session::auto_exposure;
use steradian_session::live::{Following, Live, MovingSky, Truth, Turned, rotation};

/// How radiance is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DisplayMode {
    /// Exposed and tone-mapped.
    #[default]
    Picture,
    /// Luminance in stops about the middle grey of 0.18 after exposure, from [`FALSE_COLOUR`] below to as
    /// many above.
    FalseColour,
    /// FLIP to the reference's picture.
    Heat,
}

/// Stops on either side of middle grey that false colours show.
pub const FALSE_COLOUR: f32 = 6.0;

/// What is to be drawn.
#[derive(Clone)]
pub struct View {
    /// One scene, or the two sides of a comparison.
    pub sides: Vec<Arc<Live>>,
    /// From where.
    pub camera: Camera,
    /// Rotation of the light about +Y, degrees.
    pub turn: f64,
    /// Pixels.
    pub size: [usize; 2],
    /// Exposure in stops; `None` is automatic, of the first side.
    pub exposure: Option<f32>,
    /// Tone mapper.
    pub mapper: ToneMapper,
    /// How radiance is shown.
    pub mode: DisplayMode,
    /// What the heat map and the numbers are made against.
    pub truth: Option<Arc<Truth>>,
    /// Is every sample shaded, as in stills, or one a pixel, as in motion?
    pub still: bool,
    /// The sky that the sides follow until bakes for it are there, as a spec. Sides that a GPU does not
    /// refilter ([`Live::light_tables`]) stay in the light that they were baked for.
    pub sky: Option<String>,
}

/// Milliseconds of the device that a picture in motion leaves to the filters of a moving sky.
const FILTER_MS: f64 = 8.0;

/// A drawn view.
pub struct Frame {
    /// Each side as a display shows it.
    pub pictures: Vec<Display>,
    /// Radiance of each side.
    pub films: Vec<Arc<Film>>,
    /// The exposure that it was developed with.
    pub ev: f32,
    /// Of each side against the reference: relative RMS error of radiance, stops, mean FLIP.
    pub numbers: Vec<[f64; 3]>,
    /// Milliseconds from asking to having the radiance.
    pub draw_ms: f64,
    /// Milliseconds of exposure, tone mapping and differences.
    pub develop_ms: f64,
    /// Bytes of data that shading reads.
    pub bytes: usize,
    /// Was it drawn as a still?
    pub still: bool,
    /// The size that was asked for.
    pub size: [usize; 2],
    /// Of a moving sky: milliseconds of filtering for this picture, waited for.
    pub filter_ms: Option<f64>,
    /// Is the light of a moving sky still on its way to the objects?
    pub unfinished: bool,
}

/// One side on the GPU.
struct Side {
    live: Arc<Live>,
    renderer: Renderer,
    settings: Settings,
    camera: Camera,
    turn: f64,
    film: Option<Arc<Film>>,
    /// The sky that it follows, and its spec.
    following: Option<(Following, String)>,
}

/// Draws views on a GPU. What stays from one view to the next stays on the device.
pub struct Painter {
    gpu: Gpu,
    /// Develops pictures: in the pool of all they would wait for the steps of bakes, whole seconds.
    pool: Option<rayon::ThreadPool>,
    /// Of each side one for motion, one for stills, and one of the size of the reference's picture.
    sides: Vec<[Option<Side>; 3]>,
    sky: Option<(String, MovingSky)>,
}

impl Painter {
    /// Opens a GPU.
    pub fn open() -> Result<Self, GpuError> {
        let pool = rayon::ThreadPoolBuilder::new().build().ok();
        Ok(Self { gpu: Gpu::open()?, pool, sides: Vec::new(), sky: None })
    }

    /// Adapter, driver and back end in one line.
    pub fn describe(&self) -> String {
        self.gpu.describe()
    }

    /// Does the adapter compute on the CPU?
    pub fn is_software(&self) -> bool {
        self.gpu.is_software()
    }

    /// Draws and develops a view; where the device turns out to be lost, on one that is opened anew.
    pub fn paint(&mut self, view: &View) -> Result<Frame, Error> {
        match self.paint_here(view) {
            Err(_) if self.gpu.is_lost() => {
                *self = Self::open()?;
                self.paint_here(view)
            }
            painted => painted,
        }
    }

    fn beside<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        match &self.pool {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }

    fn paint_here(&mut self, view: &View) -> Result<Frame, Error> {
        let start = Instant::now();
        self.sides.resize_with(view.sides.len(), || [None, None, None]);
        if let Some(spec) = view.sky.as_ref().filter(|s| self.sky.as_ref().is_none_or(|k| k.0 != **s)) {
            self.sky = Some((spec.clone(), MovingSky::new(&self.gpu, spec)?));
        }
        let sky = self.sky.as_ref().filter(|_| view.sky.is_some());
        let mut films = Vec::new();
        let (mut filter_ms, mut unfinished) = (None, false);
        for (k, live) in view.sides.iter().enumerate() {
            let side = &mut self.sides[k][usize::from(view.still)];
            let ms = draw(&self.gpu, side, live, view, sky)?;
            filter_ms = ms.map(|ms| ms + filter_ms.unwrap_or(0.0)).or(filter_ms);
            if let Some(s) = side {
                unfinished |= s.following.as_ref().is_some_and(|f| f.0.is_busy());
                films.extend(s.film.clone());
            }
        }
        let drawn = Instant::now();
        let ev = view.exposure.unwrap_or_else(|| films.first().map_or(0.0, |f| auto_exposure(f)));
        let develop = Develop { ev, mapper: view.mapper };
        let mut numbers = Vec::new();
        let mut heat = Vec::new();
        if let Some(truth) = view.truth.as_ref().filter(|_| view.still) {
            let size = [truth.film.width, truth.film.height];
            let seen = View { size, ..view.clone() };
            for (k, live) in view.sides.iter().enumerate() {
                let film = match size == view.size {
                    true => films[k].clone(),
                    false => {
                        let side = &mut self.sides[k][2];
                        draw(&self.gpu, side, live, &seen, None)?;
                        side.as_ref().and_then(|s| s.film.clone()).unwrap_or_else(|| films[k].clone())
                    }
                };
                let d = self.beside(|| truth.difference(&film, develop));
                numbers.push([d.errors.relative_rms, d.errors.stops, d.flip]);
                heat.push(d.picture);
            }
        }
        let mode = view.mode;
        let picture = |film: &Arc<Film>| match mode {
            DisplayMode::FalseColour => false_colour(film, ev),
            DisplayMode::Picture | DisplayMode::Heat => develop.film(film),
        };
        let pictures = match mode {
            DisplayMode::Heat if !heat.is_empty() => heat,
            _ => self.beside(|| films.iter().map(picture).collect()),
        };
        Ok(Frame {
            pictures,
            ev,
            numbers,
            draw_ms: 1e3 * (drawn - start).as_secs_f64(),
            develop_ms: 1e3 * drawn.elapsed().as_secs_f64(),
            bytes: view.sides.iter().map(|l| l.bytes()).sum(),
            films,
            still: view.still,
            size: view.size,
            filter_ms,
            unfinished,
        })
    }
}

/// Draws one side, in the light of `sky` where it can follow that; milliseconds of filtering where it does.
fn draw(
    gpu: &Gpu,
    side: &mut Option<Side>,
    live: &Arc<Live>,
    view: &View,
    sky: Option<&(String, MovingSky)>,
) -> Result<Option<f64>, Error> {
    let [width, height] = view.size;
    let path: Path = gpu.preferred_path();
    let settings = match view.still {
        true => Settings { path, rate: Rate::Sample, ..Settings::new(width, height) },
        false => Settings::interactive(width, height, path),
    };
    let turned: Mat3 = rotation(view.turn);
    let kept = side.take().filter(|s| {
        // What followed a sky that a bake is there for is lit by that bake again.
        let lit = sky.is_some() || s.following.is_none() || !Arc::ptr_eq(&s.live, live);
        s.settings == settings && s.live.same_mesh(live) && lit
    });
    let mut s = match kept {
        Some(mut s) => {
            if !Arc::ptr_eq(&s.live, live) {
                let whole = live.gpu(view.camera, height, turned);
                s.renderer.set_direct(gpu, whole.direct.clone())?;
                for (k, object) in whole.objects.into_iter().enumerate() {
                    s.renderer.set_technique(gpu, k, object.technique)?;
                }
                if s.following.is_some() || !s.live.same_light(live) {
                    s.renderer.set_backdrop(gpu, whole.backdrop)?;
                }
                (s.live, s.film, s.following) = (live.clone(), None, None);
            }
            s
        }
        None => {
            let scene = live.gpu(view.camera, height, turned);
            let renderer = Renderer::new(gpu, scene, &settings)?;
            let (camera, turn) = (view.camera, view.turn);
            Side { live: live.clone(), renderer, settings, camera, turn, film: None, following: None }
        }
    };
    if s.camera != view.camera || s.turn != view.turn {
        s.renderer.set_camera(gpu, view.camera);
        s.renderer.set_light_rotation(gpu, turned);
        for (k, turned) in live.turned(view.camera, turned).into_iter().enumerate() {
            match turned {
                Turned::Uniforms(u) => s.renderer.update_uniforms(gpu, k, &u)?,
                Turned::Technique(t) => s.renderer.set_technique(gpu, k, *t)?,
            }
        }
        if let Some((f, _)) = &s.following {
            f.turn(gpu, &s.renderer, turned)?;
        }
        (s.camera, s.turn, s.film) = (view.camera, view.turn, None);
    }
    let mut filter_ms = None;
    if let Some(sky) = sky.filter(|_| live.light_tables().is_ok()) {
        let start = Instant::now();
        s.follow(gpu, live, view, sky, turned)?;
        filter_ms = Some(1e3 * start.elapsed().as_secs_f64());
    }
    if s.film.is_none() {
        let (picture, _) = s.renderer.render(gpu)?;
        s.film = Some(Arc::new(Film::without_background(width, height, picture.rgb, picture.alpha)));
    }
    *side = Some(s);
    Ok(filter_ms)
}

impl Side {
    /// A picture's share of the way to the light of `sky`.
    fn follow(
        &mut self,
        gpu: &Gpu,
        live: &Live,
        view: &View,
        (spec, sky): &(String, MovingSky),
        turned: Mat3,
    ) -> Result<(), Error> {
        let (mut following, known) = match self.following.take() {
            Some((f, known)) => (f, known == *spec),
            None => (Following::new(gpu, live)?, false),
        };
        if !known {
            following.set_sky(gpu, &mut self.renderer, live, sky, (view.camera, view.size[1]))?;
            self.film = None;
        }
        loop {
            let budget = if view.still { f64::INFINITY } else { FILTER_MS };
            if following.step(gpu, &self.renderer, budget, turned)? {
                self.film = None;
            }
            gpu.wait()?;
            // A still has no frame to keep up with.
            if !view.still || !following.is_busy() {
                break;
            }
        }
        self.following = Some((following, spec.clone()));
        Ok(())
    }
}

/// Luminance in stops about middle grey.
fn false_colour(film: &Film, ev: f32) -> Display {
    let gain = ev.exp2() / 0.18;
    let stops = |i: usize| {
        let y = luminance(film.pixel(i)) * gain;
        if y > 0.0 { 0.5 + 0.5 * y.log2() / FALSE_COLOUR } else { 0.0 }
    };
    let map: Vec<f32> = (0..film.len()).map(stops).collect();
    difference_picture(&map, film.width, film.height)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Baker, Wish};
    use steradian_base::Task;
    use steradian_session::Session;

    #[test]
    fn a_lost_device_costs_no_picture() {
        let mut painter = match Painter::open() {
            Ok(p) => p,
            Err(e) if std::env::var_os("STERADIAN_REQUIRE_GPU").is_none() => {
                return eprintln!("left out: {e}");
            }
            Err(e) => panic!("{e}"),
        };
        let wish = Wish {
            input: "sphere".into(),
            technique: Some("sh_irradiance".into()),
            brdf: Some("lambert".into()),
            ground: None,
            ..Wish::default()
        };
        let live = Baker::new(Session::new()).bake(&wish, Task::quiet()).expect("bakes");
        let view = View {
            camera: live.camera(),
            sides: vec![live],
            turn: 0.0,
            size: [64, 48],
            exposure: None,
            mapper: ToneMapper::default(),
            mode: DisplayMode::Picture,
            truth: None,
            still: true,
            sky: None,
        };
        let film = |painter: &mut Painter| painter.paint(&view).expect("paints").films[0].clone();
        let before = film(&mut painter);
        painter.gpu.destroy();
        assert!(painter.gpu.is_lost());
        // The picture that is on the host already is not drawn again; another size is.
        let (again, wider) = (film(&mut painter), View { size: [80, 48], ..view.clone() });
        assert_eq!(before.rgb, again.rgb);
        assert_eq!(painter.paint(&wider).expect("paints").films[0].width, 80);
        assert!(!painter.gpu.is_lost());
        assert_eq!(film(&mut painter).rgb, before.rgb);
    }
}
