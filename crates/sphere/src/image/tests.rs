//! Lookup: exactness, continuity over every border, order of the error.

use super::{Filter, SphereImage};
use crate::layout::Layout;
use glam::DVec3;

fn smooth(d: DVec3) -> [f32; 3] {
    let v = [2.0 + d.x, 2.0 + d.y - 0.5 * d.z, 2.0 + d.x * d.z + 0.5 * d.y * d.y];
    v.map(|v| v as f32)
}

fn size(layout: Layout, n: usize) -> (usize, usize) {
    if layout == Layout::LatLong { (2 * n, n) } else { (n, n) }
}

/// Deterministic directions all over the sphere.
fn directions(n: usize) -> impl Iterator<Item = DVec3> {
    (0..n).map(move |k| {
        let z = 1.0 - (2 * k + 1) as f64 / n as f64;
        let (s, c) = (k as f64 * 2.399963229728653).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * c, z, r * s)
    })
}

fn largest_error(layout: Layout, n: usize, filter: Filter, at: impl Iterator<Item = DVec3>) -> f64 {
    let (w, h) = size(layout, n);
    let image = SphereImage::from_fn(layout, w, h, smooth);
    at.map(|d| {
        let (a, b) = (image.lookup(filter, d), smooth(d));
        (0..3).map(|c| f64::from((a[c] - b[c]).abs())).fold(0.0, f64::max)
    })
    .fold(0.0, f64::max)
}

#[test]
fn centres_are_met_and_texels_too() {
    for layout in Layout::ALL {
        let (w, h) = size(layout, 16);
        let image = SphereImage::from_fn(layout, w, h, smooth);
        for face in 0..layout.faces() {
            for k in 0..w * h {
                let (i, j) = (k % w, k / w);
                let rim =
                    (2.0 * (i as f64 + 0.5) / w as f64 - 1.0).hypot(2.0 * (j as f64 + 0.5) / h as f64 - 1.0);
                if layout.is_disc() && rim > 0.6 {
                    continue;
                }
                let d = layout.texel_direction(w, h, face, i, j).expect("in use");
                for filter in
                    [Filter::Nearest, Filter::Bilinear, Filter::CatmullRom, Filter::LimitedCatmullRom]
                {
                    let (a, b) = (image.lookup(filter, d), image.texel(face, i, j));
                    assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-6), "{layout:?} {filter:?} {i} {j}");
                }
            }
        }
    }
}

#[test]
fn errors_shrink_at_the_right_order_everywhere() {
    for layout in Layout::ALL {
        for filter in [Filter::Bilinear, Filter::CatmullRom, Filter::LimitedCatmullRom] {
            let [coarse, fine] = [32, 128].map(|n| largest_error(layout, n, filter, directions(20_000)));
            // The folds of the octahedral net and the rim of the mirror ball allow only first order there; at
            // a corner of the cube the neighbours' borders are repeated.
            let order = match layout {
                Layout::Octahedral | Layout::SphereMap => 0.8,
                Layout::Cube => 1.3,
                _ => 1.6,
            };
            let reached = (coarse / fine).log2() / 2.0;
            assert!(reached > order, "{layout:?} {filter:?}: {coarse:e} {fine:e} order {reached}");
            assert!(
                fine < if layout == Layout::SphereMap { 0.12 } else { 0.02 },
                "{layout:?} {filter:?} {fine}"
            );
        }
    }
}

