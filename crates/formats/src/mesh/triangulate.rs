//! Polygons to triangles.

/// Polygons with more corners than this are cut as fans: ear clipping takes quadratic time.
const MAX_EARS: usize = 512;

/// Corners that are tried as ears, for each corner of the polygon.
const MAX_TRIES: usize = 8;

/// Calls `emit` with the corner numbers of the triangles of a polygon: ear clipping in the plane of Newell's
/// normal, so that concave polygons come out whole; a fan where the polygon is not simple.
pub fn triangulate(corners: &[[f32; 3]], mut emit: impl FnMut([usize; 3])) {
    let n = corners.len();
    if n <= 3 {
        if n == 3 {
            emit([0, 1, 2]);
        }
        return;
    }
    if n > MAX_EARS {
        (1..n - 1).for_each(|i| emit([0, i, i + 1]));
        return;
    }
    let flat = project(corners);
    let mut left: Vec<usize> = (0..n).collect();
    let mut start = 1;
    // Each search may try every corner against every other: quadratic for the polygons of real meshes, of
    // which most corners are ears, cubic for those that are made to be. The rest of such a one is cut anyhow.
    let mut tries = MAX_TRIES * n;
    while left.len() > 3 {
        let m = left.len();
        // Beginning where the last ear was keeps convex polygons fans.
        let found = (0..m.min(tries)).map(|k| (start + k) % m).find(|&k| {
            tries -= 1;
            is_ear(&flat, &left, k)
        });
        let k = found.unwrap_or(1);
        emit([left[(k + m - 1) % m], left[k], left[(k + 1) % m]]);
        left.remove(k);
        start = k % left.len();
    }
    emit([left[0], left[1], left[2]]);
}

/// The corners in the plane of the polygon: two of the coordinates, wound counter-clockwise.
fn project(corners: &[[f32; 3]]) -> Vec<[f64; 2]> {
    let mut normal = [0.0f64; 3];
    let relative = |p: &[f32; 3]| [0, 1, 2].map(|k| f64::from(p[k]) - f64::from(corners[0][k]));
    for pair in corners.windows(2) {
        let (a, b) = (relative(&pair[0]), relative(&pair[1]));
        for k in 0..3 {
            let (x, y) = ((k + 1) % 3, (k + 2) % 3);
            normal[k] += a[x] * b[y] - a[y] * b[x];
        }
    }
    let k = (0..3).max_by(|&i, &j| normal[i].abs().total_cmp(&normal[j].abs())).unwrap_or(2);
    let (x, y) = if normal[k] >= 0.0 { ((k + 1) % 3, (k + 2) % 3) } else { ((k + 2) % 3, (k + 1) % 3) };
    corners.iter().map(|p| [f64::from(p[x]), f64::from(p[y])]).collect()
}

fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Is corner `k` of the rest convex, with no other corner inside its triangle?
fn is_ear(flat: &[[f64; 2]], left: &[usize], k: usize) -> bool {
    let m = left.len();
    let at = |i: usize| flat[left[i % m]];
    let (a, b, c) = (at(k + m - 1), at(k), at(k + 1));
    turn(a, b, c) > 0.0
        && (2..m - 1).all(|i| {
            let p = at(k + i);
            p == a || p == b || p == c || turn(a, b, p) < 0.0 || turn(b, c, p) < 0.0 || turn(c, a, p) < 0.0
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[[f32; 3]], triangles: &[[usize; 3]]) -> (f64, f64) {
        let flat = project(corners);
        let signed = triangles.iter().map(|&[a, b, c]| 0.5 * turn(flat[a], flat[b], flat[c]));
        signed.fold((0.0, 0.0), |(s, u), a| (s + a, u + a.abs()))
    }

    fn cut(corners: &[[f32; 3]]) -> Vec<[usize; 3]> {
        let mut out = Vec::new();
        triangulate(corners, |t| out.push(t));
        out
    }

    #[test]
    fn a_square_is_two_triangles_and_a_line_is_none() {
        let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(area(&square, &cut(&square)), (1.0, 1.0));
        assert!(cut(&square[..2]).is_empty());
    }

    #[test]
    fn concave_polygons_keep_their_area_whatever_corner_comes_first() {
        // An L in the plane x = 2, and an arrow head.
        let l: Vec<[f32; 3]> =
            [[0., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 3.], [0., 3.]].map(|[y, z]| [2.0, y, z]).into();
        let arrow: Vec<[f32; 3]> = [[0., 0.], [2., 1.], [0., 2.], [1., 1.]].map(|[x, z]| [x, 7.0, z]).into();
        for (polygon, want) in [(l, 4.0), (arrow, 1.0)] {
            for shift in 0..polygon.len() {
                let mut p = polygon.clone();
                p.rotate_left(shift);
                for _ in 0..2 {
                    let t = cut(&p);
                    assert_eq!(t.len(), p.len() - 2);
                    let (signed, unsigned) = area(&p, &t);
                    assert!(
                        (signed - want).abs() < 1e-12 && (unsigned - want).abs() < 1e-12,
                        "{shift} {t:?}"
                    );
                    p.reverse();
                }
            }
        }
    }

    #[test]
    fn degenerate_polygons_still_end() {
        let point = [[1.0; 3]; 9];
        assert_eq!(cut(&point).len(), 7);
        let huge = vec![[0.0; 3]; 2000];
        assert_eq!(cut(&huge).len(), 1998);
    }
}
