//! Turns are told apart.

use super::*;

fn light(d: DVec3) -> [f32; 3] {
    let sun = if d.dot(DVec3::new(0.3, 0.6, 0.74)) > 0.99 { 500.0 } else { 0.0 };
    let v = 1.0 + 0.8 * (2.0 * d.x + 0.3).sin() * d.y + 0.5 * d.z + 0.2 * (5.0 * d.x * d.z + d.y).cos();
    [v as f32 + sun, 0.7 * v as f32 + sun, 0.4 + sun]
}

fn cube() -> SphereImage {
    SphereImage::from_fn(Layout::Cube, 32, 32, light)
}

#[test]
fn every_symmetry_is_recognised_and_undone() {
    let world = cube();
    assert_eq!(symmetries().len(), 48);
    for g in symmetries() {
        // W(g d) = R(d)
        let back = g.transpose();
        let file = SphereImage::from_fn(Layout::Cube, 32, 32, |d| world.nearest(back * d));
        let found = find(&file, &world);
        assert_eq!(found.orientation, Orientation::Axes(g), "{} {}", found.orientation.name(), axes_name(g));
        assert_eq!(found.orientation.undo(&file), world);
    }
}

#[test]
fn lat_long_images_turn_too() {
    let world = cube();
    for degrees in [0.0, 90.0, 180.0, 37.0] {
        let back = DMat3::from_rotation_y(f64::to_radians(-degrees));
        let file = SphereImage::from_fn(Layout::LatLong, 128, 64, |d| light(back * d));
        let found = find(&file, &world);
        let want = if degrees == 0.0 { "identity".into() } else { format!("turned by {degrees}° about +Y") };
        let name = found.orientation.name();
        let got: f64 = name.split(&[' ', '°'][..]).find_map(|w| w.parse().ok()).unwrap_or(0.0);
        assert!(name == want || (degrees == 37.0 && (got - 37.0).abs() < 1.5), "{name} {want}");
    }
}

#[test]
fn faces_that_changed_places_are_named() {
    let world = cube();
    let n = 32 * 32;
    let mut file = world.clone();
    for c in 0..3 {
        let (a, b) = file.planes[c].split_at_mut(3 * n);
        a[2 * n..].swap_with_slice(&mut b[..n]);
    }
    let found = find(&file, &world);
    assert_eq!(found.orientation.name(), "faces +Y and -Y swapped");
    assert_eq!(found.orientation.undo(&file), world);
    let mut file = world.clone();
    file.planes.iter_mut().for_each(|p| p.chunks_exact_mut(32).for_each(|r| r.reverse()));
    let found = find(&file, &world);
    assert_eq!(found.orientation.name(), "every face mirrored left to right");
    assert_eq!(found.orientation.undo(&file), world);
    // One face by a quarter.
    let mut file = world.clone();
    for k in 0..n {
        (0..3).for_each(|c| file.planes[c][2 * n + k] = world.planes[c][2 * n + (31 - k % 32) * 32 + k / 32]);
    }
    let found = find(&file, &world);
    assert!(
        found.orientation.name().starts_with("face +Y turned by a quarter"),
        "{}",
        found.orientation.name()
    );
    assert_eq!(found.orientation.undo(&file), world);
}

#[test]
fn names() {
    let g = DMat3::from_rotation_y(std::f64::consts::FRAC_PI_2);
    assert_eq!(
        axes_name(symmetries().into_iter().find(|s| s.abs_diff_eq(g, 1e-9)).unwrap()),
        "turned by 90° about +Y"
    );
    assert_eq!(axes_name(DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0))), "mirrored in z");
    assert_eq!(map_name(DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y)), "(x, z, y)");
}
