//! Runs the command, and says what came of it.

use std::path::Path;
use std::process::{Command, Output};

/// The command in a folder.
pub fn run(dir: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_steradian")).current_dir(dir).args(arguments).output().expect("runs")
}

/// Exit code, standard output and standard error.
pub fn said(dir: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let o = run(dir, arguments);
    (o.status.code(), String::from_utf8_lossy(&o.stdout).into_owned(), stderr(&o))
}

/// What it wrote to standard error.
pub fn stderr(o: &Output) -> String {
    String::from_utf8_lossy(&o.stderr).into_owned()
}

/// Runs well.
pub fn done(dir: &Path, arguments: &[&str]) -> Output {
    let o = run(dir, arguments);
    assert_eq!(o.status.code(), Some(0), "{arguments:?}: {}", stderr(&o));
    o
}

/// Runs well; its standard output.
pub fn well(dir: &Path, arguments: &[&str]) -> String {
    String::from_utf8(done(dir, arguments).stdout).expect("UTF-8")
}

/// Runs well; the document that it writes.
pub fn json(dir: &Path, arguments: &[&str]) -> serde_json::Value {
    serde_json::from_str(&well(dir, arguments)).expect("JSON")
}

/// Exits with `code` and says one line that contains `want`.
pub fn fails(dir: &Path, code: i32, want: &str, arguments: &[&str]) {
    let (got, _, e) = said(dir, arguments);
    assert_eq!(got, Some(code), "{arguments:?}: {e}");
    assert!(e.trim_end().lines().count() == 1 && e.starts_with("steradian: "), "{arguments:?}: {e}");
    assert!(e.contains(want), "{arguments:?}: {e}");
}

/// Exits with `code`, and the last line that it says, after warnings, contains `want`.
pub fn ends(dir: &Path, code: i32, want: &str, arguments: &[&str]) {
    let (got, _, e) = said(dir, arguments);
    assert_eq!(got, Some(code), "{arguments:?}: {e}");
    assert!(e.lines().last().is_some_and(|l| l.contains(want)), "{arguments:?}: {e}");
}
