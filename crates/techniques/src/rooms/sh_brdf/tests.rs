use super::*;
use crate::shared::material::view_table::ViewTable;
use crate::trial::Certified;
use crate::{AnyBake, PointsBuf, find, trial};
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::ParamValues;
use steradian_brdf::{Brdf, Domain, Info, Lobe, Sample};
use steradian_light::DiskLight;
use steradian_sphere::Frame as Local;
use steradian_sphere::sh::{self, ShRgb};

fn bake(slug: &str, lights: &Lights, spec: &str, params: &[(&str, f64)]) -> Box<dyn AnyBake> {
    let material = Material::new(steradian_brdf::parse(spec).unwrap());
    let values: ParamValues = params.iter().copied().collect();
    find(slug).unwrap().draft(lights, &material, None, &values, &Task::quiet()).unwrap()
}

/// Frames all over, with views from the normal down to 80°.
fn points() -> (PointsBuf, Vec<(Local, DVec3)>) {
    let (mut q, mut all) = (PointsBuf::default(), Vec::new());
    for k in 0..40 {
        let n = steradian_prefilter::probe::direction(k, 40);
        let f = Local::from_normal_tangent(n, DVec3::new((k as f64).cos(), 0.4, (2.0 * k as f64).sin()));
        let z = 1.0 - 0.82 * (k as f64 + 0.5) / 40.0;
        let (s, phi) = ((1.0 - z * z).sqrt(), 2.4 * k as f64);
        let local = DVec3::new(s * phi.cos(), s * phi.sin(), z);
        q.push(n.as_vec3(), f.t.as_vec3(), f.to_world(local).as_vec3(), Vec3::ZERO);
        all.push((f, local));
    }
    (q, all)
}

fn shade(b: &dyn AnyBake, q: &PointsBuf) -> [Vec<f32>; 3] {
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    rgb
}

fn off(a: &[Vec<f32>; 3], b: &[Vec<f32>; 3]) -> f64 {
    let scale = b.iter().flatten().fold(0.0f32, |m, x| m.max(x.abs()));
    let worst = (0..3).flat_map(|c| a[c].iter().zip(&b[c])).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    f64::from(worst / scale)
}

#[test]
fn lambert_is_irradiance_from_nine_coefficients() {
    let spec = "lambert:albedo=0.8/0.5/0.2";
    let (q, _) = points();
    for light in [lights::smooth(), lights::studio(), lights::sunny()] {
        let other = shade(&*bake("sh_irradiance", &light, spec, &[]), &q);
        let own = shade(&*bake("sh_brdf", &light, spec, &[("bands", 3.0), ("lights", 0.0)]), &q);
        assert!(off(&own, &other) < 1e-5, "{}", off(&own, &other));
        // Four bands are three: the cosine has no band 3.
        let four = shade(&*bake("sh_brdf", &light, spec, &[("bands", 4.0), ("lights", 0.0)]), &q);
        assert!(off(&four, &other) < 1e-5);
    }
}

/// f_cos of three bands in wi for every view, anisotropic and not separable: 1 + r·wi/2 + wi.x wi.y (r·x)/3
/// over the sphere.
#[derive(Debug)]
struct Limited;

static INFO: Info = Info {
    name: "limited",
    source: "a test",
    formula: "",
    units: "",
    parameters: &[],
    reciprocity: "none",
    energy: "none",
};

