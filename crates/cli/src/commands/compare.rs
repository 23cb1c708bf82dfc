//! `steradian compare`: techniques side by side against the reference.

use crate::commands::render::{save_display, size, tone_mapper};
use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, Adjust, Method};
use crate::study::{self, Answer, Case, Plan};
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use steradian_render::{Row, Settings, Sheet, ToneMapper};
use steradian_scene::{Bvh, Camera};

/// Options of `steradian compare`.
#[derive(Debug, Args)]
pub struct Options {
    /// Mesh file or built-in shape
    #[arg(value_name = "MESH|SHAPE", default_value = "sphere")]
    mesh: String,
    /// Image or sky spec; may be given several times [default: sky]
    #[arg(short, long, value_name = "FILE|SKY")]
    environment: Vec<String>,
    #[command(flatten)]
    adjust: Adjust,
    /// BRDF spec; may be given several times [default: lambert:albedo=0.6 and ggx:alpha=0.2]
    #[arg(short, long, value_name = "SPEC")]
    brdf: Vec<String>,
    /// Technique; may be given several times [default: all that take the material]
    #[arg(short, long, value_name = "SLUG")]
    technique: Vec<String>,
    /// Contact sheet
    #[arg(short, long, value_name = "OUT.png")]
    output: Option<PathBuf>,
    /// Report as a web page
    #[arg(long, value_name = "OUT.html")]
    html: Option<PathBuf>,
    /// Size of each picture
    #[arg(long, value_name = "WxH", default_value = "160x160", value_parser = size)]
    size: (usize, usize),
    /// Relative error of the reference at each sample
    #[arg(long, value_name = "T", default_value_t = 5e-3, value_parser = inputs::positive)]
    reference_tolerance: f64,
    /// Exit 4 where a technique's relative RMS error is larger
    #[arg(long, value_name = "T", value_parser = inputs::positive)]
    tolerance: Option<f64>,
    /// Tone mapper of the pictures and of FLIP
    #[arg(long, value_name = "NAME", value_parser = tone_mapper)]
    tone_mapper: Option<ToneMapper>,
}

/// A row of the table: light, material and what every technique makes of them.
struct Finding {
    environment: String,
    brdf: String,
    answers: Vec<Answer>,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let findings = study(&o, context)?;
    if let Some(path) = &o.output {
        save_display(path, &sheet(&o, &findings).draw(), Vec::new(), context)?;
    }
    if let Some(path) = &o.html {
        context.write_text(Some(path), &html(&o, &findings))?;
    }
    if context.common.json {
        context.print_json(document(&findings))?;
    } else {
        context.print(&table(&findings))?;
    }
    gate(&o, &findings)
}

fn study(o: &Options, context: &mut Context) -> Result<Vec<Finding>, Failure> {
    let or = |given: &[String], default: &[&str]| -> Vec<String> {
        if given.is_empty() { default.iter().map(|s| (*s).into()).collect() } else { given.to_vec() }
    };
    let methods: Vec<Method> = if o.technique.is_empty() {
        Method::slugs().into_iter().skip(1).map(Method::find).collect::<Result<_, _>>()?
    } else {
        o.technique.iter().filter(|t| *t != "reference").map(|t| Method::find(t)).collect::<Result<_, _>>()?
    };
    let mesh = inputs::mesh(&o.mesh, context)?;
    let aspect = o.size.0 as f32 / o.size.1 as f32;
    let (low, high) = mesh.bounds().ok_or_else(|| Failure::input(format!("{}: has no triangles", o.mesh)))?;
    let camera = Camera::framing(low, high, 30f32.to_radians(), aspect);
    let bvh = Bvh::build(&mesh);
    let mesh = Arc::new((mesh, bvh));
    let plan = Plan {
        settings: Settings { inner: 1, share: true, ..Settings::new(o.size.0, o.size.1) },
        tone_mapper: o.tone_mapper.unwrap_or_default(),
        tolerance: o.reference_tolerance,
    };
    let mut findings = Vec::new();
    for environment in or(&o.environment, &[inputs::DEFAULT_SKY]) {
        let lights = Arc::new(inputs::light(&environment, &o.adjust, context)?);
        let background = Arc::new(study::backdrop(&lights, &camera, o.size.1, 0.02));
        for spec in or(&o.brdf, &["lambert:albedo=0.6", "ggx:alpha=0.2"]) {
            let case = Case {
                label: Vec::new(),
                mesh: mesh.clone(),
                camera,
                lights: lights.clone(),
                brdf: inputs::brdf(&spec, context)?,
                background: background.clone(),
                ev: 0.0,
            };
            let answers = study::run(&case, &methods, &plan, context)?;
            findings.push(Finding { environment: short(&environment), brdf: short(&spec), answers });
        }
    }
    Ok(findings)
}

