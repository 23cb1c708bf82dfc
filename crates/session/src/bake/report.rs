//! Report of a bake: bytes, error by elevation, orders, timings.

use super::{Baked, Written};
use crate::report::{details_json, elevations_json, params_json, points_json};
use crate::{BakedLocal, size_in_words};
use serde_json::{Value, json};
use steradian_base::Certificate;

/// The error in words.
fn error_in_words(c: &Certificate) -> String {
    format!("{} {:.2e} ({})", c.metric, c.error, c.known.word())
}

impl Baked {
    /// Report as JSON, including the files written, which took `writing` seconds; `energy` is the epsilon of
    /// the request.
    pub fn document(&self, files: &[Written], writing: f64, energy: Option<f64>) -> Value {
        let c = &self.certificate;
        let stages: Vec<Value> =
            self.stages.iter().map(|(name, s)| json!({"name": name, "seconds": s})).collect();
        json!({
            "technique": self.bake.card().slug,
            "brdf": self.made.brdf,
            "environment": self.made.environment,
            "parameters": params_json(&self.bake.params()),
            "bytes": self.bake.bytes(),
            "error": c.error,
            "error_known": c.known.word(),
            "metric": c.metric,
            "elevations": elevations_json(c),
            "missing_energy": c.missing_energy,
            "details": details_json(c),
            "points": points_json(c),
            "tolerance": self.accuracy.tolerance(),
            "energy_epsilon": energy,
            "tolerance_met": self.reached().map(|_| !self.missed()),
            "read_seconds": self.read_seconds,
            "bake_seconds": self.seconds,
            "stages": stages,
            "write_seconds": writing,
            "files": files.iter().map(file).collect::<Vec<_>>(),
        })
    }

    /// Report in words, line by line.
    pub fn lines(&self, files: &[Written], writing: f64) -> Vec<String> {
        let c = &self.certificate;
        let mut out = Vec::new();
        let total: u64 = files.iter().map(|f| f.bytes).sum();
        out.push(format!(
            "{} of {} under {}: shading reads {}, {} written in {}",
            self.bake.card().slug,
            self.made.brdf,
            self.made.environment,
            size_in_words(self.bake.bytes() as u64),
            size_in_words(total),
            plural(files.len(), "file"),
        ));
        out.push(error_in_words(c));
        out.extend(c.spread.map(|s| s.to_string()));
        if !c.elevations.is_empty() {
            let each: Vec<String> = c
                .elevations
                .iter()
                .map(|e| format!("{:.0}° {:.1e}", e.theta_o.to_degrees(), e.error))
                .collect();
            out.push(format!("by angle of view: {}", each.join(", ")));
        }
        let missing = c.missing_energy.map(|e| format!("missing energy of the reflectance {}", short(e)));
        let details = c.details.iter().map(|(k, v)| format!("{k} {}", short(*v)));
        let details: Vec<String> = missing.into_iter().chain(details).collect();
        if !details.is_empty() {
            out.push(details.join(", "));
        }
        let stages: Vec<String> = self.stages.iter().map(|(n, s)| format!("{n} {:.0} ms", s * 1e3)).collect();
        let ms = |seconds: f64| format!("{:.0} ms", 1e3 * seconds);
        let [read, all, writing] = [self.read_seconds, self.seconds, writing].map(ms);
        out.push(format!("inputs {read}, bake {all} ({}), writing {writing}", stages.join(", ")));
        for f in files {
            let texels =
                f.texels.map(|(t, e)| format!(", {}, rounding {e:.1e}", t.name())).unwrap_or_default();
            out.push(format!("{}: {}{texels}", f.name, size_in_words(f.bytes)));
        }
        out
    }
}

impl BakedLocal {
    /// Report as JSON, for a file of `bytes`; `tolerance` is that of the request, and `met` says whether it
    /// was met.
    pub fn document(&self, bytes: u64, tolerance: Option<f64>, met: bool) -> Value {
        let c = self.bake.certificate();
        json!({
            "technique": self.bake.card().slug,
            "brdf": self.brdf,
            "parameters": params_json(&self.bake.params()),
            "bytes": self.bake.bytes(),
            "error": c.error,
            "error_known": c.known.word(),
            "metric": c.metric,
            "details": details_json(c),
            "tolerance": tolerance,
            "tolerance_met": tolerance.map(|_| met),
            "bake_seconds": self.seconds,
            "file_bytes": bytes,
        })
    }

    /// Report in words, line by line.
    pub fn lines(&self, bytes: u64) -> [String; 2] {
        let [shading, written] = [self.bake.bytes() as u64, bytes].map(size_in_words);
        let slug = self.bake.card().slug;
        let made = format!("{slug} of {}: shading reads {shading}, {written} written", self.brdf);
        [made, error_in_words(self.bake.certificate())]
    }
}

fn file(w: &Written) -> Value {
    let (format, rounding) = w.texels.map_or((None, None), |(f, e)| (Some(f.name()), Some(e)));
    json!({"name": w.name, "bytes": w.bytes, "format": format, "rounding": rounding})
}

fn plural(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

/// A number in at most four digits.
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
