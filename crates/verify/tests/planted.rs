//! Faults planted in right files: each is named, or the report says that nothing explains it; no false cause
//! is named.

#![expect(clippy::print_stdout, reason = "the score table of the plants")]

#[path = "planted/bake.rs"]
mod bake;

use bake::{bake, lights, moved, reduced, turned, values};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;
use std::time::Instant;
use steradian_base::Task;
use steradian_engines::Curve;
use steradian_formats::{linear_to_srgb, srgb_to_linear};
use steradian_light::load::Profile;
use steradian_sphere::SphereImage;
use steradian_testkit::full;
use steradian_verify::laws::{Law, Rule, Slip};
use steradian_verify::orientation::Orientation;
use steradian_verify::{Alteration, Encoding, Family, Fault, Input, Kernel, Report, Scale, check};

const SIDE: usize = 16;
const LEVELS: usize = 3;

/// The kernels of a list of perceptual roughness.
fn list(r: impl Fn(usize) -> f64) -> Vec<Kernel> {
    (0..LEVELS).map(|m| Kernel::at(Family::Ggx, r(m))).collect()
}

fn linear() -> Vec<Kernel> {
    list(|m| Curve::Linear.roughness(m, LEVELS - 1))
}

fn verify(levels: &[SphereImage], light: &SphereImage) -> Report {
    let input = Input {
        levels,
        expected: &linear(),
        law: Law::Roughness(Curve::Linear),
        lights: &lights(light),
        read: Profile::own(),
        step: 0.0,
    };
    check(&input, &Task::quiet()).expect("is not cancelled")
}

type Judge = Box<dyn Fn(&[Fault]) -> bool>;

/// One planted fault: its name, the levels, and whether faults name it.
struct Plant {
    name: String,
    levels: Vec<SphereImage>,
    named: Judge,
}

fn plant(
    name: impl Into<String>,
    levels: Vec<SphereImage>,
    named: impl Fn(&[Fault]) -> bool + 'static,
) -> Plant {
    Plant { name: name.into(), levels, named: Box::new(named) }
}

/// Is there exactly one fault, apart from [`Fault::Remains`], and does it fit?
fn one(faults: &[Fault], fits: impl Fn(&Fault) -> bool) -> bool {
    let rest: Vec<&Fault> = faults.iter().filter(|f| !matches!(f, Fault::Remains(_))).collect();
    rest.len() == 1 && fits(rest[0])
}

/// Light that was altered before it was filtered.
fn of_light(light: &SphereImage) -> Vec<Plant> {
    let mut out = Vec::new();
    for factor in [2, 4, 8] {
        for means in [true, false] {
            let levels = bake(&reduced(light, factor, means), &linear(), SIDE);
            let right = move |f: &[Fault]| {
                one(f, |f| matches!(f, Fault::Light(Alteration::Reduced { factor: g, .. }) if *g == factor))
            };
            out.push(plant(
                format!("reduced {factor} {}", if means { "means" } else { "texels" }),
                levels,
                right,
            ));
        }
    }
    let peak = f64::from(light.planes.iter().flatten().fold(0.0f32, |m, v| m.max(*v)));
    for part in [0.5, 0.1, 0.02] {
        let c = peak * part;
        let mut clipped = light.clone();
        clipped.planes.iter_mut().flatten().for_each(|v| *v = v.min(c as f32));
        let levels = bake(&clipped, &linear(), SIDE);
        out.push(plant(format!("clipped at {part} of its peak"), levels, move |f| {
            one(
                f,
                |f| matches!(f, Fault::Light(Alteration::Clipped(at)) if (at / c).ln().abs() < 1.3f64.ln()),
            )
        }));
    }
    out
}

