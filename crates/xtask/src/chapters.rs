//! The error tables of the techniques' chapters, from what the conformance suite recorded.

use crate::Page;
use anyhow::{Context, Result, bail};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use steradian_techniques::{locals, registry};

/// Where the suite records errors: of techniques for environments, and for local light.
const RECORDED: [&str; 2] = [
    "crates/techniques/tests/conformance/errors.txt",
    "crates/techniques/tests/conformance/local_errors.txt",
];
const BEGIN: &str = "<!-- errors -->\n";
const END: &str = "<!-- /errors -->\n";

/// A light for each texel of a height map.
const BUMPS: &str = "bumps";

/// Names of the suite's lights, as rows of the recorded table have them and as chapters do.
const LIGHTS: [&[(&str, &str)]; 2] = [
    &[("smooth", "smooth sky"), ("studio", "soft boxes"), ("sunny", "sky with sun")],
    &[
        ("point", "near point light"),
        ("directionals", "three directional lights"),
        (BUMPS, "on bumps, a light for each texel"),
    ],
];

/// What the errors are, and what their points are.
const POINTS: [&str; 2] = [
    "The points are of the kinds that certificates take, others of them and as many as it takes for a standard error of 5 %: views uniform in solid angle, and as many that mirror suns and lamps.",
    "The points are 4096 of a ball, with views up to the horizon; parameters are the defaults, or where these need a mesh others that need none.",
];

/// What they are on bumps.
const ON_BUMPS: &str = " On bumps they are texels, under lights and from views as certificates have them, where the bump faces the viewer.";

/// The chapters of all techniques with their error tables as recorded.
pub fn pages(root: &Path) -> Result<Vec<Page>> {
    let read = |file: &'static str| std::fs::read_to_string(root.join(file)).context(file);
    let recorded = [read(RECORDED[0])?, read(RECORDED[1])?];
    let chapter = |slug: &str, local: usize| {
        let path = format!("crates/techniques/src/rooms/{slug}/README.md");
        let text = std::fs::read_to_string(root.join(&path)).with_context(|| path.clone())?;
        let parts = text.split_once(BEGIN).and_then(|(before, rest)| Some((before, rest.split_once(END)?.1)));
        let Some((before, after)) = parts else { bail!("{path} has no lines {BEGIN:?} and {END:?}") };
        Ok(Page {
            text: format!("{before}{BEGIN}{}{END}{after}", table(slug, &recorded[local], local)?),
            path,
        })
    };
    let far = registry().iter().map(|t| chapter(t.card().slug, 0));
    far.chain(locals().iter().map(|t| chapter(t.card().slug, 1))).collect()
}

/// A technique's rows.
fn table(slug: &str, recorded: &str, local: usize) -> Result<String> {
    let file = RECORDED[local];
    // Reflectances in the order of the record; cells by light.
    let mut specs = Vec::new();
    let mut cells = BTreeMap::new();
    for row in recorded.lines().skip(1) {
        let [of, spec, light, found, _, stated, _] = row.split(" | ").collect::<Vec<_>>()[..] else {
            bail!("{file}: {row:?} has not seven columns");
        };
        if of != slug {
            continue;
        }
        if !specs.contains(&spec) {
            specs.push(spec);
        }
        cells.insert((spec, light), format!("{} ({})", short(found)?, short(stated)?));
    }
    // Bumps are for techniques that read heights.
    let bumps = cells.keys().any(|k: &(&str, &str)| k.1 == BUMPS);
    let points = format!("{}{}", POINTS[local], if bumps { ON_BUMPS } else { "" });
    let mut out = format!(
        "**Error.** Relative RMS of outgoing radiance against the reference, no tolerance given, and in parentheses what \
         the certificate states.\n{points} The conformance suite records\nand checks these numbers; `cargo run -p \
         steradian-xtask -- pages` writes them here.\n\n| reflectance |"
    );
    let tried = |light: &&(&str, &str)| bumps || light.0 != BUMPS;
    let lights: Vec<_> = LIGHTS[local].iter().filter(tried).collect();
    lights.iter().for_each(|(_, name)| out += &format!(" {name} |"));
    out += "\n|---|";
    out += &"---|".repeat(lights.len());
    out += "\n";
    for spec in specs {
        // Writes to a `String` cannot fail.
        let _ = write!(out, "| `{spec}` |");
        for (light, _) in &lights {
            let _ = write!(out, " {} |", cells.get(&(spec, *light)).map_or("", |c| c.as_str()));
        }
        out += "\n";
    }
    Ok(out)
}

/// Two significant digits.
fn short(number: &str) -> Result<String> {
    let x: f64 = number.trim().parse().with_context(|| format!("recorded errors: {number}"))?;
    let digits = if x > 0.0 { (1.0 - x.log10().floor()).clamp(0.0, 5.0) as usize } else { 0 };
    Ok(format!("{x:.digits$}"))
}