/// Steps of 1e-6 across edges and corners may not change a rough image's value by more than its slope allows.
#[test]
fn no_jumps_anywhere() {
    for layout in Layout::ALL {
        let (w, h) = size(layout, 8);
        // Noise: neighbours differ by order 1.
        let mut image = SphereImage::from_fn(layout, w, h, smooth);
        let mut state = 1u32;
        for plane in &mut image.planes {
            for v in plane.iter_mut() {
                state = state.wrapping_mul(1664525).wrapping_add(1013904223);
                *v = (state >> 8) as f32 / (1 << 24) as f32;
            }
        }
        // Great circles in many planes and circles close to the axes, where borders, corners and poles are.
        let planes = if steradian_testkit::full() { 24 } else { 8 };
        let axes: Vec<DVec3> = directions(planes).chain([DVec3::X, DVec3::Y, DVec3::Z]).collect();
        for filter in [Filter::Bilinear, Filter::CatmullRom, Filter::LimitedCatmullRom] {
            for (k, &n) in axes.iter().enumerate() {
                let frame = crate::Frame::from_normal(n);
                for radius in [1.0, 0.3, 0.99] {
                    let point = |t: f64| {
                        let (s, c) = t.sin_cos();
                        frame.to_world(DVec3::new(radius * c, radius * s, (1.0f64 - radius * radius).sqrt()))
                    };
                    let mut worst: (f64, DVec3) = (0.0, DVec3::ZERO);
                    for step in 0..2000 {
                        // A long step, then a short one back and forth over whatever lies there.
                        let t = std::f64::consts::TAU * f64::from(step) / 2000.0;
                        worst = worst.max_by(largest_jump(
                            &image,
                            filter,
                            &point,
                            t,
                            std::f64::consts::TAU / 2000.0,
                        ));
                    }
                    let poles = layout == Layout::LatLong;
                    let allowed = if poles { 2.0 } else { 1e-3 };
                    assert!(worst.0 < allowed, "{layout:?} {filter:?} {k} {radius}: {worst:?}");
                }
            }
        }
    }
}

trait MaxBy {
    fn max_by(self, other: Self) -> Self;
}
impl MaxBy for (f64, DVec3) {
    fn max_by(self, other: Self) -> Self {
        if other.0 > self.0 { other } else { self }
    }
}

/// Bisects towards the steepest part of [t, t + step] and returns the difference over its last 1e-9.
fn largest_jump(
    image: &SphereImage,
    filter: Filter,
    point: &impl Fn(f64) -> DVec3,
    t: f64,
    step: f64,
) -> (f64, DVec3) {
    let value = |t: f64| image.lookup_f64(filter, point(t))[0];
    let (mut a, mut b) = (t, t + step);
    let (mut va, mut vb) = (value(a), value(b));
    if (va - vb).abs() < 0.05 {
        return (0.0, DVec3::ZERO);
    }
    while b - a > 1e-9 {
        let m = 0.5 * (a + b);
        let vm = value(m);
        if (vm - va).abs() > (vb - vm).abs() { (b, vb) = (m, vm) } else { (a, va) = (m, vm) }
    }
    ((va - vb).abs(), point(a))
}

#[test]
fn lat_long_is_continuous_over_the_seam_and_through_the_pole() {
    let image = SphereImage::from_fn(Layout::LatLong, 32, 16, smooth);
    for filter in [Filter::Bilinear, Filter::CatmullRom, Filter::LimitedCatmullRom] {
        for y in [-0.9, 0.0, 0.5, 0.99] {
            let r = (1.0f64 - y * y).sqrt();
            let at = |e: f64| image.lookup_f64(filter, DVec3::new(-r, y, r * e).normalize());
            let (a, b) = (at(1e-9), at(-1e-9));
            assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-6));
        }
        for phi in [0.0f64, 0.7, 2.0, 4.0] {
            let at =
                |e: f64| image.lookup_f64(filter, DVec3::new(e * phi.cos(), 1.0, e * phi.sin()).normalize());
            let (a, b) = (at(1e-9), at(-1e-9));
            assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-6));
        }
    }
}

