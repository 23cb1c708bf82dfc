use super::*;
use crate::shared::trials::lights;
use crate::{PointsBuf, find};
use glam::{DVec3, Vec3};
use steradian_base::ParamValues;
use steradian_light::{DirectionalLight, DiskLight};

fn mirror(f0: &str) -> Material {
    Material::new(steradian_brdf::parse(&format!("ggx:alpha=0.001,f0={f0}")).unwrap())
}

fn bake(lights: &Lights, f0: &str, size: f64) -> Result<Box<dyn crate::AnyBake>, BakeError> {
    let values = ParamValues::from_iter([("size", size)]);
    find("mirror-map").unwrap().draft(lights, &mirror(f0), None, &values, &Task::quiet())
}

fn radiance(b: &dyn crate::AnyBake, n: DVec3, wo: DVec3) -> [f32; 3] {
    let mut q = PointsBuf::default();
    q.push(n.as_vec3(), Vec3::X, wo.as_vec3(), Vec3::ZERO);
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    rgb.map(|p| p[0])
}

/// STAR04 eq. 17 with k_s = F(n·wo): at the normal f0 L(n), at grazing L(r).
#[test]
fn it_shows_what_lies_along_the_mirror_direction() {
    let b = bake(&lights::smooth(), "0.5", 0.0).unwrap();
    let sky = lights::smooth().environment.unwrap();
    let n = DVec3::new(0.3, 0.9, 0.1).normalize();
    for cosine in [1.0, 0.6, 0.05] {
        let side = n.any_orthonormal_vector() * (1.0f64 - cosine * cosine).sqrt();
        let got = radiance(&*b, n, n * cosine + side);
        let l = sky.image.bilinear(n * cosine - side);
        let f = 0.5 + 0.5 * (1.0 - cosine).powi(5);
        for c in 0..3 {
            let expected = f * f64::from(l[c]);
            assert!((f64::from(got[c]) - expected).abs() < 4e-3 * expected, "{cosine}: {got:?} {l:?}");
        }
    }
}

/// A sun larger than a texel shows with its own radiance; outside it there is none.
#[test]
fn a_sun_is_seen_with_its_radiance() {
    let disk = DiskLight { direction: DVec3::Z, angular_radius: 0.2, radiance: [7.0; 3] };
    let lights = Lights { disks: vec![disk], ..Lights::default() };
    let b = bake(&lights, "1", 128.0).unwrap();
    assert!((radiance(&*b, DVec3::Z, DVec3::Z)[0] - 7.0).abs() < 0.05);
    assert_eq!(radiance(&*b, DVec3::X, DVec3::X), [0.0; 3]);
}

#[test]
fn directional_lights_are_refused() {
    let light = DirectionalLight { direction: DVec3::Y, irradiance: [1.0; 3] };
    let lights = Lights { directionals: vec![light], ..Lights::default() };
    assert!(bake(&lights, "1", 0.0).err().unwrap().to_string().contains("use a disk light"));
}
