//! The window.

use crate::bake::Baker;
use crate::controls;
use crate::paint::{FALSE_COLOUR, Frame, Look, Painter, View};
use crate::reference::STEPS;
use crate::work::Desk;
use crate::{Error, Orbit, Wish};
use eframe::egui::{self, Color32, Key, Modifiers, Pos2, Rect, RichText, Sense, Ui, Vec2};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use steradian_base::{Progress, Task, split_spec};
use steradian_render::ToneMapper;
use steradian_session::Session;
use steradian_session::live::{Live, Truth};

/// How long nothing moves before a still is drawn.
const REST: Duration = Duration::from_millis(220);
/// Milliseconds of a still beyond which motion is drawn at half the size.
const SLOW: f64 = 45.0;
/// Steps that can be undone.
const UNDO: usize = 200;

/// What the window remembers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
struct Kept {
    wish: Wish,
    /// The technique of the right side, where the view is split.
    other: Option<String>,
    split: bool,
    wipe: f32,
    theme: Theme,
    panel: bool,
}

impl Default for Kept {
    fn default() -> Self {
        Self {
            wish: Wish::default(),
            other: None,
            split: false,
            wipe: 0.5,
            theme: Theme::System,
            panel: true,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum Theme {
    System,
    Light,
    Dark,
}

/// What threads say.
enum Said {
    Baked { side: usize, wish: Box<Wish>, made: Result<Arc<Live>, steradian_session::Error>, seconds: f64 },
    Opened(Result<(String, bool), String>),
    Painted(Result<Box<Frame>, String>),
    True { made: Result<Arc<Truth>, steradian_session::Error>, step: usize, of: Box<Posed> },
    Reflectance(Result<String, String>),
}

/// What a reference's picture is of.
#[derive(Clone)]
struct Posed {
    live: Arc<Live>,
    orbit: Orbit,
    turn: f64,
    size: [usize; 2],
}

impl PartialEq for Posed {
    fn eq(&self, o: &Self) -> bool {
        // Techniques differ, the truth does not.
        let same = self.live.same_mesh(&o.live) && self.live.same_light(&o.live);
        let spec = |l: &Live| l.scene().materials.iter().map(|m| m.brdf.spec()).collect::<Vec<_>>();
        (self.orbit, self.turn, self.size) == (o.orbit, o.turn, o.size)
            && (Arc::ptr_eq(&self.live, &o.live) || same && spec(&self.live) == spec(&o.live))
    }
}

/// Progress that a window reads.
#[derive(Default)]
struct Bar {
    label: Mutex<String>,
    done: AtomicU64,
    total: AtomicU64,
}

impl Progress for Bar {
    fn begin(&self, label: &str, total: u64) {
        *self.label.lock().unwrap_or_else(PoisonError::into_inner) = label.into();
        self.done.store(0, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
    }

    fn advance(&self, steps: u64) {
        self.done.fetch_add(steps, Ordering::Relaxed);
    }

    fn end(&self) {
        self.done.store(self.total.load(Ordering::Relaxed), Ordering::Relaxed);
    }
}

/// Threads and what they are asked.
struct Threads {
    bakes: Vec<Arc<Desk<Wish>>>,
    bars: Vec<Arc<Bar>>,
    paint: Arc<Desk<View>>,
    truth: Arc<Desk<Posed>>,
    truth_bar: Arc<Bar>,
    said: Receiver<Said>,
    say: Sender<Said>,
    running: Vec<JoinHandle<()>>,
}

impl Threads {
    fn start(ctx: &egui::Context, memory: u64) -> Self {
        let (say, said) = channel();
        let mut running = Vec::new();
        let (mut bakes, mut bars) = (Vec::new(), Vec::new());
        for side in 0..2 {
            let (desk, bar) = (Arc::new(Desk::<Wish>::new()), Arc::new(Bar::default()));
            bakes.push(desk.clone());
            bars.push(bar.clone());
            let (say, ctx) = (say.clone(), ctx.clone());
            running.push(std::thread::spawn(move || {
                let mut baker = Baker::new(Session::new());
                while let Some((wish, cancel)) = desk.next() {
                    let start = Instant::now();
                    let task =
                        Task::quiet().with_max_memory(memory).with_progress(bar.clone()).with_cancel(cancel);
                    let made = baker.bake(&wish, task);
                    let seconds = start.elapsed().as_secs_f64();
                    let _ = say.send(Said::Baked { side, wish: Box::new(wish), made, seconds });
                    ctx.request_repaint();
                }
            }));
        }
        let paint = Arc::new(Desk::<View>::new());
        {
            let (desk, say, ctx) = (paint.clone(), say.clone(), ctx.clone());
            running.push(std::thread::spawn(move || paint_all(&desk, &say, &ctx)));
        }
        let (truth, truth_bar) = (Arc::new(Desk::<Posed>::new()), Arc::new(Bar::default()));
        {
            let (desk, bar, say, ctx) = (truth.clone(), truth_bar.clone(), say.clone(), ctx.clone());
            running.push(std::thread::spawn(move || refine(&desk, &bar, &say, &ctx, memory)));
        }
        Self { bakes, bars, paint, truth, truth_bar, said, say, running }
    }

    /// Ends all threads and waits for them: nothing is left behind.
    fn close(&mut self) {
        self.bakes.iter().for_each(|d| d.close());
        self.paint.close();
        self.truth.close();
        for t in self.running.drain(..) {
            let _ = t.join(); // a thread that panicked has nothing more to say
        }
    }
}

fn paint_all(desk: &Desk<View>, say: &Sender<Said>, ctx: &egui::Context) {
    let mut painter = match Painter::open() {
        Ok(p) => {
            let _ = say.send(Said::Opened(Ok((p.describe(), p.is_software()))));
            p
        }
        Err(e) => {
            let _ = say.send(Said::Opened(Err(e.to_string())));
            ctx.request_repaint();
            return;
        }
    };
    ctx.request_repaint();
    while let Some((view, _)) = desk.next() {
        let painted = painter.paint(&view).map(Box::new).map_err(|e| e.to_string());
        let failed = painted.is_err();
        let _ = say.send(Said::Painted(painted));
        ctx.request_repaint();
        // A lost device is opened anew.
        if failed && let Ok(p) = Painter::open() {
            painter = p;
        }
    }
}

fn refine(desk: &Desk<Posed>, bar: &Arc<Bar>, say: &Sender<Said>, ctx: &egui::Context, memory: u64) {
    while let Some((posed, cancel)) = desk.next() {
        for (step, (part, tolerance)) in STEPS.into_iter().enumerate() {
            let mut session = Session::new();
            session.task =
                Task::quiet().with_max_memory(memory).with_progress(bar.clone()).with_cancel(cancel.clone());
            let size = posed.size.map(|n| n.div_ceil(part).max(1));
            let made = session.truth(&posed.live, posed.orbit.camera(), posed.turn, size, tolerance);
            let failed = made.is_err();
            let made = made.map(Arc::new);
            let _ = say.send(Said::True { made, step, of: Box::new(posed.clone()) });
            ctx.request_repaint();
            if failed {
                break;
            }
        }
    }
}

/// Opens the window on `wish`, or on what was seen last, until it is closed.
pub fn run(wish: Option<Wish>, memory: u64) -> Result<(), Error> {
    // Without an adapter there is nothing to see: said before a window opens.
    drop(Painter::open()?);
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Steradian")
            .with_app_id("steradian")
            .with_inner_size([1280.0, 820.0])
            .with_min_inner_size([420.0, 320.0])
            .with_drag_and_drop(true),
        ..Default::default()
    };
    let make: eframe::AppCreator<'_> = Box::new(move |cc| {
        let mut kept: Kept = cc
            .storage
            .and_then(|s| s.get_string("steradian"))
            .and_then(|text| serde_json::from_str(&text).ok())
            .unwrap_or_default();
        if let Some(wish) = wish {
            kept.wish = wish;
        }
        Ok(Box::new(App::new(&cc.egui_ctx, kept, memory)))
    });
    eframe::run_native("steradian", options, make).map_err(|e| Error::Window(explained(&e.to_string())))
}

/// What the window system says, in words.
fn explained(why: &str) -> String {
    if why.contains("WAYLAND_DISPLAY") || why.contains("DISPLAY is set") {
        return "no display to open a window on (DISPLAY and WAYLAND_DISPLAY are not set); --screenshot FILE draws without one".into();
    }
    if why.contains("CreateSurface") || why.contains("adapter") {
        return "the graphics adapter cannot draw into windows; --screenshot FILE draws without one".into();
    }
    format!("cannot open a window: {}", why.lines().next().unwrap_or_default())
}

/// The window.
struct App {
    kept: Kept,
    threads: Threads,
    /// The wish of each side that was asked for last, without what needs no bake.
    asked: [Option<Wish>; 2],
    lives: [Option<Arc<Live>>; 2],
    seconds: [f64; 2],
    adapter: Option<(String, bool)>,
    error: Option<String>,
    /// What to go back to if a dropped file turns out broken.
    before_drop: Option<Wish>,
    frame: Option<Box<Frame>>,
    textures: Vec<egui::TextureHandle>,
    drawn: Option<Drawn>,
    look: Look,
    truth: Option<(Arc<Truth>, Posed, usize)>,
    truth_asked: Option<Posed>,
    truth_history: Vec<(f64, Option<f64>)>,
    moved: Instant,
    still_ms: f64,
    undo: Vec<Wish>,
    redo: Vec<Wish>,
    committed: Wish,
    said: Option<(String, Instant)>,
    help: bool,
    wiping: bool,
    hover: Option<[f32; 2]>,
    pixels: [usize; 2],
}

/// What was asked of the painter last.
#[derive(Clone)]
struct Drawn(View);

impl PartialEq for Drawn {
    fn eq(&self, o: &Self) -> bool {
        let (a, b) = (&self.0, &o.0);
        let pair = |a: &Option<Arc<Truth>>, b: &Option<Arc<Truth>>| match (a, b) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        };
        a.sides.len() == b.sides.len()
            && a.sides.iter().zip(&b.sides).all(|(x, y)| Arc::ptr_eq(x, y))
            && pair(&a.truth, &b.truth)
            && (a.camera, a.turn, a.size, a.exposure, a.mapper, a.look, a.still)
                == (b.camera, b.turn, b.size, b.exposure, b.mapper, b.look, b.still)
    }
}

