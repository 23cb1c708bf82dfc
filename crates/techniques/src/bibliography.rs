//! The works that techniques come from, read out of the citations on their cards.

use crate::{Card, locals, registry};

/// The Cards of all techniques: those for environments, then the local ones, in the order of menus.
pub fn cards() -> impl Iterator<Item = &'static Card> {
    registry().iter().map(|t| t.card()).chain(locals().iter().map(|t| t.card()))
}

/// A work that techniques come from.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Work {
    authors: Vec<String>,
    year: String,
    title: String,
    techniques: Vec<&'static str>,
}

/// Short names of works that citations use.
const SHORT: [(&str, &str); 5] = [
    ("RH02 ", "Ramamoorthi & Hanrahan 2002, Frequency Space Environment Map Rendering"),
    (
        "GKD07 ",
        "Green, Kautz & Durand 2007, Efficient Reflectance and Visibility Approximations for Environment Map Rendering",
    ),
    (
        "KSS02 ",
        "Kautz, Sloan & Snyder 2002, Fast, Arbitrary BRDF Shading for Low-Frequency Lighting Using Spherical Harmonics",
    ),
    ("STAR04 ", "Kautz 2004, Hardware Lighting and Shading: a Survey"),
    (
        "SKS02 ",
        "Sloan, Kautz & Snyder 2002, Precomputed Radiance Transfer for Real-Time Rendering in Dynamic, Low-Frequency Lighting Environments",
    ),
];

/// A part of a citation: `Authors YEAR, Title, eqs …`, or a short name and a place in
/// it; `None` for what names no title.
fn work(part: &str) -> Option<Work> {
    let part = part.trim();
    let part = part.strip_prefix("after ").unwrap_or(part);
    let part = SHORT.iter().find(|(name, _)| part.starts_with(name)).map_or(part, |(_, whole)| whole);
    let is_year = |w: &str| w.len() == 5 && w.ends_with(',') && w[..4].bytes().all(|b| b.is_ascii_digit());
    let at = part.split(' ').position(is_year)?;
    let words: Vec<&str> = part.split(' ').collect();
    let names = words[..at].join(" ").replace(" & ", ", ");
    let title = words[at + 1..].join(" ");
    let title = title.split(", eq").next().unwrap_or_default().to_string();
    let authors: Vec<String> = names.split(", ").map(String::from).collect();
    let named = !title.is_empty() && authors.iter().all(|a| !a.is_empty());
    let year = words[at].trim_end_matches(',').into();
    named.then_some(Work { authors, year, title, techniques: Vec::new() })
}

/// Reduces a text to ASCII letters and digits; other letters become their base letter, as far as authors'
/// names here need it.
fn plain(text: &str) -> String {
    let near = |c: char| match c {
        'á' | 'à' | 'ä' => 'a',
        'é' | 'è' => 'e',
        'ó' | 'ö' => 'o',
        'ú' | 'ü' => 'u',
        c => c,
    };
    text.to_lowercase().chars().map(near).filter(char::is_ascii_alphanumeric).collect()
}

impl Work {
    fn key(&self) -> String {
        let skip = ["a", "an", "the", "of", "on"];
        let word = self.title.split([' ', '-']).find(|w| !skip.contains(&w.to_lowercase().as_str()));
        let family = self.authors[0].split(' ').next_back().unwrap_or_default();
        format!("{}{}{}", plain(family), self.year, plain(word.unwrap_or_default()))
    }

    fn entry(&self) -> String {
        let techniques: Vec<String> = self.techniques.iter().map(|t| t.replace('_', "\\_")).collect();
        format!(
            "@misc{{{},\n  author = {{{}}},\n  title = {{{{{}}}}},\n  year = {{{}}},\n  note = {{Steradian: {}}}\n}}\n",
            self.key(),
            self.authors.join(" and "),
            self.title.replace('&', "\\&"),
            self.year,
            techniques.join(", ")
        )
    }
}

/// Every work once.
fn works() -> Vec<Work> {
    let mut out: Vec<Work> = Vec::new();
    for c in cards() {
        for found in c.citation.split(';').filter_map(work) {
            match out.iter_mut().find(|w| w.key() == found.key()) {
                Some(w) => w.techniques.push(c.slug),
                None => out.push(Work { techniques: vec![c.slug], ..found }),
            }
        }
    }
    out.sort_by_key(Work::key);
    out
}

/// The works that the techniques come from as BibTeX, with the techniques in their notes, and Steradian
/// itself.
pub fn bibtex() -> String {
    let version = env!("CARGO_PKG_VERSION");
    let own = format!(
        "@software{{steradian,\n  author = {{{{The Steradian authors}}}},\n  title = {{{{Steradian: environment-map \
         lighting of any reflectance}}}},\n  version = {{{version}}}\n}}\n"
    );
    works().iter().fold(own, |all, w| all + "\n" + &w.entry())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn citations_become_works() {
        let w = work(
            "after Ramamoorthi & Hanrahan 2002, Frequency Space Environment Map Rendering, eqs 5.9 and 5.22",
        );
        let w = w.expect("a work");
        assert_eq!(w.authors, ["Ramamoorthi", "Hanrahan"]);
        assert_eq!(
            (w.title.as_str(), w.key().as_str()),
            ("Frequency Space Environment Map Rendering", "ramamoorthi2002frequency")
        );
        let w = work("Heidrich & Seidel 1999, Realistic, Hardware-Accelerated Shading and Lighting")
            .expect("a work");
        assert_eq!(w.title, "Realistic, Hardware-Accelerated Shading and Lighting");
        let w = work("Kautz, Vázquez, Heidrich & Seidel 2000, A Unified Approach").expect("a work");
        assert_eq!((w.authors.len(), w.key().as_str()), (4, "kautz2000unified"));
        assert_eq!(work(" STAR04 7.3.1, eqs 14–18").map(|w| w.key()).as_deref(), Some("kautz2004hardware"));
        assert_eq!([work("eqs 4 and 6"), work("")], [None, None]);
    }

    /// Every technique names a work, keys are unlike, and braces match.
    #[test]
    fn the_bibliography_is_whole() {
        let all = works();
        for c in cards() {
            assert!(all.iter().any(|w| w.techniques.contains(&c.slug)), "{}: {}", c.slug, c.citation);
        }
        let mut keys: Vec<String> = all.iter().map(Work::key).collect();
        let n = keys.len();
        keys.dedup();
        assert!(n > 10 && keys.len() == n, "{keys:?}");
        let text = bibtex();
        assert_eq!(text.matches('{').count(), text.matches('}').count());
        assert_eq!(text.matches("\n@").count(), n);
    }
}
