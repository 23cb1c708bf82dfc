//! What a list of the pictures of a bidirectional texture function is.

use super::{Report, file_name};
use crate::context::Context;
use crate::failure::Failure;
use serde_json::json;
use std::path::Path;

/// The report; `None` where the file is no such list.
pub fn report(what: &str, context: &mut Context) -> Result<Option<Report>, Failure> {
    if !what.to_lowercase().ends_with(".csv") {
        return Ok(None);
    }
    let f = context.inspect_btf(Path::new(what))?;
    let (w, h) = f.size;
    let json = json!({
        "kind": "bidirectional texture function",
        "name": file_name(what),
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
        ("name", file_name(what)),
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
        ("source", f.source.unwrap_or_else(|| "not said".into())),
    ];
    lines.extend(f.seed.map(|s| ("seed", s.to_string())));
    lines.extend(
        f.variance.map(|v| ("variance", format!("{v:.3e}, the mean over all numbers, white being 1"))),
    );
    Ok(Some(Report { json, lines }))
}
