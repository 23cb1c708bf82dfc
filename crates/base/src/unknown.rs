//! What was written and is not known, with the nearest of what is.

/// Names that a message lists.
const MOST_NAMES: usize = 64;

/// Characters of a name that are compared.
const LONGEST: usize = 64;

/// "unknown KIND 'x' (did you mean 'y'?); there are: …".
pub fn unknown(kind: &str, word: &str, known: &[&str]) -> String {
    let hint = nearest(word, known).map(|k| format!(" (did you mean '{k}'?)")).unwrap_or_default();
    let more = if known.len() > MOST_NAMES { ", …" } else { "" };
    let known = &known[..known.len().min(MOST_NAMES)];
    format!("unknown {kind} '{}'{hint}; there are: {}{more}", crate::brief(word), known.join(", "))
}

/// The name nearest to `word` by edit distance, if it is near enough to be a slip.
pub fn nearest<'a>(word: &str, names: &[&'a str]) -> Option<&'a str> {
    let best = names.iter().map(|n| (distance(word, n), *n)).min()?;
    (best.0 <= 1 + word.chars().take(LONGEST).count() / 3).then_some(best.1)
}

/// The `count` names that are nearest to `word`, those first that contain it.
pub fn nearest_few<'a>(word: &str, names: &[&'a str], count: usize) -> Vec<&'a str> {
    let word = word.to_lowercase().replace('_', "-");
    let apart = |name: &str| word.is_empty() || !name.to_lowercase().replace('_', "-").contains(&word);
    let mut all: Vec<&str> = names.to_vec();
    all.sort_by_cached_key(|name| (apart(name), distance(&word, name)));
    all.truncate(count);
    all
}

/// Levenshtein's edit distance, where `-` and `_` are the same.
fn distance(a: &str, b: &str) -> usize {
    let fold = |s: &str| -> Vec<char> { s.to_lowercase().replace('-', "_").chars().take(LONGEST).collect() };
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_recognised() {
        assert_eq!(nearest("lamberd", &["lambert", "ggx"]), Some("lambert"));
        assert_eq!(nearest("gx", &["lambert", "ggx"]), Some("ggx"));
        assert_eq!(nearest("quartz", &["lambert", "ggx"]), None);
        assert_eq!(nearest(&"x".repeat(1000), &["lambert", "ggx"]), None);
        assert_eq!(distance("kitten", "sitting"), 3);
        let some = nearest_few("gold", &["cold", "old-gold", "quartz", "gold-leaf"], 3);
        assert_eq!(some, ["old-gold", "gold-leaf", "cold"]);
    }
}
