//! Against brute force, watertightness, and the measured occlusion of the bunny.

use super::*;
use crate::shapes;
use glam::{Vec3, Vec3A};
use obvhs::triangle::Triangle;
use steradian_testkit::on_every_isa;

/// A stream of numbers in [0, 1): PCG32 (O'Neill 2014).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let word = ((self.0 >> 18) ^ self.0) >> 27;
        ((word as u32).rotate_right((self.0 >> 59) as u32) >> 8) as f32 / (1 << 24) as f32
    }

    pub fn direction(&mut self) -> Vec3 {
        let (z, phi) = (2.0 * self.next() - 1.0, std::f32::consts::TAU * self.next());
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    }
}

/// Möller–Trumbore in f64.
fn brute(mesh: &Mesh, ray: &Ray) -> Option<(f64, u32)> {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let mut best: Option<(f64, u32)> = None;
    for i in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(i).map(|p| p.as_dvec3());
        let (e1, e2) = (b - a, c - a);
        let p = d.cross(e2);
        let det = e1.dot(p);
        let s = (o - a) / det;
        let q = s.cross(e1);
        let (u, v, t) = (s.dot(p), d.dot(q), e2.dot(q));
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && best.is_none_or(|b| t < b.0) {
            best = Some((t, i as u32));
        }
    }
    best
}

#[test]
fn one_of_many_equal_triangles_is_enough() {
    let mut mesh = shapes::icosphere(1);
    let whole = Bvh::build(&mesh);
    let first = mesh.triangles[0];
    mesh.triangles.extend(std::iter::repeat_n(first, 20_000));
    let bvh = Bvh::build(&mesh);
    assert_eq!(bvh.blocks.len(), whole.blocks.len());
    let ray = Ray { origin: Vec3::ZERO, direction: mesh.corners(0).iter().sum::<Vec3>().normalize() };
    assert_eq!(bvh.closest(&ray, f32::INFINITY).expect("a hit").triangle, 0);
}

#[test]
fn closest_and_any_hits_are_those_of_brute_force() {
    let mut random = Random(7);
    for mesh in [shapes::teapot(4, true), shapes::knot(2, 3, 0.6, 0.3, 0.1, 16), shapes::icosphere(0)] {
        let bvh = Bvh::build(&mesh);
        let (mut hits, mut edges) = (0, 0);
        for _ in 0..1500 {
            let origin = random.direction() * (2.0 * random.next());
            let ray = Ray { origin, direction: (random.direction() - 0.5 * origin).normalize() };
            let want = brute(&mesh, &ray);
            let got = bvh.closest(&ray, f32::INFINITY);
            assert_eq!(got.is_some(), bvh.occluded(&ray, f32::INFINITY));
            match (got, want) {
                (Some(g), Some((t, id))) => {
                    hits += 1;
                    assert!((f64::from(g.t) - t).abs() < 1e-5, "{g:?} {t} {id}");
                    if g.triangle != id {
                        // At an edge the neighbours' distances agree up to rounding.
                        edges += 1;
                    } else {
                        let [a, b, c] = mesh.corners(id as usize);
                        let p = a * (1.0 - g.u - g.v) + b * g.u + c * g.v;
                        assert!((p - (ray.origin + ray.direction * g.t)).length() < 1e-5);
                    }
                    assert!(!bvh.occluded(&ray, g.t) || edges > 0);
                    assert!(bvh.occluded(&ray, g.t * 1.0001));
                }
                (None, None) => {}
                // A ray through an edge may differ: it must graze one.
                other => panic!("{other:?}"),
            }
        }
        assert!(hits > 300 && edges < 3, "{hits} {edges}");
    }
}

/// Meshes and batches that fill no register, or just more than one.
#[test]
fn small_meshes_and_batches() {
    on_every_isa(|| {
        let whole = shapes::icosphere(1);
        let mut random = Random(3);
        let rays: Vec<Ray> = (0..65)
            .map(|_| {
                let origin = random.direction() * 2.0;
                Ray { origin, direction: (0.5 * random.direction() - origin).normalize() }
            })
            .collect();
        let mut hits = 0;
        for triangles in [0, 1, 2, 3, 7, 8, 9, 15, 16, 17, 33] {
            let mut mesh = whole.clone();
            mesh.triangles.truncate(triangles);
            let bvh = Bvh::build(&mesh);
            let want: Vec<bool> = rays.iter().map(|r| brute(&mesh, r).is_some()).collect();
            for n in [0, 1, 2, 3, 7, 8, 9, 65] {
                let (closest, blocked) =
                    (bvh.closest_many(&rays[..n], 9.0), bvh.occluded_many(&rays[..n], 9.0));
                let found: Vec<bool> = closest.iter().map(|h| h.is_some()).collect();
                assert_eq!(
                    (&found[..], &blocked[..]),
                    (&want[..n], &want[..n]),
                    "{triangles} triangles, {n} rays"
                );
                hits += found.iter().filter(|f| **f).count();
            }
        }
        assert!(hits > 100, "{hits}");
    });
}

