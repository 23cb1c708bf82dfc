//! Parts of reports: errors as JSON.

use serde_json::{Value, json};
use steradian_base::{Certificate, Elevation, ParamValues, Value as Param};

/// Parameters as JSON: numbers as numbers, everything else in words.
pub(crate) fn params_json(params: &ParamValues) -> Value {
    let one = |v: &Param| if let Param::Number(x) = v { json!(x) } else { json!(v.to_string()) };
    params.0.iter().map(|(name, value)| (name.clone(), one(value))).collect()
}

/// Further figures by name.
pub(crate) fn details_json(c: &Certificate) -> Value {
    c.details.iter().map(|(k, v)| (k.clone(), json!(v))).collect()
}

/// Errors by angle of view, degrees.
pub(crate) fn elevations_json(c: &Certificate) -> Value {
    let degrees = |theta: f64| (theta.to_degrees() * 1e6).round() / 1e6;
    let one = |e: &Elevation| {
        json!({
            "degrees": degrees(e.theta_o),
            "range": e.range.map(degrees),
            "error": e.error,
            "error_beside_suns": e.beside_suns,
            "known": e.known.word(),
        })
    };
    c.elevations.iter().map(one).collect()
}

/// Distribution of the error over single points; null where it was not measured.
pub(crate) fn points_json(c: &Certificate) -> Value {
    c.spread.map_or(Value::Null, |s| {
        json!({
            "median": s.median,
            "ninetieth": s.ninetieth,
            "stops": s.stops,
            "top_hundredth": s.top_hundredth,
        })
    })
}
