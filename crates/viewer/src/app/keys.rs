//! What keys and menus do.

use super::App;
use super::{DisplayMode, REST, Theme, UNDO, degrees};
use crate::{Orbit, Shot, Wish, controls};
use eframe::egui::{self, Key, Modifiers};
use std::path::PathBuf;
use std::time::Instant;
use steradian_base::split_spec;
use steradian_render::ToneMapper;
use steradian_session::{ANIMATION, Session};

/// Frames of a turn: three seconds.
const TURN: usize = 72;

impl App {
    pub(super) fn keys(&mut self, ctx: &egui::Context) {
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
        for (key, hours) in [(Key::J, -0.25), (Key::K, 0.25)] {
            if pressed(key) {
                self.later(hours);
            }
        }
        if pressed(Key::H) {
            self.mode = if self.mode == DisplayMode::Heat { DisplayMode::Picture } else { DisplayMode::Heat };
        }
        if pressed(Key::F) {
            self.mode = if self.mode == DisplayMode::FalseColour {
                DisplayMode::Picture
            } else {
                DisplayMode::FalseColour
            };
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
        if pressed(Key::R) {
            self.turntable();
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
            self.threads.stop_turning();
            (self.help, self.error) = (false, None);
        }
    }

    pub(super) fn back(&mut self) {
        if let Some(before) = self.undo.pop() {
            self.redo.push(std::mem::replace(&mut self.kept.wish, before.clone()));
            self.committed = before;
            self.moved = Instant::now();
        }
    }

    pub(super) fn again(&mut self) {
        if let Some(after) = self.redo.pop() {
            self.undo.push(std::mem::replace(&mut self.kept.wish, after.clone()));
            self.committed = after;
            self.moved = Instant::now();
        }
    }

    /// What was changed becomes a step that can be undone, once nothing is held any more.
    pub(super) fn commit(&mut self, ctx: &egui::Context) {
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
    pub(super) fn techniques(&self) -> Vec<&'static str> {
        let brdf = self.lives[0].as_ref().and_then(|l| l.scene().materials.first().map(|m| m.brdf.clone()));
        let takes = |t: &&'static dyn steradian_techniques::AnyTechnique| {
            brdf.as_ref().is_none_or(|b| (t.card().materials)(&**b).is_ok())
        };
        steradian_techniques::registry().iter().copied().filter(takes).map(|t| t.card().slug).collect()
    }

    pub(super) fn next_technique(&mut self, by: isize) {
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

    pub(super) fn next_light(&mut self) {
        let names = steradian_light::sky::NAMES;
        let now = self.kept.wish.light.clone().unwrap_or_default();
        let at = names.iter().position(|n| *n == split_spec(&now).0).map_or(0, |k| k + 1);
        self.kept.wish.light = Some(names[at % names.len()].into());
        self.kept.wish.exposure = None;
    }

    pub(super) fn next_model(&mut self) {
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

    pub(super) fn next_mapper(&mut self) {
        let all = ToneMapper::ALL;
        let at = all.iter().position(|t| t.name() == self.kept.wish.tone_mapper).map_or(0, |k| k + 1);
        self.kept.wish.tone_mapper = all[at % all.len()].name().into();
        self.note(format!("tone mapper {}", self.kept.wish.tone_mapper));
    }

    /// The first view.
    pub(super) fn home(&mut self) {
        if let Some(live) = &self.lives[0] {
            self.kept.wish.orbit = Some(Orbit::of(&live.camera()));
        }
        (self.kept.wish.turn, self.kept.wish.exposure) = (0.0, None);
        self.moved = Instant::now();
    }

    pub(super) fn command(&self) -> Option<String> {
        let frame = self.frame.as_ref()?;
        Some(self.kept.wish.command(frame.size, frame.ev))
    }

    pub(super) fn copy_command(&mut self, ctx: &egui::Context) {
        if let Some(command) = self.command() {
            ctx.copy_text(command);
            self.note("the command line that makes this picture is in the clipboard");
        }
    }

    /// Draws a full turn of the camera into the working folder, under a name that is free.
    pub(super) fn turntable(&mut self) {
        let Some(frame) = &self.frame else { return };
        let free =
            (1..10_000).map(|k| PathBuf::from(format!("steradian-{k:04}.{ANIMATION}"))).find(|f| !f.exists());
        let Some(file) = free.filter(|_| !self.threads.is_turning()) else { return };
        // Half a window is enough to send around.
        let size = frame.size.map(|n| n.div_ceil(2));
        let wish = Wish { exposure: Some(frame.ev), ..self.kept.wish.clone() };
        self.threads.turn(wish, Shot { file, frames: TURN, size });
        self.note(format!("drawing {TURN} frames of a turn (Esc stops)"));
    }

    /// Writes the picture into the working folder, under a name that is free.
    pub(super) fn screenshot(&mut self) {
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
    pub(super) fn export(&mut self) {
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
}

/// What keys and the mouse do.
pub(super) const KEYS: &[(&str, &str)] = &[
    ("drag, arrow keys", "turn around the object"),
    ("Shift drag, Shift arrows", "turn the light"),
    ("right drag, Alt arrows", "move"),
    ("wheel, pinch, + −", "nearer and farther"),
    ("double click, 0", "the first view"),
    ("T, Shift T", "next technique, the one before"),
    ("L, M", "next light, next material"),
    ("drag a sun in the round map", "moves it; a sun in an image turns with the light"),
    ("J, K", "a quarter of an hour earlier, later, under a sky with a sun"),
    ("B, then , and .", "beside another technique; move the line"),
    ("H, F", "error against the reference, false colour"),
    ("[ ] and A", "darker, brighter; automatic exposure"),
    ("O", "next tone mapper"),
    ("S, C, E", "screenshot; copy the command that makes this picture; save the scene"),
    ("R", "a full turn of the camera as an animated PNG"),
    ("Ctrl Z, Ctrl Y", "undo, redo"),
    ("P, D", "panel; dark or light"),
    ("Esc, Ctrl Q", "stop a bake; close the window"),
];
