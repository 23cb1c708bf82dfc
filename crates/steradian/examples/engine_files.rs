//! A light becomes an engine's files: here Bevy's two cubes and the sun, with what to paste.

#![allow(clippy::print_stdout, reason = "an example says what it found")]

use std::path::Path;
use steradian::engines::{Engine, Filtered, Request};
use steradian::session::{Adjust, Error, Session};

/// Writes the files into `folder`; their names.
pub fn run(folder: &Path) -> Result<Vec<String>, Error> {
    let mut session = Session::new();
    let light = session.light("sky:elevation=25", &Adjust::default())?;
    let bevy = Engine::parse("bevy").map_err(Error::usage)?;
    let usual = Request::of(bevy, folder.join("bevy"), "evening");
    let request = Request { size: Some((32, 32)), tolerance: 1e-2, check: 16, ..usual };
    // Shared exponents do not hold the sun: it becomes a directional light of the snippet, and a file of its
    // own says what was taken out. `even_if_missed` would accept maps that miss the tolerance.
    let mut made = Filtered::new(request, light, &session.task)?.met()?;
    session.note_error(format!("relative RMS error {:.2e}", made.error()));
    let written = made.write(&session.provenance_pairs())?;
    println!("{}", made.snippet().unwrap_or_default());
    Ok(written.into_iter().map(|w| w.name).collect())
}

#[allow(dead_code, reason = "the test calls run()")]
fn main() -> Result<(), Error> {
    run(&std::env::temp_dir()).map(|_| ())
}
