use super::*;
use crate::shared::trials::specimens;
use crate::trial::Certified;
use crate::{AnyBake, PointsBuf, find};
use glam::{DVec3, Vec3};
use steradian_base::ParamValues;
use steradian_brdf::Form;
use steradian_brdf::{Files, parse_with};
use steradian_light::DirectionalLight;
use steradian_scene::surface::Planes;
use steradian_sphere::Frame;

fn bake_in(slug: &str, lights: &Lights, spec: &str, params: &[(&str, f64)]) -> Box<dyn AnyBake> {
    let values: ParamValues = params.iter().copied().collect();
    let material = Material::new(parse_with(spec, Files::Any).unwrap());
    find(slug).unwrap().draft(lights, &material, None, &values, &Task::quiet()).unwrap()
}

fn bake(lights: &Lights, spec: &str, params: &[(&str, f64)]) -> Box<dyn AnyBake> {
    bake_in("lafortune-env", lights, spec, params)
}

const POINTS: usize = 48;

/// Frame and local wo of point `k`.
fn point(k: usize) -> (Frame, DVec3) {
    let n = steradian_prefilter::probe::direction(k, POINTS);
    let c: f64 = [0.95, 0.7, 0.4, 0.15][k % 4];
    let phi = 2.4 * k as f64;
    let s = (1.0 - c * c).sqrt();
    (Frame::from_normal(n), DVec3::new(s * phi.cos(), s * phi.sin(), c))
}

fn shade(b: &dyn AnyBake) -> Vec<[f64; 3]> {
    let mut q = PointsBuf::default();
    for k in 0..POINTS {
        let (f, wo) = point(k);
        q.push(f.n.as_vec3(), f.t.as_vec3(), f.to_world(wo).as_vec3(), Vec3::ZERO);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    // Without tangents the conventional ones are used, which are the same here.
    let mut bare: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
    b.shade(&Points { t: [&[]; 3], ..q.as_points() }, &mut Radiance::of(&mut bare));
    let largest = rgb.iter().flatten().fold(0.0f32, |m, v| m.max(v.abs()));
    for (a, b) in rgb.iter().flatten().zip(bare.iter().flatten()) {
        assert!((a - b).abs() <= 2e-3 * largest, "{a} {b}");
    }
    (0..POINTS).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]].map(f64::from)).collect()
}

fn difference(a: Vec<[f64; 3]>, b: Vec<[f64; 3]>) -> f64 {
    steradian_prefilter::probe::relative_rms(a.into_iter().zip(b))
}

/// C = (−1, −1, 1) is (n·r)₊ times Phong's map, by the axis and as eq. 39 prints it.
#[test]
fn the_mirror_lobe_is_the_cosine_times_phongs_map() {
    let light = lights::studio();
    let phong = shade(&*bake_in("phong-diffuse-maps", &light, "phong-map:n=25,scale=1/0.5/0.2", &[]));
    let expected: Vec<[f64; 3]> = (0..POINTS).map(|k| phong[k].map(|l| l * point(k).1.z)).collect();
    let spec = "lafortune:cx=-1,cy=-1,cz=1,n=25,ks=1/0.5/0.2";
    for cosine in [0.0, 1.0] {
        let error = difference(shade(&*bake(&light, spec, &[("cosine", cosine)])), expected.clone());
        assert!(error < 3e-3, "{cosine}: {error}");
    }
}

/// C = (0, 0, 1): r̂ = n and |c| = n·wo, a lobe about the normal.
#[test]
fn a_lobe_along_z_is_about_the_normal() {
    let direction = DVec3::new(0.2, 0.9, 0.3).normalize();
    let light = DirectionalLight { direction, irradiance: [1.0; 3] };
    let lights = Lights { directionals: vec![light], ..Lights::default() };
    let got = shade(&*bake(&lights, "lafortune:cx=0,cy=0,cz=1,n=12", &[("cosine", 0.0)]));
    for (k, got) in got.iter().enumerate() {
        let (f, wo) = point(k);
        let expected = wo.z.powi(12) * f.n.dot(direction).max(0.0).powi(12);
        assert!((got[0] - expected).abs() < 0.01, "{k}: {} {expected}", got[0]);
    }
}

