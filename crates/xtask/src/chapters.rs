//! The error tables of the techniques' chapters, from what the conformance suite recorded.

use crate::Page;
use anyhow::{Context, Result, bail};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use steradian_techniques::registry;

const RECORDED: &str = "crates/techniques/tests/conformance/errors.txt";
const BEGIN: &str = "<!-- errors -->\n";
const END: &str = "<!-- /errors -->\n";

/// Names of the suite's lights, as rows of the recorded table have them and as chapters do.
const LIGHTS: [(&str, &str); 3] =
    [("smooth", "smooth sky"), ("studio", "soft boxes"), ("sunny", "sky with sun")];

/// The chapters of all techniques with their error tables as recorded.
pub fn pages(root: &Path) -> Result<Vec<Page>> {
    let recorded = std::fs::read_to_string(root.join(RECORDED)).context(RECORDED)?;
    let chapter = |slug: &str| {
        let path = format!("crates/techniques/src/rooms/{slug}/README.md");
        let text = std::fs::read_to_string(root.join(&path)).with_context(|| path.clone())?;
        let parts = text.split_once(BEGIN).and_then(|(before, rest)| Some((before, rest.split_once(END)?.1)));
        let Some((before, after)) = parts else { bail!("{path} has no lines {BEGIN:?} and {END:?}") };
        Ok(Page { text: format!("{before}{BEGIN}{}{END}{after}", table(slug, &recorded)?), path })
    };
    registry().iter().map(|t| chapter(t.card().slug)).collect()
}

/// A technique's rows.
fn table(slug: &str, recorded: &str) -> Result<String> {
    // Reflectances in the order of the record; cells by light.
    let mut specs = Vec::new();
    let mut cells = BTreeMap::new();
    for row in recorded.lines().skip(1) {
        let [of, spec, light, found, stated] = row.split(" | ").collect::<Vec<_>>()[..] else {
            bail!("{RECORDED}: {row:?} has not five columns");
        };
        if of != slug {
            continue;
        }
        if !specs.contains(&spec) {
            specs.push(spec);
        }
        cells.insert((spec, light), format!("{} ({})", short(found)?, short(stated)?));
    }
    let mut out = String::from(
        "**Error.** Relative RMS of outgoing radiance against the reference, no tolerance given, and in parentheses what \
         the certificate states.\nThe points are those that certificates take: views uniform in solid angle, and as many \
         that mirror suns and lamps. The conformance suite records\nand checks these numbers; `cargo run -p \
         steradian-xtask -- pages` writes them here.\n\n| reflectance |",
    );
    LIGHTS.iter().for_each(|(_, name)| out += &format!(" {name} |"));
    out += "\n|---|---|---|---|\n";
    for spec in specs {
        // Writes to a `String` cannot fail.
        let _ = write!(out, "| `{spec}` |");
        for (light, _) in LIGHTS {
            let _ = write!(out, " {} |", cells.get(&(spec, light)).map_or("", |c| c.as_str()));
        }
        out += "\n";
    }
    Ok(out)
}

/// Two significant digits.
fn short(number: &str) -> Result<String> {
    let x: f64 = number.trim().parse().with_context(|| format!("{RECORDED}: {number}"))?;
    let digits = if x > 0.0 { (1.0 - x.log10().floor()).clamp(0.0, 5.0) as usize } else { 0 };
    Ok(format!("{x:.digits$}"))
}
