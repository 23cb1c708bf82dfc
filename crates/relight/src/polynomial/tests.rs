//! Fits of planted and photographed surfaces against closed forms.

use super::photographs::{RUN, Rows};
use super::*;

/// Directions uniform on the hemisphere.
fn hemisphere(n: usize) -> Vec<DVec3> {
    let at = |k: usize| {
        let z = (k as f64 + 0.5) / n as f64;
        let (s, phi) = ((1.0 - z * z).sqrt(), 2.399_963_229_728_653 * k as f64);
        DVec3::new(s * phi.cos(), s * phi.sin(), z)
    };
    (0..n).map(at).collect()
}

#[test]
fn quadratics_are_recovered() {
    let lights = hemisphere(24);
    let fit = Fit::<6>::new(&lights).unwrap();
    let a = [-0.4, -0.7, 0.2, 0.3, -0.1, 0.9];
    let found = fit.coefficients(lights.iter().map(|l| evaluate(&a, *l)));
    assert!(a.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
}

/// Least squares of the cosine over the hemisphere: 9/8 − 15/16 (u² + v²), off by an eighth of its RMS.
#[test]
fn lambert_seen_from_above_has_a_closed_form() {
    let lights = hemisphere(200_000);
    let a = Fit::<6>::new(&lights).unwrap().coefficients(lights.iter().map(|l| l.z));
    let want = [-15.0 / 16.0, -15.0 / 16.0, 0.0, 0.0, 0.0, 9.0 / 8.0];
    assert!(a.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-4), "{a:?}");
    let sum = |f: &dyn Fn(&DVec3) -> f64| lights.iter().map(f).sum::<f64>();
    let off = sum(&|l| (evaluate(&a, *l) - l.z).powi(2)) / sum(&|l| l.z * l.z);
    assert!((off.sqrt() - 0.125).abs() < 1e-3, "{}", off.sqrt());
}

/// Normals of tilted Lambertian facets are biased, since a parabola differs from a cosine clamped at its
/// own shadow.
#[test]
fn normals_of_tilted_facets_are_biased() {
    let lights = hemisphere(20_000);
    let fit = Fit::<6>::new(&lights).unwrap();
    for (tilt, bias) in [(0.0f64, 0.0), (15.0, 7.1), (30.0, 11.0)] {
        let n = DVec3::new(tilt.to_radians().sin(), 0.0, tilt.to_radians().cos());
        let a = fit.coefficients(lights.iter().map(|l| l.dot(n).max(0.0)));
        let found = normal(&a).unwrap().angle_between(n).to_degrees();
        assert!((found - bias).abs() < 0.1, "{tilt}: {found}");
    }
}

/// Harmonics have the cosine among them: Lambert seen from above is recovered, and facets are followed
/// more closely.
#[test]
fn normals_by_harmonics_are_less_biased() {
    fn biases<const N: usize>(want: [(f64, f64, f64); 4]) {
        let lights = hemisphere(20_000);
        let fit = Fit::<N>::new(&lights).unwrap();
        for (tilt, bias, rms) in want {
            let n = DVec3::new(tilt.to_radians().sin(), 0.0, tilt.to_radians().cos());
            let facet = |l: &DVec3| l.dot(n).max(0.0);
            let a = fit.coefficients(lights.iter().map(facet));
            let found = brightest(&a).unwrap().angle_between(n).to_degrees();
            let sum = |f: &dyn Fn(&DVec3) -> f64| lights.iter().map(f).sum::<f64>();
            let off = sum(&|l| (evaluate(&a, *l).max(0.0) - facet(l)).powi(2)) / sum(&|l| facet(l).powi(2));
            println!("{N} {tilt}: {found:.3} {:.4}", off.sqrt());
            assert!((found - bias).abs() < 0.05, "{N}: {tilt}: {found}");
            assert!((off.sqrt() - rms).abs() < 1e-3, "{N}: {tilt}: {}", off.sqrt());
        }
    }
    biases::<9>([(0.0, 0.0, 0.0), (15.0, 0.76, 0.027), (30.0, 0.49, 0.052), (60.0, 1.39, 0.063)]);
    biases::<16>([(0.0, 0.0, 0.0), (15.0, 0.91, 0.0185), (30.0, 0.32, 0.021), (60.0, 2.36, 0.043)]);
}

