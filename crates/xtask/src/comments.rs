//! Comments stay within the width that rustfmt gives code.

use anyhow::{Context, Result, ensure};
use std::path::Path;

/// `max_width` of `rustfmt.toml`.
const WIDTH: usize = 110;

/// Fails where a line of a comment is wider than code may be, and names the first such lines.
pub fn check(root: &Path) -> Result<()> {
    let mut wide = Vec::new();
    for folder in ["crates", "fuzz"] {
        look(root, Path::new(folder), &mut wide)?;
    }
    let (count, first) = (wide.len(), wide[..wide.len().min(5)].join(", "));
    ensure!(wide.is_empty(), "{count} lines of comments are wider than {WIDTH} characters: {first}");
    Ok(())
}

fn look(root: &Path, folder: &Path, wide: &mut Vec<String>) -> Result<()> {
    for entry in std::fs::read_dir(root.join(folder)).with_context(|| format!("{}", folder.display()))? {
        let path = folder.join(entry?.file_name());
        let whole = root.join(&path);
        if whole.is_dir() && !path.ends_with("target") {
            look(root, &path, wide)?;
        } else if path.extension().is_some_and(|e| e == "rs") {
            let text = std::fs::read_to_string(&whole)?;
            wide.extend(too_wide(&text).map(|line| format!("{}:{line}", path.display())));
        }
    }
    Ok(())
}

/// Numbers of lines that could be broken and are too wide. Tables, formulas, what is laid out as code, and
/// lines of strings that hold other languages' comments stay as they are.
fn too_wide(text: &str) -> impl Iterator<Item = usize> {
    let mut fenced = false;
    let broken = move |line: &str| {
        let Some(comment) = line.trim_start().strip_prefix("//") else {
            fenced = false;
            return false;
        };
        let comment = comment.trim_start_matches(['/', '!']);
        fenced ^= comment.trim_start().starts_with("```");
        let laid_out = [" |", " >", "     "].iter().any(|s| comment.starts_with(s));
        let string = line.ends_with("\\n\\") || line.ends_with("\\n\",");
        !fenced && !laid_out && !string && line.chars().count() > WIDTH
    };
    text.lines().map(broken).enumerate().filter(|(_, wide)| *wide).map(|(k, _)| k + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_comments_are_found_and_what_is_laid_out_is_not() {
        let long = "word ".repeat(30);
        let found = |text: &str| too_wide(text).collect::<Vec<_>>();
        assert_eq!(found(&format!("/// {long}\nfn f() {{}} // {long}\n    // {long}")), [1, 3]);
        assert_eq!(found(&format!("//! | {long} |\n///     {long}\n/// > {long}")), [0; 0]);
        assert_eq!(found(&format!("/// ```text\n/// {long}\n/// ```\n/// {long}")), [4]);
    }
}
