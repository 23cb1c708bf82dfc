use super::errors::{ratio, upper};
use super::*;
use steradian_base::Evidence;
use steradian_brdf::parse;
use steradian_light::{DiskLight, Lights};
use steradian_prefilter::SmallLight;

/// Where errors are independent of each other, the stated error is above that of the whole population in
/// nearly all samples, and not by much.
#[test]
fn the_stated_error_is_an_upper_one() {
    let random = |k: usize| (k as f64 * 0.618_033_988).fract().mul_add(12.9898, 0.3).sin().abs();
    let (mut below, mut sum) = (0, 0.0);
    for s in 0..200 {
        let sample = |k: usize| {
            let u = random(7919 * (s * PROBES + k));
            ProbeSample { weight: 1.0, degrees: 0.0, shaded: [1.0 + 0.1 * u * u; 3], exact: [1.0; 3] }
        };
        let samples: Vec<ProbeSample> = (0..PROBES).map(sample).collect();
        let samples: Vec<&ProbeSample> = samples.iter().collect();
        let (stated, mean) = (upper(&samples), ratio(&samples).0.sqrt());
        assert!(stated > mean);
        sum += stated / mean / 200.0;
        let all = (0..40_000).map(|k| random(k).powi(4)).sum::<f64>() / 40_000.0;
        below += usize::from(stated < 0.1 * all.sqrt());
    }
    assert!(below < 12 && sum < 1.2, "{below} {sum}");
}

/// Lobes about a point are compared at all probes, a ridge that is far longer than wide at fewer.
#[test]
fn expensive_reflectance_is_probed_at_fewer_points() {
    let image = crate::shared::trials::lights::furnace().environment.unwrap().image.clone();
    let tree = Tree::new(Some(&image), &[], &Task::quiet()).unwrap();
    let probes = |lobe: Lobe| {
        let m =
            Model { whole: true, lobes: Box::new(move |_| vec![lobe]), f_cos: one_by_one(|_, _| [1.0; 3]) };
        affordable(&tree, &m, &Task::quiet()).unwrap()
    };
    assert_eq!(probes(Lobe::Axis { axis: DVec3::Z, width: 0.003 }), PROBES);
    let ridge = probes(Lobe::Arc { normal: DVec3::X, width: 0.003 });
    assert!((FEWEST..PROBES).contains(&ridge), "{ridge}");
}

/// Chords decide as the angles do, but for the error of the angles themselves.
#[test]
fn a_ridge_reaches_what_its_scale_says() {
    let frame = Frame::from_normal(DVec3::new(0.3, 0.5, -0.2).normalize());
    let axis = DVec3::new(0.1, -0.4, 0.7).normalize();
    for lobe in [Lobe::Axis { axis, width: 0.02 }, Lobe::Cone { axis, cosine: 0.4, width: 0.02 }] {
        let ridge = Ridge::new(&lobe, &frame);
        for (k, needed) in (0..3000).flat_map(|k| [0.01, 0.05, 0.3, 0.6].map(|n| (k, n))) {
            let d = steradian_prefilter::probe::direction(k, 3000);
            let scale = ridge.scale(d);
            let near = (scale - needed).abs() < 4e-4;
            assert!(
                near || ridge.scale_reaches(d, needed) == (scale >= needed),
                "{lobe:?} {d} {needed} {scale}"
            );
        }
    }
}

#[test]
fn ridges_that_take_hours_are_refused() {
    let of = |spec: &str| measurable(&*parse(spec).unwrap());
    for spec in ["banks:n=1e5", "banks-map:n=30", "kajiya-kay:s=1e5", "ggx:alpha=1e-4", "phong:n=1e8"] {
        assert_eq!(of(spec), Ok(()), "{spec}");
    }
    for spec in ["banks:n=1e6", "banks-map:n=1e8", "kajiya-kay:s=1e6", "kajiya-kay:s=1e8"] {
        let why = of(spec).unwrap_err();
        assert!(why.contains("use a smaller exponent") && !why.contains('\n'), "{why}");
    }
}

