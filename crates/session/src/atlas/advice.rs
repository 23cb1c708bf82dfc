//! Advice of sections 6.5 and 7.7 of the survey, compared with measurements.

use super::{Chapter, Entry, GLOSSY, MATTE, Outcome, Row, Stage};

/// A piece of advice.
#[derive(Debug, Clone)]
pub struct Advice {
    /// The survey's words.
    pub says: &'static str,
    /// The measurements.
    pub found: String,
    /// Does it hold here? `None` where techniques that it compares were left out.
    pub holds: Option<bool>,
}

/// Methods that project to spherical harmonics and know the mesh: references 52, 83 and 84 of the survey.
const HARMONIC: [&str; 3] = ["prt_glossy", "matrix_radiance_transfer", "clustered_pca"];

pub(super) fn all(chapters: &[Chapter], rows: &[Row]) -> Vec<Advice> {
    let found = Found { chapters, rows };
    vec![found.diffuse(), found.shadowed(), found.any_brdf(), found.sharp(), found.fixed(), found.flexible()]
}

struct Found<'a> {
    chapters: &'a [Chapter],
    rows: &'a [Row],
}

impl Found<'_> {
    fn chapter(&self, stage: Stage, brdf: &str) -> Option<&Chapter> {
        self.chapters.iter().find(|c| c.stage == stage && c.brdf == brdf)
    }

    fn entry(&self, stage: Stage, brdf: &str, slug: &str) -> Option<&Entry> {
        self.chapter(stage, brdf)?.entries.iter().find(|e| e.card.slug == slug)
    }

    /// The glossy reflectance that a technique has a picture of at a stage, and its error there.
    fn glossy(&self, stage: Stage, slug: &str) -> Option<(&str, f64)> {
        let mut all = self.chapters.iter().filter(|c| c.stage == stage && c.brdf != MATTE);
        all.find_map(|c| Some((c.brdf.as_str(), c.entries.iter().find(|e| e.card.slug == slug)?.error()?)))
    }

    fn diffuse(&self) -> Advice {
        let says = "For diffuse surfaces, the algorithm by Ramamoorthi et al. is very good if shadowing does not need to be included.";
        let own = self
            .entry(Stage::Open, MATTE, "sh_irradiance")
            .and_then(|e| Some((e.error()?, e.rendering()?.bytes)));
        let others = self.chapter(Stage::Open, MATTE).into_iter().flat_map(|c| &c.entries);
        let smallest = others.filter_map(|e| Some(e.rendering()?.bytes)).min();
        let Some(((error, bytes), smallest)) = own.zip(smallest) else { return missing(says) };
        Advice {
            says,
            found: format!(
                "sh_irradiance is {} off with {bytes} bytes; the smallest data of all are {smallest} bytes",
                percent(error)
            ),
            holds: Some(error < 0.1 && bytes == smallest),
        }
    }

    fn shadowed(&self) -> Advice {
        let says = "If diffuse surfaces with self-shadowing are desired, then Ng et al.'s or Sloan et al.'s algorithm is very well-suited.";
        let errors =
            ["haar_transport", "prt_diffuse"].map(|s| self.entry(Stage::Shadowed, MATTE, s)?.error());
        let without = self.chapter(Stage::Shadowed, MATTE).and_then(|c| c.unshadowed);
        let ([Some(haar), Some(sh)], Some(without)) = (errors, without) else { return missing(says) };
        Advice {
            says,
            found: format!(
                "haar_transport is {} off and prt_diffuse {}; the integral without shadows {}",
                percent(haar),
                percent(sh),
                percent(without)
            ),
            holds: Some(haar.max(sh) < 0.5 * without),
        }
    }

    fn any_brdf(&self) -> Advice {
        let says = "If arbitrary BRDFs are to be included (with or without shadowing), then one of the SH precomputed radiance transfer methods is preferred if you can live with the restriction to low-frequency SH (differences are only in speed and difficulty of implementation).";
        let chapter = self.chapters.iter().find(|c| c.stage == Stage::Shadowed && c.brdf == GLOSSY);
        let errors: Vec<(&str, f64)> = HARMONIC
            .iter()
            .filter_map(|s| Some((*s, self.entry(Stage::Shadowed, GLOSSY, s)?.error()?)))
            .collect();
        let without = chapter.and_then(|c| c.unshadowed);
        let (Some(without), false) = (without, errors.is_empty()) else { return missing(says) };
        let named: Vec<String> = errors.iter().map(|(s, e)| format!("{s} {}", percent(*e))).collect();
        Advice {
            says,
            found: format!(
                "with shadows {} off; the integral without shadows {}",
                named.join(", "),
                percent(without)
            ),
            holds: Some(errors.iter().all(|(_, e)| *e < without)),
        }
    }

    fn sharp(&self) -> Advice {
        let says = "Higher-frequency (dynamic) illumination is possible with Kautz et al.'s method, at the cost of only working with approximations of isotropic BRDFs and no self-shadowing.";
        let filter = self.glossy(Stage::Open, "paraboloid_filter");
        let harmonics = self.entry(Stage::Open, GLOSSY, "sh_brdf").and_then(Entry::error);
        let Some(((lobe, filter), harmonics)) = filter.zip(harmonics) else { return missing(says) };
        Advice {
            says,
            found: format!(
                "paraboloid_filter is {} off for {lobe}, spherical harmonics of five bands (sh_brdf) {} for {GLOSSY}",
                percent(filter),
                percent(harmonics)
            ),
            holds: Some(filter < harmonics),
        }
    }

    fn fixed(&self) -> Advice {
        let says = "If the lighting is static, then the method by Latta and Kolb is best. It allows arbitrary isotropic BRDFs to be rendered in real-time but with good quality.";
        let own = self.entry(Stage::Open, GLOSSY, "factored_lighting").and_then(Entry::error);
        let others = self.chapter(Stage::Open, GLOSSY).into_iter().flat_map(|c| &c.entries);
        let better: Vec<String> = match own {
            Some(own) => others
                .filter_map(|e| Some((e.card.slug, e.error()?)))
                .filter(|(_, error)| *error < own)
                .map(|(slug, error)| format!("{slug} {}", percent(error)))
                .collect(),
            None => return missing(says),
        };
        let own = own.unwrap_or_default();
        Advice {
            says,
            found: format!(
                "factored_lighting is {} off; nearer are {}",
                percent(own),
                if better.is_empty() { "none".into() } else { better.join(", ") }
            ),
            holds: Some(better.is_empty()),
        }
    }

    fn flexible(&self) -> Advice {
        let says = "The algorithm by Kautz and Seidel is probably the most flexible and most widely used one (of those for local light).";
        let claims =
            |r: &&Row| r.tried.iter().filter(|t| t.claimed && matches!(t.outcome, Outcome::Holds(_))).count();
        let local: Vec<&Row> = self.rows.iter().filter(|r| !r.card.capabilities.global).collect();
        let own = local.iter().find(|r| r.card.slug == "shift_variant");
        let Some((own, most)) = own.zip(local.iter().max_by_key(|r| claims(r))) else { return missing(says) };
        Advice {
            says,
            found: format!(
                "shift_variant keeps {} of its claims here, {} the most: {}",
                claims(own),
                most.card.slug,
                claims(most)
            ),
            holds: Some(claims(own) == claims(most)),
        }
    }
}

fn missing(says: &'static str) -> Advice {
    Advice { says, found: "techniques that it compares were left out".into(), holds: None }
}

fn percent(x: f64) -> String {
    format!("{:.1} %", 100.0 * x)
}
