//! Results of comparisons, as tables, charts, pages and files from which a comparison resumes.

mod chart;
mod forms;
mod kept;
mod request;
mod sweep;

use crate::compare::Answer;
use serde_json::{Value, json};
use steradian_render::Cell;

pub use chart::drawing;
pub use forms::{csv, document, html, latex, sheet, table};
use kept::{Kept, digest};
pub use request::{Request, short};
use sweep::mark;
pub use sweep::{Sweep, Swept};

/// A row of a comparison: light, material and the answer of every technique.
pub struct Finding {
    /// The light, without folders.
    pub environment: String,
    /// The material.
    pub brdf: String,
    /// The reflectance without the parameter that a sweep sets.
    pub base: String,
    /// The value that a sweep sets.
    pub value: Option<f64>,
    /// The reference's answer, then those of the techniques.
    pub answers: Vec<Answer>,
}

impl Finding {
    /// The first technique whose picture's error exceeds `tolerance`, in words.
    pub fn missed(&self, tolerance: f64) -> Option<String> {
        // NaN counts as worse than any error.
        let misses = |a: &&Answer| a.error().is_some_and(|e| e > tolerance || e.is_nan());
        let r = self.answers.iter().find(misses)?.rendering()?;
        let error = r.errors.as_ref()?.0.relative_rms;
        let Self { brdf, environment, .. } = self;
        Some(format!("{} on {brdf} under {environment}: error {error:.4} is above {tolerance}", r.label))
    }
}

/// The cell of a contact sheet; nothing for a refusal. `named` puts the technique's name into the caption.
pub(crate) fn cell(answer: &Answer, named: bool) -> Option<Cell> {
    let r = answer.rendering()?;
    let error = r.errors.as_ref().map(|(e, flip)| format!("FLIP {flip:.3}, {:.2} stops", e.stops));
    let name = match (named, &error) {
        (false, _) => None,
        (true, Some(_)) => Some(answer.name().replace('_', " ")),
        (true, None) => Some("reference".into()),
    };
    Some(Cell { picture: r.picture.clone(), caption: name.into_iter().chain(error).collect() })
}

/// An answer as JSON.
pub fn answer_json(answer: &Answer) -> Value {
    match answer {
        Answer::Refused { label, backend, why } => {
            json!({"technique": label, "backend": backend, "refused": why})
        }
        Answer::Rendered(r) => with_claims(
            answer,
            json!({
                "technique": r.label,
                "backend": r.backend,
                "relative_rms": r.errors.as_ref().map(|e| e.0.relative_rms),
                "rmse": r.errors.as_ref().map(|e| e.0.rmse),
                "median": r.errors.as_ref().map(|e| e.0.median),
                "ninetieth": r.errors.as_ref().map(|e| e.0.ninetieth),
                "stops": r.errors.as_ref().map(|e| e.0.stops),
                "rel_mse": r.errors.as_ref().map(|e| e.0.rel_mse),
                "flip": r.errors.as_ref().map(|e| e.1),
                "flip_to_cpu": r.flip_to_cpu,
                "certificate": r.certificate.as_ref().map(|c| json!({"error": c.error, "known": c.known.word()})),
                "bake_seconds": r.bake_seconds,
                "shade_seconds": r.shade_seconds,
                "bytes": r.bytes,
            }),
        ),
    }
}

/// The document of an answer with its technique's capabilities.
fn with_claims(answer: &Answer, mut document: Value) -> Value {
    if let Some(fields) = document.as_object_mut() {
        fields.extend(forms::claims(answer));
    }
    document
}
