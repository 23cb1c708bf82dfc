//! The checks that every registered technique gets without asking, as its Card's claims make them meaningful.
//!
//! Checks that a Card waives are printed with the reason. `STERADIAN_BLESS=1 cargo test -p
//! steradian-techniques --test conformance` records the error table anew;
//! `STERADIAN_TECHNIQUES=split_sum,shrm` puts these techniques alone to most checks.

#![expect(clippy::print_stdout, reason = "tests report what they leave out and what they measure")]

#[path = "conformance/harness.rs"]
mod harness;
#[path = "conformance/lobes.rs"]
mod lobes;
#[path = "conformance/local.rs"]
mod local;
#[path = "conformance/photographs.rs"]
mod photographs;
#[path = "conformance/random.rs"]
mod random;
#[path = "conformance/robust.rs"]
mod robust;
#[path = "conformance/sites.rs"]
mod sites;
#[path = "conformance/table.rs"]
mod table;

use glam::DMat3;
use harness::*;
use std::collections::BTreeMap;
use steradian_light::Lights;
use steradian_techniques::shared::trials::lights;
use steradian_techniques::{Check, View, find, registry};

#[test]
fn slugs_are_unique_module_names_and_both_spellings_find_them() {
    let mut slugs: Vec<_> = registry().iter().map(|t| t.card().slug).collect();
    for s in &slugs {
        assert!(s.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_'), "{s}");
        assert_eq!(find(&s.replace('_', "-")).map(|t| t.card().slug), Some(*s));
    }
    slugs.sort_unstable();
    slugs.dedup();
    assert_eq!(slugs.len(), registry().len());
    assert!(find("no such technique").is_none());
}

/// Specimens are taken, and defaults are in their ranges.
#[test]
fn cards_keep_their_word() {
    for t in registry() {
        let card = t.card();
        assert!(!card.specimens.is_empty(), "{}", card.slug);
        let claimed = card.exact_when.iter().map(|c| c.brdf);
        for spec in card.specimens.iter().copied().chain(claimed) {
            assert_eq!((card.materials)(&*material(spec).brdf), Ok(()), "{}: {spec}", card.slug);
        }
        for p in t.params() {
            let default = p.default_value().expect("every parameter of a technique has a default");
            assert_eq!(p.check(&default), Ok(default), "{}: {}", card.slug, p.name);
        }
    }
}

/// Under constant light the result is the directional albedo, up to the error that the certificate states.
#[test]
fn white_furnace() {
    let points = points(24);
    for t in techniques(Check::Furnace) {
        let light = lights::furnace();
        for spec in t.card().specimens {
            let b = shared(t, "furnace", spec);
            let error = difference(&shade(b, &points), &judged(&light, spec, &points));
            let exact = 2e-3;
            let bound = if error > exact { exact.max(2.0 * certified(b).error) } else { exact };
            assert!(error <= bound, "{}: {spec}: {error:.5} > {bound:.5}", t.card().slug);
        }
    }
}

#[test]
fn linearity_in_the_light() {
    let points = points(64);
    for t in techniques(Check::Linearity) {
        let spec = t.card().specimens[0];
        let [a, b] = [lights::sunny(), lights::studio()];
        let made = shared(t, "sunny", spec);
        let of = |l: &Lights| shade(&*relit(made, l), &points);
        let [one, other] = [made, shared(t, "studio", spec)].map(|b| shade(b, &points));
        let two = of(&doubled(&a));
        let twice: Vec<_> = one.iter().map(|l| l.map(|x| 2.0 * x)).collect();
        assert!(difference(&two, &twice) < 1e-5, "{}: twice the light", t.card().slug);
        let added: Vec<_> =
            one.iter().zip(other).map(|(x, y)| std::array::from_fn(|c| x[c] + y[c])).collect();
        let error = difference(&of(&sum(&a, &b)), &added);
        // Each of the three maps meets its own tolerance.
        assert!(error < 0.02, "{}: sum of two lights: {error}", t.card().slug);
    }
}

#[test]
fn turning_light_and_frame_together_changes_nothing() {
    let r = DMat3::from_rotation_z(0.9) * DMat3::from_rotation_y(2.0) * DMat3::from_rotation_x(0.4);
    let points = points(64);
    let moved = turned(&points, r);
    let mut worst = 0.0_f64;
    for t in techniques(Check::Rotation) {
        let spec = t.card().specimens[0];
        let light = lights::smooth();
        let made = shared(t, "smooth", spec);
        let still = shade(made, &points);
        // Turned at bake time: up to the resampling of the image and the tables.
        let environment = light.environment.as_ref().expect("an image").rotated(r);
        let error = difference(&shade(&*relit(made, &environment.into()), &moved), &still);
        println!("{}: baked turned: {error:.5}", t.card().slug);
        worst = worst.max(error);
        // Turned in the frame: up to rounding.
        let mut b = t.load(&made.save()).expect("its own bake");
        b.frame(&View { light_rotation: r.as_mat3(), ..View::default() });
        let error = difference(&shade(&*b, &moved), &still);
        assert!(error < 1e-5, "{}: frame turned: {error}", t.card().slug);
    }
    assert!(worst < 0.012, "{worst}");
}

#[test]
fn exact_where_the_card_says_so() {
    let points = points(24);
    let mut failures = Vec::new();
    for t in techniques(Check::ExactWhen) {
        for c in t.card().exact_when {
            let light = (c.light)();
            let got = shade(&*draft(t, &light, c.brdf, c.params), &points);
            let error = difference(&got, &judged(&light, c.brdf, &points));
            let line = format!("{}: {}: {error:.6} (at most {})", t.card().slug, c.statement, c.within);
            println!("{line}");
            if error > c.within {
                failures.push(line);
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// Points of each kind at which errors are measured in every run.
const RECORDED: usize = 64;
/// Points of each kind where they are recorded, more where fewer leave a standard error above 5 %.
const PRECISE: [usize; 3] = [256, 1024, 4096];

/// In all other cases the error is the recorded one: a larger error fails, and so does a smaller one, until
/// the record is renewed. Points are of the kinds that certificates use, but others of them: uniform ones
/// alone hardly ever see a sun.
#[test]
fn errors_are_the_recorded_ones() {
    let mut lines = Vec::new();
    // Techniques share specimens.
    let mut judged = BTreeMap::new();
    for t in techniques(Check::ErrorBound) {
        for name in RECORDED_UNDER {
            for (spec, _) in tried(t).filter(|(_, lights)| lights.contains(&name)) {
                let b = shared(t, name, spec);
                let mut at = |count: usize| {
                    let new = || Judged::new(&light(name), spec, count, 0.37);
                    judged.entry((name, spec, count)).or_insert_with(new).error(b)
                };
                let found = at(RECORDED).error;
                let precise = || {
                    let mut found = at(PRECISE[0]);
                    for more in &PRECISE[1..] {
                        if found.sigma > 0.05 * found.error + 1e-4 {
                            found = at(*more);
                        }
                    }
                    found
                };
                let stated = certified(b).error;
                let line = table::Line::new([t.card().slug, spec, name], found, stated, precise);
                let noise = b.certificate().figure("noise of the paths");
                lines.push(line.beside_paths(noise));
            }
        }
    }
    table::compare(&lines);
}