impl App {
    fn new(ctx: &egui::Context, kept: Kept, memory: u64) -> Self {
        style(ctx);
        let app = Self {
            threads: Threads::start(ctx, memory),
            committed: kept.wish.clone(),
            kept,
            asked: [None, None],
            lives: [None, None],
            seconds: [0.0; 2],
            adapter: None,
            error: None,
            before_drop: None,
            frame: None,
            textures: Vec::new(),
            drawn: None,
            look: Look::Picture,
            truth: None,
            truth_asked: None,
            truth_history: Vec::new(),
            moved: Instant::now(),
            still_ms: 0.0,
            undo: Vec::new(),
            redo: Vec::new(),
            said: None,
            help: false,
            wiping: false,
            hover: None,
            pixels: [0, 0],
        };
        app.set_theme(ctx);
        app
    }

    fn set_theme(&self, ctx: &egui::Context) {
        ctx.set_theme(match self.kept.theme {
            Theme::System => egui::ThemePreference::System,
            Theme::Light => egui::ThemePreference::Light,
            Theme::Dark => egui::ThemePreference::Dark,
        });
    }

    fn note(&mut self, text: impl Into<String>) {
        self.said = Some((text.into(), Instant::now()));
    }

    /// What each thread has finished.
    fn listen(&mut self, ctx: &egui::Context) {
        while let Ok(said) = self.threads.said.try_recv() {
            match said {
                Said::Opened(Ok(adapter)) => self.adapter = Some(adapter),
                Said::Opened(Err(e)) => self.error = Some(e),
                Said::Baked { made: Err(e), .. } if e.is_cancelled() => {}
                Said::Baked { side, made: Err(e), .. } => {
                    self.error = Some(e.to_string());
                    if let (0, Some(before)) = (side, self.before_drop.take()) {
                        self.kept.wish = before;
                    }
                }
                Said::Baked { side, wish, made: Ok(live), seconds } => {
                    if self.kept.wish.orbit.is_none() || self.lives[0].is_none() && wish.orbit.is_none() {
                        self.kept.wish.orbit = Some(Orbit::of(&live.camera()));
                        self.committed = self.kept.wish.clone();
                    }
                    self.lives[side] = Some(live);
                    self.seconds[side] = seconds;
                    if side == 0 {
                        (self.error, self.before_drop) = (None, None);
                    }
                }
                Said::Painted(Ok(frame)) => {
                    self.textures.resize_with(frame.pictures.len(), || {
                        let blank = egui::ColorImage::filled([1, 1], Color32::BLACK);
                        ctx.load_texture("picture", blank, egui::TextureOptions::LINEAR)
                    });
                    for (texture, p) in self.textures.iter_mut().zip(&frame.pictures) {
                        let image = egui::ColorImage::from_rgb([p.width, p.height], &p.rgb);
                        texture.set(image, egui::TextureOptions::LINEAR);
                    }
                    if frame.still {
                        self.still_ms = frame.draw_ms;
                    }
                    if let (Some(n), Some(last)) = (frame.numbers.first(), self.truth_history.last_mut()) {
                        last.1 = Some(n[0]);
                    }
                    self.frame = Some(frame);
                }
                Said::Painted(Err(e)) => self.error = Some(e),
                Said::True { made: Ok(truth), step, of } => {
                    if self.truth_asked.as_ref() == Some(&*of) {
                        self.truth_history.push((truth.error, None));
                        self.truth = Some((truth, *of, step));
                    }
                }
                Said::True { made: Err(e), .. } => {
                    if !e.is_cancelled() {
                        self.error = Some(e.to_string());
                    }
                }
                Said::Reflectance(Ok(spec)) => {
                    self.kept.wish.brdf = Some(spec);
                    self.kept.wish.bake = None;
                }
                Said::Reflectance(Err(e)) => self.error = Some(e),
            }
        }
    }

