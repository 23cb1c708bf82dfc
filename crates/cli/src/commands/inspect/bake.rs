//! What a saved bake is.

use super::{Report, file_name};
use crate::bakefile::BakeFile;
use crate::context::Context;
use crate::elevation::Elevations;
use crate::failure::Failure;
use crate::inputs::Adjust;
use serde_json::{Map, Value, json};
use std::path::Path;

/// Is this the name of tensors?
pub fn is_bake(what: &str) -> bool {
    what.to_lowercase().ends_with(".safetensors")
}

/// The report on a saved bake.
pub fn report(what: &str, context: &mut Context) -> Result<Report, Failure> {
    let file = BakeFile::read(Path::new(what), &Adjust::default(), context)?;
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
        "parameters": bake.params().0,
        "bytes": bake.bytes(),
        "error": c.error,
        "error_known": c.known.word(),
        "metric": c.metric,
        "details": details,
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
    let by_angle = Elevations::of(c).0;
    lines.extend(by_angle.iter().map(|(t, e)| ("error", format!("{e:.3e} at {:.0}°", t.to_degrees()))));
    let others = c.details.iter().filter(|d| !d.0.starts_with("error at "));
    lines.extend(others.map(|(k, v)| ("figure", format!("{k} {v}"))));
    lines.extend(
        file.tensors
            .tensors
            .iter()
            .map(|(name, t)| ("tensor", format!("{name} {:?}, {} bytes", t.shape, t.data.bytes()))),
    );
    Ok(Report { json, lines })
}
