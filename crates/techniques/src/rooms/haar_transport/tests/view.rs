//! Any reflectance for a fixed view.

use super::*;
use crate::Part as _;
use crate::rooms::haar_transport::keep;
use crate::rooms::haar_transport::material::Glossy;
use crate::rooms::haar_transport::sights::Sights;
use crate::rooms::haar_transport::transport::Seen;
use crate::rooms::haar_transport::visibility::{Pyramid, Scratch};
use crate::rooms::haar_transport::weigh::{self, Place};
use crate::tensors::{TensorFile, get_f32};
use crate::trial;
use crate::trial::Certified;
use glam::Vec3;
use steradian_brdf::parse;
use steradian_formats::{Tensor, TensorData};
use steradian_scene::Bvh;
use steradian_sphere::Frame as Axes;

const GGX: &str = "ggx:alpha=0.3";

fn params(values: &[(&str, f64)], fix: &str) -> ParamValues {
    let mut all: ParamValues = values.iter().copied().collect();
    all.0.insert("fix".into(), fix.into());
    all
}

/// A bake with its types, of the ring.
fn of_ring(spec: &str, light: &Lights, values: &[(&str, f64)], fix: &str) -> Bake<HaarTransport> {
    trial::typed(light, spec, &trial::vertices(&ring()), &params(values, fix))
}

const EYE: Vec3 = Vec3::new(1.5, 2.5, 1.0);
/// All wavelets, on small faces.
const WHOLE: &[(&str, f64)] = &[("size", 4.0), ("wavelets", 98304.0), ("precision", 0.0)];

fn seen_from(eye: Vec3, turn: f32) -> View {
    View { eye, light_rotation: Mat3::from_rotation_y(turn), ..View::default() }
}

/// Vertices of the ring that face the eye, as points.
fn facing(eye: Vec3) -> PointsBuf {
    let (mesh, mut q) = (ring(), PointsBuf::default());
    for (k, (n, p)) in mesh.normals.iter().zip(&mesh.positions).enumerate() {
        let wo = (eye - *p).normalize();
        if n.dot(wo) > 0.05 {
            q.push(*n, n.any_orthonormal_vector(), wo, *p);
            q.locate(Vec2::ZERO, [k as u32; 3], [0.0; 2]);
        }
    }
    q
}

fn shaded(b: &dyn AnyBake, q: &PointsBuf) -> Vec<[f32; 3]> {
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    (0..q.len()).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]]).collect()
}

fn made(spec: &str, light: &Lights, values: &[(&str, f64)], fix: &str) -> Box<dyn AnyBake> {
    let g = Geometry::new(Arc::new(ring()), Sites::Vertices);
    let material = Material::new(parse(spec).unwrap());
    let t = find("haar_transport").unwrap();
    t.draft(light, &material, Some(&g), &params(values, fix), &Task::quiet()).unwrap()
}

/// The sum over all wavelets of light and transport is the sum over texels.
#[test]
fn all_wavelets_are_the_sum_over_texels() {
    let b = of_ring(GGX, &low_sun(), WHOLE, "view");
    let (Matter::Glossy(matter), Transfer::Sights(sights)) = (&*b.material, &*b.transfer) else { panic!() };
    let mut f = Frame::default();
    HaarTransport::frame(&b, &seen_from(EYE, 0.0), &mut f);
    let texels = b.light.on_cube(&sights.cube, Mat3::IDENTITY);
    let (mut got, mut want) = (Vec::new(), Vec::new());
    for k in (0..sights.frames.len()).step_by(7) {
        let [n, t] = sights.frames.at(k).map(Vec3::as_dvec3);
        let frame = Axes::from_normal_tangent(n, t);
        let wo = frame.to_local((EYE - sights.frames.position(k)).normalize().as_dvec3());
        if wo.z < 0.05 {
            continue;
        }
        let (mut open, mut t) = (Vec::new(), vec![Vec::new()]);
        sights.open(k, &mut open);
        let place = Place { brdf: &*matter.brdf, frame, wo };
        place.weigh(&sights.cube, &sights.cube.steps(), &open, &mut weigh::Scratch::default(), &mut t);
        want.push([0, 1, 2].map(|c| t[0].iter().zip(&texels[c]).map(|(t, l)| t * l).sum::<f32>()));
        got.push(f.radiance[k]);
    }
    assert!(want.len() > 20);
    assert!(off(&got, &want) < 0.01, "{}", off(&got, &want));
}

