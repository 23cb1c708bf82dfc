//! What was made, as JSON and in words.

use crate::{BeyondRange, Filtered, Kernel, Level, MethodCost, Remedy, Request, Written};
use serde_json::{Map, Value, json};

impl Filtered {
    /// What was made as JSON, in `seconds` by part: `levels` are those of the output or of its specular cube,
    /// `beside` the other maps of a profile.
    pub fn document(&self, written: &[Written], seconds: &Map<String, Value>) -> Value {
        let o = &self.request;
        let rows: Vec<Value> = self.levels.iter().enumerate().map(|(m, l)| row(m, l)).collect();
        let curve = (rows.len() > 1).then_some(self.plan.engine.curve.name());
        let mut document = json!({
            "kernel": o.kernel,
            "profile": o.engine.map(|e| e.name),
            "profile_doc": o.engine.map(|e| e.doc),
            "curve": curve,
            "tolerance": o.tolerance,
            "analysis": {
                "order": self.light.order(),
                "suns": self.light.suns().len(),
                "bright_texels": self.light.bright_texels().len(),
            },
            "beyond_range": self.beyond.map(|b| json!({
                "largest": b.largest,
                "peak": b.peak,
                "lost_without_remedy": b.lost,
                "taken_out": b.taken,
                "still_lost": b.left,
                "remedy": b.remedy.name(),
            })),
            "levels": rows,
            "files": written.iter().map(file).collect::<Vec<_>>(),
            "snippet": self.snippet(),
            "seconds": seconds,
        });
        let mut others = Vec::new();
        for (map, level) in self.companions.maps() {
            let m = others.iter().filter(|v: &&Value| v["map"] == map).count();
            let mut row = row(m, level);
            row["map"] = json!(map);
            others.push(row);
        }
        if !others.is_empty() {
            document["beside"] = json!(others);
        }
        document
    }

    /// The same in words, line by line.
    pub fn lines(&self, written: &[Written]) -> Vec<String> {
        let levels = self.levels.iter().enumerate().map(|(m, l)| format!("level {m}: {}", words(l)));
        let others = self.companions.maps().map(|(map, l)| format!("{map}: {}", words(l)));
        levels.chain(others).chain(written.iter().map(|w| w.name.clone())).collect()
    }

    /// What was done about light too bright for the files, where there was any.
    pub fn beyond_in_words(&self) -> Option<String> {
        self.beyond.as_ref().map(|b| beyond(b, &self.request))
    }

    /// How the error is known, and how much of it the texels' format adds.
    pub fn error_in_words(&self) -> String {
        let how = if self.request.check > 0 { "measured" } else { "bound" };
        match self.format_error() {
            e if e > 0.0 => format!("{how}, {e:.2e} of the texels' format"),
            _ => how.into(),
        }
    }
}

fn file(w: &Written) -> Value {
    let r = w.report;
    json!({"file": w.name, "clipped": r.clipped, "vanished": r.vanished, "lost": r.lost})
}

/// A level in the report. Errors are relative RMS: `predicted_error` and `measured_error` of the filter,
/// `format_error` of the texels' format (what comes back from the file less what was given), `error` of the
/// file, which is the root of the sum of squares of the last two.
fn row(m: usize, l: &Level) -> Value {
    let f = &l.filtered;
    let measured =
        l.measured.map(|d| json!({"rms": d.rms, "bias": d.bias, "worst": d.worst, "texels": d.texels}));
    let mut row = json!({
        "level": m,
        "width": f.image.width,
        "height": f.image.height,
        "perceptual_roughness": l.filter.roughness,
        "alpha": l.filter.roughness.map(|r| r * r),
        "way": f.way.name(),
        "order": f.way.order(),
        "kernel_accuracy": l.filter.lobe.as_ref().map(Kernel::accuracy),
        "predicted_error": f.predicted,
        "measured_error": measured,
        "format_error": l.format_error,
        "error": l.error(),
        "energy_in": f.energy_in,
        "energy_out": f.energy_out,
        "raised_to_zero": f.clipped,
        "seconds": l.seconds,
    });
    if let Some(MethodCost { method, cost }) = l.method {
        let card = method.card();
        row["way"] = json!(card.name);
        row["order"] = Value::Null;
        row["source"] = json!(card.source);
        row["equation"] = json!(card.equation);
        row["exact_when"] = json!(card.exact_when);
        row["cost"] = json!({"kernel_evaluations": cost.kernel, "taps": cost.taps});
    }
    row
}

/// A part of the light in words: `1.9 %`.
pub fn percent(share: f64) -> String {
    match 100.0 * share {
        p if p < 0.01 => "less than 0.01 %".into(),
        p if p < 1.0 => format!("{p:.2} %"),
        p => format!("{p:.1} %"),
    }
}

/// What became of light that does not fit.
fn beyond(b: &BeyondRange, o: &Request) -> String {
    let (largest, peak, lost) = (b.largest, b.peak, percent(b.lost));
    let would = format!("radiance is up to {peak:.3e}, and beyond {largest} {lost} of the light");
    match (b.remedy, o.format) {
        (Remedy::Floats, _) => {
            format!("{would} would be lost: the file has 32-bit floats, not halves")
        }
        (Remedy::SunsTakenOut, _) => {
            let suns = if o.suns.len() == 1 {
                "1 sun is a light of its own".into()
            } else {
                format!("{} suns are lights of their own", o.suns.len())
            };
            let (file, taken) = (o.suns_file(), percent(b.taken));
            let left = match b.left {
                0.0 => String::new(),
                left => format!("; {} of the light is still clipped: no sun", percent(left)),
            };
            format!(
                "{would} would be lost: {suns}, in {file} and below, and not in the map ({taken} of the light){left}"
            )
        }
        (Remedy::Clipped, Some(f)) => format!("{would} is clipped, as {} was asked for", f.name()),
        (Remedy::Clipped, None) => format!("{would} is clipped; nothing of it is a sun to take out"),
    }
}

fn words(l: &Level) -> String {
    let f = &l.filtered;
    let r = l.filter.roughness.map(|r| format!(" r {r:.3}")).unwrap_or_default();
    let e =
        l.measured.map(|d| format!(", error rms {:.1e} worst {:.1e}", d.rms, d.worst)).unwrap_or_default();
    let engine = || format!("{} to band {}", f.way.name(), f.way.order());
    let way = l.method.map_or_else(engine, |m| m.method.name().into());
    format!("{} x {}{r}, {way}{e}, {:.0} ms", f.image.width, f.image.height, l.seconds * 1e3)
}