    /// The wish of a side.
    fn side(&self, side: usize) -> Wish {
        let mut wish = self.kept.wish.clone();
        if side == 1 {
            wish.technique.clone_from(&self.kept.other);
            wish.bake = None;
        }
        wish
    }

    /// Asks for what has changed.
    fn ask(&mut self, ctx: &egui::Context) {
        for side in 0..if self.kept.split { 2 } else { 1 } {
            let of = self.side(side);
            // What needs no bake is not asked for.
            let plain = Wish { turn: 0.0, exposure: None, orbit: None, tone_mapper: String::new(), ..of };
            if self.asked[side].as_ref() != Some(&plain) {
                self.asked[side] = Some(plain.clone());
                self.threads.bakes[side].ask(plain);
            }
        }
        let Some(orbit) = self.kept.wish.orbit else { return };
        let mut sides: Vec<_> = self.lives[0].iter().cloned().collect();
        if self.kept.split {
            sides.extend(self.lives[1].iter().cloned());
        }
        if sides.is_empty() || self.pixels.contains(&0) || self.adapter.is_none() {
            return;
        }
        let still = self.moved.elapsed() >= REST;
        if !still {
            ctx.request_repaint_after(REST);
        }
        let posed = Posed { live: sides[0].clone(), orbit, turn: self.kept.wish.turn, size: self.pixels };
        if self.look == Look::Heat && still {
            if self.truth_asked.as_ref() != Some(&posed) {
                self.truth_asked = Some(posed.clone());
                self.truth_history.clear();
                self.truth = None;
                self.threads.truth.ask(posed.clone());
            }
        } else if self.truth_asked.is_some()
            && (self.look != Look::Heat || self.truth_asked.as_ref() != Some(&posed))
        {
            self.threads.truth.cancel();
            self.truth_asked = None;
            self.truth = None;
        }
        let half = !still && self.still_ms > SLOW;
        let size = if half { self.pixels.map(|n| n.div_ceil(2)) } else { self.pixels };
        let view = View {
            sides,
            camera: orbit.camera(),
            turn: self.kept.wish.turn,
            size,
            exposure: self.kept.wish.exposure,
            mapper: ToneMapper::from_name(&self.kept.wish.tone_mapper).unwrap_or_default(),
            look: self.look,
            truth: self.truth.as_ref().map(|t| t.0.clone()),
            still,
        };
        let drawn = Drawn(view);
        if self.drawn.as_ref() != Some(&drawn) {
            self.threads.paint.ask_next(drawn.0.clone());
            self.drawn = Some(drawn);
        }
    }

