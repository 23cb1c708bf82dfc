//! Names of WGSL text.

use std::collections::HashSet;

/// `text` with `prefix` before every name that it declares at module scope, wherever it is used, so that two
/// texts with different prefixes can share a module. The prefix takes the case of the name: `eval`, `Lobe`
/// and `TINY` become `a_eval`, `ALobe` and `A_TINY` under `a`. Names declared elsewhere and members of
/// structures stay as they are.
pub fn scoped(prefix: &str, text: &str) -> String {
    let words = words(text);
    let declared = declared(&words);
    let (mut last, mut structure) = ("", false);
    let mut out = String::with_capacity(text.len() + text.len() / 8);
    for (k, word) in words.iter().enumerate() {
        let names_member = || words[k + 1..].iter().find(|w| is_code(w)) == Some(&":");
        if declared.contains(word) && last != "." && !(structure && names_member()) {
            out += &with_prefix(prefix, word);
        } else {
            out += word;
        }
        if is_code(word) {
            structure = *word == "struct" || (structure && *word != "}");
            last = word;
        }
    }
    out
}

/// Is it neither a comment nor space?
fn is_code(word: &str) -> bool {
    !word.starts_with("//") && !word.trim().is_empty()
}

/// Identifiers and numbers, comments and spaces as wholes, and single characters of all else.
fn words(text: &str) -> Vec<&str> {
    let named = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut out = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let end = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if named(first) {
            rest.find(|c| !named(c)).unwrap_or(rest.len())
        } else if first.is_whitespace() {
            rest.find(|c: char| !c.is_whitespace()).unwrap_or(rest.len())
        } else {
            first.len_utf8()
        };
        let (word, after) = rest.split_at(end);
        out.push(word);
        rest = after;
    }
    out
}

/// The names that follow `fn`, `struct`, `const`, `alias`, `override` or `var<…>` outside all braces.
fn declared<'a>(words: &[&'a str]) -> HashSet<&'a str> {
    let mut out = HashSet::new();
    let (mut depth, mut angles, mut declares) = (0u32, 0u32, false);
    for word in words.iter().filter(|w| is_code(w)) {
        match *word {
            "{" => depth += 1,
            "}" => depth = depth.saturating_sub(1),
            "fn" | "struct" | "const" | "alias" | "override" | "var" if depth == 0 => declares = true,
            "<" if declares => angles += 1,
            ">" if declares => angles = angles.saturating_sub(1),
            name if declares && angles == 0 => {
                out.insert(name);
                declares = false;
            }
            _ => {}
        }
    }
    out
}

fn with_prefix(prefix: &str, name: &str) -> String {
    if !name.starts_with(|c: char| c.is_ascii_uppercase()) {
        return format!("{prefix}_{name}");
    }
    if !name.contains(|c: char| c.is_ascii_lowercase()) {
        return format!("{}_{name}", prefix.to_ascii_uppercase());
    }
    let (first, rest) = prefix.split_at(prefix.len().min(1));
    format!("{}{rest}{name}", first.to_ascii_uppercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn declared_names_get_the_prefix_and_others_stay() {
        let text = "// eval is told of\nstruct Lobe {\n    eval: f32,\n}\nconst TINY: f32 = 1e-9;\n\
                    var<private> lobe: Lobe = Lobe(TINY);\nalias Many = array<Lobe, 4>;\n\
                    fn eval(x: f32) -> f32 {\n    return max(cell(lobe.eval), TINY) + evaluate(eval(x));\n}\n";
        let want = "// eval is told of\nstruct ALobe {\n    eval: f32,\n}\nconst A_TINY: f32 = 1e-9;\n\
                    var<private> a_lobe: ALobe = ALobe(A_TINY);\nalias AMany = array<ALobe, 4>;\n\
                    fn a_eval(x: f32) -> f32 {\n    return max(cell(a_lobe.eval), A_TINY) + evaluate(a_eval(x));\n}\n";
        assert_eq!(scoped("a", text), want);
    }
}
