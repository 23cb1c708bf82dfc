//! Checks that need no reference: extremes, shaders, determinism, files, live changes.

use super::harness::*;
use glam::{Mat3, Vec2, Vec3};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};
use steradian_base::{ParamValues, Task};
use steradian_formats::{Limits, Tensor, TensorData, TensorFile, decode_tensors};
use steradian_light::Lights;
use steradian_techniques::shared::trials::lights;
use steradian_techniques::{
    AnyBake, AnyTechnique, BakeError, Check, Material, PointLobe, PointsBuf, Radiance, View, gpu, registry,
};
use steradian_testkit::{Mutator, full, on_every_isa};

/// Poles, axes, cube corners; views at the normal, at grazing, below the horizon.
fn extreme_points() -> PointsBuf {
    let mut q = PointsBuf::default();
    for x in [-1.0f32, 0.0, 1.0] {
        for y in [-1.0f32, 0.0, 1.0] {
            for z in [-1.0f32, 0.0, 1.0] {
                let Some(n) = Vec3::new(x, y, z).try_normalize() else { continue };
                let t = n.any_orthonormal_vector();
                for c in [1.0f32, 0.5, 1e-3, 1e-7, 0.0, -0.5, -1.0] {
                    q.push(n, t, n * c + t * (1.0 - c * c).max(0.0).sqrt(), Vec3::ZERO);
                }
            }
        }
    }
    q
}

#[test]
fn finite_on_extremes() {
    let q = extreme_points();
    for t in techniques(Check::Extremes) {
        let first = t.card().specimens[0];
        // The sharpest and the roughest that the technique takes.
        let more = [["ggx:alpha=0.0001,f0=1", "phong:n=100000"], ["ggx:alpha=1,f0=0", "phong-map:n=0.01"]];
        let takes = |s: &&&str| (t.card().materials)(&*material(s).brdf).is_ok();
        let taken = more.iter().filter_map(|kind| kind.iter().find(takes));
        // Under two texels an error is soon measured.
        let two_texels: Vec<_> = taken.map(|spec| (*spec, draft(t, &light("tiny"), spec, &[]))).collect();
        // Their light alone is replaced, for the sharpest always.
        let many = if full() { two_texels.len() } else { 1 };
        let bright = |(spec, b): &(&'static str, Box<dyn AnyBake>)| (*spec, relit(&**b, &light("bright")));
        let extremes: Vec<_> = two_texels.iter().take(many).map(bright).collect();
        let dark = relit(shared(t, "tiny", first), &Lights::default());
        let usual = [shared(t, "bright", first), &*dark, shared(t, "tiny", first)].map(|b| (first, b));
        let two_texels = two_texels.iter().map(|(spec, b)| (*spec, &**b));
        let measured = |(spec, b): (&str, &dyn AnyBake)| {
            assert!(certified(b).error.is_finite(), "{}: {spec}", t.card().slug);
        };
        two_texels.clone().take(many).for_each(measured);
        usual[..if full() { 3 } else { 2 }].iter().copied().for_each(measured);
        for (spec, b) in extremes.iter().map(|(spec, b)| (*spec, &**b)).chain(two_texels).chain(usual) {
            let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
            b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
            for i in 0..q.len() {
                let facing: f32 = (0..3).map(|k| q.n[k][i] * q.wo[k][i]).sum();
                for c in &rgb {
                    assert!(c[i].is_finite(), "{}: {spec}: point {i}: {}", t.card().slug, c[i]);
                    assert!(facing > 0.0 || c[i] == 0.0, "{}: light from behind", t.card().slug);
                }
            }
        }
    }
}

#[test]
fn batches_that_do_not_fit_give_zero() {
    let q = extreme_points();
    for t in registry() {
        let b = shared(*t, "tiny", t.card().specimens[0]);
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![1.0; 5]);
        b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
        assert!(rgb.iter().flatten().all(|x| *x == 0.0));
    }
}

