//! What the files of a technique import of each other: never around in a circle.

use anyhow::{Context, Result, ensure};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The modules of a technique's folder, each with those that it imports.
type Imports = BTreeMap<String, BTreeSet<String>>;

/// Fails where modules of a technique import each other, directly or by way of others. Its page (`mod.rs`)
/// and its tests may import all of them.
pub fn check(root: &Path) -> Result<()> {
    let rooms = root.join("crates/techniques/src/rooms");
    for folder in std::fs::read_dir(&rooms).context("the techniques")? {
        let folder = folder?.path();
        if folder.is_dir() {
            let imports = imports(&folder)?;
            let circle = circle(&imports);
            ensure!(circle.is_empty(), "{}: import each other: {}", folder.display(), circle.join(", "));
        }
    }
    Ok(())
}

fn imports(folder: &Path) -> Result<Imports> {
    let page = std::fs::read_to_string(folder.join("mod.rs"))?;
    let mut texts = BTreeMap::new();
    for line in page.replace("#[cfg(test)]\nmod ", "").lines() {
        if let Some(name) = line.strip_prefix("mod ").and_then(|l| l.strip_suffix(';')) {
            texts.insert(name.to_string(), std::fs::read_to_string(folder.join(format!("{name}.rs")))?);
        }
    }
    let of = |text: &String| texts.keys().filter(|name| is_imported(name, text)).cloned().collect();
    Ok(texts.iter().map(|(name, text)| (name.clone(), of(text))).collect())
}

/// Does a text name `super::NAME`, or NAME among what `super::{…}` imports?
fn is_imported(name: &str, text: &str) -> bool {
    text.split("super::").skip(1).any(|rest| {
        let list = rest.strip_prefix('{').map_or(rest, |l| l.split(';').next().unwrap_or_default());
        let mut words = list.split(|c: char| !c.is_alphanumeric() && c != '_');
        if rest.starts_with('{') { words.any(|w| w == name) } else { words.next() == Some(name) }
    })
}

/// The modules that reach themselves.
fn circle(imports: &Imports) -> Vec<&str> {
    let reaches_itself = |start: &String| {
        let (mut seen, mut next) = (BTreeSet::new(), vec![start]);
        while let Some(of) = next.pop().and_then(|name| imports.get(name)) {
            next.extend(of.iter().filter(|name| seen.insert(*name)));
        }
        seen.contains(start)
    };
    imports.keys().filter(|name| reaches_itself(name)).map(String::as_str).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circles_are_found() {
        assert!(
            is_imported("bake", "use super::bake::Tables;") && is_imported("bake", "use super::{A, bake};")
        );
        assert!(!is_imported("bake", "use super::bakery::X;\nuse crate::{bake};"));
        let of = |all: &[(&str, &[&str])]| -> Imports {
            all.iter().map(|(n, to)| (n.to_string(), to.iter().map(ToString::to_string).collect())).collect()
        };
        let circle =
            of(&[("bake", &["shade"]), ("shade", &["scatter"]), ("scatter", &["bake"]), ("tables", &[])]);
        assert_eq!(super::circle(&circle), ["bake", "scatter", "shade"]);
        let line = of(&[("bake", &["shade", "tables"]), ("shade", &["tables"]), ("tables", &[])]);
        assert!(super::circle(&line).is_empty());
    }
}