#[test]
fn integrals_of_constants_and_of_bands() {
    for layout in Layout::ALL {
        let (w, h) = size(layout, 64);
        let one = SphereImage::from_fn(layout, w, h, |_| [1.0, 2.0, 0.5]).integral();
        assert!((one[0] / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-12, "{layout:?}");
        let square =
            SphereImage::from_fn(layout, w, h, |d| [(d.x * d.x) as f32, (d.z) as f32, d.y as f32]).integral();
        assert!((square[0] / (4.0 * std::f64::consts::PI / 3.0) - 1.0).abs() < 3e-3, "{layout:?} {square:?}");
        assert!(square[1].abs() < 0.02 && square[2].abs() < 1e-3, "{layout:?} {square:?}");
    }
}

#[test]
fn a_limited_lookup_has_no_rims_beside_a_window() {
    for layout in Layout::ALL {
        let (w, h) = size(layout, 32);
        let window =
            |d: DVec3| if d.x > 0.3 && d.y.abs() < 0.5 { [1000.0, 1.0, 0.0] } else { [1.0, 1000.0, 0.25] };
        let image = SphereImage::from_fn(layout, w, h, window);
        let mut rim = 0;
        for d in directions(20_000) {
            let (v, plain) = (image.bicubic_limited(d), image.bicubic(d));
            for (c, [low, high]) in [[1.0, 1000.0], [1.0, 1000.0], [0.0, 0.25]].into_iter().enumerate() {
                assert!((low..=high).contains(&v[c]), "{layout:?} {c} {d}: {}", v[c]);
                rim += usize::from(plain[c] < low - 0.01 * (high - low));
            }
        }
        assert!(rim > 100, "{layout:?}: the plain cubic has rims, here {rim}");
    }
}

#[test]
fn a_limited_lookup_is_the_cubic_where_data_rise_steadily() {
    for layout in Layout::ALL {
        let (w, h) = size(layout, 64);
        let image = SphereImage::from_fn(layout, w, h, smooth);
        let (mut same, mut worst) = (0, 0.0f32);
        for d in directions(5000) {
            let (a, b) = (image.bicubic_limited(d), image.bicubic(d));
            same += (0..3).filter(|&c| (a[c] - b[c]).abs() < 1e-6).count();
            worst = (0..3).fold(worst, |m, c| m.max((a[c] - b[c]).abs()));
        }
        // It differs near extrema, by the second difference of texels, and at the rim of a mirror ball.
        let bound = if layout == Layout::SphereMap { 0.2 } else { 0.02 };
        assert!(same > 12_000 && worst < bound, "{layout:?}: the same in {same} of 15000, else {worst}");
    }
}

#[test]
fn tiny_images_and_odd_directions_do_not_panic() {
    for layout in Layout::ALL {
        for (w, h) in [(1, 1), (2, 1), (1, 3), (3, 2)] {
            let image = SphereImage::from_fn(layout, w, h, |_| [1.0; 3]);
            for filter in [Filter::Nearest, Filter::Bilinear, Filter::CatmullRom, Filter::LimitedCatmullRom] {
                for d in directions(50) {
                    let v = image.lookup(filter, d);
                    assert!((v[0] - 1.0).abs() < 1e-5, "{layout:?} {w}x{h} {filter:?} {v:?}");
                }
                for d in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY, DVec3::NEG_Z, DVec3::Z] {
                    image.lookup(filter, d);
                }
            }
        }
    }
}

/// A dim floor with a few single texels 10⁴ times brighter, on borders and in corners too.
fn suns(layout: Layout, n: usize) -> SphereImage {
    let (w, h) = size(layout, n);
    let mut image = SphereImage::from_fn(layout, w, h, |_| [0.5, 1.0, 0.0]);
    for d in directions(40).chain([
        DVec3::X,
        DVec3::Y,
        DVec3::Z,
        -DVec3::X,
        -DVec3::Y,
        -DVec3::Z,
        DVec3::ONE / 3f64.sqrt(),
    ]) {
        let (face, i, j) = image.texel_of(d);
        let k = image.index(face, i, j);
        image.planes[0][k] = 1e4;
        image.planes[2][k] = 1e4;
    }
    image
}

#[test]
fn resampling_keeps_energy_and_constants() {
    for from in Layout::ALL {
        let source = suns(from, 48);
        let before = source.integral();
        for to in Layout::ALL {
            for n in [12, 31] {
                let (w, h) = size(to, n);
                let out = source.resample(to, w, h);
                let after = out.integral();
                for c in 0..3 {
                    let gap = (after[c] / before[c] - 1.0).abs();
                    // A cube of 31 has smaller texels than these probes anywhere: that is interpolation.
                    let shrinks = to == Layout::Cube && n == 31;
                    assert!(gap < 2e-4 || shrinks, "{from:?} {to:?} {n} {c}: {gap:e}");
                }
                let low = out.planes[1].iter().zip(0..).filter(|(_, k)| {
                    let (i, j) = (k % w, k / w % h);
                    to.solid_angle(w, h, k / (w * h), i, j) > 0.0
                });
                for (v, k) in low {
                    assert!((v - 1.0).abs() < 1e-5, "{from:?} {to:?} {n}: {v} at {k}");
                }
            }
        }
    }
}
