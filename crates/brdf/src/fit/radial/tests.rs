use super::*;
use std::f64::consts::PI;

fn plan(shape: Shape, lobes: usize, mirror: bool) -> Plan {
    Plan { shape, stack: 9, lobes, mirror }
}

fn fit(spec: &str, plan: Plan) -> RadialFit {
    RadialFit::new(&*crate::parse(spec).expect("spec"), plan, &Task::quiet()).expect("nobody cancels")
}

/// f_cos = (r·wi)^n over the sphere is one profile: A = 2π/(n + 1), p = (n + 1)/2π cos^n ψ.
#[test]
fn phong_is_one_profile() {
    for shape in [Shape::Stack, Shape::Scaled] {
        for n in [1.0, 30.0, 1000.0] {
            let f = fit(&format!("phong-map:n={n},scale=2/1/0"), plan(shape, 1, true));
            let lobe = &f.lobes[0];
            assert!(f.residual < 1e-7, "{n}: {:e}", f.residual);
            for a in &lobe.amplitude {
                let want = 2.0 * PI / (n + 1.0);
                assert!((a[0] / want - 2.0).abs() < 1e-4 && (a[1] / want - 1.0).abs() < 1e-4, "{n}: {a:?}");
                assert_eq!(a[2], 0.0);
            }
            for s in &lobe.shapes {
                let curve = f.rings.curve(&s[0]);
                for psi in [0.0_f64, 0.1 / f64::sqrt(n), 1.0 / f64::sqrt(n)] {
                    let want = (n + 1.0) / (2.0 * PI) * psi.cos().powf(n);
                    assert!((curve.at(psi) / want - 1.0).abs() < 1e-4, "{n} {psi}: {} {want}", curve.at(psi));
                }
            }
        }
    }
}

/// The clamped cosine is symmetric about the normal, which is found.
#[test]
fn lambert_is_about_the_normal() {
    let f = fit("lambert:albedo=0.8/0.5/0.2", plan(Shape::Scaled, 1, false));
    assert!(f.lobes[0].gamma.iter().all(|g| g.abs() < 1e-6), "{:?}", f.lobes[0].gamma);
    assert!(f.residual < 1e-6, "{:e}", f.residual);
    assert!(f.lobes[0].amplitude.iter().all(|a| (a[0] - 0.8).abs() < 1e-4 && (a[2] - 0.2).abs() < 1e-4));
}

/// Whatever the plan, the energy of each view is the directional albedo.
#[test]
fn energies_are_exact() {
    for p in [plan(Shape::Stack, 1, true), plan(Shape::Scaled, 1, false), plan(Shape::Scaled, 2, false)] {
        let spec = "ggx:alpha=0.3,f0=0.9/0.6/0.04";
        let brdf = crate::parse(spec).expect("spec");
        let f = fit(spec, p);
        for k in 0..f.views.len() {
            let want = crate::albedo::directional(&*brdf, f.views.wo(k), 1e-5);
            for c in 0..3 {
                let sum: f64 = f
                    .lobes
                    .iter()
                    .map(|l| {
                        let (a, b, w) = l.around(k, f.stride);
                        let of = |s: usize| f.rings.integral(&l.shapes[s][c]);
                        l.amplitude[k][c] * (of(a) + (of(b) - of(a)) * w)
                    })
                    .sum();
                assert!((sum - want[c]).abs() < 1e-3 * want[c], "{p:?} view {k}: {sum} {}", want[c]);
            }
        }
    }
}

/// More freedom leaves less: a stack less than one profile, a better axis less than the mirror direction,
/// more lobes less than one.
#[test]
fn more_freedom_leaves_less() {
    for spec in ["ggx:alpha=0.3,f0=1", "lafortune:@skin"] {
        let residual = |shape, lobes, mirror| fit(spec, plan(shape, lobes, mirror)).residual;
        let (scaled, stack) = (residual(Shape::Scaled, 1, true), residual(Shape::Stack, 1, true));
        let better = residual(Shape::Stack, 1, false);
        let two = residual(Shape::Scaled, 2, false);
        assert!(stack < scaled && better <= stack + 1e-6 && two < 0.5 * scaled, "{spec}");
    }
}

/// As the lobe narrows the kernel becomes round: the residual goes to zero at the normal, and falls at any
/// view.
#[test]
fn nothing_is_left_of_phong_as_it_narrows() {
    let left: Vec<f64> =
        [10, 100, 1000].map(|n| fit(&format!("phong:n={n}"), plan(Shape::Stack, 1, true)).residual).to_vec();
    assert!(left[0] > 1.3 * left[1] && left[1] > 1.3 * left[2], "{left:?}");
}

/// A diffuse part and a lobe: one profile can represent only one of them, two both.
#[test]
fn two_phenomena_take_two_lobes() {
    let spec = "lafortune:cx=-1,cy=-1,cz=1,n=60,kd=0.5";
    let of = |lobes| fit(spec, plan(Shape::Scaled, lobes, false)).residual;
    let (one, two) = (of(1), of(2));
    assert!(two < 0.02 && two < 0.1 * one, "{one} {two}");
}

/// The profiles are the q = 0 part of RH02's expansion about that axis, and their residual is Σ over q ≠ 0.
#[test]
fn what_is_left_is_the_expansion_beyond_q_0() {
    use crate::central::{Centre, Slice, Slices};
    let brdf = crate::parse("ggx:alpha=0.36,f0=0.9/0.6/0.04").expect("spec");
    let p = Plan { stack: 5, ..plan(Shape::Stack, 1, true) };
    let f = RadialFit::new(&*brdf, p, &Task::quiet()).expect("nobody cancels");
    let theta = &f.views.theta[..8];
    let slices = theta.iter().map(|t| Slice::reflection(*t)).collect();
    let central = Slices::new(&*brdf, Centre::Reflection, slices, 40, 0, &Task::quiet()).expect("isotropic");
    let lobe = &f.lobes[0];
    for k in (0..theta.len()).step_by(f.stride) {
        for c in 0..3 {
            // The second and third channel differ from the first by Schlick's term.
            let a = lobe.amplitude[k][c];
            let own = a * a * f.rings.dot(&lobe.shapes[k / f.stride][c], &lobe.shapes[k / f.stride][c]);
            let (all, zonal) = (central.energy[k][c], central.captured(k, 40, 0)[c]);
            assert!((own - zonal).abs() < 4e-3 * all, "view {k}, channel {c}: {own} {zonal} of {all}");
        }
    }
}

#[test]
fn curves_are_the_profiles() {
    let rings = Rings::graded(0.05);
    let profile: Vec<f64> = rings.angles().iter().map(|p| (-p * p / 0.02).exp() + 0.1 * p.cos()).collect();
    let curve = rings.curve(&profile);
    for k in 0..300 {
        let psi = PI * f64::from(k) / 300.0;
        let want = (-psi * psi / 0.02).exp() + 0.1 * psi.cos();
        assert!((curve.at(psi) - want).abs() < 1e-6, "{psi}: {}", curve.at(psi) - want);
    }
    let ones = vec![1.0; rings.angles().len()];
    assert!((rings.integral(&ones) - 4.0 * PI).abs() < 1e-10);
}
