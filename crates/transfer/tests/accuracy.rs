//! Transfer against independent values and closed forms.

use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_scene::{Bvh, Mesh, Ray, load, shapes};
use steradian_sphere::{Frame, sh};
use steradian_transfer::{FileError, Saved, Scene, Settings, Site, Store, Transfer, transfer};

fn of(mesh: &Mesh, sites: &[Site], settings: &Settings) -> Transfer {
    transfer(&Scene::new(mesh).expect("a mesh"), sites, settings, None, &Task::quiet()).expect("transfer")
}

/// A ground plate below a mesh.
fn on_plate(mesh: Mesh) -> Mesh {
    let (lo, hi) = mesh.bounds().expect("vertices");
    let size = (hi - lo).max_element();
    let map = glam::Affine3A::from_scale_rotation_translation(
        Vec3::new(2.0 * size, 0.1 * size, 2.0 * size),
        glam::Quat::IDENTITY,
        Vec3::new(0.5 * (lo.x + hi.x), lo.y - 0.05 * size, 0.5 * (lo.z + hi.z)),
    );
    Mesh::merged(&[mesh, shapes::cuboid([1.0; 3], 1).transformed(&map)])
}

/// t, v (25 each) and ao of one site by `n` directions of a lattice, uniform over the hemisphere: an
/// independent sampler, basis and sums.
fn independent(bvh: &Bvh, site: &Site, n: usize) -> (Vec<f64>, Vec<f64>, f64) {
    let frame = Frame::from_normal(site.n.as_dvec3().normalize());
    let origin = site.p + 1e-4 * site.n;
    let directions: Vec<DVec3> = (0..n)
        .map(|k| {
            // Weyl's sequence of the plastic number (Roberts 2018).
            let u = (0.5 + k as f64 * 0.754_877_666_246_692_8).fract();
            let phi = 2.0 * PI * (0.5 + k as f64 * 0.569_840_290_998_053_2).fract();
            let r = (1.0 - u * u).sqrt();
            frame.to_world(DVec3::new(r * phi.cos(), r * phi.sin(), u))
        })
        .collect();
    let rays: Vec<Ray> = directions.iter().map(|d| Ray { origin, direction: d.as_vec3() }).collect();
    let hits = bvh.occluded_many(&rays, f32::INFINITY);
    let (mut t, mut v, mut y) = (vec![0.0; 25], vec![0.0; 25], vec![0.0; 25]);
    for (d, _) in directions.iter().zip(&hits).filter(|(_, h)| !**h) {
        sh::eval(4, *d, &mut y);
        for i in 0..25 {
            t[i] += d.dot(frame.n) * y[i] * 2.0 * PI / n as f64;
            v[i] += y[i] * 2.0 * PI / n as f64;
        }
    }
    let ao = t[0] * (4.0 * PI).sqrt() / PI;
    (t, v, ao)
}

/// The largest differences of t and of v over all sites.
fn differences(mesh: &Mesh, sites: &[Site], x: &Transfer, n: usize) -> ([f64; 2], Vec<f64>) {
    let bvh = Bvh::build(mesh);
    let mut worst = [0.0f64; 2];
    let mut of_t = Vec::new();
    for (k, site) in sites.iter().enumerate() {
        let (t, v, ao) = independent(&bvh, site, n);
        let far = |a: &[f32], b: &[f64]| {
            a.iter().zip(b).map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, f64::max)
        };
        let e = far(x.vector(k, 0), &t).max(far(&[x.ao[k]], &[ao]));
        of_t.push(e);
        worst = [worst[0].max(e), worst[1].max(far(x.visibility(k), &v))];
    }
    (worst, of_t)
}

/// The error of direct and interreflected light together is within the tolerance of their sum.
#[test]
fn reflected_light_is_within_the_tolerance_too() {
    let mesh = shapes::torus(1.0, 0.4, 24);
    let settings = Settings { tolerance: 5e-3, bounces: 3, albedo: vec![[0.8; 3]], ..Settings::default() };
    let x = of(&mesh, &Site::vertices(&mesh), &settings);
    let worst = x.error.iter().fold(0.0f32, |m, e| m.max(e[0]));
    assert!((1e-3..=5e-3).contains(&worst), "{worst}");
}

