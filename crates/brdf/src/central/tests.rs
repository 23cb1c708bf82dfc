//! Closed forms first, then the paper's numbers, then brute force.

use super::rule::{self, POINTS};
use super::*;
use crate::{Brdf, Info, Lobe, Sample, SharedBrdf, parse};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use steradian_base::Task;
use steradian_sphere::quadrature::gauss_legendre;
use steradian_sphere::sh::{self, zonal};

fn brdf(spec: &str) -> SharedBrdf {
    parse(spec).expect("spec")
}

fn project(spec: &str, centre: Centre, f: usize, p: usize) -> Lpq {
    Lpq::project(&*brdf(spec), centre, f, p, &Task::quiet()).expect("isotropic")
}

fn slices(spec: &str, list: Vec<Slice>, f: usize, q: usize) -> Slices {
    Slices::new(&*brdf(spec), Centre::Reflection, list, f, q, &Task::quiet()).expect("isotropic")
}

/// The coefficients of a zonal kernel of Funk–Hecke factors k_l: ρ̂_l00 = √(2l + 1) k_l, nothing else.
fn assert_zonal(rho: &Lpq, k: &[f64], tolerance: f64) {
    for (p, q) in (0..=rho.p).flat_map(|p| (0..=p).map(move |q| (p, q))) {
        for (l, got) in rho.row(p, q)[1].iter().enumerate() {
            let want = if p == 0 { ((2 * l + 1) as f64).sqrt() * k[l] } else { 0.0 };
            assert!((got - want).abs() < tolerance, "{l} {p} {q}: {got} {want}");
        }
    }
}

#[test]
fn a_radially_symmetric_lobe_needs_one_term() {
    let k = zonal::phong(24, 32.0);
    let normalized: Vec<f64> = k.iter().map(|x| x / k[0]).collect();
    assert_zonal(&project("phong-normalized:s=32", Centre::Reflection, 24, 3), &normalized, 1e-10);
    assert_zonal(&project("phong-map:n=32", Centre::Reflection, 24, 2), &k, 1e-10);
}

/// A polynomial of degree 14 goes through 15 nodes, and on to the ends of their interval.
#[test]
fn interpolation_between_nodes_is_exact_for_polynomials() {
    let f = |x: f64| (0..POINTS as i32).map(|k| (1.0 - 0.1 * f64::from(k)) * x.powi(k)).sum::<f64>();
    let nodes = rule::nodes(-1.0, 1.0);
    for x in [-1.0, -0.993, -0.4, 0.0, nodes[11].at, 0.77, 1.0] {
        let got: f64 = rule::interpolation(x).iter().zip(&nodes).map(|(w, node)| w * f(node.at)).sum();
        assert!((got - f(x)).abs() < 1e-12, "{x}: {got} {}", f(x));
    }
}

/// Waves far shorter than the lobe is wide: circles are interpolated to them, within the tolerance that is
/// asked for, of a closed form and of lobes that the horizon cuts.
#[test]
fn circles_are_interpolated_to_short_waves() {
    let of = |spec: &str, tolerance: f64| {
        let list = [0.3, 1.4].map(Slice::reflection).to_vec();
        let b = brdf(spec);
        Slices::to(&*b, Centre::Reflection, list, [255, 8], tolerance, &Task::quiet()).expect("isotropic")
    };
    let round = of("phong-normalized:s=200", 1e-4);
    let k = zonal::phong(255, 200.0);
    for i in 0..2 {
        let norm = round.energy[i][0].sqrt();
        for (l, got) in round.row(i, 0)[0].iter().enumerate() {
            let want = k[l] / k[0] * ((2 * l + 1) as f64 / (4.0 * PI)).sqrt();
            assert!((got - want).abs() < 1e-4 * norm, "{i} {l}: {got} {want}");
        }
    }
    for spec in ["ggx:alpha=0.05", "dielectric:alpha=0.1", "cook-torrance:m=0.3"] {
        let [rough, fine] = [1e-3, 1e-6].map(|tolerance| of(spec, tolerance));
        for i in 0..2 {
            let rows = |q: usize| rough.row(i, q).into_iter().zip(fine.row(i, q));
            let squares =
                |(a, b): (&[f64], &[f64])| -> f64 { a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum() };
            let off: f64 =
                (0..=8).map(|q| if q == 0 { 1.0 } else { 2.0 } * rows(q).map(squares).sum::<f64>()).sum();
            let energy: f64 = fine.energy[i].iter().sum();
            println!("{spec} {i}: {:.1e}, estimated {:.1e}", (off / energy).sqrt(), rough.accuracy);
            assert!(off.sqrt() < 1e-3 * energy.sqrt(), "{spec} {i}: {}", (off / energy).sqrt());
        }
    }
}

