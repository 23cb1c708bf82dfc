//! Results of a comparison, as a sheet of pictures, a table, a document and a web page.

use super::{Finding, answer_json, cell};
use crate::Error;
use crate::compare::{Answer, Rendering};
use crate::page::Page;
use serde_json::{Value, json};
use steradian_render::{Row, Sheet};
use steradian_techniques::Capabilities;

fn columns(findings: &[Finding]) -> Vec<String> {
    // Every row has the same methods; a method without a picture in any row has no column.
    let Some(first) = findings.first() else { return Vec::new() };
    let shown = |name: &String| {
        findings
            .iter()
            .any(|f| f.answers.iter().any(|a| a.name() == *name && matches!(a, Answer::Rendered(_))))
    };
    first.answers.iter().map(Answer::name).filter(|n| shown(n)).collect()
}

/// Pictures side by side, with the name of the mesh.
pub fn sheet(mesh: &str, findings: &[Finding]) -> Sheet {
    let columns = columns(findings);
    let rows = findings
        .iter()
        .map(|f| Row {
            label: wrapped(&f.brdf).into_iter().chain(wrapped(&f.environment)).collect(),
            cells: columns.iter().map(|c| cell(f.answers.iter().find(|a| a.name() == *c)?, false)).collect(),
        })
        .collect();
    Sheet {
        title: "Techniques and the reference".into(),
        subtitle: format!(
            "{}: FLIP, and the mean difference in photographic stops, over the pixels of the mesh",
            mesh
        ),
        columns: columns.iter().map(|c| heading(c)).collect(),
        rows,
        text_size: 12.5,
    }
}

/// A technique's name in words; that of a file stays as it is.
fn heading(column: &str) -> String {
    let (slug, file) = column.split_once(' ').unwrap_or((column, ""));
    format!("{} {file}", slug.replace('_', " ")).trim_end().into()
}

/// Lines of at most 24 characters, broken after commas and colons.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for piece in text.split_inclusive([',', ':', ' ']) {
        let last = lines.len() - 1;
        if !lines[last].is_empty() && lines[last].len() + piece.len() > 24 {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            line.push_str(piece);
        }
    }
    lines
}

/// For `--json`.
pub fn document(findings: &[Finding]) -> Value {
    let rows: Vec<Value> = findings
        .iter()
        .map(|f| {
            let answers: Vec<Value> = f.answers.iter().map(answer_json).collect();
            json!({"environment": f.environment, "brdf": f.brdf, "value": f.value, "techniques": answers})
        })
        .collect();
    json!({ "comparisons": rows })
}

/// A number of the tables: FLIP and stops first, which describe visible differences.
struct Column {
    /// Name in CSV and in the JSON document.
    name: &'static str,
    /// Heading in texts.
    head: &'static str,
    value: fn(&Rendering) -> Option<f64>,
    /// Factor and digits in texts.
    shown: (f64, usize),
}

const COLUMNS: [Column; 8] = {
    const fn column(
        name: &'static str,
        head: &'static str,
        value: fn(&Rendering) -> Option<f64>,
        shown: (f64, usize),
    ) -> Column {
        Column { name, head, value, shown }
    }
    [
        column("flip", "FLIP", |r| Some(r.errors.as_ref()?.1), (1.0, 4)),
        column("stops", "stops", |r| Some(r.errors.as_ref()?.0.stops), (1.0, 3)),
        column("median", "median %", |r| Some(r.errors.as_ref()?.0.median), (100.0, 2)),
        column("ninetieth", "90th %", |r| Some(r.errors.as_ref()?.0.ninetieth), (100.0, 2)),
        column("relative_rms", "RMS %", |r| Some(r.errors.as_ref()?.0.relative_rms), (100.0, 2)),
        column("bake_seconds", "bake s", |r| Some(r.bake_seconds), (1.0, 3)),
        column("shade_seconds", "shade s", |r| Some(r.shade_seconds), (1.0, 3)),
        column("bytes", "bytes", |r| Some(r.bytes as f64), (1.0, 0)),
    ]
};

