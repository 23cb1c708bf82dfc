//! Where a straight line over the surface meets the edges of its triangles: between them the height is linear in the
//! distance, so the highest slope that is seen from the line's start is that of a crossing.

use super::HeightField;
use glam::DVec3;
use steradian_parallel::prelude::*;

/// Texels of a row that are taken together.
const BLOCK: usize = 64;
/// Crossings that are left out together where no height ahead of a block reaches above what its texels see already.
const GROUP: usize = 16;
/// A line is followed over this many periods at most: what stands further off is below (range of heights)/(4 periods).
const PERIODS: usize = 4;

/// A crossing of a line from a vertex with an edge: z = (1 − weight) z(first) + weight z(second).
struct Crossing {
    /// Columns and rows from the start to the edge's ends, reduced to one period.
    ends: [(usize, usize); 2],
    weight: f32,
    /// 1/distance.
    inverse: f32,
}

/// Crossings of neighbouring distances.
struct Group {
    /// Columns and rows from the start to the least of their ends, reduced to one period.
    corner: (usize, usize),
    /// 1/distance of the nearest.
    inverse: f32,
}

/// A crossing with its distance, and the columns and rows of its edge's ends.
type Placed = (f64, [(i64, i64); 2], Crossing);

/// A line's crossings by distance, and their groups of [`GROUP`].
type Line = (Vec<Crossing>, Vec<Group>);

/// The crossings of lines of azimuth `phi` up to `reach`, by distance.
fn crossings(field: &HeightField, phi: f64, reach: f64) -> Line {
    // Rows count downwards.
    let (di, dj) = (phi.cos(), -phi.sin());
    let (w, h) = (field.width as i64, field.height as i64);
    let end = |(i, j): (i64, i64)| (i.rem_euclid(w) as usize, j.rem_euclid(h) as usize);
    let mut out: Vec<Placed> = Vec::new();
    let mut add = |s: f64, first: (i64, i64), second: (i64, i64), weight: f64| {
        let ends = [end(first), end(second)];
        let crossing = Crossing { ends, weight: weight as f32, inverse: (1.0 / s) as f32 };
        out.push((s, [first, second], crossing));
    };
    // Columns, rows and diagonals i − j = n.
    for (rate, kind) in [(di, 0), (dj, 1), (di - dj, 2)] {
        if rate.abs() < 1e-12 {
            continue;
        }
        for n in 1..=(reach * rate.abs()) as i64 {
            let s = n as f64 / rate.abs();
            let n = if rate < 0.0 { -n } else { n };
            let (i, j) = (di * s, dj * s);
            match kind {
                0 => add(s, (n, j.floor() as i64), (n, j.floor() as i64 + 1), j - j.floor()),
                1 => add(s, (i.floor() as i64, n), (i.floor() as i64 + 1, n), i - i.floor()),
                _ => {
                    let a = i.floor() as i64;
                    add(s, (a, a - n), (a + 1, a + 1 - n), i - i.floor());
                }
            }
        }
    }
    out.sort_by(|a, b| a.0.total_cmp(&b.0));
    let group = |g: &[Placed]| {
        let least = |f: fn((i64, i64)) -> i64| g.iter().flat_map(|c| c.1).map(f).min().unwrap_or_default();
        Group { corner: end((least(|e| e.0), least(|e| e.1))), inverse: g[0].2.inverse }
    };
    let groups = out.chunks(GROUP).map(group).collect();
    (out.into_iter().map(|c| c.2).collect(), groups)
}

