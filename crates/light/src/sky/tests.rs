//! Published orders of magnitude of the clear sky, closed forms of the others, and specs.

use super::*;
use glam::DVec3;
use std::f64::consts::PI;
use steradian_sphere::{Layout, layout::Position};

/// Horizontal irradiance of the upper half, per channel, summed texel by texel.
fn horizontal(image: &SphereImage) -> [f64; 3] {
    let mut e = [0.0; 3];
    for j in 0..image.height / 2 {
        let at = Position { face: 0, x: 0.5, y: j as f64 + 0.5 };
        let y = Layout::LatLong.direction(image.width, image.height, at).map_or(0.0, |d| d.y);
        let w = y * Layout::LatLong.solid_angle(image.width, image.height, 0, 0, j);
        for i in 0..image.width {
            e.iter_mut().zip(image.texel(0, i, j)).for_each(|(e, v)| *e += w * f64::from(v));
        }
    }
    e
}

fn texel(g: &Generated, d: DVec3) -> [f64; 3] {
    let p = Layout::LatLong.position(g.image.width, g.image.height, d);
    let (i, j) = ((p.x as usize).min(g.image.width - 1), (p.y as usize).min(g.image.height - 1));
    g.image.texel(0, i, j).map(f64::from)
}

fn sun_illuminance(g: &Generated) -> f64 {
    g.sun.map_or(0.0, |s| luminance(s.radiance) * s.solid_angle() * EFFICACY)
}

#[test]
fn the_clear_sky_has_daylights_magnitudes() {
    let sky = by_name("sky:elevation=60,azimuth=0,turbidity=2.5", 128, 64).unwrap();
    let diffuse = luminance(horizontal(&sky.image)) * EFFICACY;
    let direct = sun_illuminance(&sky);
    // IES clear-sky daylight at 60°: about 95 klx normal to the sun, 12–18 klx of sky.
    assert!((80e3..115e3).contains(&direct), "direct {direct}");
    assert!((8e3..22e3).contains(&diffuse), "diffuse {diffuse}");
    let zenith = texel(&sky, DVec3::Y);
    assert!(zenith[2] > 1.5 * zenith[0], "blue zenith {zenith:?}");
    let away = texel(&sky, DVec3::new(-1.0, 1.0, 0.0).normalize());
    assert!(away[2] > 2.2 * away[0] && away[1] > away[0], "bluer away from the sun {away:?}");
    let horizon = texel(&sky, DVec3::new(-1.0, 0.03, 0.3).normalize());
    assert!(luminance(horizon) > 1.8 * luminance(away), "{horizon:?} {away:?}");
    let sun = sky.sun.unwrap();
    assert!((sun.direction.y - 60f64.to_radians().sin()).abs() < 1e-12 && sun.direction.x > 0.0);
}

#[test]
fn the_sky_darkens_and_the_sun_reddens_as_it_sets() {
    let mut before = f64::INFINITY;
    for elevation in [70, 40, 20, 10, 5, 2, 0, -2, -5] {
        let sky = by_name(&format!("sky:elevation={elevation}"), 64, 32).unwrap();
        let total = luminance(horizontal(&sky.image)) * EFFICACY
            + sun_illuminance(&sky) * f64::from(elevation).to_radians().sin().max(0.0);
        assert!(total < before && total > 0.0, "{elevation}: {total} after {before}");
        assert!(sky.image.planes.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
        before = total;
        assert_eq!(sky.sun.is_some(), elevation >= 0);
        if let (Some(sun), true) = (sky.sun, elevation < 10) {
            assert!(sun.radiance[0] > 2.0 * sun.radiance[2], "{elevation}: {:?}", sun.radiance);
        }
    }
    // Civil twilight at −5° is of the order of 10 lx to 100 lx.
    assert!((2.0..300.0).contains(&before), "{before}");
}

#[test]
fn haze_brightens_the_sky_and_dims_the_sun() {
    let of = |t: f64| {
        let g = by_name(&format!("sky:elevation=45,turbidity={t}"), 64, 32).unwrap();
        (luminance(horizontal(&g.image)), sun_illuminance(&g))
    };
    let (clean, hazy) = (of(1.5), of(8.0));
    assert!(hazy.0 > 1.3 * clean.0 && hazy.1 < 0.7 * clean.1, "{clean:?} {hazy:?}");
}

#[test]
fn the_ground_is_lit_by_sky_and_sun_and_turning_the_sun_turns_the_sky() {
    let g = by_name("sky:elevation=30,azimuth=0,ground=0.5/0.4/0.3", 64, 32).unwrap();
    let sun = g.sun.unwrap();
    let e = horizontal(&g.image);
    let below = texel(&g, -DVec3::Y);
    for (k, albedo) in [0.5, 0.4, 0.3].into_iter().enumerate() {
        let expected = albedo / PI * (e[k] + sun.radiance[k] * sun.solid_angle() * 0.5);
        assert!((below[k] / expected - 1.0).abs() < 1e-5);
    }
    let turned = by_name("sky:elevation=30,azimuth=90,ground=0.5/0.4/0.3", 64, 32).unwrap();
    for i in 0..64 {
        let (a, b) = (g.image.texel(0, i, 9), turned.image.texel(0, (i + 16) % 64, 9));
        assert!((a[1] / b[1] - 1.0).abs() < 1e-5);
    }
}

#[test]
fn overcast_and_furnace_are_their_closed_forms() {
    let g = by_name("overcast:zenith=9,ground=0.5", 256, 128).unwrap();
    for e in horizontal(&g.image) {
        assert!((e / (7.0 * PI) - 1.0).abs() < 1e-3, "{e}");
    }
    assert!((texel(&g, DVec3::Y)[0] - 9.0).abs() < 1e-2);
    assert!((texel(&g, DVec3::new(1.0, 0.01, 0.0).normalize())[1] - 3.0).abs() < 0.2);
    assert!((texel(&g, -DVec3::Y)[2] - 3.5).abs() < 1e-6);
    let g = by_name("furnace:radiance=0.5/1/2", 8, 4).unwrap();
    assert!(g.image.planes.iter().zip([0.5, 1.0, 2.0]).all(|(p, v)| p.iter().all(|x| *x == v)));
    let g = by_name("studio", 64, 32).unwrap();
    let peak = g.image.planes[1].iter().copied().fold(0.0, f32::max);
    assert!(peak > 8.0 && g.image.planes.iter().flatten().all(|v| *v > 0.0));
}

#[test]
fn bad_specs_say_what_to_do() {
    let message = |s: &str| by_name(s, 8, 4).unwrap_err().to_string();
    assert!(message("moon").contains("there are: sky, studio, overcast, furnace"));
    assert_eq!(
        message("sky:height=3"),
        "sky: no parameter 'height'; there are: elevation, azimuth, turbidity, ground"
    );
    assert_eq!(message("sky:elevation=99"), "sky: elevation = '99' is not a number in -5 … 90");
    assert_eq!(
        message("furnace:radiance=1/2"),
        "furnace: radiance = '1/2' is not a number in 0 … 1000000000, or three of them as r/g/b"
    );
    for bad in ["sky:elevation=NaN", "sky:elevation", "sky:turbidity=1/2/3", "overcast:zenith=inf"] {
        assert!(matches!(by_name(bad, 8, 4), Err(SkyError::Param { .. })), "{bad}");
    }
    assert!(matches!(by_name("sky", 0, 4), Err(SkyError::Size(0, 4))));
    assert!(is_name("sky:elevation=3") && is_name("studio") && !is_name("sky.hdr") && !is_name("a/sky"));
}
