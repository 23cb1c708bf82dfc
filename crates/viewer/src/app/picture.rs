//! The picture: what the mouse does in it, and what is written over and below it.

use super::{App, DisplayMode, degrees, short, suns, tag};
use crate::paint::FALSE_COLOUR;
use crate::reference::STEPS;
use eframe::egui::{self, Color32, Pos2, Rect, RichText, Sense, Ui, Vec2};
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};
use steradian_render::Film;
use steradian_session::live::Live;
use steradian_session::size_in_words;

impl App {
    /// The picture, and what the mouse does in it.
    pub(super) fn picture(&mut self, ui: &mut Ui) {
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

    pub(super) fn mouse(&mut self, ui: &Ui, response: &egui::Response, rect: Rect, wipe: Option<f32>) {
        let pointer = response.hover_pos();
        self.hover =
            pointer.map(|p| [(p.x - rect.left()) / rect.width(), (p.y - rect.top()) / rect.height()]);
        let near = |p: Option<Pos2>| wipe.zip(p).is_some_and(|(w, p)| (p.x - w).abs() < 8.0);
        let under = self.sun_at(rect, pointer);
        if response.drag_started() {
            let origin = ui.input(|i| i.pointer.press_origin());
            self.holding = self.sun_at(rect, origin);
            self.wiping = self.holding.is_none() && near(origin);
        }
        if under.is_some() || self.holding.is_some() {
            ui.ctx().set_cursor_icon(egui::CursorIcon::Grab);
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
        if let (true, Some(k), Some(at)) =
            (response.dragged() && d != Vec2::ZERO, self.holding, response.interact_pointer_pos())
        {
            self.drag_sun(k, rect, at);
        } else if response.dragged() && self.wiping {
            self.kept.wipe = (self.kept.wipe + d.x / rect.width()).clamp(0.0, 1.0);
        } else if let (true, true, Some(at)) = (response.drag_stopped(), self.wiping, released(ui)) {
            // The button comes up in the frame of the last motion, which is no part of the drag.
            self.kept.wipe = ((at.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
        } else if response.dragged() && self.holding.is_none() && d != Vec2::ZERO {
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
            (self.wiping, self.holding) = (false, None);
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
    pub(super) fn overlay(&mut self, ui: &mut Ui, painter: &egui::Painter, rect: Rect) {
        self.draw_suns(painter, rect, self.sun_at(rect, ui.input(|i| i.pointer.hover_pos())));
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
                ui.ctx().request_repaint_after(Duration::from_millis(250));
            }
        }
        if self.frame.is_none() && self.error.is_none() && y < rect.top() + 20.0 {
            tag(painter, rect.center(), egui::Align2::CENTER_CENTER, "Drawing …");
        }
        if self.mode == DisplayMode::Heat {
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
        if self.mode == DisplayMode::FalseColour {
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
                // Words about the picture stand at the lower left.
                let plain = self.mode == DisplayMode::Picture;
                let (x, align) = match plain {
                    true => (rect.center().x, egui::Align2::CENTER_BOTTOM),
                    false => (rect.right() - 14.0, egui::Align2::RIGHT_BOTTOM),
                };
                tag(painter, Pos2::new(x, rect.bottom() - 14.0), align, text);
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
    pub(super) fn heat_words(&self) -> String {
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
        let shadows = |live: &Live| live.materials().iter().any(|m| m.knows_shadows());
        if self.lives.iter().flatten().any(|live| shadows(live)) {
            text += "\nthe reference knows no shadows: those in the picture count as errors";
        }
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
    pub(super) fn status(&mut self, ui: &mut Ui) {
        let room = ui.available_width();
        let read = self.probe().unwrap_or_else(|| "Point at the picture to read it".into());
        let mut words = Vec::new();
        if let Some(f) = &self.frame {
            words.extend(self.moving_sky(f.filter_ms));
            words.push(format!("draw {:.0} ms", f.draw_ms));
            words.push(format!("develop {:.0} ms", f.develop_ms));
            words.push(format!("data {}", size_in_words(f.bytes as u64)));
        }
        if let Some(live) = &self.lives[0] {
            words.push(format!("bake {:.2} s", self.seconds[0]));
            words.push(format!("{} triangles", live.scene().mesh.triangles.len()));
        }
        // Where there is little room, what is under the pointer matters more.
        const LETTER: f32 = 5.5;
        const WORD: f32 = 110.0;
        let left = room - LETTER * read.chars().count() as f32;
        words.truncate((left / WORD).max(0.0) as usize);
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

    /// How the objects follow a sky that is not baked yet.
    fn moving_sky(&self, filter_ms: Option<f64>) -> Option<String> {
        if let Some(ms) = filter_ms {
            return Some(format!("sky filtered on the GPU, {ms:.0} ms"));
        }
        let live = self.lives[0].as_ref().filter(|_| self.threads.bakes[0].is_busy())?;
        let moved = self.kept.wish.light.as_ref().is_some_and(|s| s != live.light_name());
        let sunny = suns::of_spec(live.light_name()).is_some() && (moved || live.is_preview());
        self.not_filtered(live).filter(|_| sunny).map(|why| format!("sky by previews: {why}"))
    }

    /// What is under the pointer: the surface, and of each side the radiance, its certificate and its true
    /// error.
    pub(super) fn probe(&self) -> Option<String> {
        let ([u, v], frame, live) = (self.hover?, self.frame.as_ref()?, self.lives[0].as_ref()?);
        let at = |n: usize, t: f32| ((t * n as f32) as usize).min(n.saturating_sub(1));
        let pixel = |film: &Film| film.pixel(at(film.height, v) * film.width + at(film.width, u));
        let y = steradian_render::tone::luminance;
        let should = self.truth.as_ref().map(|(truth, ..)| y(pixel(&truth.film))).filter(|y| *y > 0.0);
        let camera = self.kept.wish.orbit?.camera();
        let point = [u * self.pixels[0] as f32, v * self.pixels[1] as f32];
        let under = live.probe(camera, point, self.pixels);
        let side = |(film, shown): (&Arc<Film>, &Option<Arc<Live>>)| {
            let rgb = pixel(film);
            let [r, g, b] = rgb.map(short);
            let mut text = format!("L = {r} {g} {b} W/sr/m²");
            let shown = shown.as_ref().filter(|l| !l.is_preview());
            if let Some(m) = under.as_ref().zip(shown).and_then(|(p, l)| l.materials().get(p.material)) {
                text += &format!(", {} ±{:.1} % ({})", m.method.slug(), 100.0 * m.error(), m.known());
            }
            if let Some(should) = should {
                text += &format!(", here {:+.1} %", 100.0 * (y(rgb) / should - 1.0));
            }
            text
        };
        let mut words: Vec<String> = frame.films.iter().zip(&self.lives).map(side).collect();
        if let Some(p) = &under {
            let three = |v: glam::Vec3| format!("{:.2} {:.2} {:.2}", v.x, v.y, v.z);
            words.push(format!("n = {}", three(p.normal)));
            words.push(format!("v = {}", three(p.wo)));
            words.push(format!("n·v = {:.2}", p.normal.dot(p.wo)));
        }
        Some(words.join("   "))
    }
}

/// Where a button came up in this frame.
fn released(ui: &Ui) -> Option<Pos2> {
    let up = |e: &egui::Event| match e {
        egui::Event::PointerButton { pos, pressed: false, .. } => Some(*pos),
        _ => None,
    };
    ui.input(|i| i.events.iter().find_map(up))
}
