//! Orientation of a map: the 48 symmetries of the cube, rotations about +Y, and exchanged faces.

use glam::{DMat3, DVec3};
use std::sync::OnceLock;
use steradian_parallel::prelude::*;
use steradian_sphere::layout::Position;
use steradian_sphere::{Layout, SphereImage};

/// Texels a side of the cubes that are compared: 5.6° each. Turns by less than that are found by bilinear
/// lookups, in steps down to 0.03°.
pub const SIDE: usize = 16;
/// A map is reported as turned only where that reduces the residual to this part. Planted symmetries of the
/// cube leave nothing of it; those that were passed over in 59 planted files leave 0.67 to 0.91.
const MAX_REMAINING_PART: f64 = 0.6;
/// Residuals below this are not worth a turn: they are differences of filters and rounding. In 59 planted
/// files no turn is found below 0.04, so that half and twice give the same decisions.
const MIN_RESIDUAL: f64 = 2e-4;

/// The faces in order.
pub const FACES: [&str; 6] = ["+X", "-X", "+Y", "-Y", "+Z", "-Z"];

/// Transformation of a map's directions: the light of world direction d is found at …
#[derive(Debug, Clone, PartialEq)]
pub enum Orientation {
    /// g d for an orthogonal g; a symmetry of the cube or a turn about +Y, perhaps mirrored.
    Axes(DMat3),
    /// On face `from[f].0` of the world, after one of eight turns and flips, for each face f of the file.
    Faces([(usize, usize); 6]),
}

/// A turn and how well it explains the map: 1 − correlation.
#[derive(Debug, Clone)]
pub struct Found {
    /// The turn.
    pub orientation: Orientation,
    /// 1 − correlation with it undone.
    pub residual: f64,
    /// The residual of the map as it is.
    pub straight: f64,
    /// Does the map vary enough to tell?
    pub certain: bool,
}

/// Every symmetry of the cube.
pub fn symmetries() -> Vec<DMat3> {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    let signed = |o: [usize; 3], s: usize| {
        let col = |k: usize| axes[o[k]] * if s >> k & 1 == 1 { -1.0 } else { 1.0 };
        DMat3::from_cols(col(0), col(1), col(2))
    };
    let mut all: Vec<DMat3> = orders.iter().flat_map(|o| (0..8).map(|s| signed(*o, s))).collect();
    // Identity first, then the smallest changes: of equally good ones the simpler is chosen.
    all.sort_by(|a, b| simplicity(*b).total_cmp(&simplicity(*a)));
    all
}

fn simplicity(g: DMat3) -> f64 {
    g.x_axis.x + g.y_axis.y + g.z_axis.z
}

/// Brightness on a cube of `side` as x/(1 + x) of twice the median, with mean 0: suns, clamped or clipped or
/// not, do not decide alone, and a factor changes nothing.
fn features(image: &SphereImage, side: usize) -> Vec<f64> {
    let cube = image.resample(Layout::Cube, side, side);
    let [r, g, b] = &cube.planes;
    let sum = |i: usize| (f64::from(r[i]) + f64::from(g[i]) + f64::from(b[i])).max(0.0);
    let v: Vec<f64> = (0..r.len()).map(sum).collect();
    saturated(&v)
}

fn saturated(v: &[f64]) -> Vec<f64> {
    let mut sorted = v.to_vec();
    sorted.sort_by(f64::total_cmp);
    let positive = sorted.iter().copied().find(|v| *v > 0.0).unwrap_or(1.0);
    let half = (2.0 * sorted.get(v.len() / 2).copied().unwrap_or(1.0)).max(positive);
    let f: Vec<f64> = v.iter().map(|v| v / (v + half)).collect();
    let mean = f.iter().sum::<f64>() / f.len().max(1) as f64;
    f.iter().map(|f| f - mean).collect()
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Finds how `file` is turned against `world`. Faces may have changed places only in files that are cubes.
pub fn find(file: &SphereImage, world: &SphereImage) -> Found {
    Map::new(file, side(world)).find(world)
}

/// Texels a side of the cube on which a map is compared with `world`.
pub fn side(world: &SphereImage) -> usize {
    SIDE.min(world.height).max(1)
}

/// A file's map as it is compared with worlds of one [`side`].
pub struct Map<'a> {
    file: &'a SphereImage,
    side: usize,
    features: Vec<f64>,
    directions: Vec<DVec3>,
    /// The features of turns about +Y in steps of 3°, then those of mirrored turns.
    about_y: OnceLock<Vec<Vec<f64>>>,
}

