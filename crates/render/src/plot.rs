//! Line drawings, drawn alike as pictures and as SVG.

use crate::Display;
use crate::sheet::Pen;
use std::fmt::Write;

/// Alignment of a text relative to its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// To its right.
    Start,
    /// Around it.
    Middle,
    /// To its left.
    End,
}

/// A part of a drawing; pixels from the top left corner, sRGB colours.
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    /// A line through points, with round ends.
    Line {
        /// The points.
        points: Vec<(f64, f64)>,
        /// Its colour.
        colour: [u8; 3],
        /// Its width.
        width: f64,
    },
    /// A disc.
    Dot {
        /// Its centre.
        at: (f64, f64),
        /// Its colour.
        colour: [u8; 3],
        /// Its radius.
        radius: f64,
    },
    /// A text; its capitals begin at the height of the point.
    Text {
        /// The point.
        at: (f64, f64),
        /// Text.
        text: String,
        /// Pixels per em.
        size: f64,
        /// Its colour.
        colour: [u8; 3],
        /// Alignment relative to the point.
        anchor: Anchor,
    },
}

/// Marks on white paper, the first one lowest.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Marks, in drawing order.
    pub marks: Vec<Mark>,
}

/// Height of capitals, em.
const CAPITALS: f64 = 0.727;

fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

impl Drawing {
    /// An empty page.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, marks: Vec::new() }
    }

    /// As a picture.
    pub fn display(&self) -> Display {
        let mut page = Display::filled(self.width, self.height, [255; 3]);
        for mark in &self.marks {
            match mark {
                Mark::Line { points, colour, width } => {
                    let p = |p: (f64, f64)| (p.0 as f32, p.1 as f32);
                    for w in points.windows(2) {
                        page.line(p(w[0]), p(w[1]), *width as f32, *colour);
                    }
                }
                Mark::Dot { at, colour, radius } => {
                    let p = (at.0 as f32, at.1 as f32);
                    page.line(p, p, 2.0 * *radius as f32, *colour);
                }
                Mark::Text { at, text, size, colour, anchor } => {
                    let pen = Pen::new(*size as f32, *colour);
                    let before = match anchor {
                        Anchor::Start => 0.0,
                        Anchor::Middle => 0.5,
                        Anchor::End => 1.0,
                    };
                    pen.draw(&mut page, at.0 as f32 - before * pen.width(text), at.1 as f32, text);
                }
            }
        }
        page
    }

    /// As SVG 1.1.
    pub fn svg(&self) -> String {
        let (w, h) = (self.width, self.height);
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
             font-family=\"Inter, sans-serif\">\n<rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n"
        );
        for mark in &self.marks {
            // Writing to a string does not fail.
            let _ = match mark {
                Mark::Line { points, colour, width } => {
                    let points: Vec<String> = points.iter().map(|(x, y)| format!("{x:.2},{y:.2}")).collect();
                    writeln!(
                        out,
                        "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" \
                         stroke-linecap=\"round\" stroke-linejoin=\"round\"/>",
                        points.join(" "),
                        hex(*colour)
                    )
                }
                Mark::Dot { at: (x, y), colour, radius } => writeln!(
                    out,
                    "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius}\" fill=\"{}\"/>",
                    hex(*colour)
                ),
                Mark::Text { at: (x, y), text, size, colour, anchor } => {
                    let anchor = match anchor {
                        Anchor::Start => "start",
                        Anchor::Middle => "middle",
                        Anchor::End => "end",
                    };
                    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
                    writeln!(
                        out,
                        "<text x=\"{x:.2}\" y=\"{:.2}\" font-size=\"{size}\" fill=\"{}\" \
                         text-anchor=\"{anchor}\">{text}</text>",
                        y + CAPITALS * size,
                        hex(*colour)
                    )
                }
            };
        }
        out.push_str("</svg>\n");
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both forms have every mark at the same place.
    #[test]
    fn pictures_and_svg_show_the_same() {
        let colour = [200, 30, 40];
        let drawing = Drawing {
            marks: vec![
                Mark::Line { points: vec![(10.0, 10.0), (50.0, 10.0)], colour, width: 3.0 },
                Mark::Dot { at: (70.0, 30.0), colour, radius: 5.0 },
                Mark::Text { at: (90.0, 50.0), text: "A<&>".into(), size: 12.0, colour, anchor: Anchor::End },
            ],
            ..Drawing::new(100, 70)
        };
        let page = drawing.display();
        let red = |x: usize, y: usize| page.rgb[3 * (y * 100 + x)..3 * (y * 100 + x) + 3] == colour;
        assert!(red(30, 10) && red(70, 30) && !red(30, 20));
        let text = (50..62).any(|y| (50..90).any(|x| page.rgb[3 * (y * 100 + x) + 1] < 128));
        assert!(
            text && !(50..62).any(|y| page.rgb[3 * (y * 100 + 95) + 1] < 128),
            "the text ends at its point"
        );
        let svg = drawing.svg();
        for part in ["10.00,10.00 50.00,10.00", "cx=\"70.00\" cy=\"30.00\"", "A&lt;&amp;&gt;", "#c81e28"] {
            assert!(svg.contains(part), "{part}: {svg}");
        }
    }
}
