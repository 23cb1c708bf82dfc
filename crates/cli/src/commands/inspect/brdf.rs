//! What a reflectance is.

use super::{Line, Report, plot};
use crate::context::Context;
use crate::failure::Failure;
use glam::DVec3;
use serde_json::json;
use std::path::Path;
use steradian_brdf::{Brdf, Domain, albedo};
use steradian_session::Method;

/// View angles of the albedo table, degrees.
const ANGLES: [f64; 6] = [0.0, 30.0, 60.0, 75.0, 85.0, 89.0];
/// Relative tolerance of the albedos.
const TOLERANCE: f64 = 1e-5;

/// The report on `spec`; the list of models for an empty one.
pub fn report(spec: &str, plot: Option<&Path>, context: &mut Context) -> Result<Report, Failure> {
    if spec.is_empty() {
        return Ok(list());
    }
    let brdf = context.brdf(spec)?;
    let info = brdf.info();
    let wo = |degrees: f64| {
        let t = degrees.to_radians();
        DVec3::new(t.sin(), 0.0, t.cos())
    };
    let table: Vec<(f64, [f64; 3])> =
        ANGLES.iter().map(|&a| (a, albedo::directional(&*brdf, wo(a), TOLERANCE))).collect();
    let hemispherical = albedo::hemispherical(&*brdf, 1e-4);
    if let Some(path) = plot {
        plot::draw(&*brdf, path, context)?;
    }
    let taken = techniques(&*brdf);
    let json = json!({
        "kind": "brdf",
        "name": info.name,
        "spec": brdf.spec(),
        "source": info.source,
        "formula": info.formula,
        "units": info.units,
        "parameters": info.parameters.iter().map(|p| json!({"name": p.label(), "meaning": p.to_string()})).collect::<Vec<_>>(),
        "reciprocity": info.reciprocity,
        "energy": info.energy,
        "domain": match brdf.domain() { Domain::Hemisphere => "hemisphere", Domain::Sphere => "sphere" },
        "isotropic": brdf.is_isotropic(),
        "directional_albedo": table.iter().map(|(a, v)| json!({"degrees": a, "rgb": v})).collect::<Vec<_>>(),
        "hemispherical_albedo": hemispherical,
        "techniques": taken,
    });
    let three = |v: [f64; 3]| format!("{:.6} {:.6} {:.6}", v[0], v[1], v[2]);
    let mut lines: Vec<Line> = vec![
        ("model", info.name.into()),
        ("spec", brdf.spec()),
        ("formula", info.formula.into()),
        ("units", info.units.into()),
        ("source", info.source.into()),
        ("reciprocity", info.reciprocity.into()),
        ("energy", info.energy.into()),
        ("isotropic", if brdf.is_isotropic() { "yes" } else { "no" }.into()),
    ];
    lines.extend(info.parameters.iter().map(|p| ("parameter", format!("{}: {p}", p.label()))));
    lines.extend(table.iter().map(|(a, v)| ("albedo", format!("{} from {a}°", three(*v)))));
    lines.push(("albedo", format!("{} over the hemisphere", three(hemispherical))));
    lines.push(("techniques", taken.join(", ")));
    Ok(Report { json, lines })
}

/// Slugs of the techniques that take this reflectance.
fn techniques(brdf: &dyn Brdf) -> Vec<&'static str> {
    Method::slugs()
        .into_iter()
        .filter(|slug| steradian_techniques::find(slug).is_none_or(|t| (t.card().materials)(brdf).is_ok()))
        .collect()
}

fn list() -> Report {
    let models: Vec<_> =
        steradian_brdf::models().iter().chain(steradian_brdf::measured_models()).copied().collect();
    let json = json!({
        "kind": "brdf models",
        "models": models.iter().map(|m| json!({"name": m.name, "source": m.source})).collect::<Vec<_>>(),
    });
    Report { json, lines: models.iter().map(|m| (m.name, m.source.to_string())).collect() }
}
