//! What a saved bake is.

use super::{Report, file_name};
use crate::context::Context;
use crate::failure::Failure;
use crate::report::{elevations_json, params_json, points_json};
use serde_json::{Map, Value, json};
use std::path::Path;
use steradian_base::Elevation;
use steradian_formats::read_ktx2_array;
use steradian_session::Adjust;
use steradian_techniques::IN_FOLDER;

/// Is this the name of tensors, or a folder that holds a bake?
pub fn is_bake(what: &str) -> bool {
    what.to_lowercase().ends_with(".safetensors") || Path::new(what).join(IN_FOLDER).is_file()
}

/// The report on a texture that holds a table of a bake; `None` where `what` is something else.
pub fn table(what: &str, context: &mut Context) -> Result<Option<Report>, Failure> {
    let path = Path::new(what);
    if !what.to_lowercase().ends_with(".ktx2") || !path.is_file() {
        return Ok(None);
    }
    // What cannot be read as an array is a map of light, or says so there.
    let Ok(array) = read_ktx2_array(path, &context.limits()) else { return Ok(None) };
    let (Some(technique), Some(name)) = (array.get("steradian.technique"), array.get("steradian.table"))
    else {
        return Ok(None);
    };
    context.note_input(path);
    let head: Map<String, Value> = array.metadata.iter().map(|(k, v)| (k.clone(), json!(v))).collect();
    let json = json!({
        "kind": "table of a bake",
        "name": file_name(what),
        "technique": technique,
        "table": name,
        "width": array.width,
        "height": array.height,
        "layers": array.layers,
        "metadata": head,
    });
    let mut lines = vec![
        ("name", file_name(what)),
        ("technique", technique.into()),
        ("table", format!("{name}: {} x {} texels, layers {}", array.width, array.height, array.layers)),
    ];
    let said = [
        ("lookup", "table.shape"),
        ("rounding", "table.rounding"),
        ("light", "environment"),
        ("reflectance", "brdf"),
        ("error", "error"),
    ];
    let value = |key: &str| array.get(&format!("steradian.{key}")).map(String::from);
    lines.extend(said.into_iter().filter_map(|(label, key)| Some((label, value(key)?))));
    Ok(Some(Report { json, lines }))
}

/// The report on a saved bake.
pub fn report(what: &str, context: &mut Context) -> Result<Report, Failure> {
    let file = context.saved_bake(Path::new(what), &Adjust::default())?;
    let bake = file.open()?;
    let (card, c, made) = (bake.card(), bake.certificate(), &file.made);
    let details: Map<String, Value> = c.details.iter().map(|(k, v)| (k.clone(), json!(v))).collect();
    let tensors: Vec<Value> = file
        .tensors
        .tensors
        .iter()
        .map(|(name, t)| json!({"name": name, "shape": t.shape, "bytes": t.data.bytes()}))
        .collect();
    let json = json!({
        "kind": "bake",
        "name": file_name(what),
        "technique": card.slug,
        "title": card.title,
        "citation": card.citation,
        "brdf": made.brdf,
        "environment": made.environment,
        "parameters": params_json(&bake.params()),
        "bytes": bake.bytes(),
        "error": c.error,
        "error_known": c.known.word(),
        "metric": c.metric,
        "tolerance": c.tolerance,
        "elevations": elevations_json(c),
        "missing_energy": c.missing_energy,
        "details": details,
        "points": points_json(c),
        "tensors": tensors,
        "metadata": file.tensors.metadata,
    });
    let mut lines = vec![
        ("name", file_name(what)),
        ("technique", format!("{}: {}", card.slug, card.title)),
        ("source", card.citation.into()),
        ("light", made.environment.clone()),
        ("reflectance", made.brdf.clone()),
        (
            "parameters",
            bake.params().0.iter().map(|(k, v)| format!("{k} {v}")).collect::<Vec<_>>().join(", "),
        ),
        ("shading reads", format!("{} bytes", bake.bytes())),
        ("error", format!("{:.3e} ({}): {}", c.error, c.known.word(), c.metric)),
    ];
    lines.extend(c.spread.map(|s| ("error", s.to_string())));
    let at = |e: &Elevation| format!("{:.3e} at {:.0}°", e.error, e.theta_o.to_degrees());
    lines.extend(c.elevations.iter().map(|e| ("error", at(e))));
    lines.extend(c.missing_energy.map(|e| ("figure", format!("missing energy of the reflectance {e}"))));
    lines.extend(c.details.iter().map(|(k, v)| ("figure", format!("{k} {v}"))));
    lines.extend(
        file.tensors
            .tensors
            .iter()
            .map(|(name, t)| ("tensor", format!("{name} {:?}, {} bytes", t.shape, t.data.bytes()))),
    );
    Ok(Report { json, lines })
}
