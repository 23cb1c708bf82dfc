//! What a comparison found, as a sheet of pictures, a table, a document and a web page.

use super::{Finding, Options, short};
use crate::failure::Failure;
use crate::report::{Page, answer_json, cell};
use serde_json::{Value, json};
use steradian_render::{Row, Sheet};
use steradian_session::compare::Answer;

fn columns(findings: &[Finding]) -> Vec<String> {
    // Every row answers for the same methods; those that no row shows have no column.
    let Some(first) = findings.first() else { return Vec::new() };
    let shown = |name: &String| {
        findings
            .iter()
            .any(|f| f.answers.iter().any(|a| a.name() == *name && matches!(a, Answer::Rendered(_))))
    };
    first.answers.iter().map(Answer::name).filter(|n| shown(n)).collect()
}

/// Pictures side by side.
pub fn sheet(o: &Options, findings: &[Finding]) -> Sheet {
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
            "{}: relative RMS error of radiance, and FLIP, over the pixels of the mesh",
            short(&o.mesh)
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
            json!({"environment": f.environment, "brdf": f.brdf, "techniques": answers})
        })
        .collect();
    json!({ "comparisons": rows })
}

/// Cells of one line of the table.
fn line(f: &Finding, a: &Answer) -> [String; 8] {
    let head = [f.environment.clone(), f.brdf.clone(), a.name()];
    let [environment, brdf, slug] = head;
    match a {
        Answer::Refused { why, .. } => {
            let none = || "-".to_string();
            [environment, brdf, slug, none(), none(), none(), none(), why.clone()]
        }
        Answer::Rendered(s) => {
            let error = |f: &dyn Fn(&(steradian_render::Errors, f64)) -> String| {
                s.errors.as_ref().map_or_else(|| "-".into(), f)
            };
            [
                environment,
                brdf,
                slug,
                error(&|e| format!("{:.2} %", 100.0 * e.0.relative_rms)),
                error(&|e| format!("{:.4}", e.1)),
                format!("{:.3}", s.bake_seconds),
                format!("{:.3}", s.shade_seconds),
                s.bytes.to_string(),
            ]
        }
    }
}

const HEAD: [&str; 8] =
    ["environment", "brdf", "technique", "rel. RMS", "FLIP", "bake s", "shade s", "bytes"];

/// The table in words.
pub fn table(findings: &[Finding]) -> String {
    let mut lines = vec![HEAD.map(String::from)];
    lines.extend(findings.iter().flat_map(|f| f.answers.iter().map(|a| line(f, a))));
    let width = |c: usize| lines.iter().map(|l| l[c].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..7).map(width).collect();
    lines
        .iter()
        .map(|l| {
            let cells: Vec<String> = (0..7).map(|c| format!("{:<w$}", l[c], w = widths[c])).collect();
            format!("{}  {}\n", cells.join("  "), l[7])
        })
        .collect()
}

/// The numbers of a row: relative RMS, FLIP, seconds of bake and picture, bytes; `None` for a refusal.
fn numbers(a: &Answer) -> Option<[Option<f64>; 5]> {
    let r = a.rendering()?;
    let e = r.errors.as_ref();
    let errors = [e.map(|e| e.0.relative_rms), e.map(|e| e.1)];
    Some([errors[0], errors[1], Some(r.bake_seconds), Some(r.shade_seconds), Some(r.bytes as f64)])
}

/// The table as CSV (RFC 4180), numbers in full; a refusal leaves them out and says why.
pub fn csv(findings: &[Finding]) -> String {
    let quoted = |t: &str| format!("\"{}\"", t.replace('"', "\"\""));
    let mut out = String::from(
        "environment,brdf,technique,relative_rms,flip,bake_seconds,shade_seconds,bytes,refused\n",
    );
    for f in findings {
        for a in &f.answers {
            let why = if let Answer::Refused { why, .. } = a { quoted(why) } else { String::new() };
            let all = numbers(a).unwrap_or([None; 5]);
            let all = all.map(|v| v.map_or_else(String::new, |v| v.to_string())).join(",");
            let head = [&f.environment, &f.brdf, &a.name()].map(|t| quoted(t)).join(",");
            out.push_str(&format!("{head},{all},{why}\n"));
        }
    }
    out
}

/// The table as LaTeX with booktabs; refusals are left out.
pub fn latex(findings: &[Finding]) -> String {
    let plain = |t: &str| -> String {
        t.chars().map(|c| if "_&%#$".contains(c) { format!("\\{c}") } else { c.into() }).collect()
    };
    let mut out = String::from(
        "\\begin{tabular}{lllrrrrr}\n\\toprule\nenvironment & reflectance & technique & rel.\\ RMS \\% & FLIP & \
         bake s & shade s & bytes \\\\\n\\midrule\n",
    );
    for f in findings {
        for (a, n) in f.answers.iter().filter_map(|a| Some((a, numbers(a)?))) {
            let number = |v: Option<f64>, scale: f64, digits: usize| {
                v.map_or_else(|| "--".into(), |v| format!("{:.digits$}", v * scale))
            };
            let cells = [
                plain(&f.environment),
                plain(&f.brdf),
                plain(&a.name()),
                number(n[0], 100.0, 2),
                number(n[1], 1.0, 4),
                number(n[2], 1.0, 3),
                number(n[3], 1.0, 3),
                number(n[4], 1.0, 0),
            ];
            out.push_str(&format!("{} \\\\\n", cells.join(" & ")));
        }
    }
    out.push_str("\\bottomrule\n\\end{tabular}\n");
    out
}

/// One web page.
pub fn html(o: &Options, findings: &[Finding]) -> Result<String, Failure> {
    let mut page = Page::new("Techniques and the reference", &short(&o.mesh));
    page.table(&HEAD, findings.iter().flat_map(|f| f.answers.iter().map(|a| line(f, a))));
    for f in findings {
        page.heading(&format!("{} under {}", f.brdf, f.environment));
        for a in &f.answers {
            let Answer::Rendered(s) = a else { continue };
            let caption = s.errors.as_ref().map_or_else(String::new, |(e, flip)| {
                format!(": {:.2} %, FLIP {flip:.3}", 100.0 * e.relative_rms)
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
