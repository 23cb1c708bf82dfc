//! What was made, as JSON and in words.

use crate::context::Context;
use serde_json::{Map, Value, json};
use std::time::Instant;
use steradian_engines::{BeyondRange, Filtered, Kernel, Level, MethodCost, Remedy, Written};

/// Where the time goes: parts that follow one another, and so add up to all of it.
pub struct Clock {
    started: Instant,
    last: Instant,
    parts: Map<String, Value>,
}

impl Clock {
    /// Started at `started`; what has passed is `part`.
    pub fn new(started: Instant, part: &str) -> Self {
        let mut clock = Self { started, last: started, parts: Map::new() };
        clock.lap(part);
        clock
    }

    /// Ends a part, which began where the last one ended.
    pub fn lap(&mut self, part: &str) {
        let now = Instant::now();
        self.parts.insert(part.into(), json!((now - self.last).as_secs_f64()));
        self.last = now;
    }

    /// Parts that were timed elsewhere and have passed; the last of them ends now.
    pub fn parts(&mut self, parts: &[(&str, f64)]) {
        let Some(((last, _), others)) = parts.split_last() else { return };
        let now = Instant::now();
        let mut left = (now - self.last).as_secs_f64();
        for (part, seconds) in others {
            self.parts.insert((*part).into(), json!(seconds));
            left -= seconds;
        }
        self.parts.insert((*last).into(), json!(left));
        self.last = now;
    }

    /// Seconds of wall time of each part, and of all.
    fn json(mut self) -> Value {
        self.parts.insert("all".into(), json!((self.last - self.started).as_secs_f64()));
        Value::Object(self.parts)
    }
}

/// The JSON document. `levels` are those of the output or of its specular cube, `beside` the other maps of a profile.
pub fn report(made: &Filtered, written: &[Written], clock: Clock, snippet: Option<&str>) -> Value {
    let o = &made.request;
    let rows: Vec<Value> = made.levels.iter().enumerate().map(|(m, l)| row(m, l)).collect();
    let curve = (rows.len() > 1).then_some(made.plan.engine.curve.name());
    let mut document = json!({
        "kernel": o.kernel,
        "profile": o.engine.map(|e| e.name),
        "profile_doc": o.engine.map(|e| e.doc),
        "curve": curve,
        "tolerance": o.tolerance,
        "analysis": {
            "order": made.light.order(),
            "suns": made.light.suns().len(),
            "bright_texels": made.light.bright_texels().len(),
        },
        "beyond_range": made.beyond.map(|b| json!({
            "largest": b.largest,
            "peak": b.peak,
            "lost_without_remedy": b.lost,
            "taken_out": b.taken,
            "remedy": b.remedy.name(),
        })),
        "levels": rows,
        "files": written.iter().map(file).collect::<Vec<_>>(),
        "snippet": snippet,
        "seconds": clock.json(),
    });
    let mut others = Vec::new();
    for (map, level) in made.companions.maps() {
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

fn file(w: &Written) -> Value {
    let r = w.report;
    json!({"file": w.name, "clipped": r.clipped, "vanished": r.vanished, "lost": r.lost})
}

/// A level in the report. Errors are relative RMS: `predicted_error` and `measured_error` of the filter, `format_error`
/// of the texels' format (what comes back from the file less what was given), `error` of the file, which is the root of
/// the sum of squares of the last two.
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

/// What became of light that does not fit.
pub fn beyond(made: &Filtered, b: &BeyondRange) -> String {
    let engine = made.plan.engine.name;
    let (largest, peak, lost, taken) = (b.largest, b.peak, 100.0 * b.lost, 100.0 * b.taken);
    let would = format!("radiance is up to {peak:.3e}, and beyond {largest} {lost:.1} % of the light");
    match b.remedy {
        Remedy::Floats => format!("{engine}: {would} would be lost: the file has 32-bit floats, not halves"),
        Remedy::SunsTakenOut => {
            let n = made.request.suns.len();
            let suns = if n == 1 {
                "1 sun is a light of its own".into()
            } else {
                format!("{n} suns are lights of their own")
            };
            format!(
                "{engine}: {would} would be lost: {suns}, in _suns.json and below, and not in the map ({taken:.1} % of the light)"
            )
        }
        Remedy::Clipped => format!("{engine}: {would} is clipped; nothing of it is a sun to take out"),
    }
}

/// The report for people, on stderr.
pub fn say(made: &Filtered, written: &[Written], context: &Context) {
    for (m, l) in made.levels.iter().enumerate() {
        context.say(format_args!("level {m}: {}", words(l)));
    }
    for (map, l) in made.companions.maps() {
        context.say(format_args!("{map}: {}", words(l)));
    }
    for w in written {
        context.say(&w.name);
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
