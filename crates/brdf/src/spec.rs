//! Spec strings: `name:key=value,key=value`, with scalars or `r/g/b` triples.

use crate::error::nearest;
use crate::{Files, Info, SpecError};
use std::fmt;
use steradian_base::brief;

/// An interval of accepted values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Interval {
    pub min: f64,
    pub max: f64,
}

impl Interval {
    /// 0 ≤ x ≤ 1.
    pub const UNIT: Self = Self::closed(0.0, 1.0);
    /// x ≥ 0, finite.
    pub const NON_NEGATIVE: Self = Self::closed(0.0, f64::INFINITY);
    /// Any finite number.
    pub const ANY: Self = Self::closed(f64::NEG_INFINITY, f64::INFINITY);

    /// min ≤ x ≤ max.
    pub const fn closed(min: f64, max: f64) -> Self {
        Self { min, max }
    }

    fn contains(&self, x: f64) -> bool {
        x.is_finite() && (self.min..=self.max).contains(&x)
    }
}

impl fmt::Display for Interval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.min.is_finite(), self.max.is_finite()) {
            (false, _) => write!(f, "a finite number"),
            (true, false) => write!(f, "a finite number of at least {}", self.min),
            (true, true) => write!(f, "a number in {} … {}", self.min, self.max),
        }
    }
}

/// The parsed keys of one spec string.
#[derive(Debug)]
pub(crate) struct Args<'a> {
    info: &'static Info,
    /// Those that the spec may open.
    pub files: Files<'a>,
    /// The item without `=`, where the model takes one (`sgd:NAME`, `lafortune:@skin`).
    pub name: Option<String>,
    pairs: Vec<(String, String)>,
}

/// Every model takes it.
pub(crate) const SCALE: &str = "scale";

impl<'a> Args<'a> {
    /// Splits `body` (what follows `name:`) and refuses unknown keys.
    pub fn new(
        info: &'static Info,
        takes_name: bool,
        body: &str,
        files: Files<'a>,
    ) -> Result<Self, SpecError> {
        let mut args = Self { info, files, name: None, pairs: Vec::new() };
        for item in body.split(',').map(str::trim).filter(|i| !i.is_empty()) {
            match item.split_once('=') {
                Some((key, value)) => args.push(key.trim(), value.trim())?,
                None if takes_name && args.name.is_none() => args.name = Some(item.to_owned()),
                None => {
                    return Err(args.syntax(format!("'{}' is not key=value; {}", brief(item), args.usage())));
                }
            }
        }
        Ok(args)
    }

    fn push(&mut self, key: &str, value: &str) -> Result<(), SpecError> {
        let accepted: Vec<_> = self.keys().collect();
        if !accepted.contains(&key) {
            let nearest = nearest(key, &accepted);
            return Err(SpecError::UnknownKey { model: self.info.name, key: key.into(), nearest, accepted });
        }
        if self.has(key) {
            return Err(self.syntax(format!("key '{}' is given twice; give it once", brief(key))));
        }
        self.pairs.push((key.to_owned(), value.to_owned()));
        Ok(())
    }

    /// The keys of the model.
    fn keys(&self) -> impl Iterator<Item = &'static str> {
        let own = self.info.parameters.iter().map(|p| p.0).filter(|k| !k.starts_with(['@', 'N']));
        own.chain([SCALE])
    }

    fn usage(&self) -> String {
        format!("it takes: {}", self.keys().map(|k| format!("{k}=")).collect::<Vec<_>>().join(", "))
    }

    /// An error of form.
    pub fn syntax(&self, what: String) -> SpecError {
        SpecError::Syntax { model: self.info.name, what }
    }

    /// Is the key given?
    pub fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// The text of a key.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.pairs.iter().find(|p| p.0 == key).map(|p| p.1.as_str())
    }

    /// The error of a value.
    pub fn refuse(&self, key: &str, expected: String) -> SpecError {
        let value = self.get(key).unwrap_or_default().to_owned();
        SpecError::Value { model: self.info.name, key: key.into(), value, expected }
    }

    fn missing(&self, key: &'static str) -> SpecError {
        let meaning = self.info.parameters.iter().find(|p| p.0 == key).map_or("", |p| p.1);
        SpecError::MissingKey { model: self.info.name, key, meaning }
    }

    /// A number that must be given.
    pub fn required(&self, key: &'static str, range: Interval) -> Result<f64, SpecError> {
        self.optional(key, range)?.ok_or_else(|| self.missing(key))
    }

    /// A number with a default.
    pub fn number(&self, key: &str, range: Interval, default: f64) -> Result<f64, SpecError> {
        Ok(self.optional(key, range)?.unwrap_or(default))
    }

    /// A number, if given.
    pub fn optional(&self, key: &str, range: Interval) -> Result<Option<f64>, SpecError> {
        let Some(text) = self.get(key) else { return Ok(None) };
        match text.parse::<f64>() {
            Ok(x) if range.contains(x) => Ok(Some(x)),
            _ => Err(self.refuse(key, range.to_string())),
        }
    }

    /// A scalar or an `r/g/b` triple, with a default.
    pub fn rgb(&self, key: &str, range: Interval, default: f64) -> Result<[f64; 3], SpecError> {
        let Some(text) = self.get(key) else { return Ok([default; 3]) };
        let values: Result<Vec<f64>, _> = text.split('/').map(|t| t.trim().parse::<f64>()).collect();
        match values.as_deref() {
            Ok([x]) if range.contains(*x) => Ok([*x; 3]),
            Ok([r, g, b]) if [r, g, b].iter().all(|x| range.contains(**x)) => Ok([*r, *g, *b]),
            _ => Err(self.refuse(key, format!("{range}, or three of them as r/g/b"))),
        }
    }

    /// One of a few words; the first is the default.
    pub fn word(&self, key: &str, words: &[&'static str]) -> Result<&'static str, SpecError> {
        let Some(text) = self.get(key) else { return Ok(words[0]) };
        let found = words.iter().find(|w| **w == text).copied();
        found.ok_or_else(|| self.refuse(key, format!("one of: {}", words.join(", "))))
    }
}

/// `x`, or `r/g/b` where the channels differ.
pub(crate) fn triple(v: [f64; 3]) -> String {
    if v[0] == v[1] && v[1] == v[2] { v[0].to_string() } else { format!("{}/{}/{}", v[0], v[1], v[2]) }
}
