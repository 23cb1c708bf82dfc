//! Crossings of a straight line over the surface with the edges of its triangles: between them the height is
//! linear in the distance, so the highest slope that is seen from the line's start is that of a crossing.

use super::HeightField;
use glam::DVec3;
use steradian_parallel::prelude::*;

/// Texels of a row that are taken together.
const BLOCK: usize = 64;
/// Rows that are processed together: their lookups for a group of crossings overlap, and fit the nearest
/// cache.
const TILE: usize = 8;
/// Crossings that are skipped together where no height ahead of a block can raise its texels' horizons.
const GROUP: usize = 16;
/// A line is followed over this many periods at most: points further away have a slope below (range of
/// heights)/(4 periods).
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

/// The largest height of the columns and rows that a group may look up for a block of texels whose first one
/// meets its corner: texel by texel of the corner. Columns, rows and diagonals lie less than one texel apart
/// along a line, so that a group spans [`GROUP`] and one texels at most.
fn heights_ahead(field: &HeightField) -> Vec<f32> {
    let (w, h) = (field.width, field.height);
    let along = |of: &dyn Fn(usize) -> f32, n: usize, span: usize| -> Vec<f32> {
        // Windows of lengths 1, 2, 4 …, and two of these for any other length.
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

/// Distance to which lines are followed.
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

/// Raises the horizon of each texel of a block to the slopes of a crossing, from heights at the ends of its
/// edge. (`f32::max` would check for NaN.)
#[inline(always)]
fn raise(best: &mut [f32; BLOCK], own: &[f32; BLOCK], [a, b]: [&[f32; BLOCK]; 2], c: &Crossing) {
    for k in 0..BLOCK {
        let slope = (a[k] + c.weight * (b[k] - a[k]) - own[k]) * c.inverse;
        best[k] = if slope > best[k] { slope } else { best[k] };
    }
}

/// Can a point of height `z`, at a distance of 1/`inverse` or further, raise the horizon of any texel?
#[inline(always)]
fn open(best: &[f32; BLOCK], own: &[f32; BLOCK], z: f32, inverse: f32) -> bool {
    let mut any = 0;
    for k in 0..BLOCK {
        any |= u32::from((z - own[k]) * inverse > best[k]);
    }
    any != 0
}

const NONE: &[f32; BLOCK] = &[0.0; BLOCK];

/// A field as periodic rows, so that the lookups of a block are contiguous.
struct Rows<'a> {
    field: &'a HeightField,
    /// Row by row of `wide` heights.
    z: Vec<f32>,
    wide: usize,
    highest: f32,
    /// Result of [`heights_ahead`]; `None` where every group is to be visited.
    ahead: Option<Vec<f32>>,
}

impl<'a> Rows<'a> {
    fn new(field: &'a HeightField, ahead: Option<Vec<f32>>) -> Self {
        let (w, h) = (field.width, field.height);
        let wide = w + BLOCK.max(w);
        let z = (0..h).flat_map(|j| (0..wide).map(move |i| field.z[j * w + i % w])).collect();
        Self { field, z, wide, highest: field.range().1, ahead }
    }

    /// A sum of two numbers below `n`, reduced to one period.
    #[inline(always)]
    fn within(k: usize, n: usize) -> usize {
        if k < n { k } else { k - n }
    }

    /// The heights of a block that begins at a column and a row.
    #[inline(always)]
    fn block(&self, i: usize, j: usize) -> &[f32; BLOCK] {
        // Rows are long enough wherever a block begins.
        self.z[j * self.wide + i..].first_chunk().unwrap_or(NONE)
    }

    /// Computes the horizons of the texels of a tile.
    #[inline(always)]
    fn see(&self, Tile { top, line: (line, groups), out }: Tile<'_>) {
        let (w, h) = (self.field.width, self.field.height);
        let count = out.len() / w;
        for from in (0..w).step_by(BLOCK) {
            let mut all = [[0.0; BLOCK]; TILE];
            // Rows that something further off may still raise.
            let mut left = [true; TILE];
            for (group, crossings) in groups.iter().zip(line.chunks(GROUP)) {
                let corner = Self::within(from + group.corner.0, w);
                for (r, best) in all.iter_mut().enumerate().take(count) {
                    if !left[r] {
                        continue;
                    }
                    let own = self.block(from, top + r);
                    let row = Self::within(top + r + group.corner.1, h);
                    let z = match &self.ahead {
                        Some(ahead) => ahead[row * w + corner],
                        None => self.highest,
                    };
                    if !open(best, own, z, group.inverse) {
                        left[r] = self.ahead.is_some() && open(best, own, self.highest, group.inverse);
                        continue;
                    }
                    for c in crossings {
                        let [a, b] = c.ends;
                        let a = self.block(Self::within(from + a.0, w), Self::within(top + r + a.1, h));
                        let b = self.block(Self::within(from + b.0, w), Self::within(top + r + b.1, h));
                        raise(best, own, [a, b], c);
                    }
                }
                if left[..count] == [false; TILE][..count] {
                    break;
                }
            }
            let columns = BLOCK.min(w - from);
            for (best, out) in all.iter().zip(out.chunks_mut(w)) {
                out[from..from + columns].copy_from_slice(&best[..columns]);
            }
        }
    }
}

/// Rows from `top` on, [`TILE`] at most, and the horizons of their texels along a line.
struct Tile<'a> {
    top: usize,
    line: &'a Line,
    out: &'a mut [f32],
}

/// The largest slope dz/ds, 0 at least, seen from every texel along each azimuth: planes of texels, azimuth
/// by azimuth.
pub fn slopes(field: &HeightField, azimuths: &[f64], go_on: &(dyn Fn() -> bool + Sync)) -> Option<Vec<f32>> {
    along_lines(&Rows::new(field, Some(heights_ahead(field))), azimuths, go_on)
}

/// The slopes without skipping groups.
pub fn slopes_by_every_crossing(field: &HeightField, azimuths: &[f64]) -> Vec<f32> {
    along_lines(&Rows::new(field, None), azimuths, &|| true).unwrap_or_default()
}

fn along_lines(rows: &Rows<'_>, azimuths: &[f64], go_on: &(dyn Fn() -> bool + Sync)) -> Option<Vec<f32>> {
    let (w, h) = (rows.field.width, rows.field.height);
    let reach = reach(rows.field);
    let lines: Vec<Line> = azimuths.par_iter().map(|phi| crossings(rows.field, *phi, reach)).collect();
    let mut out = vec![0.0; w * h * azimuths.len()];
    let tiles: Vec<_> = out
        .chunks_mut(w * h)
        .zip(&lines)
        .flat_map(|(plane, line)| {
            plane.chunks_mut(w * TILE).enumerate().map(move |(k, out)| Tile { top: k * TILE, line, out })
        })
        .collect();
    tiles.into_par_iter().for_each(|tile| {
        if go_on() {
            rows.see(tile);
        }
    });
    go_on().then_some(out)
}
