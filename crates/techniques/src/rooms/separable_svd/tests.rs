use super::coordinates::{Coordinates, Form, Node};
use super::samples::Samples;
use super::{SeparableSvd, shade};
use crate::Material;
use crate::local::LocalTechnique;
use steradian_base::{ParamValues, Params as _, Task};
use steradian_brdf::Symmetry;
use steradian_brdf::parse;

const WARD: &str = "ward:ax=0.15,ay=0.4,variant=1992";

fn samples(spec: &str, form: Form, side: usize) -> Samples {
    let brdf = parse(spec).expect(spec);
    let c = Coordinates::new(form, Symmetry::of(&*brdf), side);
    Samples::new(&*brdf, c, &Task::quiet()).expect("nobody cancels")
}

fn tables(spec: &str, params: &[(&str, &str)]) -> super::Tables {
    let values: ParamValues = params.iter().copied().collect();
    let p = super::Params::from_values(&values).expect("parameters");
    super::bake::bake(&Material::new(parse(spec).expect(spec)), &p, &Task::quiet()).expect("bakes")
}

/// Terms to 5 % of f (n·l), and σ₁/σ₀.
fn terms(s: &Samples, most: usize) -> (usize, Option<f64>) {
    let (f, ratio) = s.decompose([1, most], 0.05, &Task::quiet()).expect("nobody cancels");
    (f.left.len(), ratio)
}

/// ‖M − M_K‖² = Σ_{k≥K} σ_k², entry by entry, for every K.
#[test]
fn what_is_left_is_the_sum_of_the_other_squares() {
    let s = samples("ggx:alpha=0.4,f0=0.9/0.6/0.3", Form::ViewLight, 12);
    let all = s.svd(usize::MAX);
    let sum: f64 = all.values.iter().map(|s| s * s).sum();
    assert!((sum / all.square - 1.0).abs() < 1e-6, "{sum} {}", all.square);
    for count in [1, 2, 5, 20] {
        let (f, _) = s.decompose([count; 2], 0.0, &Task::quiet()).expect("nobody cancels");
        let others: f64 = all.values[count..].iter().map(|s| s * s).sum::<f64>() / all.square;
        assert!((f.residual / others - 1.0).abs() < 1e-3, "{count}: {} {others}", f.residual);
        // The error is computed again from the terms themselves.
        let (mut left, mut square) = (0.0, 0.0);
        let [x, y] = [s.coordinates.x, s.coordinates.y].map(|m| Node::all(&m));
        for i in 0..s.coordinates.x.len() {
            for j in 0..s.coordinates.y.len() {
                let w = s.coordinates.pair(&x[i], &y[j]).weight;
                for (c, m) in s.colours.iter().enumerate() {
                    let m = f64::from(m.row(i)[j]);
                    let sum: f64 = (0..count).map(|k| f.left[k][i] * f.right[c][k][j]).sum();
                    left += w * (m - sum).powi(2);
                    square += w * m * m;
                }
            }
        }
        assert!((left / square / others - 1.0).abs() < 1e-2, "{count}: {} {others}", left / square);
    }
}

/// One term is all of Lambert's and Minnaert's over (v, l), and of D(h) F(d) over (h, d).
#[test]
fn products_have_rank_one() {
    for spec in ["lambert:albedo=0.8/0.5/0.2", "minnaert:k=1.4", "minnaert:k=0.65,albedo=0.9/0.6/0.3"] {
        let s = samples(spec, Form::ViewLight, 16).svd(2);
        assert!(s.values.get(1).is_none_or(|second| second / s.values[0] < 1e-6), "{spec}: {:?}", s.values);
    }
    // The power of n·h times Schlick's term is D(h) F(d) once the cosines of Ashikhmin and Shirley's model
    // are divided out.
    let (brdf, nh) = (parse("lambert").expect("lambert"), 20.0);
    for isotropic in [true, false] {
        let symmetry = Symmetry { isotropic, ..Symmetry::of(&*brdf) };
        let form = if isotropic { Form::IsotropicHalfDifference } else { Form::HalfDifference };
        let product = Product { nh };
        let s = Samples::new(&product, Coordinates::new(form, symmetry, 16), &Task::quiet())
            .expect("nobody cancels");
        let (f, _) = s.decompose([1, 1], 0.0, &Task::quiet()).expect("nobody cancels");
        // Up to single-precision rounding.
        assert!(f.residual.sqrt() < 3e-4, "{form:?}: {}", f.residual.sqrt());
    }
}

/// f = D(h) F(d), coloured.
#[derive(Debug)]
struct Product {
    nh: f64,
}

impl steradian_brdf::Brdf for Product {
    fn info(&self) -> &'static steradian_brdf::Info {
        &steradian_brdf::model::lambert::INFO
    }
    fn spec(&self) -> String {
        "lambert".into()
    }
    fn eval(&self, wi: glam::DVec3, wo: glam::DVec3) -> [f64; 3] {
        let h = (wi + wo).normalize();
        let u = (1.0 - h.dot(wi)).powi(5);
        [0.9, 0.6, 0.3].map(|f: f64| h.z.powf(self.nh) * (f + (1.0 - f) * u))
    }
    fn lobes(&self, _: glam::DVec3) -> Vec<steradian_brdf::Lobe> {
        Vec::new()
    }
    fn sample(&self, _: glam::DVec3, _: glam::DVec2) -> Option<steradian_brdf::Sample> {
        None
    }
    fn pdf(&self, _: glam::DVec3, _: glam::DVec3) -> f64 {
        0.0
    }
}