/// What is left out is small beside what is there, in the tail of a lobe too.
#[test]
fn tails_keep_their_detail() {
    let n = 6 * SIDE * SIDE;
    // One face bright, the next a thousandth of it, each with a step half-way.
    let mut texels = vec![0.0f32; n];
    for (k, t) in texels.iter_mut().enumerate().take(2 * SIDE * SIDE) {
        let scale = if k < SIDE * SIDE { 1.0 } else { 1e-3 };
        *t = scale * if k % SIDE < SIDE / 2 { 1.0 } else { 2.0 };
    }
    let mut all = texels.clone();
    transform(&mut all, SIDE);
    let kept = |precision: f64| keep::row(&texels, &all, SIDE, precision).kept.len();
    // By length alone the second face's step would be left out at 0.001 already.
    assert_eq!([kept(1e-4), kept(0.009), kept(0.05), kept(0.5)], [2, 2, 1, 0]);
}

/// Sorting all coefficients and sorting those of one magnitude keep the same ones.
#[test]
fn both_ways_to_choose_coefficients_agree() {
    let mut all = noise(6 * SIDE * SIDE);
    transform(&mut all, SIDE);
    let whole: f64 = all.iter().map(|x| f64::from(*x).powi(2)).sum();
    for precision in [0.0f64, 0.03, 0.1, 0.3, 2.0] {
        let left = precision * precision * whole;
        let mut sorted = Row::of(&all, SIDE, left);
        sorted.kept.sort_unstable_by_key(|k| k.0);
        let keys: Vec<f32> = all.iter().map(|x| x.abs()).collect();
        let dense = keep::largest(&all, &keys, SIDE, left);
        assert_eq!((dense.scaling, dense.kept), (sorted.scaling, sorted.kept), "{precision}");
    }
}

/// A site whose coefficients are thousandths of another's keeps them to some percent.
#[test]
fn tails_are_not_rounded_away() {
    let all = noise(6 * SIDE * SIDE);
    let of = |scale: f32| Row::of(&all.iter().map(|x| x * scale).collect::<Vec<_>>(), SIDE, 0.0);
    let columns = Columns::new(&[of(1.0), of(1e-3), of(-1e-3)], SIDE, Scale::Octaves);
    for k in (0..all.len() as u32).filter(|k| !(*k as usize).is_multiple_of(SIDE * SIDE)).step_by(97) {
        let seen = columns.apply(&[[0.0; 3]; 6], &[(k, [1.0; 3])]);
        for (site, want) in [1.0, 1e-3, -1e-3].into_iter().enumerate() {
            let want = all[k as usize] * want;
            assert!((seen[site][0] / want - 1.0).abs() < 0.04, "{k}: {} {want}", seen[site][0]);
        }
    }
}

/// Runs hold what rays found.
#[test]
fn sites_keep_what_they_see() {
    let (mesh, p) = (ring(), Params { size: 5, ..all(200, 0) });
    let g = Geometry::new(Arc::new(mesh.clone()), Sites::Vertices);
    let sights = Sights::new(&g, &p, &Task::quiet()).unwrap();
    let (pyramid, mut scratch, mut open) = (Pyramid::new(32), Scratch::default(), Vec::new());
    let bvh = Bvh::build(&mesh);
    let offset = steradian_transfer::Settings::default().offset;
    let mut partly = 0;
    for (k, (n, p)) in mesh.normals.iter().zip(&mesh.positions).enumerate() {
        sights.open(k, &mut open);
        let own = pyramid.see(&bvh, *p + *n * offset, *n, k as u64, &mut scratch);
        assert!(open.len() == own.len() && (k >= 64 || open == own), "{k}");
        partly += own.iter().filter(|v| **v > 0.0 && **v < 1.0).count();
    }
    assert!(partly > 1000 && sights.bytes() < 1000 * mesh.positions.len(), "{partly} {}", sights.bytes());
}

/// One eye has one transport, whatever frame asks and however the light turns; another eye has another.
#[test]
fn transport_is_made_where_the_eye_moves_and_only_there() {
    let b = of_ring(GGX, &low_sun(), &[("size", 4.0)], "view");
    let (mut f, mut other) = (Frame::default(), Frame::default());
    let address = |f: &Frame| f.fixed.seen.as_ref().map(|s| Arc::as_ptr(&s.1).addr()).unwrap();
    let mut renew = |v: View| {
        HaarTransport::frame(&b, &v, &mut f);
        (address(&f), f.radiance.clone())
    };
    let still = renew(seen_from(EYE, 0.0));
    assert_eq!(renew(seen_from(EYE, 0.0)), still);
    let turned = renew(seen_from(EYE, 1.0));
    assert!(turned.0 == still.0 && turned.1 != still.1);
    HaarTransport::frame(&b, &seen_from(EYE, 1.0), &mut other);
    assert_eq!((address(&other), &other.radiance), (turned.0, &turned.1));
    let moved = renew(seen_from(EYE * 1.2, 1.0));
    assert!(moved.0 != still.0 && moved.1 != turned.1);
    // Made again, it has the same bits.
    assert_eq!(renew(seen_from(EYE, 0.0)).1, still.1);
}

