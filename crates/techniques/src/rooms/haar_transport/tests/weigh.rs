//! The integral of a reflectance over texels.

use crate::rooms::haar_transport::cube::Level;
use crate::rooms::haar_transport::visibility::{Pyramid, Scratch};
use crate::rooms::haar_transport::weigh::{self, Place};
use glam::{DVec3, Vec3};
use steradian_brdf::{Brdf, albedo, parse};
use steradian_scene::{Bvh, Mesh};
use steradian_sphere::Frame as Axes;

const GGX: &str = "ggx:alpha=0.3";

/// A frame that lies askew to the cube, and a view 40° off its normal.
fn askew() -> (Axes, DVec3) {
    let frame = Axes::from_normal(DVec3::new(0.4, 0.7, -0.6).normalize());
    let (s, c) = 40f64.to_radians().sin_cos();
    (frame, DVec3::new(s * 0.6, s * 0.8, c))
}

/// Transport of a place that is open as `open` says, on faces of `side` texels.
fn weighed(spec: &str, side: usize, open: &[f32]) -> (Level, Vec<f32>) {
    let (frame, wo) = askew();
    let (cube, brdf) = (Level::new(side), parse(spec).unwrap());
    let mut out = vec![Vec::new()];
    let place = Place { brdf: &*brdf, frame, wo };
    place.weigh(&cube, &cube.steps(), open, &mut weigh::Scratch::default(), &mut out);
    (cube, out.remove(0))
}

/// ∫ f_cos over texel `k` where `open` says so, by 64 × 64 points.
fn direct(spec: &dyn Brdf, cube: &Level, k: usize, open: impl Fn(Vec3) -> bool) -> f64 {
    const N: usize = 64;
    let (frame, wo) = askew();
    let steps = cube.steps();
    let at = |i: usize| (i as f32 + 0.5) / N as f32;
    let point = |j: usize| {
        let d = cube.point(k, &steps, [at(j % N), at(j / N)]);
        let nearest = d.abs().max_element().powi(3);
        if open(d) { f64::from(nearest) * spec.f_cos(frame.to_local(d.as_dvec3()), wo)[0] } else { 0.0 }
    };
    let area = (2.0 / cube.side as f64 / N as f64).powi(2);
    area * (0..N * N).map(point).sum::<f64>()
}

/// In the open each texel has the integral of f_cos over it, and all have the directional albedo.
#[test]
fn transport_is_the_integral_over_texels() {
    let (cube, t) = weighed(GGX, 32, &[1.0; 6 * 32 * 32]);
    let brdf = parse(GGX).unwrap();
    let (mut off, mut all) = (0.0, 0.0);
    for (k, t) in t.iter().enumerate() {
        let want = direct(&*brdf, &cube, k, |_| true);
        off += (f64::from(*t) - want).powi(2);
        all += want * want;
    }
    assert!((off / all).sqrt() < 5e-3, "{}", (off / all).sqrt());
    let want = albedo::directional(&*brdf, askew().1, 1e-6)[0];
    let sum: f64 = t.iter().map(|x| f64::from(*x)).sum();
    assert!((sum / want - 1.0).abs() < 5e-4, "{sum} {want}");
}

/// A wall of infinite height in the plane of incidence takes half of a lobe that is its own mirror image
/// there.
#[test]
fn a_wall_takes_its_half_of_the_lobe() {
    let (frame, wo) = askew();
    let up = frame.n.as_vec3();
    let out = frame.to_world(DVec3::new(-wo.y, wo.x, 0.0)).as_vec3().normalize();
    let corner = |x: f32, y: f32| out * 0.5 + (up * x + out.cross(up) * y) * 1e4;
    let wall = Mesh {
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        normals: vec![-out; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let (bvh, pyramid, mut scratch) = (Bvh::build(&wall), Pyramid::new(32), Scratch::default());
    let open = pyramid.see(&bvh, Vec3::ZERO, up, 5, &mut scratch);
    let (cube, t) = weighed(GGX, 32, open);
    let brdf = parse(GGX).unwrap();
    let half = 0.5 * albedo::directional(&*brdf, wo, 1e-6)[0];
    let sum: f64 = t.iter().map(|x| f64::from(*x)).sum();
    assert!((sum / half - 1.0).abs() < 0.01, "{sum} {half}");
    // Texel by texel: rays through those on the edge are four.
    let (mut off, mut all) = (0.0, 0.0);
    for (k, t) in t.iter().enumerate() {
        let want = direct(&*brdf, &cube, k, |d| d.dot(out) < 0.0);
        off += (f64::from(*t) - want).powi(2);
        all += want * want;
    }
    assert!((off / all).sqrt() < 0.12, "{}", (off / all).sqrt());
}

/// A lobe narrower than a texel has its whole energy, and a thin arc of a brushed metal has too.
#[test]
fn lobes_narrower_than_a_texel_keep_their_energy() {
    for (spec, within) in [
        ("ggx:alpha=0.02", 2e-3),
        ("ggx:alpha=0.001", 2e-3),
        ("ggx:alpha=0.0001", 0.01),
        ("ggx:ax=0.01,ay=0.4", 5e-3),
        ("phong:n=100000", 2e-3),
    ] {
        let (_, t) = weighed(spec, 64, &[1.0; 6 * 64 * 64]);
        let want = albedo::directional(&*parse(spec).unwrap(), askew().1, 1e-5)[0];
        let sum: f64 = t.iter().map(|x| f64::from(*x)).sum();
        assert!((sum / want - 1.0).abs() < within, "{spec}: {sum} {want}");
    }
}
