//! Errors that point at file, line, column and key.

use std::ops::Range;
use steradian_base::brief;

/// A fault in a scene file; displays as one line `file:line:column: …`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}:{line}:{column}: {why}")]
pub struct SceneError {
    /// The file's name.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1, in characters.
    pub column: usize,
    /// The fault and, where that helps, what to write.
    pub why: String,
}

/// A scene file's text, to turn byte positions into lines.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// The file's name.
    pub file: &'a str,
    /// Its text.
    pub text: &'a str,
}

impl Source<'_> {
    /// An error at byte `at`.
    pub fn error(&self, at: usize, why: impl Into<String>) -> SceneError {
        let before = self.text.get(..at.min(self.text.len())).unwrap_or(self.text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
        SceneError { file: self.file.into(), line, column, why: why.into() }
    }

    /// What the TOML parser found, in one line, with the nearest key where a key is unknown.
    pub fn parse_error(&self, e: &toml::de::Error) -> SceneError {
        let span = e.span().unwrap_or(0..0);
        let message = e.message().replace('\n', " ");
        let why = match unknown_field(&message) {
            Some((word, known)) => unknown("key", word, &known),
            None => format!("{}{message}", self.key_before(&span)),
        };
        self.error(span.start, why)
    }

    /// `key 'x': ` where the line of `span` starts like `x = …`.
    fn key_before(&self, span: &Range<usize>) -> String {
        let start = self.text[..span.start.min(self.text.len())].rfind('\n').map_or(0, |i| i + 1);
        let line = self.text[start..].lines().next().unwrap_or("");
        match line.split_once('=') {
            Some((key, _)) if !key.trim().is_empty() && start + key.len() < span.end => {
                format!("key '{}': ", key.trim())
            }
            _ => String::new(),
        }
    }
}

/// serde's "unknown field `x`, expected one of `a`, `b`" → x and (a, b).
fn unknown_field(message: &str) -> Option<(&str, Vec<&str>)> {
    let rest = message.strip_prefix("unknown field ")?;
    let mut quoted = rest.split('`').skip(1).step_by(2);
    Some((quoted.next()?, quoted.collect()))
}

/// Names that a message lists.
const MOST_NAMES: usize = 64;

/// "unknown KIND 'x' (did you mean 'y'?); there are: …".
pub fn unknown(kind: &str, word: &str, known: &[&str]) -> String {
    let nearest = known.iter().map(|k| (distance(word, k), *k)).min();
    let hint = match nearest {
        Some((d, k)) if d <= 1 + word.chars().count() / 3 => format!(" (did you mean '{k}'?)"),
        _ => String::new(),
    };
    let more = if known.len() > MOST_NAMES { ", …" } else { "" };
    let known = &known[..known.len().min(MOST_NAMES)];
    format!("unknown {kind} '{}'{hint}; there are: {}{more}", brief(word), known.join(", "))
}

/// Levenshtein's edit distance, where `-` and `_` are the same.
fn distance(a: &str, b: &str) -> usize {
    let fold = |s: &str| -> Vec<char> { s.to_lowercase().replace('-', "_").chars().take(64).collect() };
    let (a, b) = (fold(a), fold(b));
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.iter().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, cb) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}