#[test]
fn the_bunny_on_its_plate_is_within_the_tolerance() {
    let Some(path) = steradian_testkit::data("meshes/bunny_bun_zipper.ply") else { return };
    let bunny = load(&path, &Default::default()).unwrap().merged();
    let low = bunny.bounds().unwrap().0.y;
    let mesh = on_plate(bunny);
    let step = if steradian_testkit::full() { 97 } else { 1697 };
    let all = Site::vertices(&mesh);
    let there = all.iter().copied().filter(|s| !s.is_absent());
    // Sites that face the plate and nearly touch it see out through gaps of a fraction of a degree.
    let touching = there.clone().filter(|s| s.n.y < -0.9 && s.p.y < low + 1.5e-3);
    let sites: Vec<Site> = there.step_by(step).chain(touching.step_by(step / 12)).collect();
    for (tolerance, n) in [(1e-2, 100_000), (1e-3, 1_000_000)] {
        let x = of(&mesh, &sites, &Settings { tolerance, ..Settings::default() });
        let (worst, each) = differences(&mesh, &sites, &x, n);
        let rms = (each.iter().map(|e| e * e).sum::<f64>() / each.len() as f64).sqrt();
        let said = x.worst_error();
        assert!(said[0] <= tolerance && said[1] <= 5.0 * tolerance, "{said:?}");
        // As accurate as stated, and not much better than required.
        assert!(rms > 0.05 * tolerance && rms < 0.5 * tolerance, "{rms}");
        assert!(worst[0] <= tolerance && worst[1] <= 5.0 * tolerance, "{worst:?}");
    }
}

/// Above every vertex of a convex body V ≡ 1: t_lm = Â_l y_lm(n), v that of the hemisphere, the bent normal
/// the normal.
#[test]
fn a_convex_body_has_the_closed_forms() {
    let mesh = shapes::icosphere(2);
    let sites = Site::vertices(&mesh);
    let x = of(&mesh, &sites, &Settings { rays: Some(256), bands: 4, ..Settings::default() });
    let (cosine, hemisphere) = (sh::zonal::cosine(3), sh::zonal::phong(3, 0.0));
    for (k, s) in sites.iter().enumerate() {
        let mut y = [0.0; 16];
        sh::eval(3, s.n.as_dvec3(), &mut y);
        for i in 0..16usize {
            assert!((f64::from(x.vector(k, 0)[i]) - cosine[i.isqrt()] * y[i]).abs() < 1e-6);
            assert!((f64::from(x.visibility(k)[i]) - hemisphere[i.isqrt()] * y[i]).abs() < 1e-6);
        }
        assert!((x.ao[k] - 1.0).abs() < 1e-6 && (Vec3::from(x.bent_normal(k)) - s.n).length() < 1e-5);
        assert_eq!(x.error[k], [0.0; 2]);
    }
}

/// A wall from (x, 0) up to (x, height), long in z, of quads.
fn strip(from: Vec3, to: Vec3, long: f32, n: u32) -> Mesh {
    let z = Vec3::new(0.0, 0.0, 0.5 * long);
    let along = (to - from).normalize();
    let normal = Vec3::Z.cross(along);
    let mut mesh = Mesh::default();
    for i in 0..=n {
        let p = from.lerp(to, i as f32 / n as f32);
        mesh.positions.extend([p - z, p + z]);
        mesh.normals.extend([normal; 2]);
    }
    mesh.triangles =
        (0..n).flat_map(|i| [[2 * i, 2 * i + 1, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 2]]).collect();
    mesh
}