fn of_kernels(light: &SphereImage) -> Vec<Plant> {
    let mut out = Vec::new();
    let last = LEVELS - 1;
    let curves: [(&str, Vec<Kernel>); 8] = [
        ("alpha = m/L", list(|m| (m as f64 / last as f64).sqrt())),
        ("sqrt", list(|m| Curve::Sqrt.roughness(m, last))),
        ("squared twice", list(|m| (m as f64 / last as f64).powi(2))),
        ("one more level, without its last", list(|m| m as f64 / LEVELS as f64)),
        ("one more level, without its first", list(|m| (m + 1) as f64 / LEVELS as f64)),
        ("off by one up", list(|m| ((m + 1) as f64 / last as f64).min(1.0))),
        ("off by one down", list(|m| m.saturating_sub(1) as f64 / last as f64)),
        ("level 1 of another roughness", list(|m| if m == 1 { 0.4 } else { m as f64 / last as f64 })),
    ];
    for (k, (name, kernels)) in curves.into_iter().enumerate() {
        let rule = [
            Some(Rule::RoughnessAsAlpha(Curve::Linear)),
            Some(Rule::Curve(Curve::Sqrt)),
            Some(Rule::AlphaAsRoughness(Curve::Linear)),
            Some(Rule::Counted(Slip::OneMoreWithoutLast)),
            Some(Rule::Counted(Slip::OneMoreWithoutFirst)),
            Some(Rule::Counted(Slip::AsNext)),
            Some(Rule::Counted(Slip::AsBefore)),
            None,
        ][k];
        let levels = bake(light, &kernels, SIDE);
        out.push(plant(name, levels, move |f| {
            one(f, |f| match f {
                Fault::Curve(found) => rule == Some(*found),
                // The kernels reported are correct too.
                Fault::Kernels(found) => found.iter().all(|(m, k)| {
                    let (r, want) = (k.roughness().unwrap_or(9.0), kernels[*m].roughness().unwrap_or(9.0));
                    matches!(k.family, Family::Ggx | Family::None) && (r - want).abs() < 0.02 + 0.04 * want
                }),
                _ => false,
            })
        }));
    }
    /// A name, the family, and its width for GGX's α.
    type Wrong = (&'static str, Family, fn(f64) -> f64);
    let families: [Wrong; 6] = [
        ("beckmann", Family::Beckmann, |a| a),
        ("phong", Family::Phong, |a| 2.0 / (a * a) - 1.0),
        ("gaussian", Family::Gaussian, |a| 1.2 * a),
        ("ggx without cosine", Family::GgxPlain, |a| a),
        ("charlie", Family::Charlie, |a| a.max(0.02)),
        ("lambert", Family::Lambert, |_| 0.0),
    ];
    for (name, family, width) in families {
        let kernel = |k: Kernel| if k == Kernel::NONE { k } else { Kernel { family, width: width(k.width) } };
        let kernels: Vec<Kernel> = linear().into_iter().map(kernel).collect();
        out.push(plant(name, bake(light, &kernels, SIDE), move |f| {
            one(f, |f| matches!(f, Fault::Kernels(found) if found.iter().all(|(_, k)| k.family == family)))
        }));
    }
    let mut boxes = bake(light, &linear(), SIDE);
    for m in 1..LEVELS {
        let finer = boxes[m - 1].clone();
        let level = &mut boxes[m];
        let n = level.width;
        for k in 0..6 * n * n {
            let (f, j, i) = (k / (n * n), k / n % n, k % n);
            for c in 0..3 {
                let at = |a: usize, b: usize| finer.planes[c][finer.index(f, 2 * i + a, 2 * j + b)];
                level.planes[c][k] = 0.25 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1));
            }
        }
    }
    out.push(plant("box mips", boxes, |f| {
        one(f, |f| matches!(f, Fault::Kernels(found) if found.iter().all(|(_, k)| k.family == Family::Box)))
    }));
    out
}