#[test]
fn harmonics_are_recovered_and_have_the_biquadratic_among_them() {
    fn recovered<const N: usize>() {
        let lights = hemisphere(40);
        let fit = Fit::<N>::new(&lights).unwrap();
        let a: [f64; N] = std::array::from_fn(|k| (k as f64 * 1.7).sin());
        let found = fit.coefficients(lights.iter().map(|l| evaluate(&a, *l)));
        assert!(a.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-10), "{found:?}");
        let six = [-0.4, -0.7, 0.2, 0.3, -0.1, 0.9];
        let all = fit.coefficients(lights.iter().map(|l| evaluate(&six, *l)));
        assert!(hemisphere(100).iter().all(|l| (evaluate(&all, *l) - evaluate(&six, *l)).abs() < 1e-10));
        // Orthonormal over the sphere: those of even order and those of odd order each over the
        // hemisphere.
        let all = hemisphere(20_000);
        let dot = |i: usize, j: usize| {
            let sum: f64 = all.iter().map(|l| terms::<N>(*l)[i] * terms::<N>(*l)[j]).sum();
            sum * 4.0 * std::f64::consts::PI / all.len() as f64
        };
        for (i, j, want) in [(0, 0, 1.0), (2, 2, 1.0), (6, 6, 1.0), (8, 8, 1.0), (4, 6, 0.0), (0, 6, 0.0)] {
            assert!((dot(i, j) - want).abs() < 1e-3, "{i} {j}: {}", dot(i, j));
        }
    }
    recovered::<9>();
    recovered::<16>();
}

/// The direction that any basis finds is the best of many.
#[test]
fn no_direction_is_brighter_than_the_brightest() {
    let all = hemisphere(4000);
    for seed in 0..40 {
        let a: [f64; 16] = std::array::from_fn(|k| ((k + 1) as f64 * 7.3 + f64::from(seed) * 2.1).sin());
        let n = brightest(&a).unwrap();
        assert!((n.length() - 1.0).abs() < 1e-9 && n.z > -1e-9);
        let most = all.iter().map(|l| evaluate(&a, *l)).fold(f64::MIN, f64::max);
        assert!(evaluate(&a, n) >= most - 2e-3 * most.abs(), "{seed}: {} {most}", evaluate(&a, n));
    }
    let mut constant = [0.0; 9];
    constant[0] = 2.0;
    assert_eq!(brightest(&constant), None);
}

#[test]
fn without_a_maximum_within_it_lies_on_the_rim() {
    for a in
        [[0.0, 0.0, 0.0, 3.0, 4.0, 0.0], [0.5, -1.0, 0.0, 0.0, 0.0, 1.0], [-1.0, -1.0, 0.0, 4.0, 1.0, 0.0]]
    {
        let n = normal(&a).unwrap();
        assert!((n.length() - 1.0).abs() < 1e-12 && n.z.abs() < 1e-12);
        let best = (0..10_000).map(|k| {
            let (s, c) = (std::f64::consts::TAU * f64::from(k) / 10_000.0).sin_cos();
            evaluate(&a, DVec3::new(c, s, 0.0))
        });
        assert!(evaluate(&a, n) >= best.fold(f64::MIN, f64::max) - 1e-12, "{a:?}: {n}");
    }
    assert_eq!(normal(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.7]), None);
}

