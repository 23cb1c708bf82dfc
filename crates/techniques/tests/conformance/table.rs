//! The recorded error table: `tests/conformance/errors.txt`.

use super::harness::Found;
use std::path::PathBuf;

/// One measurement against the reference.
pub struct Line {
    key: String,
    /// Error found at the points that every run shades.
    found: f64,
    claimed: f64,
    /// The measured error, as precisely as the comparison with the certificate needs; measured where the
    /// table is recorded.
    precise: Found,
    /// Standard error of the certificate's own measurement.
    uncertain: f64,
    /// Noise that the certificate states as part of the error.
    noise: f64,
}

/// Is the table recorded now?
pub fn recording() -> bool {
    std::env::var_os("STERADIAN_BLESS").is_some()
}

impl Line {
    /// Technique, reflectance, light, error against the reference at the points of every run, error that the
    /// certificate states; where the table is recorded, `precise` measures the error with as many points as
    /// that takes.
    pub fn new(
        [slug, spec, light]: [&str; 3],
        found: f64,
        claimed: f64,
        precise: impl FnOnce() -> Found,
    ) -> Self {
        let precise = if recording() { precise() } else { Found { error: found, sigma: 0.0 } };
        Self {
            key: format!("{slug} | {spec} | {light}"),
            found,
            claimed,
            precise,
            uncertain: 5e-4,
            noise: 0.0,
        }
    }

    /// For a certificate measured against paths, which states their noise too.
    pub fn beside_paths(self, noise: Option<f64>) -> Self {
        match noise {
            Some(noise) => Self { uncertain: 2e-3, noise, ..self },
            None => self,
        }
    }

    fn text(&self) -> String {
        let Found { error, sigma } = self.precise;
        format!("{} | {error:.5} | {sigma:.5} | {:.5} | {:.5}\n", self.key, self.claimed, self.found)
    }

    /// The fault, compared with the recorded row.
    fn fault(&self, row: Option<&str>) -> Option<String> {
        let numbers: Option<Vec<f64>> =
            row.and_then(|r| r.split(" | ").map(|n| n.trim().parse().ok()).collect());
        let Some([error, sigma, _, before]) = numbers.as_deref() else {
            return Some(format!("{}: not recorded", self.key));
        };
        if (self.found - before).abs() > 0.05 * before + 5e-4 {
            return Some(format!("{}: {:.5}, recorded {before:.5}", self.key, self.found));
        }
        // A certificate passes where it is within a factor of two of the measured error.
        let noise = 3.0 * sigma + self.uncertain;
        let beyond_paths = (self.claimed.powi(2) - self.noise.powi(2)).max(0.0).sqrt();
        let honest = *error <= 2.0 * self.claimed + noise && error + noise >= 0.5 * beyond_paths;
        (!honest).then(|| format!("{}: {error:.5} ± {sigma:.5}, certificate {:.5}", self.key, self.claimed))
    }
}

fn path(file: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/conformance").join(file)
}

const HEAD: &str = "# technique | reflectance | light | relative RMS error against the reference | its standard error | as the \
                    certificate states | at the points of every run\n";

/// The table with these lines; where only some techniques were run, these replace lines with their keys, and
/// new ones go to the end.
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
    if recording() {
        let before = std::fs::read_to_string(path(file)).unwrap_or_default();
        std::fs::write(path(file), blessed(&before, lines)).expect("the table can be written");
        return;
    }
    let recorded =
        std::fs::read_to_string(path(file)).expect("the recorded table (STERADIAN_BLESS=1 makes it)");
    let row = |l: &Line| {
        recorded.lines().find_map(|r| r.strip_prefix(l.key.as_str())?.strip_prefix(" | ").map(str::to_owned))
    };
    let failures: Vec<String> = lines.iter().filter_map(|l| l.fault(row(l).as_deref())).collect();
    assert!(failures.is_empty(), "better or worse than recorded (STERADIAN_BLESS=1 records): {failures:#?}");
}
