//! What is said of a picture.

use super::Options;
use crate::context::Context;
use crate::failure::Outcome;
use serde_json::{Value, json};
use steradian_session::{Choice, Local, Picture, Prepared, Scene, Trial};

pub fn report(o: &Options, scene: &Scene, picture: &Picture, context: &Context) -> Outcome {
    let Picture { develop, materials, seconds, backend, .. } = picture;
    let (w, h, ev) = (scene.settings.width, scene.settings.height, develop.ev);
    if context.common.json {
        return context.print_json(json!({
            "output": o.output.file_name().map(|n| n.to_string_lossy()),
            "width": w,
            "height": h,
            "exposure": ev,
            "triangles": scene.mesh.triangles.len(),
            "backend": backend,
            "render_seconds": seconds,
            "materials": materials.iter().map(material_json).collect::<Vec<_>>(),
        }));
    }
    let bake: f64 = materials.iter().map(|m| m.seconds).sum();
    let choice: f64 = materials.iter().filter_map(|m| m.choice.as_ref()).map(|c| c.seconds).sum();
    let samples = materials.iter().filter(|m| m.choice.is_none()).map(|m| m.sample_seconds).sum();
    let taken = |what: &str, seconds: f64| {
        if seconds > 0.0 { format!("{what} {seconds:.2} processor s, ") } else { String::new() }
    };
    let looked = taken("choice", choice) + &taken("error in the picture", samples);
    let path = o.output.display();
    context.say(format_args!(
        "{path}: {w} x {h}, {looked}bake {bake:.2} s, render {seconds:.2} s, exposure {ev:+.2} EV"
    ));
    Ok(())
}

fn material_json(m: &Prepared) -> Value {
    json!({
        "brdf": m.spec(),
        "technique": m.method.slug(),
        "local": m.material.local.as_ref().map(Local::label),
        "bake_seconds": m.seconds,
        "bytes": m.bytes,
        "error": m.error(),
        "error_known": m.known(),
        "picture_error": m.picture_error.map(|e| e.relative_rms),
        "picture_median": m.picture_error.map(|e| e.median),
        "picture_ninetieth": m.picture_error.map(|e| e.ninetieth),
        "silhouette_error": m.picture_error.and_then(|e| e.silhouettes),
        "picture_unmeasured": m.picture_unmeasured,
        "sample_processor_seconds": m.sample_seconds,
        "choice": m.choice.as_deref().map(choice_json),
    })
}

fn choice_json(c: &Choice) -> Value {
    let trial = |t: &Trial| {
        json!({
            "technique": t.technique,
            "processor_seconds": t.seconds,
            "error": t.error,
            "verdict": t.verdict.word(),
        })
    };
    json!({
        "processor_seconds": c.seconds,
        "trials": c.trials.iter().map(trial).collect::<Vec<_>>(),
    })
}