/// Turns in steps of 3°.
const COARSE: usize = 120;

impl<'a> Map<'a> {
    /// The map of `file` on a cube of `side`.
    pub fn new(file: &'a SphereImage, side: usize) -> Self {
        let (features, directions) = (features(file, side), directions(side));
        Self { file, side, features, directions, about_y: OnceLock::new() }
    }

    /// Finds how the file is turned against `world`.
    pub fn find(&self, world: &SphereImage) -> Found {
        let (file, side, f) = (self.file, self.side, &self.features);
        let w = features(world, side);
        let scale = norm(f) * norm(&w);
        let varies = |v: &[f64]| norm(v) / (v.len() as f64).sqrt();
        if scale == 0.0 || varies(&w) < 1e-3 || varies(f) < 1e-4 {
            let residual = (varies(f) - varies(&w)).abs();
            return Found {
                orientation: Orientation::Axes(DMat3::IDENTITY),
                residual,
                straight: residual,
                certain: false,
            };
        }
        let score = |g: DMat3| 1.0 - self.after(g).zip(&w).map(|(v, w)| v * w).sum::<f64>() / scale;
        let scores: Vec<(DMat3, f64)> = symmetries().into_par_iter().map(|g| (g, score(g))).collect();
        let straight = scores[0].1;
        let better = |a: f64, b: f64| a < MAX_REMAINING_PART * b && b > MIN_RESIDUAL;
        let mut best = (Orientation::Axes(DMat3::IDENTITY), straight);
        let lowest = scores.iter().fold(scores[0], |a, b| if b.1 < a.1 - 1e-6 { *b } else { a });
        if better(lowest.1, best.1) {
            best = (Orientation::Axes(lowest.0), lowest.1);
        }
        if file.layout == Layout::Cube && side > 2 {
            let (faces, residual) = by_faces(f, &w, side, scale);
            if better(residual, best.1) && best.1 > 5e-3 {
                best = (Orientation::Faces(faces), residual);
            }
        }
        if best.1 > 0.02 && side > 2 {
            let (g, residual) = self.about_y(&w);
            if better(residual, best.1) {
                best = (Orientation::Axes(g), residual);
            }
        }
        Found { orientation: best.0, residual: best.1, straight, certain: true }
    }

    /// Correlation of the map's details with the world's, under the symmetry of the cube or the rotation
    /// that fits best; `None` where the world has no detail. Features common to all lights, such as a
    /// bright sky above a darker ground, are not detail: the part within bands 0 to 2, which shading of
    /// surfaces can follow, is removed.
    pub fn detail(&self, world: &SphereImage) -> Option<f64> {
        let smooth = smooth_basis(&self.directions);
        let w = without(&features(world, self.side), &smooth);
        if norm(&w) < 0.02 * (w.len() as f64).sqrt() {
            return None;
        }
        let likeness = |f: &[f64]| {
            let f = without(f, &smooth);
            let all = norm(&f) * norm(&w);
            if all > 0.0 { f.iter().zip(&w).map(|(a, b)| a * b).sum::<f64>() / all } else { 0.0 }
        };
        let symmetric = symmetries().into_iter().map(|g| likeness(&self.after(g).collect::<Vec<_>>()));
        let found = likeness(&features(&self.find(world).orientation.undo(self.file), self.side));
        Some(symmetric.fold(found, f64::max))
    }

    /// The features after a symmetry of the cube, which exchanges texels.
    fn after(&self, g: DMat3) -> impl Iterator<Item = f64> {
        let side = self.side;
        self.directions.iter().map(move |d| {
            let at = Layout::Cube.position(side, side, g * *d);
            let (i, j) = ((at.x as usize).min(side - 1), (at.y as usize).min(side - 1));
            self.features[(at.face * side + j) * side + i]
        })
    }

