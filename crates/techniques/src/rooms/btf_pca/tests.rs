use crate::local::{LocalBake, Place};
use crate::shared::trials::specimens;
use crate::trial::local::{direction, single};
use crate::{BakeError, Material, find_local};
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use steradian_base::{ParamValues, Task};
use steradian_formats::TensorData;
use steradian_relight::btf::{Btf, bonn, spread};

fn bake(spec: &str, map: Option<Btf>, parameters: &str) -> Box<dyn LocalBake> {
    let t = find_local("btf_pca").expect("a technique");
    let params = ParamValues::parse(parameters, t.params()).expect("parameters");
    let mut material = Material::new(steradian_brdf::parse(spec).expect("a spec"));
    if let Some(map) = map {
        material = material.with_apparent(Arc::new(map));
    }
    t.bake(&material, None, &params, &Task::quiet()).expect("bakes")
}

/// With as many components as the function has, every method reproduces it: at the map's directions and texel
/// centres the value itself over π, between lights the cosine, between texels and directions interpolated
/// values; nothing from below.
#[test]
fn maps_are_shaded_as_they_are() {
    let all = spread(6);
    let lights = all.clone();
    let f = move |x: usize, v: usize, l: usize| {
        [0, 1, 2]
            .map(|c| (lights[l].z * (0.2 + 0.1 * (x % 3) as f64 + 0.05 * v as f64 + 0.1 * c as f64)) as f32)
    };
    let map = Btf::of((3, 2), &all, &all, f.clone()).expect("a function");
    for method in ["method=local,clusters=1", "method=view", "method=chained,components=6,halves=64"] {
        let b = bake("lambert", Some(map.clone()), method);
        // A chain's tables of half and difference vectors are between directions.
        let within = if method.contains("chained") { 0.06 } else { 1e-3 };
        assert!(b.certificate().error < within, "{method}: {}", b.certificate().error);
        for k in 0..6 * 36 {
            let (x, v, l) = (k / 36, k / 6 % 6, k % 6);
            let uv = [(x % 3) as f32 / 3.0 + 1.0 / 6.0, (x / 3) as f32 / 2.0 + 0.25];
            let got = b.f_cos_at(Place { uv, footprint: 0.0 }, single(all[l]), single(all[v]));
            let want = f(x, v, l);
            for c in 0..3 {
                let off = (f64::from(got[c]) * PI - f64::from(want[c])).abs();
                assert!(off < within * 0.7, "{method}: {k}: {got:?} {want:?}");
            }
        }
        let lit = |z: f64| {
            let wi = DVec3::new((1.0 - z * z).sqrt(), 0.0, z);
            b.f_cos_at(Place::default(), single(wi), [0.0, 0.0, 1.0])[1]
        };
        if !method.contains("chained") {
            assert!((lit(0.6) / lit(0.9) - 0.6 / 0.9).abs() < 2e-3);
            assert!((lit(0.05) / lit(0.9) - 0.05 / 0.9).abs() < 2e-3);
        }
        assert_eq!(lit(-0.5), 0.0);
        let mean = b.f_cos_at(Place { uv: [0.9, 0.1], footprint: 1.0 }, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]);
        assert!((f64::from(mean[0]) * PI - 0.3).abs() < within, "{method}: {mean:?}");
    }
}

/// The certificate states the error between decoded and original numbers, and falls with components; it does
/// not include interpolation between the file's directions.
#[test]
fn more_components_err_less() {
    let map = |k: usize, method: &str| {
        let p = format!("method={method},clusters=4,components={k}");
        bake("lambert", Some((*specimens::apparent()).clone()), &p).certificate().error
    };
    for method in ["local", "view", "chained"] {
        let [one, more] = [1, 6].map(|k| map(k, method));
        assert!(more < 0.8 * one && one < 1.0, "{method}: {one} {more}");
    }
}