/// On the floor of a long groove whose walls rise to elevations a and b, ao = ½(cos a + cos b).
#[test]
fn a_groove_has_its_closed_form() {
    let groove = |height: f32| {
        Mesh::merged(&[
            strip(Vec3::new(-1.0, height, 0.0), Vec3::new(-1.0, 0.0, 0.0), 200.0, 1),
            strip(Vec3::new(-1.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0), 200.0, 1),
            strip(Vec3::new(1.0, 0.0, 0.0), Vec3::new(1.0, height, 0.0), 200.0, 1),
        ])
    };
    for height in [0.3, 1.0, 5.0] {
        let sites: Vec<Site> =
            [-0.9, -0.3, 0.0, 0.77].map(|x| Site { p: Vec3::new(x, 0.0, 0.1), n: Vec3::Y }).to_vec();
        let x = of(&groove(height), &sites, &Settings { offset: 1e-6, ..Settings::default() });
        for (k, s) in sites.iter().enumerate() {
            let wall = |d: f32| f64::from(d / d.hypot(height));
            let exact = 0.5 * (wall(1.0 + s.p.x) + wall(1.0 - s.p.x));
            assert!((f64::from(x.ao[k]) - exact).abs() < 1e-3, "{height} {}: {} {exact}", s.p.x, x.ao[k]);
        }
    }
}

/// Under a roof with a slit between the angles a and b from the normal, long in z: ao = ½ (sin b − sin a),
/// and of the sphere's 4π it shows a lune of 2 (b − a).
#[test]
fn a_thin_gap_is_seen() {
    for from in [0.0f64, 20.0, 50.0, 75.0, 84.0, 88.0, 89.2] {
        for width in [0.3, 0.8] {
            let [a, b] = [from, from + width].map(f64::to_radians);
            let at = |angle: f64| Vec3::new(angle.tan() as f32, 1.0, 0.0);
            let mesh = Mesh::merged(&[
                strip(Vec3::new(-1e3, 1.0, 0.0), at(a), 4e4, 1),
                strip(Vec3::new(-1e3, 0.0, 0.0), Vec3::new(-1e3, 1.0, 0.0), 4e4, 1),
                strip(at(b), at(b) + Vec3::X * 1e3, 4e4, 1),
                strip(at(b) + Vec3::X * 1e3, Vec3::new(at(b).x + 1e3, 0.0, 0.0), 4e4, 1),
            ]);
            let places = (0..3).map(|k| Site { p: Vec3::new(0.0, 0.0, 7.0 * k as f32), n: Vec3::Y });
            let x = of(&mesh, &places.collect::<Vec<_>>(), &Settings { offset: 0.0, ..Settings::default() });
            for k in 0..x.len() {
                let off = f64::from(x.ao[k]) - 0.5 * (b.sin() - a.sin());
                assert!(off.abs() < 1e-3, "{from} {width}: ao is off by {off}");
                let off = f64::from(x.visibility(k)[0]) - 2.0 * (b - a) / (4.0 * PI).sqrt();
                assert!(off.abs() < 5e-3, "{from} {width}: v is off by {off}");
            }
        }
    }
}

/// In a white bowl under uniform light everything becomes as bright as the light, once all reflections are
/// summed: the deep groove approaches that in steps, none of which overshoots.
#[test]
fn a_white_furnace_is_reached_from_below() {
    let n = 16;
    let mesh = Mesh::merged(&[
        strip(Vec3::new(-1.0, 1.0, 0.0), Vec3::new(-1.0, 0.0, 0.0), 200.0, n),
        strip(Vec3::new(-1.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0), 200.0, 2 * n),
        strip(Vec3::new(1.0, 0.0, 0.0), Vec3::new(1.0, 1.0, 0.0), 200.0, n),
    ]);
    let site = [Site { p: Vec3::new(0.25, 0.0, 0.0), n: Vec3::Y }];
    let mut last = 0.0;
    for bounces in [1, 2, 4, 40] {
        let settings = Settings {
            bands: 1,
            bounces,
            albedo: vec![[1.0; 3]],
            tolerance: 3e-3,
            offset: 1e-5,
            ..Settings::default()
        };
        // ∫ L (n·w) dw/π with L = 1.
        let x = f64::from(of(&mesh, &site, &settings).vector(0, 0)[0]) * (4.0 * PI).sqrt() / PI;
        // The tolerance of a coefficient is 0.34 % of x, and interreflected light may have the same error.
        assert!(x > last && x < 1.0065, "{bounces}: {x} after {last}");
        last = x;
    }
    assert!(last > 0.99, "{last}");
}