    /// The turn about +Y, perhaps mirrored, that fits features `w` best: steps of 3°, then finer.
    fn about_y(&self, w: &[f64]) -> (DMat3, f64) {
        let fine = self.file.resample(Layout::Cube, 2 * self.side, 2 * self.side);
        let turned = |degrees: f64, mirror: bool| {
            let m = if mirror { DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)) } else { DMat3::IDENTITY };
            DMat3::from_rotation_y(degrees.to_radians()) * m
        };
        let seen = |g: DMat3| {
            let value = |d: &DVec3| {
                let [r, g, b] = fine.bilinear(g * *d);
                f64::from(r + g + b).max(0.0)
            };
            saturated(&self.directions.iter().map(value).collect::<Vec<_>>())
        };
        let coarse = |k: usize| ((k % COARSE) as f64 * 360.0 / COARSE as f64, k >= COARSE);
        let all = self.about_y.get_or_init(|| {
            let one = |k: usize| {
                let (degrees, mirror) = coarse(k);
                seen(turned(degrees, mirror))
            };
            (0..2 * COARSE).into_par_iter().map(one).collect()
        });
        let score = |v: &[f64]| {
            1.0 - v.iter().zip(w).map(|(a, b)| a * b).sum::<f64>()
                / (norm(v) * norm(w)).max(f64::MIN_POSITIVE)
        };
        let scores = all.iter().map(|v| score(v)).enumerate();
        let least = scores.fold((0, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a });
        let (degrees, mirror) = coarse(least.0);
        let mut best = (degrees, least.1);
        for step in [1.0, 0.3, 0.1, 0.03] {
            for side in [-1.0, 1.0] {
                loop {
                    let next = best.0 + side * step;
                    let next = (next, score(&seen(turned(next, mirror))));
                    if next.1 >= best.1 {
                        break;
                    }
                    best = next;
                }
            }
        }
        (turned(best.0, mirror), best.1)
    }
}

/// 1 − correlation of a map, after a turn is undone, with the world.
pub fn residual(orientation: &Orientation, file: &SphereImage, world: &SphereImage) -> f64 {
    let side = side(world);
    let (f, w) = (features(&orientation.undo(file), side), features(world, side));
    let scale = norm(&f) * norm(&w);
    if scale > 0.0 { 1.0 - f.iter().zip(&w).map(|(a, b)| a * b).sum::<f64>() / scale } else { 0.0 }
}

/// Orthonormal functions over some directions that span bands 0 to 2.
fn smooth_basis(directions: &[DVec3]) -> Vec<Vec<f64>> {
    let mut out: Vec<Vec<f64>> = Vec::new();
    let of = |f: fn(DVec3) -> f64| directions.iter().map(|d| f(*d)).collect::<Vec<f64>>();
    let all: [fn(DVec3) -> f64; 9] = [
        |_| 1.0,
        |d| d.x,
        |d| d.y,
        |d| d.z,
        |d| d.x * d.y,
        |d| d.y * d.z,
        |d| d.z * d.x,
        |d| d.x * d.x - d.z * d.z,
        |d| d.y * d.y,
    ];
    for f in all {
        let rest = without(&of(f), &out);
        let n = norm(&rest);
        if n > 1e-9 {
            out.push(rest.iter().map(|v| v / n).collect());
        }
    }
    out
}

/// The part of `v` orthogonal to the span of an orthonormal basis.
fn without(v: &[f64], basis: &[Vec<f64>]) -> Vec<f64> {
    let mut out = v.to_vec();
    for b in basis {
        let part: f64 = out.iter().zip(b).map(|(v, b)| v * b).sum();
        out.iter_mut().zip(b).for_each(|(v, b)| *v -= part * b);
    }
    out
}

fn directions(side: usize) -> Vec<DVec3> {
    let texel = |k: usize| {
        let (face, j, i) = (k / (side * side), k / side % side, k % side);
        Layout::Cube.texel_direction(side, side, face, i, j).unwrap_or(DVec3::Y)
    };
    (0..6 * side * side).map(texel).collect()
}

/// One of the eight turns and flips of a square: column and row of the source.
fn square(q: usize, i: usize, j: usize, n: usize) -> (usize, usize) {
    let (i, j) = if q & 4 != 0 { (j, i) } else { (i, j) };
    (if q & 1 != 0 { n - 1 - i } else { i }, if q & 2 != 0 { n - 1 - j } else { j })
}