impl Column {
    fn text(&self, r: &Rendering) -> Option<String> {
        let (factor, digits) = self.shown;
        (self.value)(r).map(|v| format!("{:.digits$}", factor * v))
    }
}

/// A capability of techniques, a column of figure 11 of Kautz, *Hardware Lighting and Shading: a Survey*
/// (2004).
struct Claim {
    /// Name in CSV and in the JSON document.
    name: &'static str,
    /// Heading in texts.
    head: &'static str,
    holds: fn(&Capabilities) -> bool,
}

const CLAIMS: [Claim; 3] = [
    Claim { name: "bump_mapping", head: "normal maps", holds: |c| c.bump_mapping },
    Claim { name: "dynamic_lighting", head: "light changes", holds: |c| c.dynamic_lighting },
    Claim { name: "dynamic_objects", head: "objects deform", holds: |c| c.dynamic_objects },
];

impl Claim {
    fn text(&self, a: &Answer) -> String {
        a.capabilities().map_or("-", |c| if (self.holds)(&c) { "yes" } else { "no" }).into()
    }
}

/// For the JSON document: capabilities of an answer's technique.
pub(super) fn claims(a: &Answer) -> impl Iterator<Item = (String, Value)> + use<> {
    let all = a.capabilities();
    CLAIMS.iter().map(move |claim| (claim.name.into(), all.as_ref().map(claim.holds).into()))
}

/// Has any row a technique for directional and point lights? It then has a column of its own.
fn has_local(findings: &[Finding]) -> bool {
    findings.iter().flat_map(|f| &f.answers).any(|a| a.names().1.is_some())
}

/// Headings of the columns that identify a row: light, material, technique, and where `local` that for
/// directional and point lights.
fn headings(local: bool) -> &'static [&'static str] {
    let all: &[&str] = &["environment", "brdf", "technique", "local"];
    &all[..3 + usize::from(local)]
}

/// Entries of a row under [`headings`].
fn names(f: &Finding, a: &Answer, local: bool) -> Vec<String> {
    let (technique, other) = a.names();
    let other = local.then(|| other.unwrap_or_else(|| "-".into()));
    [f.environment.clone(), f.brdf.clone(), technique].into_iter().chain(other).collect()
}

fn head(local: bool) -> Vec<String> {
    let names = headings(local).iter().copied();
    let all = names.chain(COLUMNS.iter().map(|c| c.head)).chain(CLAIMS.iter().map(|c| c.head));
    all.map(String::from).collect()
}

/// Columns before the last, which says why where there is a refusal.
fn before_last(local: bool) -> usize {
    headings(local).len() + COLUMNS.len() + CLAIMS.len() - 1
}

/// Cells of one line of the table; a refusal says why.
fn line(f: &Finding, a: &Answer, local: bool) -> Vec<String> {
    let mut out = names(f, a, local);
    match a {
        Answer::Refused { why, .. } => {
            out.resize(before_last(local), "-".into());
            out.push(why.clone());
        }
        Answer::Rendered(r) => {
            out.extend(COLUMNS.iter().map(|c| c.text(r).unwrap_or_else(|| "-".into())));
            out.extend(CLAIMS.iter().map(|c| c.text(a)));
        }
    }
    out
}

/// The table in words.
pub fn table(findings: &[Finding]) -> String {
    let local = has_local(findings);
    let mut lines = vec![head(local)];
    lines.extend(findings.iter().flat_map(|f| f.answers.iter().map(|a| line(f, a, local))));
    let last = before_last(local);
    let width = |c: usize| lines.iter().map(|l| l[c].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..last).map(width).collect();
    lines
        .iter()
        .map(|l| {
            let cells: Vec<String> = (0..last).map(|c| format!("{:<w$}", l[c], w = widths[c])).collect();
            format!("{}  {}\n", cells.join("  "), l[last])
        })
        .collect()
}

