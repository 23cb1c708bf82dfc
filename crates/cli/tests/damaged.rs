//! Specs and bakes with faults from a fixed seed: refused or used, soon and without a panic.

use std::time::{Duration, Instant};
use steradian_base::{ParamValues, Task};
use steradian_formats::{TensorData, TensorFile};
use steradian_techniques::shared::trials::lights;
use steradian_techniques::{Material, PointsBuf, Radiance, find};
use steradian_testkit::{Mutator, full};

const MOST_TIME: Duration = Duration::from_secs(2);

#[test]
fn damaged_specs_end_well() {
    let specs = [
        "ggx:alpha=0.1,f0=0.9/0.7/0.3",
        "lafortune:cx=-1,cy=-1,cz=0.9,n=20,ks=0.1/0.2/0.3,kd=0.5",
        "lafortune:@skin,scale=0.5",
        "curet:rbrdf.dat,sample=3,angles=a.dat",
        "sgd:gold-metallic-paint",
        "ward:ax=0.1,ay=0.3,variant=duer",
        "oren-nayar:sigma=0.3,albedo=0.8/0.5/0.2,variant=fujii",
    ];
    let mut damage = Mutator::new(1);
    for i in 0..if full() { 2_000_000 } else { 20_000 } {
        let (spec, other) = (specs[i % specs.len()], specs[damage.below(specs.len())]);
        let text = damage.damage(spec.as_bytes(), other.as_bytes());
        let text = String::from_utf8_lossy(&text);
        let start = Instant::now();
        if let Err(e) = steradian_brdf::parse(&text) {
            assert!(!e.to_string().is_empty(), "{text}");
        }
        assert!(start.elapsed() < MOST_TIME, "{text}");
    }
}

/// A bake with one number or word changed.
fn edited(whole: &TensorFile, damage: &mut Mutator) -> TensorFile {
    const VALUES: [f64; 8] = [0.0, -1.0, 0.5, 65504.0, 4294967295.0, -1e30, 1e30, 1e-30];
    let mut file = whole.clone();
    let (entry, value) = (damage.below(file.metadata.len()), VALUES[damage.below(VALUES.len())]);
    let tensor = damage.below(2 * file.tensors.len());
    match file.tensors.values_mut().nth(tensor) {
        None => {
            if let Some(text) = file.metadata.values_mut().nth(entry) {
                *text = String::from_utf8_lossy(&damage.damage(text.as_bytes(), b"-1e39,nan/0")).into_owned();
            }
        }
        Some(x) if damage.below(8) == 0 => x.shape.reverse(),
        Some(x) => {
            let k = damage.below(x.data.len());
            match &mut x.data {
                TensorData::F32(v) => v.iter_mut().skip(k).take(1).for_each(|v| *v = value as f32),
                TensorData::F64(v) => v.iter_mut().skip(k).take(1).for_each(|v| *v = value),
                TensorData::U32(v) => v.iter_mut().skip(k).take(1).for_each(|v| *v = value as u32),
                TensorData::F16(v) => _ = v.pop(),
            }
        }
    }
    file
}

#[test]
fn edited_bakes_end_well() {
    let mut points = PointsBuf::default();
    let up = glam::Vec3::Y;
    points.push(up, glam::Vec3::X, glam::Vec3::new(0.6, 0.8, 0.0), glam::Vec3::ZERO);
    for (slug, spec) in
        [("sh_irradiance", "lambert"), ("lafortune_env", "lafortune:cx=-1,cy=-1,cz=1,n=9,ks=0.3")]
    {
        let t = find(slug).expect("a technique");
        let material = Material::new(steradian_brdf::parse(spec).expect("a spec"));
        let bake = t.bake(&lights::smooth(), &material, None, &ParamValues::default(), &Task::quiet());
        let whole = bake.expect("a bake").save();
        let mut damage = Mutator::new(1);
        for i in 0..if full() { 10_000 } else { 100 } {
            let file = edited(&whole, &mut damage);
            let start = Instant::now();
            if let Ok(b) = t.load(&file) {
                let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0]);
                b.shade(&points.as_points(), &mut Radiance::of(&mut rgb));
            }
            assert!(start.elapsed() < MOST_TIME, "{slug}: edit {i} took {:?}", start.elapsed());
        }
    }
}