/// A technique that misses a small sun altogether has as its error the sun's share of the mean square, which
/// is nearly all; among the probes that see no sun its error is zero.
#[test]
fn what_a_sun_decides_is_stated() {
    let brdf = parse("ggx:alpha=0.1,f0=0.9").unwrap();
    let direction = DVec3::new(0.3, 0.8, -0.5).normalize();
    let sun = DiskLight { direction, angular_radius: 0.004, radiance: [3e4; 3] };
    let sky = crate::shared::trials::lights::smooth();
    let lights = Lights { disks: vec![sun], ..sky.clone() };
    let image = |l: &Lights| l.environment.as_ref().map(|e| e.image.clone());
    let [tree, dark] = [&lights, &sky].map(|l| {
        let suns: Vec<SmallLight> = l.disks.iter().map(SmallLight::from).collect();
        Tree::new(image(l).as_ref(), &suns, &Task::quiet()).unwrap()
    });
    let m = Model::of(&*brdf);
    let blind = by_integrals(&dark, &m, 1.0);
    let seen = Target::Integral(Model::of(&*brdf)).errors(&tree, &Task::quiet(), &blind).unwrap();
    assert!((0.8..1.0).contains(&seen.mean) && (0.85..1.1).contains(&seen.all), "{seen:?}");
    // Most points see no sun, as the errors of single points show.
    let s = seen.spread;
    assert!(s.median < 0.02 && s.stops < 1.0 && s.top_hundredth > 0.9, "{s:?}");
    // A computed error is clamped between the measured error and its upper bound.
    let mut stated = [0.1, 0.5 * (seen.mean + seen.all), 2.0]
        .map(|error| seen.certificate(&Report::estimated(error, Vec::new())).error);
    let c = seen.certificate(&Report::default());
    assert!(c.error == seen.all && c.elevations.len() == 5 && c.elevations[1].known == Evidence::Measured);
    assert!(stated[0] == seen.least && seen.least < seen.mean && stated[2] == seen.all, "{stated:?}");
    stated.sort_by(f64::total_cmp);
    assert!(stated[0] < stated[1] && stated[1] < stated[2], "{stated:?}");
    let plain = probes::all(PROBES, 0.0, &dark, &m.lobes);
    let same = compare(&plain, &|_, p, coarser| radiance(&dark, &m, p, coarser), &[], &Task::quiet(), &blind)
        .unwrap();
    assert!(plain.len() == PROBES + PROBES / 4 && same.all < 1e-6, "{same:?}");
}

/// Shading by integrals, times a factor.
fn by_integrals<'a>(
    tree: &'a Tree,
    m: &'a Model<'_>,
    factor: f64,
) -> impl Fn(&crate::Points<'_>, &mut Radiance<'_>) + Sync + 'a {
    move |q, out| {
        for i in 0..q.len() {
            let at = |v: &[&[f32]; 3]| DVec3::from_array(v.map(|c| f64::from(c[i])));
            let frame = Frame::from_normal_tangent(at(&q.n), at(&q.t));
            let l = radiance(tree, m, &Probe { frame, wo: frame.to_local(at(&q.wo)), weight: 1.0 }, 1.0);
            (0..3).for_each(|c| out.rgb[c][i] = (factor * l[c]) as f32);
        }
    }
}

/// Shading that is off by a known factor has that error, whether it is large, and measured by coarse
/// integrals for the most part, or small, and measured by precise ones.
#[test]
fn integrals_are_as_precise_as_the_error_needs() {
    let lights = crate::shared::trials::lights::sunny();
    let tree = crate::shared::light::distant::tree(&lights, &Task::quiet()).unwrap();
    for spec in ["ggx:alpha=0.1,f0=0.9", "oren-nayar:sigma=0.4"] {
        let brdf = parse(spec).unwrap();
        let m = Model::of(&*brdf);
        let probes = probes::all(PROBES, 0.0, &tree, &m.lobes);
        for (off, all) in [(0.1, false), (1e-3, true)] {
            let precise = AtomicU64::new(0);
            let exact = |_: usize, p: &Probe, coarser: f64| {
                precise.fetch_add(u64::from(coarser == 1.0), Ordering::Relaxed);
                radiance(&tree, &m, p, coarser)
            };
            let e =
                compare(&probes, &exact, &[], &Task::quiet(), &by_integrals(&tree, &m, 1.0 + off)).unwrap();
            assert!((e.mean / off - 1.0).abs() < 0.02, "{spec}: {off} {e:?}");
            let precise = precise.into_inner() as usize;
            let right = if all { precise == probes.len() } else { precise < probes.len() / 7 };
            assert!(right, "{spec}: {off}: {precise} of {}", probes.len());
        }
    }
}
