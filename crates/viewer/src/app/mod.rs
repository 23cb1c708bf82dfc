//! The window.

mod dropped;
mod keys;
mod panel;
mod picture;
mod suns;
mod threads;

use crate::paint::{DisplayMode, Frame, Painter, View};
use crate::{Error, Orbit, Wish};
use eframe::egui::{self, Color32, Pos2, RichText, Ui, Vec2};
use keys::KEYS;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use steradian_render::ToneMapper;
use steradian_session::live::{Live, Truth};
use threads::{Order, Threads};

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
    Dropped(Result<dropped::Change, String>),
    Turned(Result<PathBuf, String>),
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
    /// The wish that each of `lives` was baked for.
    baked: [Option<Wish>; 2],
    seconds: [f64; 2],
    adapter: Option<(String, bool)>,
    error: Option<String>,
    /// What to go back to if a dropped file turns out broken.
    before_drop: Option<Wish>,
    frame: Option<Box<Frame>>,
    textures: Vec<egui::TextureHandle>,
    drawn: Option<Drawn>,
    mode: DisplayMode,
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
    /// Unit directions to the suns of the light before it is turned, and the one that the mouse holds.
    suns: Vec<glam::Vec3>,
    holding: Option<usize>,
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
            && (a.camera, a.turn, a.size, a.exposure, a.mapper, a.mode, a.still, &a.sky)
                == (b.camera, b.turn, b.size, b.exposure, b.mapper, b.mode, b.still, &b.sky)
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
            baked: [None, None],
            seconds: [0.0; 2],
            adapter: None,
            error: None,
            before_drop: None,
            frame: None,
            textures: Vec::new(),
            drawn: None,
            mode: DisplayMode::Picture,
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
            suns: Vec::new(),
            holding: None,
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
                        // What is shown is baked for that; a bake of it would take the message away.
                        if self.lives[0].as_ref().is_some_and(|live| !live.is_preview()) {
                            self.asked[0] = self.baked[0].clone();
                        }
                    }
                }
                Said::Baked { side, wish, made: Ok(live), seconds } => {
                    if self.kept.wish.orbit.is_none() || self.lives[0].is_none() && wish.orbit.is_none() {
                        self.kept.wish.orbit = Some(Orbit::of(&live.camera()));
                        self.committed = self.kept.wish.clone();
                    }
                    if side == 0 && self.holding.is_none() {
                        self.suns = suns::suns(&live.scene().lights);
                    }
                    self.lives[side] = Some(live);
                    self.baked[side] = Some(*wish);
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
                    if frame.unfinished {
                        self.drawn = None;
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
                Said::Dropped(Ok(change)) => {
                    self.before_drop = Some(self.kept.wish.clone());
                    if let Some(note) = change(&mut self.kept.wish) {
                        self.note(note);
                    }
                }
                Said::Dropped(Err(e)) | Said::Turned(Err(e)) => self.error = Some(e),
                Said::Turned(Ok(file)) => {
                    let at = std::path::absolute(&file).unwrap_or(file);
                    self.note(at.display().to_string());
                }
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

    /// Why a GPU does not filter the sky of a side anew while its sun moves.
    fn not_filtered(&self, live: &Live) -> Option<String> {
        match self.adapter {
            Some((_, false)) => live.light_tables().err(),
            // It would take the bakes' processors, and longer.
            _ => Some("the adapter computes on the CPU".into()),
        }
    }

    /// The sky that a side follows until there is a bake for it: one with a sun elsewhere, where nothing else
    /// has changed.
    fn follows(&self, side: usize, plain: &Wish) -> Option<String> {
        let (live, baked, spec) =
            (self.lives[side].as_ref()?, self.baked[side].as_ref()?, plain.light.as_ref()?);
        let before = live.light_name();
        let sunny = |spec: &str| suns::of_spec(spec).is_some();
        let light_alone = || Wish { light: plain.light.clone(), ..baked.clone() } == *plain;
        let follows = before != spec
            && sunny(before)
            && sunny(spec)
            && light_alone()
            && self.not_filtered(live).is_none();
        follows.then(|| spec.clone())
    }

    /// Asks for what has changed.
    fn ask(&mut self, ctx: &egui::Context) {
        let still = self.moved.elapsed() >= REST;
        let mut sky = None;
        for side in 0..if self.kept.split { 2 } else { 1 } {
            let of = self.side(side);
            // What needs no bake is not asked for.
            let plain = Wish { turn: 0.0, exposure: None, orbit: None, tone_mapper: String::new(), ..of };
            let follows = self.follows(side, &plain);
            if self.asked[side].as_ref() != Some(&plain) {
                if follows.is_some() && !still {
                    // Each bake would be stopped by the next step of the sun.
                    self.threads.bakes[side].cancel();
                    self.asked[side] = None;
                } else {
                    self.asked[side] = Some(plain.clone());
                    self.threads.bakes[side].ask(Order { wish: plain, preview: follows.is_none() });
                }
            }
            sky = sky.or(follows);
        }
        if let Some(sun) = sky.as_deref().and_then(suns::direction_of) {
            self.suns = vec![sun];
        }
        let Some(orbit) = self.kept.wish.orbit else { return };
        let mut sides: Vec<_> = self.lives[0].iter().cloned().collect();
        if self.kept.split {
            sides.extend(self.lives[1].iter().cloned());
        }
        if sides.is_empty() || self.pixels.contains(&0) || self.adapter.is_none() {
            return;
        }
        if !still {
            ctx.request_repaint_after(REST);
        }
        let posed = Posed { live: sides[0].clone(), orbit, turn: self.kept.wish.turn, size: self.pixels };
        if self.mode == DisplayMode::Heat && still {
            if self.truth_asked.as_ref() != Some(&posed) {
                self.truth_asked = Some(posed.clone());
                self.truth_history.clear();
                self.truth = None;
                self.threads.truth.ask(posed.clone());
            }
        } else if self.truth_asked.is_some()
            && (self.mode != DisplayMode::Heat || self.truth_asked.as_ref() != Some(&posed))
        {
            self.threads.truth.cancel();
            self.truth_asked = None;
            self.truth = None;
        }
        // The first picture comes soon rather than whole.
        let first = self.frame.is_none();
        let half = first || !still && self.still_ms > SLOW;
        let size = if half { self.pixels.map(|n| n.div_ceil(2)) } else { self.pixels };
        let view = View {
            sides,
            camera: orbit.camera(),
            turn: self.kept.wish.turn,
            size,
            exposure: self.kept.wish.exposure,
            mapper: ToneMapper::from_name(&self.kept.wish.tone_mapper).unwrap_or_default(),
            mode: self.mode,
            truth: self.truth.as_ref().map(|t| t.0.clone()),
            still: still && !first,
            sky,
        };
        let drawn = Drawn(view);
        if self.drawn.as_ref() != Some(&drawn) {
            self.threads.paint.ask_next(drawn.0.clone());
            self.drawn = Some(drawn);
        }
    }

    fn help(&mut self, ui: &Ui) {
        if !self.help {
            return;
        }
        let mut shown = true;
        let rows = |ui: &mut Ui| {
            for (key, what) in KEYS {
                ui.label(RichText::new(*key).strong());
                ui.label(*what);
                ui.end_row();
            }
        };
        let window = egui::Window::new("Keys and mouse").open(&mut shown).collapsible(false).resizable(false);
        // Small windows scroll.
        window.vscroll(true).show(ui.ctx(), |ui| {
            egui::Grid::new("keys").num_columns(2).spacing([24.0, 4.0]).striped(true).show(ui, rows);
        });
        self.help = shown;
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut Ui, _: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.listen(&ctx);
        self.drop_files(&ctx);
        let (bake, light) = (self.kept.wish.bake.clone(), self.kept.wish.light.clone());
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
        // A saved bake holds no other light than its own.
        let wish = &mut self.kept.wish;
        wish.bake.take_if(|b| Some(&*b) == bake.as_ref() && wish.light != light);
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
        style.text_styles.insert(egui::TextStyle::Small, egui::FontId::proportional(11.0));
    });
}

/// Degrees in −180 … 180.
fn degrees(x: f64) -> f64 {
    (((x + 180.0).rem_euclid(360.0) - 180.0) * 10.0).round() / 10.0
}

fn file_name(path: &str) -> String {
    Path::new(path).file_name().map_or_else(|| path.into(), |n| n.to_string_lossy().into_owned())
}

/// Three digits.
fn short(x: f32) -> String {
    if x != 0.0 && !(0.01..1000.0).contains(&x.abs()) { format!("{x:.2e}") } else { format!("{x:.3}") }
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
}
