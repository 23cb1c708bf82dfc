use super::*;
use crate::AnyBake;
use crate::trial::Certified;
use crate::trial::vertices;
use crate::trial::{at_vertices, farthest, on_mesh};
use crate::{Geometry, Sites, find};
use glam::{DVec3, Mat3, Vec3};
use steradian_scene::{Mesh, shapes};

fn bake(lights: &Lights, mesh: &Mesh, params: &[(&str, f64)]) -> Box<dyn AnyBake> {
    on_mesh("prt_diffuse", lights, "lambert:albedo=0.5", mesh, params)
}

fn ring() -> Mesh {
    shapes::torus(0.7, 0.3, 24)
}

/// The certificate is measured by paths through the mesh: far below the error without visibility, and above
/// zero.
#[test]
fn the_certificate_sees_shadows() {
    let mesh = ring();
    let smooth = bake(&lights::smooth(), &mesh, &[]);
    let c = smooth.certified();
    assert!(c.error < 0.03 && c.error > 1e-4, "{}", c.error);
    assert!(c.metric.contains("points of the mesh"));
    let sunny = bake(&lights::sunny(), &mesh, &[]);
    // Both include the error of interpolation between vertices; five bands lose more of a sun.
    assert!(sunny.certified().error > 1.3 * c.error, "{} {}", sunny.certified().error, c.error);
}

/// Against paths: the certificate of two events holds for light that was reflected once.
#[test]
fn reflected_light_is_that_of_paths() {
    let mesh = ring();
    for bounces in [2.0, 5.0] {
        let b = bake(&lights::quadratic(), &mesh, &[("bounces", bounces)]);
        assert!(b.certified().error < 0.02, "{bounces}: {}", b.certified().error);
        let direct = bake(&lights::quadratic(), &mesh, &[]);
        let (more, less) = (at_vertices(&*b, &mesh), at_vertices(&*direct, &mesh));
        assert!(more.iter().zip(&less).all(|(a, b)| a[0] > b[0] - 2e-3));
        assert!(farthest(&more, &less) > 0.02);
    }
}

/// A bake of one slot of the mesh gives that slot's sites the data that a bake of all gives them, also where
/// light is reflected by other slots, whose own sites get none.
#[test]
fn slots_have_the_data_that_they_have_among_all() {
    let mut low = ring();
    low.positions.iter_mut().for_each(|p| p.y -= 0.7);
    let mesh = Mesh::merged(&[ring().with_material(0), low.with_material(1)]);
    let first = ring().positions.len();
    let all = vertices(&mesh);
    let lower = Geometry { sites: Sites::Slots([1].into()), ..all.clone() };
    for bounces in [1.0, 2.0] {
        let of = |g: &Geometry| {
            let material = Material::new(steradian_brdf::parse("lambert:albedo=0.5").unwrap());
            let params = [("bounces", bounces), ("precision", 0.05)].into_iter().collect();
            let t = find("prt_diffuse").unwrap();
            t.draft(&lights::smooth(), &material, Some(g), &params, &Task::quiet()).unwrap()
        };
        let (whole, part) = (of(&all), of(&lower));
        let (want, got) = (at_vertices(&*whole, &mesh), at_vertices(&*part, &mesh));
        assert_eq!(got[first..], want[first..], "{bounces}");
        assert!(got[first..].iter().all(|l| l[0] > 0.0) && want[..first].iter().all(|l| l[0] > 0.0));
        if bounces == 1.0 {
            assert!(got[..first].iter().all(|l| *l == [0.0; 3]));
        }
        // The certificate's points lie in the slot that has data.
        assert!(part.certified().error < 0.1, "{bounces}: {}", part.certified().error);
    }
}

/// Light turned in a frame is the light turned at bake time; the object turned is the light turned back.
#[test]
fn objects_turned_are_lights_turned_back() {
    let r = Mat3::from_rotation_z(0.9) * Mat3::from_rotation_x(0.4);
    let mesh = ring();
    let light = lights::smooth();
    let mut b = bake(&light, &mesh, &[("precision", 1e-3)]);
    b.frame(&View { light_rotation: r.transpose(), ..View::default() });
    let turned_back = at_vertices(&*b, &mesh);
    let moved = mesh.transformed(&glam::Affine3A::from_mat3(r));
    let turned = at_vertices(&*bake(&light, &moved, &[("precision", 1e-3)]), &moved);
    let far = farthest(&turned_back, &turned);
    // The two bakes cast different rays: each is within the precision, times the light.
    assert!(far < 3e-3, "{far}");
}