/// Rays of one origin traced as a packet give the results of single rays: along the axes too, where
/// components are 0, and from vertices, where boxes touch the origin.
#[test]
fn packets_of_rays_are_those_rays() {
    on_every_isa(|| {
        let mesh = Mesh::merged(&[shapes::knot(2, 3, 0.6, 0.3, 0.1, 24), shapes::plane(3.0, -0.7, 6)]);
        let bvh = Bvh::build(&mesh);
        let mut random = Random(11);
        let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
        let (mut hits, mut count) = (0, 0);
        for i in 0..4000 {
            let vertex = (random.next() * mesh.positions.len() as f32) as usize;
            let height = [0.0, 1e-4, 0.3][i % 3];
            let origin = mesh.positions[vertex] + height * mesh.normals[vertex];
            let middle = if i % 4 == 0 { axes[i / 4 % 6] } else { random.direction() };
            let width = [0.0, 0.01, 0.2, 0.6][i / 7 % 4];
            let rays: Vec<Ray> = (0..40)
                .map(|k| {
                    let aside = if k % 5 == 0 { axes[k / 5 % 6] } else { random.direction() };
                    Ray { origin, direction: (middle + width * aside).normalize_or(middle) }
                })
                .collect();
            let t_max = if i % 2 == 0 { f32::INFINITY } else { 0.5 };
            let mut together = vec![false; rays.len()];
            bvh.occluded_each(&rays, t_max, &mut together);
            let alone: Vec<bool> = rays.iter().map(|r| bvh.occluded(r, t_max)).collect();
            assert_eq!(together, alone, "{i}: {origin} {middle} {width}");
            hits += alone.iter().filter(|h| **h).count();
            count += alone.len();
        }
        assert!(hits > count / 5 && hits < count * 4 / 5, "{hits} of {count}");
    });
}

/// Rays that start just above a long wall and leave it do not hit it, and those that start just below do.
#[test]
fn long_triangles_do_not_hit_what_leaves_them() {
    on_every_isa(|| {
        let mut random = Random(5);
        for length in [3.0, 300.0, 30_000.0] {
            let (up, n) = (Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.8, 0.6, 0.0));
            let z = Vec3::Z * length;
            let mesh = Mesh {
                positions: vec![-up - z, up - z, up + z, -up + z],
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                ..Mesh::default()
            };
            let bvh = Bvh::build(&mesh);
            let mut hits = 0;
            for _ in 0..4000 {
                let (p, mut d) = (up * (random.next() - 0.5), random.direction());
                d *= d.dot(n).signum();
                let [away, through] = [1e-4, -1e-4].map(|h| Ray { origin: p + h * n, direction: d });
                assert!(!bvh.occluded(&away, f32::INFINITY) && bvh.closest(&away, f32::INFINITY).is_none());
                // Through the wall, unless it leaves below one of its edges.
                if d.dot(n) > 1e-3 {
                    assert!(bvh.occluded(&through, f32::INFINITY), "{length}: {through:?}");
                    hits += 1;
                }
            }
            assert!(hits > 3000);
        }
    });
}

/// Rays from inside at the very vertices and edge points of a closed mesh never escape (Woop 2013's test).
#[test]
fn no_ray_leaves_a_closed_mesh_between_its_triangles() {
    let mesh = shapes::icosphere(3);
    let bvh = Bvh::build(&mesh);
    let mut random = Random(3);
    for i in 0..20_000 {
        let t = mesh.corners(i % mesh.triangles.len());
        let origin = random.direction() * (0.9 * random.next());
        let s = random.next();
        let target = if i % 3 == 0 { t[i % 2] } else { t[0] * s + t[1] * (1.0 - s) };
        let ray = Ray { origin, direction: (target - origin).normalize() };
        assert!(bvh.occluded(&ray, f32::INFINITY), "{ray:?}");
        assert!(bvh.closest(&ray, f32::INFINITY).is_some());
    }
}

#[test]
fn axis_parallel_rays_in_the_planes_of_boxes_hit() {
    let mesh = shapes::cuboid([2.0, 2.0, 2.0], 4);
    let bvh = Bvh::build(&mesh);
    for d in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
        for origin in [Vec3::ZERO, Vec3::splat(0.5), Vec3::splat(-0.5)] {
            let h = bvh.closest(&Ray { origin, direction: d }, f32::INFINITY).unwrap();
            assert_eq!(origin.dot(d) + h.t, 1.0);
        }
    }
}

#[test]
fn odd_meshes_and_rays_are_no_trouble() {
    let ray = Ray { origin: Vec3::ZERO, direction: Vec3::Z };
    assert!(!Bvh::build(&Mesh::default()).occluded(&ray, 1.0));
    let bad = Mesh {
        positions: vec![Vec3::NAN, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2], [1, 2, 9], [1, 1, 1]],
        ..Mesh::default()
    };
    assert!(Bvh::build(&bad).closest(&ray, 1.0).is_none());
    let sphere = Bvh::build(&shapes::sphere(16));
    for v in [Vec3::NAN, Vec3::ZERO, Vec3::INFINITY] {
        assert!(sphere.closest(&Ray { origin: Vec3::ZERO, direction: v }, 9.0).is_none());
        let _ = sphere.occluded(&Ray { origin: v, direction: Vec3::Z }, 9.0);
    }
    assert!(sphere.closest(&ray, 0.5).is_none() && sphere.closest(&ray, 1.5).is_some());
}

