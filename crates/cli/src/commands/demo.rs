//! `steradian demo`: the first picture, from nothing but formulas.

use crate::context::Context;
use crate::failure::Outcome;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;
use steradian_session::comparison::answer_json;

/// Options of `steradian demo`.
#[derive(Debug, Args)]
pub struct Options {
    /// The picture
    #[arg(short, long, value_name = "OUT.png", default_value = "steradian-demo.png")]
    output: PathBuf,
    /// Width of each of its three panels in pixels
    #[arg(long, value_name = "N", default_value_t = 510, value_parser = clap::value_parser!(u16).range(32..=2048))]
    size: u16,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    context.check_output(&o.output, &["png"])?;
    let start = Instant::now();
    let demo = context.demo(usize::from(o.size))?;
    context.write_display(&o.output, &demo.sheet().draw(), Vec::new())?;
    let seconds = start.elapsed().as_secs_f64();
    if context.common.json {
        let techniques: Vec<_> = demo.answers.iter().map(answer_json).collect();
        let name = o.output.file_name().map(|n| n.to_string_lossy());
        return context.print_json(json!({"output": name, "seconds": seconds, "techniques": techniques}));
    }
    context.say(format_args!("{}: {seconds:.1} s", o.output.display()));
    let (brdf, slug) = demo.next();
    context.say(format_args!(
        "next: steradian render knot --environment sky:elevation=6 --brdf {brdf} --technique {slug} -o knot.png"
    ));
    Ok(())
}
