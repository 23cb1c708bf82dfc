//! What others wrote, for one line that quotes it.

use std::borrow::Cow;

/// Characters that a message quotes at most.
const LONGEST: usize = 80;

/// A text as messages quote it: whole, unless it is longer than a line has room for; then its beginning and
/// how long it is.
pub fn brief(text: &str) -> Cow<'_, str> {
    match text.char_indices().nth(LONGEST) {
        None => Cow::Borrowed(text),
        Some((end, _)) => Cow::Owned(format!("{}… ({} bytes)", &text[..end], text.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_texts_are_cut() {
        assert_eq!(brief("ggx:alpha=0.3"), "ggx:alpha=0.3");
        let whole = "é".repeat(LONGEST);
        assert_eq!(brief(&whole), whole);
        let long = "é".repeat(50_000);
        assert_eq!(brief(&long), format!("{whole}… (100000 bytes)"));
    }
}
