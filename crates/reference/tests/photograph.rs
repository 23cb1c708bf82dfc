//! Photographs of surfaces that repeat: against the reflectance itself, closed forms of grooves, and
//! themselves shifted.

use glam::{DVec2, DVec3, Vec2, Vec3, Vec4};
use std::f64::consts::{FRAC_1_SQRT_2, PI};
use steradian_base::Task;
use steradian_brdf::SharedBrdf;
use steradian_reference::path::{Patch, PathOptions, Photographs, photograph};
use steradian_scene::{Bvh, Mesh};

fn brdf(spec: &str) -> SharedBrdf {
    steradian_brdf::parse(spec).expect("a known model")
}

/// One period of heights over `side` cells each way, flat from cell to cell or smooth.
fn field(side: usize, smooth: bool, height: impl Fn(usize, usize) -> f64) -> Mesh {
    let mut mesh = Mesh::default();
    let z = |i: usize, j: usize| height(i % side, j % side);
    let corner = |i: usize, j: usize| DVec3::new(i as f64, j as f64, z(i, j));
    let mut put = |p: DVec3, n: DVec3| {
        mesh.positions.push(p.as_vec3());
        mesh.normals.push(n.as_vec3());
        mesh.tangents.push(Vec4::new(1.0, 0.0, 0.0, 1.0));
        mesh.uvs.push((p.truncate() / side as f64).as_vec2());
        mesh.positions.len() as u32 - 1
    };
    for j in 0..side {
        for i in 0..side {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1)];
            for t in [[a, b, d], [a, d, c]] {
                let flat = (t[1] - t[0]).cross(t[2] - t[0]).normalize();
                let n = if smooth { DVec3::Z } else { flat };
                let t = t.map(|p| put(p, n));
                mesh.triangles.push(t);
            }
        }
    }
    mesh
}

fn pictures(
    mesh: &Mesh,
    side: usize,
    spec: &str,
    view: DVec3,
    lights: &[DVec3],
    options: PathOptions,
) -> Photographs {
    let (bvh, brdf) = (Bvh::build(mesh), brdf(spec));
    let patch = Patch {
        mesh,
        bvh: &bvh,
        period: DVec2::splat(side as f64),
        corner: DVec2::ZERO,
        plane: 0.0,
        brdf: &*brdf,
        tint: None,
        offset: 1e-4,
    };
    photograph(&patch, (side, side), (view, 3), lights, options, &Task::quiet()).expect("nobody cancels")
}

const DIRECT: PathOptions = PathOptions { bounces: 1, samples: 1, seed: 5 };

#[test]
fn a_plane_shows_its_reflectance_from_everywhere() {
    let mesh = field(4, false, |_, _| 0.0);
    let at = |t: f64, p: f64| DVec3::new(t.sin() * p.cos(), t.sin() * p.sin(), t.cos());
    let lights: Vec<DVec3> = (0..20).map(|k| at(0.075 * f64::from(k), 1.3 * f64::from(k))).collect();
    for spec in ["lambert:albedo=0.8/0.5/0.2", "ward:ax=0.2,ay=0.6,rs=0.5,rd=0.3"] {
        for view in [at(0.0, 0.0), at(1.3, 2.0), at(1.5, 5.0)] {
            let p = pictures(&mesh, 4, spec, view, &lights, DIRECT);
            assert!(p.variance.iter().all(|v| *v == 0.0));
            for (k, rgb) in p.rgb.iter().enumerate() {
                let want = brdf(spec).f_cos(lights[k % 20], view);
                for c in 0..3 {
                    let off = (f64::from(rgb[c]) - want[c]).abs();
                    assert!(off < 1e-5 + 1e-5 * want[c], "{spec}: {k}: {rgb:?} {want:?}");
                }
            }
        }
    }
}

