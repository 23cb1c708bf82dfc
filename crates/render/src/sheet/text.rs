//! Text on pictures, set in Inter (fonts/OFL.txt).

use crate::Display;
use fontdue::{Font, FontSettings};
use std::sync::OnceLock;

/// Size, colour and weight of a text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pen {
    /// Pixels per em; capitals are 0.73 em high.
    pub size: f32,
    /// sRGB colour.
    pub colour: [u8; 3],
    /// Semi-bold instead of regular?
    pub bold: bool,
}

/// Height of capitals, em.
const CAPITALS: f32 = 0.727;

/// Regular and semi-bold; they are part of the program, and a test reads them.
fn font(bold: bool) -> Option<&'static Font> {
    static FONTS: [OnceLock<Option<Font>>; 2] = [const { OnceLock::new() }; 2];
    let bytes: [&[u8]; 2] =
        [include_bytes!("fonts/Inter-Regular.otf"), include_bytes!("fonts/Inter-SemiBold.otf")];
    let k = usize::from(bold);
    FONTS[k].get_or_init(|| Font::from_bytes(bytes[k], FontSettings::default()).ok()).as_ref()
}

impl Pen {
    /// A regular pen of `size` pixels per em.
    pub fn new(size: f32, colour: [u8; 3]) -> Self {
        Self { size, colour, bold: false }
    }

    /// This pen, semi-bold.
    pub fn bold(mut self) -> Self {
        self.bold = true;
        self
    }

    /// Width of `text` in pixels.
    pub fn width(&self, text: &str) -> f32 {
        let Some(font) = font(self.bold) else { return 0.0 };
        text.chars().map(|c| font.metrics(c, self.size).advance_width).sum()
    }

    /// Height of a line with descenders, in pixels.
    pub fn line(&self) -> f32 {
        1.35 * self.size
    }

    /// The lines of a text that are no wider than `width`, broken between words; a longer word has a line.
    pub fn wrapped(&self, text: &str, width: f32) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for word in text.split_whitespace() {
            match lines.last_mut() {
                Some(line) if self.width(&format!("{line} {word}")) <= width => {
                    line.push(' ');
                    line.push_str(word);
                }
                _ => lines.push(word.into()),
            }
        }
        lines
    }

    /// Draws `text` with the top left corner of its first capital at (x, y).
    pub fn draw(&self, page: &mut Display, x: f32, y: f32, text: &str) {
        let Some(font) = font(self.bold) else { return };
        let base = (y + CAPITALS * self.size).round();
        let mut pen = x;
        for c in text.chars() {
            let (m, coverage) = font.rasterize(c, self.size);
            let (left, top) = (pen.round() + m.xmin as f32, base - m.ymin as f32 - m.height as f32);
            for (k, &a) in coverage.iter().enumerate() {
                let (px, py) = (left + (k % m.width) as f32, top + (k / m.width) as f32);
                if a > 0 && px >= 0.0 && py >= 0.0 {
                    page.blend(px as usize, py as usize, self.colour, f32::from(a) / 255.0);
                }
            }
            pen += m.advance_width;
        }
    }

    /// Draws `text` centred on x.
    pub fn centred(&self, page: &mut Display, x: f32, y: f32, text: &str) {
        self.draw(page, x - 0.5 * self.width(text), y, text);
    }
}

impl Display {
    /// Draws a line of round ends from a to b (pixels from the top left corner), covered by distance.
    pub fn line(&mut self, a: (f32, f32), b: (f32, f32), width: f32, colour: [u8; 3]) {
        let half = 0.5 * width;
        let reach = half + 1.0;
        let range = |p: f32, q: f32, n: usize| {
            let low = (p.min(q) - reach).floor().max(0.0) as usize;
            low..((p.max(q) + reach).ceil().max(0.0) as usize).min(n)
        };
        for y in range(a.1, b.1, self.height) {
            for x in range(a.0, b.0, self.width) {
                let (px, py) = (x as f32 + 0.5 - a.0, y as f32 + 0.5 - a.1);
                let (dx, dy) = (b.0 - a.0, b.1 - a.1);
                let l = dx * dx + dy * dy;
                let t = if l > 0.0 { ((px * dx + py * dy) / l).clamp(0.0, 1.0) } else { 0.0 };
                let distance = (px - t * dx).hypot(py - t * dy);
                self.blend(x, y, colour, half - distance + 0.5);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_weights_have_the_signs_that_captions_use() {
        for bold in [false, true] {
            let font = font(bold).expect("the fonts are part of the program");
            for c in ('!'..='~').chain("°±²³·×–—…→−≈≤≥αθπσ".chars()) {
                assert!(font.lookup_glyph_index(c) != 0, "{c}");
            }
        }
    }

    #[test]
    fn text_is_as_wide_as_it_says_and_stays_on_the_page() {
        let pen = Pen::new(20.0, [255; 3]);
        let mut page = Display::filled(120, 40, [0; 3]);
        pen.draw(&mut page, 4.0, 8.0, "Width 12");
        let lit = |x: usize| (0..40).any(|y| page.rgb[3 * (y * 120 + x)] > 64);
        let last = (0..120).rfind(|&x| lit(x)).expect("something is drawn");
        assert!((last as f32 - (4.0 + pen.width("Width 12"))).abs() < 4.0, "{last}");
        // A capital's top is where it was put.
        let row = (0..40).find(|y| (0..120).any(|x| page.rgb[3 * (y * 120 + x)] > 64));
        assert!(row.is_some_and(|y| (7..=9).contains(&y)), "{row:?}");
        pen.draw(&mut page, 110.0, 35.0, "over the edge");
    }
}