#[test]
fn the_cosine_about_the_normal_needs_one_term() {
    let k: Vec<f64> = zonal::cosine(20).iter().map(|a| a / PI).collect();
    assert_zonal(&project("lambert", Centre::Normal, 20, 3), &k, 1e-9);
}

/// RH02, table 5.5: the orders at which the microfacet model of 5.34, without a cosine in addition to the
/// formula's own, has ε < .03. The shares of the energy follow if the right side of 5.18 runs over θ_o' = 0 …
/// π, twice the angle between n and wo.
#[test]
fn the_papers_microfacet_orders() {
    let table = [
        (0.1, 24, 3, 0.9805),
        (0.2, 12, 2, 0.9743),
        (0.3, 7, 2, 0.9731),
        (0.4, 5, 2, 0.9720),
        (0.5, 5, 2, 0.9745),
    ];
    for (sigma, f, p, want) in table {
        let rho = project(&format!("microfacet:sigma={sigma}"), Centre::Reflection, f + 2, p + 1);
        assert!((rho.share(f, p) - want).abs() < 2e-4, "{sigma}: {} {want}", rho.share(f, p));
        assert!(rho.accuracy < 1e-4, "{}", rho.accuracy);
        let (fo, po) = rho.orders(0.03).expect("reached");
        assert!(po <= p && (po < p || fo <= f), "{sigma}: {fo} {po}");
        assert_eq!(rho.orders(1e-9), None);
    }
}

/// RH02, section 5.7.1: P = 8 holds Kajiya and Kay's lobe of s = 32 with ε < .03.
#[test]
fn the_papers_strand_order() {
    let rho = project("kajiya-kay:s=32", Centre::Tangent, 30, 10);
    assert_eq!(rho.orders(0.03).map(|o| o.1), Some(8));
    assert_eq!(rho.azimuth(), 0);
}

/// RH02, section 5.7.1: P = 4 suffices for the skin of Marschner et al. in Lafortune's form with ε < .03. The
/// energy is that of all channels, with the cosine; the green channel alone would need P = 5.
#[test]
fn the_papers_skin_order() {
    for spec in ["lafortune:@skin", "lafortune:@skin-mahesh"] {
        let rho = project(spec, Centre::Reflection, 30, 5);
        assert!(rho.orders(0.03).is_some_and(|o| o.1 <= 4));
    }
}

#[test]
fn what_is_captured_grows_to_the_total() {
    let rho = project("ggx:alpha=0.4", Centre::Reflection, 32, 12);
    let mut before = 0.0;
    for (f, p) in [(0, 0), (4, 1), (8, 2), (16, 4), (24, 8), (32, 12)] {
        let share = rho.share(f, p);
        assert!(share > before && share <= 1.0 + 1e-9, "{f} {p}: {share}");
        before = share;
    }
    assert!(before > 0.99);
    let s = slices("ggx:alpha=0.4", vec![Slice::reflection(0.5)], 64, 24);
    let share = s.captured(0, 64, 24)[0] / s.energy[0][0];
    assert!((1.0 - 1e-6..=1.0 + 1e-9).contains(&share), "{share}");
}

