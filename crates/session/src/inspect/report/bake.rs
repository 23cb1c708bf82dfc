//! Report of a saved bake.

use super::{Line, Report};
use crate::inspect::{ArrayContent, ArrayFacts, BakeFacts, LocalBakeFacts, TensorFacts};
use crate::report::{details_json, elevations_json, params_json, points_json};
use serde_json::{Value, json};
use steradian_base::Elevation;

/// The report on a texture that holds an array of images, such as a table of a bake.
pub fn array(f: &ArrayFacts, name: &str) -> Report {
    let size = format!("{} x {} texels, layers {}", f.width, f.height, f.layers);
    let mut json = json!({
        "kind": "array of images",
        "name": name,
        "width": f.width,
        "height": f.height,
        "layers": f.layers,
        "metadata": f.metadata,
    });
    let mut lines = vec![("name", name.into())];
    match &f.content {
        ArrayContent::Table { technique, table } => {
            json["kind"] = json!("table of a bake");
            json["technique"] = json!(technique);
            json["table"] = json!(table);
            lines.extend([("technique", technique.clone()), ("table", format!("{table}: {size}"))]);
        }
        ArrayContent::Horizons(numbers) => {
            json["kind"] = json!("horizons");
            json["horizons"] = json!(numbers);
            lines.extend([("horizons", numbers.clone()), ("texture", size)]);
        }
        ArrayContent::Images => lines.push(("array", size)),
    }
    let said = [
        ("lookup", "table.shape"),
        ("rounding", "table.rounding"),
        ("light", "environment"),
        ("reflectance", "brdf"),
        ("relief", "relief"),
        ("error", "error"),
    ];
    lines.extend(said.into_iter().filter_map(|(label, key)| Some((label, f.get(key)?.into()))));
    Report { json, lines }
}

/// The report on a saved bake.
pub fn bake(f: &BakeFacts, name: &str) -> Report {
    let (c, card, made) = (&f.certificate, f.card, &f.made);
    let json = json!({
        "kind": "bake",
        "name": name,
        "technique": card.slug,
        "title": card.title,
        "citation": card.citation,
        "brdf": made.brdf,
        "environment": made.environment,
        "parameters": params_json(&f.params),
        "bytes": f.bytes,
        "error": c.error,
        "error_known": c.known.word(),
        "metric": c.metric,
        "tolerance": c.tolerance,
        "elevations": elevations_json(c),
        "missing_energy": c.missing_energy,
        "details": details_json(c),
        "points": points_json(c),
        "tensors": tensors_json(&f.tensors),
        "metadata": f.metadata,
    });
    let params: Vec<String> = f.params.0.iter().map(|(k, v)| format!("{k} {v}")).collect();
    let mut lines = vec![
        ("name", name.into()),
        ("technique", format!("{}: {}", card.slug, card.title)),
        ("source", card.citation.into()),
        ("light", made.environment.clone()),
        ("reflectance", made.brdf.clone()),
        ("parameters", params.join(", ")),
        ("shading reads", format!("{} bytes", f.bytes)),
        ("error", format!("{:.3e} ({}): {}", c.error, c.known.word(), c.metric)),
    ];
    lines.extend(c.spread.map(|s| ("error", s.to_string())));
    let at = |e: &Elevation| format!("{:.3e} at {:.0}°", e.error, e.theta_o.to_degrees());
    lines.extend(c.elevations.iter().map(|e| ("error", at(e))));
    lines.extend(c.missing_energy.map(|e| ("figure", format!("missing energy of the reflectance {e}"))));
    lines.extend(c.details.iter().map(|(k, v)| ("figure", format!("{k} {v}"))));
    lines.extend(tensor_lines(&f.tensors));
    Report { json, lines }
}

/// The report on a saved bake of a technique for directional and point lights.
pub fn local(f: &LocalBakeFacts, name: &str) -> Report {
    let (c, card) = (&f.certificate, f.card);
    let said = |key: &str| f.metadata.get(&format!("steradian.{key}"));
    let json = json!({
        "kind": "local bake",
        "name": name,
        "technique": card.slug,
        "title": card.title,
        "citation": card.citation,
        "brdf": f.brdf,
        "parameters": params_json(&f.params),
        "bytes": f.bytes,
        "error": c.error,
        "error_known": c.known.word(),
        "metric": c.metric,
        "tolerance": c.tolerance,
        "elevations": elevations_json(c),
        "details": details_json(c),
        "points": points_json(c),
        "source": said("source"),
        "seed": said("seed").and_then(|s| s.parse::<u64>().ok()),
        "variance": said("variance").and_then(|s| s.parse::<f64>().ok()),
        "tensors": tensors_json(&f.tensors),
        "metadata": f.metadata,
    });
    let params: Vec<String> = f.params.0.iter().map(|(k, v)| format!("{k} {v}")).collect();
    let mut lines = vec![
        ("name", name.into()),
        ("technique", format!("{}: {}", card.slug, card.title)),
        ("source", card.citation.into()),
        ("light", "directional and point lights, one by one (`local`)".into()),
        ("reflectance", f.brdf.clone()),
        ("parameters", params.join(", ")),
        ("shading reads", format!("{} bytes", f.bytes)),
        ("error", format!("{:.3e} ({}): {}", c.error, c.known.word(), c.metric)),
    ];
    let at = |e: &Elevation| format!("{:.3e} at {:.0}°", e.error, e.theta_o.to_degrees());
    lines.extend(c.elevations.iter().map(|e| ("error", at(e))));
    lines.extend(c.details.iter().map(|(k, v)| ("figure", format!("{k} {v}"))));
    if let Some(source) = said("source") {
        let more = |key: &str| said(key).map_or(String::new(), |v| format!(", {key} {v}"));
        lines.push(("data", format!("{source}{}{}", more("seed"), more("variance"))));
    }
    lines.extend(tensor_lines(&f.tensors));
    Report { json, lines }
}

/// Names, shapes and sizes of tensors.
pub fn tensors_json(tensors: &[TensorFacts]) -> Value {
    tensors.iter().map(|t| json!({"name": t.name, "shape": t.shape, "bytes": t.bytes})).collect()
}

/// The tensors in words, a line each.
pub fn tensor_lines(tensors: &[TensorFacts]) -> impl Iterator<Item = Line> {
    tensors.iter().map(|t| ("tensor", format!("{} {:?}, {} bytes", t.name, t.shape, t.bytes)))
}
