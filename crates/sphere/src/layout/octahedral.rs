//! Octahedral map (Praun & Hoppe 2003; Cigolle et al. 2014) about +Y: s towards +X, t (down) towards +Z.

use super::cube::triangle;
use glam::DVec3;

/// The unit direction at (s, t).
pub fn direction(s: f64, t: f64) -> DVec3 {
    vector(s, t).normalize()
}

/// The point of the octahedron |x| + |y| + |z| = 1 at (s, t); beyond the square the net repeats folded.
fn vector(s: f64, t: f64) -> DVec3 {
    // A step over an edge comes back at the mirrored place of the same edge.
    let (s, t) = if s.abs() > 1.0 { (2.0 * s.signum() - s, -t) } else { (s, t) };
    let (s, t) = if t.abs() > 1.0 { (-s, 2.0 * t.signum() - t) } else { (s, t) };
    let y = 1.0 - s.abs() - t.abs();
    if y >= 0.0 {
        DVec3::new(s, y, t)
    } else {
        DVec3::new((1.0 - t.abs()).copysign(s), y, (1.0 - s.abs()).copysign(t))
    }
}

/// Face 0, s and t.
pub fn position(d: DVec3) -> (usize, f64, f64) {
    let k = 1.0 / (d.x.abs() + d.y.abs() + d.z.abs());
    let (s, t) = (d.x * k, d.z * k);
    if d.y >= 0.0 { (0, s, t) } else { (0, (1.0 - t.abs()).copysign(s), (1.0 - s.abs()).copysign(t)) }
}

/// Solid angle of [x0, x1] × [y0, y1]: the parts in the eight triangles of the net are planar polygons on the
/// octahedron's faces, and planar polygons are spherical polygons seen from the centre.
pub fn solid_angle(x0: f64, x1: f64, y0: f64, y1: f64) -> f64 {
    let mut total = 0.0;
    for (sx, sy) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        // The quadrant's part, mirrored to s, t ≥ 0.
        let (a0, a1) = if sx > 0.0 { (x0, x1) } else { (-x1, -x0) };
        let (b0, b1) = if sy > 0.0 { (y0, y1) } else { (-y1, -y0) };
        let (a0, a1, b0, b1) = (a0.max(0.0), a1.min(1.0), b0.max(0.0), b1.min(1.0));
        if a0 < a1 && b0 < b1 {
            total += quadrant(a0, a1, b0, b1);
        }
    }
    total
}

/// The same in the quadrant s, t ≥ 0, cut along s + t = 1.
fn quadrant(x0: f64, x1: f64, y0: f64, y1: f64) -> f64 {
    let corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)];
    let mut total = 0.0;
    for side in [1.0, -1.0] {
        // side·(1 − s − t) ≥ 0 keeps the upper or the lower triangle.
        let height = |p: (f64, f64)| side * (1.0 - p.0 - p.1);
        let mut part: Vec<(f64, f64)> = Vec::with_capacity(6);
        for k in 0..4 {
            let (p, q) = (corners[k], corners[(k + 1) % 4]);
            let (hp, hq) = (height(p), height(q));
            if hp >= 0.0 {
                part.push(p);
            }
            if (hp > 0.0 && hq < 0.0) || (hp < 0.0 && hq > 0.0) {
                let f = hp / (hp - hq);
                part.push((p.0 + (q.0 - p.0) * f, p.1 + (q.1 - p.1) * f));
            }
        }
        total += polygon(&part, side);
    }
    total
}

/// Solid angle of a convex polygon of one triangle of the net, by a fan of triangles.
///
/// The triple product of three points is twice their area in (s, t): the face's plane is x + y + z = 1, and
/// (s, t) are two of its coordinates (below, 1 − t and 1 − s, which keeps areas).
fn polygon(p: &[(f64, f64)], side: f64) -> f64 {
    let lift = |(s, t): (f64, f64)| {
        let y = 1.0 - s - t;
        if side > 0.0 { DVec3::new(s, y, t) } else { DVec3::new(1.0 - t, y, 1.0 - s) }
    };
    let mut total = 0.0;
    for k in 2..p.len() {
        let (a, b, c) = (p[0], p[k - 1], p[k]);
        let twice = (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0);
        total += triangle(twice, lift(a), lift(b), lift(c));
    }
    total
}