/// Reflections of coloured walls make three vectors, and those of grey ones one.
#[test]
fn coloured_albedo_bleeds() {
    let red = strip(Vec3::new(1.0, 0.0, 0.0), Vec3::new(1.0, 2.0, 0.0), 100.0, 8).with_material(1);
    let mesh = Mesh::merged(&[strip(Vec3::new(-1.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0), 100.0, 8), red]);
    let site = [Site { p: Vec3::new(0.5, 0.0, 0.0), n: Vec3::Y }];
    let settings = |red: [f64; 3]| Settings {
        bounces: 2,
        tolerance: 1e-2,
        albedo: vec![[0.5; 3], red],
        ..Settings::default()
    };
    let x = of(&mesh, &site, &settings([0.8, 0.1, 0.0]));
    let t = |c: usize| x.vector(0, c)[0];
    assert_eq!(x.channels, 3);
    let direct = x.direct.as_ref().expect("with reflections")[0];
    assert_eq!(t(2), direct);
    let (r, g) = (t(0) - direct, t(1) - direct);
    assert!(r > 0.05 && (r / g - 8.0).abs() < 1e-3, "{r} {g}");
    assert_eq!(of(&mesh, &site, &settings([0.8; 3])).channels, 1);
}

/// Stratified grids converge like N^(−3/4): the square root of the number of cells that a boundary crosses.
#[test]
fn more_rays_err_less_at_the_rate_of_strata() {
    let mesh = on_plate(shapes::torus(0.7, 0.3, 48));
    let all = Site::vertices(&mesh);
    let sites: Vec<Site> = all.into_iter().step_by(53).filter(|s| !s.is_absent()).collect();
    let truth = of(&mesh, &sites, &Settings { rays: Some(1 << 18), ..Settings::default() });
    let error = |rays: u32| {
        let x = of(&mesh, &sites, &Settings { rays: Some(rays), ..Settings::default() });
        let sum: f64 = x.t.iter().zip(&truth.t).map(|(a, b)| f64::from(a - b).powi(2)).sum();
        (sum / x.t.len() as f64).sqrt()
    };
    let (coarse, fine) = (error(1 << 6), error(1 << 12));
    // 64 times the rays: 22.6 times less error, 8 times with independent rays.
    assert!(coarse / fine > 13.0 && coarse / fine < 40.0, "{coarse} {fine}");
}

#[test]
fn threads_and_interruptions_do_not_change_a_bit() {
    let mesh = on_plate(shapes::torus(0.7, 0.3, 24));
    let (scene, sites) = (Scene::new(&mesh).unwrap(), Site::vertices(&mesh));
    let settings = Settings { tolerance: 2e-2, bounces: 2, ..Settings::default() };
    let with = |threads: usize, store: Option<&Store>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| transfer(&scene, &sites, &settings, store, &Task::quiet()).unwrap())
    };
    let one = with(1, None);
    assert_eq!(with(3, None), one);
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("t.safetensors");
    let key = steradian_transfer::key(&scene, &sites, &settings);
    let store = Store::open(&output, &key).unwrap();
    assert_eq!(with(2, Some(&store)), one);
    drop(store);
    let store = Store::open(&output, &key).unwrap();
    assert_eq!(store.found(), sites.len().div_ceil(steradian_transfer::BLOCK));
    assert_eq!(with(2, Some(&store)), one);
}

#[test]
fn what_is_no_site_is_said() {
    let mesh = shapes::icosphere(2);
    let inside =
        of(&mesh, &[Site { p: Vec3::ZERO, n: Vec3::Y }], &Settings { rays: Some(64), ..Settings::default() });
    assert_eq!(inside.enclosed, [0]);
    assert!(inside.t.iter().chain(&inside.v).chain(&inside.ao).all(|x| *x == 0.0));
    let scene = Scene::new(&mesh).unwrap();
    let fails = |site: Site, settings: Settings| {
        transfer(&scene, &[site], &settings, None, &Task::quiet()).unwrap_err().to_string()
    };
    let good = Site { p: Vec3::ZERO, n: Vec3::Y };
    assert!(fails(Site { n: Vec3::NAN, ..good }, Settings::default()).contains("site 0"));
    assert!(fails(good, Settings { bands: 16, ..Settings::default() }).contains("1 to 15"));
    assert!(fails(good, Settings { bounces: 0, ..Settings::default() }).contains("direct light"));
    assert!(Scene::new(&Mesh::default()).err().unwrap().to_string().contains("no triangles"));
}

