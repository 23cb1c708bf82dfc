//! What a list of the pictures of a bidirectional texture function is.

use super::Report;
use crate::btf::BtfFacts;
use serde_json::json;

/// The report on a list of pictures.
pub fn report(f: &BtfFacts, name: &str) -> Report {
    let (w, h) = f.size;
    let json = json!({
        "kind": "bidirectional texture function",
        "name": name,
        "pictures": f.pictures,
        "views": f.views,
        "lights": f.lights,
        "width": w,
        "height": h,
        "largest_view_angle": f.angles[0],
        "largest_light_angle": f.angles[1],
        "source": f.source,
        "seed": f.seed,
        "variance": f.variance,
    });
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
        ("source", f.source.clone().unwrap_or_else(|| "not said".into())),
    ];
    lines.extend(f.seed.map(|s| ("seed", s.to_string())));
    lines.extend(
        f.variance.map(|v| ("variance", format!("{v:.3e}, the mean over all numbers, white being 1"))),
    );
    Report { json, lines }
}