/// Walls of 45°, up and down: lit from above each wall has the irradiance cos 45°, and the form factor
/// between two is 1 − sin 45°. A light at 45° along x lights one wall fully, head on, and leaves the opposite
/// one dark, whatever the number of periods that its rays cross.
#[test]
fn grooves_have_their_closed_form() {
    let mesh = field(2, false, |i, _| i as f64);
    let low = DVec3::new(1.0, 0.0, 1.0).normalize();
    let lights = [DVec3::Z, low];
    let p = pictures(&mesh, 2, "lambert:albedo=0.9", DVec3::Z, &lights, DIRECT);
    let value = |p: &Photographs, k: usize| f64::from(p.rgb[k][0]);
    for pixel in 0..4 {
        assert!((value(&p, 2 * pixel) - 0.9 / PI * FRAC_1_SQRT_2).abs() < 1e-6);
    }
    // Walls that fall to the right face the light.
    let mut facing: Vec<f64> = (0..4).map(|k| value(&p, 2 * k + 1)).collect();
    facing.sort_by(f64::total_cmp);
    assert!(facing[1].abs() < 1e-6 && (facing[2] - 0.9 / PI).abs() < 1e-4, "{facing:?}");
    let many = PathOptions { bounces: 2, samples: 20_000, seed: 9 };
    let p = pictures(&mesh, 2, "lambert:albedo=0.9", DVec3::Z, &lights[..1], many);
    let mean = (0..4).map(|k| value(&p, k)).sum::<f64>() / 4.0;
    let want = 0.9 / PI * FRAC_1_SQRT_2 * (1.0 + 0.9 * (1.0 - FRAC_1_SQRT_2));
    // The mean of four pixels has a quarter of their mean variance.
    assert!((mean - want).abs() < 4.5 * (p.variance[0] / 4.0).sqrt(), "{mean} {want} {}", p.variance[0]);
    assert!(p.variance[0] > 0.0 && (mean - want).abs() < 2e-3);
}

fn rocks(i: usize, j: usize) -> f64 {
    let [x, y] = [i, j].map(|k| std::f64::consts::TAU * k as f64 / 12.0);
    2.5 * ((x + y).sin() + (2.0 * y - x).cos())
        + 3.0 * f64::from(u8::from((i * 5 + j * 3).is_multiple_of(11)))
}

/// The beginning of a period makes no difference: pictures of a shifted surface are shifted pictures, with
/// grazing rays that cross many periods; and threads change no bit.
#[test]
fn a_period_begins_anywhere() {
    let at = |t: f64, p: f64| DVec3::new(t.sin() * p.cos(), t.sin() * p.sin(), t.cos());
    let lights = [at(0.3, 0.2), at(1.2, 2.3), at(1.45, 4.0), at(1.5, 0.0)];
    let plain = field(12, false, rocks);
    let moved = field(12, false, |i, j| rocks((i + 5) % 12, (j + 7) % 12));
    for view in [at(0.0, 0.0), at(1.1, 1.0), at(1.4, 4.4)] {
        let of = |m: &Mesh| pictures(m, 12, "lambert", view, &lights, DIRECT);
        let (a, b) = (of(&plain), of(&moved));
        let mut differ = 0;
        for (k, rgb) in b.rgb.iter().enumerate() {
            let (pixel, l) = (k / 4, k % 4);
            let (i, j) = (pixel % 12, pixel / 12);
            // Rows run down.
            let there = (j + 12 - 7) % 12 * 12 + (i + 5) % 12;
            differ += usize::from((rgb[0] - a.rgb[4 * there + l][0]).abs() > 1e-4);
        }
        // Rounding decides at a few edges.
        assert!(differ <= 6, "{view}: {differ} of {}", b.rgb.len());
        assert!(a.rgb.iter().filter(|v| v[0] == 0.0).count() > 20, "some are in shadow");
        assert!(a.rgb.iter().filter(|v| v[0] > 0.05).count() > 100, "and most are not");
        let noisy = PathOptions { bounces: 3, samples: 4, seed: 1 };
        let again = || pictures(&plain, 12, "lambert", view, &lights, noisy);
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        assert_eq!(one.install(again), again());
    }
}

/// Interpolated normals shade, and never make a visible point black.
#[test]
fn interpolated_normals_shade() {
    let smooth = field(12, true, |i, j| 0.5 * rocks(i, j));
    let view = DVec3::new(0.9, 0.1, 0.3).normalize();
    let p = pictures(&smooth, 12, "lambert:albedo=1", view, &[DVec3::Z], DIRECT);
    let lit = p.rgb.iter().filter(|v| (f64::from(v[0]) - 1.0 / PI).abs() < 1e-5).count();
    assert!(lit > 100, "{lit} are as bright as a level plane");
    assert!(smooth.normals.iter().all(|n| *n == Vec3::Z) && smooth.uvs[0] == Vec2::ZERO);
}
