//! What is said of a bake: bytes, error by elevation, orders, timings.

use super::Options;
use crate::context::Context;
use crate::report::{elevations_json, params_json, points_json};

use crate::failure::Outcome;
use serde_json::{Map, Value, json};
use steradian_session::bake::{Baked, Written};
use steradian_session::size_in_words;

/// Says it: a JSON document, or lines on standard error.
pub fn say(o: &Options, done: &Baked, files: &[Written], writing: f64, context: &Context) -> Outcome {
    if context.common.json {
        return context.print_json(document(o, done, files, writing));
    }
    lines(done, files, writing).into_iter().for_each(|l| context.say(l));
    Ok(())
}

fn document(o: &Options, done: &Baked, files: &[Written], writing: f64) -> Value {
    let c = &done.certificate;
    let details: Map<String, Value> = c.details.iter().map(|(k, v)| (k.clone(), json!(v))).collect();
    let stages: Vec<Value> =
        done.stages.iter().map(|(name, s)| json!({"name": name, "seconds": s})).collect();
    json!({
        "technique": done.bake.card().slug,
        "brdf": done.made.brdf,
        "environment": done.made.environment,
        "parameters": params_json(&done.bake.params()),
        "bytes": done.bake.bytes(),
        "error": c.error,
        "error_known": c.known.word(),
        "metric": c.metric,
        "elevations": elevations_json(c),
        "missing_energy": c.missing_energy,
        "details": details,
        "points": points_json(c),
        "tolerance": done.accuracy.tolerance(),
        "energy_epsilon": o.energy_epsilon,
        "tolerance_met": done.reached().map(|_| !done.missed()),
        "bake_seconds": done.seconds,
        "stages": stages,
        "write_seconds": writing,
        "files": files.iter().map(file).collect::<Vec<_>>(),
    })
}

fn file(w: &Written) -> Value {
    let (format, rounding) = w.texels.map_or((None, None), |(f, e)| (Some(f.name()), Some(e)));
    json!({"name": w.name, "bytes": w.bytes, "format": format, "rounding": rounding})
}

fn lines(done: &Baked, files: &[Written], writing: f64) -> Vec<String> {
    let c = &done.certificate;
    let mut out = Vec::new();
    let total: u64 = files.iter().map(|f| f.bytes).sum();
    out.push(format!(
        "{} of {} under {}: shading reads {}, {} written in {}",
        done.bake.card().slug,
        done.made.brdf,
        done.made.environment,
        size_in_words(done.bake.bytes() as u64),
        size_in_words(total),
        plural(files.len(), "file"),
    ));
    out.push(format!("{} {:.2e} ({})", c.metric, c.error, c.known.word()));
    out.extend(c.spread.map(|s| s.to_string()));
    if !c.elevations.is_empty() {
        let each: Vec<String> =
            c.elevations.iter().map(|e| format!("{:.0}° {:.1e}", e.theta_o.to_degrees(), e.error)).collect();
        out.push(format!("by angle of view: {}", each.join(", ")));
    }
    let missing = c.missing_energy.map(|e| format!("missing energy of the reflectance {}", short(e)));
    let details = c.details.iter().map(|(k, v)| format!("{k} {}", short(*v)));
    let details: Vec<String> = missing.into_iter().chain(details).collect();
    if !details.is_empty() {
        out.push(details.join(", "));
    }
    let stages: Vec<String> = done.stages.iter().map(|(n, s)| format!("{n} {:.0} ms", s * 1e3)).collect();
    let of = if stages.is_empty() { String::new() } else { format!(" ({})", stages.join(", ")) };
    out.push(format!("bake {:.0} ms{of}, writing {:.0} ms", done.seconds * 1e3, writing * 1e3));
    for f in files {
        let texels = f.texels.map(|(t, e)| format!(", {}, rounding {e:.1e}", t.name())).unwrap_or_default();
        out.push(format!("{}: {}{texels}", f.name, size_in_words(f.bytes)));
    }
    out
}

fn plural(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

/// At most four digits.
fn short(v: f64) -> String {
    if v.fract() == 0.0 && v.abs() < 1e9 { format!("{v}") } else { format!("{v:.3e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_words() {
        assert_eq!((short(12.0), short(0.012345)), ("12".to_string(), "1.235e-2".to_string()));
        assert_eq!((plural(1, "file"), plural(2, "file")), ("1 file".into(), "2 files".into()));
    }
}