/// Batches that fill no register, or just more than one, shade each point as if it were alone.
#[test]
fn every_length_of_a_batch_shades_the_same() {
    on_every_isa(|| {
        let mut q = extreme_points();
        // A lobe of its own for every second half of the batch, so that both of a technique's loops run.
        let varied = PointLobe { spread: [4e-3, 1e-3, 2e-3], ..PointLobe::PLAIN };
        for t in registry() {
            let b = shared(*t, "tiny", t.card().specimens[0]);
            for lobes in [false, true] {
                q.lobe = varied.to_array().map(|x| vec![x; if lobes { q.len() } else { 0 }]);
                let shade = |range: std::ops::Range<usize>| {
                    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; range.len()]);
                    b.shade(&q.slice(range), &mut Radiance::of(&mut rgb));
                    rgb
                };
                let alone: Vec<[u32; 3]> =
                    (0..q.len()).map(|i| shade(i..i + 1).map(|c| c[0].to_bits())).collect();
                for n in [0, 1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 31, 32, 33, 65] {
                    let rgb = shade(3..3 + n);
                    for i in 0..n {
                        let got = [0, 1, 2].map(|c| rgb[c][i].to_bits());
                        assert_eq!(got, alone[3 + i], "{}: {n} points, {i}, {lobes}", t.card().slug);
                    }
                }
            }
        }
    });
}

/// Every technique's module is valid WGSL. Whether it computes the same numbers is tested on a GPU, in the
/// tests of `gpu`.
#[test]
fn shaders_are_valid() {
    for t in techniques(Check::Shader) {
        // Under a sun techniques that take it apart have its functions too.
        let sunny = tried(t).filter(|(_, lights)| lights.contains(&"sunny")).map(|(spec, _)| ("sunny", spec));
        let constant = t.card().specimens.iter().map(|spec| ("furnace", *spec));
        for technique in constant.chain(sunny).map(|(name, spec)| shared(t, name, spec).gpu()) {
            let text = gpu::module(&technique);
            let module = naga::front::wgsl::parse_str(&text)
                .unwrap_or_else(|e| panic!("{}:\n{}", technique.slug, e.emit_to_string(&text)));
            let mut validator = naga::valid::Validator::new(
                naga::valid::ValidationFlags::all(),
                // Halves in buffers.
                naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32,
            );
            let valid = validator.validate(&module);
            assert!(valid.is_ok(), "{}: {:?}", technique.slug, valid.err());
            for t in &technique.tables {
                let texels = t.level.width * t.level.height * t.level.layers;
                assert_eq!(t.level.bytes.len(), texels * t.format.bytes(), "{}", t.name);
            }
        }
        println!("{}: shader valid; CPU = WGSL is compared by the gpu crate, with an adapter", t.card().slug);
    }
}

/// Techniques that use only the mean of the light, whose result does not change when the light is rotated.
const TURNLESS: [&str; 1] = ["ambient"];

/// A running picture gets a frame's uniforms alone: everything else of the technique stays.
#[test]
fn a_frame_changes_what_it_says_and_no_more() {
    for t in registry() {
        let made = shared(*t, "bright", t.card().specimens[0]);
        let mut b = t.load(&made.save()).expect("its own bake");
        let before = [Some(b.gpu()), b.gpu_varied()];
        let light_rotation = Mat3::from_rotation_y(0.8) * Mat3::from_rotation_x(0.4);
        b.frame(&View { light_rotation, eye: Vec3::new(1.0, 2.0, 3.0), ..View::default() });
        let Some(changed) = b.gpu_frame() else { continue };
        for (before, after) in before.into_iter().zip([Some(b.gpu()), b.gpu_varied()]) {
            let (Some(mut live), Some(after)) = (before, after) else { continue };
            let turnless = TURNLESS.contains(&after.slug);
            assert_eq!(live.uniforms == after.uniforms, turnless, "{}", after.slug);
            live.set_uniforms(&changed);
            assert!(live == after, "{}: a frame changes more than gpu_frame says", after.slug);
        }
    }
}

#[test]
fn bakes_are_bit_identical_whatever_the_thread_count() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    for t in techniques(Check::Determinism) {
        let spec = t.card().specimens[0];
        let saved = |b: &dyn AnyBake| {
            certified(b);
            b.save()
        };
        let many = saved(shared(t, "sunny", spec));
        let single = one.install(|| saved(&*draft(t, &light("sunny"), spec, &[])));
        assert!(many == single, "{}", t.card().slug);
    }
}

fn round_trip(t: &dyn AnyTechnique, b: &dyn AnyBake) -> Box<dyn AnyBake> {
    let mut bytes = Vec::new();
    b.save().encode(&mut bytes).expect("memory takes it");
    let file = decode_tensors(Path::new("bake.safetensors"), &bytes, &Limits::default()).expect("own file");
    t.load(&file).expect("own file")
}