impl Brdf for Limited {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        String::new()
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        self.f_cos(wi, wo)
    }

    fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let r = DVec3::new(-wo.x, -wo.y, wo.z);
        let (a, b) = (0.5 * r.dot(wi), wi.x * wi.y * r.x / 3.0);
        [1.0 + a + b, 0.5 + a - b, 0.2 + b]
    }

    fn domain(&self) -> Domain {
        Domain::Sphere
    }

    fn is_isotropic(&self) -> bool {
        false
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

/// Light and reflectance of B bands: the sum is the integral, here by a Gauss rule over the sphere. What the
/// table's spacing h leaves falls with h²: it is below 1e-5 of the largest radiance in 512 × 512 texels.
#[test]
fn band_limited_light_and_reflectance_give_the_integral() {
    const SIZE: usize = 128;
    let (q, frames) = points();
    let (x, w) = steradian_sphere::quadrature::gauss_legendre(8);
    for bands in [3usize, 8] {
        let c =
            std::array::from_fn(|k| (0..bands * bands).map(|i| 0.2 + ((5 * i + k) as f64).sin()).collect());
        let sh = ShRgb { order: bands - 1, c };
        let table = ViewTable::bake(&Limited, bands, SIZE, &Task::quiet()).unwrap();
        let lanes = view_table::LightLanes::new(&table, &sh);
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
        view_table::shade(&table, &lanes, &q.as_points(), &mut Radiance::of(&mut rgb));
        let mut want: [Vec<f32>; 3] = Default::default();
        for (f, wo) in &frames {
            let mut sum = [0.0; 3];
            for (z, wz) in x.iter().zip(&w) {
                for k in 0..16 {
                    let phi = PI * f64::from(k) / 8.0;
                    let s = (1.0 - z * z).sqrt();
                    let wi = DVec3::new(s * phi.cos(), s * phi.sin(), *z);
                    let (l, v) = (sh.value(f.to_world(wi)), Limited.f_cos(wi, *wo));
                    (0..3).for_each(|c| sum[c] += wz * PI / 8.0 * l[c] * v[c]);
                }
            }
            (0..3).for_each(|c| want[c].push(sum[c] as f32));
        }
        assert!(off(&rgb, &want) < 1.6e-4, "{bands}: {}", off(&rgb, &want));
    }
}

/// A circular light of any size and direction has its coefficients in closed form (KSS02 section 3): those of
/// its cap, 2π ∫ P_l = 2π (P_{l−1}(cos r) − P_{l+1}(cos r))/(2l + 1), times y at its centre.
#[test]
fn circular_lights_have_closed_coefficients() {
    let direction = DVec3::new(0.3, 0.8, -0.4).normalize();
    let spec = "ashikhmin-shirley:nu=24,nv=8";
    let (q, _) = points();
    let table = ViewTable::bake(&*steradian_brdf::parse(spec).unwrap(), 5, 32, &Task::quiet()).unwrap();
    let first = bake("sh_brdf", &lights::studio(), spec, &[("size", 32.0), ("lights", 0.0)]);
    for radius in [0.1f64, 0.6, 1.2] {
        let disk = DiskLight { direction, angular_radius: radius, radiance: [2.0, 1.0, 0.5] };
        let lights = Lights { disks: vec![disk], ..Lights::default() };
        let got = shade(&*first.preview(Some(&lights), None, &Task::quiet()).unwrap(), &q);
        let mut p = vec![1.0, radius.cos()];
        (2..7).for_each(|l| {
            let n = l as f64;
            p.push(((2.0 * n - 1.0) * p[1] * p[l - 1] - (n - 1.0) * p[l - 2]) / n);
        });
        let mut y = vec![0.0; 25];
        sh::eval(4, direction, &mut y);
        for (l, band) in (0..5usize).map(|l| (l, l * l..(l + 1) * (l + 1))) {
            let below = if l == 0 { 1.0 } else { p[l - 1] };
            let cap = 2.0 * PI * (below - p[l + 1]) / (2 * l + 1) as f64;
            y[band].iter_mut().for_each(|y| *y *= cap);
        }
        let sh = ShRgb { order: 4, c: disk.radiance.map(|l| y.iter().map(|y| l * y).collect()) };
        let lanes = view_table::LightLanes::new(&table, &sh);
        let mut want: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
        view_table::shade(&table, &lanes, &q.as_points(), &mut Radiance::of(&mut want));
        assert!(off(&got, &want) < 1e-5, "{radius}: {}", off(&got, &want));
    }
}

/// A sun that is shaded exactly costs no accuracy; in the coefficients it does (KSS02 section 7).
#[test]
fn a_sun_apart_is_better_than_one_in_the_bands() {
    let spec = "ashikhmin-shirley:nu=24,nv=8";
    let error =
        |lights: f64| bake("sh_brdf", &lights::sunny(), spec, &[("lights", lights)]).certified().error;
    let (apart, folded) = (error(1.0), error(0.0));
    assert!(apart < 0.3 * folded, "{apart} {folded}");
}

#[test]
fn more_bands_err_less_and_a_window_takes_the_ringing() {
    let spec = "ashikhmin-shirley:nu=12,nv=4";
    let studio = lights::studio();
    let error =
        |bands: f64| bake("sh_brdf", &studio, spec, &[("bands", bands), ("size", 64.0)]).certified().error;
    let all = [3.0, 5.0, 7.0, 10.0].map(error);
    assert!(all.windows(2).all(|w| w[1] < w[0]), "{all:?}");
    // A single window of light: its projection to five bands has negative values, smaller ones with a window
    // over the bands.
    let disk = DiskLight { direction: DVec3::Y, angular_radius: 0.4, radiance: [1.0; 3] };
    let lamp = Lights { disks: vec![disk], ..Lights::default() };
    let (q, _) = points();
    let lowest = |window: f64| {
        let rgb =
            shade(&*bake("sh_brdf", &lamp, spec, &[("window", window), ("size", 32.0), ("lights", 0.0)]), &q);
        let top = rgb[0].iter().fold(0.0f32, |m, x| m.max(*x));
        rgb[0].iter().fold(0.0f32, |m, x| m.min(*x)) / top
    };
    let (plain, windowed) = (lowest(0.0), lowest(6.0));
    assert!(plain < -0.01 && windowed > 0.3 * plain, "{plain} {windowed}");
}

#[test]
fn the_wrong_inputs_say_what_to_do() {
    let t = find("sh_brdf").unwrap();
    let m = |s: &str| Material::new(steradian_brdf::parse(s).unwrap());
    let none = ParamValues::default();
    let e =
        t.bake(&Lights::default(), &m("kajiya-kay:s=10000000"), None, &none, &Task::quiet()).err().unwrap();
    assert!(e.to_string().starts_with("sh_brdf: takes highlights along circles"), "{e}");
    let point = steradian_light::PointLight { position: Vec3::ZERO, intensity: [1.0; 3] };
    let lights = Lights { points: vec![point], ..Lights::default() };
    assert!(t.bake(&lights, &m("ggx:alpha=0.3"), None, &none, &Task::quiet()).is_err());
    let two = ParamValues::from_iter([("bands", 2.0)]);
    assert!(t.bake(&Lights::default(), &m("ggx:alpha=0.3"), None, &two, &Task::quiet()).is_err());
    let small = Task::quiet().with_max_memory(1 << 20);
    let e = t.bake(&Lights::default(), &m("ggx:alpha=0.3"), None, &none, &small).err().unwrap();
    assert!(matches!(e, BakeError::Memory { .. }));
}

/// A bake with its types, of an anisotropic reflectance under a sun, at the sites of `g`.
fn at_sites(fix: &str, halves: bool, g: &Geometry) -> Bake<ShBrdf> {
    let mut values: ParamValues = [("halves", f64::from(u8::from(halves)))].into_iter().collect();
    values.0.insert("fix".into(), fix.into());
    trial::typed(&lights::sunny(), "ggx:ax=0.2,ay=0.5,f0=0.9/0.6/0.3", g, &values)
}

/// At vertices, with light or view static, radiance is that with both free; sites' data are recomputed when
/// the static quantity changes, and only then.
#[test]
fn fixed_light_and_fixed_view_keep_what_stands_still() {
    let mesh = Arc::new(steradian_scene::shapes::icosphere(2));
    let g = Geometry::new(mesh.clone(), crate::Sites::Vertices);
    let view = |angle: f32, eye: Vec3| View {
        light_rotation: glam::Mat3::from_rotation_x(angle),
        eye,
        ..View::default()
    };
    let eyes = [Vec3::new(4.0, 1.0, 0.5), Vec3::new(-1.0, 3.0, 2.0)];
    let shade = |b: &Bake<ShBrdf>, f: &Frame, eye: Vec3| {
        let mut q = PointsBuf::default();
        for (k, (p, n)) in mesh.positions.iter().zip(&mesh.normals).enumerate() {
            let t = Local::from_normal(n.as_dvec3()).t.as_vec3();
            q.push(*n, t, (eye - *p).normalize(), *p);
            q.locate(glam::Vec2::ZERO, [k as u32; 3], [0.0; 2]);
        }
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
        ShBrdf::shade(b, f, &q.as_points(), &mut Radiance::of(&mut rgb));
        rgb
    };
    let free = at_sites("nothing", false, &g);
    // Whole numbers of 16 bits: 25 products of two, each off by 2^-16 of the largest, and 16-bit floats in
    // the table.
    for (fix, halves, most) in [("light", false, 2e-5), ("view", false, 2e-5), ("light", true, 1e-3)] {
        let b = at_sites(fix, halves, &g);
        let (mut f, mut other) = (Frame::default(), Frame::default());
        let mut kept = Vec::new();
        for v in [view(0.4, eyes[0]), view(0.4, eyes[1]), view(1.4, eyes[1]), view(1.4, eyes[1])] {
            ShBrdf::frame(&b, &v, &mut f);
            ShBrdf::frame(&free, &v, &mut other);
            let (a, c) = (shade(&b, &f, v.eye), shade(&free, &other, v.eye));
            assert!(off(&a, &c) < most, "{fix}, {halves}: {}", off(&a, &c));
            kept.push(match &f.kept {
                shade::Kept::Nothing => panic!("{fix}"),
                shade::Kept::Light(l) => Arc::as_ptr(l).addr(),
                shade::Kept::View { views, .. } => Arc::as_ptr(views).addr(),
            });
        }
        let same: Vec<bool> = kept.windows(2).map(|k| k[0] == k[1]).collect();
        let want = if fix == "light" { [true, false, true] } else { [false, true, true] };
        assert_eq!(same, want, "{fix}");
        // Pictures of several cameras prepare each where the view is fixed.
        let mut values = ParamValues::default();
        values.0.insert("fix".into(), fix.into());
        assert_eq!(find("sh_brdf").unwrap().needs_view(&values), fix == "view");
    }
}

#[test]
fn what_stands_still_needs_a_mesh_and_few_bands() {
    let t = find("sh_brdf").unwrap();
    let m = Material::new(steradian_brdf::parse("ggx:alpha=0.3").unwrap());
    let mut values = ParamValues::default();
    values.0.insert("fix".into(), "view".into());
    assert!(t.needs_sites(&values) && !t.needs_sites(&ParamValues::default()));
    let e = t.bake(&Lights::default(), &m, None, &values, &Task::quiet()).err().unwrap();
    assert_eq!(e.to_string(), "sh_brdf: bakes per site of a mesh: give one (`mesh`)");
    values.0.insert("bands".into(), 7.0.into());
    let g = Geometry::new(Arc::new(steradian_scene::shapes::icosphere(1)), crate::Sites::Vertices);
    let e = t.bake(&Lights::default(), &m, Some(&g), &values, &Task::quiet()).err().unwrap();
    assert_eq!(e.to_string(), "sh_brdf: fix=view keeps 6 bands at most, not 7");
}

/// A texture of widths along a line, everywhere else, and in a box.
fn widths(f: impl Fn(f64, f64) -> [f64; 2]) -> Arc<steradian_scene::surface::Texture> {
    use crate::shared::trials::specimens::{SIDE, texture};
    texture(|i, j| {
        let [x, y] = f((i as f64 + 0.5) / SIDE as f64, (j as f64 + 0.5) / SIDE as f64);
        [x, y, 0.0]
    })
}

fn varied(
    spec: &str,
    texture: Arc<steradian_scene::surface::Texture>,
    params: &[(&str, f64)],
) -> Box<dyn AnyBake> {
    let planes = steradian_scene::surface::Planes::default().with("widths", texture);
    let m = Material::new(steradian_brdf::parse(spec).unwrap()).with_textures(planes);
    let values: ParamValues = params.iter().copied().chain([("size", 32.0)]).collect();
    find("sh_brdf").unwrap().draft(&lights::studio(), &m, None, &values, &Task::quiet()).unwrap()
}

fn located(q: &mut PointsBuf, uv: impl Fn(usize) -> [f32; 2]) {
    let n = q.len();
    q.uv = [0, 1].map(|k| (0..n).map(|i| uv(i)[k]).collect());
}

/// Constant widths give one table: that of the reflectance with these widths.
#[test]
fn widths_alike_are_one_reflectance() {
    let (mut q, _) = points();
    let b = varied("ggx:alpha=0.5,f0=0.9/0.6/0.3", widths(|_, _| [0.2, 0.4]), &[]);
    located(&mut q, |i| [0.31 * i as f32, 0.77 * i as f32]);
    let params = [("size", 32.0), ("lights", 0.0)];
    let one = bake("sh_brdf", &lights::studio(), "ggx:ax=0.2,ay=0.4,f0=0.9/0.6/0.3", &params);
    assert!(off(&shade(&*b, &q), &shade(&*one, &q)) < 1e-6);
    assert_eq!(trial::detail(&*b, "tables"), 1.0);
}

/// At texels whose widths are a node's, shading is that of the node's reflectance; between nodes the error is
/// within the measured one, and a quarter of that with twice the nodes.
#[test]
fn tables_of_a_line_of_exponents_are_those_of_its_nodes() {
    let spec = "ashikhmin-shirley:nu=1,nv=1";
    let ends = widths(|x, _| if x < 0.5 { [4.0; 2] } else { [64.0; 2] });
    let (mut q, _) = points();
    for (uv, n) in [([0.25, 0.5], 4), ([0.75, 0.5], 64)] {
        located(&mut q, |_| uv);
        let b = varied(spec, ends.clone(), &[("nodes", 2.0)]);
        let alone = format!("ashikhmin-shirley:nu={n},nv={n}");
        let one = bake("sh_brdf", &lights::studio(), &alone, &[("size", 32.0), ("lights", 0.0)]);
        assert!(off(&shade(&*b, &q), &shade(&*one, &q)) < 2e-5, "{n}");
    }
    let ramp = widths(|x, _| [4.0 * 16f64.powf(x); 2]);
    let figure =
        |nodes: f64, name: &str| trial::detail(&*varied(spec, ramp.clone(), &[("nodes", nodes)]), name);
    let (coarse, fine) = (figure(3.0, "error between tables"), figure(5.0, "error between tables"));
    assert!(coarse > 3.0 * fine && fine > 1e-3, "{coarse} {fine}");
    // Between nodes: the reflectance of the texel itself.
    let b = varied(spec, ramp, &[]);
    assert!(trial::detail(&*b, "error between tables") <= 0.01);
    for x in [0.2f32, 0.45, 0.61] {
        located(&mut q, |_| [x, 0.5]);
        // Texels' centres lie at half-integers, their logarithms are linear between them.
        let n = 4.0 * 16f64.powf(f64::from(x));
        let alone = format!("ashikhmin-shirley:nu={n},nv={n}");
        let one = bake("sh_brdf", &lights::studio(), &alone, &[("size", 32.0), ("lights", 0.0)]);
        let e = off(&shade(&*b, &q), &shade(&*one, &q));
        assert!(e < 0.01, "{x}: {e}");
    }
}

/// Two numbers that vary apart need a box of tables; two along a curve whose product is constant do not.
#[test]
fn anisotropy_is_a_line_and_two_numbers_are_a_box() {
    let tables = |b: &dyn AnyBake| trial::detail(b, "tables");
    let spec = "ashikhmin-shirley:nu=10,nv=10,rd=0.2";
    let line = varied(spec, widths(|x, _| [10.0 * 4f64.powf(x), 10.0 / 4f64.powf(x)]), &[("nodes", 4.0)]);
    assert_eq!(tables(&*line), 4.0);
    let apart = varied(spec, widths(|x, y| [4.0 + 8.0 * x, 4.0 + 8.0 * y]), &[("nodes", 3.0)]);
    assert_eq!(tables(&*apart), 9.0);
    let c = apart.certified();
    // The stated error holds at points where it was not measured.
    let (mut q, frames) = points();
    located(&mut q, |i| [0.17 * i as f32 + 0.03, 0.29 * i as f32]);
    let got = shade(&*apart, &q);
    let reference = steradian_reference::Reference::new(
        &lights::studio(),
        steradian_reference::Lookup::Constant,
        &Task::quiet(),
    )
    .unwrap();
    let (mut lost, mut all) = (0.0, 0.0);
    for (i, (f, wo)) in frames.iter().enumerate() {
        let [x, y] = [q.uv[0][i], q.uv[1][i]].map(|x| f64::from(x).rem_euclid(1.0));
        let exact = format!("ashikhmin-shirley:nu={},nv={},rd=0.2", 4.0 + 8.0 * x, 4.0 + 8.0 * y);
        let point = steradian_reference::ReferencePoint { frame: *f, wo: f.to_world(*wo), position: None };
        let brdf = steradian_brdf::parse(&exact).unwrap();
        let want = reference.radiance_batch(&*brdf, &[point], 1e-3, &Task::quiet()).unwrap()[0].rgb;
        for k in 0..3 {
            lost += (f64::from(got[k][i]) - want[k]).powi(2);
            all += want[k] * want[k];
        }
    }
    let error = (lost / all).sqrt();
    assert!(error < 1.3 * c.error, "{error} {}", c.error);
    // A bake loads completely.
    let again = find("sh_brdf").unwrap().load(&apart.save()).unwrap();
    assert_eq!(shade(&*again, &q), got);
    assert!(again.is_textured());
}

#[test]
fn widths_that_a_model_does_not_take_are_refused() {
    let planes = |x: f64| steradian_scene::surface::Planes::default().with("widths", widths(|_, _| [x, 0.5]));
    let why = |spec: &str, x: f64, fix: &str| {
        let m = Material::new(steradian_brdf::parse(spec).unwrap()).with_textures(planes(x));
        let mut values = ParamValues::default();
        values.0.insert("fix".into(), fix.into());
        let g = Geometry::new(Arc::new(steradian_scene::shapes::icosphere(1)), crate::Sites::Vertices);
        let lights = Lights::default();
        find("sh_brdf")
            .unwrap()
            .draft(&lights, &m, Some(&g), &values, &Task::quiet())
            .err()
            .unwrap()
            .to_string()
    };
    assert_eq!(why("lambert", 0.5, "nothing"), "sh_brdf: BRDF lambert: has no width and no exponent to vary");
    assert!(why("ggx:alpha=0.2", 50.0, "nothing").contains("ax"));
    assert_eq!(
        why("ggx:alpha=0.2", 0.5, "light"),
        "sh_brdf: fix=light keeps one reflectance: leave out fix or widths"
    );
}