/// Lambert's reflectance stays what it is whatever is fixed, and as any reflectance it comes to the same.
#[test]
fn lambert_is_the_same_either_way() {
    let spec = "lambert:albedo=0.5";
    let (light, q) = (low_sun(), facing(EYE));
    let both = ["nothing", "view"].map(|fix| {
        let mut b = made(spec, &light, &[("size", 5.0)], fix);
        b.frame(&seen_from(EYE, 0.4));
        shaded(&*b, &q)
    });
    assert_eq!(both[0], both[1]);
    let values = [("size", 5.0), ("wavelets", 98304.0), ("precision", 0.01)];
    let b = of_ring(GGX, &light, &values, "view");
    let matter = Glossy { brdf: parse(spec).unwrap(), tint: Some([1.0; 3]) };
    let b = Bake { material: Arc::new(Matter::Glossy(matter)), ..b };
    let mut f = Frame::default();
    HaarTransport::frame(&b, &seen_from(EYE, 0.4), &mut f);
    let own: Vec<[f32; 3]> = q.corners[0].iter().map(|k| f.radiance[*k as usize]).collect();
    let mut b = made(spec, &light, &values, "nothing");
    b.frame(&seen_from(EYE, 0.4));
    let diffuse = shaded(&*b, &q);
    assert!(off(&own, &diffuse) < 0.01, "{}", off(&own, &diffuse));
}

/// Channels that differ have transport of their own, and those that do not share it.
#[test]
fn channels_share_their_transport_where_they_can() {
    let channels = |spec: &str| {
        let b = of_ring(spec, &lights::smooth(), &[("size", 3.0)], "view");
        let mut f = Frame::default();
        HaarTransport::frame(&b, &seen_from(EYE, 0.0), &mut f);
        let seen: Arc<Seen> = f.fixed.seen.unwrap().1;
        (seen.channels.len(), f.radiance)
    };
    let (one, plain) = channels("phong:n=20");
    let (three, coloured) = channels("ggx:alpha=0.3,f0=0.9/0.6/0.3");
    assert_eq!([one, three], [1, 3]);
    let mean = |l: &[[f32; 3]], c: usize| l.iter().map(|x| x[c]).sum::<f32>();
    assert!(mean(&coloured, 2) < 0.6 * mean(&coloured, 0) && mean(&plain, 2) > 0.0);
    let grey = channels("ggx:alpha=0.3,f0=0.3").1;
    let blue = |l: &[[f32; 3]]| l.iter().map(|x| [x[2]; 3]).collect::<Vec<_>>();
    assert!(off(&blue(&coloured), &blue(&grey)) < 2e-3, "{}", off(&blue(&coloured), &blue(&grey)));
}

/// Points that are seen from elsewhere than from the frame's eye are as if an eye were there.
#[test]
fn other_views_are_shaded_point_by_point() {
    let b = made(GGX, &low_sun(), WHOLE, "view");
    let far = Vec3::new(900.0, 1500.0, 600.0);
    let q = facing(far);
    let (unseen, near, there) =
        (b.with_view(&seen_from(EYE, 0.0)), shaded(&*b, &q), b.with_view(&seen_from(far, 0.0)));
    let there = shaded(&*there, &q);
    assert!(off(&near, &there) < 0.01, "{}", off(&near, &there));
    assert_eq!(shaded(&*unseen, &q), near);
    assert!(off(&there, &shaded(&*b.with_view(&seen_from(far, 1.0)), &q)) > 0.1);
}

/// What a certificate states is measured at the sites against paths, and more wavelets lower it.
#[test]
fn certificates_are_of_all_views() {
    let mesh = Arc::new(ring());
    let some = |v: &[Vec3]| v.iter().step_by(5).copied().collect();
    let sites = Sites::Points { p: some(&mesh.positions), n: some(&mesh.normals) };
    let (g, material) = (Geometry::new(mesh, sites), Material::new(parse(GGX).unwrap()));
    let error = |wavelets: f64| {
        let params = params(&[("wavelets", wavelets)], "view");
        let t = find("haar_transport").unwrap();
        let b = t.draft(&low_sun(), &material, Some(&g), &params, &Task::quiet()).unwrap();
        assert_eq!(b.certified().known, steradian_base::Evidence::Measured);
        b.certified().error
    };
    let errors = [12.0, 200.0].map(error);
    assert!(errors[1] < 0.5 * errors[0] && errors[1] < 0.1, "{errors:?}");
}

