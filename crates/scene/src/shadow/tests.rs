//! Maps and volumes compared with rays.

use super::*;
use crate::{Mesh, shapes};
use glam::Affine3A;

/// Points that maps are compared with rays at.
const POINTS: usize = 300_000;
/// Distance of points off the surface.
const OFFSET: f32 = 1e-4;

/// A knot above a floor.
fn scene() -> Mesh {
    let lift = Affine3A::from_translation(Vec3::Y);
    let floor = shapes::by_name("plane:size=6").expect("a shape");
    Mesh::merged(&[shapes::knot(2, 3, 0.6, 0.3, 0.1, 24).transformed(&lift), floor])
}

/// Points of a mesh with their geometric normals, turned to the light.
fn points(mesh: &Mesh, light: LightAt, count: usize) -> Vec<(Ray, Vec3, f32)> {
    let mut out = Vec::new();
    let areas: Vec<f32> = (0..mesh.triangles.len())
        .map(|i| {
            let [a, b, c] = mesh.corners(i);
            (b - a).cross(c - a).length()
        })
        .collect();
    let whole: f32 = areas.iter().sum();
    let (mut k, mut before) = (0, 0.0);
    for (i, area) in areas.iter().enumerate() {
        let [a, b, c] = mesh.corners(i);
        while k < count && (k as f32 + 0.5) / count as f32 * whole < before + area {
            let (u, v) = ((k as f32 * 0.754_877_7).fract(), (k as f32 * 0.569_840_3).fract());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let p = a + u * (b - a) + v * (c - a);
            let (d, distance) = match light {
                LightAt::Far(d) => (d, f32::INFINITY),
                LightAt::Near(l) => ((l - p).normalize(), (l - p).length()),
            };
            let n = (b - a).cross(c - a).normalize_or_zero();
            let n = if n.dot(d) < 0.0 { -n } else { n };
            out.push((Ray { origin: p + OFFSET * n, direction: d }, n, distance - OFFSET));
            k += 1;
        }
        before += area;
    }
    out
}

const LIGHTS: [LightAt; 4] = [
    LightAt::Far(Vec3::new(0.36, 0.8, 0.48)),
    LightAt::Far(Vec3::new(0.8, 0.36, -0.48)),
    LightAt::Near(Vec3::new(1.3, 2.9, 0.4)),
    LightAt::Near(Vec3::new(0.05, 1.02, 0.1)),
];

/// Points that face a light, and what rays say of them.
struct Facing(Vec<((Ray, Vec3, f32), bool)>);

impl Facing {
    fn new(mesh: &Mesh, bvh: &Bvh, light: LightAt) -> Self {
        let facing =
            points(mesh, light, POINTS).into_iter().filter(|(ray, n, _)| ray.direction.dot(*n) > 0.2);
        let all: Vec<_> = facing.map(|p| (p, bvh.arriving(&p.0, p.1, p.2) > 0.5)).collect();
        assert!(all.len() > POINTS / 10);
        Self(all)
    }

    /// The part at which a blocker and rays disagree.
    fn mislit(&self, blocker: &dyn Blocker) -> f32 {
        let wrong =
            |((ray, n, d), lit): &&((Ray, Vec3, f32), bool)| (blocker.arriving(ray, *n, *d) > 0.5) != *lit;
        self.0.iter().filter(wrong).count() as f32 / self.0.len() as f32
    }
}

/// Points lit wrongly are those within a texel or so of an edge of a shadow: half as many with twice the
/// texels a side. Over two doublings the ratio is 4 within a third, over all three from 5.6 (a lamp within
/// the knot, a twentieth of it from its surface) to 8.3: the power of the resolution is −0.83 to −1.02.
#[test]
fn maps_err_by_half_as_much_with_twice_the_texels() {
    let mesh = scene();
    let bvh = Bvh::build(&mesh);
    for light in LIGHTS {
        let facing = Facing::new(&mesh, &bvh, light);
        for taps in [1, 3] {
            let errors = [128, 256, 512, 1024].map(|size| {
                facing.mislit(&ShadowMaps::new(&mesh, &bvh, &[light], MapOptions { size, taps }))
            });
            let twice = [errors[0] / errors[2], errors[1] / errors[3]];
            println!("{light:?}, {taps} taps: {errors:?}, of two doublings {twice:.2?}");
            let all = errors[0] / errors[3];
            assert!(twice.iter().all(|r| (2.7..5.2).contains(r)), "{light:?}: {errors:?}");
            assert!((5.3..9.0).contains(&all) && errors[3] < 0.003, "{light:?}: {errors:?}");
        }
    }
}

/// A ground of 40 kilometres under the mesh does not coarsen its shadows.
#[test]
fn maps_over_a_ground_to_the_horizon_are_as_fine() {
    let sunk = Affine3A::from_translation(-0.01 * Vec3::Y);
    let ground = shapes::by_name("plane:size=40000").expect("a shape").transformed(&sunk);
    let mesh = Mesh::merged(&[scene(), ground]);
    let bvh = Bvh::build(&mesh);
    for light in &LIGHTS[..2] {
        let maps = ShadowMaps::new(&mesh, &bvh, &[*light], MapOptions::default());
        let error = Facing::new(&scene(), &bvh, *light).mislit(&maps);
        assert!(error < 0.012, "{light:?}: {error}");
    }
}

