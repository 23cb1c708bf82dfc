//! The atlas as one web page that needs no other file, as a table of numbers, and as a document.

use super::{Atlas, COLUMNS, Chapter, Entry, LIGHT, Outcome, Stage, Tried, published};
use crate::comparison::answer_json;
use crate::page::Page;
use crate::{Error, size_in_words};
use serde_json::{Value, json};

impl Stage {
    /// Its word in tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Shadowed => "shadowed",
            Self::Local => "local",
            Self::Scattered => "scattered",
            Self::Textured => "textured",
        }
    }

    fn title(self, brdf: &str) -> String {
        match self {
            Self::Open => format!("{brdf} under {LIGHT}"),
            Self::Shadowed => format!("{brdf} under {LIGHT}, with shadows"),
            Self::Local => format!("{brdf} under three directional lights"),
            Self::Scattered => {
                format!(
                    "{brdf} under three directional lights, with shadows and a reflection between surfaces"
                )
            }
            Self::Textured => format!("{brdf} with data per texel, under three directional lights"),
        }
    }

    fn about(self, unshadowed: Option<f64>) -> String {
        match self {
            Self::Open => "Beside the integral, nothing in the way.".into(),
            Self::Shadowed => format!(
                "Beside the path tracer; the integral without shadows differs from it by {} relative RMS.",
                unshadowed.map_or("–".into(), percent)
            ),
            Self::Local => "Beside the sum over the lights.".into(),
            Self::Scattered => "Beside the path tracer, of two scattering events.".into(),
            Self::Textured => "Beside the same surface without the data, which no reference knows: what is said is what the data change.".into(),
        }
    }
}

fn percent(x: f64) -> String {
    format!("{:.1} %", 100.0 * x)
}

/// Numbers of an entry's first renderer, then the GPU's seconds and difference.
fn numbers(e: &Entry) -> Vec<String> {
    let Some(r) = e.rendering() else { return vec!["–".into(); 8] };
    let errors = r.errors.as_ref();
    let gpu = e.answers.iter().filter_map(|a| a.rendering()).find(|r| r.backend == "gpu");
    vec![
        errors.map_or("–".into(), |e| percent(e.0.relative_rms)),
        errors.map_or("–".into(), |e| format!("{:.3}", e.0.stops)),
        errors.map_or("–".into(), |e| format!("{:.3}", e.1)),
        r.certificate.as_ref().map_or("–".into(), |c| percent(c.error)),
        size_in_words(r.bytes as u64),
        format!("{:.2} s", r.bake_seconds),
        format!("{:.0} ms", 1e3 * r.shade_seconds),
        gpu.map_or("–".into(), |g| {
            format!("{:.0} ms, FLIP {:.4}", 1e3 * g.shade_seconds, g.flip_to_cpu.unwrap_or_default())
        }),
    ]
}

/// Mark of a tried claim: the survey's letters where it holds, a dash where it is neither claimed nor holds.
fn mark(t: &Tried) -> &'static str {
    match (t.claimed, &t.outcome) {
        (true, Outcome::Holds(_)) => "x",
        (false, Outcome::Holds(_)) => "(x)",
        (true, Outcome::Fails(_)) => "fails",
        (true, Outcome::Untried(_)) => "x?",
        (false, _) => "·",
    }
}

impl Atlas {
    /// Claims that failed, as technique, column and measurement.
    pub fn broken(&self) -> Vec<[String; 3]> {
        let all = self.rows.iter().flat_map(|r| r.tried.iter().zip(COLUMNS).map(move |(t, c)| (r, t, c.0)));
        all.filter_map(|(r, t, column)| match (t.claimed, &t.outcome) {
            (true, Outcome::Fails(why)) => Some([r.card.slug.to_owned(), column.to_owned(), why.clone()]),
            _ => None,
        })
        .collect()
    }

    /// One page: advice, figure 11, and the pictures with their numbers.
    pub fn html(&self) -> Result<String, Error> {
        let about = "Every technique on the same scenes, beside the reference; figure 11 of Kautz, Hardware Lighting and Shading: a Survey (2004), with every claim tried; and the survey's advice held against the numbers.";
        let mut page = Page::new("Atlas of techniques", about);
        page.paragraph(&format!("Made in {:.0} s.", self.seconds));
        page.heading("The survey's advice");
        let head = ["the survey", "here", "found"].map(String::from);
        page.table(
            &head,
            self.advice.iter().map(|a| {
                let holds = match a.holds {
                    Some(true) => "holds",
                    Some(false) => "does not hold",
                    None => "not tried",
                };
                vec![a.says.into(), holds.into(), a.found.clone()]
            }),
        );
        self.figure(&mut page);
        for c in &self.chapters {
            chapter(&mut page, c)?;
        }
        Ok(page.finish())
    }