#[test]
fn a_saved_bake_shades_the_same_bits() {
    let mut b = made("ggx:ax=0.2,ay=0.5,f0=0.9/0.6/0.3", &low_sun(), &[("size", 5.0)], "view");
    let mut again = find("haar_transport").unwrap().load(&b.save()).unwrap();
    let q = facing(EYE);
    let first = shaded(&*b, &q);
    assert_eq!(shaded(&*again, &q), first);
    b.frame(&seen_from(EYE, 0.3));
    again.frame(&seen_from(EYE, 0.3));
    assert_eq!(shaded(&*again, &q), shaded(&*b, &q));
    assert_ne!(shaded(&*b, &q), first);
    assert_eq!(again.bytes(), b.bytes());
}

#[test]
fn damaged_bakes_are_refused() {
    let whole = made(GGX, &low_sun(), &[("size", 3.0)], "view").save();
    let refused = |edit: &dyn Fn(&mut TensorFile)| {
        let mut file = whole.clone();
        edit(&mut file);
        find("haar_transport").unwrap().load(&file).err().map(|e| e.to_string())
    };
    assert_eq!(refused(&|_| ()), None);
    let words = |name: &'static str, change: fn(&mut Vec<u32>)| {
        refused(&|file: &mut TensorFile| {
            let t = file.tensors.get_mut(name).unwrap();
            let TensorData::U32(v) = &mut t.data else { panic!() };
            change(v);
            t.shape = vec![v.len()];
        })
        .expect(name)
    };
    for (name, change) in [
        // A run that is too long, one that is open more than wholly, and one too few.
        ("transfer.runs", (|v| v[0] ^= 1 << 15) as fn(&mut Vec<u32>)),
        ("transfer.runs", |v| v[0] |= 7),
        ("transfer.runs", |v| v.truncate(v.len() - 1)),
        ("transfer.starts", |v| v[0] = 1),
        ("transfer.starts", |v| v[3] = u32::MAX),
        ("transfer.starts", |v| v.truncate(4)),
        ("transfer.side", |v| v[0] = 7),
        ("transfer.side", |v| v[0] = 16),
        ("transfer.side", Vec::clear),
    ] {
        assert!(words(name, change).contains("is not what it should be"), "{name}");
    }
    let short = |file: &mut TensorFile| {
        let name = "linked.norms";
        let v = get_f32(file, name, 1).unwrap().1[1..].to_vec();
        file.tensors.insert(name.into(), Tensor::f32(vec![v.len()], v));
    };
    assert!(refused(&short).unwrap().contains("do not fit each other"));
    for name in ["transfer.frames", "transfer.runs", "material.tint", "linked.norms"] {
        assert!(refused(&|file| drop(file.tensors.remove(name))).is_some(), "{name}");
    }
    let other = |spec: &'static str| {
        move |file: &mut TensorFile| {
            file.metadata.insert("steradian.material.brdf".into(), spec.into());
        }
    };
    for spec in ["lambert", "phong-map:n=5", "ggx"] {
        assert!(refused(&other(spec)).is_some(), "{spec}");
    }
    let fixed = |file: &mut TensorFile| {
        file.metadata.insert("steradian.param.fix".into(), "nothing".into());
    };
    assert!(refused(&fixed).is_some());
}

#[test]
fn what_is_not_taken_is_told_what_to_do() {
    let why = |spec: &str, values: &[(&str, f64)], fix: &str| {
        let t = find("haar_transport").unwrap();
        let material = Material::new(parse(spec).unwrap());
        let g = Geometry::new(Arc::new(shapes::icosphere(0)), Sites::Vertices);
        let params = params(values, fix);
        let taken = t.takes(&*material.brdf, &params);
        let e = t.draft(&Lights::default(), &material, Some(&g), &params, &Task::quiet()).err();
        assert_eq!(e.as_ref().map(|e| e.to_string()), taken.err().map(|e| format!("haar_transport: {e}")));
        e.map(|e| e.to_string())
    };
    assert_eq!(
        why(GGX, &[], "nothing").unwrap(),
        "haar_transport: takes lambert only, not ggx; with fix=view it takes any reflectance, for one camera"
    );
    assert_eq!(why(GGX, &[], "view"), None);
    assert_eq!(why("lambert", &[("bounces", 2.0)], "view"), None);
    assert!(why(GGX, &[("bounces", 2.0)], "view").unwrap().contains("leave bounces out, or use lambert"));
    assert!(why("phong-map:n=5", &[], "view").unwrap().contains("use exact"));
    // Lists and comparisons go by the Card.
    assert!((HaarTransport::CARD.materials)(&*parse(GGX).unwrap()).is_err());
    let t = find("haar_transport").unwrap();
    assert!(t.needs_view(&params(&[], "view")) && !t.needs_view(&params(&[], "nothing")));
}