/// k_lq by a dense product rule in the frame of the normal, where neither the horizon nor the centre is
/// special.
fn brute(brdf: &dyn Brdf, slice: &Slice, order: usize, n: usize) -> (Vec<f64>, f64) {
    let (nodes, weights) = gauss_legendre(n);
    let axes = [slice.zero_azimuth(), slice.centre().cross(slice.zero_azimuth()), slice.centre()];
    let (mut sum, mut energy) = (vec![0.0; sh::count(order)], 0.0);
    let mut y = sum.clone();
    for (x, w) in nodes.iter().zip(&weights) {
        // Half of the nodes would suffice for the hemisphere; z = x² concentrates the remaining ones at the
        // horizon.
        let z = (0.5 * (1.0 + x)).powi(2);
        let dz = 0.5 * (1.0 + x) * w;
        for j in 0..n {
            let phi = 2.0 * PI * (j as f64 + 0.5) / n as f64;
            let r = (1.0 - z * z).sqrt();
            let wi = DVec3::new(r * phi.cos(), r * phi.sin(), z);
            let f = brdf.f_cos(wi, slice.view())[0];
            let weight = f * dz * 2.0 * PI / n as f64;
            energy += f * weight;
            sh::eval(order, DVec3::new(wi.dot(axes[0]), wi.dot(axes[1]), wi.dot(axes[2])), &mut y);
            sum.iter_mut().zip(&y).for_each(|(s, y)| *s += weight * y);
        }
    }
    (sum, energy)
}

#[test]
fn slices_agree_with_brute_force_about_the_normal() {
    let cases = [
        ("ggx:alpha=0.2", Slice::reflection(80f64.to_radians())),
        ("ggx:alpha=0.2", Slice { theta_v: 80f64.to_radians(), gamma: 70f64.to_radians() }),
        ("ggx:alpha=0.5", Slice { theta_v: 0.7, gamma: -0.4 }),
        ("phong:n=32", Slice::reflection(1.2)),
        ("microfacet:sigma=0.3", Slice::reflection(1.3)),
        ("microfacet:sigma=0.3", Slice { theta_v: 1.1, gamma: FRAC_PI_2 }),
        ("oren-nayar:sigma=0.5", Slice::normal(1.0)),
    ];
    let order = 9;
    for (spec, slice) in cases {
        let b = brdf(spec);
        let (want, energy) = brute(&*b, &slice, order, 360);
        let s = slices(spec, vec![slice], order, order);
        let norm = energy.sqrt();
        let mut worst = 0.0f64;
        for (l, q) in (0..=order).flat_map(|l| (0..=l).map(move |q| (l, q))) {
            let scale = if q == 0 { 1.0 } else { SQRT_2 };
            let got = scale * s.row(0, q)[0][l];
            worst = worst.max((got - want[sh::index(l, q as isize)]).abs());
            if q > 0 {
                worst = worst.max(want[sh::index(l, -(q as isize))].abs());
            }
        }
        assert!(worst < 1e-5 * norm, "{spec} {slice:?}: {worst} of {norm}");
        assert!((s.energy[0][0] / energy - 1.0).abs() < 1e-5, "{spec}: {} {energy}", s.energy[0][0]);
    }
}

/// The quadrature's error estimate is not below the difference from a far stricter run.
#[test]
fn refinement_changes_no_more_than_is_said() {
    let polar = Polar::new(24, 6);
    for spec in
        ["ggx:alpha=0.1", "cook-torrance:m=0.3", "ashikhmin-shirley:nu=100,nv=100", "sgd:blue-acrylic"]
    {
        let b = brdf(spec);
        for theta_v in [0.0, 0.8, 1.4] {
            let slice = Slice::reflection(theta_v);
            let run = |tolerance: f64| {
                let request = kernel::Request { f: 24, q: 6, tolerance, two_sided: false };
                kernel::slice(&*b, &slice, &request, &polar, &Task::quiet()).expect("nobody cancels")
            };
            let fine = run(1e-11);
            let norm = fine.energy.iter().sum::<f64>().sqrt();
            for tolerance in [1e-4, 1e-7] {
                let k = run(tolerance);
                let square: f64 = k.k.iter().zip(&fine.k).map(|(a, b)| 2.0 * (a - b) * (a - b)).sum();
                let off = square.sqrt() / norm;
                assert!(off < 3.0 * tolerance + k.accuracy, "{spec} {theta_v}: {off} {}", k.accuracy);
            }
        }
    }
}

