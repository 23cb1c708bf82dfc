//! Suns as handles that the mouse moves, and the time of day.

use super::{App, degrees};
use eframe::egui::{Color32, Painter, Pos2, Rect, Stroke, Vec2};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use std::time::Instant;
use steradian_base::{ParamInfo, ParamValues, Value, split_spec};
use steradian_light::Lights;
use steradian_light::adjust::about_y;
use steradian_light::sky;

/// Radius of the map of the upper hemisphere, points.
const RADIUS: f32 = 46.0;
/// How near to a handle the mouse has to be, points.
const NEAR: f32 = 14.0;
/// Latitude of the days, degrees north.
const LATITUDE: f64 = 35.0;
/// Luminance of a texel, relative to the mean, above which an image is said to have a sun.
const BRIGHT: f64 = 100.0;

/// What the sun of the sky does at `hours` of solar time on the day of equal length, at 35° north: elevation
/// and azimuth in degrees, where north is −Z and east +X.
pub(super) fn at_hour(hours: f64) -> [f64; 2] {
    let angle = (hours - 12.0) * PI / 12.0;
    let up = LATITUDE.to_radians().cos() * angle.cos();
    let (south, east) = (LATITUDE.to_radians().sin() * angle.cos(), -angle.sin());
    [up.asin().to_degrees(), south.atan2(east).to_degrees()]
}

/// The hour at which the sun stands over a point of the horizon, 0 to 24.
pub(super) fn hour_of(azimuth: f64) -> f64 {
    let (south, east) = azimuth.to_radians().sin_cos();
    let angle = (-east).atan2(south / LATITUDE.to_radians().sin());
    12.0 + angle * 12.0 / PI
}

/// Hours between which the sun is in the sky that a formula knows.
pub(super) const DAY: std::ops::RangeInclusive<f64> = 5.7..=18.3;

