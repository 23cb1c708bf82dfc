//! What lies outside the disc of a probe: black, or text, or anything. It is not light.

use steradian_sphere::{Layout, SphereImage};

/// Fills the texels whose centre lies outside the disc. A texel that the rim cuts gets the value of its
/// neighbour inside; on a paraboloid the corners get what the other face shows there; the rest becomes 0.
pub fn fill_outside(image: &mut SphereImage) {
    let (layout, w, h) = (image.layout, image.width, image.height);
    if !layout.is_disc() {
        return;
    }
    let r = |i: usize, j: usize| {
        // Lattice points are half a texel further to the left and up.
        let o = if layout == Layout::AngularLattice { 0.0 } else { 0.5 };
        (2.0 * (i as f64 + o) / w as f64 - 1.0).hypot(2.0 * (j as f64 + o) / h as f64 - 1.0)
    };
    for face in 0..layout.faces() {
        for j in 0..h {
            for i in 0..w {
                if r(i, j) <= 1.0 {
                    continue;
                }
                let source = if layout == Layout::DualParaboloid {
                    let d = layout.texel_direction(w, h, face, i, j);
                    d.map(|d| {
                        let (face, i, j) = image.texel_of(d);
                        let (i, j) = inwards(w, h, i, j, r);
                        (face, i, j)
                    })
                } else if layout.solid_angle(w, h, face, i, j) > 0.0 {
                    let (i, j) = inwards(w, h, i, j, r);
                    Some((face, i, j))
                } else {
                    None
                };
                let to = image.index(face, i, j);
                let from = source.map(|(f, i, j)| image.index(f, i, j));
                for plane in &mut image.planes {
                    plane[to] = from.map_or(0.0, |k| plane[k]);
                }
            }
        }
    }
}

/// Steps towards the centre until a texel's centre lies in the disc.
fn inwards(
    w: usize,
    h: usize,
    mut i: usize,
    mut j: usize,
    r: impl Fn(usize, usize) -> f64,
) -> (usize, usize) {
    let towards = |v: usize, n: usize| {
        if 2 * v + 1 > n {
            v - 1
        } else if 2 * v + 1 < n {
            v + 1
        } else {
            v
        }
    };
    while r(i, j) > 1.0 {
        let (di, dj) = ((2 * i + 1).abs_diff(w) * h, (2 * j + 1).abs_diff(h) * w);
        // A texel on an axis is inside, so that the larger distance always shrinks.
        if di >= dj {
            i = towards(i, w);
        } else {
            j = towards(j, h);
        }
        if di.max(dj) == 0 {
            break;
        }
    }
    (i, j)
}