/// ∫ (c·wi)₊^n L = |c|^n Phong_n(ĉ) exactly, whatever C: against every texel, without the cosine.
#[test]
fn the_length_of_c_is_an_identity() {
    let light = lights::smooth();
    let image = &light.environment.as_ref().unwrap().image;
    let (c, n) = (DVec3::new(-0.8, -1.2, 0.7), 9.0);
    let spec = format!("lafortune:cx={},cy={},cz={},n={n}", c.x, c.y, c.z);
    let got = shade(&*bake(&light, &spec, &[("cosine", 1.0), ("size", 64.0)]));
    let quadrature = |f: &Frame, wo: DVec3| {
        let axis = f.to_world(c * wo);
        let mut sum = [0.0; 3];
        for j in 0..image.height {
            for i in 0..image.width {
                let at = steradian_sphere::layout::Position { face: 0, x: i as f64 + 0.5, y: j as f64 + 0.5 };
                let d = image.layout.direction(image.width, image.height, at).unwrap();
                let omega = image.layout.solid_angle(image.width, image.height, 0, i, j);
                let w = omega * axis.dot(d).max(0.0).powf(n);
                let l = image.texel(0, i, j);
                (0..3).for_each(|c| sum[c] += w * f64::from(l[c]));
            }
        }
        sum
    };
    let pairs = (0..POINTS).step_by(3).map(|k| {
        let (f, wo) = point(k);
        (got[k], quadrature(&f, wo).map(|l| l * wo.z))
    });
    let error = steradian_prefilter::probe::relative_rms(pairs);
    assert!(error < 4e-3, "{error}");
}

/// Away from grazing views the cosine's part of the error falls like 1/n.
#[test]
fn the_cosines_part_of_the_error_falls_like_one_over_n() {
    for cosine in [0.0, 1.0, 2.0] {
        let errors = [20.0, 80.0].map(|n| {
            let light = lights::smooth();
            let brdf = steradian_brdf::parse(&format!("lafortune:cx=-1,cy=-1,cz=1,n={n}")).unwrap();
            let distant = DistantLight::bake("", &light, 63, &Task::quiet()).unwrap();
            let got = shade(&*bake(&light, &brdf.spec(), &[("cosine", cosine), ("size", 64.0)]));
            let to = |axis: DVec3| move |d: DVec3| d.angle_between(axis);
            let pairs = (0..POINTS).filter(|k| k % 4 < 2).map(|k| {
                let (f, wo) = point(k);
                let axis = f.to_world(DVec3::new(-wo.x, -wo.y, wo.z));
                let width = 1.0 / f64::sqrt(n);
                let near = to(axis);
                let exact = distant
                    .tree
                    .integrate(|d, _| (0.5 * near(d)).max(0.5 * width), |d| brdf.f_cos(f.to_local(d), wo));
                (got[k], exact)
            });
            steradian_prefilter::probe::relative_rms(pairs)
        });
        assert!(errors[0] > 2.5 * errors[1], "{cosine}: {errors:?}");
    }
}

/// Interpolation in a ladder of exponents is close to maps of the exponents themselves.
#[test]
fn a_ladder_of_exponents_is_close_to_their_own_maps() {
    let light = lights::smooth();
    let own = shade(&*bake(&light, "lafortune:@skin", &[]));
    let few = difference(shade(&*bake(&light, "lafortune:@skin", &[("exponents", 4.0)])), own.clone());
    let many = difference(shade(&*bake(&light, "lafortune:@skin", &[("exponents", 10.0)])), own);
    assert!(many < few && many < 5e-3, "{few} {many}");
}

#[test]
fn the_mean_cosine_is_the_integral() {
    for n in [0.0, 1.0, 7.5, 200.0] {
        for cosine in [-0.9_f64, -0.1, 0.0, 0.3, 0.95, 1.0] {
            // Rings about the axis, each in even steps.
            let (mut sum, mut all) = (0.0, 0.0);
            let sine = (1.0 - cosine * cosine).sqrt();
            for i in 0..2000 {
                let psi = std::f64::consts::FRAC_PI_2 * (f64::from(i) + 0.5) / 2000.0;
                let w = psi.cos().powf(n) * psi.sin();
                all += w * 256.0;
                for j in 0..256 {
                    let phi = std::f64::consts::PI * (f64::from(j) + 0.5) / 256.0;
                    sum += w * (cosine * psi.cos() + sine * psi.sin() * phi.cos()).max(0.0);
                }
            }
            let (got, want) = (bake::mean_cosine(n, cosine), sum / all);
            assert!((got - want).abs() < 2e-4, "{n} {cosine}: {got} {want}");
        }
    }
}