/// The assignment of faces that fits best: for each face of the file, the world's face and the turn.
fn by_faces(f: &[f64], w: &[f64], n: usize, scale: f64) -> ([(usize, usize); 6], f64) {
    let mut best = [[(0usize, f64::NEG_INFINITY); 6]; 6];
    for (file, row) in best.iter_mut().enumerate() {
        for (world, cell) in row.iter_mut().enumerate() {
            for q in 0..8 {
                let mut sum = 0.0;
                for k in 0..n * n {
                    let (i, j) = square(q, k % n, k / n, n);
                    sum += f[file * n * n + k] * w[world * n * n + j * n + i];
                }
                if sum > cell.1 + 1e-9 * scale {
                    *cell = (q, sum);
                }
            }
        }
    }
    let mut order = [0, 1, 2, 3, 4, 5];
    let mut found = ([(0, 0); 6], f64::NEG_INFINITY);
    permute(&mut order, 0, &mut |p| {
        let sum: f64 = p.iter().enumerate().map(|(file, &world)| best[file][world].1).sum();
        if sum > found.1 + 1e-9 * scale {
            found = (std::array::from_fn(|file| (p[file], best[file][p[file]].0)), sum);
        }
    });
    // A face without features fits any orientation: it gets that of the remaining faces.
    let every = |q: usize| -> f64 {
        let texel = |k: usize| {
            let (i, j) = square(q, k % n, k / n % n, n);
            f[k] * w[k / (n * n) * n * n + j * n + i]
        };
        (0..6 * n * n).map(texel).sum()
    };
    let alike =
        (1..8).map(|q| (q, every(q))).fold((0, f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a });
    let (own, same) = (1.0 - found.1 / scale, 1.0 - alike.1 / scale);
    if same <= 1.2 * own + MIN_RESIDUAL {
        return (std::array::from_fn(|face| (face, alike.0)), same);
    }
    (found.0, own)
}

fn permute(p: &mut [usize; 6], k: usize, visit: &mut impl FnMut(&[usize; 6])) {
    if k == 6 {
        return visit(p);
    }
    for i in k..6 {
        p.swap(k, i);
        permute(p, k + 1, visit);
        p.swap(k, i);
    }
}

impl Orientation {
    /// Is it undone by interpolation, not by moving texels? True of turns that are no symmetry of the cube.
    pub fn interpolates(&self) -> bool {
        let Self::Axes(g) = self else { return false };
        g.to_cols_array().iter().any(|v| v.abs() > 1e-9 && (v.abs() - 1.0).abs() > 1e-9)
    }

    /// Nothing happened.
    pub fn is_identity(&self) -> bool {
        matches!(self, Self::Axes(g) if (*g - DMat3::IDENTITY).abs_diff_eq(DMat3::ZERO, 1e-9))
    }

    /// The map as it should be.
    pub fn undo(&self, file: &SphereImage) -> SphereImage {
        match self {
            _ if self.is_identity() => file.clone(),
            Self::Axes(g) => {
                let g = *g;
                SphereImage::from_fn(file.layout, file.width, file.height, |d| {
                    let at = file.position(g * d);
                    let centred = |v: f64| (v - v.floor() - 0.5).abs() < 1e-6;
                    let exact = centred(at.x) && centred(at.y);
                    if exact { file.nearest(g * d) } else { file.bilinear(g * d) }
                })
            }
            Self::Faces(from) => {
                let n = file.width;
                let mut out = SphereImage::new(Layout::Cube, n, n);
                for (f, &(world, q)) in from.iter().enumerate() {
                    for k in 0..n * n {
                        let (i, j) = square(q, k % n, k / n, n);
                        let to = world * n * n + j * n + i;
                        (0..3).for_each(|c| out.planes[c][to] = file.planes[c][f * n * n + k]);
                    }
                }
                out
            }
        }
    }

    /// In words.
    pub fn name(&self) -> String {
        match self {
            Self::Axes(g) => axes_name(*g),
            Self::Faces(from) => faces_name(from),
        }
    }

    /// The world direction whose light the file should hold at `d`, of texels of `file`.
    pub fn world(&self, file: &SphereImage, d: DVec3) -> DVec3 {
        match self {
            Self::Axes(g) => g.transpose() * d,
            Self::Faces(from) => {
                let at = file.position(d);
                let n = file.width as f64;
                let (face, q) = from[at.face];
                let (x, y) = if q & 4 != 0 { (at.y, at.x) } else { (at.x, at.y) };
                let x = if q & 1 != 0 { n - x } else { x };
                let y = if q & 2 != 0 { n - y } else { y };
                Layout::Cube.direction(file.width, file.width, Position { face, x, y }).unwrap_or(d)
            }
        }
    }

