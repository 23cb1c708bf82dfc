//! Text on pictures.

use super::font;
use crate::Display;

/// Size and colour of a text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pen {
    /// Pixels per grid unit; capitals are 7 units high.
    pub scale: f32,
    /// sRGB colour.
    pub colour: [u8; 3],
    /// Thickness of the strokes in grid units.
    pub weight: f32,
}

impl Pen {
    /// A pen of `scale` pixels per grid unit.
    pub fn new(scale: f32, colour: [u8; 3]) -> Self {
        Self { scale, colour, weight: 0.85 }
    }

    /// The same pen with thicker strokes.
    pub fn bold(mut self) -> Self {
        self.weight = 1.2;
        self
    }

    /// Width of `text` in pixels.
    pub fn width(&self, text: &str) -> f32 {
        font::width(text) * self.scale
    }

    /// Height of a line with descenders, in pixels.
    pub fn line(&self) -> f32 {
        12.0 * self.scale
    }

    /// Draws `text` with the top left corner of its first capital at (x, y).
    pub fn draw(&self, page: &mut Display, x: f32, y: f32, text: &str) {
        for s in font::strokes(text) {
            let half = 0.5 * self.weight * self.scale;
            let point = |p: (f32, f32)| (x + (p.0 + 0.5) * self.scale, y + (p.1 + 0.5) * self.scale);
            capsule(page, point(s.from), point(s.to), half, self.colour);
        }
    }

    /// Draws `text` centred on x.
    pub fn centred(&self, page: &mut Display, x: f32, y: f32, text: &str) {
        self.draw(page, x - 0.5 * self.width(text), y, text);
    }
}

impl Display {
    /// Draws a line of round ends from a to b (pixels from the top left corner), covered by distance. Both mix
    /// towards one colour, so that overlapping strokes never darken each other.
    pub fn line(&mut self, a: (f32, f32), b: (f32, f32), width: f32, colour: [u8; 3]) {
        capsule(self, a, b, 0.5 * width, colour);
    }
}

fn capsule(page: &mut Display, a: (f32, f32), b: (f32, f32), half: f32, colour: [u8; 3]) {
    let reach = half + 1.0;
    let range = |p: f32, q: f32, n: usize| {
        let low = (p.min(q) - reach).floor().max(0.0) as usize;
        low..((p.max(q) + reach).ceil().max(0.0) as usize).min(n)
    };
    for y in range(a.1, b.1, page.height) {
        for x in range(a.0, b.0, page.width) {
            let (px, py) = (x as f32 + 0.5 - a.0, y as f32 + 0.5 - a.1);
            let (dx, dy) = (b.0 - a.0, b.1 - a.1);
            let l = dx * dx + dy * dy;
            let t = if l > 0.0 { ((px * dx + py * dy) / l).clamp(0.0, 1.0) } else { 0.0 };
            let distance = (px - t * dx).hypot(py - t * dy);
            page.blend(x, y, colour, half - distance + 0.5);
        }
    }
}