/// Without a map the reflectance is tabulated from 81 views under 81 lights: exact at these, and the
/// certificate states the error in between.
#[test]
fn a_reflectance_is_tabulated() {
    let spec = "ggx:alpha=0.6,f0=0.9/0.6/0.3";
    let brdf = steradian_brdf::parse(spec).expect("a spec");
    let b = bake(spec, None, "method=local");
    let all = bonn();
    for k in 0..300 {
        let (wi, wo) = (all[k * 7 % 81], all[k * 11 % 81]);
        let (got, want) = (b.f_cos(single(wi), single(wo)), brdf.f_cos(wi, wo));
        (0..3).for_each(|c| assert!((f64::from(got[c]) - want[c]).abs() < 2e-3 * want[c] + 2e-4, "{k}"));
    }
    assert!((0.01..0.3).contains(&b.certificate().error), "{}", b.certificate().error);
    let lambert = bake("lambert:albedo=0.5", None, "method=view");
    for k in 0..200 {
        let (wi, wo) = (direction(k, 0.01), direction(3 * k, 0.05));
        let got = f64::from(lambert.f_cos(single(wi), single(wo))[2]);
        assert!((got - 0.5 / PI * wi.z).abs() < 1e-3 * wi.z, "{k}");
    }
}

/// A bake that was saved is the same, to the bit, by every method; tensors of inconsistent shapes are
/// refused.
#[test]
fn saved_functions_come_back() {
    let t = find_local("btf_pca").expect("a technique");
    let map = (*specimens::apparent()).clone();
    for (method, name, other) in [
        ("method=local,clusters=3,components=2", "cluster", [9.0; 3]),
        ("method=view,components=0", "pictures", [1.0; 3]),
        ("method=chained,components=2,halves=7", "corners", [7.0; 3]),
    ] {
        let b = bake("lambert:albedo=0.4", Some(map.clone()), method);
        let saved = b.save().expect("no mesh");
        let again = t.load(&saved, b.brdf().clone()).expect("its own");
        assert!(
            again.is_textured() && again.certificate() == b.certificate() && again.params() == b.params()
        );
        for k in 0..60 {
            let (wi, wo) = (single(direction(k, 0.01)), single(direction(3 * k, 0.1)));
            let at = Place { uv: [0.17 * k as f32, 0.31 * k as f32], footprint: 0.01 * k as f32 };
            assert_eq!(b.f_cos_at(at, wi, wo), again.f_cos_at(at, wi, wo), "{method}: {k}");
        }
        let lost = |name: &str| {
            let mut t = saved.clone();
            t.tensors.remove(name);
            t
        };
        let mut wrong = saved.clone();
        if let Some(x) = wrong.tensors.get_mut(name) {
            match &mut x.data {
                TensorData::U32(v) => v[0] = other[0] as u32,
                _ => x.shape[0] += 1,
            }
        }
        let mut huge = saved.clone();
        if let Some(x) = huge.tensors.get_mut("size") {
            x.data = TensorData::U32(vec![65536, 65536]);
        }
        let mut below = saved.clone();
        if let Some(TensorData::F64(v)) = below.tensors.get_mut("views").map(|x| &mut x.data) {
            v[2] = -v[2];
        }
        for (file, what) in
            [(lost("views"), "views"), (lost(name), name), (wrong, name), (huge, ""), (below, "views")]
        {
            let e = t.load(&file, b.brdf().clone()).err().expect("refused").to_string();
            assert!(e.contains(what) && !e.contains('\n'), "{method}: {e}");
        }
    }
}

/// A cancelled task returns no bake, by any method.
#[test]
fn interrupted_bakes_are_none() {
    let t = find_local("btf_pca").expect("a technique");
    let material =
        Material::new(steradian_brdf::parse("lambert").expect("a spec")).with_apparent(specimens::apparent());
    for method in ["method=local", "method=view", "method=chained"] {
        let params = ParamValues::parse(method, t.params()).expect("parameters");
        let task = Task::quiet().with_cancel(Arc::new(AtomicBool::new(true)));
        let e = t.bake(&material, None, &params, &task).err().expect("interrupted");
        assert!(matches!(e, BakeError::Cancelled(_)), "{method}: {e}");
    }
}
