//! What the three layouts on a disc share: solid angles of texels that the rim cuts.
//!
//! With θ the angle from the centre's direction and φ the azimuth, dω = d(1 − cos θ) ∧ dφ, so that the solid
//! angle of a region is the boundary integral ∮ (1 − cos θ) dφ (Stokes). Along a vertical edge x = c that is
//! ∫ g(r²) c dy with g = (1 − cos θ)/r², a function without singularities; along the rim it is a constant
//! times the angle. Neighbours share edges, so that sums telescope to 4π.

use std::f64::consts::TAU;

/// A segment of the boundary.
#[derive(Clone, Copy)]
struct Piece {
    from: (f64, f64),
    to: (f64, f64),
}

/// ∮ (1 − cos θ) dφ around [x0, x1] × [y0, y1] ∩ unit disc, counterclockwise in (x, y).
///
/// `edge(c, a, b)` is ∫_a^b g(c² + y²) c dy; `rim` is 1 − cos θ at r = 1.
pub fn integrate(x0: f64, x1: f64, y0: f64, y1: f64, edge: impl Fn(f64, f64, f64) -> f64, rim: f64) -> f64 {
    if inside(x0, x1, y0, y1) {
        return edge(x1, y0, y1) - edge(y1, x1, x0) + edge(x0, y1, y0) - edge(y0, x0, x1);
    }
    let mut total = 0.0;
    let mut pieces = [None; 4];
    for (piece, (p, q)) in pieces.iter_mut().zip(sides(x0, x1, y0, y1)) {
        *piece = clip(p, q);
    }
    let kept: Vec<Piece> = pieces.into_iter().flatten().collect();
    if kept.is_empty() {
        // Nothing of the boundary lies in the disc: the cell holds all of it or nothing.
        let holds = x0 < 0.0 && x1 > 0.0 && y0 < 0.0 && y1 > 0.0;
        return if holds { rim * TAU } else { 0.0 };
    }
    for (k, piece) in kept.iter().enumerate() {
        let ((ax, ay), (bx, by)) = (piece.from, piece.to);
        // dφ = (x dy − y dx)/r².
        total += if ax == bx { edge(ax, ay, by) } else { -edge(ay, ax, bx) };
        total += rim * arc(piece.to, kept[(k + 1) % kept.len()].from);
    }
    total.max(0.0)
}

/// ∫ of the area's boundary form (x dy − y dx)/2.
pub fn area_edge(c: f64, a: f64, b: f64) -> f64 {
    0.5 * c * (b - a)
}

/// Value of the area's form on the rim.
pub const AREA_RIM: f64 = 0.5;

/// Does the texel that holds position (x, y) of a w × h face, whose square begins `o` texels from its corner,
/// overlap the disc?
pub fn in_use(w: f64, h: f64, x: f64, y: f64, o: f64) -> bool {
    let nearest = |v: f64, n: f64| {
        let i = v.floor().clamp(0.0, n - 1.0);
        let (a, b) = (2.0 * (i - o) / n - 1.0, 2.0 * (i + 1.0 - o) / n - 1.0);
        0f64.clamp(a, b)
    };
    let (s, t) = (nearest(x, w), nearest(y, h));
    s * s + t * t < 1.0
}

/// Do all corners lie in the disc?
fn inside(x0: f64, x1: f64, y0: f64, y1: f64) -> bool {
    x0.abs().max(x1.abs()).powi(2) + y0.abs().max(y1.abs()).powi(2) <= 1.0
}

/// The four sides, counterclockwise.
pub fn sides(x0: f64, x1: f64, y0: f64, y1: f64) -> [((f64, f64), (f64, f64)); 4] {
    [((x1, y0), (x1, y1)), ((x1, y1), (x0, y1)), ((x0, y1), (x0, y0)), ((x0, y0), (x1, y0))]
}

/// The part of an axis-parallel side inside the disc.
fn clip(p: (f64, f64), q: (f64, f64)) -> Option<Piece> {
    let vertical = p.0 == q.0;
    let (c, a, b) = if vertical { (p.0, p.1, q.1) } else { (p.1, p.0, q.0) };
    let half = (1.0 - c * c).max(0.0).sqrt();
    let (a, b) = (a.clamp(-half, half), b.clamp(-half, half));
    if (b - a).abs() < 1e-14 {
        return None;
    }
    let at = |v: f64| if vertical { (c, v) } else { (v, c) };
    Some(Piece { from: at(a), to: at(b) })
}

/// Counterclockwise angle between two points of the rim; 0 where they are one point.
pub fn arc(from: (f64, f64), to: (f64, f64)) -> f64 {
    let cross = from.0 * to.1 - from.1 * to.0;
    let dot = from.0 * to.0 + from.1 * to.1;
    if (from.0 - to.0).abs() + (from.1 - to.1).abs() < 1e-13 {
        return 0.0;
    }
    let angle = cross.atan2(dot);
    if angle < 0.0 { angle + TAU } else { angle }
}

/// The boundary of [x0, x1] × [y0, y1] ∩ disc as a closed polygon: `n` steps per side, and as many per arc.
pub fn outline(x0: f64, x1: f64, y0: f64, y1: f64, n: usize, out: &mut Vec<(f64, f64)>) {
    let kept: Vec<Piece> = sides(x0, x1, y0, y1).into_iter().filter_map(|(p, q)| clip(p, q)).collect();
    if kept.is_empty() {
        if x0 < 0.0 && x1 > 0.0 && y0 < 0.0 && y1 > 0.0 {
            let steps = 8 * n.max(4);
            out.extend((0..steps).map(|k| (TAU * k as f64 / steps as f64).sin_cos()).map(|(s, c)| (c, s)));
        }
        return;
    }
    for (k, piece) in kept.iter().enumerate() {
        let ((ax, ay), (bx, by)) = (piece.from, piece.to);
        for step in 0..n {
            let f = step as f64 / n as f64;
            out.push((ax + (bx - ax) * f, ay + (by - ay) * f));
        }
        let turn = arc(piece.to, kept[(k + 1) % kept.len()].from);
        if turn > 0.0 {
            let start = by.atan2(bx);
            let steps = n + (turn / 0.2) as usize;
            out.extend((0..steps).map(|s| {
                let (sin, cos) = (start + turn * s as f64 / steps as f64).sin_cos();
                (cos, sin)
            }));
        }
    }
}
