//! The command's own help, page by page.

use anyhow::{Context, Result, ensure};
use std::path::Path;
use std::process::Command;

/// `docs/commands.md`: `steradian --help` and each command's `--help`, as the binary prints them.
pub fn page(root: &Path) -> Result<String> {
    let top = help(root, &[])?;
    let mut out = format!("# Commands\n\n```text\n{}\n```\n", top.trim_end());
    for name in names(&top) {
        let text = help(root, &[&name])?;
        out.push_str(&format!("\n## `steradian {name}`\n\n```text\n{}\n```\n", text.trim_end()));
    }
    Ok(out)
}

fn help(root: &Path, words: &[&str]) -> Result<String> {
    let out = Command::new(env!("CARGO"))
        .args(["run", "--quiet", "-p", "steradian-cli", "--"])
        .args(words)
        .arg("--help")
        .env("COLUMNS", "100")
        .current_dir(root)
        .output()
        .context("cannot run cargo")?;
    ensure!(
        out.status.success(),
        "steradian {} --help failed: {}",
        words.join(" "),
        String::from_utf8_lossy(&out.stderr)
    );
    Ok(String::from_utf8_lossy(&out.stdout).lines().map(str::trim_end).collect::<Vec<_>>().join("\n"))
}

/// Names below "Commands:" in clap's help.
fn names(top: &str) -> Vec<String> {
    top.lines()
        .skip_while(|l| !l.starts_with("Commands:"))
        .skip(1)
        .take_while(|l| !l.is_empty())
        .filter_map(|l| l.split_whitespace().next())
        .filter(|n| *n != "help")
        .map(str::to_owned)
        .collect()
}