    /// Takes files that were dropped.
    fn drop_files(&mut self, ctx: &egui::Context) {
        let files: Vec<PathBuf> =
            ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_path_buf()).collect());
        for file in files {
            self.take(&file);
        }
    }

    /// Takes a file for what it is by its name.
    fn take(&mut self, file: &Path) {
        let name = file.display().to_string();
        let extension = file.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let before = self.kept.wish.clone();
        let wish = &mut self.kept.wish;
        match extension.as_str() {
            "toml" => *wish = Wish { tone_mapper: wish.tone_mapper.clone(), ..Wish::of(&name) },
            "obj" | "ply" | "stl" | "gltf" | "glb" => {
                (wish.input, wish.orbit, wish.normal_map, wish.brdf) = (name, None, None, None);
                wish.light.get_or_insert_with(|| "studio".into());
            }
            "hdr" | "exr" | "pfm" | "pic" | "dds" | "ktx" | "ktx2" => {
                (wish.light, wish.bake) = (Some(name), None);
            }
            "png" | "jpg" | "jpeg" | "tga" => wish.normal_map = Some(name),
            "safetensors" => wish.bake = Some(name),
            _ => {
                let (say, file) = (self.threads.say.clone(), name);
                std::thread::spawn(move || {
                    let _ = say.send(Said::Reflectance(measured(&file)));
                });
                return;
            }
        }
        self.before_drop = Some(before);
    }

    fn keys(&mut self, ctx: &egui::Context) {
        if ctx.egui_wants_keyboard_input() {
            return;
        }
        let pressed = |key: Key| ctx.input_mut(|i| i.consume_key(Modifiers::NONE, key));
        let shifted = |key: Key| ctx.input_mut(|i| i.consume_key(Modifiers::SHIFT, key));
        if ctx.input_mut(|i| i.consume_key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z))
            || ctx.input_mut(|i| i.consume_key(Modifiers::COMMAND, Key::Y))
        {
            self.again();
        }
        if ctx.input_mut(|i| i.consume_key(Modifiers::COMMAND, Key::Z)) {
            self.back();
        }
        if ctx.input_mut(|i| i.consume_key(Modifiers::COMMAND, Key::Q)) {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        const STEP: f32 = 0.08;
        let mut moved = false;
        let arrows = [
            (Key::ArrowLeft, -1.0, 0.0),
            (Key::ArrowRight, 1.0, 0.0),
            (Key::ArrowUp, 0.0, 1.0),
            (Key::ArrowDown, 0.0, -1.0),
        ];
        for (key, x, y) in arrows {
            if shifted(key) {
                self.kept.wish.turn = degrees(self.kept.wish.turn + f64::from(x + y) * 5.0);
                moved = true;
            } else if ctx.input_mut(|i| i.consume_key(Modifiers::ALT, key)) {
                if let Some(o) = &mut self.kept.wish.orbit {
                    o.shift(-0.05 * x, -0.05 * y);
                }
                moved = true;
            } else if pressed(key) {
                if let Some(o) = &mut self.kept.wish.orbit {
                    o.turn(STEP * x, STEP * y);
                }
                moved = true;
            }
        }
        for (keys, factor) in [([Key::Plus, Key::Equals], 0.9), ([Key::Minus, Key::Minus], 1.0 / 0.9)] {
            if keys.iter().any(|k| pressed(*k) || shifted(*k)) {
                if let Some(o) = &mut self.kept.wish.orbit {
                    o.zoom(factor);
                }
                moved = true;
            }
        }
        if moved {
            self.moved = Instant::now();
        }
        if shifted(Key::T) {
            self.next_technique(-1);
        }
        if pressed(Key::T) {
            self.next_technique(1);
        }
        if pressed(Key::L) {
            self.next_light();
        }
        if pressed(Key::M) {
            self.next_model();
        }
        if pressed(Key::H) {
            self.look = if self.look == Look::Heat { Look::Picture } else { Look::Heat };
        }
        if pressed(Key::F) {
            self.look = if self.look == Look::FalseColour { Look::Picture } else { Look::FalseColour };
        }
        if pressed(Key::B) {
            self.kept.split = !self.kept.split;
        }
        for (key, by) in [(Key::Comma, -0.02), (Key::Period, 0.02)] {
            if pressed(key) {
                self.kept.wipe = (self.kept.wipe + by).clamp(0.0, 1.0);
            }
        }
        for (key, by) in [(Key::OpenBracket, -0.25), (Key::CloseBracket, 0.25)] {
            if pressed(key) {
                let ev = self.frame.as_ref().map_or(0.0, |f| f.ev);
                self.kept.wish.exposure = Some(self.kept.wish.exposure.unwrap_or(ev) + by);
            }
        }
        if pressed(Key::A) {
            self.kept.wish.exposure = None;
        }
        if pressed(Key::O) {
            self.next_mapper();
        }
        if pressed(Key::Num0) {
            self.home();
        }
        if pressed(Key::S) {
            self.screenshot();
        }
        if pressed(Key::E) {
            self.export();
        }
        if pressed(Key::C) {
            self.copy_command(ctx);
        }
        if pressed(Key::P) {
            self.kept.panel = !self.kept.panel;
        }
        if pressed(Key::D) {
            self.kept.theme = if ctx.theme() == egui::Theme::Dark { Theme::Light } else { Theme::Dark };
            self.set_theme(ctx);
        }
        if pressed(Key::F1) || shifted(Key::Slash) || pressed(Key::Questionmark) {
            self.help = !self.help;
        }
        if pressed(Key::Escape) {
            self.threads.bakes.iter().for_each(|d| d.cancel());
            (self.help, self.error) = (false, None);
        }
    }

    fn back(&mut self) {
        if let Some(before) = self.undo.pop() {
            self.redo.push(std::mem::replace(&mut self.kept.wish, before.clone()));
            self.committed = before;
            self.moved = Instant::now();
        }
    }

    fn again(&mut self) {
        if let Some(after) = self.redo.pop() {
            self.undo.push(std::mem::replace(&mut self.kept.wish, after.clone()));
            self.committed = after;
            self.moved = Instant::now();
        }
    }

    /// What was changed becomes a step that can be undone, once nothing is held any more.
    fn commit(&mut self, ctx: &egui::Context) {
        let held = ctx.input(|i| i.pointer.any_down()) || self.moved.elapsed() < REST;
        if !held && self.kept.wish != self.committed {
            self.undo.push(std::mem::replace(&mut self.committed, self.kept.wish.clone()));
            if self.undo.len() > UNDO {
                self.undo.remove(0);
            }
            self.redo.clear();
        }
    }

    /// Techniques that take the material, in the order of the registry.
    fn techniques(&self) -> Vec<&'static str> {
        let brdf = self.lives[0].as_ref().and_then(|l| l.scene().materials.first().map(|m| m.brdf.clone()));
        let takes = |t: &&'static dyn steradian_techniques::AnyTechnique| {
            brdf.as_ref().is_none_or(|b| (t.card().materials)(&**b).is_ok())
        };
        steradian_techniques::registry().iter().copied().filter(takes).map(|t| t.card().slug).collect()
    }

    fn next_technique(&mut self, by: isize) {
        // Techniques at sites take minutes to bake: they are for the picker.
        let quick = |slug: &&str| steradian_techniques::find(slug).is_some_and(|t| !t.card().needs.sites);
        let all: Vec<_> = self.techniques().into_iter().filter(quick).collect();
        let now = self.kept.wish.technique.clone().unwrap_or_default();
        let at = all.iter().position(|s| *s == now).map_or(0, |k| k as isize + by);
        if !all.is_empty() {
            self.kept.wish.technique = Some(all[at.rem_euclid(all.len() as isize) as usize].into());
            self.kept.wish.bake = None;
            self.note(format!("technique {}", self.kept.wish.technique.as_deref().unwrap_or_default()));
        }
    }

    fn next_light(&mut self) {
        let names = steradian_light::sky::NAMES;
        let now = self.kept.wish.light.clone().unwrap_or_default();
        let at = names.iter().position(|n| *n == split_spec(&now).0).map_or(0, |k| k + 1);
        self.kept.wish.light = Some(names[at % names.len()].into());
        self.kept.wish.exposure = None;
    }

    fn next_model(&mut self) {
        let all: Vec<_> = steradian_brdf::models()
            .iter()
            .filter_map(|m| Some((m.name, controls::first_spec(m.name, m.parameters)?)))
            .collect();
        let now = self.kept.wish.brdf.clone().unwrap_or_default();
        let at = all.iter().position(|m| m.0 == split_spec(&now).0).map_or(0, |k| k + 1);
        if let Some((_, spec)) = all.get(at % all.len().max(1)) {
            self.kept.wish.brdf = Some(spec.clone());
        }
    }

    fn next_mapper(&mut self) {
        let all = ToneMapper::ALL;
        let at = all.iter().position(|t| t.name() == self.kept.wish.tone_mapper).map_or(0, |k| k + 1);
        self.kept.wish.tone_mapper = all[at % all.len()].name().into();
        self.note(format!("tone mapper {}", self.kept.wish.tone_mapper));
    }

    /// The first view.
    fn home(&mut self) {
        if let Some(live) = &self.lives[0] {
            self.kept.wish.orbit = Some(Orbit::of(&live.camera()));
        }
        (self.kept.wish.turn, self.kept.wish.exposure) = (0.0, None);
        self.moved = Instant::now();
    }

    fn command(&self) -> Option<String> {
        let frame = self.frame.as_ref()?;
        Some(self.kept.wish.command(frame.size, frame.ev))
    }

    fn copy_command(&mut self, ctx: &egui::Context) {
        if let Some(command) = self.command() {
            ctx.copy_text(command);
            self.note("the command line that makes this picture is in the clipboard");
        }
    }

    /// Writes the picture into the working folder, under a name that is free.
    fn screenshot(&mut self) {
        let Some(frame) = &self.frame else { return };
        let free = (1..10_000).map(|k| PathBuf::from(format!("steradian-{k:04}.png"))).find(|f| !f.exists());
        let Some(file) = free else { return };
        let written = Session::new().write_display(&file, &frame.pictures[0], Vec::new());
        match written {
            Ok(()) => {
                let command = self.command().unwrap_or_default();
                let at = std::path::absolute(&file).unwrap_or(file);
                self.note(format!("{}\n{command}", at.display()));
            }
            Err(e) => self.error = Some(e.to_string()),
        }
    }

    /// Writes the scene into a new folder of the working folder.
    fn export(&mut self) {
        let Some(frame) = &self.frame else { return };
        let free = (1..10_000).map(|k| PathBuf::from(format!("steradian-{k:04}"))).find(|f| !f.exists());
        let Some(folder) = free else { return };
        match self.kept.wish.export(&folder, frame.size, frame.ev) {
            Ok(()) => {
                let at = std::path::absolute(&folder).unwrap_or(folder);
                self.note(format!("{}", at.join("scene.toml").display()));
            }
            Err(e) => self.error = Some(e),
        }
    }

    /// The picture, and what the mouse does in it.
    fn picture(&mut self, ui: &mut Ui) {
        let rect = ui.available_rect_before_wrap();
        let scale = ui.ctx().pixels_per_point();
        self.pixels = [rect.width(), rect.height()].map(|n| (n * scale).round().max(1.0) as usize);
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        let painter = ui.painter_at(rect);
        let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
        if let Some(first) = self.textures.first() {
            painter.image(first.id(), rect, whole, Color32::WHITE);
        }
        let wipe = rect.left() + self.kept.wipe * rect.width();
        let two = self.kept.split && self.textures.len() > 1;
        if two {
            let right = Rect::from_min_max(Pos2::new(wipe, rect.top()), rect.max);
            let part = Rect::from_min_max(Pos2::new(self.kept.wipe, 0.0), Pos2::new(1.0, 1.0));
            painter.image(self.textures[1].id(), right, part, Color32::WHITE);
            painter.vline(wipe, rect.y_range(), (1.5, Color32::WHITE));
            painter.circle_filled(Pos2::new(wipe, rect.center().y), 6.0, Color32::WHITE);
            let label = |at: Pos2, align: egui::Align2, text: &str| {
                tag(&painter, at, align, text);
            };
            let name = |t: &Option<String>| t.clone().unwrap_or_else(|| "chosen".into());
            label(
                Pos2::new(wipe - 12.0, rect.top() + 14.0),
                egui::Align2::RIGHT_TOP,
                &name(&self.kept.wish.technique),
            );
            label(Pos2::new(wipe + 12.0, rect.top() + 14.0), egui::Align2::LEFT_TOP, &name(&self.kept.other));
        }
        self.mouse(ui, &response, rect, two.then_some(wipe));
        self.overlay(ui, &painter, rect);
    }

    fn mouse(&mut self, ui: &Ui, response: &egui::Response, rect: Rect, wipe: Option<f32>) {
        let pointer = response.hover_pos();
        self.hover =
            pointer.map(|p| [(p.x - rect.left()) / rect.width(), (p.y - rect.top()) / rect.height()]);
        let near = |p: Option<Pos2>| wipe.zip(p).is_some_and(|(w, p)| (p.x - w).abs() < 8.0);
        if response.drag_started() {
            self.wiping = near(ui.input(|i| i.pointer.press_origin()));
        }
        if near(pointer) || self.wiping {
            ui.ctx().set_cursor_icon(egui::CursorIcon::ResizeHorizontal);
        }
        let d: Vec2 = response.drag_delta();
        let (shift, secondary) = (
            ui.input(|i| i.modifiers.shift),
            response.dragged_by(egui::PointerButton::Secondary)
                || response.dragged_by(egui::PointerButton::Middle),
        );
        if response.dragged() && self.wiping {
            self.kept.wipe = (self.kept.wipe + d.x / rect.width()).clamp(0.0, 1.0);
        } else if response.dragged() && d != Vec2::ZERO {
            self.moved = Instant::now();
            if shift {
                self.kept.wish.turn = degrees(self.kept.wish.turn + f64::from(d.x) * 0.4);
            } else if let Some(o) = &mut self.kept.wish.orbit {
                if secondary {
                    o.shift(-d.x / rect.height(), d.y / rect.height());
                } else {
                    o.turn(-d.x * 0.008, d.y * 0.008);
                }
            }
        }
        if response.drag_stopped() {
            self.wiping = false;
        }
        if response.double_clicked() {
            self.home();
        }
        if response.hovered() {
            let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
            let factor = (-scroll * 0.002).exp() / pinch;
            if factor != 1.0
                && let Some(o) = &mut self.kept.wish.orbit
            {
                o.zoom(factor);
                self.moved = Instant::now();
            }
        }
    }

    /// What is written over the picture: progress, errors, the reference's state, notes.
    fn overlay(&mut self, ui: &mut Ui, painter: &egui::Painter, rect: Rect) {
        let mut y = rect.top() + 14.0;
        for side in 0..2 {
            if self.threads.bakes[side].is_busy() {
                let bar = &self.threads.bars[side];
                let label = bar.label.lock().unwrap_or_else(PoisonError::into_inner).clone();
                let (done, total) = (bar.done.load(Ordering::Relaxed), bar.total.load(Ordering::Relaxed));
                let part = if total > 0 { (done as f32 / total as f32).min(1.0) } else { 0.0 };
                let percent = if total > 0 { format!(" {:.0} %", 100.0 * part) } else { String::new() };
                tag(
                    painter,
                    Pos2::new(rect.left() + 14.0, y),
                    egui::Align2::LEFT_TOP,
                    &format!("Baking: {label}{percent}   (Esc stops)"),
                );
                let track =
                    Rect::from_min_size(Pos2::new(rect.left() + 14.0, y + 25.0), Vec2::new(220.0, 3.0));
                painter.rect_filled(track, 1.5, Color32::from_black_alpha(120));
                let fill = Rect::from_min_size(track.min, Vec2::new(220.0 * part, 3.0));
                painter.rect_filled(fill, 1.5, Color32::from_rgb(255, 190, 90));
                y += 36.0;
                ui.ctx().request_repaint_after(Duration::from_millis(100));
            }
        }
        if self.frame.is_none() && self.error.is_none() && y < rect.top() + 20.0 {
            tag(painter, rect.center(), egui::Align2::CENTER_CENTER, "Drawing …");
        }
        if self.look == Look::Heat {
            let text = self.heat_words();
            tag(
                painter,
                Pos2::new(rect.left() + 14.0, rect.bottom() - 14.0),
                egui::Align2::LEFT_BOTTOM,
                &text,
            );
            if self.threads.truth.is_busy() {
                ui.ctx().request_repaint_after(Duration::from_millis(200));
            }
        }
        if self.look == Look::FalseColour {
            let text = format!(
                "luminance, {FALSE_COLOUR} stops below (black) to {FALSE_COLOUR} above (pale yellow) middle grey"
            );
            tag(
                painter,
                Pos2::new(rect.left() + 14.0, rect.bottom() - 14.0),
                egui::Align2::LEFT_BOTTOM,
                &text,
            );
        }
        if let Some((text, since)) = &self.said {
            let left = Duration::from_secs(5).saturating_sub(since.elapsed());
            if left.is_zero() {
                self.said = None;
            } else {
                tag(
                    painter,
                    Pos2::new(rect.center().x, rect.bottom() - 14.0),
                    egui::Align2::CENTER_BOTTOM,
                    text,
                );
                ui.ctx().request_repaint_after(left);
            }
        }
        if let Some(e) = &self.error {
            let text = format!("{e}");
            let galley =
                painter.layout(text, egui::FontId::proportional(14.0), Color32::WHITE, rect.width() - 60.0);
            let size = galley.size() + Vec2::new(24.0, 14.0);
            let at = Rect::from_min_size(Pos2::new(rect.center().x - 0.5 * size.x, rect.top() + 14.0), size);
            painter.rect_filled(at, 6.0, Color32::from_rgb(150, 40, 36));
            painter.galley(at.min + Vec2::new(12.0, 7.0), galley, Color32::WHITE);
        }
    }

    /// The state of the reference, and the numbers of each side.
    fn heat_words(&self) -> String {
        let Some((truth, _, step)) = &self.truth else {
            let bar = &self.threads.truth_bar;
            let (done, total) = (bar.done.load(Ordering::Relaxed), bar.total.load(Ordering::Relaxed).max(1));
            return format!(
                "The reference: {} of {} passes, {:.0} %",
                0,
                STEPS.len(),
                100.0 * done as f64 / total as f64
            );
        };
        let mut text = format!(
            "FLIP to the reference, whose own error is {:.2} % at most (pass {} of {}{})",
            100.0 * truth.error,
            step + 1,
            STEPS.len(),
            if self.threads.truth.is_busy() { ", refining" } else { "" }
        );
        let history: Vec<_> = self.truth_history.iter().map(|h| format!("{:.2} %", 100.0 * h.0)).collect();
        if history.len() > 1 {
            text += &format!("\nits error pass by pass: {}", history.join(", then "));
        }
        let names = [self.kept.wish.technique.clone(), self.kept.other.clone()];
        if let Some(frame) = &self.frame {
            for (n, name) in frame.numbers.iter().zip(names) {
                let name = name.unwrap_or_else(|| "chosen".into());
                text += &format!(
                    "\n{name}: relative RMS error {:.2} %, {:.3} stops, FLIP {:.4}",
                    100.0 * n[0],
                    n[1],
                    n[2]
                );
            }
        }
        text
    }

    /// The line below the picture: what is under the pointer, times, memory.
    fn status(&mut self, ui: &mut Ui) {
        let room = ui.available_width();
        let read = self.probe().unwrap_or_else(|| "Point at the picture to read it".into());
        let mut words = Vec::new();
        if let Some(f) = &self.frame {
            words.push(format!("draw {:.0} ms", f.draw_ms));
            words.push(format!("develop {:.0} ms", f.develop_ms));
            words.push(format!("data {}", bytes(f.bytes)));
        }
        if let Some(live) = &self.lives[0] {
            words.push(format!("bake {:.2} s", self.seconds[0]));
            words.push(format!("{} triangles", live.scene().mesh.triangles.len()));
        }
        // Where there is little room, what is under the pointer matters more.
        words.truncate((room / 180.0) as usize);
        ui.horizontal(|ui| {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui.small_button("?").on_hover_text("Keys and mouse (F1)").clicked() {
                    self.help = true;
                }
                ui.label(RichText::new(words.join("  ·  ")).small())
                    .on_hover_text(self.adapter.as_ref().map_or("", |a| &a.0));
                ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                    ui.add(egui::Label::new(RichText::new(read).small()).truncate());
                });
            });
        });
    }

    /// What is under the pointer.
    fn probe(&self) -> Option<String> {
        let ([u, v], frame, live) = (self.hover?, self.frame.as_ref()?, self.lives[0].as_ref()?);
        let side = usize::from(self.kept.split && frame.films.len() > 1 && u > self.kept.wipe);
        let film = frame.films.get(side)?;
        let at = |n: usize, t: f32| ((t * n as f32) as usize).min(n.saturating_sub(1));
        let i = at(film.height, v) * film.width + at(film.width, u);
        let [r, g, b] = film.pixel(i);
        let mut text = format!("L = {} {} {} W/sr/m²", short(r), short(g), short(b));
        let camera = self.kept.wish.orbit?.camera();
        let point = [u * self.pixels[0] as f32, v * self.pixels[1] as f32];
        if let Some(p) = live.probe(camera, point, self.pixels) {
            let n = p.normal;
            text += &format!("   n = {:.2} {:.2} {:.2}   n·v = {:.2}", n.x, n.y, n.z, n.dot(p.wo));
            let shown = self.lives[side].as_ref().unwrap_or(live);
            if let Some(m) = shown.materials().get(p.material) {
                text += &format!("   {}: ±{:.1} % ({})", m.method.slug(), 100.0 * m.error(), m.known());
            }
        }
        if let Some((truth, ..)) = &self.truth {
            let t = &truth.film;
            let j = at(t.height, v) * t.width + at(t.width, u);
            let y = steradian_render::tone::luminance;
            let (is, should) = (y([r, g, b]), y(t.pixel(j)));
            if should > 0.0 {
                text += &format!("   here {:+.1} % off the reference", 100.0 * (is / should - 1.0));
            }
        }
        Some(text)
    }

    /// The controls.
    fn panel(&mut self, ui: &mut Ui) {
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            ui.heading("Steradian");
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let dark = ui.visuals().dark_mode;
                if ui.small_button(if dark { "Light" } else { "Dark" }).on_hover_text("D").clicked() {
                    self.kept.theme = if dark { Theme::Light } else { Theme::Dark };
                    self.set_theme(ui.ctx());
                }
                if ui.add_enabled(!self.redo.is_empty(), egui::Button::new("Redo").small()).clicked() {
                    self.again();
                }
                if ui
                    .add_enabled(!self.undo.is_empty(), egui::Button::new("Undo").small())
                    .on_hover_text("Ctrl Z")
                    .clicked()
                {
                    self.back();
                }
            });
        });
        ui.add_space(4.0);
        egui::ScrollArea::vertical().auto_shrink([false, true]).show(ui, |ui| {
            self.object(ui);
            self.light(ui);
            self.material(ui);
            self.technique(ui);
            self.display(ui);
            ui.add_space(12.0);
        });
    }

    fn object(&mut self, ui: &mut Ui) {
        section(ui, "Object", "Drop a mesh or a scene file onto the window");
        let wish = &mut self.kept.wish;
        let shapes = &steradian_scene::shapes::SHAPES;
        let name = split_spec(&wish.input).0.to_owned();
        let known = shapes.iter().any(|s| s.name == name);
        let shown = if known { name.clone() } else { file_name(&wish.input) };
        egui::ComboBox::from_id_salt("object")
            .width(ui.available_width() - 8.0)
            .selected_text(shown)
            .show_ui(ui, |ui| {
                for s in shapes.iter() {
                    if ui.selectable_label(s.name == name, s.name).on_hover_text(s.about).clicked() {
                        (wish.input, wish.orbit, wish.normal_map) = (s.name.into(), None, None);
                        wish.brdf.get_or_insert_with(|| Wish::default().brdf.unwrap_or_default());
                        wish.light.get_or_insert_with(|| "studio".into());
                    }
                }
            });
        if !wish.is_scene() {
            let mut ground = wish.ground.is_some();
            if ui.checkbox(&mut ground, "Ground").changed() {
                wish.ground = ground.then(|| "lambert:albedo=0.4".into());
            }
        }
        let mut cleared = false;
        if let Some(map) = &wish.normal_map {
            ui.horizontal(|ui| {
                ui.label(format!("normal map {}", file_name(map)));
                cleared = ui.small_button("×").clicked();
            });
        }
        if cleared {
            wish.normal_map = None;
        }
    }

    fn light(&mut self, ui: &mut Ui) {
        section(ui, "Light", "Drop an HDR image onto the window; Shift and drag in the picture turns it");
        let wish = &mut self.kept.wish;
        let names = steradian_light::sky::NAMES;
        let spec = wish.light.clone().unwrap_or_default();
        let at = names.iter().position(|n| *n == split_spec(&spec).0);
        let shown = match at {
            Some(k) => names[k].to_owned(),
            None if spec.is_empty() => "of the scene file".into(),
            None => file_name(&spec),
        };
        egui::ComboBox::from_id_salt("light").width(ui.available_width() - 8.0).selected_text(shown).show_ui(
            ui,
            |ui| {
                if wish.is_scene() && ui.selectable_label(wish.light.is_none(), "of the scene file").clicked()
                {
                    wish.light = None;
                }
                for (k, n) in names.iter().enumerate() {
                    if ui.selectable_label(at == Some(k), *n).clicked() {
                        (wish.light, wish.exposure) = (Some((*n).into()), None);
                    }
                }
            },
        );
        if let Some(k) = at
            && let Some(new) = controls::of_spec(ui, &spec, steradian_light::sky::PARAMETERS[k])
        {
            wish.light = Some(new);
        }
        ui.horizontal(|ui| {
            controls::label(ui, "turned");
            ui.spacing_mut().slider_width = (ui.available_width() - 58.0).max(40.0);
            let slider = egui::Slider::new(&mut wish.turn, -180.0..=180.0).suffix("°").max_decimals(1);
            if ui.add(slider).changed() {
                self.moved = Instant::now();
            }
        });
    }

    fn material(&mut self, ui: &mut Ui) {
        section(ui, "Material", "Drop a file of measurements onto the window");
        let wish = &mut self.kept.wish;
        if let Some(file) = wish.bake.clone() {
            ui.horizontal(|ui| {
                ui.label(format!("bake {}", file_name(&file)));
                if ui.small_button("×").clicked() {
                    wish.bake = None;
                }
            });
            return;
        }
        let spec = wish.brdf.clone().unwrap_or_default();
        let name = split_spec(&spec).0.to_owned();
        let model = steradian_brdf::models().iter().find(|m| m.name == name);
        let shown = if spec.is_empty() { "of the file".into() } else { name.clone() };
        egui::ComboBox::from_id_salt("material")
            .width(ui.available_width() - 8.0)
            .selected_text(shown)
            .show_ui(ui, |ui| {
                if ui.selectable_label(spec.is_empty(), "of the file").clicked() {
                    wish.brdf = None;
                }
                for m in steradian_brdf::models() {
                    let Some(first) = controls::first_spec(m.name, m.parameters) else { continue };
                    if ui.selectable_label(m.name == name, m.name).on_hover_text(m.source).clicked() {
                        wish.brdf = Some(first);
                    }
                }
            });
        match model {
            Some(m) => {
                if let Some(new) = controls::of_spec(ui, &spec, m.parameters) {
                    wish.brdf = Some(new);
                }
            }
            None if !spec.is_empty() => {
                ui.label(RichText::new(spec).small());
            }
            None => {}
        }
    }

    fn technique(&mut self, ui: &mut Ui) {
        section(ui, "Technique", "T and Shift T step through them");
        let brdf = self.lives[0].as_ref().and_then(|l| l.scene().materials.first().map(|m| m.brdf.clone()));
        let chosen = self.lives[0].as_ref().and_then(|l| l.materials().first().map(|m| m.method.slug()));
        let wish = &mut self.kept.wish;
        if let Some(new) = pick(ui, "technique", &wish.technique, brdf.as_deref()) {
            (wish.technique, wish.bake) = (new, None);
        }
        let slug = wish.technique.as_deref().or(chosen);
        if let Some(t) = slug.and_then(steradian_techniques::find) {
            ui.label(RichText::new(t.card().citation).small().weak());
            if wish.technique.is_some() && !t.params().is_empty() {
                let given = wish.params.get(t.card().slug).map(String::as_str).unwrap_or_default();
                let mut values = steradian_base::ParamValues::parse(given, t.params()).unwrap_or_default();
                if controls::of_values(ui, &mut values, t.params()) {
                    wish.params.insert(t.card().slug.into(), values.body(t.params()));
                }
            }
        }
        if let Some(c) = self.lives[0].as_ref().and_then(|l| l.certificate()) {
            ui.label(format!("Error {:.2} % ({})", 100.0 * c.error, c.known.word()))
                .on_hover_text("Relative RMS error of radiance over all normals and views, as certified");
        }
        ui.checkbox(&mut self.kept.split, "Beside another").on_hover_text("B; drag the line in the picture");
        if self.kept.split
            && let Some(new) = pick(ui, "other", &self.kept.other, brdf.as_deref())
        {
            self.kept.other = new;
        }
    }

    fn display(&mut self, ui: &mut Ui) {
        section(ui, "Display", "");
        let ev = self.frame.as_ref().map_or(0.0, |f| f.ev);
        let wish = &mut self.kept.wish;
        ui.horizontal(|ui| {
            controls::label(ui, "exposure");
            let mut auto = wish.exposure.is_none();
            if ui.checkbox(&mut auto, "auto").on_hover_text("A; [ and ] change it").changed() {
                wish.exposure = if auto { None } else { Some(ev) };
            }
            let mut x = wish.exposure.unwrap_or(ev);
            if ui.add(egui::DragValue::new(&mut x).speed(0.02).max_decimals(2).suffix(" EV")).changed() {
                wish.exposure = Some(x);
            }
        });
        ui.horizontal(|ui| {
            controls::label(ui, "tone mapper");
            egui::ComboBox::from_id_salt("tone").selected_text(wish.tone_mapper.clone()).show_ui(ui, |ui| {
                for t in ToneMapper::ALL {
                    ui.selectable_value(&mut wish.tone_mapper, t.name().into(), t.name());
                }
            });
        });
        ui.horizontal_wrapped(|ui| {
            ui.selectable_value(&mut self.look, Look::Picture, "Picture");
            ui.selectable_value(&mut self.look, Look::FalseColour, "False colour").on_hover_text("F");
            ui.selectable_value(&mut self.look, Look::Heat, "Error")
                .on_hover_text("H: FLIP to the reference, which is computed beside the window");
        });
        ui.add_space(6.0);
        ui.horizontal_wrapped(|ui| {
            if ui.button("Screenshot").on_hover_text("S: a PNG in the working folder").clicked() {
                self.screenshot();
            }
            if ui
                .button("Copy command")
                .on_hover_text("C: the command line that makes this picture")
                .clicked()
            {
                self.copy_command(ui.ctx());
            }
            if ui
                .button("Save scene")
                .on_hover_text("E: a scene file and copies of its files, in a new folder")
                .clicked()
            {
                self.export();
            }
            if ui.button("First view").on_hover_text("0, or a double click").clicked() {
                self.home();
            }
        });
    }

    fn help(&mut self, ui: &Ui) {
        if !self.help {
            return;
        }
        let mut shown = true;
        egui::Window::new("Keys and mouse").open(&mut shown).collapsible(false).resizable(false).show(
            ui.ctx(),
            |ui| {
                egui::Grid::new("keys").num_columns(2).spacing([24.0, 4.0]).striped(true).show(ui, |ui| {
                    for (key, what) in KEYS {
                        ui.label(RichText::new(*key).strong());
                        ui.label(*what);
                        ui.end_row();
                    }
                });
            },
        );
        self.help = shown;
    }
}

