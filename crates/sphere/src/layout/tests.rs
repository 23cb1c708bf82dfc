//! Closed forms: sums of solid angles, round trips, orientation.

use super::{Layout, Position};
use glam::DVec3;
use std::f64::consts::PI;

fn sum(layout: Layout, w: usize, h: usize) -> f64 {
    let mut total = 0.0;
    for face in 0..layout.faces() {
        for j in 0..h {
            for i in 0..w {
                total += layout.solid_angle(w, h, face, i, j);
            }
        }
    }
    total
}

#[test]
fn solid_angles_sum_to_the_sphere() {
    for layout in Layout::ALL {
        for (w, h) in [(1, 1), (2, 2), (3, 3), (7, 7), (64, 64), (129, 129), (31, 17)] {
            let s = sum(layout, w, h);
            assert!((s / (4.0 * PI) - 1.0).abs() < 1e-12, "{layout:?} {w}x{h}: {}", s / (4.0 * PI));
        }
    }
}

/// Each texel's solid angle against brute force over the map's Jacobian.
#[test]
fn solid_angles_match_quadrature() {
    for layout in Layout::ALL {
        let (w, h) = (9, 9);
        for (i, j) in [(4, 4), (3, 1), (6, 2), (1, 5), (2, 2)] {
            let (x, weights) = crate::quadrature::gauss_legendre(24);
            let mut total = 0.0;
            // Pieces, because the octahedral net has folds.
            for (pi, pj) in (0..36).map(|k| (k % 6, k / 6)) {
                for (a, wa) in x.iter().zip(&weights) {
                    for (b, wb) in x.iter().zip(&weights) {
                        let at = |dx: f64, dy: f64| {
                            let px = i as f64 + (f64::from(pi) + 0.5 * (a + 1.0)) / 6.0 + dx;
                            let py = j as f64 + (f64::from(pj) + 0.5 * (b + 1.0)) / 6.0 + dy;
                            layout.direction(w, h, Position { face: 0, x: px, y: py }).expect("inside")
                        };
                        let e = 1e-5;
                        let (dx, dy) = (at(e, 0.0) - at(-e, 0.0), at(0.0, e) - at(0.0, -e));
                        total += wa * wb * dx.cross(dy).length() / (4.0 * e * e) / 144.0;
                    }
                }
            }
            let exact = layout.solid_angle(w, h, 0, i, j);
            let tolerance = if layout == Layout::Octahedral { 1e-3 } else { 1e-8 };
            assert!((total / exact - 1.0).abs() < tolerance, "{layout:?} {i},{j}: {total} {exact}");
        }
    }
}

#[test]
fn positions_and_directions_are_inverse() {
    for layout in Layout::ALL {
        let (w, h) = (37, 23);
        for face in 0..layout.faces() {
            for j in 0..h * 3 {
                for i in 0..w * 3 {
                    let at = Position { face, x: (i as f64 + 0.5) / 3.0, y: (j as f64 + 0.5) / 3.0 };
                    let o = layout.offset();
                    let (s, t) = (2.0 * (at.x - o) / w as f64 - 1.0, 2.0 * (at.y - o) / h as f64 - 1.0);
                    if layout.is_disc() && s.hypot(t) >= 1.0 {
                        continue;
                    }
                    let d = layout.direction(w, h, at).expect("in use");
                    assert!((d.length() - 1.0).abs() < 1e-14);
                    let p = layout.position(w, h, d);
                    let gap = (p.x - at.x).abs() + (p.y - at.y).abs();
                    assert!(p.face == face && gap < 1e-9, "{layout:?} {at:?} {p:?}");
                }
            }
        }
    }
}

#[test]
fn disc_texels_have_a_direction_where_they_have_a_solid_angle() {
    for layout in [Layout::SphereMap, Layout::AngularMap, Layout::AngularLattice] {
        for n in [1, 2, 5, 16, 33] {
            for k in 0..n * n {
                let (i, j) = (k % n, k / n);
                let d = layout.texel_direction(n, n, 0, i, j);
                let omega = layout.solid_angle(n, n, 0, i, j);
                assert_eq!(d.is_some(), omega > 0.0, "{layout:?} {n} {i} {j}: {omega}");
                assert!(d.is_none_or(|d| (d.length() - 1.0).abs() < 1e-12));
            }
        }
    }
}

#[test]
fn axes_lie_where_the_conventions_say() {
    let at = |layout: Layout, d: DVec3| {
        let p = layout.position(100, 100, d);
        (p.face, p.x.round() as i32, p.y.round() as i32)
    };
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    assert_eq!(at(Layout::LatLong, x), (0, 50, 50));
    assert_eq!(at(Layout::LatLong, z), (0, 75, 50));
    assert_eq!(at(Layout::LatLong, -z), (0, 25, 50));
    assert_eq!(at(Layout::LatLong, y).2, 0);
    assert_eq!(at(Layout::AngularMap, -z), (0, 50, 50));
    assert_eq!(at(Layout::AngularMap, x), (0, 75, 50));
    assert_eq!(at(Layout::AngularMap, y), (0, 50, 25));
    assert_eq!(at(Layout::SphereMap, z), (0, 50, 50));
    assert_eq!(at(Layout::SphereMap, x), (0, 85, 50));
    assert_eq!(at(Layout::SphereMap, y), (0, 50, 15));
    assert_eq!(at(Layout::DualParaboloid, z), (0, 50, 50));
    assert_eq!(at(Layout::DualParaboloid, -z), (1, 50, 50));
    assert_eq!(at(Layout::DualParaboloid, y), (0, 50, 0));
    assert_eq!(at(Layout::Octahedral, y), (0, 50, 50));
    assert_eq!(at(Layout::Octahedral, x), (0, 100, 50));
    assert_eq!(at(Layout::Octahedral, z), (0, 50, 100));
    for (face, d) in [x, -x, y, -y, z, -z].into_iter().enumerate() {
        assert_eq!(at(Layout::Cube, d), (face, 50, 50));
    }
    // The Khronos table: to the right of +X's centre lies −Z, to the right of +Z's +X; +Y's lower edge is +Z.
    assert!(Layout::Cube.position(100, 100, DVec3::new(1.0, 0.0, -0.5)).x > 50.0);
    assert!(Layout::Cube.position(100, 100, DVec3::new(0.5, 0.0, 1.0)).x > 50.0);
    assert!(Layout::Cube.position(100, 100, DVec3::new(0.0, 1.0, 0.5)).y > 50.0);
}

#[test]
fn names_are_found_again() {
    for layout in Layout::ALL {
        assert_eq!(Layout::from_name(layout.name()), Some(layout));
    }
    assert_eq!(Layout::from_name("sphere_map"), Some(Layout::SphereMap));
    assert_eq!(Layout::from_name("nonsense"), None);
}