#[test]
fn filtered_edges_are_between_light_and_shadow() {
    let mesh = scene();
    let bvh = Bvh::build(&mesh);
    let maps = ShadowMaps::new(&mesh, &bvh, &LIGHTS[..1], MapOptions { size: 256, taps: 5 });
    let parts: Vec<f32> =
        points(&mesh, LIGHTS[0], 20_000).iter().map(|(ray, n, d)| maps.arriving(ray, *n, *d)).collect();
    assert!(parts.iter().all(|p| (0.0..=1.0).contains(p)));
    assert!(parts.iter().filter(|p| **p > 0.1 && **p < 0.9).count() > 100);
}

/// Volumes are those of rays but where a ray passes an edge by less than rounding: there the verdict of rays
/// changes too within 1e-3.
#[test]
fn volumes_are_what_rays_find() {
    let open = Mesh::merged(&[
        shapes::teapot(4, true).transformed(&Affine3A::from_translation(Vec3::Y)),
        shapes::by_name("plane:size=6").expect("a shape"),
    ]);
    for mesh in [scene(), open] {
        let bvh = Bvh::build(&mesh);
        let all = ShadowVolumes::new(&mesh, &LIGHTS);
        assert!(all.triangles() > 4 * mesh.triangles.len());
        for light in LIGHTS {
            let (mut wrong, mut blocked, mut count) = (0, 0, 0);
            for (ray, n, distance) in points(&mesh, light, 8000) {
                if ray.direction.dot(n) < 0.05 {
                    continue;
                }
                let (got, want) = (all.arriving(&ray, n, distance), bvh.arriving(&ray, n, distance));
                count += 1;
                blocked += usize::from(want == 0.0);
                if got != want {
                    let (x, y) = ray.direction.any_orthonormal_pair();
                    let beside = |d: Vec3| Ray { origin: ray.origin + 1e-3 * d, ..ray };
                    let edge = [x, -x, y, -y].map(|d| bvh.arriving(&beside(d), n, distance));
                    assert!(edge.iter().any(|e| *e != want), "{light:?}: {ray:?}");
                    wrong += 1;
                }
            }
            println!("{light:?}: {wrong} of {count}, {blocked} blocked");
            assert!(wrong * 200 < count && blocked * 50 > count, "{light:?}: {wrong}, {blocked} of {count}");
        }
    }
}

/// One triangle shadows from both sides, and nothing between it and the light.
#[test]
fn a_triangle_alone_casts_a_shadow() {
    let mesh = Mesh {
        positions: vec![Vec3::new(-1.0, 0.0, -1.0), Vec3::new(3.0, 0.0, -1.0), Vec3::new(-1.0, 0.0, 3.0)],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let (up, down) = (LightAt::Far(Vec3::Y), LightAt::Far(-Vec3::Y));
    let near = LightAt::Near(Vec3::new(0.2, 1.0, 0.3));
    let volumes = ShadowVolumes::new(&mesh, &[up, down, near]);
    let maps =
        ShadowMaps::new(&mesh, &Bvh::build(&mesh), &[up, down, near], MapOptions { size: 64, taps: 1 });
    for blocker in [&volumes as &dyn Blocker, &maps] {
        let arriving = |p: Vec3, light: LightAt| {
            let (direction, distance) = match light {
                LightAt::Far(d) => (d, f32::INFINITY),
                LightAt::Near(l) => ((l - p).normalize(), (l - p).length()),
            };
            blocker.arriving(&Ray { origin: p, direction }, direction, distance)
        };
        let (above, below, aside) =
            (Vec3::new(0.1, 0.5, 0.1), Vec3::new(0.1, -0.5, 0.1), Vec3::new(2.9, -0.5, 2.9));
        assert_eq!([up, down, near].map(|l| arriving(above, l)), [1.0, 0.0, 1.0], "{blocker:?}");
        assert_eq!([up, down, near].map(|l| arriving(below, l)), [0.0, 1.0, 0.0], "{blocker:?}");
        assert_eq!([up, down, near].map(|l| arriving(aside, l)), [1.0; 3], "{blocker:?}");
    }
}

#[test]
fn options_of_maps_are_a_list_of_keys() {
    let parsed = |text| MapOptions::parse(text);
    let usual = MapOptions::default();
    assert_eq!(parsed("size=2048,taps=1"), Ok(MapOptions { size: 2048, taps: 1 }));
    assert_eq!(parsed("taps=5"), Ok(MapOptions { taps: 5, ..usual }));
    assert_eq!(parsed("size=16"), Ok(MapOptions { size: 16, ..usual }));
    assert_eq!(parsed(""), Ok(usual));
    for (text, why) in [
        ("taps=4", "taps = 4 is even"),
        ("size=1", "size = '1' is not a whole number in 16 … 16384"),
        ("size", "'size' is not key=value"),
        ("taps=1,taps=3", "'taps' is given twice"),
        ("tap=3", "did you mean 'taps'?"),
    ] {
        assert!(parsed(text).is_err_and(|e| e.contains(why)), "{text}");
    }
}