/// What keys and the mouse do.
const KEYS: &[(&str, &str)] = &[
    ("drag, arrow keys", "turn around the object"),
    ("Shift drag, Shift arrows", "turn the light"),
    ("right drag, Alt arrows", "move"),
    ("wheel, pinch, + −", "nearer and farther"),
    ("double click, 0", "the first view"),
    ("T, Shift T", "next technique, the one before"),
    ("L, M", "next light, next material"),
    ("B, then , and .", "beside another technique; move the line"),
    ("H, F", "error against the reference, false colour"),
    ("[ ] and A", "darker, brighter; automatic exposure"),
    ("O", "next tone mapper"),
    ("S, C, E", "screenshot; copy the command that makes this picture; save the scene"),
    ("Ctrl Z, Ctrl Y", "undo, redo"),
    ("P, D", "panel; dark or light"),
    ("Esc, Ctrl Q", "stop a bake; close the window"),
];

impl eframe::App for App {
    fn ui(&mut self, ui: &mut Ui, _: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.listen(&ctx);
        self.drop_files(&ctx);
        self.keys(&ctx);
        let calm = egui::Frame::side_top_panel(ui.style()).inner_margin(egui::Margin::symmetric(14, 4));
        if self.kept.panel {
            egui::Panel::left("controls")
                .frame(calm)
                .default_size(300.0)
                .size_range(240.0..=420.0)
                .show(ui, |ui| self.panel(ui));
        }
        egui::Panel::bottom("status").frame(calm).show(ui, |ui| self.status(ui));
        egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| self.picture(ui));
        self.help(ui);
        self.commit(&ctx);
        self.ask(&ctx);
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        if let Ok(text) = serde_json::to_string(&self.kept) {
            storage.set_string("steradian", text);
        }
    }

    fn on_exit(&mut self) {
        self.threads.close();
    }
}

