//! The recorded error table: `tests/conformance/errors.txt`.

use super::harness::Found;
use std::path::PathBuf;

/// One measurement against the reference.
pub struct Line {
    key: String,
    found: Found,
    claimed: f64,
    /// The error that the certificate is held against.
    honest: Found,
}

impl Line {
    /// Technique, reflectance, light, error against the reference, error that the certificate states.
    pub fn new(slug: &str, spec: &str, light: &str, found: Found, claimed: f64) -> Self {
        Self { key: format!("{slug} | {spec} | {light}"), found, claimed, honest: found }
    }

    /// An error that has no noise.
    pub fn plain(slug: &str, spec: &str, light: &str, error: f64, claimed: f64) -> Self {
        Self::new(slug, spec, light, Found { error, sigma: 0.0 }, claimed)
    }

    /// Does the certificate claim more than twice the error? Few points may miss what decides it, such as edges that a
    /// mirror shows: then `more` of them tell.
    pub fn doubted(mut self, more: impl FnOnce() -> Found) -> Self {
        if self.exaggerates() {
            self.honest = more();
        }
        self
    }

    fn exaggerates(&self) -> bool {
        let Found { error, sigma } = self.honest;
        error + 3.0 * sigma + 2e-3 < 0.5 * self.claimed
    }

    fn text(&self) -> String {
        format!("{} | {:.5} | {:.5}\n", self.key, self.found.error, self.claimed)
    }
}

fn path(file: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/conformance").join(file)
}

const HEAD: &str = "# technique | reflectance | light | relative RMS error against the reference | as the certificate states\n";

/// The table with these lines; where some techniques alone were tried, with these in place of those of the same keys, and new
/// ones at the end.
fn blessed(before: &str, lines: &[Line]) -> String {
    let mut text = String::from(HEAD);
    if std::env::var_os("STERADIAN_TECHNIQUES").is_none() {
        lines.iter().for_each(|l| text += &l.text());
        return text;
    }
    for row in before.lines().skip(1) {
        let same = |l: &&Line| row.strip_prefix(l.key.as_str()).is_some_and(|r| r.starts_with(" | "));
        text += &lines.iter().find(same).map_or_else(|| format!("{row}\n"), Line::text);
    }
    let known = |l: &&Line| before.lines().any(|row| row.starts_with(&format!("{} | ", l.key)));
    lines.iter().filter(|l| !known(l)).for_each(|l| text += &l.text());
    text
}

/// Compares with the recorded table, or records it where `STERADIAN_BLESS` is set.
pub fn compare(lines: &[Line]) {
    compare_with("errors.txt", lines);
}

/// [`compare`] with the table in `file`.
pub fn compare_with(file: &str, lines: &[Line]) {
    let text: String = lines.iter().map(Line::text).collect();
    println!("{HEAD}{text}");
    if std::env::var_os("STERADIAN_BLESS").is_some() {
        let before = std::fs::read_to_string(path(file)).unwrap_or_default();
        std::fs::write(path(file), blessed(&before, lines)).expect("the table can be written");
        return;
    }
    let recorded =
        std::fs::read_to_string(path(file)).expect("the recorded table (STERADIAN_BLESS=1 makes it)");
    let mut failures = Vec::new();
    for l in lines {
        let row = recorded.lines().find_map(|r| r.strip_prefix(l.key.as_str())?.strip_prefix(" | "));
        let before = row.and_then(|r| r.split(" | ").next()?.trim().parse::<f64>().ok());
        let Some(before) = before else {
            failures.push(format!("{}: not recorded", l.key));
            continue;
        };
        let error = l.found.error;
        if (error - before).abs() > 0.05 * before + 5e-4 {
            failures.push(format!("{}: {error:.5}, recorded {before:.5}", l.key));
        }
        // A certificate is honest where it is within a factor of two of what the reference finds.
        let Found { error, sigma } = l.honest;
        if error > 2.0 * l.claimed + 3.0 * sigma + 2e-3 || l.exaggerates() {
            failures.push(format!("{}: {error:.5} ± {sigma:.5}, certificate {:.5}", l.key, l.claimed));
        }
    }
    assert!(failures.is_empty(), "better or worse than recorded (STERADIAN_BLESS=1 records): {failures:#?}");
}
