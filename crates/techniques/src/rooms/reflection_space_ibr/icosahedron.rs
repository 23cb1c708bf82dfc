//! The twelve views, and the three around any view with their barycentric weights; `shade.wgsl` has the same
//! function.

use glam::DVec3;

/// Golden section.
const PHI: f32 = 1.618_034;
/// Shorter and longer component of a vertex: 1/√(1 + φ²) and φ/√(1 + φ²).
const SHORT: f32 = 0.525_731_1;
const LONG: f32 = 0.850_650_8;

/// Number of views.
pub const VIEWS: usize = 12;

/// View `k`: families (0, ±a, ±b), (±a, ±b, 0), (±b, 0, ±a); bit 0 of k is set where the shorter component is
/// negative, bit 1 where the longer one is.
pub fn vertex(k: usize) -> DVec3 {
    let phi = f64::midpoint(1.0, 5.0_f64.sqrt());
    let b = phi / (1.0 + phi * phi).sqrt();
    let sign = |bit: usize| if k >> bit & 1 == 1 { -1.0 } else { 1.0 };
    let (short, long) = (sign(0) * b / phi, sign(1) * b);
    match k / 4 {
        0 => DVec3::new(0.0, short, long),
        1 => DVec3::new(short, long, 0.0),
        _ => DVec3::new(long, 0.0, short),
    }
}

/// [`vertex`] in single precision.
#[inline(always)]
pub fn view(k: usize) -> [f32; 3] {
    let short = if k & 1 == 1 { -SHORT } else { SHORT };
    let long = if k & 2 == 2 { -LONG } else { LONG };
    match k / 4 {
        0 => [0.0, short, long],
        1 => [short, long, 0.0],
        _ => [long, 0.0, short],
    }
}

/// The vertices of the face that contains unit `w`, and w's barycentric weights on the sphere (signed
/// volumes), which sum to 1. In the octant of w, A = (0, a, b), B = (a, b, 0), C = (b, 0, a) are one face;
/// each of its edges also belongs to a face whose third vertex is the mirror image of one of the edge's two.
#[inline(always)]
pub fn around(w: [f32; 3]) -> ([usize; 3], [f32; 3]) {
    let [sx, sy, sz] = w.map(|c| usize::from(c < 0.0));
    let [x, y, z] = w.map(f32::abs);
    let (a, b, c) = (sy + 2 * sz, 4 + sx + 2 * sy, 8 + sz + 2 * sx);
    let inside =
        [z * (PHI * PHI) + y - PHI * x, y * (PHI * PHI) + x - PHI * z, x * (PHI * PHI) + z - PHI * y];
    let (index, weight) = if inside[1] < 0.0 {
        ([a, a ^ 1, c], mirrored(x, z, y))
    } else if inside[2] < 0.0 {
        ([b, b ^ 1, a], mirrored(z, y, x))
    } else if inside[0] < 0.0 {
        ([c, c ^ 1, b], mirrored(y, x, z))
    } else {
        ([a, b, c], inside)
    };
    let scale = 1.0 / (weight[0] + weight[1] + weight[2]);
    (index, weight.map(|v| v.max(0.0) * scale))
}

/// Weights of a vertex, its mirror image and the third one of their face, from the coordinates that are the
/// third's longer one, the pair's longer one and the pair's shorter one.
#[inline(always)]
fn mirrored(third: f32, long: f32, short: f32) -> [f32; 3] {
    let w = third / LONG;
    let (sum, gap) = ((long - SHORT * w) / LONG, short / SHORT);
    [0.5 * (sum + gap), 0.5 * (sum - gap), w]
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_prefilter::probe;

    #[test]
    fn the_views_are_an_icosahedron() {
        for i in 0..VIEWS {
            let near = (0..VIEWS).filter(|&k| (vertex(i).dot(vertex(k)) - 0.2_f64.sqrt()).abs() < 1e-12);
            assert_eq!(near.count(), 5);
            assert!((vertex(i).as_vec3() - glam::Vec3::from_array(view(i))).length() < 1e-6);
        }
    }

    /// The three nearest by brute force, weights by determinants.
    #[test]
    fn three_views_around_every_view() {
        for k in 0..20_000 {
            let w = probe::direction(k, 20_000);
            let (index, weight) = around(w.as_vec3().to_array());
            let mut all: Vec<usize> = (0..VIEWS).collect();
            all.sort_by(|a, b| vertex(*b).dot(w).total_cmp(&vertex(*a).dot(w)));
            let v = index.map(vertex);
            let det = |a: DVec3, b: DVec3, c: DVec3| a.dot(b.cross(c));
            let want = [det(w, v[1], v[2]), det(v[0], w, v[2]), det(v[0], v[1], w)];
            let sum: f64 = want.iter().sum();
            for c in 0..3 {
                assert!((want[c] / sum - f64::from(weight[c])).abs() < 2e-6, "{w}: {want:?} {weight:?}");
                assert!(all[..3].contains(&index[c]) || weight[c] < 1e-4, "{w}: {index:?} {all:?}");
            }
        }
    }

    #[test]
    fn a_vertex_is_itself() {
        for k in 0..VIEWS {
            let (index, weight) = around(vertex(k).as_vec3().to_array());
            let own: f32 = (0..3).filter(|&c| index[c] == k).map(|c| weight[c]).sum();
            assert!((own - 1.0).abs() < 1e-6, "{k}: {index:?} {weight:?}");
        }
    }
}
