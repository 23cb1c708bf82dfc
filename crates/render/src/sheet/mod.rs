//! Contact sheets: a grid of pictures with labels.

mod text;

pub use text::Pen;

use crate::Display;

/// One picture and the lines below it.
#[derive(Debug, Clone, Default)]
pub struct Cell {
    /// The picture.
    pub picture: Display,
    /// The lines below; the first is bright where there are several.
    pub caption: Vec<String>,
}

/// One row: a label and its cells, `None` where nothing belongs.
#[derive(Debug, Clone, Default)]
pub struct Row {
    /// Lines of text next to the row; the first is bright.
    pub label: Vec<String>,
    /// One per column.
    pub cells: Vec<Option<Cell>>,
}

/// A grid of pictures.
#[derive(Debug, Clone, Default)]
pub struct Sheet {
    /// The heading; empty for none.
    pub title: String,
    /// The line below the heading; empty for none.
    pub subtitle: String,
    /// Labels above the columns.
    pub columns: Vec<String>,
    /// The rows.
    pub rows: Vec<Row>,
    /// Pixels per em of the text. 0 takes 15.
    pub text_size: f32,
}

const PAPER: [u8; 3] = [22, 24, 28];
const BRIGHT: [u8; 3] = [238, 238, 234];
const DIM: [u8; 3] = [158, 162, 168];

/// Measures of the page in pixels.
struct Metrics {
    margin: usize,
    gap: usize,
    label: usize,
    head: usize,
    column_head: usize,
    caption: usize,
    cell: (usize, usize),
    /// Of everything between the margins.
    width: usize,
}

impl Sheet {
    /// The page.
    pub fn draw(&self) -> Display {
        let em = if self.text_size > 0.0 { self.text_size } else { 15.0 };
        let (bright, dim) = (Pen::new(em, BRIGHT), Pen::new(em, DIM));
        let title = Pen::new(1.7 * em, BRIGHT).bold();
        let m = self.measure(&title, &bright);
        let width = 2 * m.margin + m.width;
        let rows = self.rows.len();
        let height = 2 * m.margin
            + m.head
            + m.column_head
            + rows * (m.cell.1 + m.caption)
            + rows.saturating_sub(1) * m.gap;
        let mut page = Display::filled(width, height, PAPER);
        let mut below = m.margin as f32;
        for (pen, text) in [(&title, &self.title), (&dim, &self.subtitle)] {
            for line in pen.wrapped(text, m.width as f32) {
                pen.draw(&mut page, m.margin as f32, below, &line);
                below += pen.line();
            }
        }
        let left = m.margin + m.label;
        for (c, name) in self.columns.iter().enumerate() {
            let x = left + c * (m.cell.0 + m.gap) + m.cell.0 / 2;
            bright.centred(&mut page, x as f32, (m.margin + m.head) as f32, name);
        }
        for (r, row) in self.rows.iter().enumerate() {
            let y = m.margin + m.head + m.column_head + r * (m.cell.1 + m.caption + m.gap);
            draw_row(&mut page, row, &m, (left, y), (&bright, &dim));
        }
        page
    }

    fn measure(&self, title: &Pen, pen: &Pen) -> Metrics {
        let em = pen.size;
        let cells = || self.rows.iter().flat_map(|r| r.cells.iter().flatten());
        let widest =
            |lines: &mut dyn Iterator<Item = &String>| lines.map(|l| pen.width(l)).fold(0.0f32, f32::max);
        let side = widest(&mut self.rows.iter().flat_map(|r| r.label.iter()));
        let words = widest(&mut self.columns.iter()).max(widest(&mut cells().flat_map(|c| &c.caption)));
        let width = cells().map(|c| c.picture.width).max().unwrap_or(0).max(words as usize + 1);
        let label = if side > 0.0 { (side + em) as usize } else { 0 };
        let (gap, columns) = ((0.85 * em) as usize, self.columns.len());
        let all = label + columns * width + columns.saturating_sub(1) * gap;
        // A page of one narrow column is wide enough for the longest word of its heading.
        let longest =
            |pen: &Pen, text: &str| text.split_whitespace().map(|w| pen.width(w)).fold(0.0, f32::max);
        let all = all.max(longest(title, &self.title).max(longest(pen, &self.subtitle)).ceil() as usize);
        let height = |pen: &Pen, text: &str| pen.line() * pen.wrapped(text, all as f32).len() as f32;
        let head = height(title, &self.title) + height(pen, &self.subtitle);
        let captions = cells().map(|c| c.caption.len()).max().unwrap_or(0);
        Metrics {
            margin: (1.25 * em) as usize,
            gap,
            label,
            head: if head > 0.0 { (head + 0.6 * em) as usize } else { 0 },
            column_head: if self.columns.iter().all(String::is_empty) { 0 } else { (1.4 * em) as usize },
            caption: if captions > 0 { (0.45 * em + pen.line() * captions as f32) as usize } else { 0 },
            cell: (width, cells().map(|c| c.picture.height).max().unwrap_or(0)),
            width: all,
        }
    }
}

fn draw_row(page: &mut Display, row: &Row, m: &Metrics, at: (usize, usize), pens: (&Pen, &Pen)) {
    let (bright, dim) = pens;
    let line = bright.line();
    let top = at.1 as f32 + 0.5 * (m.cell.1 as f32 - line * row.label.len() as f32);
    for (k, text) in row.label.iter().enumerate() {
        let pen = if k == 0 { bright } else { dim };
        pen.draw(page, m.margin as f32, top + line * k as f32, text);
    }
    for (c, cell) in row.cells.iter().enumerate() {
        let Some(cell) = cell else { continue };
        let x = at.0 + c * (m.cell.0 + m.gap);
        page.paste(&cell.picture, x + (m.cell.0 - cell.picture.width.min(m.cell.0)) / 2, at.1);
        let y = (at.1 + m.cell.1) as f32 + 0.45 * dim.size;
        for (k, text) in cell.caption.iter().enumerate() {
            let pen = if k == 0 && cell.caption.len() > 1 { bright } else { dim };
            pen.centred(page, (x + m.cell.0 / 2) as f32, y + line * k as f32, text);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_holds_every_cell_and_an_empty_sheet_is_fine() {
        assert!(Sheet::default().draw().width > 0);
        let cell = Cell { picture: Display::filled(40, 30, [200, 10, 10]), caption: vec!["0.1 %".into()] };
        let sheet = Sheet {
            title: "Title".into(),
            columns: vec!["one".into(), "two".into()],
            rows: vec![Row { label: vec!["row".into()], cells: vec![Some(cell.clone()), None] }],
            ..Sheet::default()
        };
        let page = sheet.draw();
        let red = page.rgb.chunks_exact(3).filter(|p| *p == [200, 10, 10]).count();
        assert_eq!(red, 40 * 30);
        // A long line is broken where the page ends.
        let words = "the mean difference in photographic stops, over the pixels of the mesh";
        let long = Sheet { subtitle: words.into(), ..sheet };
        let (pen, broken) = (Pen::new(15.0, DIM), long.draw());
        let inside = broken.width - 2 * long.measure(&Pen::new(25.5, BRIGHT).bold(), &pen).margin;
        let lines = pen.wrapped(words, inside as f32);
        assert!(lines.len() > 1 && lines.iter().all(|l| pen.width(l) <= inside as f32), "{lines:?}");
        assert!(broken.height as f32 >= page.height as f32 + pen.line() * lines.len() as f32 - 1.0);
    }
}
