use super::shade;
use super::tables::{Model, Tables, materials, model};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};
use steradian_brdf::{Brdf, parse};
use steradian_sphere::sampling::Pcg32;

const SPECS: [&str; 3] = [
    "ggx:alpha=0.3,f0=0.9/0.6/0.3",
    "cook-torrance:m=0.3,f0=0.5,g=smith",
    "ashikhmin-shirley:nu=20,nv=50,rs=0.3,rd=0.5",
];

fn of(spec: &str) -> Model {
    model(&*parse(spec).expect(spec)).expect(spec)
}

/// Distance of a number from the single-precision number nearest to `exact`, in units in the last place.
fn ulps(got: f32, exact: f64) -> u32 {
    got.to_bits().abs_diff((exact as f32).to_bits())
}

/// At the entries the tables are the functions, to 4 units in the last place, n·v = 0 among them.
#[test]
fn entries_are_exact() {
    const N: usize = 65;
    let at = |k: usize| k as f64 / (N - 1) as f64;
    for spec in &SPECS[..2] {
        let m = of(spec);
        let Tables::Two { facets, masking, .. } = Tables::new(&m, N) else { panic!("two tables") };
        for i in 0..N {
            for j in 0..N {
                let (u, v) = (at(i) as f32, at(j) as f32);
                let exact = m.facets(at(i), FRAC_PI_2 * at(j));
                let got = facets.plane(u, v);
                assert!((0..3).all(|c| ulps(got[c], exact[c]) <= 4), "{spec}: T1 {i} {j}: {got:?} {exact:?}");
                let (got, exact) = (masking.plane(u, v)[0], m.cosines_over_masking(at(i), at(j)));
                assert!(ulps(got, exact) <= 4, "{spec}: T2 {i} {j}: {got} {exact}");
            }
        }
        // G/(n·v) has a limit at n·v = 0: n·l over the table is finite, and the model's.
        let brdf = parse(spec).expect(spec);
        for nl in [1.0f64, 0.5, 0.1] {
            let (wi, wo) = (DVec3::new((1.0 - nl * nl).sqrt(), 0.0, nl), DVec3::new(-1.0, 0.0, 1e-9));
            let exact = brdf.f_cos(wi, wo)[0];
            let tables = Tables::new(&m, 1025);
            let got = shade::f_cos(&tables, wi.as_vec3().to_array(), wo.as_vec3().to_array());
            assert!((f64::from(got[0]) / exact - 1.0).abs() < 5e-3, "{spec}: {nl}: {got:?} {exact}");
        }
    }
}

/// Ashikhmin & Shirley's three tables at their entries, by the formulas of the paper: eqs 4 and 5 without F,
/// h·l and the larger cosine, Schlick's F, and the diffuse part.
#[test]
fn entries_of_three_tables_are_exact() {
    const N: usize = 65;
    let at = |k: usize| k as f64 / (N - 1) as f64;
    let [nu, nv, rs, rd] = [20.0f64, 50.0, 0.3, 0.5];
    let Tables::Three { power, fresnel, base, .. } = Tables::new(&of(SPECS[2]), N) else {
        panic!("three tables")
    };
    let mut worst = [0; 3];
    for i in 0..N {
        let f = rs + (1.0 - rs) * (1.0 - at(i)).powi(5);
        worst[1] = fresnel.line(at(i) as f32)[..3].iter().map(|x| ulps(*x, f)).fold(worst[1], u32::max);
        for j in 0..N {
            let (u, v) = (at(i) as f32, at(j) as f32);
            let (phi, theta) = (FRAC_PI_2 * at(i), FRAC_PI_2 * at(j));
            let n = nu * phi.cos().powi(2) + nv * phi.sin().powi(2);
            let p = ((nu + 1.0) * (nv + 1.0)).sqrt() / (8.0 * PI) * theta.cos().powf(n);
            // θ = 90° and what is below the normal numbers count as 0.
            let p = if p < f64::from(f32::MIN_POSITIVE) { 0.0 } else { p };
            let got = power.plane(u, v)[0];
            worst[0] = worst[0].max(if got < f32::MIN_POSITIVE { ulps(0.0, p) } else { ulps(got, p) });
            let part = |c: f64| 1.0 - (1.0 - 0.5 * c).powi(5);
            let d = 28.0 * rd / (23.0 * PI) * (1.0 - rs) * part(at(i)) * part(at(j));
            let got = base.plane(u, v);
            worst[2] = got[..3].iter().map(|x| ulps(*x, d)).fold(worst[2].max(ulps(got[3], at(j))), u32::max);
        }
    }
    println!("units in the last place at the entries of power, F and base: {worst:?}");
    assert!(worst.iter().all(|w| *w <= 4), "{worst:?}");
}

/// Relative RMS error over directions that are at least 12° above the horizon, where nothing diverges.
fn error(brdf: &dyn Brdf, t: &Tables) -> f64 {
    let mut random = Pcg32::new(3, 5);
    let mut direction = || {
        let z = 0.2 + 0.8 * random.next_f64();
        let (phi, s) = (std::f64::consts::TAU * random.next_f64(), (1.0 - z * z).sqrt());
        DVec3::new(s * phi.cos(), s * phi.sin(), z)
    };
    let (mut squares, mut energy) = (0.0, 0.0);
    for _ in 0..20_000 {
        let (wi, wo) = (direction(), direction());
        let got = shade::f_cos(t, wi.as_vec3().to_array(), wo.as_vec3().to_array());
        let exact = brdf.f_cos(wi, wo);
        for c in 0..3 {
            squares += (f64::from(got[c]) - exact[c]).powi(2);
            energy += exact[c] * exact[c];
        }
    }
    (squares / energy).sqrt()
}

/// The error falls fourfold as entries double, within a tenth.
#[test]
fn errors_fall_with_the_square() {
    for spec in SPECS {
        let brdf = parse(spec).expect(spec);
        let [a, b, c] = [65, 129, 257].map(|n| error(&*brdf, &Tables::new(&of(spec), n)));
        for ratio in [a / b, b / c] {
            assert!((3.6..4.4).contains(&ratio), "{spec}: {a:.2e} {b:.2e} {c:.2e}: {ratio:.2}");
        }
    }
}

#[test]
fn what_needs_a_third_number_is_refused_by_its_reason() {
    for (spec, part) in [
        ("cook-torrance:m=0.2", "V-cavity's G needs n·h"),
        ("ggx:ax=0.1,ay=0.4", "D needs the azimuth"),
        ("ward:alpha=0.2", "not ward"),
    ] {
        let why = materials(&*parse(spec).expect(spec)).expect_err("refused");
        assert!(why.contains(part), "{why}");
    }
}
