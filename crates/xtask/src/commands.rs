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
    // A binary that is built already saves cargo from building it with other features of its dependencies.
    let mut command = match std::env::var_os("STERADIAN_BIN") {
        Some(binary) => Command::new(binary),
        None => {
            let mut cargo = Command::new(env!("CARGO"));
            cargo.args(["run", "--quiet", "-p", "steradian-cli", "--"]);
            cargo
        }
    };
    let out = command
        .args(words)
        .arg("--help")
        .env("COLUMNS", "100")
        .current_dir(root)
        .output()
        .context("cannot run the command: STERADIAN_BIN is its binary, else cargo builds it")?;
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
