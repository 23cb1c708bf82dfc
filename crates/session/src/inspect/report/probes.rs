//! Report of a file of probes.

use super::Report;
use super::bake::{tensor_lines, tensors_json};
use crate::inspect::ProbesFacts;
use serde_json::json;
use steradian_light::Places;

/// The report on a light field.
pub fn report(f: &ProbesFacts, name: &str) -> Report {
    let field = &f.field;
    let (places, grid) = match &field.places {
        Places::Grid { bounds: [lo, hi], size } => {
            let words = format!(
                "grid of {} x {} x {} from ({:.4}, {:.4}, {:.4}) to ({:.4}, {:.4}, {:.4})",
                size.x, size.y, size.z, lo.x, lo.y, lo.z, hi.x, hi.y, hi.z
            );
            (words, json!({"size": size.to_array(), "from": lo.to_array(), "to": hi.to_array()}))
        }
        Places::Points(p) => (format!("{} given points", p.len()), json!(null)),
    };
    let image = field.image_size();
    let json = json!({
        "kind": "probes",
        "name": name,
        "probes": field.light.len(),
        "grid": grid,
        "inside": f.inside,
        "bands": field.bands(),
        "image": image.map(|(w, h)| [w, h]),
        "mean_radiance": f.mean,
        "energy_by_band": f.energy,
        "tensors": tensors_json(&f.tensors),
        "metadata": f.metadata,
    });
    let energy: Vec<String> = f.energy.iter().map(|e| format!("{:.2}", 100.0 * e)).collect();
    let [r, g, b] = f.mean;
    let mut lines = vec![
        ("name", name.into()),
        ("probes", places),
        ("inside solids", f.inside.to_string()),
        ("bands", field.bands().to_string()),
        ("images", image.map_or("none".into(), |(w, h)| format!("{w} x {h} each"))),
        ("mean radiance", format!("{r:.5} {g:.5} {b:.5}")),
        ("energy by band", format!("{} %", energy.join(" "))),
    ];
    lines.extend(tensor_lines(&f.tensors));
    Report { json, lines }
}