/// A file is read back, and is recognised as that of another mesh.
#[test]
fn files_come_back_and_know_their_mesh() {
    let mesh = on_plate(shapes::icosphere(1));
    let sites = Site::vertices(&mesh);
    let settings = Settings { bands: 3, rays: Some(64), matrices: true, ..Settings::default() };
    let saved = Saved::new(of(&mesh, &sites, &settings), &mesh, "vertices".into(), &settings);
    let mut file = saved.tensors();
    let mut back = Saved::read(&file).unwrap();
    (back.transfer.rays, back.transfer.enclosed) = (saved.transfer.rays, saved.transfer.enclosed.clone());
    assert_eq!(back, saved);
    let matrices: Vec<f32> = saved.matrices(&sites).flatten().collect();
    assert_eq!(matrices.len(), 81 * sites.len());
    // ∫ V y_0² of the constant harmonic, V being 1 below the horizon.
    for (m, k) in matrices.chunks(81).zip(0..) {
        assert!((m[0] - 0.5 - saved.transfer.visibility(k)[0] * 0.282_094_8).abs() < 1e-5, "{k}");
    }
    assert!(back.fits(&mesh, 3).is_ok());
    assert!(back.fits(&mesh, 4).unwrap_err().to_string().contains("3 bands"));
    assert!(back.fits(&shapes::icosphere(1), 3).unwrap_err().to_string().contains("another mesh"));
    file.tensors.remove("v");
    assert!(Saved::read(&file).unwrap_err().to_string().contains("'v'"));
    assert_eq!(Saved::read(&Default::default()), Err(FileError::NoTransfer));
}

/// Visibility by direction is nearer by least squares over the hemisphere than by the series of ∫ V y dw.
#[test]
fn least_squares_over_the_hemisphere_are_nearer_to_visibility() {
    let mesh = on_plate(shapes::knot(2, 3, 0.6, 0.3, 0.1, 24));
    let sites: Vec<Site> = Site::vertices(&mesh).into_iter().step_by(29).collect();
    let bvh = Bvh::build(&mesh);
    for (bands, expected) in
        [(3, [0.328, 0.273]), (4, [0.296, 0.252]), (5, [0.276, 0.236]), (8, [0.226, 0.191])]
    {
        let settings = Settings { bands, ..Settings::default() };
        let mut saved = Saved::new(of(&mesh, &sites, &settings), &mesh, "points".into(), &settings);
        saved.project_on_hemispheres(&sites, &Task::quiet()).expect("nobody cancels");
        let nearest = saved.hemisphere.as_deref().expect("projected");
        let (mut off, mut count, mut y) = ([0.0; 2], 0.0, vec![0.0; bands * bands]);
        for (k, site) in sites.iter().enumerate() {
            let frame = Frame::from_normal(site.n.as_dvec3().normalize());
            for i in 0..500 {
                let z = (f64::from(i) + 0.5) / 500.0;
                let (r, phi) = ((1.0 - z * z).sqrt(), 2.4 * f64::from(i));
                let d = frame.to_world(DVec3::new(r * phi.cos(), r * phi.sin(), z));
                sh::eval(bands - 1, d, &mut y);
                let ray = Ray { origin: site.p + 1e-4 * site.n, direction: d.as_vec3() };
                let v = f64::from(u8::from(!bvh.occluded(&ray, f32::INFINITY)));
                for (off, c) in off.iter_mut().zip([saved.transfer.visibility(k), &nearest[k * y.len()..]]) {
                    *off += (y.iter().zip(c).map(|(y, c)| y * f64::from(*c)).sum::<f64>() - v).powi(2);
                }
                count += 1.0;
            }
        }
        // The numbers of docs/transfer.md.
        let rms = off.map(|o: f64| (o / count).sqrt());
        assert!((0..2).all(|i| (rms[i] - expected[i]).abs() < 2e-3), "{bands} bands: {rms:.4?}");
    }
}
