//! Files that the command line names as inputs, so that no output takes the place of one.

use clap::ArgMatches;
use std::path::{Path, PathBuf};

/// Options whose values are outputs, by their fields' names.
const OUTPUTS: [&str; 12] = [
    "output",
    "variance",
    "plot",
    "slice",
    "html",
    "table",
    "resume",
    "extract_sun",
    "dump_levels",
    "wgsl",
    "report",
    "screenshot",
];

/// Separators of specs, such as `npf:FILE,MATERIAL`, `front,back` and `room.safetensors#3`.
const SEPARATORS: [char; 4] = [':', ',', '=', '#'];

/// Separators of one value that are looked at: names with more are no specs.
const MOST: usize = 24;

/// The files that the values of all other options and arguments name, alone or within a spec.
pub fn of(matches: &ArgMatches) -> Vec<PathBuf> {
    let mut out = Vec::new();
    for id in matches.ids().map(clap::Id::as_str).filter(|id| !OUTPUTS.contains(id)) {
        // Groups have no values of their own.
        let Ok(Some(values)) = matches.try_get_raw(id) else { continue };
        values.for_each(|value| named(&value.to_string_lossy(), &mut out));
    }
    if let Some((_, below)) = matches.subcommand() {
        out.extend(of(below));
    }
    out
}

/// The files that a value names.
fn named(value: &str, out: &mut Vec<PathBuf>) {
    let cuts: Vec<usize> =
        value.char_indices().filter(|(_, c)| SEPARATORS.contains(c)).map(|(i, _)| i).collect();
    let cuts = &cuts[..cuts.len().min(MOST)];
    let starts = std::iter::once(0).chain(cuts.iter().map(|i| i + 1));
    for start in starts {
        let ends = cuts.iter().copied().filter(|end| *end > start).chain([value.len()]);
        out.extend(ends.map(|end| Path::new(&value[start..end])).filter(|p| p.is_file()).map(PathBuf::from));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_within_specs() {
        let d = tempfile::tempdir().expect("a folder");
        let [a, b] = ["a.bin", "b,c=1.hdr"].map(|n| d.path().join(n));
        [&a, &b].iter().for_each(|f| std::fs::write(f, "").expect("written"));
        let (a, b) = (a.display().to_string(), b.display().to_string());
        for (value, files) in [
            (a.clone(), vec![&a]),
            (format!("npf:{a},@chrome"), vec![&a]),
            (format!("{a},{b}"), vec![&a, &b]),
            (format!("{a}#3"), vec![&a]),
            ("ggx:alpha=0.2".into(), vec![]),
        ] {
            let mut found = Vec::new();
            named(&value, &mut found);
            assert_eq!(found, files.into_iter().map(PathBuf::from).collect::<Vec<_>>(), "{value}");
        }
    }

    /// Values of options that are called OUT are outputs.
    #[test]
    fn outputs_are_known() {
        let command = crate::command();
        for argument in command.get_subcommands().flat_map(clap::Command::get_arguments) {
            let names = argument.get_value_names().unwrap_or_default();
            if names.iter().any(|n| n.starts_with("OUT")) {
                assert!(OUTPUTS.contains(&argument.get_id().as_str()), "{}", argument.get_id());
            }
        }
    }
}
