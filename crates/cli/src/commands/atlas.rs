//! `steradian atlas`: every technique on the same scenes, and the survey's figure 11 tried.

use crate::commands::compare::renderers;
use crate::commands::render::size;
use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs;
use clap::Args;
use std::path::PathBuf;
use std::time::Instant;
use steradian_session::Destinations;
use steradian_session::atlas::{Plan, SHAPE};

/// Options of `steradian atlas`.
#[derive(Debug, Args)]
pub struct Options {
    /// Folder of the page (index.html, which needs no other file) and the numbers (atlas.csv)
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Technique, local ones too; may be given several times [default: all]
    #[arg(short, long, value_name = "SLUG")]
    technique: Vec<String>,
    /// Size of each picture, pixels
    #[arg(long, value_name = "WxH", default_value = "160x120", value_parser = size)]
    size: (usize, usize),
    /// Relative noise of the path tracer's pictures
    #[arg(long, value_name = "T", default_value_t = 0.05, allow_negative_numbers = true, value_parser = inputs::positive)]
    noise: f64,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let known: Vec<&str> = steradian_session::Method::slugs()
        .into_iter()
        .chain(steradian_session::Local::slugs())
        .filter(|s| !["reference", "path", "exact"].contains(s))
        .collect();
    for slug in &o.technique {
        if !known.contains(&slug.replace('-', "_").as_str()) {
            return Err(Failure::usage(steradian_base::unknown("technique", slug, &known)));
        }
    }
    let mut places = Destinations::default();
    let [page, numbers] = ["index.html", "atlas.csv"].map(|name| o.output.join(name));
    std::fs::create_dir_all(&o.output)
        .map_err(|e| Failure::failed(format!("{}: cannot make the folder: {e}", o.output.display())))?;
    places.file("--output", &page)?;
    places.file("--output", &numbers)?;
    let start = Instant::now();
    let renderers = renderers(context)?;
    let plan = Plan { size: [o.size.0, o.size.1], noise: o.noise, only: o.technique, shape: SHAPE };
    let atlas = context.atlas(&plan, &renderers)?;
    context.write_words(Some(&page), &atlas.html()?)?;
    context.write_words(Some(&numbers), &atlas.csv())?;
    if context.common.json {
        context.print_json(atlas.document())?;
    } else {
        for [slug, column, why] in atlas.broken() {
            context.say(format_args!("{slug} claims '{column}', which does not hold: {why}"));
        }
        for a in &atlas.advice {
            let holds = a.holds.map_or("not tried", |h| if h { "holds" } else { "does not hold" });
            context.say(format_args!("{holds}: {}", a.found));
        }
        context.say(format_args!("{}: {:.0} s", page.display(), start.elapsed().as_secs_f64()));
    }
    Ok(())
}
