use super::fit::{Layout, Samples, fit, problem};
use super::form::Form;
use super::shade;
use crate::local;
use crate::shared::tables::hemisphere::Map;
use crate::{BakeError, Material};
use glam::DVec3;
use steradian_base::{ParamValues, Params as _, Task};
use steradian_brdf::Symmetry;
use steradian_brdf::{Brdf, parse};
use steradian_numerics::lsqr::Sparse;

fn tables(spec: &str, params: &[(&str, &str)]) -> super::Tables {
    let values: ParamValues = params.iter().copied().collect();
    let p = super::Params::from_values(&values).expect("parameters");
    super::bake::bake(&Material::new(parse(spec).expect(spec)), &p, &Task::quiet()).expect("bakes")
}

fn error(spec: &str, t: &super::Tables) -> f64 {
    let brdf = parse(spec).expect(spec);
    local::error(&*brdf, &|wi, wo| brdf.f_cos(wi, wo), |wi, wo| shade::f_cos(t, wi, wo))
}

/// The normal equations of a direct solution count, which take most of the memory there.
#[test]
fn memory_holds_the_normal_equations() {
    let brdf = parse("ggx:alpha=0.4").expect("a spec");
    let p = super::Params::from_values(&ParamValues::default()).expect("parameters");
    let symmetry = Symmetry::of(&*brdf);
    let layout = Layout::new(symmetry, 64, Form::of(&*brdf, symmetry.isotropic));
    let normal = layout.normal_bytes() as u64;
    assert!(normal >= 16 * 24 * (layout.count() as u64).pow(2) && normal > 0, "{} unknowns", layout.count());
    let task = Task::quiet().with_max_memory(normal);
    let e = super::bake::bake(&Material::new(brdf), &p, &task).err();
    assert!(matches!(e, Some(BakeError::Memory { need, .. }) if need > normal), "{e:?}");
}

/// Pairs whose light, view and half vector lie on entries: no lookup interpolates.
fn on_entries(brdf: &dyn Brdf, layout: &Layout) -> Samples {
    let mut out = Samples { at: Vec::new(), f: Vec::new(), share: Vec::new() };
    // Without nodes on the horizon, whose values are those of directions above it.
    let side: Vec<DVec3> = (1..layout.sides.height).map(|k| layout.sides.direction(k)).collect();
    for (v, l) in side.iter().enumerate().flat_map(|(i, v)| side[i..].iter().map(move |l| (v, l))) {
        // Up to 60°, where distributions are numbers.
        let halves = (0..layout.halves.height).map(|k| layout.form.half(layout.halves.direction(k)).z);
        for z in halves.filter(|z| *z > 0.5) {
            let cosines = v.z * l.z;
            // |v + l|² = 2 + 2 v·l, and z = (n·v + n·l)/|v + l|.
            let vl = 0.5 * ((v.z + l.z) / z).powi(2) - 1.0;
            let across = (v.x.hypot(v.y)) * (l.x.hypot(l.y));
            let cos_phi = (vl - cosines) / across;
            if cos_phi.abs() < 1.0 {
                let sin_phi = (1.0 - cos_phi * cos_phi).sqrt();
                let (s, r) = (v.x.hypot(v.y), l.x.hypot(l.y));
                let pair = [DVec3::new(r * cos_phi, r * sin_phi, l.z), DVec3::new(s, 0.0, v.z)];
                let risen = (v.z * l.z).powf(layout.form.grazing);
                out.f.push(brdf.eval(pair[0], pair[1]).map(|f| f * risen));
                out.at.push(pair);
                out.share.push(1.0);
            }
        }
    }
    out
}

