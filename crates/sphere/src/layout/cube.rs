//! Cube faces +X −X +Y −Y +Z −Z in the Khronos orientation: s to the right and t down, both in [−1, 1].

use glam::DVec3;

/// The (not normalised) direction at (s, t) of a face (Vulkan specification, cube map face selection).
#[inline]
pub fn vector(face: usize, s: f64, t: f64) -> Option<DVec3> {
    Some(match face {
        0 => DVec3::new(1.0, -t, -s),
        1 => DVec3::new(-1.0, -t, s),
        2 => DVec3::new(s, 1.0, t),
        3 => DVec3::new(s, -1.0, -t),
        4 => DVec3::new(s, -t, 1.0),
        5 => DVec3::new(-s, -t, -1.0),
        _ => return None,
    })
}

/// The unit direction at (s, t) of a face.
#[inline]
pub fn direction(face: usize, s: f64, t: f64) -> Option<DVec3> {
    Some(vector(face, s, t)?.normalize())
}

/// The face that holds a direction.
#[inline]
pub fn face(d: DVec3) -> usize {
    let a = d.abs();
    if a.x >= a.y && a.x >= a.z {
        usize::from(d.x < 0.0)
    } else if a.y >= a.z {
        2 + usize::from(d.y < 0.0)
    } else {
        4 + usize::from(d.z < 0.0)
    }
}

/// (s, t) of a direction on the plane of a face, which must face it.
#[inline]
pub fn project(face: usize, d: DVec3) -> (f64, f64) {
    match face {
        0 => (-d.z / d.x, -d.y / d.x),
        1 => (-d.z / d.x, d.y / d.x),
        2 => (d.x / d.y, d.z / d.y),
        3 => (-d.x / d.y, d.z / d.y),
        4 => (d.x / d.z, -d.y / d.z),
        _ => (d.x / d.z, d.y / d.z),
    }
}

/// Face, s and t of a direction.
#[inline]
pub fn position(d: DVec3) -> (usize, f64, f64) {
    let face = face(d);
    let (s, t) = project(face, d);
    (face, s, t)
}

/// Solid angle of the rectangle [x0, x1] × [y0, y1] of the plane at distance 1.
///
/// Van Oosterom & Strackee 1983: tan(Ω/2) = a·(b × c) / (abc + (a·b)c + (b·c)a + (c·a)b) for each half. The
/// triple product of three points of that plane is twice the triangle's area, so that nothing cancels.
pub fn solid_angle(x0: f64, x1: f64, y0: f64, y1: f64) -> f64 {
    let area = (x1 - x0) * (y1 - y0);
    let p = |x: f64, y: f64| DVec3::new(x, y, 1.0);
    let (a, b, c, d) = (p(x0, y0), p(x1, y0), p(x1, y1), p(x0, y1));
    triangle(area, a, b, c) + triangle(area, a, c, d)
}

/// Solid angle of a triangle whose triple product is known.
pub(super) fn triangle(triple: f64, a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    2.0 * triple.atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
}
