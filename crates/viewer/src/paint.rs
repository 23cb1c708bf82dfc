//! Pictures of a live scene, by a GPU, developed for a display.

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
use steradian_session::live::{Live, Truth, Turned, rotation};

/// How radiance is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Look {
    /// Exposed and tone-mapped.
    #[default]
    Picture,
    /// Luminance in stops about the middle grey of 0.18 after exposure, from [`FALSE_COLOUR`] below to as many above.
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
    pub look: Look,
    /// What the heat map and the numbers are made against.
    pub truth: Option<Arc<Truth>>,
    /// Is every sample shaded, as in stills, or one a pixel, as in motion?
    pub still: bool,
}

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
}

/// One side on the GPU.
struct Side {
    live: Arc<Live>,
    renderer: Renderer,
    settings: Settings,
    camera: Camera,
    turn: f64,
    film: Option<Arc<Film>>,
}

/// Draws views on a GPU. What stays from one view to the next stays on the device.
pub struct Painter {
    gpu: Gpu,
    /// Of each side one for motion, one for stills, and one of the size of the reference's picture.
    sides: Vec<[Option<Side>; 3]>,
}

impl Painter {
    /// Opens a GPU.
    pub fn open() -> Result<Self, GpuError> {
        Ok(Self { gpu: Gpu::open()?, sides: Vec::new() })
    }

    /// Adapter, driver and back end in one line.
    pub fn describe(&self) -> String {
        self.gpu.describe()
    }

    /// Does the adapter compute on the CPU?
    pub fn is_software(&self) -> bool {
        self.gpu.is_software()
    }

    /// Draws and develops a view.
    pub fn paint(&mut self, view: &View) -> Result<Frame, GpuError> {
        let start = Instant::now();
        self.sides.resize_with(view.sides.len(), || [None, None, None]);
        let mut films = Vec::new();
        for (k, live) in view.sides.iter().enumerate() {
            let side = &mut self.sides[k][usize::from(view.still)];
            films.push(draw(&self.gpu, side, live, view)?);
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
                    false => draw(&self.gpu, &mut self.sides[k][2], live, &seen)?,
                };
                let d = truth.difference(&film, develop);
                numbers.push([d.errors.relative_rms, d.errors.stops, d.flip]);
                heat.push(d.picture);
            }
        }
        let picture = |film: &Arc<Film>| match view.look {
            Look::FalseColour => false_colour(film, ev),
            Look::Picture | Look::Heat => develop.film(film),
        };
        let pictures = match view.look {
            Look::Heat if !heat.is_empty() => heat,
            _ => films.iter().map(picture).collect(),
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
        })
    }
}

/// The radiance of one side.
fn draw(gpu: &Gpu, side: &mut Option<Side>, live: &Arc<Live>, view: &View) -> Result<Arc<Film>, GpuError> {
    let [width, height] = view.size;
    let path: Path = gpu.preferred_path();
    let settings = match view.still {
        true => Settings { path, rate: Rate::Sample, ..Settings::new(width, height) },
        false => Settings::interactive(width, height, path),
    };
    let turned: Mat3 = rotation(view.turn);
    let kept = side.take().filter(|s| s.settings == settings && s.live.same_mesh(live));
    let mut s = match kept {
        Some(mut s) => {
            if !Arc::ptr_eq(&s.live, live) {
                let whole = live.gpu(view.camera, height, turned);
                s.renderer.set_direct(gpu, whole.direct.clone())?;
                for (k, object) in whole.objects.into_iter().enumerate() {
                    s.renderer.set_technique(gpu, k, object.technique)?;
                }
                if !s.live.same_light(live) {
                    s.renderer.set_backdrop(gpu, whole.backdrop)?;
                }
                (s.live, s.film) = (live.clone(), None);
            }
            s
        }
        None => {
            let scene = live.gpu(view.camera, height, turned);
            let renderer = Renderer::new(gpu, scene, &settings)?;
            let (camera, turn) = (view.camera, view.turn);
            Side { live: live.clone(), renderer, settings, camera, turn, film: None }
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
        (s.camera, s.turn, s.film) = (view.camera, view.turn, None);
    }
    let film = match s.film.take() {
        Some(film) => film,
        None => {
            let (picture, _) = s.renderer.render(gpu)?;
            Arc::new(Film::without_background(width, height, picture.rgb, picture.alpha))
        }
    };
    s.film = Some(film.clone());
    *side = Some(s);
    Ok(film)
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
