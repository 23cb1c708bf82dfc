//! The options of the command, as libraries name them and as a command line does.

use clap::Command;
use serde_json::Value;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::LazyLock;

/// Long options of the command and of all below it.
static LONG: LazyLock<BTreeSet<String>> = LazyLock::new(|| {
    fn collect(command: &Command, out: &mut BTreeSet<String>) {
        out.extend(command.get_arguments().filter_map(|a| a.get_long()).map(String::from));
        command.get_subcommands().for_each(|below| collect(below, out));
    }
    let mut out = BTreeSet::new();
    collect(&crate::command(), &mut out);
    out
});

/// A library's sentence for who typed a command: `` `size` `` becomes `--size`. Other words in back ticks
/// stay.
pub fn dashed(text: &str) -> Cow<'_, str> {
    if !text.contains('`') {
        return text.into();
    }
    let (mut out, mut rest) = (String::with_capacity(text.len()), text);
    while let Some((before, after)) = rest.split_once('`') {
        out.push_str(before);
        rest = match after.split_once('`') {
            Some((word, behind)) if LONG.contains(word) => {
                out.push_str("--");
                out.push_str(word);
                behind
            }
            _ => {
                out.push('`');
                after
            }
        };
    }
    out.push_str(rest);
    out.into()
}

/// The same of every sentence in a document.
pub fn dashed_document(value: &mut Value) {
    match value {
        Value::String(text) => {
            if let Cow::Owned(changed) = dashed(text) {
                *text = changed;
            }
        }
        Value::Array(all) => all.iter_mut().for_each(dashed_document),
        Value::Object(map) => map.values_mut().for_each(dashed_document),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn options_alone_get_dashes() {
        let same = |text| assert_eq!(dashed(text), text);
        assert_eq!(
            dashed("`size` 3x3: too small; raise `max-memory`"),
            "--size 3x3: too small; raise --max-memory"
        );
        assert_eq!(dashed("use `backend` cpu"), "use --backend cpu");
        assert_eq!(dashed("`alpha_x` of `brdf` ` and `size`"), "`alpha_x` of --brdf ` and --size");
        ["size", "`sizes` and `si ze`", "``", "`size", "a `b` c"].into_iter().for_each(same);
        let mut document =
            json!({"`size`": 1, "refused": ["leave `mesh` out", 2, null], "why": {"x": "`y`"}});
        dashed_document(&mut document);
        let expected = json!({"`size`": 1, "refused": ["leave --mesh out", 2, null], "why": {"x": "`y`"}});
        assert_eq!(document, expected);
    }
}