/// Sizes from 1e-20 to 1e15: no overflow and no loss, and a deep tree takes a stack on the heap.
#[test]
fn every_scale_and_depth_works() {
    for scale in [1e-15, 1.0, 1e15] {
        let map = glam::Affine3A::from_scale(Vec3::splat(scale));
        let bvh = Bvh::build(&shapes::icosphere(2).transformed(&map));
        let ray = Ray { origin: Vec3::ZERO, direction: Vec3::new(0.6, 0.0, 0.8) };
        let t = bvh.closest(&ray, f32::INFINITY).unwrap().t / scale;
        assert!((0.9..=1.0).contains(&t), "{scale} {t}");
    }
    // Ever smaller triangles towards a point make a degenerate tree.
    let mut deep = Mesh::default();
    for i in 0..2000u32 {
        let s = 0.97f32.powi(i as i32);
        deep.positions.extend([Vec3::new(-s, s, s), Vec3::new(s, s, s), Vec3::new(0.0, -s, s)]);
        deep.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let bvh = Bvh::build(&deep);
    let hit = bvh.closest(&Ray { origin: Vec3::ZERO, direction: Vec3::Z }, f32::INFINITY);
    assert!(hit.is_some());
    let fallback = Bvh { stack: 100_000, ..bvh.clone() };
    assert_eq!(fallback.closest(&Ray { origin: Vec3::ZERO, direction: Vec3::Z }, f32::INFINITY), hit);
}

#[test]
fn batches_agree_with_single_rays() {
    let mesh = shapes::torus(0.7, 0.3, 32);
    let bvh = Bvh::build(&mesh);
    let mut random = Random(1);
    let rays: Vec<Ray> =
        (0..5000).map(|_| Ray { origin: random.direction(), direction: random.direction() }).collect();
    let (hits, blocked) = (bvh.closest_many(&rays, 3.0), bvh.occluded_many(&rays, 3.0));
    for ((ray, hit), blocked) in rays.iter().zip(&hits).zip(&blocked) {
        assert_eq!(bvh.closest(ray, 3.0), *hit);
        assert_eq!(bvh.occluded(ray, 3.0), *blocked);
    }
    let share = blocked.iter().filter(|b| **b).count();
    assert!(share > 1000 && share < 4500);
}

/// The rays through obvhs' own traversal with its own triangle test give the same results.
#[test]
fn another_librarys_traversal_sees_the_same() {
    let mesh = shapes::teapot(8, true);
    let bvh = Bvh::build(&mesh);
    let triangles: Vec<Triangle> = (0..mesh.triangles.len())
        .map(|i| {
            let [v0, v1, v2] = mesh.corners(i).map(Vec3A::from);
            Triangle { v0, v1, v2 }
        })
        .collect();
    let other = obvhs::bvh2::builder::build_bvh2_from_tris(
        &triangles,
        obvhs::BvhBuildParams::fastest_build(),
        &mut Default::default(),
    );
    let mut random = Random(5);
    let mut differ = 0;
    for _ in 0..20_000 {
        let ray = Ray { origin: random.direction() * random.next(), direction: random.direction() };
        let theirs = obvhs::ray::Ray::new_inf(ray.origin.into(), ray.direction.into());
        let miss = other
            .ray_traverse_miss(theirs, |r, id| triangles[other.primitive_indices[id] as usize].intersect(r));
        differ += usize::from(miss == bvh.occluded(&ray, f32::INFINITY));
    }
    // Only rays through an edge may differ.
    assert!(differ <= 2, "{differ}");
}

/// The Stanford bunny, 256 cosine-weighted directions at every 64th used vertex: 9.0 % are occluded (obvhs'
/// own traversals agree to five digits on every fourth).
#[test]
fn nine_percent_of_the_bunnys_directions_are_occluded() {
    let Some(path) = steradian_testkit::data("meshes/bunny_bun_zipper.ply") else { return };
    let mesh = crate::load(&path, &Default::default()).unwrap().merged();
    let (bvh, used, offset) = (Bvh::build(&mesh), mesh.used(), 1e-4 * mesh.diagonal());
    let mut random = Random(11);
    let mut rays = Vec::new();
    for i in (0..mesh.positions.len()).step_by(64).filter(|&i| used[i]) {
        let n = mesh.normals[i];
        for _ in 0..256 {
            let direction = (n + random.direction()).normalize_or(n);
            rays.push(Ray { origin: mesh.positions[i] + n * offset, direction });
        }
    }
    let blocked = bvh.occluded_many(&rays, f32::INFINITY).iter().filter(|b| **b).count();
    let share = blocked as f64 / rays.len() as f64;
    assert!((share - 0.0902).abs() < 0.01, "{share}");
}