/// The RMS error of the logarithm where nothing is interpolated: the error of the form itself.
fn form_error(spec: &str) -> f64 {
    let brdf = parse(spec).expect(spec);
    let layout = Layout::new(Symmetry::of(&*brdf), 12, Form::of(&*brdf, true));
    let samples = on_entries(&*brdf, &layout);
    let (mut p, _) = problem(&layout, &samples, 0.0);
    (p.accuracy, p.steps, p.floor, p.dense) = (1e-16, 4000, 1e-300, false);
    // Entries themselves: single precision finds them within 1e-5 of a step.
    let nearest = |map: &Map, start: usize, w: DVec3| {
        let at = |k: usize| map.direction(k).z;
        let k = (0..map.len()).min_by(|a, b| (at(*a) - w.z).abs().total_cmp(&(at(*b) - w.z).abs()));
        (start + k.expect("entries")) as u32
    };
    let (mut ends, mut entries) = (Vec::new(), Vec::new());
    for [l, v] in &samples.at {
        let h = layout.form.stretched(*l + *v).normalize();
        let h = nearest(&layout.halves, layout.first_half(), h);
        entries.extend([*l, *v].map(|w| (nearest(&layout.sides, 0, w), 1.0)));
        entries.push((h, 1.0));
        ends.push(entries.len() as u32);
    }
    p.a = Sparse::new(layout.count(), ends, entries);
    let logs = p.logs();
    let s = p.solve();
    let square = |(m, b): (&[f64; 3], &[f64; 3])| (m[0] - b[0]).powi(2);
    (s.model.iter().zip(&logs).map(square).sum::<f64>() / logs.len() as f64).sqrt()
}

/// Cook and Torrance's model with Smith's masking and without Fresnel's term is exactly of the form; so are,
/// whatever the widths, Ward's of 1992 and Dür's; GGX, whose masking is correlated, is not.
#[test]
fn products_are_found_to_rounding() {
    for (spec, exact) in [
        ("cook-torrance:m=0.5,f0=1,g=smith", true),
        ("ward:alpha=0.5,variant=1992", true),
        ("ward:alpha=0.5,variant=duer", true),
        ("lambert", true),
        ("ggx:alpha=0.5,f0=1", false),
        ("cook-torrance:m=0.5,f0=0.1,g=smith", false),
    ] {
        let e = form_error(spec);
        println!("{spec}: {e:.1e}");
        assert!(if exact { e < 1e-11 } else { e > 1e-3 }, "{spec}: {e:.2e}");
    }
}

/// With entries of the usual number the error is interpolation's: it falls as they grow in number.
#[test]
fn exact_forms_are_exact_up_to_interpolation() {
    for (spec, within) in [
        ("cook-torrance:m=0.3,f0=1,g=smith", 1e-3),
        // Models unbounded at the horizon, down to it.
        ("ward:alpha=0.3,variant=1992", 1e-3),
        ("ward:ax=0.15,ay=0.4,variant=1992", 1e-3),
        ("ward:ax=0.2,ay=0.4,variant=duer", 1e-3),
        ("lambert:albedo=0.8/0.5/0.2", 1e-5),
    ] {
        let of = |side: &str| error(spec, &tables(spec, &[("resolution", side)]));
        let (coarse, usual) = (of("32"), of("64"));
        println!("{spec}: {coarse:.2e} with 32 entries a side, {usual:.2e} with 64");
        assert!(usual < within && (usual < coarse || usual < 1e-5), "{spec}: {coarse} {usual}");
    }
}

/// f(l, v) and f(v, l) have the same bits.
#[test]
fn the_product_is_reciprocal_to_the_bit() {
    for spec in ["ward:ax=0.15,ay=0.4", "ggx:alpha=0.3,f0=0.9/0.6/0.3"] {
        let t = tables(spec, &[("resolution", "16")]);
        for k in 0..200 {
            let of = |j: usize| {
                let (z, phi) = (0.02 + 0.97 * ((k * j) as f64 * 0.618).fract(), (k * j) as f64);
                let s = (1.0 - z * z).sqrt();
                DVec3::new(s * phi.cos(), s * phi.sin(), z).as_vec3().to_array()
            };
            let (wi, wo) = (of(3), of(7));
            let f = |a: [f32; 3], b: [f32; 3]| shade::f(&t, a, b).map(f32::to_bits);
            assert_eq!(f(wi, wo), f(wo, wi), "{spec}");
        }
    }
}

