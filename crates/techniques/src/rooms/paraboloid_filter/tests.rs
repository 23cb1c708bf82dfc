use super::bake::map_errors;
use super::*;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;
use steradian_light::{DirectionalLight, Environment, Lights};
use steradian_prefilter::methods::{Footprint, Paraboloids, paraboloids};
use steradian_prefilter::{EdgeCube, Power};
use steradian_sphere::{Layout, SphereImage};

fn distant(lights: &Lights) -> DistantLight {
    DistantLight::bake("test", lights, 0, &Task::quiet()).unwrap()
}

fn maps(light: &DistantLight, n: f64, footprint: &Footprint) -> Paraboloids {
    let lookup = |size: usize| -> steradian_prefilter::methods::Lookup {
        match &light.source().base {
            Some(base) => {
                let cube = EdgeCube::from_image(base, size);
                Box::new(move |d: DVec3| cube.sample(d.as_vec3().to_array())[..3].try_into().unwrap())
            }
            None => Box::new(|_| [0.0; 3]),
        }
    };
    paraboloids(&lookup, &light.source().small_lights, &Power { n }, footprint, &Task::quiet()).unwrap().0
}

fn blended(radii: usize) -> Footprint {
    Footprint { radii, farthest: FRAC_PI_2, ..Footprint::default() }
}

/// Light with detail of one size everywhere.
fn spots() -> Lights {
    let d = |k| steradian_prefilter::probe::direction(k, 60);
    let image = SphereImage::from_fn(Layout::LatLong, 256, 128, |w| {
        [(0..60).map(|k| (60.0 * (w.dot(d(k)) - 1.0)).exp()).sum::<f64>() as f32; 3]
    });
    Environment { image }.into()
}

#[test]
fn constant_light_stays_constant() {
    for n in [1.0, 30.0, 500.0] {
        let made = maps(&distant(&lights::furnace()), n, &blended(2));
        let exact = 2.0 * std::f64::consts::PI / (n + 1.0);
        for k in 0..200 {
            let got = made.bilinear(steradian_prefilter::probe::direction(k, 200))[1];
            assert!((got / exact - 1.0).abs() < 1e-5, "{n}: {got} {exact}");
        }
    }
}

/// The delta light's image is the lobe: half its peak at the lobe's own angle, in the middle of a map,
/// halfway and on its rim, along the map's radius and across; nothing beyond the kernel's reach.
#[test]
fn a_point_of_light_shows_the_footprint() {
    let n = 200.0;
    let half = 0.5_f64.powf(1.0 / n).acos();
    for (direction, within) in
        [(DVec3::Z, 0.02), (DVec3::new(0.5, 0.2, 0.7), 0.08), (DVec3::new(0.6, 0.8, 0.0), 0.05)]
    {
        let direction = direction.normalize();
        let light = DirectionalLight { direction, irradiance: [1.0; 3] };
        let made = maps(&distant(&Lights { directionals: vec![light], ..Lights::default() }), n, &blended(2));
        let peak = made.bilinear(direction)[0];
        assert!((peak - 1.0).abs() < 0.12, "{direction}: {peak}");
        for axis in [direction.cross(DVec3::Z).try_normalize().unwrap_or(DVec3::X), DVec3::Y] {
            let side = axis - direction * axis.dot(direction);
            let at = |a: f64| made.bilinear(direction * a.cos() + side.normalize() * a.sin())[0];
            assert!((at(half) / peak - 0.5).abs() < within, "{direction} {axis}: {}", at(half) / peak);
            // R_L drawn in the middle reaches twice the kernel's angle.
            assert!(at(0.55) == 0.0, "{direction}: {}", at(0.55));
        }
    }
}

/// STAR04 7.4.2: blending two radii is exact in the middle and on the rim, and worst between.
#[test]
fn the_error_is_small_and_peaks_at_mid_radius() {
    let light = distant(&spots());
    let run = |n: f64, f: Footprint| map_errors(&light, &Power { n }, &maps(&light, n, &f));
    let (all, [middle, between, rim]) = run(400.0, blended(2));
    assert!(all < 0.02 && between > middle && between > rim, "{all}: {middle} {between} {rim}");
    // More radii take that away.
    let (more, _) = run(400.0, blended(6));
    assert!(more < 0.7 * all, "{more} {all}");
}

/// A light's flux does not depend on where it stands between texels.
#[test]
fn small_lights_keep_their_flux() {
    let mut sums = Vec::new();
    for k in 0..8 {
        let direction =
            (DVec3::new(0.3, -0.2, 0.9) + DVec3::new(0.011, 0.007, 0.0) * f64::from(k)).normalize();
        let light = DirectionalLight { direction, irradiance: [1.0; 3] };
        let made =
            maps(&distant(&Lights { directionals: vec![light], ..Lights::default() }), 300.0, &blended(2));
        let sum: f64 =
            (0..20_000).map(|k| made.bilinear(steradian_prefilter::probe::direction(k, 20_000))[0]).sum();
        sums.push(sum);
    }
    let mean = sums.iter().sum::<f64>() / 8.0;
    assert!(sums.iter().all(|s| (s / mean - 1.0).abs() < 0.02), "{sums:?}");
    let exact = 2.0 * std::f64::consts::PI / 301.0 * 20_000.0 / (4.0 * std::f64::consts::PI);
    assert!((mean / exact - 1.0).abs() < 0.03, "{mean} {exact}");
}

/// Stored maps of other sizes hold the same function.
#[test]
fn the_map_may_be_stored_larger() {
    let light = distant(&lights::smooth());
    let own = maps(&light, 20.0, &blended(2));
    for size in [16, 40, 200] {
        let other = maps(&light, 20.0, &Footprint { size, ..blended(2) });
        assert!(other.side() >= size && other.extent() > 1.0);
        for k in 0..300 {
            let d = steradian_prefilter::probe::direction(k, 300);
            let (a, b) = (own.bilinear(d), other.bilinear(d));
            assert!((a[0] - b[0]).abs() < 0.03 * a[0], "{size} {d}: {a:?} {b:?}");
        }
    }
}