/// Half precision changes transfer by its rounding alone, and a window only the light.
#[test]
fn halves_and_windows() {
    let mesh = ring();
    let light = lights::smooth();
    let plain = at_vertices(&*bake(&light, &mesh, &[]), &mesh);
    let halves = at_vertices(&*bake(&light, &mesh, &[("halves", 1.0)]), &mesh);
    let far = farthest(&plain, &halves);
    assert!(far > 0.0 && far < 2e-3, "{far}");
    let furnace = bake(&lights::furnace(), &mesh, &[]);
    let windowed = bake(&lights::furnace(), &mesh, &[("window", 5.0)]);
    assert!(farthest(&at_vertices(&*furnace, &mesh), &at_vertices(&*windowed, &mesh)) < 1e-5);
}

/// A plane with a box above a part of it, and points of the plane with normals of bumps.
fn bumpy() -> (Mesh, crate::PointsBuf, Vec<DVec3>) {
    let plane = shapes::plane(3.0, 0.0, 24);
    let shade = shapes::cuboid([0.8; 3], 2).transformed(&glam::Affine3A::from_translation(Vec3::Y));
    let mesh = Mesh::merged(&[plane.clone(), shade]);
    let (mut q, mut normals) = (crate::PointsBuf::default(), Vec::new());
    let inside = |p: &Vec3| p.x.abs() < 1.3 && p.z.abs() < 1.3;
    for (k, p) in plane.positions.iter().enumerate().filter(|(_, p)| inside(p)) {
        let slope = 0.6 * Vec3::new((9.0 * p.x).sin(), 0.0, (7.0 * p.z + 1.0).cos());
        let n = (Vec3::Y - slope).normalize();
        q.push(n, Vec3::X, Vec3::Y, *p);
        q.locate(Default::default(), [k as u32; 3], [0.0; 2]);
        let (own, t) = (Vec3::Y.to_array(), Vec3::X.to_array());
        q.chart(crate::PointChart { n: own, t, side: 1.0, footprint: 0.0 });
        normals.push(n.as_dvec3());
    }
    (mesh, q, normals)
}

fn of(b: &dyn AnyBake, q: &crate::PointsBuf) -> [Vec<f32>; 3] {
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    rgb
}

/// A flat normal map changes nothing.
#[test]
fn flat_bumps_are_none() {
    let (mesh, mut q, _) = bumpy();
    q.n = [0.0f32, 1.0, 0.0].map(|x| vec![x; q.len()]);
    let plain = of(&*bake(&lights::smooth(), &mesh, &[]), &q);
    for (bounces, precision) in [(1.0, 5e-3), (2.0, 0.05)] {
        let params = [("normals", 1.0), ("bounces", bounces), ("precision", precision)];
        let b = bake(&lights::smooth(), &mesh, &params);
        let flat = of(&*b, &q);
        let mut bare = q.clone();
        bare.chart = Default::default();
        assert_eq!(flat, of(&*b, &bare), "{bounces}");
        if bounces == 1.0 {
            // The two bakes cast different rays: each is within the precision, times the light.
            let far = flat.iter().flatten().zip(plain.iter().flatten()).map(|(a, b)| (a - b).abs());
            assert!(far.fold(0.0, f32::max) < 5e-3);
        }
        // A bake loads completely.
        let again = find("prt_diffuse").unwrap().load(&b.save()).unwrap();
        assert_eq!(of(&*again, &q), flat);
    }
}

