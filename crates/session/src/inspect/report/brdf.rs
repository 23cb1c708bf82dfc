//! Report of a reflectance.

use super::{Line, Report};
use crate::Error;
use crate::inspect::{BrdfFacts, Domain, brdf_models};
use serde_json::json;
use steradian_base::brief;
use steradian_brdf::Files;
use steradian_brdf::measured::expand;

/// The report on a reflectance.
pub fn report(facts: &BrdfFacts) -> Report {
    let (degrees, largest) = facts.largest_albedo();
    let BrdfFacts { brdf, directional: table, hemispherical, reciprocity_error, techniques: taken } = facts;
    let info = brdf.info();
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
        "largest_albedo": {"degrees": degrees, "value": largest},
        "reciprocity_error": reciprocity_error,
        "notes": brdf.notes(),
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
    lines.extend(brdf.notes().into_iter().map(|n| ("measured", n)));
    lines.extend(table.iter().map(|(a, v)| ("albedo", format!("{} from {a}°", three(*v)))));
    lines.push(("albedo", format!("{} over the hemisphere", three(*hemispherical))));
    let kept = match largest > 1.0 {
        true => format!("albedo {largest:.6} from {degrees}°: makes energy"),
        false => format!("at most {largest:.6} of the light is reflected, from {degrees}°"),
    };
    lines.push(("energy", kept));
    let apart = format!("f(l, v) and f(v, l) differ by {:.2e} of f (RMS)", reciprocity_error);
    lines.push(("reciprocity", apart));
    lines.push(("techniques", taken.join(", ")));
    Report { json, lines }
}

/// The materials of a spec with `*` for them.
pub fn materials(spec: &str) -> Result<Report, Error> {
    let all = expand(spec, Files::Any)?;
    if all == [spec] {
        let why =
            "its model has no list of materials; these have: sgd:* abc:* lafortune:* npf:FILE,* nbrdf:FILE,*";
        return Err(Error::usage(format!("brdf:{}: {why}", brief(spec))));
    }
    let json = json!({"kind": "brdf materials", "materials": all});
    Ok(Report { json, lines: all.into_iter().map(|s| ("brdf", s)).collect() })
}

/// The list of models.
pub fn list() -> Report {
    let models = brdf_models();
    let json = json!({
        "kind": "brdf models",
        "models": models.iter().map(|m| json!({"name": m.name, "source": m.source})).collect::<Vec<_>>(),
    });
    Report { json, lines: models.iter().map(|m| (m.name, m.source.to_string())).collect() }
}
