//! The controls beside the picture.

use super::{App, DisplayMode, Theme, file_name, section, suns};
use crate::wish::{GROUND, SHADOWS};
use crate::{Wish, controls};
use eframe::egui::{self, RichText, Ui};
use std::time::Instant;
use steradian_base::split_spec;
use steradian_render::ToneMapper;

impl App {
    /// The controls.
    pub(super) fn panel(&mut self, ui: &mut Ui) {
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

    pub(super) fn object(&mut self, ui: &mut Ui) {
        section(ui, "Object", "Drop a mesh or a scene file onto the window");
        let wish = &mut self.kept.wish;
        let shapes = &steradian_scene::shapes::SHAPES;
        let name = split_spec(&wish.input).0.to_owned();
        let known = shapes.iter().any(|s| s.name == name);
        let shown = if known { name.clone() } else { file_name(&wish.input) };
        egui::ComboBox::from_id_salt("object").width(ui.available_width()).selected_text(shown).show_ui(
            ui,
            |ui| {
                for s in shapes.iter() {
                    if ui.selectable_label(s.name == name, s.name).on_hover_text(s.about).clicked() {
                        (wish.input, wish.orbit, wish.normal_map) = (s.name.into(), None, None);
                        wish.brdf.get_or_insert_with(|| Wish::default().brdf.unwrap_or_default());
                        wish.light.get_or_insert_with(|| "studio".into());
                    }
                }
            },
        );
        if !wish.is_scene() {
            ui.horizontal(|ui| {
                let mut ground = wish.ground.is_some();
                if ui.checkbox(&mut ground, "Ground").changed() {
                    wish.ground = ground.then(|| GROUND.into());
                }
                let mut shadows = wish.ground_technique.is_some();
                let about = "What the object keeps from the ground, baked at its vertices";
                let shown = ui.add_enabled(ground, egui::Checkbox::new(&mut shadows, "with shadows"));
                if shown.on_hover_text(about).changed() {
                    wish.ground_technique = shadows.then(|| SHADOWS.0.into());
                    wish.params.entry(SHADOWS.0.into()).or_insert_with(|| SHADOWS.1.into());
                }
            });
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

    pub(super) fn light(&mut self, ui: &mut Ui) {
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
        egui::ComboBox::from_id_salt("light").width(ui.available_width()).selected_text(shown).show_ui(
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
            self.moved = Instant::now();
        }
        if let Some([_, azimuth]) = suns::of_spec(&spec) {
            ui.horizontal(|ui| {
                let about =
                    "Solar time at 35° north on the day of equal length; north is −Z, east +X. J and K step.";
                controls::label(ui, "time of day").on_hover_text(about);
                controls::fill(ui);
                let mut hour = suns::hour_of(azimuth).clamp(*suns::DAY.start(), *suns::DAY.end());
                let clock = |h: f64, _| {
                    format!("{}:{:02}", (60.0 * h).round() as u32 / 60, (60.0 * h).round() as u32 % 60)
                };
                let slider = egui::Slider::new(&mut hour, suns::DAY).custom_formatter(clock);
                if ui.add(slider).changed() {
                    wish.light = suns::with_sun(&spec, suns::at_hour(hour));
                    self.moved = Instant::now();
                }
            });
        }
        ui.horizontal(|ui| {
            controls::label(ui, "turned");
            controls::fill(ui);
            let slider = egui::Slider::new(&mut wish.turn, -180.0..=180.0).suffix("°").max_decimals(1);
            if ui.add(slider).changed() {
                self.moved = Instant::now();
            }
        });
    }

    pub(super) fn material(&mut self, ui: &mut Ui) {
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
        egui::ComboBox::from_id_salt("material").width(ui.available_width()).selected_text(shown).show_ui(
            ui,
            |ui| {
                if ui.selectable_label(spec.is_empty(), "of the file").clicked() {
                    wish.brdf = None;
                }
                for m in steradian_brdf::models() {
                    let Some(first) = controls::first_spec(m.name, m.parameters) else { continue };
                    if ui.selectable_label(m.name == name, m.name).on_hover_text(m.source).clicked() {
                        wish.brdf = Some(first);
                    }
                }
            },
        );
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

    pub(super) fn technique(&mut self, ui: &mut Ui) {
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
            let early = self.lives[0].as_ref().is_some_and(|l| l.is_preview());
            let text = if early {
                "Error: a preview's is not measured".into()
            } else {
                format!("Error {:.2} % ({})", 100.0 * c.error, c.known.word())
            };
            ui.label(text)
                .on_hover_text("Relative RMS error of radiance over all normals and views, as certified");
        }
        ui.checkbox(&mut self.kept.split, "Beside another").on_hover_text("B; drag the line in the picture");
        if self.kept.split
            && let Some(new) = pick(ui, "other", &self.kept.other, brdf.as_deref())
        {
            self.kept.other = new;
        }
    }

    pub(super) fn display(&mut self, ui: &mut Ui) {
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
            ui.selectable_value(&mut self.mode, DisplayMode::Picture, "Picture");
            ui.selectable_value(&mut self.mode, DisplayMode::FalseColour, "False colour").on_hover_text("F");
            ui.selectable_value(&mut self.mode, DisplayMode::Heat, "Error")
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
            if ui
                .button("Turntable")
                .on_hover_text("R: a full turn as an animated PNG in the working folder")
                .clicked()
            {
                self.turntable();
            }
            if ui.button("First view").on_hover_text("0, or a double click").clicked() {
                self.home();
            }
        });
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
    let width = ui.available_width();
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
