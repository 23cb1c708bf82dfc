//! Controls made from the descriptions of parameters.

use eframe::egui::{self, Ui};
use steradian_base::{Kind, ParamInfo, ParamValues, Preset, Value, split_spec};

/// What a parameter is where it is required and nothing is given yet.
fn first(info: &ParamInfo) -> Option<Value> {
    let inside = |x: f64| {
        let low = if info.min.is_finite() { info.min } else { f64::NEG_INFINITY };
        let high = if info.max.is_finite() { info.max } else { f64::INFINITY };
        x.clamp(low, high)
    };
    Some(match info.kind {
        Kind::Real => Value::Number(inside(0.3)),
        Kind::Whole => Value::Number(inside(1.0)),
        Kind::Angle => Value::Number(inside(0.0)),
        Kind::Rgb => Value::Rgb([inside(0.5); 3]),
        Kind::Vector => Value::Rgb([1.0, 0.0, 0.0]),
        Kind::Switch => Value::Switch(false),
        Kind::Choice(words) => (*words.first()?).into(),
        Kind::File | Kind::Name => return None,
    })
}

/// A reflectance of the model `name` to begin with: what is required, and the first other parameter where
/// that is not enough; `None` where a file is needed.
pub fn first_spec(name: &str, infos: &[ParamInfo]) -> Option<String> {
    let mut values = ParamValues::default();
    for info in infos.iter().filter(|i| i.default == Preset::Required) {
        values.0.insert(info.name.into(), first(info)?);
    }
    let with = |extra: Option<&ParamInfo>| {
        let mut values = values.clone();
        if let Some(info) = extra {
            values.0.insert(info.name.into(), first(info)?);
        }
        Some(spec(name, &values, infos)).filter(|s| steradian_brdf::parse(s).is_ok())
    };
    let absent = infos.iter().filter(|i| i.default == Preset::Absent).map(Some);
    std::iter::once(None).chain(absent).find_map(with)
}

/// `name:key=value,…`.
fn spec(name: &str, values: &ParamValues, infos: &[ParamInfo]) -> String {
    let body = values.body(infos);
    if body.is_empty() { name.into() } else { format!("{name}:{body}") }
}

/// Controls of a spec `name:key=value,…`; the new spec where something was moved.
pub fn of_spec(ui: &mut Ui, text: &str, infos: &[ParamInfo]) -> Option<String> {
    let (name, body) = split_spec(text);
    let mut values = ParamValues::parse(body, infos).ok()?;
    of_values(ui, &mut values, infos).then(|| spec(name, &values, infos))
}

/// The name of a control, in a column of its own.
pub fn label(ui: &mut Ui, text: &str) -> egui::Response {
    let left = egui::Layout::left_to_right(egui::Align::Center);
    let size = egui::Vec2::new(86.0, ui.spacing().interact_size.y);
    ui.allocate_ui_with_layout(size, left, |ui| {
        ui.set_min_width(size.x);
        ui.add(egui::Label::new(text).truncate())
    })
    .inner
}

/// Controls of values; has one been moved?
pub fn of_values(ui: &mut Ui, values: &mut ParamValues, infos: &[ParamInfo]) -> bool {
    let mut moved = false;
    for info in infos {
        let given = values.get(info).ok().flatten();
        let value = given.or_else(|| info.default_value());
        ui.horizontal(|ui| {
            label(ui, &info.name.replace('_', " ")).on_hover_text(info.to_string());
            if info.default == Preset::Absent && !matches!(info.kind, Kind::File | Kind::Name) {
                let mut on = value.is_some();
                if ui.checkbox(&mut on, "").changed() {
                    moved = true;
                    match first(info).filter(|_| on) {
                        Some(new) => values.0.insert(info.name.into(), new),
                        None => values.0.remove(info.name),
                    };
                }
                if !on {
                    return;
                }
            }
            if let Some(new) = control(ui, info, value) {
                moved = true;
                values.0.insert(info.name.into(), new);
            }
        });
    }
    moved
}