/// A picker of techniques; those that do not take the material say why. The new one where another was picked.
fn pick(
    ui: &mut Ui,
    id: &str,
    now: &Option<String>,
    brdf: Option<&dyn steradian_brdf::Brdf>,
) -> Option<Option<String>> {
    let mut new = None;
    let shown = now
        .as_deref()
        .and_then(steradian_techniques::find)
        .map_or("the best for the material", |t| t.card().title);
    let width = ui.available_width() - 8.0;
    egui::ComboBox::from_id_salt(id).width(width).truncate().selected_text(shown).height(420.0).show_ui(
        ui,
        |ui| {
            if ui.selectable_label(now.is_none(), "the best for the material").clicked() {
                new = Some(None);
            }
            for t in steradian_techniques::registry() {
                let card = t.card();
                let why = brdf.and_then(|b| (card.materials)(b).err());
                ui.add_enabled_ui(why.is_none(), |ui| {
                    let label = ui.selectable_label(now.as_deref() == Some(card.slug), card.title);
                    let about = format!("{}\n{}\n{}", card.slug, card.equation, card.citation);
                    let label = label.on_hover_text(about).on_disabled_hover_text(why.unwrap_or_default());
                    if label.clicked() {
                        new = Some(Some(card.slug.to_owned()));
                    }
                });
            }
        },
    );
    new
}