fn of_values(good: &[SphereImage]) -> Vec<Plant> {
    let gain = |g: f64| values(good, |_, v| v.map(|v| v * g as f32));
    let is_gain = |g: f64| {
        move |f: &[Fault]| {
            one(f, |f| matches!(f, Fault::Scale(Scale::Gain(x), _) if (x / g - 1.0).abs() < 0.01))
        }
    };
    let mut out = vec![
        plant("times pi", gain(PI), is_gain(PI)),
        plant("over pi", gain(1.0 / PI), is_gain(1.0 / PI)),
        plant("+2 EV", gain(4.0), is_gain(4.0)),
        plant("times 0.9", gain(0.9), is_gain(0.9)),
    ];
    let colour = [1.0, 0.78, 0.34];
    let levels = values(good, |_, v| std::array::from_fn(|c| v[c] * colour[c] as f32));
    out.push(plant("a colour", levels, move |f| {
        one(f, |f| matches!(f, Fault::Scale(Scale::Colour(s), _) if (0..3).all(|c| (s[c] / colour[c] - 1.0).abs() < 0.01)))
    }));
    let levels = values(good, |m, v| {
        let alpha = (m as f64 / (LEVELS - 1) as f64).powi(2);
        let g = if m == 0 {
            (1.0, 0.0)
        } else {
            let d = steradian_brdf::dfg::ggx(1.0, alpha);
            (d.scale, d.bias)
        };
        v.map(|v| v * (0.9 * g.0 + g.1) as f32)
    });
    out.push(plant("F0 = 0.9 baked in", levels, |f| {
        one(f, |f| matches!(f, Fault::Scale(Scale::Reflectance(x), _) if x.iter().all(|x| (x - 0.9).abs() < 0.02)))
    }));
    for (name, order) in [("red and blue", [2, 1, 0]), ("red and green", [1, 0, 2]), ("rolled", [1, 2, 0])] {
        let levels = values(good, |_, v| order.map(|c: usize| v[c]));
        out.push(plant(format!("channels: {name}"), levels, move |f| {
            one(f, |f| *f == Fault::Channels(order))
        }));
    }
    out.push(plant("sRGB-encoded", values(good, |_, v| v.map(linear_to_srgb)), |f| {
        one(f, |f| *f == Fault::Encoded(Encoding::Encoded))
    }));
    out.push(plant(
        "sRGB-encoded and clipped at 1",
        values(good, |_, v| v.map(|v| linear_to_srgb(v.min(1.0)))),
        |f| {
            f.contains(&Fault::Encoded(Encoding::Encoded))
                && f.iter()
                    .all(|f| matches!(f, Fault::Encoded(_) | Fault::Limited { .. } | Fault::Remains(_)))
        },
    ));
    out.push(plant("decoded twice", values(good, |_, v| v.map(srgb_to_linear)), |f| {
        one(f, |f| *f == Fault::Encoded(Encoding::Decoded))
    }));
    out.push(plant(
        "8 bits, clipped at 1",
        values(good, |_, v| v.map(|v| (v.min(1.0) * 255.0).round() / 255.0)),
        |f| f.iter().all(|f| matches!(f, Fault::Limited { .. } | Fault::Coarse(..))),
    ));
    let rgbe = |v: [f32; 3]| {
        let e = v.iter().fold(1e-9f32, |m, v| m.max(*v)).log2().floor() as i32 + 1;
        let unit = 2f32.powi(e - 8);
        v.map(|v| ((v / unit).floor() + 0.5) * unit)
    };
    out.push(plant("RGBE", values(good, |_, v| rgbe(v)), |f| f.is_empty()));
    out.push(plant("half floats", values(good, |_, v| v.map(|v| (v * 1024.0).round() / 1024.0)), |f| {
        f.is_empty()
    }));
    out.push(plant("no fault", good.to_vec(), |f| f.is_empty()));
    out
}

