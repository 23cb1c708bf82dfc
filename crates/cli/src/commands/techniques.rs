//! `steradian techniques`: what there is, and its sources as BibTeX.

use crate::context::Context;
use crate::failure::Outcome;
use clap::Args;
use serde_json::{Value, json};
use steradian_techniques::{Card, bibtex, cards};

/// Options of `steradian techniques`.
#[derive(Debug, Args)]
pub struct Options {
    /// The works that the techniques come from, as BibTeX with the techniques in the notes, and Steradian
    /// itself
    #[arg(long)]
    bibtex: bool,
}

pub fn run(o: Options, context: &Context) -> Outcome {
    if o.bibtex {
        return context.print(&bibtex());
    }
    let cards: Vec<&Card> = cards().collect();
    if context.common.json {
        let one = |c: &&Card| -> Value {
            json!({
                "technique": c.slug,
                "title": c.title,
                "local": !c.capabilities.global,
                "light": c.light.to_string(),
                "reflectance": c.reflectance.to_string(),
                "citation": c.citation,
            })
        };
        return context.print_json(json!({ "techniques": cards.iter().map(one).collect::<Vec<_>>() }));
    }
    let width = cards.iter().map(|c| c.slug.len()).max().unwrap_or(0);
    let lines: String = cards.iter().map(|c| format!("{:width$}  {}\n", c.slug, c.title)).collect();
    context.print(&lines)
}