/// The parameters of the sun in the spec of a sky: elevation, azimuth.
fn parameters(spec: &str) -> Option<(usize, [&'static ParamInfo; 2])> {
    let k = sky::NAMES.iter().position(|n| *n == split_spec(spec).0)?;
    let find = |name: &str| sky::PARAMETERS[k].iter().find(|p| p.name == name);
    Some((k, [find("elevation")?, find("azimuth")?]))
}

/// Elevation and azimuth of a sky's sun, degrees; `None` where the light is no sky with a sun.
pub(super) fn of_spec(spec: &str) -> Option<[f64; 2]> {
    let (k, infos) = parameters(spec)?;
    let values = ParamValues::parse(split_spec(spec).1, sky::PARAMETERS[k]).ok()?;
    let [elevation, azimuth] = infos.map(|i| values.number(i).ok());
    Some([elevation?, azimuth?])
}

/// Unit direction to a sky's sun.
pub(super) fn direction_of(spec: &str) -> Option<Vec3> {
    let [elevation, azimuth] = of_spec(spec)?.map(f64::to_radians);
    let flat = elevation.cos();
    Some(DVec3::new(flat * azimuth.cos(), elevation.sin(), flat * azimuth.sin()).as_vec3())
}

/// The sky with its sun elsewhere.
pub(super) fn with_sun(spec: &str, [elevation, azimuth]: [f64; 2]) -> Option<String> {
    let (k, infos) = parameters(spec)?;
    let (name, body) = split_spec(spec);
    let mut values = ParamValues::parse(body, sky::PARAMETERS[k]).ok()?;
    let round = |x: f64| (10.0 * x).round() / 10.0;
    for (info, x) in infos.into_iter().zip([elevation.clamp(infos[0].min, infos[0].max), azimuth]) {
        values.0.insert(info.name.into(), Value::Number(round(x)));
    }
    Some(format!("{name}:{}", values.body(sky::PARAMETERS[k])))
}

/// Unit directions to the suns of lights: disks, directional lights, and the brightest texel of an image
/// where it is far brighter than the mean.
pub(super) fn suns(lights: &Lights) -> Vec<Vec3> {
    let mut out: Vec<Vec3> = lights.disks.iter().map(|d| d.direction.as_vec3()).collect();
    out.extend(lights.directionals.iter().map(|d| d.direction.as_vec3()));
    if let (Some(e), true) = (&lights.environment, out.is_empty()) {
        let image = &e.image;
        let y = |k: usize| image.planes[0][k] + image.planes[1][k] + image.planes[2][k];
        let n = image.planes[0].len();
        let mean = (0..n).map(|k| f64::from(y(k))).sum::<f64>() / n as f64;
        let brightest = (0..n).max_by(|&a, &b| y(a).total_cmp(&y(b)));
        if let Some(k) = brightest.filter(|&k| f64::from(y(k)) > BRIGHT * mean) {
            let (i, j, face) =
                (k % image.width, k / image.width % image.height, k / (image.width * image.height));
            let d = image.layout.texel_direction(image.width, image.height, face, i, j);
            out.extend(d.map(|d| d.as_vec3()));
        }
    }
    out
}

/// Where the map of the upper hemisphere shows a direction: the zenith at its centre, the horizon on its rim,
/// and above the centre what lies beyond the object as the camera at `azimuth` (radians) sees it.
fn place(d: DVec3, azimuth: f64) -> Vec2 {
    let radius = (2.0 / PI * d.y.clamp(-1.0, 1.0).acos()).min(1.08) as f32 * RADIUS;
    let angle = d.z.atan2(d.x) - azimuth;
    // Straight ahead is −1 in y; to the right of the camera is +1 in x.
    Vec2::new(-angle.sin() as f32, angle.cos() as f32) * radius
}

/// The direction at a place of the map, not below the horizon.
fn direction(at: Vec2, azimuth: f64) -> DVec3 {
    let theta = f64::from((at.length() / RADIUS).min(1.0)) * 0.5 * PI;
    let angle = f64::from(-at.x).atan2(f64::from(at.y)) + azimuth;
    DVec3::new(theta.sin() * angle.cos(), theta.cos(), theta.sin() * angle.sin())
}

impl App {
    /// Where the map of suns is drawn; `None` where there is none to show.
    fn sun_map(&self, rect: Rect) -> Option<(Pos2, f64)> {
        let orbit = self.kept.wish.orbit?;
        if self.suns.is_empty() || rect.width() < 6.0 * RADIUS || rect.height() < 5.0 * RADIUS {
            return None;
        }
        let from = Vec3::from(orbit.from()) - Vec3::from(orbit.at);
        let centre = Pos2::new(rect.right() - RADIUS - 18.0, rect.top() + RADIUS + 18.0);
        Some((centre, f64::from(from.z).atan2(f64::from(from.x))))
    }

    /// The suns as the light is turned.
    fn turned_suns(&self) -> Vec<DVec3> {
        let turn = about_y(self.kept.wish.turn);
        self.suns.iter().map(|d| turn * d.as_dvec3()).collect()
    }

    /// The handle under the mouse.
    pub(super) fn sun_at(&self, rect: Rect, at: Option<Pos2>) -> Option<usize> {
        let ((centre, azimuth), at) = (self.sun_map(rect)?, at?);
        let far = |d: &DVec3| (centre + place(*d, azimuth) - at).length();
        let all = self.turned_suns();
        (0..all.len()).filter(|&k| far(&all[k]) < NEAR).min_by(|&a, &b| far(&all[a]).total_cmp(&far(&all[b])))
    }

    /// Moves sun `k` to where the mouse is: the sun of a sky itself, any other light turns with it.
    pub(super) fn drag_sun(&mut self, k: usize, rect: Rect, at: Pos2) {
        let (Some((centre, azimuth)), Some(old)) = (self.sun_map(rect), self.turned_suns().get(k).copied())
        else {
            return;
        };
        let new = direction(at - centre, azimuth);
        let flat = |d: DVec3| d.z.atan2(d.x).to_degrees();
        let wish = &mut self.kept.wish;
        let spec = wish.light.clone().unwrap_or_default();
        // A turn by +ψ about +Y takes +Z towards +X: the azimuth from +X towards +Z falls.
        let moved = with_sun(&spec, [new.y.asin().to_degrees(), degrees(flat(new) + wish.turn)]);
        match moved {
            Some(spec) => {
                // Until the bake is there, the handle goes ahead of the picture.
                self.suns = vec![(about_y(-wish.turn) * new).as_vec3()];
                wish.light = Some(spec);
            }
            None => wish.turn = degrees(wish.turn - (flat(new) - flat(old))),
        }
        self.moved = Instant::now();
    }

    /// Moves the sun of a sky by so many hours.
    pub(super) fn later(&mut self, hours: f64) {
        let spec = self.kept.wish.light.clone().unwrap_or_default();
        if let Some([_, azimuth]) = of_spec(&spec) {
            let hour = (hour_of(azimuth) + hours).clamp(*DAY.start(), *DAY.end());
            self.kept.wish.light = with_sun(&spec, at_hour(hour));
            self.moved = Instant::now();
        }
    }

    /// The map with its handles.
    pub(super) fn draw_suns(&self, painter: &Painter, rect: Rect, under: Option<usize>) {
        let Some((centre, azimuth)) = self.sun_map(rect) else { return };
        painter.circle_filled(centre, RADIUS, Color32::from_black_alpha(110));
        let line = Color32::from_white_alpha(70);
        painter.circle_stroke(centre, RADIUS, Stroke::new(1.0, Color32::from_white_alpha(150)));
        for part in [1.0 / 3.0, 2.0 / 3.0] {
            painter.circle_stroke(centre, part * RADIUS, Stroke::new(0.5, line));
        }
        painter.circle_filled(centre, 1.5, Color32::from_white_alpha(150));
        for (k, d) in self.turned_suns().into_iter().enumerate() {
            let at = centre + place(d, azimuth);
            let held = under == Some(k) || self.holding == Some(k);
            let colour =
                if d.y < 0.0 { Color32::from_rgb(150, 120, 80) } else { Color32::from_rgb(255, 200, 90) };
            painter.circle_filled(at, if held { 8.0 } else { 6.0 }, colour);
            painter.circle_stroke(
                at,
                if held { 8.0 } else { 6.0 },
                Stroke::new(1.0, Color32::from_black_alpha(160)),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_rises_in_the_east_and_is_highest_in_the_south_at_noon() {
        let [low, east] = at_hour(6.0);
        assert!(low.abs() < 1e-9 && east.abs() < 1e-9);
        let [high, south] = at_hour(12.0);
        assert!((high - 55.0).abs() < 1e-9 && (south - 90.0).abs() < 1e-9);
        for hour in [6.5, 9.0, 12.0, 15.25, 18.0] {
            assert!((hour_of(at_hour(hour)[1]) - hour).abs() < 1e-9, "{hour}");
        }
        let range = |h: f64| (-5.0..=90.0).contains(&at_hour(h)[0]);
        assert!(range(*DAY.start()) && range(*DAY.end()));
    }

    #[test]
    fn the_map_shows_directions_where_the_camera_sees_them() {
        // A camera at +Z looks along −Z: what is there lies above the centre, +X to the right of it.
        let azimuth = 0.5 * PI;
        let far = place(DVec3::NEG_Z, azimuth);
        assert!(far.x.abs() < 1e-4 && (far.y + RADIUS).abs() < 1e-4, "{far:?}");
        let right = place(DVec3::X, azimuth);
        assert!((right.x - RADIUS).abs() < 1e-4 && right.y.abs() < 1e-4, "{right:?}");
        for d in [DVec3::new(0.3, 0.8, -0.2), DVec3::new(-0.6, 0.2, 0.5)] {
            let d = d.normalize();
            assert!((direction(place(d, 0.7), 0.7) - d).length() < 1e-6);
        }
    }

    #[test]
    fn a_sky_takes_its_sun_along_and_other_lights_have_none_to_move() {
        let moved = with_sun("sky:turbidity=4", [20.0, 45.04]).expect("a sky");
        assert_eq!(of_spec(&moved), Some([20.0, 45.0]));
        assert!(moved.contains("turbidity=4"), "{moved}");
        assert_eq!((with_sun("studio", [1.0, 1.0]), of_spec("beach.hdr")), (None, None));
        let generated = sky::by_name(&moved, 64, 32).expect("a sky");
        let sun = generated.sun.expect("a sun").direction;
        let azimuth = sun.z.atan2(sun.x).to_degrees();
        assert!((azimuth - 45.0).abs() < 1e-6 && (sun.y.asin().to_degrees() - 20.0).abs() < 1e-6);
    }
}