/// Over (v, l) a highlight is a diagonal, whose spectrum is flat; over (h, d) it is two products.
#[test]
fn the_half_vector_is_what_makes_ward_s_highlight_separable() {
    let s = samples(WARD, Form::ViewLight, 32);
    let (count, ratio) = terms(&s, 200);
    // By weights of f (n·l); 82 terms where there are 64 × 64 nodes.
    let ratio = ratio.expect("singular values");
    assert!((50..120).contains(&count) && ratio > 0.8, "{count} {ratio}");
    // f itself, node by node, without weights.
    let plain = steradian_numerics::svd::leading(&s.colours[0], 200, 1e-5);
    println!("{count} terms, {ratio:.3} weighted, {:.4} plain", plain.values[1] / plain.values[0]);
    assert!(plain.values[1] > 0.99 * plain.values[0], "{:?}", &plain.values[..4]);
    // Nearer to the horizon this form of the model has no bound.
    for (degrees, most) in [(2.0f64, 2), (0.1, 8)] {
        let brdf = parse(WARD).expect(WARD);
        let lowest = degrees.to_radians().sin();
        let c = Coordinates { lowest, ..Coordinates::new(Form::HalfDifference, Symmetry::of(&*brdf), 24) };
        let s = Samples::new(&*brdf, c, &Task::quiet()).expect("nobody cancels");
        let (count, _) = terms(&s, 16);
        println!("from {degrees}° on: {count} terms");
        assert!(count <= most, "{degrees}: {count}");
    }
}

/// The better coordinates are found: (h, d) for a highlight, one term whatever they are for Lambert.
#[test]
fn coordinates_are_chosen_by_the_terms_they_take() {
    let small = ("resolution", "16");
    assert_eq!(tables("ggx:alpha=0.2", &[small]).coordinates.form, Form::IsotropicHalfDifference);
    assert_eq!(tables(WARD, &[small]).coordinates.form, Form::HalfDifference);
    let t = tables("lambert:albedo=0.8/0.5/0.2", &[small]);
    assert_eq!((t.terms, t.tint.is_some(), t.coordinates.form), (1, true, Form::ViewLight));
    assert_eq!(tables("minnaert:k=1.4", &[small]).coordinates.form, Form::ViewLight);
}

/// Pairs below the horizon are missing, not 0: with zeros in their place one term of D(h) F(d) would have an
/// error.
#[test]
fn below_the_horizon_is_missing() {
    let t = tables("blinn-phong:n=12", &[("parametrisation", "hd"), ("terms", "1")]);
    // f is D(h) alone: exact up to the spacing of entries, at grazing pairs too.
    let brdf = parse("blinn-phong:n=12").expect("a spec");
    for (wi, wo) in [([0.9, 0.1, 0.1], [-0.5, -0.7, 0.3]), ([0.9, 0.2, 0.1], [0.3, 0.2, 0.9])] {
        let (wi, wo) = (glam::DVec3::from_array(wi).normalize(), glam::DVec3::from_array(wo).normalize());
        let got = shade::f_cos(&t, wi.as_vec3().to_array(), wo.as_vec3().to_array())[1];
        let exact = brdf.f_cos(wi, wo)[1];
        assert!((f64::from(got) / exact - 1.0).abs() < 0.02, "{wi}: {got} {exact}");
    }
}

/// Normalised decomposition: not negative, exact for products without missing pairs, never better than least
/// squares.
#[test]
fn normalised_decomposition_is_a_mean() {
    let exact = samples("minnaert:k=1.4", Form::ViewLight, 16).normalised();
    assert!(exact.residual.sqrt() < 1e-6, "{}", exact.residual.sqrt());
    let s = samples("ggx:alpha=0.3", Form::IsotropicHalfDifference, 24);
    let (mean, (least, _)) =
        (s.normalised(), s.decompose([1, 1], 0.0, &Task::quiet()).expect("nobody cancels"));
    assert!(mean.left[0].iter().chain(&mean.right[0][0]).all(|x| *x >= 0.0));
    assert!(mean.residual >= least.residual, "{} {}", mean.residual, least.residual);
}

/// Terms beyond the first lower the error, whatever the coordinates.
#[test]
fn more_terms_err_less() {
    for form in [Form::IsotropicHalfDifference, Form::ViewLight, Form::HalfView] {
        let s = samples("dielectric:alpha=0.3,albedo=0.6/0.3/0.1", form, 12);
        let residual = |n| s.decompose([n, n], 0.0, &Task::quiet()).expect("nobody cancels").0.residual;
        let all: Vec<f64> = (1..6).map(residual).collect();
        assert!(all.windows(2).all(|r| r[1] < r[0]), "{form:?}: {all:?}");
    }
}

#[test]
fn light_from_behind_is_refused() {
    let brdf = parse("phong-map:n=9").expect("a spec");
    let why = (SeparableSvd::CARD.materials)(&*brdf).expect_err("refused");
    assert!(why.contains("from above"), "{why}");
}

/// Tables of every form reproduce their reflectance.
#[test]
fn tables_shade_what_they_were_made_of() {
    for (spec, parametrisation, within) in [
        ("ward:ax=0.15,ay=0.4", "hd", 0.03),
        ("ward:ax=0.15,ay=0.4,variant=1992", "hd", 0.3),
        ("ggx:alpha=0.4,f0=0.9/0.6/0.3", "hd", 0.03),
        ("ggx:alpha=0.6,f0=0.9/0.6/0.3", "hv", 0.1),
        ("oren-nayar:sigma=0.35", "vl", 0.05),
    ] {
        let t = tables(spec, &[("parametrisation", parametrisation), ("resolution", "32")]);
        let brdf = parse(spec).expect(spec);
        let exact = |wi, wo| brdf.f_cos(wi, wo);
        let error = crate::local::error(&*brdf, &exact, |wi, wo| shade::f_cos(&t, wi, wo));
        assert!(error < within, "{spec} {parametrisation}: {error}, {} at entries", t.residual);
    }
}