fn of_texels(good: &[SphereImage]) -> Vec<Plant> {
    let mut out = Vec::new();
    for size in [0.1, 0.3] {
        let mut random = bake::Random(3);
        let mut normal = || (0..6).map(|_| random.draw() - 0.5).sum::<f64>() * 2f64.sqrt();
        let levels = values(good, |m, v| {
            if m == 0 {
                v
            } else {
                let g = (size * normal()).exp() as f32;
                v.map(|v| v * g)
            }
        });
        out.push(plant(format!("noise of {size}"), levels, |f| one(f, |f| matches!(f, Fault::Noise(_)))));
    }
    let mut seams = good.to_vec();
    for level in &mut seams {
        let n = level.width;
        for k in 0..6 * n * n {
            let (i, j) = (k % n, k / n % n);
            if i == 0 || j == 0 || i + 1 == n || j + 1 == n {
                (0..3).for_each(|c| level.planes[c][k] *= 0.8);
            }
        }
    }
    out.push(plant("seams", seams, |f| one(f, |f| matches!(f, Fault::Seams(_)))));
    let damaged = |value: f32| {
        let mut levels = good.to_vec();
        for k in [17, 400, 401, 1200] {
            (0..3).for_each(|c| levels[0].planes[c][k] = value);
        }
        (0..3).for_each(|c| levels[2].planes[c][55] = value);
        levels
    };
    out.push(plant("not a number", damaged(f32::NAN), |f| {
        f.iter().all(|f| matches!(f, Fault::Damaged { invalid, black: 0, .. } if *invalid > 0))
            && f.len() == 2
    }));
    out.push(plant("black texels", damaged(0.0), |f| {
        f.iter().all(|f| matches!(f, Fault::Damaged { invalid: 0, .. })) && !f.is_empty()
    }));
    out
}

fn of_turns(good: &[SphereImage], light: &SphereImage) -> Vec<Plant> {
    let mut out = Vec::new();
    let axes = |g: DMat3| {
        move |f: &[Fault]| {
            one(f, |f| matches!(f, Fault::Turned(Orientation::Axes(h), _) if h.abs_diff_eq(g, 1e-6)))
        }
    };
    for (name, g) in [
        ("turned by 90", DMat3::from_rotation_y(0.5 * PI)),
        ("turned by 180", DMat3::from_rotation_y(PI)),
        ("mirrored in x", DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0))),
        ("upside down", DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0))),
        ("z up", DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y)),
    ] {
        let g = DMat3::from_cols(g.x_axis.round(), g.y_axis.round(), g.z_axis.round());
        out.push(plant(name, moved(good, g), axes(g)));
    }
    // Each takes ten times as long as another plant: its angle is searched for.
    for columns in if full() { &[13, 71][..] } else { &[13] } {
        let (light, g) = turned(light, *columns);
        let levels = bake(&light, &linear(), SIDE);
        let degrees = *columns as f64 * 360.0 / light.width as f64;
        out.push(plant(format!("turned by {degrees}"), levels, move |f| {
            let near = |h: &DMat3| (h.transpose() * g).x_axis.angle_between(DVec3::X) < f64::to_radians(0.5);
            one(f, |f| matches!(f, Fault::Turned(Orientation::Axes(h), _) if near(h)))
        }));
    }
    let mut faces = good.to_vec();
    for level in &mut faces {
        let n = level.width * level.width;
        for p in &mut level.planes {
            let (a, b) = p.split_at_mut(3 * n);
            a[2 * n..].swap_with_slice(&mut b[..n]);
        }
    }
    out.push(plant("faces +Y and -Y exchanged", faces, |f| {
        one(f, |f| matches!(f, Fault::Turned(t, _) if t.name() == "faces +Y and -Y swapped"))
    }));
    let mut flipped = good.to_vec();
    for level in &mut flipped {
        let n = level.width;
        level.planes.iter_mut().for_each(|p| p.chunks_exact_mut(n).for_each(<[f32]>::reverse));
    }
    out.push(plant("every face mirrored", flipped, |f| {
        one(f, |f| matches!(f, Fault::Turned(t, _) if t.name() == "every face mirrored left to right"))
    }));
    let g = DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0));
    let levels = values(&moved(good, g), |_, v| v.map(|v| v * PI as f32));
    out.push(plant("mirrored in z, times pi", levels, move |f| {
        f.len() == 2
            && f.iter().any(|f| matches!(f, Fault::Turned(Orientation::Axes(h), _) if h.abs_diff_eq(g, 1e-6)))
            && f.iter().any(|f| matches!(f, Fault::Scale(Scale::Gain(x), _) if (x / PI - 1.0).abs() < 0.01))
    }));
    out
}