#[test]
fn lights_that_determine_nothing_are_refused() {
    assert_eq!(Fit::<6>::new(&hemisphere(5)).unwrap_err(), FitError::Few { got: 5, want: 6 });
    let e = Fit::<16>::new(&hemisphere(15)).unwrap_err().to_string();
    assert!(e.contains("16 spherical harmonics need 16"), "{e}");
    let ring: Vec<DVec3> = (0..12)
        .map(|k| {
            let (s, c) = (f64::from(k) * 0.5).sin_cos();
            DVec3::new(0.6 * c, 0.6 * s, 0.8)
        })
        .collect();
    let e = Fit::<6>::new(&ring).unwrap_err();
    let singular = |e: &FitError| {
        let text = e.to_string();
        assert!(text.contains("singular") && !text.contains("inf") && text.lines().count() == 1, "{text}");
        matches!(e, FitError::Undetermined { condition, .. } if *condition > MAX_CONDITION)
    };
    assert!(singular(&e) && e.to_string().contains("one conic"), "{e}");
    // Two rings are two conics: six numbers are determined, nine harmonics are not.
    let two = |second: f64| -> Vec<DVec3> {
        let z = |k: usize| if k.is_multiple_of(2) { 0.8 } else { second };
        let at = |k: usize| (z(k), (1.0 - z(k) * z(k)).sqrt(), 0.5 * k as f64);
        (0..24).map(at).map(|(z, r, phi)| DVec3::new(r * phi.cos(), r * phi.sin(), z)).collect()
    };
    assert!(Fit::<6>::new(&two(0.4)).is_ok());
    for (e, n) in [(Fit::<9>::new(&two(0.4)).unwrap_err(), 9), (Fit::<16>::new(&two(0.4)).unwrap_err(), 16)] {
        assert!(singular(&e) && e.to_string().contains(&format!("{n} spherical harmonics")), "{e}");
        assert!(!e.to_string().contains("conic"), "{e}");
    }
    let e = Fit::<6>::new(&two(0.8 + 1e-6)).unwrap_err().to_string();
    assert!(e.contains("condition number ") && e.contains("e6"), "{e}");
    let mut below = hemisphere(8);
    below[3].z = -0.1;
    assert!(matches!(Fit::<6>::new(&below), Err(FitError::Below(3, ..))));
    below[3] = DVec3::NAN;
    assert!(matches!(Fit::<6>::new(&below), Err(FitError::Below(3, ..))));
}

/// Photographs of one colour under lights give its polynomial and its colour; polynomial · colour / 255
/// is the radiance.
#[test]
fn photographs_become_polynomials_and_colours() {
    let lights = hemisphere(16);
    let fit = Fit::<6>::new(&lights).unwrap();
    let a = [-0.3, -0.2, 0.1, 0.05, -0.1, 0.6];
    let color = [0.8, 0.4, 0.2];
    let texels = 100;
    let mut all = Photographs::new(&fit, Channels::Luminance, texels);
    for l in &lights {
        let planes = color.map(|c| vec![(c * evaluate(&a, *l)) as f32; texels]);
        all.add([&planes[0], &planes[1], &planes[2]]).unwrap();
    }
    let Polynomials { planes, color: bytes } = all.finish();
    assert_eq!(bytes.unwrap()[texels - 1], [255, 128, 64]);
    for (found, a) in planes[0].iter().zip(a) {
        let found = found[texels - 1];
        assert!((f64::from(found) / WHITE - 0.8 * a).abs() < 1e-6, "{found} {a}");
    }
    let mut wrong = Photographs::new(&fit, Channels::Luminance, 2);
    let (two, three) = ([0.5f32; 2], [0.5f32; 3]);
    assert!(matches!(
        wrong.add([&two, &three, &two]),
        Err(FitError::Size { photograph: 0, got: 3, want: 2 })
    ));
    assert_eq!(wrong.add([&two, &[f32::NAN; 2], &two]), Err(FitError::Finite(0)));
}

/// Planes by formula, others under each light.
fn some(light: usize, texels: usize) -> [Vec<f32>; 3] {
    let value = |c: usize, k: usize| ((k * 37 + light * 1013 + c * 211) % 4099) as f32 / 4098.0;
    [0, 1, 2].map(|c| (0..texels).map(|k| value(c, k)).collect())
}