#[test]
fn every_isotropic_model_is_finite_and_keeps_parseval() {
    let specs = [
        "oren-nayar:sigma=0.5,variant=full",
        "minnaert:k=0.6",
        "minnaert:k=0",
        "blinn-phong:n=60",
        "blinn-phong-gl:kd=0.3,ks=0.5,n=40",
        "cook-torrance:m=0.4,g=smith",
        "ggx:alpha=0.0001",
        "ward:alpha=0.2,variant=1992",
        "ward:alpha=0.2,variant=duer",
        "ashikhmin-shirley:nu=100,nv=100,rs=0.1,rd=0.5",
        "lafortune:@felt",
        "lafortune:@clay",
        "sgd:chrome",
        "abc:gold-metallic-paint",
        "microfacet:sigma=10",
        "phong:n=1000000",
    ];
    for spec in specs {
        let b = brdf(spec);
        let s = Slices::even(&*b, Centre::Reflection, 7, 16, 4, &Task::quiet()).expect("finite");
        for i in 0..7 {
            let (c, e) = (s.captured(i, 16, 4), s.energy[i]);
            for k in 0..3 {
                assert!(c[k] <= e[k] * (1.0 + 1e-5), "{spec} {i}: {c:?} {e:?}");
            }
        }
    }
}

#[test]
fn a_dense_fit_is_the_projection() {
    let b = brdf("ggx:alpha=0.3,f0=0.9/0.5/0.2");
    let s = Slices::even(&*b, Centre::Reflection, 129, 16, 3, &Task::quiet()).expect("isotropic");
    let fit = Lpq::fit(&s, Argument::View, 3, &|_| 1.0, false).expect("enough");
    let plain = Lpq::project(&*b, Centre::Reflection, 16, 3, &Task::quiet()).expect("isotropic");
    for c in 0..3 {
        assert!((fit.energy[c] / plain.energy[c] - 1.0).abs() < 2e-3, "{:?} {:?}", fit.energy, plain.energy);
        assert!((fit.captured(16, 3)[c] / plain.captured(16, 3)[c] - 1.0).abs() < 2e-3);
        assert!((fit.captured(9, 1)[c] / plain.captured(9, 1)[c] - 1.0).abs() < 2e-3);
    }
    for (p, q) in [(0, 0), (1, 1), (2, 0), (3, 2)] {
        for l in q..=16 {
            assert!((fit.row(p, q)[1][l] - plain.row(p, q)[1][l]).abs() < 1e-3 * plain.energy[1].sqrt());
        }
    }
    // With weight on near views, the energy captured there grows.
    let near = |t: f64| if t < 120f64.to_radians() { 1.0 } else { 0.05 };
    let weighted = Lpq::fit(&s, Argument::View, 1, &near, true).expect("enough");
    let flat = fit.truncated(16, 1);
    let error = |rho: &Lpq, i: usize| {
        let approximate = rho.slice(s.slices[i].theta_o());
        let mut sum = 0.0;
        for q in 0..=s.azimuth {
            for l in 0..=16 {
                let a = approximate.get(q).map_or(0.0, |k| k[0][l]);
                sum += (a - s.row(i, q)[0][l]).powi(2) * if q == 0 { 1.0 } else { 2.0 };
            }
        }
        (sum / s.energy[i][0]).sqrt()
    };
    assert!(error(&weighted, 64) < error(&flat, 64));
    assert!((weighted.share(16, 1) - 1.0).abs() < 0.2);
}