/// The weights' power decides what is minimised: with 1 the error of f (n·l), with 0 that of its logarithm.
#[test]
fn weights_decide_what_is_minimised() {
    let spec = "dielectric:alpha=0.2,albedo=0.5";
    let brdf = parse(spec).expect(spec);
    let (form, quiet) = (Form::of(&*brdf, true), Task::quiet());
    let layout = Layout::new(Symmetry::of(&*brdf), 16, form);
    let samples = Samples::new(&*brdf, 24 * layout.count(), true, form, &quiet).expect("nobody cancels");
    let of = |power| fit(&layout, &samples, power, &quiet).expect("nobody cancels").residual;
    assert!(of(1.0) < 0.9 * of(0.0), "{} {}", of(1.0), of(0.0));
}

/// A reflectance that is no product is approximated, as well between the fit's samples as at them.
#[test]
fn what_is_no_product_is_approximated() {
    for (spec, within) in [
        ("ashikhmin-shirley:nu=20,nv=200,rs=0.3,rd=0.5/0.3/0.1", 0.5),
        ("ashikhmin-shirley:nu=20,nv=200,rs=0.3", 0.6),
        ("dielectric:alpha=0.3,albedo=0.6/0.3/0.1", 0.42),
        ("ggx:ax=0.2,ay=0.5,f0=0.9/0.6/0.3", 0.08),
    ] {
        let t = tables(spec, &[("resolution", "24")]);
        let error = error(spec, &t);
        println!("{spec}: {error:.3}, {:.3} at samples", t.residual);
        assert!(error < within && error < 1.5 * t.residual, "{spec}: {error} {}", t.residual);
    }
}

/// Powers at the horizon and widths are those of the formulas; a reflectance that is no product gets power 0.
#[test]
fn closed_forms_are_found() {
    for (spec, power, widths) in [
        ("ward:ax=0.15,ay=0.4,variant=1992", 0.5, [0.15, 0.4]),
        ("ward:alpha=0.1,variant=duer", 1.0, [0.1; 2]),
        ("minnaert:k=0.65", 0.35, [1.0; 2]),
        ("minnaert:k=1.4", -0.4, [1.0; 2]),
        ("lambert", 0.0, [1.0; 2]),
        ("cook-torrance:m=0.3,f0=1,g=smith", 0.0, [0.3; 2]),
        ("ggx:ax=0.2,ay=0.5", 0.0, [0.2, 0.5]),
        ("dielectric:alpha=0.2,albedo=0.5", 0.0, [0.2; 2]),
        ("lambert:albedo=0", 0.0, [1.0; 2]),
    ] {
        let brdf = parse(spec).expect(spec);
        let form = Form::of(&*brdf, brdf.is_isotropic());
        println!("{spec}: {form:?}");
        assert!((form.grazing - power).abs() < 0.01, "{spec}: {form:?}");
        let near = |(a, b): (f64, f64)| (a / b - 1.0).abs() < 0.3;
        assert!(form.widths.into_iter().zip(widths).all(near), "{spec}: {form:?}");
    }
}

/// Of all solutions that differ by a constant factor between the maps, the one is kept whose largest p is 1.
#[test]
fn factors_stay_within_range() {
    for spec in ["ggx:alpha=0.05", "ward:ax=0.15,ay=0.4,variant=1992"] {
        let t = tables(spec, &[("resolution", "16")]);
        let most = |m: &crate::shared::tables::grid::GridStack, count: usize| {
            let at = |k: usize| m.layer(m.place([(k % 65) as f32 / 64.0, (k / 65) as f32 / 64.0]), 0)[0];
            (0..count).map(at).fold(f32::NEG_INFINITY, f32::max)
        };
        let (p, q) = (most(&t.side, 65 * 65), most(&t.half, 65 * 65));
        assert!(p.abs() < 1e-5 && q.abs() < 20.0, "{spec}: {p} {q}");
    }
}