#[test]
fn saved_and_loaded_it_shades_the_same_bits() {
    let points = points(300);
    for t in techniques(Check::RoundTrip) {
        for (spec, lights) in tried(t) {
            let b = shared(t, lights[lights.len() - 1], spec);
            certified(b);
            let mut loaded = round_trip(t, b);
            assert_eq!(shade(&*loaded, &points), shade(b, &points), "{}: {spec}", t.card().slug);
            assert_eq!(loaded.certificate(), b.certificate());
            assert_eq!(loaded.params(), b.params());
            assert_eq!(loaded.bytes(), b.bytes());
            // A loaded bake still takes another material, whatever its own was.
            if spec == t.card().specimens[0] {
                let again = loaded.preview(None, Some(&material(spec)), &Task::quiet());
                loaded = again.expect("its own specimen");
                assert_eq!(shade(&*loaded, &points), shade(b, &points), "{}: {spec}", t.card().slug);
            }
        }
    }
}

#[test]
fn foreign_and_damaged_bakes_are_refused() {
    for t in registry() {
        let whole = shared(*t, "tiny", t.card().specimens[0]).save();
        for other in registry().iter().filter(|o| o.card().slug != t.card().slug) {
            assert!(matches!(other.load(&whole), Err(BakeError::Load { .. })));
        }
        for name in whole.tensors.keys() {
            let mut file = whole.clone();
            file.tensors.remove(name);
            // Light without an image is a light, hence the exception.
            assert!(t.load(&file).is_err() || name.ends_with(".base"), "{}: {name}", t.card().slug);
            let mut file = whole.clone();
            if let Some(x) = file.tensors.get_mut(name) {
                x.shape = vec![1, 1];
            }
            assert!(t.load(&file).is_err(), "{}: {name}", t.card().slug);
        }
    }
}

/// Numbers that a hostile file may hold.
const HOSTILE: [f64; 9] = [0.0, -1.0, 0.5, 65504.0, 1e9, 4294967295.0, -1e30, 1e38, 1e-30];

fn put(data: &mut TensorData, value: f64, which: impl Fn(usize) -> bool) {
    match data {
        TensorData::F32(v) => (0..v.len()).filter(|k| which(*k)).for_each(|k| v[k] = value as f32),
        TensorData::F64(v) => (0..v.len()).filter(|k| which(*k)).for_each(|k| v[k] = value),
        TensorData::U32(v) => (0..v.len()).filter(|k| which(*k)).for_each(|k| v[k] = value as u32),
        TensorData::I8(v) => (0..v.len()).filter(|k| which(*k)).for_each(|k| v[k] = value as i8),
        TensorData::F16(v) => {
            let half = half::f16::from_f64(value);
            (0..v.len()).filter(|k| which(*k)).for_each(|k| v[k] = half);
        }
    }
}

/// Bakes with a tensor filled with one number or given another shape, then with single numbers and words
/// changed.
fn edited(whole: &TensorFile, singles: usize) -> Vec<(String, TensorFile)> {
    let mut all = Vec::new();
    for (name, tensor) in &whole.tensors {
        let mut add = |what: String, change: &dyn Fn(&mut Tensor)| {
            let mut file = whole.clone();
            file.tensors.get_mut(name).into_iter().for_each(change);
            all.push((format!("{name} {what}"), file));
        };
        for value in [0.0, -1.0, 1e9, -1e30, 1e38] {
            add(format!("all {value}"), &|t| put(&mut t.data, value, |_| true));
        }
        let n: usize = tensor.shape.iter().product();
        add("reversed".into(), &|t| t.shape.reverse());
        for k in 0..tensor.shape.len() {
            // One extent changed, all others 1.
            add(format!("along {k}"), &|t| {
                t.shape.iter_mut().enumerate().for_each(|(i, x)| *x = if i == k { n } else { 1 })
            });
        }
    }
    let mut damage = Mutator::new(1);
    for single in 0..singles {
        let mut file = whole.clone();
        let (entry, value) = (damage.below(file.metadata.len()), HOSTILE[damage.below(HOSTILE.len())]);
        let tensor = damage.below(2 * file.tensors.len());
        match file.tensors.values_mut().nth(tensor) {
            None => {
                if let Some(text) = file.metadata.values_mut().nth(entry) {
                    *text =
                        String::from_utf8_lossy(&damage.damage(text.as_bytes(), b"-1e39,nan/0")).into_owned();
                }
            }
            Some(x) => {
                let at = damage.below(x.shape.iter().product());
                put(&mut x.data, value, |k| k == at);
            }
        }
        all.push((format!("edit {single}"), file));
    }
    all
}

