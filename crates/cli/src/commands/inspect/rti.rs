//! What the files of reflectance transformation imaging hold.

use super::{Line, Report, file_name};
use crate::context::Context;
use crate::failure::Failure;
use serde_json::{Value, json};
use std::path::Path;

/// What a0 … a5 are coefficients of.
const POWERS: [&str; 6] = ["u²", "v²", "uv", "u", "v", "1"];

/// The report on a polynomial texture map.
pub fn ptm(what: &str, context: &mut Context) -> Result<Report, Failure> {
    let f = context.inspect_ptm(Path::new(what))?;
    let polynomials: Vec<Value> = f
        .polynomials
        .iter()
        .map(|(name, r)| json!({"name": name, "smallest": r.map(|r| r.0), "largest": r.map(|r| r.1)}))
        .collect();
    let json = json!({
        "kind": "ptm",
        "name": file_name(what),
        "format": f.kind,
        "width": f.width,
        "height": f.height,
        "polynomials": polynomials,
        "color": f.color.map(|c| json!({"smallest": c.map(|r| r.0), "largest": c.map(|r| r.1)})),
    });
    let mut lines: Vec<Line> = vec![
        ("name", file_name(what)),
        ("polynomial texture map", format!("{}, {} x {} texels", f.kind, f.width, f.height)),
    ];
    for (name, ranges) in &f.polynomials {
        let ranges: Vec<String> =
            POWERS.iter().zip(ranges).map(|(p, (a, b))| format!("{p} {a:.4} … {b:.4}")).collect();
        lines.push((name, ranges.join(", ")));
    }
    if let Some(color) = f.color {
        let [r, g, b] = color.map(|(a, b)| format!("{a} … {b}"));
        lines.push(("colour", format!("red {r}, green {g}, blue {b}")));
    }
    Ok(Report { json, lines })
}

/// The report on a list of light positions.
pub fn lp(what: &str, context: &mut Context) -> Result<Report, Failure> {
    let f = context.inspect_lp(Path::new(what))?;
    let json = json!({
        "kind": "light positions",
        "name": file_name(what),
        "lights": f.lights,
        "smallest": f.ranges.map(|r| r.0),
        "largest": f.ranges.map(|r| r.1),
        "distances": [f.distances.0, f.distances.1],
    });
    let [x, y, z] = f.ranges.map(|(a, b)| format!("{a:.4} … {b:.4}"));
    let lines = vec![
        ("name", file_name(what)),
        ("lights", f.lights.to_string()),
        ("positions", format!("x {x}, y {y}, z {z}")),
        ("distances", format!("{:.4} … {:.4}", f.distances.0, f.distances.1)),
    ];
    Ok(Report { json, lines })
}
