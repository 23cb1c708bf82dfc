//! Faults of the command line in one line, as every other error of the command.

use clap::{Command, Error};
use std::ffi::OsString;

/// What the parser found, in one line: the fault, the values that are possible, a similar one, and where the
/// options are described.
pub fn line(e: &Error, command: &Command) -> String {
    line_of(&e.to_string(), command, std::env::args_os().skip(1))
}

fn line_of(said: &str, command: &Command, arguments: impl Iterator<Item = OsString>) -> String {
    let mut out = String::new();
    for text in said.lines().map(str::trim).filter(|l| !l.is_empty()) {
        if text.starts_with("Usage:") || text.starts_with("For more information") {
            break;
        }
        let text = text.strip_prefix("error: ").unwrap_or(text);
        let text = text.strip_prefix("tip: ").unwrap_or(text);
        let joint = match out.chars().last() {
            None => "",
            Some(':') => " ",
            _ if text.starts_with('[') => " ",
            // Of a list of arguments.
            _ if text.starts_with(['-', '<']) => ", ",
            _ => "; ",
        };
        out.push_str(joint);
        out.push_str(text);
    }
    if out.contains("not provided") && out.contains("--technique <SLUG>") {
        out.push_str("; `steradian techniques` lists the techniques");
    }
    let known = |word: &OsString| command.find_subcommand(word).map(Command::get_name);
    let below = arguments.take_while(|a| a != "--").find_map(|a| known(&a));
    let name = below.map_or(String::new(), |n| format!("{n} "));
    format!("{out}; see `steradian {name}--help`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_is_one_line_that_says_what_to_do() {
        for (arguments, parts) in [
            (
                "render sphere -o x.png --size 1000000x1000000",
                &[
                    "invalid value '1000000x1000000' for '--size <WxH>'",
                    "WIDTHxHEIGHT",
                    "`steradian render --help`",
                ][..],
            ),
            (
                "prefilter sky -o x.ktx2 --kernel gxx",
                &["'gxx'", "did you mean 'ggx'?", "`steradian prefilter --help`"],
            ),
            (
                "bake sky -b lambert -o x.safetensors",
                &[
                    "not provided: --technique <SLUG>; `steradian techniques` lists",
                    "`steradian bake --help`",
                ],
            ),
            ("bake", &["not provided: --brdf <SPEC>, --output <FILE|DIR>, "]),
            ("eval --lookup linear", &["[possible values: constant, bilinear]"]),
            ("render sphere -o x.png --technik shrm", &["unexpected argument '--technik'", "'--technique'"]),
            ("rendr sphere", &["unrecognized subcommand 'rendr'", "'render'", "`steradian --help`"]),
            ("render", &["not provided: --output <OUT>, <SCENE|MESH|SHAPE>"]),
        ] {
            let words: Vec<&str> = arguments.split(' ').collect();
            let e = crate::command()
                .try_get_matches_from([&["steradian"], &words[..]].concat())
                .expect_err(arguments);
            let line = line_of(&e.to_string(), &crate::command(), words.iter().map(OsString::from));
            assert!(!line.contains('\n') && !line.contains("error:") && !line.contains("  "), "{line}");
            parts.iter().for_each(|part| assert!(line.contains(part), "{arguments}: {line}"));
        }
    }
}