/// Faults that name no cause.
fn unnamed(faults: &[Fault]) -> bool {
    !faults.is_empty() && faults.iter().all(|f| matches!(f, Fault::Unexplained(..)))
}

/// The judgement of the plants under one light, printed; false causes, and visible faults that nothing was
/// said of.
fn judged(
    (name, turn): (&str, usize),
    light: &SphereImage,
    other: &SphereImage,
) -> (usize, usize, Vec<String>) {
    let good = bake(light, &linear(), SIDE);
    let mut plants = of_light(light);
    plants.extend(of_kernels(light));
    plants.extend(of_values(&good));
    plants.extend(of_texels(&good));
    plants.extend(of_turns(&good, light));
    plants.push(plant("made from another light", bake(other, &linear(), SIDE), |f| {
        one(f, |f| *f == Fault::OtherLight)
    }));
    // Every plant is judged under one light; under each one with STERADIAN_FULL=1.
    if !full() {
        let kept = plants.into_iter().enumerate().filter(|(k, _)| k % 3 == turn);
        plants = kept.map(|k| k.1).collect();
    }
    let (all, mut right, mut wrong) = (plants.len(), 0, Vec::new());
    for p in plants {
        let start = Instant::now();
        let report = verify(&p.levels, light);
        let seconds = start.elapsed().as_secs_f64();
        let off = report.levels.iter().map(|l| l.expected_residual).fold(0.0, f64::max);
        let verdict = match &report.faults[..] {
            f if (p.named)(f) => "named",
            // A fault that hardly changes the file cannot be seen.
            [] if off < 0.02 => "hardly there",
            f if unnamed(f) => "unexplained",
            [] => "SILENT",
            _ => "FALSE",
        };
        let text: Vec<String> = report.faults.iter().map(|f| format!("{f:?}")).collect();
        println!(
            "{name:<11} {:<34} {verdict:<12} {:6.2} % {seconds:5.2} s  {}",
            p.name,
            100.0 * off,
            text.join(" + ")
        );
        right += usize::from(verdict == "named" || verdict == "hardly there");
        if verdict == "SILENT" || verdict == "FALSE" {
            wrong.push(format!("{name}: {}: {verdict}: {}", p.name, text.join(" + ")));
        }
    }
    println!(
        "{name}: {right} of {all} named, {} unexplained, {} wrong",
        all - right - wrong.len(),
        wrong.len()
    );
    (right, all, wrong)
}

#[test]
fn no_false_cause_is_named_under_a_sky() {
    let (right, all, wrong) = judged(("sky", 0), &bake::sky(), &bake::studio());
    assert!(wrong.is_empty(), "{wrong:#?}");
    // Lambert and GGX of roughness 1 are one kernel, for example: indistinguishable causes are not named.
    assert!(7 * right >= 6 * all, "{right} of {all}");
}

#[test]
fn no_false_cause_is_named_in_a_studio() {
    let (right, all, wrong) = judged(("studio", 1), &bake::studio(), &bake::photograph());
    assert!(wrong.is_empty(), "{wrong:#?}");
    // Lambert and GGX of roughness 1 are one kernel, for example: indistinguishable causes are not named.
    assert!(7 * right >= 6 * all, "{right} of {all}");
}

#[test]
fn no_false_cause_is_named_of_a_photograph() {
    let (right, all, wrong) = judged(("photograph", 2), &bake::photograph(), &bake::sky());
    assert!(wrong.is_empty(), "{wrong:#?}");
    // Lambert and GGX of roughness 1 are one kernel, for example: indistinguishable causes are not named.
    assert!(7 * right >= 6 * all, "{right} of {all}");
}
