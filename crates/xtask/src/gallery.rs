//! The gallery's page, from the numbers that `figures gallery` wrote beside its pictures.

use anyhow::{Context, Result, bail};
use std::fmt::Write;
use std::path::Path;
use steradian_techniques::{Card, locals, registry};

/// Folder of the pictures, below `docs`.
const FOLDER: &str = "gallery";
/// The live page in it.
const LIVE: &str = "live/index.html";
/// The file of numbers in it.
pub const NUMBERS: &str = "numbers.csv";

/// The picture of a technique.
pub fn picture_name(slug: &str) -> String {
    format!("{slug}.png")
}

/// What is at the right of a picture.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum ComparedWith {
    /// Direct evaluation of the integral.
    Reference,
    /// The path tracer.
    Paths,
    /// The same surface without the technique's data, which no reference knows.
    Plain,
}

impl ComparedWith {
    const ALL: [Self; 3] = [Self::Reference, Self::Paths, Self::Plain];

    /// Its word in the file of numbers, and how the page calls it.
    fn words(self) -> [&'static str; 2] {
        match self {
            Self::Reference => ["reference", "the reference"],
            Self::Paths => ["paths", "the path tracer"],
            Self::Plain => ["plain", "the surface without its data"],
        }
    }
}

/// What a picture shows, and how far it is from the reference.
pub struct Row {
    /// The technique.
    pub slug: String,
    /// Reflectance.
    pub brdf: String,
    /// What it is beside.
    pub beside: ComparedWith,
    /// Of radiance over the pixels that the object covers.
    pub relative_rms: f64,
    /// Mean |log2| of the same.
    pub stops: f64,
    /// Mean FLIP of the same.
    pub flip: f64,
    /// What the technique certifies, over all normals and views.
    pub certified: f64,
    /// Bytes that shading reads.
    pub bytes: usize,
}

impl Row {
    /// The first line of the file; reflectance comes last, as it has commas.
    pub const HEAD: &'static str = "slug,beside,relative_rms,stops,flip,certified,bytes,brdf\n";

    /// A line of the file.
    pub fn line(&self) -> String {
        let [beside, _] = self.beside.words();
        format!(
            "{},{beside},{:.4},{:.4},{:.4},{:.4},{},{}\n",
            self.slug, self.relative_rms, self.stops, self.flip, self.certified, self.bytes, self.brdf
        )
    }

    fn parse(line: &str) -> Option<Self> {
        let mut words = line.splitn(8, ',');
        let mut word = || words.next();
        let (slug, name) = (word()?.to_string(), word()?);
        let beside = ComparedWith::ALL.into_iter().find(|b| b.words()[0] == name)?;
        let mut number = || word()?.parse::<f64>().ok();
        let [relative_rms, stops, flip, certified, bytes] =
            [number()?, number()?, number()?, number()?, number()?];
        let brdf = words.next()?.to_string();
        Some(Self { slug, brdf, beside, relative_rms, stops, flip, certified, bytes: bytes as usize })
    }
}

/// What a file of numbers says.
pub fn rows(path: &Path) -> Result<Vec<Row>> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(text.lines().filter_map(Row::parse).collect())
}

/// `docs/gallery.md`. Fails where a technique has no picture.
pub fn page(root: &Path) -> Result<String> {
    let folder = root.join("docs").join(FOLDER);
    let rows = rows(&folder.join(NUMBERS))?;
    let mut out = String::from(
        "# Gallery\n\nEvery technique at the left, the reference at the right, of the same knot; that of techniques which know the mesh is the path tracer with shadows and one reflection, whose noise of 5 % is taken off. Techniques with data per texel stand beside the same surface without them. The errors are those of these pictures, over the pixels that the object covers; certified is what the technique itself states, over all normals and views.\n\n    cargo run --release -p steradian-xtask -- figures gallery -o docs/gallery\n    cargo run -p steradian-xtask -- pages\n\ndraw the pictures that are missing and write this page. The same to turn with the mouse, in a browser: [gallery/live/index.html](gallery/live/index.html), which opens from the folder and from any static server ([web pages](web.md)). It is what this command wrote:\n\n    cargo run --release --features web -- export-web knot -e studio -b ggx:alpha=0.25,f0=1/0.77/0.34 -t split-sum -t shrm --reference --size 480x300 -o docs/gallery/live\n",
    );
    if !folder.join(LIVE).exists() {
        bail!("docs/{FOLDER} lacks {LIVE}: run the command of docs/gallery.md");
    }
    let of = |card: &Card| rows.iter().find(|r| r.slug == card.slug);
    for (title, light, cards) in [
        ("Environments", "Light: `studio`.", registry().iter().map(|t| t.card()).collect::<Vec<_>>()),
        (
            "Directional and point lights",
            "Light: three directional lights, nothing else.",
            locals().iter().map(|t| t.card()).collect(),
        ),
    ] {
        // Writes to a `String` cannot fail, hence the ignored results.
        let _ = write!(out, "\n## {title}\n\n{light}\n");
        for card in cards {
            let Some(r) = of(card).filter(|_| folder.join(picture_name(card.slug)).exists()) else {
                bail!("docs/{FOLDER} lacks {}: run `figures gallery -o docs/{FOLDER}`", card.slug);
            };
            let (slug, [_, beside]) = (card.slug, r.beside.words());
            let errors = match r.beside {
                ComparedWith::Plain => "its data are those of the conformance suite, and its chapter says against what it was measured".into(),
                _ => format!(
                    "relative RMS error {:.1} %, {:.3} stops, FLIP {:.3}; certified {:.1} %",
                    100.0 * r.relative_rms,
                    r.stops,
                    r.flip,
                    100.0 * r.certified
                ),
            };
            let _ = write!(
                out,
                "\n### {}\n\n![{slug} at the left, {beside} at the right]({FOLDER}/{})\n\n[`{slug}`](../crates/techniques/src/rooms/{slug}/README.md), {}. `{}`: {errors}; {}.\n",
                card.title,
                picture_name(slug),
                card.citation,
                r.brdf,
                steradian_session::size_in_words(r.bytes as u64),
            );
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_as_they_were_written() {
        let row = Row {
            slug: "shrm".into(),
            brdf: "ggx:alpha=0.25,f0=1/0.77/0.34".into(),
            beside: ComparedWith::Paths,
            relative_rms: 0.0123,
            stops: 0.01,
            flip: 0.002,
            certified: 0.05,
            bytes: 123_456,
        };
        let read = Row::parse(row.line().trim_end()).expect("a line");
        assert_eq!(read.line(), row.line());
        assert!(Row::parse(Row::HEAD.trim_end()).is_none());
    }
}
