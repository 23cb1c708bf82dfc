//! The checks of techniques for local light: what holds for directional and point lights, and the furnace
//! made of many directional lights.

use super::harness::{Made, material, once};
use super::table;
use glam::{DMat3, DVec3, Mat3, Vec3};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::sync::Mutex;
use steradian_base::{ParamValues, Task};
use steradian_light::{DirectionalLight, Lights, PointLight};
use steradian_reference::{Lookup, Reference, ReferencePoint};
use steradian_scene::surface::Planes;
use steradian_scene::{Bvh, Mesh, Ray};
use steradian_sphere::Frame;
use steradian_sphere::quadrature::gauss_legendre;
use steradian_techniques::local::{
    AnyLocal, Content, LocalBake, LocalFrame, LocalLights, Pair, Place, pairs, texel,
};
use steradian_techniques::shared::trials::{lights, specimens};
use steradian_techniques::{BakeError, Check, PointsBuf, Radiance, View, find_local, gpu, locals};
use steradian_testkit::full;

/// A bake of a specimen with one value per point, made once for all checks of this process.
fn shared(t: &dyn AnyLocal, spec: &'static str) -> &'static dyn LocalBake {
    static MADE: Made<2, dyn LocalBake> = Mutex::new(BTreeMap::new());
    once(&MADE, [t.card().slug, spec], || bake(t, spec, t.per_point()))
}

fn bake(t: &dyn AnyLocal, spec: &str, params: &[(&str, f64)]) -> Box<dyn LocalBake> {
    bake_with(t, spec, params, Planes::default())
}

fn bake_with(t: &dyn AnyLocal, spec: &str, params: &[(&str, f64)], planes: Planes) -> Box<dyn LocalBake> {
    let params: ParamValues = params.iter().copied().collect();
    t.bake(&material(spec).with_textures(planes), None, &params, &Task::quiet())
        .expect("a bake that the Card promises")
}

fn local(l: &Lights) -> LocalLights {
    LocalLights { directionals: l.directionals.clone(), points: l.points.clone() }
}

/// Points of the unit ball with views about the normal.
fn points(n: usize) -> Vec<ReferencePoint> {
    let mut out = super::harness::points(n);
    out.iter_mut().for_each(|p| p.position = Some(p.frame.n));
    out
}

/// [`points`] with views down to the horizon, as certificates have them.
fn to_the_horizon(n: usize) -> Vec<ReferencePoint> {
    let mut out = points(n);
    for p in &mut out {
        let wo = p.frame.to_local(p.wo);
        // The cosines of [`points`] end at 0.17.
        let z = (1.0 - (1.0 - wo.z) / 0.83).max(1e-4);
        let s = ((1.0 - z * z) / (1.0 - wo.z * wo.z).max(1e-12)).sqrt();
        p.wo = p.frame.to_world(DVec3::new(s * wo.x, s * wo.y, z)).normalize();
    }
    out
}

fn buffer(points: &[ReferencePoint]) -> PointsBuf {
    let mut q = PointsBuf::default();
    for p in points {
        let position = p.position.expect("a position");
        q.push(p.frame.n.as_vec3(), p.frame.t.as_vec3(), p.wo.as_vec3(), position.as_vec3());
    }
    q
}

fn shade(b: &dyn LocalBake, l: &LocalLights, view: &View, q: &PointsBuf) -> Vec<[f64; 3]> {
    let frame = LocalFrame { lights: l, view, mesh: None, shadowed: false };
    let shading = b.lit(&frame).expect("no mesh is needed");
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
    shading.add(None, &q.as_points(), &mut Radiance::of(&mut rgb));
    (0..q.len()).map(|i| [0, 1, 2].map(|c| f64::from(rgb[c][i]))).collect()
}

fn judged(l: &Lights, spec: &str, points: &[ReferencePoint]) -> Vec<[f64; 3]> {
    let reference = Reference::new(l, Lookup::Constant, &Task::quiet()).expect("a sound light");
    let values = reference.radiance_batch(&*material(spec).brdf, points, 1e-4, &Task::quiet());
    values.expect("nobody cancels").iter().map(|e| e.rgb).collect()
}

use super::harness::{Found, difference};

/// Every technique with each of its specimens.
fn each() -> impl Iterator<Item = (&'static dyn AnyLocal, &'static str)> {
    locals().iter().flat_map(|t| t.card().specimens.iter().map(move |spec| (*t, *spec)))
}

#[test]
fn local_cards_keep_their_word() {
    for t in locals() {
        let card = t.card();
        assert!(!card.capabilities.global && !card.specimens.is_empty());
        assert_eq!(card.exact_when.is_empty(), card.waived(Check::ExactWhen).is_some(), "{}", card.slug);
        assert_eq!(find_local(&card.slug.replace('_', "-")).map(|t| t.card().slug), Some(card.slug));
        assert!(steradian_techniques::find(card.slug).is_none(), "{}: one name, one technique", card.slug);
        for spec in card.specimens.iter().copied().chain(card.exact_when.iter().map(|c| c.brdf)) {
            assert_eq!((card.materials)(&*material(spec).brdf), Ok(()), "{}: {spec}", card.slug);
        }
        for p in t.params() {
            let default = p.default_value().expect("every parameter has a default");
            assert_eq!(p.check(&default), Ok(default), "{}: {}", card.slug, p.name);
        }
    }
}

#[test]
fn local_techniques_are_exact_where_their_cards_say_so() {
    let points = points(96);
    let q = buffer(&points);
    for t in locals() {
        for c in t.card().exact_when {
            let light = (c.light)();
            let got = shade(&*bake(*t, c.brdf, c.params), &local(&light), &View::default(), &q);
            let error = difference(&got, &judged(&light, c.brdf, &points));
            println!("{}: {}: {error:.2e}", t.card().slug, c.statement);
            assert!(error <= c.within, "{}: {}: {error:.2e}", t.card().slug, c.statement);
        }
    }
}

/// Errors under a near point light and three directional ones are the recorded ones, and certificates are
/// honest.
#[test]
fn errors_of_local_techniques_are_the_recorded_ones() {
    let points = points(256);
    let q = buffer(&points);
    let mut lines = Vec::new();
    for (t, spec) in each() {
        let b = shared(t, spec);
        for (name, light) in [("point", lights::near_point()), ("directionals", lights::three_directionals())]
        {
            let got = shade(b, &local(&light), &View::default(), &q);
            let error = difference(&got, &judged(&light, spec, &points));
            lines.push(table::Line::new([t.card().slug, spec, name], error, b.certificate().error, || {
                let points = to_the_horizon(4096);
                let got = shade(b, &local(&light), &View::default(), &buffer(&points));
                Found { error: difference(&got, &judged(&light, spec, &points)), sigma: 0.0 }
            }));
            // A table of the reflectance itself is exact up to the spacing of entries; a sum of products is
            // as good as the tolerance, 1 % where none is given; a single product is as good as its form.
            let within = match t.card().slug {
                _ if t.card().waived(Check::ExactWhen).is_some() => f64::INFINITY,
                "separable_svd" => 1e-2,
                "homomorphic" => 0.5,
                // A parabola is no cosine.
                "polynomial_texture_map" => 0.2,
                // Between directions 15° apart.
                "btf_pca" if spec != "lambert:albedo=0.6" => 0.2,
                _ => 1e-3,
            };
            assert!(error <= within, "{}: {spec}: {name}: {error:.2e}", t.card().slug);
        }
        for (of, label, params) in
            BESIDE.iter().filter(|b| b.0 == t.card().slug && b.1 == spec).map(|b| (b.1, b.2, b.3))
        {
            let b = bake(t, of, params);
            let light = lights::three_directionals();
            let at = |points: &[ReferencePoint]| {
                let got = shade(&*b, &local(&light), &View::default(), &buffer(points));
                difference(&got, &judged(&light, of, points))
            };
            let key = [t.card().slug, label, "directionals"];
            let precise = || Found { error: at(&to_the_horizon(4096)), sigma: 0.0 };
            lines.push(table::Line::new(key, at(&points), b.certificate().error, precise));
        }
        if t.planes().iter().any(|p| p.content == Content::Heights) {
            let heights: Vec<_> =
                t.planes().iter().copied().filter(|p| p.content == Content::Heights).collect();
            let b = bake_with(t, spec, &[("relief", RELIEF)], specimens::planes(&heights));
            let error = on_bumps(t, &*b, spec);
            let precise = || Found { error, sigma: 0.0 };
            lines.push(table::Line::new(
                [t.card().slug, spec, "bumps"],
                error,
                b.certificate().error,
                precise,
            ));
        }
    }
    table::compare_with("local_errors.txt", &lines);
}

/// Technique, reflectance, the name of the case in the record, and its parameters.
type Beside = (&'static str, &'static str, &'static str, &'static [(&'static str, f64)]);

/// Parameters that are recorded in addition to the defaults.
const BESIDE: [Beside; 3] = [
    ("polynomial_texture_map", "lambert:albedo=0.6", "lambert:albedo=0.6, basis=sh9", &[("basis", 1.0)]),
    ("polynomial_texture_map", "lambert:albedo=0.6", "lambert:albedo=0.6, basis=sh16", &[("basis", 2.0)]),
    (
        "btf_pca",
        "ggx:alpha=0.6,f0=0.9/0.6/0.3",
        "ggx:alpha=0.6,f0=0.9/0.6/0.3, method=chained",
        &[("method", 2.0)],
    ),
];

/// Height of white over the width of the map, on bumps.
const RELIEF: f64 = 0.15;

/// The heights as a mesh in the plane of x and z, y up, of three periods each way; the middle one begins at
/// (0, 0).
fn relief() -> Mesh {
    let n = specimens::SIDE;
    let side = 3 * n + 1;
    let mut mesh = Mesh::default();
    for k in 0..side * side {
        let (i, j) = (k % side, k / side);
        let y = RELIEF * n as f64 * specimens::height(i % n, j % n);
        mesh.positions.push(DVec3::new(i as f64 - n as f64, y, j as f64 - n as f64).as_vec3());
    }
    for k in 0..(side - 1) * (side - 1) {
        let (i, j) = (k % (side - 1), k / (side - 1));
        let [a, b, c, d] =
            [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)].map(|(i, j)| (j * side + i) as u32);
        // Cut from the upper left to the lower right.
        mesh.triangles.extend([[a, c, d], [a, d, b]]);
    }
    mesh
}

/// Error on the texels of a bumpy texture, each under a directional light of its own, with the lights, views
/// and weights of certificates. The reference evaluates the reflectance about the bump's normal, by central
/// differences, and casts a ray to the light through a mesh of the heights where the technique has shadows.
/// Most of the error is in a few grazing views whose highlight is hidden, or should be: uniform directions
/// would miss them.
fn on_bumps(t: &dyn AnyLocal, b: &dyn LocalBake, spec: &'static str) -> f64 {
    let n = specimens::SIDE;
    let bvh = Bvh::build(&relief());
    let height = |i: usize, j: usize| RELIEF * n as f64 * specimens::height(i % n, j % n);
    // Tangent X, normal Y, bitangent −Z, as rows run downwards.
    let world = |d: DVec3| DVec3::new(d.x, d.z, -d.y);
    let (mut got, mut exact) = (Vec::new(), Vec::new());
    for (k, Pair { wi, wo, weight }) in pairs(&*material(spec).brdf, 1 << 13) {
        let (place, [i, j]) = texel(k, (n, n));
        let slope = |a: f64, b: f64| 0.5 * (b - a);
        let (dx, dz) =
            (slope(height(i + n - 1, j), height(i + 1, j)), slope(height(i, j + n - 1), height(i, j + 1)));
        let bump = DVec3::new(-dx, 1.0, -dz).normalize();
        // Views that a bump turns away from are bent.
        if bump.dot(world(wo)) < 0.02 {
            continue;
        }
        let single = |d: DVec3| d.as_vec3().to_array();
        got.push(b.f_cos_at(place, single(wi), single(wo)).map(|x| weight.sqrt() * f64::from(x)));
        let at = DVec3::new(i as f64, height(i, j), j as f64) + 1e-3 * DVec3::Y;
        let ray = Ray { origin: at.as_vec3(), direction: world(wi).as_vec3() };
        let dark = t.card().capabilities.self_shadowing && bvh.occluded(&ray, f32::INFINITY);
        let light = DirectionalLight { direction: world(wi), irradiance: [1.0; 3] };
        let one = Lights { directionals: vec![light], ..Lights::default() };
        let frame = Frame::from_normal_tangent(bump, DVec3::X);
        let point = ReferencePoint { frame, wo: world(wo), position: None };
        let lit = if dark { [0.0; 3] } else { judged(&one, spec, &[point])[0] };
        exact.push(lit.map(|x| weight.sqrt() * x));
    }
    difference(&got, &exact)
}

/// 24 × 48 directional lights with the weights of a product rule are constant light, whose radiance is the
/// albedo.
#[test]
fn many_directional_lights_are_a_furnace() {
    let (x, w) = gauss_legendre(24);
    let mut light = LocalLights::default();
    for (x, w) in x.iter().zip(&w) {
        for k in 0..48 {
            let phi = TAU * (f64::from(k) + 0.5) / 48.0;
            let s = (1.0 - x * x).sqrt();
            light.directionals.push(DirectionalLight {
                direction: DVec3::new(s * phi.cos(), s * phi.sin(), *x),
                irradiance: [w * TAU / 48.0; 3],
            });
        }
    }
    let total: f64 = light.directionals.iter().map(|d| d.irradiance[0]).sum();
    assert!((total - 4.0 * PI).abs() < 1e-12);
    // Normals on the axis of the product rule, so that the horizon lies between its rows.
    let points: Vec<ReferencePoint> = (0..40)
        .map(|k| {
            let (z, phi) = (0.3 + 0.7 * f64::from(k) / 40.0, f64::from(k) * 2.4);
            let s = (1.0 - z * z).sqrt();
            let wo = DVec3::new(s * phi.cos(), s * phi.sin(), z);
            let frame = Frame::from_normal(DVec3::Z);
            ReferencePoint { frame, wo: frame.to_world(wo), position: Some(DVec3::ZERO) }
        })
        .collect();
    let q = buffer(&points);
    // Lobes that the rule resolves.
    for (slug, spec, within) in [
        ("vertex_analytic", "lambert:albedo=0.7", 2e-3),
        ("vertex_analytic", "minnaert:k=0.65", 5e-3),
        ("precomputed_visibility", "lambert:albedo=0.7", 2e-3),
        ("banks_table", "banks:n=6", 5e-3),
        ("bump_blinn_phong", "blinn-phong-gl:kd=0.5,ks=0.3,n=8", 5e-3),
        ("bump_horizon", "lambert:albedo=0.7", 2e-3),
        ("polynomial_texture_map", "lambert:albedo=0.7", 1e-2),
        ("btf_pca", "lambert:albedo=0.7", 2e-3),
        ("lafortune_svbrdf", "lafortune:cx=-0.9,cy=-0.8,cz=0.9,n=4,ks=0.3,kd=0.3", 5e-3),
        ("shift_variant", "ward:ax=0.4,ay=0.6,rs=0.4,rd=0.4", 1e-2),
        ("analytic_decomposition", "ggx:alpha=0.6,f0=0.9/0.6/0.3", 5e-3),
        ("analytic_decomposition", "cook-torrance:m=0.6,f0=0.5,g=smith", 1e-2),
        ("analytic_decomposition", "ashikhmin-shirley:nu=4,nv=8,rs=0.3,rd=0.5", 1e-2),
        ("separable_svd", "lambert:albedo=0.8/0.5/0.2", 5e-3),
        ("separable_svd", "ggx:alpha=0.6,f0=0.9/0.6/0.3", 2e-2),
        ("homomorphic", "cook-torrance:m=0.6,f0=1,g=smith", 1e-2),
    ] {
        let t = find_local(slug).expect("a technique");
        let got = shade(&*bake(t, spec, t.per_point()), &light, &View::default(), &q);
        let albedo = judged(&lights::furnace(), spec, &points);
        let error = difference(&got, &albedo);
        assert!(error <= within, "{slug}: {spec}: {error:.2e}");
    }
}

#[test]
fn local_techniques_are_linear_and_turn_with_light_and_frame() {
    let points = points(64);
    let q = buffer(&points);
    let (one, other) = (local(&lights::near_point()), local(&lights::three_directionals()));
    let r = DMat3::from_rotation_z(0.9) * DMat3::from_rotation_y(2.0);
    for (t, spec) in each() {
        let b = shared(t, spec);
        let of = |l: &LocalLights| shade(b, l, &View::default(), &q);
        let mut both = one.clone();
        both.directionals.extend(&other.directionals);
        let sum: Vec<_> =
            of(&one).iter().zip(of(&other)).map(|(x, y)| std::array::from_fn(|c| x[c] + y[c])).collect();
        assert!(difference(&of(&both), &sum) < 1e-6, "{}: {spec}: sum", t.card().slug);
        let mut twice = both.clone();
        twice.directionals.iter_mut().for_each(|d| d.irradiance = d.irradiance.map(|x| 2.0 * x));
        twice.points.iter_mut().for_each(|p| p.intensity = p.intensity.map(|x| 2.0 * x));
        let two: Vec<_> = sum.iter().map(|l| l.map(|x| 2.0 * x)).collect();
        assert!(difference(&of(&twice), &two) < 1e-6, "{}: {spec}: twice", t.card().slug);
        // Directional lights turn with the frame's light, points with their places.
        let moved: Vec<ReferencePoint> = points
            .iter()
            .map(|p| ReferencePoint {
                frame: Frame { t: r * p.frame.t, b: r * p.frame.b, n: r * p.frame.n },
                wo: r * p.wo,
                position: p.position.map(|p| r * p),
            })
            .collect();
        let mut there = both.clone();
        there.points.iter_mut().for_each(|p| p.position = (r * p.position.as_dvec3()).as_vec3());
        let view = View { light_rotation: r.as_mat3(), ..View::default() };
        let turned = shade(b, &there, &view, &buffer(&moved));
        assert!(difference(&turned, &sum) < 2e-4, "{}: {spec}: turned", t.card().slug);
        assert_ne!(view.light_rotation, Mat3::IDENTITY);
    }
}

/// Finite wherever the light is, on the surface and at the point itself among others, and black from behind.
#[test]
fn a_light_on_the_surface_gives_finite_radiance() {
    let mut q = PointsBuf::default();
    for n in [Vec3::Y, Vec3::X, Vec3::NEG_Z, Vec3::ONE.normalize()] {
        let t = n.any_orthonormal_vector();
        for c in [1.0f32, 0.5, 1e-3, 1e-7, 0.0, -0.5, -1.0] {
            q.push(n, t, n * c + t * (1.0 - c * c).max(0.0).sqrt(), n);
        }
    }
    let far = [0.0f32, 1e-30, 1e-20, 1e-12, 1e-6, 1e-3];
    let point = |d: f32, up: Vec3| PointLight { position: Vec3::Y + d * up, intensity: [1e3, 9e29, 0.0] };
    let mut light = LocalLights::default();
    light
        .points
        .extend(far.iter().flat_map(|d| [point(*d, Vec3::Y), point(*d, Vec3::X), point(*d, Vec3::NEG_Y)]));
    light.directionals.push(DirectionalLight { direction: DVec3::X, irradiance: [9e29; 3] });
    light.directionals.push(DirectionalLight { direction: DVec3::NEG_Y, irradiance: [9e29; 3] });
    let more = ["ggx:alpha=0.0001,f0=1", "banks:n=100000", "ashikhmin-shirley:nu=100000,nv=1"];
    for t in locals() {
        let taken = more.into_iter().filter(|s| (t.card().materials)(&*material(s).brdf).is_ok());
        let params: ParamValues = t.per_point().iter().copied().collect();
        // Coarse tables: those of the sharpest lobes to the usual tolerance are large.
        let task = Task::quiet().with_tolerance(Some(0.1));
        let specimens = &t.card().specimens[..if full() { t.card().specimens.len() } else { 1 }];
        for spec in specimens.iter().copied().chain(taken) {
            let b = t.bake(&material(spec), None, &params, &task).expect("a bake that the Card promises");
            assert!(b.certificate().error.is_finite());
            for (i, l) in shade(&*b, &light, &View::default(), &q).iter().enumerate() {
                let facing: f32 = (0..3).map(|k| q.n[k][i] * q.wo[k][i]).sum();
                assert!(l.iter().all(|x| x.is_finite()), "{}: {spec}: {i}: {l:?}", t.card().slug);
                // At the horizon rounding decides.
                assert!(facing > -1e-6 || *l == [0.0; 3], "{}: {spec}: light from behind", t.card().slug);
            }
        }
    }
}

/// Modules are valid WGSL, alone and merged with a technique for environments; and two bakes have the same
/// bits.
#[test]
fn local_shaders_are_valid_and_bakes_repeat() {
    let other = super::harness::draft(
        steradian_techniques::find("sh_irradiance").expect("a technique"),
        &lights::smooth(),
        "lambert",
        &[],
    );
    for (t, spec) in each() {
        let again = || {
            let params: ParamValues = t.per_point().iter().copied().collect();
            let brdf = material(spec).brdf;
            let m = specimens::material(brdf, t.planes());
            t.bake(&m, None, &params, &Task::quiet()).expect("a bake that the Card promises")
        };
        let l = local(&lights::near_point());
        let frame = LocalFrame { lights: &l, view: &View::default(), mesh: None, shadowed: false };
        let made = || again().lit(&frame).expect("no mesh").gpu().expect("a text");
        let a = made();
        if full() || spec == t.card().specimens[0] {
            assert_eq!(a, made(), "{}", t.card().slug);
        }
        for technique in [a.clone(), steradian_techniques::local::beside(other.gpu(), a)] {
            let text = gpu::module(&technique);
            let module = naga::front::wgsl::parse_str(&text)
                .unwrap_or_else(|e| panic!("{}:\n{}", t.card().slug, e.emit_to_string(&text)));
            let mut validator = naga::valid::Validator::new(
                naga::valid::ValidationFlags::all(),
                naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32,
            );
            let valid = validator.validate(&module);
            assert!(valid.is_ok(), "{}: {:?}", t.card().slug, valid.err());
        }
    }
}

/// Faulty input is refused by name: parameters, reflectance, light that is not finite, a missing mesh.
#[test]
fn local_techniques_refuse_by_name() {
    for t in locals() {
        let params: ParamValues = [("no-such", 1.0)].into_iter().collect();
        let spec = t.card().specimens[0];
        assert!(matches!(t.bake(&material(spec), None, &params, &Task::quiet()), Err(BakeError::Param(_))));
        let b = shared(*t, spec);
        let lamp = PointLight { position: Vec3::NAN, intensity: [1.0; 3] };
        let l = LocalLights { points: vec![lamp], ..LocalLights::default() };
        let frame = LocalFrame { lights: &l, view: &View::default(), mesh: None, shadowed: false };
        assert!(matches!(b.lit(&frame), Err(BakeError::Unsound(_))));
    }
    let t = find_local("vertex_analytic").expect("a technique");
    let l = local(&lights::near_point());
    let frame = LocalFrame { lights: &l, view: &View::default(), mesh: None, shadowed: false };
    let e = bake(t, "lambert", &[]).lit(&frame).err().expect("it needs a mesh");
    assert!(e.to_string().contains("needs a mesh with normals"), "{e}");
}

/// A bake that was saved loads to the same bits, from textures and from tables.
#[test]
fn local_bakes_are_saved_and_loaded() {
    let at = |k: usize| Place { uv: [0.19 * k as f32, 0.37 * k as f32], footprint: 0.02 * k as f32 };
    for t in locals() {
        let spec = t.card().specimens[0];
        let params: ParamValues = t.per_point().iter().copied().collect();
        let m = specimens::material(material(spec).brdf, t.planes());
        let b = t.bake(&m, None, &params, &Task::quiet()).expect("a bake that the Card promises");
        let again = t.load(&b.save().expect("no mesh"), m.brdf.clone()).expect("its own bake");
        assert_eq!(again.certificate(), b.certificate(), "{}", t.card().slug);
        assert_eq!((again.params(), again.is_textured()), (b.params(), b.is_textured()), "{}", t.card().slug);
        for (k, p) in points(40).iter().enumerate() {
            let (wi, wo) =
                (Vec3::new(0.3, -0.2, 0.9).normalize().to_array(), p.frame.to_local(p.wo).as_vec3());
            let [one, two] = [&b, &again].map(|b| b.f_cos_at(at(k), wi, wo.to_array()));
            assert_eq!(one, two, "{}: {k}", t.card().slug);
        }
        let other = locals().iter().find(|o| o.card().slug != t.card().slug).expect("another technique");
        assert!(matches!(
            other.load(&b.save().expect("no mesh"), m.brdf.clone()),
            Err(BakeError::Load { .. })
        ));
    }
}

/// Tables of every technique for local light have the same bits by one thread and by three.
#[test]
fn local_bakes_are_bit_identical_whatever_the_thread_count() {
    let made = |threads: usize, t: &dyn AnyLocal, spec: &str| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| bake(t, spec, &[]).save().expect("no data of a mesh"))
    };
    for t in locals().iter().filter(|t| !t.needs_sites(&ParamValues::default())) {
        let spec = t.card().specimens[0];
        assert!(made(1, *t, spec) == made(3, *t, spec), "{}", t.card().slug);
    }
}