    fn figure(&self, page: &mut Page) {
        page.heading("Figure 11, tried");
        page.paragraph("x: claimed, and seen to hold. (x): not claimed, but holds. x?: claimed, and not tried here. fails: claimed, and seen not to hold. Behind a stroke what the survey prints: p potentially, s shadowing and i interreflections with other methods, n near interactive, d for diffuse surfaces in real time, w without shadowing and interreflections only.");
        let head: Vec<String> =
            ["technique", "light"].into_iter().chain(COLUMNS.map(|c| c.0)).map(String::from).collect();
        page.table(
            &head,
            self.rows.iter().map(|r| {
                let printed: Option<Vec<char>> = published(r.card.slug).map(|p| p.chars().collect());
                let light = if r.card.capabilities.global { "global" } else { "local" };
                let cells = r.tried.iter().enumerate().map(|(k, t)| match &printed {
                    Some(p) => format!("{} / {}", mark(t), p.get(k).copied().unwrap_or('·')),
                    None => mark(t).into(),
                });
                [r.card.slug.to_owned(), light.to_owned()].into_iter().chain(cells).collect()
            }),
        );
        page.heading("What was seen");
        let head: Vec<String> =
            std::iter::once("technique").chain(COLUMNS[5..].iter().map(|c| c.0)).map(String::from).collect();
        page.table(
            &head,
            self.rows.iter().map(|r| {
                let seen = r.tried[5..].iter().map(|t| match &t.outcome {
                    Outcome::Holds(s) | Outcome::Fails(s) | Outcome::Untried(s) => s.clone(),
                });
                std::iter::once(r.card.slug.to_owned()).chain(seen).collect()
            }),
        );
    }

    /// A line for each picture: `stage,technique,backend,` numbers, and last the reflectance, which has
    /// commas.
    pub fn csv(&self) -> String {
        let mut out = String::from(
            "stage,technique,backend,relative_rms,stops,flip,certified,bytes,bake_seconds,shade_seconds,brdf\n",
        );
        for c in &self.chapters {
            for (e, r) in
                c.entries.iter().flat_map(|e| e.answers.iter().filter_map(move |a| Some((e, a.rendering()?))))
            {
                let errors = r.errors.as_ref().map(|(e, flip)| [e.relative_rms, e.stops, *flip]);
                let errors = errors.unwrap_or([f64::NAN; 3]).map(|x| format!("{x:.5}")).join(",");
                let certified = r.certificate.as_ref().map_or(f64::NAN, |c| c.error);
                out.push_str(&format!(
                    "{},{},{},{errors},{certified:.5},{},{:.4},{:.5},{}\n",
                    c.stage.word(),
                    e.card.slug,
                    r.backend,
                    r.bytes,
                    r.bake_seconds,
                    r.shade_seconds,
                    c.brdf
                ));
            }
        }
        out
    }

    /// For `--json`.
    pub fn document(&self) -> Value {
        let chapters: Vec<Value> = self.chapters.iter().map(|c| {
            let all: Vec<Value> = c.entries.iter().flat_map(|e| &e.answers).map(answer_json).collect();
            json!({"stage": c.stage.word(), "brdf": c.brdf, "unshadowed": c.unshadowed, "techniques": all})
        }).collect();
        let rows: Vec<Value> = self
            .rows
            .iter()
            .map(|r| {
                let columns: serde_json::Map<String, Value> = r
                    .tried
                    .iter()
                    .zip(COLUMNS)
                    .map(|(t, c)| {
                        let (word, what) = match &t.outcome {
                            Outcome::Holds(s) => ("holds", s),
                            Outcome::Fails(s) => ("fails", s),
                            Outcome::Untried(s) => ("untried", s),
                        };
                        (c.0.to_owned(), json!({"claimed": t.claimed, "outcome": word, "found": what}))
                    })
                    .collect();
                json!({"technique": r.card.slug, "published": published(r.card.slug), "columns": columns})
            })
            .collect();
        let advice: Vec<Value> =
            self.advice.iter().map(|a| json!({"says": a.says, "found": a.found, "holds": a.holds})).collect();
        json!({"chapters": chapters, "figure_11": rows, "advice": advice, "seconds": self.seconds})
    }
}

fn chapter(page: &mut Page, c: &Chapter) -> Result<(), Error> {
    page.heading(&c.stage.title(&c.brdf));
    page.paragraph(&c.stage.about(c.unshadowed));
    if let Some(truth) = c.truth.rendering() {
        page.figure(&truth.picture, &truth.label.replace('_', " "))?;
    }
    for e in &c.entries {
        if let Some(r) = e.rendering() {
            let errors = r.errors.as_ref();
            let flip = errors.map_or(String::new(), |e| format!(", FLIP {:.3}", e.1));
            page.figure(&r.picture, &format!("{}{flip}", e.card.slug.replace('_', " ")))?;
        }
    }
    page.line_break();
    let head = ["technique", "RMS", "stops", "FLIP", "certified", "data", "bake", "shade, CPU", "shade, GPU"];
    page.table(
        &head.map(String::from),
        c.entries.iter().map(|e| std::iter::once(e.card.slug.to_owned()).chain(numbers(e)).collect()),
    );
    for e in &c.entries {
        if let Some(super::Answer::Refused { why, .. }) = e.answers.first() {
            page.paragraph(&format!("{}: {why}", e.card.slug));
        }
    }
    Ok(())
}
