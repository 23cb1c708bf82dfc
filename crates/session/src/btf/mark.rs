//! The record of a capture, in the folder of its pictures: that they are computed, from which random numbers,
//! and of how many views and lights.

use super::capture::{MOST_DIRECTIONS, RECORD, RECORD_BYTES};
use crate::Session;
use serde_json::{Value, json};
use std::path::Path;
use steradian_formats::{BtfList, read_text};

/// Where pictures come from, and whatever is made of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// `synthetic` where they were computed.
    pub source: String,
    /// Seed of the random numbers that computed them.
    pub seed: Option<u64>,
    /// Mean over the pictures of the variance of their numbers, white being 1.
    pub variance: Option<f64>,
}

impl Source {
    /// What the list says itself, or else the record of the capture in its folder.
    pub(super) fn of_list(list: &BtfList, path: &Path) -> Option<Self> {
        let Some(source) = list.source.clone() else { return Self::beside(path) };
        let variances: Option<Vec<f64>> = list.pictures.iter().map(|p| p.variance).collect();
        let variance = variances.and_then(|v| mean(&v));
        Some(Self { source, seed: list.seed, variance })
    }

    /// What the record of the capture says in the folder of `path`; `None` where there is none. Neither
    /// `.lp` nor `.ptm` has a place for it in the file.
    pub(crate) fn beside(path: &Path) -> Option<Self> {
        let record = record(path)?;
        let capture = record.get("capture")?;
        let done = record.get("done").and_then(Value::as_object);
        let variances = done.into_iter().flat_map(|d| d.values()).filter_map(Value::as_array).flatten();
        let variances: Vec<f64> = variances.filter_map(Value::as_f64).collect();
        Some(Self {
            source: capture.get("source")?.as_str()?.into(),
            seed: capture.get("seed").and_then(Value::as_u64),
            variance: mean(&variances),
        })
    }

    /// For the metadata of files, under the names that pictures of a capture have.
    fn pairs(&self) -> Vec<(String, String)> {
        let pair = |key: &str, value: String| (format!("steradian.{key}"), value);
        let mut all = vec![pair("source", self.source.clone())];
        all.extend(self.seed.map(|s| pair("seed", s.to_string())));
        all.extend(self.variance.map(|v| pair("variance", v.to_string())));
        all
    }

    /// Lines of a report.
    pub(crate) fn lines(of: Option<&Self>) -> Vec<(&'static str, String)> {
        let Some(s) = of else { return Vec::new() };
        let mut lines = vec![("source", s.source.clone())];
        lines.extend(s.seed.map(|s| ("seed", s.to_string())));
        let variance = |v: f64| format!("{v:.3e}, the mean over all numbers, white being 1");
        lines.extend(s.variance.map(|v| ("variance", variance(v))));
        lines
    }

    /// The same for a document: null where nothing is said.
    pub(crate) fn document(of: Option<&Self>) -> [(&'static str, Value); 3] {
        let seed = of.and_then(|s| s.seed);
        let variance = of.and_then(|s| s.variance);
        [("source", json!(of.map(|s| &s.source))), ("seed", json!(seed)), ("variance", json!(variance))]
    }
}

fn mean(all: &[f64]) -> Option<f64> {
    (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
}

fn record(path: &Path) -> Option<Value> {
    let record = path.parent().unwrap_or(Path::new("")).join(RECORD);
    serde_json::from_str(&read_text(&record, RECORD_BYTES, "the record of a capture").ok()?).ok()
}

/// Numbers of views and lights of the capture whose record lies in the list's folder.
pub(super) fn captured(path: &Path) -> Option<[usize; 2]> {
    let record = record(path)?;
    let count = |what: &str| {
        let count = usize::try_from(record.get("capture")?.get(what)?.as_u64()?).ok();
        count.filter(|n| (1..=MOST_DIRECTIONS).contains(n))
    };
    Some([count("views")?, count("lights")?])
}

impl Session {
    /// Notes for the files written from now on what is known of the source of an input.
    pub(crate) fn note_source(&mut self, source: Option<&Source>) {
        for pair in source.into_iter().flat_map(Source::pairs) {
            if !self.provenance_pairs().contains(&pair) {
                self.note(pair);
            }
        }
    }
}