/// One control; the new value where it was moved.
fn control(ui: &mut Ui, info: &ParamInfo, value: Option<Value>) -> Option<Value> {
    if info.auto.is_some() {
        let mut auto = matches!(value, Some(Value::Auto) | None);
        if ui.checkbox(&mut auto, "auto").changed() {
            return if auto { Some(Value::Auto) } else { first(info) };
        }
        if auto {
            return None;
        }
    }
    match (info.kind, value) {
        (Kind::Real | Kind::Angle, value) => {
            let mut x = match value {
                Some(Value::Number(x)) => x,
                _ => 0.0,
            };
            number(ui, info, &mut x).then_some(Value::Number(x))
        }
        (Kind::Whole, value) => {
            let mut x = match value {
                Some(Value::Number(x)) => x,
                _ => info.min.max(0.0),
            };
            let drag = egui::DragValue::new(&mut x).range(range(info)).fixed_decimals(0).speed(0.1);
            (ui.add(drag).changed()).then(|| Value::Number(x.round()))
        }
        (Kind::Switch, value) => {
            let mut on = matches!(value, Some(Value::Switch(true)));
            ui.checkbox(&mut on, "").changed().then_some(Value::Switch(on))
        }
        (Kind::Choice(words), value) => {
            let now = value.map(|v| v.to_string()).unwrap_or_default();
            let mut taken = None;
            egui::ComboBox::from_id_salt(info.name).selected_text(now.clone()).show_ui(ui, |ui| {
                for w in words {
                    if ui.selectable_label(*w == now, *w).clicked() && *w != now {
                        taken = Some(Value::from(*w));
                    }
                }
            });
            taken
        }
        (Kind::Rgb, value) => {
            let mut rgb = match value {
                Some(Value::Rgb(v)) => v,
                Some(Value::Number(x)) => [x; 3],
                _ => [0.5; 3],
            };
            let mut moved = false;
            if info.max <= 1.0 {
                let mut colour = rgb.map(|x| x as f32);
                if ui.color_edit_button_rgb(&mut colour).changed() {
                    moved = true;
                    rgb = colour.map(|x| (f64::from(x) * 1e4).round() / 1e4);
                }
            }
            let speed = if info.max <= 1.0 { 0.005 } else { 0.02 * (1.0 + rgb[0].abs()) };
            // Two decimals: three fields stand beside the colour.
            for x in &mut rgb {
                let drag = egui::DragValue::new(x).range(range(info)).speed(speed).max_decimals(2);
                moved |= ui.add(drag).changed();
            }
            moved.then_some(Value::Rgb(rgb))
        }
        (Kind::Vector, value) => {
            let mut v = match value {
                Some(Value::Rgb(v)) => v,
                _ => [1.0, 0.0, 0.0],
            };
            let mut moved = false;
            for x in &mut v {
                moved |= ui.add(egui::DragValue::new(x).speed(0.01).max_decimals(3)).changed();
            }
            moved.then_some(Value::Rgb(v))
        }
        (Kind::File | Kind::Name, value) => {
            let mut text = value.map(|v| v.to_string()).unwrap_or_default();
            let edit = ui.add(egui::TextEdit::singleline(&mut text).desired_width(120.0));
            let file = info.kind == Kind::File;
            edit.changed().then(|| if file { Value::File(text.into()) } else { text.as_str().into() })
        }
    }
}

fn range(info: &ParamInfo) -> std::ops::RangeInclusive<f64> {
    info.min..=info.max
}

/// Lets a slider end where the panel does, whatever its number.
pub fn fill(ui: &mut Ui) {
    const NUMBER: f32 = 52.0;
    ui.spacing_mut().interact_size.x = NUMBER;
    ui.spacing_mut().slider_width = (ui.available_width() - NUMBER - ui.spacing().item_spacing.x).max(40.0);
}

/// A slider where the range is finite, else a field to drag.
fn number(ui: &mut Ui, info: &ParamInfo, x: &mut f64) -> bool {
    let [low, high] = [info.min, info.max];
    let response = if low.is_finite() && high.is_finite() && high - low <= 1000.0 {
        fill(ui);
        ui.add(egui::Slider::new(x, low..=high).max_decimals(3).clamping(egui::SliderClamping::Always))
    } else {
        let speed = 0.01 * (1.0 + x.abs());
        ui.add(egui::DragValue::new(x).range(low..=high).speed(speed).max_decimals(4))
    };
    response.on_hover_text(info.doc).changed()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_begin_with_a_spec_where_they_need_no_file() {
        let first = |name: &str| {
            let model = steradian_brdf::models().iter().find(|m| m.name == name).expect("a model");
            first_spec(model.name, model.parameters)
        };
        assert_eq!(first("ggx").as_deref(), Some("ggx:alpha=0.3"));
        assert!(first("lambert").is_some());
        let all = steradian_brdf::models().iter().filter(|m| first(m.name).is_some()).count();
        assert!(all >= 18, "{all} of {}", steradian_brdf::models().len());
    }
}