/// Whether there is transfer to other normals follows from the material where nothing else is said.
#[test]
fn a_normal_map_asks_for_other_normals() {
    let material =
        |bumpy| Material::new(steradian_brdf::parse("lambert:albedo=0.5").unwrap()).with_bumps(bumpy);
    let (geometry, light) = (vertices(&ring()), lights::furnace());
    for (said, bumpy, expected) in
        [(None, false, "off"), (None, true, "on"), (Some(false), true, "off"), (Some(true), false, "on")]
    {
        let given = said.map(|on: bool| ("normals", f64::from(u8::from(on))));
        let params = given.into_iter().chain([("bands", 2.0), ("precision", 0.05)]).collect();
        let technique = find("prt_diffuse").unwrap();
        let b = technique.draft(&light, &material(bumpy), Some(&geometry), &params, &Task::quiet()).unwrap();
        assert_eq!(b.params().0["normals"].to_string(), expected, "{said:?} {bumpy}");
    }
}

/// Bumps next to a box that rises above them get the irradiance that paths find, which the mesh's normals do
/// not.
#[test]
fn bumps_in_a_shadow_are_those_of_paths() {
    use steradian_reference::path::{PathOptions, PathPoint, PathScene, trace_points};
    let (mesh, q, normals) = bumpy();
    let light = lights::smooth();
    let brdf = steradian_brdf::parse("lambert:albedo=0.5").unwrap();
    let bvh = steradian_scene::Bvh::build(&mesh);
    let exact = {
        let (materials, offset) = (&[brdf.clone()][..], PathScene::OFFSET);
        let scene = PathScene { mesh: &mesh, bvh: &bvh, materials, tint: None, lights: &light, offset };
        let points: Vec<PathPoint<'_>> = normals
            .iter()
            .enumerate()
            .map(|(i, n)| PathPoint {
                position: Vec3::from_array([0, 1, 2].map(|c| q.p[c][i])).as_dvec3(),
                frame: steradian_sphere::Frame::from_normal(*n),
                wo: DVec3::Y,
                brdf: &*brdf,
            })
            .collect();
        let options = PathOptions { bounces: 1, samples: 4096, seed: 3 };
        trace_points(&scene, &points, options, &Task::quiet()).unwrap()
    };
    let error = |params: &[(&str, f64)]| {
        let got = of(&*bake(&light, &mesh, params), &q);
        let (mut off, mut all) = (0.0, 0.0);
        for (i, e) in exact.iter().enumerate() {
            for c in 0..3 {
                off += (f64::from(got[c][i]) - e.rgb[c]).powi(2);
                all += e.rgb[c] * e.rgb[c];
            }
        }
        (off / all).sqrt()
    };
    let (plain, bumped) = (error(&[]), error(&[("normals", 1.0)]));
    assert!(plain > 0.1 && bumped < 0.02, "{plain} {bumped}");
}

/// Points without sites are black, and none beyond the end is read.
#[test]
fn points_without_sites_are_black() {
    crate::trial::points_without_sites_are_black(&*bake(&lights::furnace(), &ring(), &[]));
}

/// Vertices in their order are shaded like the same points one by one, and points that face away stay black.
#[test]
fn sites_in_their_order_are_points_like_others() {
    let (mesh, light) = (ring(), lights::smooth());
    let b = bake(&light, &mesh, &[]);
    let mut all = crate::PointsBuf::default();
    for (k, (n, p)) in mesh.normals.iter().zip(&mesh.positions).enumerate() {
        let wo = if k % 5 == 0 { -*n } else { *n };
        all.push(*n, n.any_orthonormal_vector(), wo, *p);
        // Some groups are not in order, or lie within triangles.
        let site = if k / 16 % 3 == 1 { (k ^ 1) as u32 } else { k as u32 };
        all.locate(Default::default(), [site, 0, 1], [if k / 16 % 3 == 2 { 0.25 } else { 0.0 }, 0.0]);
    }
    let got = of(&*b, &all);
    for i in (0..all.len()).step_by(3) {
        let mut one = crate::PointsBuf::default();
        let at = |v: &[Vec<f32>; 3]| Vec3::from_array([0, 1, 2].map(|k| v[k][i]));
        one.push(at(&all.n), at(&all.t), at(&all.wo), at(&all.p));
        one.locate(
            Default::default(),
            all.as_points().site.index.map(|s| s[i]),
            all.as_points().site.weight.map(|w| w[i]),
        );
        let alone = of(&*b, &one);
        for c in 0..3 {
            assert_eq!(got[c][i], alone[c][0], "{i}");
            assert_eq!(got[c][i] == 0.0, i % 5 == 0, "{i}");
        }
    }
}
