//! Exact areas of a polygon in the cells of a unit grid.

/// Accumulates signed areas cell by cell; keeps its buffer between polygons.
#[derive(Default)]
pub struct Coverage {
    /// One more column than cells: each row's running sum is the area.
    cells: Vec<f64>,
    stride: usize,
    x0: isize,
    y0: isize,
    rows: usize,
}

impl Coverage {
    /// Calls `visit(column, row, area)` for every cell that the polygon, times `scale`, covers; areas are
    /// positive whichever way round it goes.
    ///
    /// Each edge adds its signed area to the right of it, within the cells that it crosses, as font
    /// rasterisers do; a running sum along the row does the rest.
    pub fn polygon(&mut self, points: &[(f64, f64)], scale: f64, mut visit: impl FnMut(isize, isize, f64)) {
        if points.len() < 3 || points.iter().any(|p| !(p.0.abs() < 1e9 && p.1.abs() < 1e9)) {
            return;
        }
        let bound = |f: fn(&(f64, f64)) -> f64| {
            points.iter().map(f).fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)))
        };
        let ((xa, xb), (ya, yb)) = (bound(|p| p.0), bound(|p| p.1));
        let (xa, xb, ya, yb) = (xa * scale, xb * scale, ya * scale, yb * scale);
        (self.x0, self.y0) = (xa.floor() as isize, ya.floor() as isize);
        self.stride = (xb.floor() as isize - self.x0) as usize + 3;
        self.rows = (yb.floor() as isize - self.y0) as usize + 1;
        self.cells.clear();
        self.cells.resize(self.stride * self.rows, 0.0);
        let mut area = 0.0;
        for k in 0..points.len() {
            let (p, q) = (points[k], points[(k + 1) % points.len()]);
            let local = |p: (f64, f64)| (p.0 * scale - self.x0 as f64, p.1 * scale - self.y0 as f64);
            let ((px, py), (qx, qy)) = (local(p), local(q));
            area += px * qy - qx * py;
            self.edge((px, py), (qx, qy));
        }
        // The side to the right of a rising edge is inside when the polygon turns clockwise in y-up terms.
        let sign = if area < 0.0 { 1.0 } else { -1.0 };
        for row in 0..self.rows {
            let mut sum = 0.0;
            for column in 0..self.stride - 1 {
                sum += self.cells[row * self.stride + column];
                if sum.abs() > 1e-12 {
                    visit(self.x0 + column as isize, self.y0 + row as isize, sign * sum);
                }
            }
        }
    }

    fn edge(&mut self, p: (f64, f64), q: (f64, f64)) {
        if p.1 == q.1 {
            return;
        }
        let (a, b, sign) = if p.1 < q.1 { (p, q, 1.0) } else { (q, p, -1.0) };
        let slope = (b.0 - a.0) / (b.1 - a.1);
        let last = (b.1.floor() as usize).min(self.rows - 1);
        for row in a.1 as usize..=last {
            let (y0, y1) = (a.1.max(row as f64), b.1.min(row as f64 + 1.0));
            if y1 > y0 {
                let at = |y: f64| if y == b.1 { b.0 } else { a.0 + (y - a.1) * slope };
                self.span(row, at(y0), at(y1), sign * (y1 - y0));
            }
        }
    }

    /// One row's part of an edge, from x0 to x1, of signed height `dy`.
    fn span(&mut self, row: usize, x0: f64, x1: f64, dy: f64) {
        let (x0, x1) = if x0 <= x1 { (x0.max(0.0), x1.max(0.0)) } else { (x1.max(0.0), x0.max(0.0)) };
        let (first, last) = (x0 as usize, (x1 as usize).min(self.stride - 2));
        let cells = &mut self.cells[row * self.stride..(row + 1) * self.stride];
        let mut put = |column: usize, middle: f64, dy: f64| {
            let inside = 1.0 - (middle - column as f64);
            cells[column] += dy * inside;
            cells[column + 1] += dy * (1.0 - inside);
        };
        if first >= last {
            put(last.min(first), 0.5 * (x0 + x1), dy);
            return;
        }
        let per = dy / (x1 - x0);
        for column in first..=last {
            let (a, b) = (x0.max(column as f64), if column == last { x1 } else { column as f64 + 1.0 });
            put(column, 0.5 * (a + b), per * (b - a));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Coverage;

    fn areas(points: &[(f64, f64)]) -> Vec<(isize, isize, f64)> {
        let mut out = Vec::new();
        Coverage::default().polygon(points, 1.0, |i, j, a| out.push((i, j, a)));
        out
    }

    #[test]
    fn areas_are_exact_and_add_up() {
        let square = [(0.5, 0.25), (2.0, 0.25), (2.0, 1.5), (0.5, 1.5)];
        let cells = areas(&square);
        let total: f64 = cells.iter().map(|c| c.2).sum();
        assert!((total - 1.875).abs() < 1e-14, "{cells:?}");
        assert!(cells.contains(&(0, 0, 0.375)) && cells.contains(&(1, 1, 0.5)), "{cells:?}");
        let reversed: Vec<_> = square.iter().rev().copied().collect();
        assert_eq!(areas(&reversed).len(), cells.len());
        let odd = [(-3.2, -1.7), (4.9, 0.3), (1.1, 5.5), (-2.0, 2.2), (0.1, 0.4)];
        let mut shoelace = 0.0;
        for k in 0..5 {
            let (p, q) = (odd[k], odd[(k + 1) % 5]);
            shoelace += 0.5 * (p.0 * q.1 - q.0 * p.1);
        }
        let cells = areas(&odd);
        assert!((cells.iter().map(|c| c.2).sum::<f64>() - shoelace.abs()).abs() < 1e-12);
        assert!(cells.iter().all(|c| c.2 > -1e-12 && c.2 < 1.0 + 1e-12), "{cells:?}");
    }
}