fn section(ui: &mut Ui, title: &str, hint: &str) {
    ui.add_space(12.0);
    let label = ui.label(RichText::new(title).strong());
    if !hint.is_empty() {
        label.on_hover_text(hint);
    }
    ui.add_space(2.0);
}

/// Text on a dark ground.
fn tag(painter: &egui::Painter, at: Pos2, align: egui::Align2, text: &str) {
    let width = (painter.clip_rect().width() - 44.0).max(80.0);
    let galley = painter.layout(text.into(), egui::FontId::proportional(13.0), Color32::WHITE, width);
    let size = galley.size() + Vec2::new(16.0, 8.0);
    let rect = align.anchor_size(at, size);
    painter.rect_filled(rect, 5.0, Color32::from_black_alpha(165));
    painter.galley(rect.min + Vec2::new(8.0, 4.0), galley, Color32::WHITE);
}

fn style(ctx: &egui::Context) {
    ctx.all_styles_mut(|style| {
        style.spacing.item_spacing = Vec2::new(8.0, 5.0);
        style.spacing.interact_size.y = 22.0;
    });
}

/// Degrees in −180 … 180.
fn degrees(x: f64) -> f64 {
    (((x + 180.0).rem_euclid(360.0) - 180.0) * 10.0).round() / 10.0
}

