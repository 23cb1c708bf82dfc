//! Report of a list of the pictures of a bidirectional texture function.

use super::Report;
use crate::btf::{BtfFacts, Source};
use serde_json::json;

/// The report on a list of pictures.
pub fn report(f: &BtfFacts, name: &str) -> Report {
    let (w, h) = f.size;
    let mut json = json!({
        "kind": "bidirectional texture function",
        "name": name,
        "pictures": f.pictures,
        "views": f.views,
        "lights": f.lights,
        "width": w,
        "height": h,
        "largest_view_angle": f.angles[0],
        "largest_light_angle": f.angles[1],
    });
    for (key, value) in Source::document(f.source.as_ref()) {
        json[key] = value;
    }
    let mut lines = vec![
        ("name", name.into()),
        (
            "bidirectional texture function",
            format!(
                "{} pictures of {w} x {h} texels: {} views under {} lights",
                f.pictures, f.views, f.lights
            ),
        ),
        (
            "angles",
            format!("views up to {:.2}°, lights up to {:.2}° from the normal", f.angles[0], f.angles[1]),
        ),
    ];
    match &f.source {
        Some(source) => lines.extend(Source::lines(Some(source))),
        None => lines.push(("source", "not said".into())),
    }
    Report { json, lines }
}
