//! How long the README's first command compiles, crate by crate: `cargo build --release --timings` from
//! nothing, in a folder of its own.

use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Rows of the table; the rest is one more.
const ROWS: usize = 20;

/// One compilation of one crate (build scripts and their runs count by themselves).
struct Unit {
    name: String,
    seconds: f64,
}

/// Builds, and prints the table.
#[expect(clippy::print_stdout, reason = "the table is the output")]
pub fn run(root: &Path) -> Result<()> {
    let target = root.join("target/build-times");
    if target.exists() {
        std::fs::remove_dir_all(&target).context("cannot empty target/build-times")?;
    }
    let start = Instant::now();
    let status = Command::new(std::env::var("CARGO").unwrap_or_else(|_| "cargo".into()))
        .current_dir(root)
        .args(["build", "--release", "--timings", "-p", "steradian-cli", "--target-dir"])
        .arg(&target)
        .status()
        .context("cannot start cargo")?;
    if !status.success() {
        bail!("the build failed");
    }
    let wall = start.elapsed().as_secs_f64();
    let page = target.join("cargo-timings/cargo-timing.html");
    let page = std::fs::read_to_string(page).context("cargo wrote no timings")?;
    print!("{}", table(&units(&page)?, wall));
    Ok(())
}

/// What cargo's page holds as `const UNIT_DATA = [...];`.
fn units(page: &str) -> Result<Vec<Unit>> {
    let text = page.split_once("UNIT_DATA = ").context("cargo's page of timings has another form")?.1;
    let mut values = serde_json::Deserializer::from_str(text).into_iter::<Value>();
    let Some(Ok(Value::Array(all))) = values.next() else { bail!("cargo's timings are no list") };
    let unit = |v: &Value| {
        let name = v.get("name")?.as_str()?.to_owned();
        Some(Unit { name, seconds: v.get("duration")?.as_f64()? })
    };
    let mut units: Vec<Unit> = Vec::new();
    for u in all.iter().filter_map(unit) {
        match units.iter_mut().find(|v| v.name == u.name) {
            Some(same) => same.seconds += u.seconds,
            None => units.push(u),
        }
    }
    units.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    Ok(units)
}

fn table(units: &[Unit], wall: f64) -> String {
    let all: f64 = units.iter().map(|u| u.seconds).sum();
    let row = |name: &str, s: f64| format!("{name:<28}{s:>8.1} s{:>7.1} %\n", 100.0 * s / all.max(1e-9));
    let mut out: String = units.iter().take(ROWS).map(|u| row(&u.name, u.seconds)).collect();
    let rest: f64 = units.iter().skip(ROWS).map(|u| u.seconds).sum();
    let others = units.len().saturating_sub(ROWS);
    out += &row(&format!("{others} others"), rest);
    out += &row("all crates", all);
    out + &format!("from start to end           {wall:>8.1} s\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crates_are_added_up_and_sorted() {
        let page = r#"<script>const UNIT_DATA = [
            {"i":0,"name":"a","duration":1.5},{"i":1,"name":"b","duration":4},{"i":2,"name":"a","duration":0.5}
        ];
        const CPU_USAGE = [];"#;
        let units = units(page).expect("parses");
        assert_eq!(
            units.iter().map(|u| (u.name.as_str(), u.seconds)).collect::<Vec<_>>(),
            [("b", 4.0), ("a", 2.0)]
        );
        let table = table(&units, 3.0);
        assert!(table.contains("66.7 %") && table.ends_with("3.0 s\n"), "{table}");
        assert!(super::units("nothing").is_err());
    }
}