/// The largest height of the columns and rows that a group may look up for a block of texels whose first one meets its corner:
/// texel by texel of the corner. Columns, rows and diagonals lie less than one texel apart along a line, so that a group
/// spans [`GROUP`] and one texels at most.
fn heights_ahead(field: &HeightField) -> Vec<f32> {
    let (w, h) = (field.width, field.height);
    let along = |of: &dyn Fn(usize) -> f32, n: usize, span: usize| -> Vec<f32> {
        // Windows of lengths 1, 2, 4 …, and two of these for the rest.
        let mut wide: Vec<f32> = (0..n).map(of).collect();
        let (mut length, span) = (1, span.min(n));
        while 2 * length <= span {
            wide = (0..n).map(|i| wide[i].max(wide[(i + length) % n])).collect();
            length *= 2;
        }
        (0..n).map(|i| wide[i].max(wide[(i + span - length) % n])).collect()
    };
    let rows: Vec<Vec<f32>> = (0..h).map(|j| along(&|i| field.z[j * w + i], w, BLOCK + GROUP + 2)).collect();
    let mut out = vec![0.0; w * h];
    for i in 0..w {
        for (j, z) in along(&|j| rows[j][i], h, GROUP + 2).into_iter().enumerate() {
            out[j * w + i] = z;
        }
    }
    out
}

/// How far lines are followed.
fn reach(field: &HeightField) -> f64 {
    (PERIODS * field.width.max(field.height)) as f64
}

/// Does light from the direction `d` reach the texel of column `i` and row `j`?
pub fn sees(field: &HeightField, (i, j): (usize, usize), d: DVec3) -> bool {
    let across = d.x.hypot(d.y);
    if d.z <= 0.0 {
        return false;
    }
    if across < 1e-12 {
        return true;
    }
    let (slope, z) = (d.z / across, field.z[j * field.width + i]);
    let rise = f64::from(field.range().1 - z);
    let below = |c: &Crossing| {
        let [a, b] = c.ends.map(|(right, down)| {
            field.z[(j + down) % field.height * field.width + (i + right) % field.width]
        });
        f64::from((a + c.weight * (b - a) - z) * c.inverse) <= slope
    };
    // Beyond, the ray is above all heights.
    crossings(field, d.y.atan2(d.x), (rise / slope).min(reach(field))).0.iter().all(below)
}

/// The largest slope dz/ds, 0 at least, seen from every texel along each azimuth: planes of texels, azimuth by azimuth.
pub fn slopes(field: &HeightField, azimuths: &[f64], go_on: &(dyn Fn() -> bool + Sync)) -> Option<Vec<f32>> {
    let (w, h) = (field.width, field.height);
    // A row and its repetition: what a block of texels looks up is in one piece.
    let wide = w + BLOCK.max(w);
    let rows: Vec<f32> = (0..h).flat_map(|j| (0..wide).map(move |i| field.z[j * w + i % w])).collect();
    let highest = field.range().1;
    let reach = reach(field);
    let ahead = heights_ahead(field);
    let lines: Vec<Line> = azimuths.par_iter().map(|phi| crossings(field, *phi, reach)).collect();
    let mut out = vec![0.0; w * h * azimuths.len()];
    out.par_chunks_mut(w).enumerate().for_each(|(row, best)| {
        if !go_on() {
            return;
        }
        let ((line, groups), j) = (&lines[row / h], row % h);
        for (block, best) in best.chunks_mut(BLOCK).enumerate() {
            let from = block * BLOCK;
            let start = &rows[j * wide + from..][..best.len()];
            // Can something as high as this, as far off as this or further, still be higher than what is seen?
            let open = |best: &[f32], z: f32, inverse: f32| {
                start.iter().zip(best).fold(false, |any, (own, b)| any | ((z - own) * inverse > *b))
            };
            for (group, crossings) in groups.iter().zip(line.chunks(GROUP)) {
                let (i, down) = group.corner;
                if !open(best, ahead[(j + down) % h * w + (from + i) % w], group.inverse) {
                    if !open(best, highest, group.inverse) {
                        break;
                    }
                    continue;
                }
                for c in crossings {
                    let [a, b] = c.ends.map(|(i, down)| {
                        let (i, j) = ((from + i) % w, (j + down) % h);
                        &rows[j * wide + i..][..best.len()]
                    });
                    for (((best, z), a), b) in best.iter_mut().zip(start).zip(a).zip(b) {
                        *best = best.max((a + c.weight * (b - a) - z) * c.inverse);
                    }
                }
            }
        }
    });
    go_on().then_some(out)
}
