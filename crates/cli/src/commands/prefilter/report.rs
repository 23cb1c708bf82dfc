//! What was made, as JSON and in words.

use super::engines::Curve;
use super::plan::{Kernel, Plan};
use super::{Job, Level, Options, files};
use crate::context::Context;
use serde_json::{Value, json};

/// The JSON document.
pub fn report(
    o: &Options,
    plan: &Plan,
    job: &Job<'_>,
    levels: &[Level],
    analysis: f64,
    written: &[files::Written],
    snippet: Option<&str>,
) -> Value {
    let rows: Vec<Value> = levels.iter().enumerate().map(|(m, l)| row(m, l)).collect();
    let chain = levels.len() > 1;
    let curve: Option<Curve> = chain.then_some(plan.engine.curve);
    json!({
        "kernel": o.kernel,
        "profile": o.profile.map(|e| e.name),
        "profile_doc": o.profile.map(|e| e.doc),
        "curve": curve.map(Curve::name),
        "tolerance": job.tolerance,
        "analysis": {
            "order": job.light.order(),
            "suns": job.light.suns().len(),
            "bright_texels": job.light.sparks().len(),
            "seconds": analysis,
        },
        "levels": rows,
        "files": written.iter().map(files::Written::json).collect::<Vec<_>>(),
        "snippet": snippet,
    })
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
    if let Some(work) = &l.by {
        work.report(&mut row);
    }
    row
}

/// The report for people, on stderr.
pub fn say(levels: &[Level], written: &[files::Written], context: &Context) {
    for (m, l) in levels.iter().enumerate() {
        let f = &l.filtered;
        let r = l.filter.roughness.map(|r| format!(" r {r:.3}")).unwrap_or_default();
        let e = l
            .measured
            .map(|d| format!(", error rms {:.1e} worst {:.1e}", d.rms, d.worst))
            .unwrap_or_default();
        let engine = || format!("{} to band {}", f.way.name(), f.way.order());
        let way = l.by.as_ref().map_or_else(engine, |work| work.name().into());
        context.say(format_args!(
            "level {m}: {} x {}{r}, {way}{e}, {:.0} ms",
            f.image.width,
            f.image.height,
            l.seconds * 1e3
        ));
    }
    for w in written {
        context.say(&w.name);
    }
}