/// A name without its folders.
fn short(spec: &str) -> String {
    let (head, tail) = spec.split_once(':').unwrap_or(("", spec));
    let name = if tail.contains(['=', ',']) && !Path::new(spec).exists() {
        tail.to_string()
    } else {
        Path::new(tail).file_name().map_or_else(|| tail.into(), |n| n.to_string_lossy().into_owned())
    };
    if head.is_empty() || head.contains(['/', '\\']) { name } else { format!("{head}:{name}") }
}

fn columns(findings: &[Finding]) -> Vec<&'static str> {
    // Every row answers for the same methods; those that no row shows have no column.
    let Some(first) = findings.first() else { return Vec::new() };
    let shown = |slug: &str| {
        findings.iter().any(|f| f.answers.iter().any(|a| a.slug() == slug && matches!(a, Answer::Shown(_))))
    };
    first.answers.iter().map(Answer::slug).filter(|s| shown(s)).collect()
}

fn sheet(o: &Options, findings: &[Finding]) -> Sheet {
    let columns = columns(findings);
    let rows = findings
        .iter()
        .map(|f| Row {
            label: wrapped(&f.brdf).into_iter().chain(wrapped(&f.environment)).collect(),
            cells: columns.iter().map(|c| f.answers.iter().find(|a| a.slug() == *c)?.cell(false)).collect(),
        })
        .collect();
    Sheet {
        title: "Techniques and the reference".into(),
        subtitle: format!(
            "{}: relative RMS error of radiance, and FLIP, over the pixels of the mesh",
            short(&o.mesh)
        ),
        columns: columns.iter().map(|c| c.replace('_', " ")).collect(),
        rows,
        text_scale: 1.2,
    }
}

/// Lines of at most 24 characters, broken after commas and colons.
pub fn wrapped(text: &str) -> Vec<String> {
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

fn document(findings: &[Finding]) -> Value {
    let rows: Vec<Value> = findings
        .iter()
        .map(|f| {
            let answers: Vec<Value> = f.answers.iter().map(Answer::json).collect();
            json!({"environment": f.environment, "brdf": f.brdf, "techniques": answers})
        })
        .collect();
    json!({ "comparisons": rows })
}

/// Cells of one line of the table.
fn line(f: &Finding, a: &Answer) -> [String; 8] {
    let head = [f.environment.clone(), f.brdf.clone(), a.slug().to_string()];
    let [environment, brdf, slug] = head;
    match a {
        Answer::Refused { why, .. } => {
            let none = || "-".to_string();
            [environment, brdf, slug, none(), none(), none(), none(), why.clone()]
        }
        Answer::Shown(s) => {
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

fn table(findings: &[Finding]) -> String {
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

fn html(o: &Options, findings: &[Finding]) -> String {
    let mut out = String::from(
        "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>Steradian: techniques and the reference</title>\n\
         <style>body{font:15px/1.5 sans-serif;margin:2em;max-width:70em}table{border-collapse:collapse}td,th{padding:.3em .8em;border-bottom:1px solid #ddd;text-align:left}img{max-width:100%}</style>\n\
         <h1>Techniques and the reference</h1>\n",
    );
    if let Some(name) = o.output.as_ref().and_then(|p| p.file_name()) {
        let name = escaped(&name.to_string_lossy());
        out.push_str(&format!("<p><img src=\"{name}\" alt=\"contact sheet\"></p>\n"));
    }
    let row = |cells: &[String], tag: &str| {
        let cells: String = cells.iter().map(|c| format!("<{tag}>{}</{tag}>", escaped(c))).collect();
        format!("<tr>{cells}</tr>\n")
    };
    out.push_str("<table>\n");
    out.push_str(&row(&HEAD.map(String::from), "th"));
    for f in findings {
        f.answers.iter().for_each(|a| out.push_str(&row(&line(f, a), "td")));
    }
    out.push_str("</table></html>\n");
    out
}

fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    text.replace('"', "&quot;").replace('\'', "&#39;")
}

fn gate(o: &Options, findings: &[Finding]) -> Outcome {
    let Some(t) = o.tolerance else { return Ok(()) };
    for f in findings {
        for a in &f.answers {
            if let Answer::Shown(s) = a
                && let Some((e, _)) = &s.errors
                && (e.relative_rms > t || e.relative_rms.is_nan())
            {
                let why = format!(
                    "{} on {} under {}: error {:.4} is above {t}",
                    s.slug, f.brdf, f.environment, e.relative_rms
                );
                return Err(Failure::missed(why));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lose_folders_and_markup() {
        assert_eq!(short("/a/b/c.hdr"), "c.hdr");
        assert_eq!(short("merl:/a/b.binary"), "merl:b.binary");
        assert_eq!(short("ggx:alpha=0.1,f0=1/0.8/0.3"), "ggx:alpha=0.1,f0=1/0.8/0.3");
        assert_eq!(escaped("<a b=\"'&\">"), "&lt;a b=&quot;&#39;&amp;&quot;&gt;");
        assert_eq!(wrapped("ggx:alpha=0.1,f0=1.0/0.8/0.3,x=1"), ["ggx:alpha=0.1,", "f0=1.0/0.8/0.3,x=1"]);
    }
}
