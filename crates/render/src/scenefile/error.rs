//! Errors that point at file, line, column and key.

use std::ops::Range;
use steradian_base::unknown;

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
    /// The fault and, where that helps, how to correct it.
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

    /// The TOML parser's error in one line, with the nearest key where a key is unknown.
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