/// Harmonics of the direction half way to the view need not vanish at the horizon: an equal number of them
/// represents grazing lobes better.
#[test]
fn harmonics_of_the_normal_hold_grazing_lobes() {
    for spec in ["ggx:alpha=0.36", "microfacet:sigma=0.2"] {
        let s = Slices::even(&*brdf(spec), Centre::Reflection, 33, 24, 6, &Task::quiet()).expect("isotropic");
        let even = |theta_o: f64| (0.5 * theta_o).sin() / theta_o.sin().max(1e-3);
        let error = |of: Argument, i: usize| {
            let fit = Lpq::fit(&s, of, 4, &even, true).expect("enough");
            let rows = fit.slice(s.slices[i].theta_o());
            let mut captured = 0.0;
            for q in 0..=s.azimuth {
                for l in q..=s.order {
                    let (k, a) = (s.row(i, q)[0][l], rows.get(q).map_or(0.0, |r| r[0][l]));
                    captured += (k * k - (k - a) * (k - a)) * if q == 0 { 1.0 } else { 2.0 };
                }
            }
            1.0 - captured / s.energy[i][0]
        };
        // 76° and 84°: squared errors fall by more than half.
        for i in [27, 30] {
            let [view, normal] = [Argument::View, Argument::Normal].map(|of| error(of, i));
            assert!(normal < 0.5 * view, "{spec} {i}: {view} {normal}");
        }
    }
}

#[test]
fn a_diffuse_part_is_found_and_taken_out() {
    let lambert =
        Slices::even(&*brdf("lambert"), Centre::Reflection, 33, 24, 24, &Task::quiet()).expect("isotropic");
    let a = lambert.best_diffuse(Argument::View, 1, &|_| 1.0).expect("enough");
    assert!((a[0] - 1.0).abs() < 1e-6, "{a:?}");
    let rest = lambert.without_diffuse([1.0; 3]);
    assert!(rest.k.iter().all(|k| k.abs() < 1e-6));
    assert!(rest.energy.iter().all(|e| e[0].abs() < 1e-6));
    let b = brdf("blinn-phong-gl:kd=0.5,ks=0.3,n=20");
    let s = Slices::even(&*b, Centre::Reflection, 33, 24, 8, &Task::quiet()).expect("isotropic");
    let a = s.best_diffuse(Argument::View, 1, &|_| 1.0).expect("enough");
    let share = |s: &Slices| {
        let fit = Lpq::fit(s, Argument::View, 1, &|_| 1.0, false).expect("enough");
        fit.energy[0] - fit.captured(24, 1)[0]
    };
    assert!(share(&s.without_diffuse(a)) < 0.7 * share(&s));
}

#[test]
fn centres_are_chosen_by_what_they_hold() {
    let quiet = Task::quiet();
    let centre = |spec: &str| best_centre(&*brdf(spec), &quiet);
    assert_eq!(centre("ggx:alpha=0.3"), Ok(Centre::Reflection));
    assert_eq!(centre("phong:n=10"), Ok(Centre::Reflection));
    assert_eq!(centre("lambert"), Ok(Centre::Normal));
    assert_eq!(centre("kajiya-kay:s=32"), Ok(Centre::Tangent));
    assert_eq!(centre("banks-map:n=40"), Ok(Centre::Tangent));
    let message = centre("ggx:ax=0.1,ay=0.3").expect_err("anisotropic").to_string();
    assert!(message.contains("anisotropic") && !message.contains('\n'), "{message}");
    assert!(centre("banks:n=40").is_err());
    let refused = Lpq::project(&*brdf("ggx:alpha=0.3"), Centre::Tangent, 4, 2, &quiet);
    assert!(matches!(refused, Err(CentralError::NotTangent { .. })));
    let refused = Lpq::project(&*brdf("ggx:alpha=0.3"), Centre::Normal, 256, 2, &quiet);
    assert!(matches!(refused, Err(CentralError::Order { order: 256 })));
    let bad = Slices::new(&*brdf("lambert"), Centre::Normal, vec![Slice::normal(2.0)], 4, 2, &quiet);
    assert!(matches!(bad, Err(CentralError::Slice { .. })));
}

