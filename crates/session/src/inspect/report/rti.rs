//! Reports of the files of reflectance transformation imaging.

use super::{Line, Report};
use crate::btf::Source;
use crate::inspect::{LightPositionFacts, PtmFacts};
use serde_json::{Value, json};

/// Terms of the coefficients a0 … a5.
const POWERS: [&str; 6] = ["u²", "v²", "uv", "u", "v", "1"];

/// The report on a polynomial texture map.
pub fn ptm(f: &PtmFacts, name: &str) -> Report {
    let polynomials: Vec<Value> = f
        .polynomials
        .iter()
        .map(|(channel, r)| json!({"name": channel, "smallest": r.map(|r| r.0), "largest": r.map(|r| r.1)}))
        .collect();
    let mut json = json!({
        "kind": "ptm",
        "name": name,
        "format": f.kind,
        "width": f.width,
        "height": f.height,
        "polynomials": polynomials,
        "color": f.color.map(|c| json!({"smallest": c.map(|r| r.0), "largest": c.map(|r| r.1)})),
    });
    for (key, value) in Source::document(f.source.as_ref()) {
        json[key] = value;
    }
    let mut lines: Vec<Line> = vec![
        ("name", name.into()),
        ("polynomial texture map", format!("{}, {} x {} texels", f.kind, f.width, f.height)),
    ];
    for (channel, ranges) in &f.polynomials {
        let ranges: Vec<String> =
            POWERS.iter().zip(ranges).map(|(p, (a, b))| format!("{p} {a:.4} … {b:.4}")).collect();
        lines.push((channel, ranges.join(", ")));
    }
    if let Some(color) = f.color {
        let [r, g, b] = color.map(|(a, b)| format!("{a} … {b}"));
        lines.push(("colour", format!("red {r}, green {g}, blue {b}")));
    }
    lines.extend(Source::lines(f.source.as_ref()));
    Report { json, lines }
}

/// The report on a list of light positions.
pub fn lp(f: &LightPositionFacts, name: &str) -> Report {
    let mut json = json!({
        "kind": "light positions",
        "name": name,
        "lights": f.lights,
        "smallest": f.ranges.map(|r| r.0),
        "largest": f.ranges.map(|r| r.1),
        "distances": [f.distances.0, f.distances.1],
        "condition": f.polynomials.as_ref().ok(),
        "warning": f.polynomials.as_ref().err(),
    });
    for (key, value) in Source::document(f.source.as_ref()) {
        json[key] = value;
    }
    let [x, y, z] = f.ranges.map(|(a, b)| format!("{a:.4} … {b:.4}"));
    let mut lines = vec![
        ("name", name.into()),
        ("lights", f.lights.to_string()),
        ("positions", format!("x {x}, y {y}, z {z}")),
        ("distances", format!("{:.4} … {:.4}", f.distances.0, f.distances.1)),
    ];
    lines.push(match &f.polynomials {
        Ok(condition) => ("condition number", format!("{condition:.2}, of polynomials of six coefficients")),
        Err(why) => ("warning", format!("no polynomials can be fitted: {why}")),
    });
    lines.extend(Source::lines(f.source.as_ref()));
    Report { json, lines }
}