/// A bake whose file was edited is refused or shaded, quickly and without a panic.
#[test]
fn edited_bakes_end_well() {
    // Time limit of shading two points, on a machine that is busy.
    const MOST_TIME: Duration = Duration::from_secs(5);
    let mut faults = Vec::new();
    let mut q = PointsBuf::default();
    for (n, wo) in [(Vec3::Y, Vec3::new(0.6, 0.8, 0.0)), (Vec3::X, Vec3::new(0.05, 0.0, 1.0).normalize())] {
        q.push(n, n.any_orthonormal_vector(), wo, Vec3::ZERO);
        q.locate(Vec2::ZERO, [0, 1, 2], [0.3, 0.3]);
    }
    for t in registry() {
        let slug = t.card().slug;
        // The last specimen is the one with the most parts.
        let spec = t.card().specimens[t.card().specimens.len() - 1];
        let whole = shared(*t, "tiny", spec).save();
        for (what, file) in edited(&whole, if full() { 10_000 } else { 12 }) {
            let start = Instant::now();
            let end = catch_unwind(AssertUnwindSafe(|| {
                let Ok(mut b) = t.load(&file) else { return };
                let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
                b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
                b.frame(&View { light_rotation: Mat3::from_rotation_y(0.5), ..View::default() });
                b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
            }));
            if end.is_err() || start.elapsed() > MOST_TIME {
                faults.push(format!(
                    "{slug}: {what}: {} after {:?}",
                    if end.is_err() { "panics" } else { "ends" },
                    start.elapsed()
                ));
            }
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

/// Views of one bake have frames of their own.
#[test]
fn several_views_share_a_bake() {
    let points = points(60);
    let view = |angle| View { light_rotation: Mat3::from_rotation_y(angle), ..View::default() };
    for t in registry() {
        let made = shared(*t, "tiny", t.card().specimens[0]);
        let mut b = made.preview(Some(&lights::quadratic()), None, &Task::quiet()).expect("a light");
        let (one, other) = (b.with_view(&view(0.5)), b.with_view(&view(2.0)));
        let (first, second) = (shade(&*one, &points), shade(&*other, &points));
        assert_eq!(first == second, TURNLESS.contains(&t.card().slug), "{}", t.card().slug);
        b.frame(&view(2.0));
        assert_eq!((shade(&*one, &points), shade(&*b, &points)), (first, second), "{}", t.card().slug);
    }
}

/// A changed factor rebaked alone gives what a whole bake gives.
#[test]
fn a_changed_factor_rebakes_alone() {
    let points = points(300);
    for t in registry() {
        let specs = t.card().specimens;
        let (first, last) = (specs[0], specs[specs.len() - 1]);
        let old = shared(*t, "studio", first);
        let before = shade(old, &points);
        let mut b = old.preview(None, Some(&material(last)), &Task::quiet()).expect("a specimen");
        b = b.with_light(&lights::smooth(), &Task::quiet()).expect("a light");
        assert_eq!(shade(old, &points), before, "{}: the old bake shades on", t.card().slug);
        let fresh = &*draft(*t, &light("smooth"), last, &[]);
        assert_eq!(shade(&*b, &points), shade(fresh, &points), "{}", t.card().slug);
        assert_eq!(b.certificate(), certified(fresh));
        // The bakes that the checks share are made by another way.
        assert_eq!(shade(shared(*t, "smooth", last), &points), shade(fresh, &points), "{}", t.card().slug);
        // Refused: the bake stays as it was.
        let foreign =
            ["oren-nayar:sigma=0.3", "ggx:ax=0.1,ay=0.4,f0=1", "kajiya-kay:s=10000000"].map(material);
        let refused = |m: &&Material| (t.card().materials)(&*m.brdf).is_err();
        // One fits every reflectance.
        let Some(m) = foreign.iter().find(refused) else {
            assert_eq!(t.card().slug, "gaussian_lobes");
            continue;
        };
        assert!(b.with_material(m, &Task::quiet()).is_err());
        assert_eq!(shade(&*b, &points), shade(fresh, &points));
    }
}

#[test]
fn memory_limits_and_cancellation_come_first() {
    for t in registry() {
        let m = material(t.card().specimens[0]);
        let values = ParamValues::default();
        let ball = t.card().needs.sites.then(|| around(&[]));
        let stopped = Task::quiet().with_cancel(Arc::new(true.into()));
        let e = t.bake(&lights::studio(), &m, ball.as_ref(), &values, &stopped);
        assert!(matches!(e, Err(BakeError::Cancelled(_))) || e.is_ok(), "{}", t.card().slug);
        let small = Task::quiet().with_max_memory(1000);
        let e = t.bake(&lights::studio(), &m, ball.as_ref(), &values, &small);
        assert!(matches!(e, Err(BakeError::Memory { .. })) || e.is_ok(), "{}", t.card().slug);
    }
}