/// f_cos with a twist about n: isotropic, but not symmetric in the plane of n and wo.
#[derive(Debug)]
struct Twisted;

impl Brdf for Twisted {
    fn info(&self) -> &'static Info {
        &crate::model::lambert::INFO
    }
    fn spec(&self) -> String {
        "twisted".into()
    }
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let twist = (wi.x * wo.y - wi.y * wo.x) * 0.5;
        if wi.z > 0.0 && wo.z > 0.0 { [0.5 + twist; 3] } else { [0.0; 3] }
    }
    fn lobes(&self, _: DVec3) -> Vec<Lobe> {
        Vec::new()
    }
    fn sample(&self, _: DVec3, _: DVec2) -> Option<Sample> {
        None
    }
    fn pdf(&self, _: DVec3, _: DVec3) -> f64 {
        0.0
    }
}

#[test]
fn both_sides_of_what_is_lopsided_are_read() {
    let slice = Slice::reflection(0.9);
    let (want, energy) = brute(&Twisted, &slice, 4, 96);
    let s = Slices::new(&Twisted, Centre::Reflection, vec![slice], 4, 4, &Task::quiet()).expect("isotropic");
    assert!((s.energy[0][0] / energy - 1.0).abs() < 1e-6);
    assert!((SQRT_2 * s.row(0, 2)[0][3] - want[sh::index(3, 2)]).abs() < 1e-6);
}

#[test]
fn a_leaning_centre_holds_grazing_lobes_better() {
    let theta_v = 80f64.to_radians();
    for spec in ["ggx:alpha=0.2", "ggx:alpha=0.36", "microfacet:sigma=0.3"] {
        let leaning = Slice::leaning(&*brdf(spec), theta_v).expect("isotropic");
        let s = slices(spec, vec![Slice::reflection(theta_v), leaning], 24, 6);
        let share = |i: usize, q: usize| s.captured(i, 24, q)[0] / s.energy[i][0];
        assert!((s.energy[0][0] / s.energy[1][0] - 1.0).abs() < 1e-5);
        assert!(share(1, 1) > share(0, 1), "{spec}");
    }
}

#[test]
fn threads_and_cancellation() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| project("ggx:alpha=0.3", Centre::Reflection, 8, 2).rho)
    };
    assert_eq!(run(1), run(3));
    let task = Task::quiet().with_cancel(Arc::new(true.into()));
    let stopped = Lpq::project(&*brdf("ggx:alpha=0.3"), Centre::Reflection, 8, 2, &task);
    assert!(matches!(stopped, Err(CentralError::Cancelled(_))));
}

/// Stops its task at the hundredth evaluation.
#[derive(Debug)]
struct Stopping {
    of: SharedBrdf,
    stop: Arc<AtomicBool>,
    looks: AtomicU64,
}

impl Brdf for Stopping {
    fn info(&self) -> &'static Info {
        self.of.info()
    }

    fn spec(&self) -> String {
        self.of.spec()
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if self.looks.fetch_add(1, Ordering::Relaxed) == 100 {
            self.stop.store(true, Ordering::Relaxed);
        }
        self.of.eval(wi, wo)
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        self.of.lobes(wo)
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        self.of.sample(wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        self.of.pdf(wi, wo)
    }
}

/// One slice of measurements may take minutes: it ends soon after its task is stopped.
#[test]
fn a_slice_ends_when_its_task_is_stopped() {
    let looks = |stopped: bool| {
        let stop = Arc::new(AtomicBool::new(false));
        let b = Stopping { of: brdf("ggx:alpha=0.1"), stop: stop.clone(), looks: AtomicU64::new(0) };
        let task = if stopped { Task::quiet().with_cancel(stop) } else { Task::quiet() };
        let made = Slices::new(&b, Centre::Reflection, vec![Slice::reflection(0.8)], 64, 16, &task);
        assert_eq!(made.is_err(), stopped);
        b.looks.load(Ordering::Relaxed)
    };
    let (whole, part) = (looks(false), looks(true));
    assert!(5 * part < whole, "{part} of {whole}");
}