fn file_name(path: &str) -> String {
    Path::new(path).file_name().map_or_else(|| path.into(), |n| n.to_string_lossy().into_owned())
}

fn bytes(n: usize) -> String {
    match n {
        0..1_000 => format!("{n} B"),
        1_000..1_000_000 => format!("{:.1} kB", n as f64 / 1e3),
        _ => format!("{:.1} MB", n as f64 / 1e6),
    }
}

/// Three digits.
fn short(x: f32) -> String {
    if x != 0.0 && !(0.01..1000.0).contains(&x.abs()) { format!("{x:.2e}") } else { format!("{x:.3}") }
}

/// The reflectance that a file of measurements holds, by whichever reader takes it.
fn measured(file: &str) -> Result<String, String> {
    let mut session = Session::new();
    let mut first = None;
    for model in steradian_brdf::measured_models() {
        let Some(info) = model.parameters.iter().find(|p| p.kind == steradian_base::Kind::File) else {
            continue;
        };
        let spec = if info.positional {
            format!("{}:{file}", model.name)
        } else {
            format!("{}:{}={file}", model.name, info.name)
        };
        match session.brdf(&spec) {
            Ok(_) => return Ok(spec),
            Err(e) => {
                first.get_or_insert_with(|| e.to_string());
            }
        }
    }
    Err(format!("{file}: is no light, mesh, scene, map, bake or measured reflectance that is known here"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_window_systems_say_becomes_a_line() {
        let e = explained(
            "winit EventLoopError: neither WAYLAND_DISPLAY nor WAYLAND_SOCKET nor DISPLAY is set.\nmore",
        );
        assert!(e.starts_with("no display") && !e.contains('\n'), "{e}");
    }

    #[test]
    fn turns_stay_within_half_a_circle() {
        assert_eq!([degrees(190.0), degrees(-190.0), degrees(12.34)], [-170.0, 170.0, 12.3]);
    }

    #[test]
    fn a_file_of_nothing_known_is_refused_in_a_line() {
        let e = measured("/nonexistent/file.abc").expect_err("no such file");
        assert!(e.contains("file.abc") && !e.contains('\n'), "{e}");
    }
}
