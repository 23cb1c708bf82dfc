//! Pictures of known content.

use super::*;
use glam::Vec3;
use steradian_scene::shapes;
use steradian_techniques::{Points, Radiance};

/// Radiance (n + 1)/2, so that a picture shows the normals.
struct Normals;

impl Shader for Normals {
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, _: &Task) -> Result<(), Cancelled> {
        for c in 0..3 {
            for i in 0..q.len() {
                out.rgb[c][i] = 0.5 * (q.n[c][i] + 1.0);
            }
        }
        Ok(())
    }
}

fn picture(width: usize, height: usize, settings: impl Fn(&mut Settings), texture: Option<Texture>) -> Film {
    let mesh = shapes::sphere(256);
    let bvh = Bvh::build(&mesh);
    let surfaces = [Surface {
        shader: Arc::new(Normals),
        base_colour: texture.map(Arc::new),
        maps: SurfaceMaps::default(),
    }];
    let camera =
        Camera::Orthographic { from: Vec3::new(0.0, 0.0, 5.0), at: Vec3::ZERO, up: Vec3::Y, height: 4.0 };
    let background = Background::Colour([0.25; 3]);
    let stage = Stage { mesh: &mesh, bvh: &bvh, surfaces: &surfaces, background: &background, camera };
    let mut s = Settings::new(width, height);
    settings(&mut s);
    render(&stage, &s, &Task::quiet()).expect("nobody cancels")
}

#[test]
fn coverage_is_the_disk_s_area_and_normals_are_where_they_belong() {
    for (inner, share) in [(1, false), (2, false), (1, true)] {
        let f = picture(150, 130, |s| (s.inner, s.share) = (inner, share), None);
        // A unit disk in a film of height 4.
        let scale = (130.0f64 / 4.0).powi(2);
        let area = f.alpha.iter().map(|a| f64::from(*a)).sum::<f64>() / scale;
        // Few samples overlook corners that an edge cuts off between them.
        assert!((area / std::f64::consts::PI - 1.0).abs() < 5e-3, "{inner}: {area}");
        // The centre of the picture faces +Z; a point half a radius to the right has n_x = ½.
        let at = |x: f64, y: f64| f.pixel((65.0 - y * 32.5) as usize * 150 + (75.0 + x * 32.5) as usize);
        assert!((at(0.0, 0.0)[2] - 1.0).abs() < 1e-3);
        assert!((at(0.5, 0.0)[0] - 0.75).abs() < 0.01 && (at(0.0, 0.5)[1] - 0.75).abs() < 0.01);
        assert!((f.pixel(0)[0] - 0.25).abs() < 1e-6 && f.alpha[0] == 0.0);
    }
}

#[test]
fn tiles_leave_no_seams() {
    // The same disk, placed so that tiles cut it differently.
    let (a, b) = (picture(128, 128, |_| {}, None), picture(256, 128, |_| {}, None));
    for y in 0..128 {
        for x in 0..128 {
            let (p, q) = (a.pixel(y * 128 + x), b.pixel(y * 256 + x + 64));
            assert!((p[1] - q[1]).abs() < 2e-3, "({x}, {y}): {p:?} {q:?}");
        }
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let with = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("threads");
        pool.install(|| picture(100, 70, |_| {}, None))
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn a_texture_multiplies_radiance() {
    let half = Texture::new(1, 1, &[vec![0.5], vec![1.0], vec![0.0]]).expect("a texel");
    let (plain, tinted) = (picture(64, 64, |_| {}, None), picture(64, 64, |_| {}, Some(half)));
    let k = 32 * 64 + 32;
    let (p, t) = (plain.pixel(k), tinted.pixel(k));
    assert!((t[0] - 0.5 * p[0]).abs() < 1e-5 && (t[1] - p[1]).abs() < 1e-5 && t[2] == 0.0);
}

/// Deviation of vertex data, interpolated by site, from position and texture coordinates.
struct Sites(Mesh);

impl Shader for Sites {
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, _: &Task) -> Result<(), Cancelled> {
        for i in 0..q.len() {
            let [u, v] = q.site.weight.map(|w| w[i]);
            let corners = q.site.index.map(|s| s[i] as usize);
            let weighted = || corners.into_iter().zip([1.0 - u - v, u, v]);
            let p: Vec3 = weighted().map(|(s, w)| self.0.positions[s] * w).sum();
            let uv: glam::Vec2 = weighted().map(|(s, w)| self.0.uvs[s] * w).sum();
            out.rgb[0][i] = p.distance(Vec3::from(q.p.map(|c| c[i])));
            out.rgb[1][i] = uv.distance(glam::Vec2::from(q.uv.map(|c| c[i])));
            out.rgb[2][i] = uv.x;
        }
        Ok(())
    }
}

#[test]
fn every_shaded_point_knows_its_site_and_texture_coordinates() {
    let moved = glam::Affine3A::from_translation(Vec3::new(1.5, 0.2, 0.0));
    let mesh = Mesh::merged(&[shapes::sphere(24), shapes::sphere(16).transformed(&moved).with_material(1)]);
    let bvh = Bvh::build(&mesh);
    let surface =
        Surface { shader: Arc::new(Sites(mesh.clone())), base_colour: None, maps: SurfaceMaps::default() };
    let surfaces = [surface.clone(), surface];
    let background = Background::Colour([0.0; 3]);
    let camera = Camera::Orthographic { from: Vec3::Z * 5.0, at: Vec3::X, up: Vec3::Y, height: 4.0 };
    let stage = Stage { mesh: &mesh, bvh: &bvh, surfaces: &surfaces, background: &background, camera };
    for share in [false, true] {
        let settings = Settings { share, ..Settings::new(96, 80) };
        let film = render(&stage, &settings, &Task::quiet()).expect("nobody cancels");
        let most = |c: usize| film.rgb[c].iter().fold(0.0f32, |m, x| m.max(*x));
        assert!(most(0) < 1e-4 && most(1) < 1e-6, "{} {}", most(0), most(1));
        assert!(most(2) > 0.2, "no texture coordinates");
    }
}

#[test]
fn a_cancelled_picture_ends() {
    let flag = Arc::new(std::sync::atomic::AtomicBool::new(true));
    let mesh = shapes::sphere(16);
    let bvh = Bvh::build(&mesh);
    let surfaces = [Surface { shader: Arc::new(Normals), base_colour: None, maps: SurfaceMaps::default() }];
    let background = Background::Colour([0.0; 3]);
    let camera = Camera::Orthographic { from: Vec3::Z * 3.0, at: Vec3::ZERO, up: Vec3::Y, height: 3.0 };
    let stage = Stage { mesh: &mesh, bvh: &bvh, surfaces: &surfaces, background: &background, camera };
    let task = Task::quiet().with_cancel(flag);
    assert_eq!(render(&stage, &Settings::new(64, 64), &task), Err(Cancelled));
}