/// Bakes hold the lobes themselves: loading reads no other file.
#[test]
fn lobes_from_a_file_are_kept_in_the_bake() {
    let folder = std::env::temp_dir().join(format!("steradian-lafortune-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("lobes.csv");
    std::fs::write(&file, "diffuse,*,0.2\nlobe,*,-1,-1,0.9,20\nlobe,0,0.3,0.3,0.5,3,0.25\n").unwrap();
    let spec = format!("lafortune:lobes={},scale=0.5", file.display());
    let b = bake(&lights::smooth(), &spec, &[]);
    std::fs::remove_dir_all(&folder).unwrap();
    let saved = b.save();
    assert!(saved.metadata.values().all(|v| !v.contains('/')), "{:?}", saved.metadata);
    let loaded = find("lafortune_env").unwrap().load(&saved).unwrap();
    assert_eq!(shade(&*loaded), shade(&*b));
    // A changed light needs the reflectance for its certificate.
    let other = loaded.with_light(&lights::studio(), &Task::quiet()).unwrap();
    assert_eq!(other.certified().known, steradian_base::Evidence::Measured);
}

#[test]
fn what_it_refuses_says_why() {
    let t = find("lafortune_env").unwrap();
    let refused = |spec: &str| (t.card().materials)(&*steradian_brdf::parse(spec).unwrap()).unwrap_err();
    assert!(refused("ggx:alpha=0.2").contains("use lobe_maps"));
    assert!(refused("ward:ax=0.1,ay=0.3").contains("use reference"));
}

/// A material of no lobe but the ones of `planes`.
fn varied(lights: &Lights, planes: Planes, params: &[(&str, f64)]) -> Box<dyn AnyBake> {
    let values: ParamValues = params.iter().copied().collect();
    let base = steradian_brdf::parse("lafortune:cx=-1,cy=-1,cz=1,n=1,ks=0").unwrap();
    let m = Material::new(base).with_textures(planes);
    find("lafortune_env").unwrap().draft(lights, &m, None, &values, &Task::quiet()).unwrap()
}

fn figure(b: &dyn AnyBake, name: &str) -> f64 {
    b.certified().figure(name).unwrap_or_else(|| panic!("no {name}"))
}

/// Constant images give the reflectance with the same parameters, up to single precision.
#[test]
fn images_alike_are_one_reflectance() {
    let light = lights::studio();
    let constant = |v: [f64; 3]| specimens::texture(move |_, _| v);
    let planes = Planes::default()
        .with("rho_d", constant([0.2; 3]))
        .with("rho_1", constant([1.0, 0.8, 0.5]))
        .with("c_1", constant([-0.9, -0.7, 0.95]))
        .with("n_1", constant([40.0; 3]));
    let b = varied(&light, planes.clone(), &[("size", 32.0)]);
    let plain = bake(&light, "lafortune:cx=-0.9,cy=-0.7,cz=0.95,n=40,ks=1/0.8/0.5,kd=0.2", &[("size", 32.0)]);
    let error = difference(shade(&*b), shade(&*plain));
    println!("images alike: {error:.1e}");
    assert!(error < 1e-6, "{error}");
    assert_eq!((figure(&*b, "maps"), figure(&*b, "error between maps")), (1.0, 0.0));
    let [one, other] = [&b, &plain].map(|b| b.certified().error);
    assert!((one / other - 1.0).abs() < 0.15, "{one} {other}");
    // With two exponents each has a map of its own: nothing is mixed.
    let two = planes.with("rho_2", constant([0.3; 3])).with("n_2", constant([5.0; 3]));
    let b = varied(&light, two, &[("size", 32.0)]);
    assert_eq!((figure(&*b, "maps"), figure(&*b, "error between maps")), (2.0, 0.0));
}

/// The reflectance's own lobes stand where no image says a number; C and n by channel are kept.
#[test]
fn what_no_image_says_is_the_reflectances() {
    let light = lights::smooth();
    let spec = "lafortune:@skin";
    let plain = bake(&light, spec, &[("size", 32.0)]);
    let planes = Planes::default().with("rho_d", specimens::texture(|_, _| [0.0; 3]));
    let m = Material::new(steradian_brdf::parse(spec).unwrap()).with_textures(planes);
    let params = [("size", 32.0), ("exponents", 33.0)].into_iter().collect();
    let b = find("lafortune_env").unwrap().draft(&light, &m, None, &params, &Task::quiet()).unwrap();
    let black = "lafortune:cx=-1,cy=-1,cz=1,n=1,ks=0,kd=1";
    let white = shade(&*bake(&light, black, &[]));
    let Form::Lafortune(own) = steradian_brdf::parse(spec).unwrap().form() else { panic!("lobes") };
    let diffuse = |k: usize| std::array::from_fn(|c| white[k][c] * own.kd[c]);
    let got: Vec<[f64; 3]> = shade(&*b)
        .iter()
        .enumerate()
        .map(|(k, l)| {
            let d: [f64; 3] = diffuse(k);
            std::array::from_fn(|c| l[c] + d[c])
        })
        .collect();
    let error = difference(got, shade(&*plain));
    println!("skin by images: {error:.1e}");
    assert!(error < 2e-3, "{error}");
}

/// The numbers of the specimens' images at the texel of column `i` and row `j`, as a spec.
fn spec_at(planes: &Planes, i: usize, j: usize, lobe: usize) -> String {
    let uv = |k: usize| (k as f32 + 0.5) / specimens::SIDE as f32;
    let at = |name: &str| planes.get(name).expect("an image").sample(uv(i), uv(j), 0.0);
    let [[r, g, b], [dr, dg, db], [x, y, z], [n, ..]] =
        [at(&format!("rho_{lobe}")), at("rho_d"), at(&format!("c_{lobe}")), at(&format!("n_{lobe}"))];
    let kd = if lobe == 1 { [dr, dg, db] } else { [0.0; 3] };
    format!("lafortune:cx={x},cy={y},cz={z},n={n},ks={r}/{g}/{b},kd={}/{}/{}", kd[0], kd[1], kd[2])
}

/// Two lobes by texel against the integral with each texel's own parameters: the error is within what the
/// certificate states, which was measured at other texels.
#[test]
fn varying_lobes_err_by_what_is_stated() {
    let planes = specimens::planes(&PLANES);
    for (name, light, most) in
        [("smooth sky", lights::smooth(), 0.05), ("soft boxes", lights::studio(), 0.15)]
    {
        let b = varied(&light, planes.clone(), &[]);
        let many = varied(&light, planes.clone(), &[("exponents", 33.0)]);
        assert!(b.is_textured());
        let distant = DistantLight::bake("", &light, 63, &Task::quiet()).unwrap();
        let mut q = PointsBuf::default();
        let mut want = Vec::new();
        for k in 0..4 * POINTS {
            let (f, wo) = point(k % POINTS);
            q.push(f.n.as_vec3(), f.t.as_vec3(), f.to_world(wo).as_vec3(), Vec3::ZERO);
            let (i, j) = (7 * k % specimens::SIDE, 11 * k % specimens::SIDE);
            let uv = glam::Vec2::new(i as f32 + 0.5, j as f32 + 0.5) / specimens::SIDE as f32;
            q.locate(uv, [0; 3], [0.0; 2]);
            let lobes = [1, 2].map(|l| steradian_brdf::parse(&spec_at(&planes, i, j, l)).unwrap());
            want.push(distant.tree.integrate(
                |d, _| 0.1_f64.max(0.25 * d.angle_between(f.to_world(DVec3::new(-wo.x, -wo.y, wo.z)))),
                |d| {
                    let [a, b] = lobes.each_ref().map(|l| l.f_cos(f.to_local(d), wo));
                    std::array::from_fn(|c| a[c] + b[c])
                },
            ));
        }
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
        b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
        let got = (0..q.len()).map(|i| [0, 1, 2].map(|c| f64::from(rgb[c][i])));
        let error = steradian_prefilter::probe::relative_rms(got.zip(want));
        let stated = b.certified().error;
        let (maps, between) = (figure(&*b, "maps"), figure(&*b, "error between maps"));
        let alone = many.certified().error;
        println!(
            "{name}: {error:.4}, stated {stated:.4}, by 33 maps {alone:.4}; {maps} maps, {between:.4} between"
        );
        assert!((stated - alone).abs() < between, "{stated} {alone}");
        assert!(error < 1.3 * stated && stated < most, "{name}: {error} {stated}");
        assert!(maps >= 2.0 && between <= 0.01);
    }
}

/// The error of mixing the maps of two exponents is a quarter where they are half as far apart.
#[test]
fn maps_between_exponents_err_by_the_square_of_their_distance() {
    let light = lights::studio();
    let ramp = specimens::texture(|i, _| [4.0 * 64f64.powf(i as f64 / (specimens::SIDE - 1) as f64); 3]);
    let planes = Planes::default().with("rho_1", specimens::texture(|_, _| [0.5; 3])).with("n_1", ramp);
    let stated = |n: f64| {
        figure(&*varied(&light, planes.clone(), &[("exponents", n), ("size", 24.0)]), "error between maps")
    };
    let errors = [3.0, 5.0, 9.0].map(stated);
    println!("between 3, 5 and 9 maps: {errors:.4?}");
    assert!(errors[0] > 2.0 * errors[1] && errors[1] > 3.0 * errors[2], "{errors:?}");
    let auto = varied(&light, planes.clone(), &[("size", 24.0)]);
    assert!(figure(&*auto, "error between maps") <= 0.01);
    // The error measured at a texel between two maps is within what is stated of the mix.
    let at = |b: &dyn AnyBake, uv: [f32; 2]| {
        let mut q = PointsBuf::default();
        for k in 0..POINTS {
            let (f, wo) = point(k);
            q.push(f.n.as_vec3(), f.t.as_vec3(), f.to_world(wo).as_vec3(), Vec3::ZERO);
        }
        q.uv = uv.map(|x| vec![x; POINTS]);
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; POINTS]);
        b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
        (0..POINTS).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]].map(f64::from)).collect::<Vec<_>>()
    };
    let side = specimens::SIDE;
    let coarse = varied(&light, planes, &[("exponents", 3.0), ("size", 48.0)]);
    for i in [side / 4, 2 * side / 3] {
        let n = 4.0 * 64f64.powf(i as f64 / (side - 1) as f64);
        let own = bake(&light, &format!("lafortune:cx=-1,cy=-1,cz=1,n={n},ks=0.5"), &[("size", 48.0)]);
        let uv = [(i as f32 + 0.5) / side as f32, 0.5];
        let error = difference(at(&*coarse, uv), at(&*own, uv));
        assert!(error < 1.5 * errors[0], "{i}: {error} {errors:?}");
    }
}

/// A bake with its images loads to the same bits; damaged images, and ones that were not read, are refused.
#[test]
fn images_are_kept_in_the_bake() {
    let light = lights::smooth();
    let b = varied(&light, specimens::planes(&PLANES), &[("size", 16.0)]);
    let mut saved = b.save();
    let t = find("lafortune_env").unwrap();
    let again = t.load(&saved).unwrap();
    assert_eq!((shade(&*again), again.is_textured(), again.bytes()), (shade(&*b), true, b.bytes()));
    let name = "material.plane.n_1";
    let tensor = saved.tensors.get(name).expect("an image").clone();
    saved.tensors.insert("material.plane.n_3".into(), tensor);
    assert!(t.load(&saved).is_err());
    let mut values = ParamValues::default();
    values.0.insert("n_1".into(), steradian_base::Value::File("n.exr".into()));
    let m = Material::new(steradian_brdf::parse("lafortune:@skin").unwrap());
    let why = t.bake(&light, &m, None, &values, &Task::quiet()).err().unwrap().to_string();
    assert_eq!(why, "lafortune_env: the file of n_1 was not read");
}