    /// The direction at which the file holds the light of the world's `d`.
    pub fn file(&self, file: &SphereImage, d: DVec3) -> DVec3 {
        match self {
            Self::Axes(g) => *g * d,
            Self::Faces(from) => {
                let at = file.position(d);
                let n = file.width as f64;
                let face = from.iter().position(|f| f.0 == at.face).unwrap_or(at.face);
                let q = from[face].1;
                let x = if q & 1 != 0 { n - at.x } else { at.x };
                let y = if q & 2 != 0 { n - at.y } else { at.y };
                let (x, y) = if q & 4 != 0 { (y, x) } else { (x, y) };
                Layout::Cube.direction(file.width, file.width, Position { face, x, y }).unwrap_or(d)
            }
        }
    }
}

/// Names of a face's eight orientations.
pub const TURNS: [&str; 8] = [
    "no",
    "mirrored left to right",
    "upside down (mirrored top to bottom)",
    "turned by half a turn",
    "transposed",
    "turned by a quarter (counterclockwise)",
    "turned by a quarter (clockwise)",
    "transposed across the other diagonal",
];

fn axes_name(g: DMat3) -> String {
    let diagonal = [g.x_axis.x, g.y_axis.y, g.z_axis.z];
    if (g - DMat3::IDENTITY).abs_diff_eq(DMat3::ZERO, 1e-9) {
        return "identity".into();
    }
    let names = ["x", "y", "z"];
    let is_diagonal = diagonal.iter().all(|v| (v.abs() - 1.0).abs() < 1e-9);
    let flipped: Vec<&str> = (0..3).filter(|k| diagonal[*k] < 0.0).map(|k| names[k]).collect();
    if is_diagonal && flipped.len() != 2 {
        return format!("mirrored in {}", flipped.join(", "));
    }
    let (mirror, r) = if g.determinant() < 0.0 {
        (", mirrored in x", g * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)))
    } else {
        ("", g)
    };
    let cosine = (0.5 * (r.x_axis.x + r.y_axis.y + r.z_axis.z - 1.0)).clamp(-1.0, 1.0);
    let angle = cosine.acos().to_degrees();
    let axis = DVec3::new(r.y_axis.z - r.z_axis.y, r.z_axis.x - r.x_axis.z, r.x_axis.y - r.y_axis.x);
    for (k, unit) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
        if (r * unit - unit).length() < 1e-9 {
            let sign = if axis.dot(unit) < -1e-9 { -1.0 } else { 1.0 };
            let degrees = (sign * angle * 10.0).round() / 10.0;
            return format!("turned by {degrees}° about +{}{mirror}", names[k].to_uppercase());
        }
    }
    format!("axes exchanged: (x, y, z) lies at {}", map_name(g))
}

/// g (x, y, z) as text, for symmetries of the cube.
pub fn map_name(g: DMat3) -> String {
    let term = |row: DVec3| {
        let parts = [(row.x, "x"), (row.y, "y"), (row.z, "z")];
        match parts.iter().find(|(v, _)| v.abs() > 1.0 - 1e-9) {
            Some((v, n)) => format!("{}{n}", if *v < 0.0 { "-" } else { "" }),
            None => "·".into(),
        }
    };
    let t = g.transpose();
    format!("({}, {}, {})", term(t.x_axis), term(t.y_axis), term(t.z_axis))
}

fn faces_name(from: &[(usize, usize); 6]) -> String {
    let same_turn = from.iter().all(|f| f.1 == from[0].1);
    let in_place = from.iter().enumerate().all(|(f, w)| f == w.0);
    if in_place && same_turn {
        return format!("every face {}", TURNS[from[0].1]);
    }
    let mut parts = Vec::new();
    for f in 0..6 {
        let (world, q) = from[f];
        if world > f && from[world].0 == f && q == 0 && from[world].1 == 0 {
            parts.push(format!("faces {} and {} swapped", FACES[f], FACES[world]));
        } else if world == f && q != 0 {
            parts.push(format!("face {} {}", FACES[f], TURNS[q]));
        } else if world != f && !(from[world].0 == f && q == 0 && from[world].1 == 0) {
            let turned = if q == 0 { String::new() } else { format!(", {}", TURNS[q]) };
            parts.push(format!("face {} holds {}{turned}", FACES[f], FACES[world]));
        }
    }
    parts.join("; ")
}

#[cfg(test)]
mod tests;
