use super::*;
use crate::{AnyBake, PointsBuf, find};
use glam::{DVec3, Vec3};
use steradian_base::ParamValues;
use steradian_brdf::{Files, parse_with};
use steradian_light::DirectionalLight;
use steradian_sphere::Frame;

fn bake_in(slug: &str, lights: &Lights, spec: &str, params: &[(&str, f64)]) -> Box<dyn AnyBake> {
    let values: ParamValues = params.iter().copied().collect();
    let material = Material::new(parse_with(spec, Files::Any).unwrap());
    find(slug).unwrap().bake(lights, &material, None, &values, &Task::quiet()).unwrap()
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
    // Without tangents the stated ones are taken: the same here.
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

/// A ladder of exponents serves what lies between its maps.
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
    assert_eq!(other.certificate().known, steradian_base::Evidence::Measured);
}

#[test]
fn what_it_refuses_says_why() {
    let t = find("lafortune_env").unwrap();
    let refused = |spec: &str| (t.card().materials)(&*steradian_brdf::parse(spec).unwrap()).unwrap_err();
    assert!(refused("ggx:alpha=0.2").contains("use lobe_maps"));
    assert!(refused("ward:ax=0.1,ay=0.3").contains("use reference"));
}
