//! What can be wrong with a spec string.

use steradian_base::brief;

/// Why a spec string names no reflectance; displays as one line that says what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpecError {
    /// No such model.
    #[error("no BRDF model '{}'{}; there are: {}", brief(.name), suggest(.nearest), .available.join(", "))]
    UnknownModel {
        /// What was written.
        name: String,
        /// The nearest known name.
        nearest: Option<&'static str>,
        /// What exists.
        available: Vec<&'static str>,
    },
    /// The model has no such key.
    #[error("BRDF {model} has no key '{}'{}; it takes: {}", brief(.key), suggest(.nearest), .accepted.join(", "))]
    UnknownKey {
        /// The model.
        model: &'static str,
        /// What was written.
        key: String,
        /// The nearest known key.
        nearest: Option<&'static str>,
        /// What it takes.
        accepted: Vec<&'static str>,
    },
    /// A key without default is missing.
    #[error("BRDF {model} needs '{key}=': {meaning}")]
    MissingKey {
        /// The model.
        model: &'static str,
        /// The key.
        key: &'static str,
        /// What the key means.
        meaning: &'static str,
    },
    /// A value that cannot be used.
    #[error("BRDF {model}: {} = '{}' is not {expected}", brief(.key), brief(.value))]
    Value {
        /// The model.
        model: &'static str,
        /// The key.
        key: String,
        /// What was written.
        value: String,
        /// What is accepted.
        expected: String,
    },
    /// The same key twice, or an item that is not `key=value`.
    #[error("BRDF {model}: {what}")]
    Syntax {
        /// The model.
        model: &'static str,
        /// What is wrong and how to write it.
        what: String,
    },
    /// No such published set or material.
    #[error("BRDF {model} has no set '{}'{}; there are: {}", brief(.name), suggest(.nearest), .available.join(", "))]
    UnknownSet {
        /// The model.
        model: &'static str,
        /// What was written.
        name: String,
        /// The nearest known name.
        nearest: Option<&'static str>,
        /// What exists.
        available: Vec<&'static str>,
    },
    /// A kind of reflectance that this version does not read.
    #[error("BRDF '{name}:' is not available in this version ({what}); there are: {}", .available.join(", "))]
    NotAvailable {
        /// What was written.
        name: &'static str,
        /// What it would be.
        what: &'static str,
        /// What exists.
        available: Vec<&'static str>,
    },
    /// A file of parameters that cannot be read or does not hold what it should.
    #[error("{}: {what}", brief(.file))]
    File {
        /// The file.
        file: String,
        /// The fault.
        what: String,
    },
}

fn suggest(nearest: &Option<&'static str>) -> String {
    nearest.map(|n| format!(" (did you mean '{n}'?)")).unwrap_or_default()
}

/// The name nearest to `word` by edit distance, if it is near enough to be a slip.
pub(crate) fn nearest(word: &str, names: &[&'static str]) -> Option<&'static str> {
    let best = names.iter().map(|n| (distance(&word.to_lowercase(), n), *n)).min()?;
    (best.0 <= 1 + word.chars().count() / 4).then_some(best.1)
}

/// Levenshtein's edit distance.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().take(64).collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().take(64).enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(ca != *cb);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_recognised() {
        assert_eq!(nearest("lamberd", &["lambert", "ggx"]), Some("lambert"));
        assert_eq!(nearest("gx", &["lambert", "ggx"]), Some("ggx"));
        assert_eq!(nearest("quartz", &["lambert", "ggx"]), None);
        assert_eq!(distance("kitten", "sitting"), 3);
    }
}
