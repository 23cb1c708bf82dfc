use super::*;
use crate::{PointsBuf, Radiance};
use glam::{DMat3, Vec3};
use steradian_brdf::parse;
use steradian_brdf::views::paraboloid::view;
use steradian_brdf::views::{Energies, Rule};
use steradian_sphere::Frame;
use steradian_sphere::sh::{Rotation, ShRgb};

fn views() -> Vec<DVec3> {
    let at = |k: usize| {
        let z = 1.0 - 0.9 * ((k as f64 + 0.5) / 24.0);
        let (s, phi) = ((1.0 - z * z).sqrt(), 2.4 * k as f64);
        DVec3::new(s * phi.cos(), s * phi.sin(), z)
    };
    (0..24).map(at).collect()
}

fn off(a: &[Vec<f64>; 3], b: &[Vec<f64>; 3]) -> f64 {
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        (0..3).flat_map(|c| a[c].iter().zip(&b[c])).map(|(a, b)| f(*a, *b)).sum()
    };
    (sum(&|a, b| (a - b).powi(2)) / sum(&|_, b| b * b)).sqrt()
}

/// The table at its texels is the rule, the sixteenfold kernel its lookup turned to the world; reflectance
/// that mirrors is computed in one quadrant.
#[test]
fn tables_hold_what_the_rule_gives_and_batches_what_tables_hold() {
    let light = |bands: usize| {
        let c = std::array::from_fn(|k| (0..bands * bands).map(|i| ((3 * i + k) as f64).sin()).collect());
        ShRgb { order: bands - 1, c }
    };
    for (spec, bands, size, mono) in [
        ("ashikhmin-shirley:nu=24,nv=8", 5, 65, true),
        ("ggx:ax=0.3,ay=0.1,f0=0.9/0.6/0.3", 4, 64, false),
        ("lambert:albedo=0.8/0.5/0.2", 3, 16, true),
        ("ggx:alpha=0.4,f0=0.7", 6, 128, true),
        ("phong:n=10", 9, 64, true),
    ] {
        let brdf = parse(spec).unwrap();
        let table = ViewTable::bake(&*brdf, bands, size, &Task::quiet()).unwrap();
        assert_eq!(table.is_mono(), mono, "{spec}");
        let rule = Rule::new(bands - 1);
        let [reach, h] = lattice(size);
        for (i, j) in
            [(size / 2, size / 2), (size / 4, size / 3), (3 * size / 4, size / 2), (size / 5, 2 * size / 3)]
        {
            let (x, y) = (i as f64 * h - reach, j as f64 * h - reach);
            let wo = view(x, y);
            let found = table.lookup(wo).map(|c| c.into_iter().map(f64::from).collect::<Vec<_>>());
            let e = off(&found, &rule.project(&*brdf, wo).c);
            assert!(e < 2e-4, "{spec} {i} {j}: {e}");
        }
        let sh = light(bands);
        let lanes = LightLanes::new(&table, &sh);
        let mut q = PointsBuf::default();
        let mut want = Vec::new();
        for (k, v) in views().into_iter().enumerate() {
            let n = steradian_prefilter::probe::direction(k, 24);
            let f = Frame::from_normal_tangent(n, DVec3::new(0.3, 0.7, (k as f64).sin()));
            let wo = f.to_world(v);
            q.push(n.as_vec3(), f.t.as_vec3(), wo.as_vec3(), Vec3::ZERO);
            let local = Rotation::new(bands - 1, DMat3::from_cols(f.t, f.b, f.n).transpose()).apply_rgb(&sh);
            let c = table.lookup(v);
            want.push(
                [0, 1, 2].map(|k| local.c[k].iter().zip(&c[k]).map(|(l, c)| l * f64::from(*c)).sum::<f64>()),
            );
        }
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
        shade(&table, &lanes, &q.as_points(), &mut Radiance::of(&mut rgb));
        let scale = want.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
        for (i, w) in want.iter().enumerate() {
            for c in 0..3 {
                assert!(
                    (f64::from(rgb[c][i]) - w[c]).abs() < 1e-5 * scale,
                    "{spec} {i}: {} {}",
                    rgb[c][i],
                    w[c]
                );
            }
        }
    }
}

/// The lookup's error falls like the square of the texels' distance.
#[test]
fn lookup_is_of_second_order() {
    let brdf = parse("phong:n=8").unwrap();
    let error = |size: usize| {
        let table = ViewTable::bake(&*brdf, 5, size, &Task::quiet()).unwrap();
        Energies::new(&*brdf, 5, |wo| table.lookup(wo), &Task::quiet())
            .unwrap()
            .lookup()
            .map(|l| l.1 * l.1)
            .sum::<f64>()
            .sqrt()
    };
    let (coarse, fine) = (error(32), error(128));
    assert!(coarse / fine > 8.0 && fine < 3e-3, "{coarse} {fine}");
}

/// Minnaert's f grows as (n·wo)^(k − 1) towards grazing views, and Ward's of 1992 as (n·wo)^(−1/2) where n·wo
/// is below its widths; with that power factored out, lookups are right between the last texels. No power is
/// factored out of reflectance without such growth.
#[test]
fn a_power_of_the_view_is_taken_out() {
    let task = Task::default();
    for (spec, power, most) in
        [("minnaert:k=0.65", -0.35, 1e-3), ("ward:ax=0.063,ay=0.375,variant=1992", -0.5, 2e-2)]
    {
        let brdf = parse(spec).unwrap();
        let table = ViewTable::bake(&*brdf, 5, 128, &task).unwrap();
        assert!((f64::from(table.pole) - power).abs() < 5e-3, "{spec}: {}", table.pole);
        for degrees in [60.0f64, 85.0, 88.3, 89.0, 89.5, 89.8] {
            let theta = degrees.to_radians();
            let wo = DVec3::new(0.6 * theta.sin(), 0.8 * theta.sin(), theta.cos());
            let exact = Rule::new(4).project(&*brdf, wo);
            let found = table.lookup(wo).map(|c| c.into_iter().map(f64::from).collect());
            let error = off(&found, &exact.c);
            assert!(error < most, "{spec} at {degrees}°: {error:.2e}");
        }
    }
    for spec in [
        "lambert:albedo=0.5",
        "ggx:alpha=0.3,f0=0.9",
        "ggx:alpha=0.01,f0=0.9",
        "phong:n=20",
        "oren-nayar:sigma=0.5",
        "ashikhmin-shirley:nu=12,nv=4",
    ] {
        assert_eq!(pole(&*parse(spec).unwrap()), 0.0, "{spec}");
    }
}
