//! Points with lobes of their own: techniques that declare that they vary do so, and equal bakes of that
//! lobe.

use super::harness::*;
use glam::{DVec3, Vec3};
use steradian_reference::ReferencePoint;
use steradian_techniques::shared::trials::lights;
use steradian_techniques::{AnyBake, PointLobe, PointsBuf, Radiance, registry};

fn shade_lobes(b: &dyn AnyBake, points: &[ReferencePoint], lobe: PointLobe) -> Vec<[f64; 3]> {
    let mut q = PointsBuf::with_capacity(points.len());
    for p in points {
        q.push_lobe([p.frame.n, p.frame.t, p.wo, DVec3::ZERO].map(|v| v.as_vec3()), lobe);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; points.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    (0..points.len()).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]].map(f64::from)).collect()
}

/// Every technique that varies, with its specimens.
fn bakes() -> Vec<(&'static str, &'static str, &'static dyn AnyBake)> {
    let mut out = Vec::new();
    for t in registry().iter().filter(|t| !t.card().needs.sites) {
        for spec in t.card().specimens {
            let b = shared(*t, "studio", spec);
            let v = b.varies();
            assert_eq!(
                b.gpu_varied().is_some_and(|r| r.entry.lobe),
                v.alpha || v.normals,
                "{}",
                t.card().slug
            );
            if v.alpha || v.normals {
                out.push((t.card().slug, *spec, b));
            }
        }
    }
    out
}

#[test]
fn a_plain_lobe_is_the_material_s_own() {
    let points = points(64);
    for (slug, spec, b) in bakes() {
        let e = difference(&shade_lobes(b, &points, PointLobe::PLAIN), &shade(b, &points));
        // Phong's lobes come from another chain of maps.
        assert!(e < 0.03, "{slug}: {spec}: {e}");
        println!("{slug}: {spec}: plain lobe {e:.1e}");
    }
}

#[test]
fn a_point_s_alpha_is_that_of_a_material() {
    let points = points(96);
    for (slug, one, other, alpha) in [
        ("split_sum", "ggx:alpha=0.5,f0=0.9/0.6/0.3", "ggx:alpha=0.1,f0=0.9/0.6/0.3", 0.1f32),
        ("split_sum", "ggx:alpha=0.01,f0=0.04", "ggx:alpha=0.4,f0=0.04", 0.4),
        ("phong_diffuse_maps", "phong-map:n=300", "phong-map:n=50", 0.1),
    ] {
        let t = steradian_techniques::find(slug).expect("a technique");
        let light = lights::studio();
        let lobe = PointLobe { alpha, ..PointLobe::PLAIN };
        let got = shade_lobes(&*draft(t, &light, one, &[]), &points, lobe);
        let e = difference(&got, &shade(&*draft(t, &light, other, &[]), &points));
        println!("{slug}: {one} at alpha {alpha}: {e:.4}");
        assert!(e < 0.04, "{slug}: {one} at alpha {alpha}: {e}");
    }
}

/// The mean over Gaussian normals, by 15 × 15 of them, against covariance and widening.
#[test]
fn spread_normals_are_the_mean_over_normals() {
    let points = points(64);
    let side = 7i32;
    let mut sums = [0.0; 2];
    for (slug, spec, b) in bakes().iter().filter(|b| b.2.varies().normals) {
        for (tt, tb, bb) in [(4e-4, 0.0, 4e-4), (4e-3, 1e-3, 1e-3), (2e-2, 0.0, 2e-4)] {
            let (l11, l21) = (f64::sqrt(tt), tb / f64::sqrt(tt));
            let l22 = f64::sqrt(bb - l21 * l21);
            let mut truth = vec![[0.0; 3]; points.len()];
            let mut total = 0.0;
            for k in 0..(2 * side + 1).pow(2) {
                let at = |k: i32| 3.2 * f64::from(k - side) / f64::from(side);
                let (x, y) = (at(k % (2 * side + 1)), at(k / (2 * side + 1)));
                let w = (-0.5 * (x * x + y * y)).exp();
                let tilt = |p: &ReferencePoint| {
                    let n = p.frame.n + p.frame.t * (l11 * x) + p.frame.b * (l21 * x + l22 * y);
                    let n = n.normalize();
                    // Bent as renderers bend normals that turn away from the viewer.
                    let c = n.dot(p.wo);
                    let n = if c < 0.01 { (n + p.wo * (0.01 - c)).normalize() } else { n };
                    ReferencePoint { frame: steradian_sphere::Frame::from_normal(n), ..*p }
                };
                let tilted: Vec<ReferencePoint> = points.iter().map(tilt).collect();
                for (to, l) in truth.iter_mut().zip(shade(*b, &tilted)) {
                    (0..3).for_each(|c| to[c] += w * l[c]);
                }
                total += w;
            }
            truth.iter_mut().flatten().for_each(|l| *l /= total);
            let spread = [tt as f32, tb as f32, bb as f32];
            let error = |lobe| difference(&shade_lobes(*b, &points, lobe), &truth);
            let covariance = error(PointLobe { spread, ..PointLobe::PLAIN });
            let isotropic = error(PointLobe { widen: (tt + bb) as f32, ..PointLobe::PLAIN });
            let none = error(PointLobe::PLAIN);
            println!("{slug}: {spec}: {spread:?}: {none:.4} {isotropic:.4} {covariance:.4}");
            sums[0] += isotropic;
            sums[1] += covariance;
            assert!(covariance < none.max(0.01), "{slug}: {spec}: {spread:?}: {covariance} {none}");
        }
    }
    assert!(sums[1] < sums[0], "{sums:?}");
}

#[test]
fn lobes_are_finite_on_extremes() {
    let mut q = PointsBuf::default();
    for k in 0..600 {
        let n = steradian_prefilter::probe::direction(k % 30, 30).as_vec3();
        let t = n.any_orthonormal_vector();
        let c = [1.0f32, 0.3, 1e-3, 1e-7, -0.5][k % 5];
        let wo = n * c + t * (1.0 - c * c).max(0.0).sqrt();
        let wide = [0.0f32, 1e-12, 1e-3, 0.3, 1.0];
        let (tt, bb) = (wide[k / 5 % 5], wide[k / 25 % 5]);
        let tb = (tt * bb).sqrt() * [-1.0, 0.0, 1.0][k % 3];
        let lobe = PointLobe {
            alpha: [-1.0, 0.0, 1e-4, 0.5, 1.0, 7.0][k % 6],
            widen: wide[k / 7 % 5],
            least: wide[k / 3 % 5],
            spread: [tt, tb, bb],
            albedo: [[-1.0; 3], [0.0, 0.5, 1.0]][k % 2],
            f0: [[-1.0; 3], [0.0, 0.04, 1.0]][k / 2 % 2],
        };
        q.push_lobe([n, t, wo, Vec3::ZERO], lobe);
    }
    for (slug, spec, b) in bakes() {
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
        b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
        for (i, x) in rgb.iter().flatten().enumerate() {
            assert!(x.is_finite(), "{slug}: {spec}: point {}: {x}", i % q.len());
        }
    }
}