/// Bytes of a texel, which decide how many megapixels a machine takes: 60 photographs of 12 megapixels
/// stay below a gigabyte in three channels.
#[test]
fn sums_take_few_bytes_a_texel() {
    assert_eq!(Photographs::<6>::bytes(Channels::Luminance, 1), 36);
    assert_eq!(Photographs::<6>::bytes(Channels::Colour, 1), 72);
    assert_eq!(Photographs::<16>::bytes(Channels::Colour, 1), 192);
    let fit = Fit::<6>::new(&hemisphere(8)).unwrap();
    for channels in [Channels::Luminance, Channels::Colour] {
        let texels = 3 * RUN + 5;
        let mut all = Photographs::new(&fit, channels, texels);
        (0..8).for_each(|l| all.add(some(l, texels).each_ref().map(|p| &p[..])).unwrap());
        let held = |planes: &[Vec<f32>]| planes.iter().map(|p| 4 * p.capacity() as u64).sum::<u64>();
        assert_eq!(held(&all.planes), Photographs::<6>::bytes(channels, texels));
        // Coefficients lie where the sums lay.
        let places: Vec<*const f32> = all.planes.iter().map(|p| p.as_ptr()).collect();
        let out = all.finish();
        let planes = out.planes.iter().flatten().map(|p| p.as_ptr());
        assert!(planes.zip(places).all(|(a, b)| a == b));
    }
}

/// Sums in single precision against the rule in double, where lights are badly placed too: off by
/// rounding of the photographs' values times the condition number.
#[test]
fn sums_in_single_precision_lose_no_more_than_rounded_photographs() {
    let ring = |height: f64| -> Vec<DVec3> {
        let z = |k: usize| if k.is_multiple_of(2) { 0.8 } else { height };
        let at = |k: usize| (z(k), (1.0 - z(k) * z(k)).sqrt(), 0.7 * k as f64);
        (0..60).map(at).map(|(z, r, phi)| DVec3::new(r * phi.cos(), r * phi.sin(), z)).collect()
    };
    for lights in [hemisphere(60), ring(0.6), ring(0.79), ring(0.799)] {
        let fit = Fit::<6>::new(&lights).unwrap();
        let texels = 500;
        let photographs: Vec<[Vec<f32>; 3]> = (0..60).map(|l| some(l, texels)).collect();
        let mut all = Photographs::new(&fit, Channels::Colour, texels);
        photographs.iter().for_each(|p| all.add(p.each_ref().map(|p| &p[..])).unwrap());
        let out = all.finish();
        let mut most = 0.0f64;
        for (c, plane) in out.planes.iter().enumerate() {
            for t in 0..texels {
                let want = fit.coefficients(photographs.iter().map(|p| f64::from(p[c][t])));
                let size = want.iter().fold(1.0f64, |m, x| m.max(x.abs()));
                for (got, want) in plane.iter().zip(want) {
                    most = most.max((f64::from(got[t]) / WHITE - want).abs() / size);
                }
            }
        }
        assert!(most < 4e-7 * fit.condition().max(2.0), "{most:.1e} at {:.1e}", fit.condition());
    }
}

/// Neither the number of threads nor that of photographs at a time changes a bit.
#[test]
fn threads_and_batches_change_no_bit() {
    let lights = hemisphere(9);
    let fit = Fit::<6>::new(&lights).unwrap();
    let texels = 5 * RUN + 77;
    let photographs: Vec<[Vec<f32>; 3]> = (0..9).map(|l| some(l, texels)).collect();
    let of = |threads: usize, channels: Channels, at_once: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut all = Photographs::new(&fit, channels, texels);
            for batch in photographs.chunks(at_once) {
                let planes: Vec<[&[f32]; 3]> = batch.iter().map(|p| p.each_ref().map(|p| &p[..])).collect();
                all.add_rows(&planes.iter().map(|p| p as &dyn Rows).collect::<Vec<_>>()).unwrap();
            }
            let out = all.finish();
            let bits = out.planes.iter().flatten().flatten().map(|x| x.to_bits());
            (bits.collect::<Vec<u32>>(), out.color)
        })
    };
    for channels in [Channels::Luminance, Channels::Colour] {
        let one = of(1, channels, 1);
        assert!([(3, 1), (1, 4), (3, 2)].iter().all(|(t, n)| of(*t, channels, *n) == one));
    }
}
