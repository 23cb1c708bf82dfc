//! Charts of shares: a row per material, a mark per order, as RH02's figure 5.7 draws them.

use steradian_render::Display;
use steradian_render::sheet::Pen;

/// A row.
pub struct Bar {
    /// Its name.
    pub label: String,
    /// Values 0 … 1 from the lowest order to the highest.
    pub values: Vec<f64>,
}

const PAPER: [u8; 3] = [250, 250, 247];
const INK: [u8; 3] = [24, 26, 30];
const DIM: [u8; 3] = [120, 124, 130];
const RULE: [u8; 3] = [216, 217, 214];
const GOOD: [u8; 3] = [70, 140, 90];
/// Pixels of a row, and of the axis.
const ROW: usize = 11;
const AXIS: usize = 420;
/// Rows of a column; longer charts have several columns.
const ROWS: usize = 75;
const LABEL: usize = 205;
const HEAD: usize = 66;

/// The chart.
pub fn draw(title: &str, subtitle: &str, bars: &[Bar]) -> Display {
    let columns = bars.len().div_ceil(ROWS).max(1);
    let rows = bars.len().div_ceil(columns);
    let width = columns * (LABEL + AXIS + 30) + 20;
    let mut page = Display::filled(width, HEAD + rows * ROW + 24, PAPER);
    Pen::new(20.0, INK).bold().draw(&mut page, 16.0, 12.0, title);
    Pen::new(13.0, DIM).draw(&mut page, 16.0, 36.0, subtitle);
    for (c, part) in bars.chunks(rows.max(1)).enumerate() {
        column(&mut page, 16 + c * (LABEL + AXIS + 30), part, rows);
    }
    page
}

fn column(page: &mut Display, left: usize, bars: &[Bar], rows: usize) {
    let axis = left + LABEL;
    let small = Pen::new(10.0, DIM);
    for tick in [0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0] {
        let x = axis + place(tick);
        let colour = if tick == 0.9 { GOOD } else { RULE };
        rectangle(page, [x, HEAD - 4, 1, rows * ROW + 4], colour);
        small.centred(page, x as f32, (HEAD - 14) as f32, &format!("{:.0}", 100.0 * tick));
    }
    let name = Pen::new(9.5, INK);
    for (r, bar) in bars.iter().enumerate() {
        let y = HEAD + r * ROW + ROW / 2;
        let text: String = bar.label.chars().take(36).collect();
        name.draw(page, left as f32, y as f32 - 4.0, &text);
        if let (Some(low), Some(high)) = (bar.values.first(), bar.values.last()) {
            let (a, b) = (axis + place(*low), axis + place(*high));
            rectangle(page, [a.min(b), y, a.abs_diff(b).max(1), 1], RULE);
        }
        let last = bar.values.len().saturating_sub(1);
        for (k, v) in bar.values.iter().enumerate() {
            mark(page, axis + place(*v), y, k, last);
        }
    }
}

fn place(v: f64) -> usize {
    (v.clamp(0.0, 1.0) * AXIS as f64).round() as usize
}

/// Diamonds, the darker the higher the order; a black disc for the highest.
fn mark(page: &mut Display, x: usize, y: usize, k: usize, last: usize) {
    let r = if k == last { 4i32 } else { 3 };
    let grey = 205 - (120 * k / last.max(1)) as u8;
    let colour = if k == last { INK } else { [grey; 3] };
    for dy in -r..=r {
        for dx in -r..=r {
            let inside = if k == last { dx * dx + dy * dy <= r * r } else { dx.abs() + dy.abs() <= r };
            if inside {
                let (px, py) = (x as i32 + dx, y as i32 + dy);
                rectangle(page, [px.max(0) as usize, py.max(0) as usize, 1, 1], colour);
            }
        }
    }
}

fn rectangle(page: &mut Display, [x, y, w, h]: [usize; 4], colour: [u8; 3]) {
    for j in y..(y + h).min(page.height) {
        for i in x..(x + w).min(page.width) {
            let k = 3 * (j * page.width + i);
            page.rgb[k..k + 3].copy_from_slice(&colour);
        }
    }
}