/// The table as CSV (RFC 4180), numbers in full; a refusal leaves them out and says why.
pub fn csv(findings: &[Finding]) -> String {
    let quoted = |t: &str| format!("\"{}\"", t.replace('"', "\"\""));
    let columns: Vec<&str> = COLUMNS.iter().map(|c| c.name).chain(CLAIMS.iter().map(|c| c.name)).collect();
    // The value of a sweep has a column of its own, for plots.
    let swept = findings.iter().any(|f| f.value.is_some());
    let value = if swept { "value," } else { "" };
    let local = has_local(findings);
    let mut out = format!("{},{value}{},refused\n", headings(local).join(","), columns.join(","));
    for f in findings {
        for a in &f.answers {
            let why = if let Answer::Refused { why, .. } = a { quoted(why) } else { String::new() };
            let number =
                |c: &Column| a.rendering().and_then(c.value).map_or_else(String::new, |v| v.to_string());
            let value = f.value.filter(|_| swept).map(|v| v.to_string());
            let names = names(f, a, local).into_iter().map(|t| quoted(&t)).chain(value);
            let claims = CLAIMS.iter().map(|c| c.text(a).replace('-', ""));
            let cells = names.chain(COLUMNS.iter().map(number)).chain(claims);
            out.push_str(&format!("{},{why}\n", cells.collect::<Vec<_>>().join(",")));
        }
    }
    out
}

/// The table as LaTeX with booktabs; refusals are left out.
pub fn latex(findings: &[Finding]) -> String {
    let plain = |t: &str| -> String {
        t.chars().map(|c| if "_&%#$".contains(c) { format!("\\{c}") } else { c.into() }).collect()
    };
    let row = |cells: Vec<String>| {
        format!("{} \\\\\n", cells.iter().map(|c| plain(c)).collect::<Vec<_>>().join(" & "))
    };
    let local = has_local(findings);
    let left = "l".repeat(headings(local).len());
    let right = "r".repeat(COLUMNS.len()) + &"l".repeat(CLAIMS.len());
    let mut out = format!("\\begin{{tabular}}{{{left}{right}}}\n\\toprule\n");
    out.push_str(&row(head(local)));
    out.push_str("\\midrule\n");
    for f in findings {
        for (a, r) in f.answers.iter().filter_map(|a| Some((a, a.rendering()?))) {
            let number = |c: &Column| c.text(r).unwrap_or_else(|| "--".into());
            let cells = names(f, a, local).into_iter().chain(COLUMNS.iter().map(number));
            out.push_str(&row(cells.chain(CLAIMS.iter().map(|c| c.text(a))).collect()));
        }
    }
    out.push_str("\\bottomrule\n\\end{tabular}\n");
    out
}

/// One web page.
pub fn html(mesh: &str, findings: &[Finding]) -> Result<String, Error> {
    let mut page = Page::new("Techniques and the reference", mesh);
    let local = has_local(findings);
    page.table(&head(local), findings.iter().flat_map(|f| f.answers.iter().map(|a| line(f, a, local))));
    for f in findings {
        page.heading(&format!("{} under {}", f.brdf, f.environment));
        for a in &f.answers {
            let Answer::Rendered(s) = a else { continue };
            let caption = s.errors.as_ref().map_or_else(String::new, |(e, flip)| {
                format!(": FLIP {flip:.3}, {:.2} stops, RMS {:.2} %", e.stops, 100.0 * e.relative_rms)
            });
            page.figure(&s.picture, &format!("{}{caption}", a.name()))?;
            if let Some(d) = &s.difference {
                page.figure(d, &format!("{}: FLIP per pixel", a.name()))?;
            }
        }
    }
    Ok(page.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_are_broken_and_slugs_are_words() {
        assert_eq!(wrapped("ggx:alpha=0.1,f0=1.0/0.8/0.3,x=1"), ["ggx:alpha=0.1,", "f0=1.0/0.8/0.3,x=1"]);
        assert_eq!(heading("shrm_slices my_bake.safetensors"), "shrm slices my_bake.safetensors");
        assert_eq!(heading("split_sum"), "split sum");
    }
}
