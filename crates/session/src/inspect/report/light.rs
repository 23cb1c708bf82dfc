//! Report of an environment, in words and as JSON.

use super::{Line, Report};
use crate::inspect::{EnvironmentFacts, LevelFacts, TextureFacts};
use glam::DVec3;
use serde_json::{Map, Value, json};
use steradian_light::DiskLight;
use steradian_light::load::Arrangement;

/// The report on an image or a sky.
pub fn report(facts: &EnvironmentFacts, name: &str) -> Report {
    Report { json: json(name, facts), lines: lines(name, facts) }
}

fn json(name: &str, f: &EnvironmentFacts) -> Value {
    let total: f64 = f.bands.iter().sum();
    let (brightest, luminance) = f.brightest;
    let mut json = json!({
        "kind": "environment",
        "name": name,
        "layout": Arrangement::of(f.layout).name(),
        "width": f.width,
        "height": f.height,
        "faces": f.layout.faces(),
        "min": f.min,
        "max": f.max,
        "mean": f.mean,
        "integral": f.integral,
        "irradiance_up": f.irradiance_up,
        "dynamic_range_stops": f.stops,
        "negative_samples": f.negative,
        "brightest": {"direction": brightest.to_array(), "luminance": luminance},
        "dominant_direction": f.dominant.map(|d| d.to_array()),
        "energy_in_brightest":
            {"0.01%": f.shares[0], "0.1%": f.shares[1], "1%": f.shares[2], "10%": f.shares[3]},
        "sh_energy": f.bands.iter().map(|b| if total > 0.0 { b / total } else { 0.0 }).collect::<Vec<_>>(),
        "disks": f.disks.iter().map(disk_json).collect::<Vec<_>>(),
        "suns_in_the_image": f.suns.iter().map(|(d, _)| disk_json(d)).collect::<Vec<_>>(),
        "advice": f.advice.iter().map(ToString::to_string).collect::<Vec<_>>(),
    });
    if let Some(r) = &f.file {
        json["file_width"] = json!(r.width);
        json["file_height"] = json!(r.height);
        json["file_layout"] = json!(r.file_layout.name());
        json["layout_stated"] = json!(r.layout_stated);
        json["profile"] = json!(r.profile);
        json["low_range"] = json!(r.low_range);
        json["warnings"] = json!(r.warnings);
    }
    if let Some(t) = &f.texture {
        json["texture"] = texture_json(t);
    }
    json
}

/// A texture: `mean` and `largest` of every level, and all that the file says of itself.
fn texture_json(t: &TextureFacts) -> Value {
    let level = |l: &LevelFacts| {
        json!({
            "width": l.width,
            "height": l.height,
            "perceptual_roughness": l.perceptual_roughness,
            "mean": l.mean,
            "largest": l.largest,
        })
    };
    json!({
        "container": t.container.name(),
        "format": t.texels.format,
        "compression": t.texels.compression,
        "faces": t.faces,
        "levels": t.levels.iter().map(level).collect::<Vec<_>>(),
        "profile": t.profile,
        "taken_for": t.taken_for,
        "kernel": t.kernel,
        "metadata": t.metadata.iter().map(|(k, v)| (k.clone(), json!(v))).collect::<Map<_, _>>(),
    })
}

fn texture_lines(t: &TextureFacts) -> Vec<Line> {
    let compression = t.texels.compression.map(|c| format!(", {c}")).unwrap_or_default();
    let shape = if t.faces == 6 { "cube" } else { "image" };
    let n = t.levels.len();
    let levels = if n == 1 { "1 level".into() } else { format!("{n} levels") };
    let profile = match (&t.profile, t.taken_for) {
        (Some(said), _) => said.clone(),
        (None, Some(given)) => format!("{given}, as it was given: the file does not say"),
        (None, None) => "not stated in the file; `profile` NAME reads it as an engine does".into(),
    };
    let kernel = match (&t.kernel, t.taken_for) {
        (Some(k), Some(given)) => format!("{k}, as {given} expects it"),
        (Some(k), None) => k.clone(),
        (None, _) => "not stated in the file".into(),
    };
    let mut out = vec![
        ("texture", format!("{}, {}{compression}, {shape}, {levels}", t.container.name(), t.texels.format)),
        ("profile", profile),
        ("kernel", kernel),
    ];
    for (m, l) in t.levels.iter().enumerate() {
        let r = l.perceptual_roughness.map(|r| format!(", perceptual roughness {r:.3}")).unwrap_or_default();
        let [mean, largest] =
            [l.mean, l.largest.map(f64::from)].map(|v| v.map(|x| format!("{x:.5}")).join(" "));
        let line = format!("{m}: {} x {}{r}, mean {mean}, largest {largest}", l.width, l.height);
        out.push(("level", line));
    }
    out
}

pub(super) fn place(d: DVec3) -> String {
    let (elevation, azimuth) = (d.y.clamp(-1.0, 1.0).asin().to_degrees(), d.z.atan2(d.x).to_degrees());
    format!(
        "({:.3}, {:.3}, {:.3}), elevation {elevation:.1}°, azimuth {azimuth:.1}° from +X to +Z",
        d.x, d.y, d.z
    )
}

fn lines(name: &str, f: &EnvironmentFacts) -> Vec<Line> {
    let total: f64 = f.bands.iter().sum();
    let mut seen = 0.0;
    let cumulative: Vec<String> = f
        .bands
        .iter()
        .take(8)
        .enumerate()
        .map(|(l, b)| {
            seen += b;
            format!("l≤{l} {:.1} %", 100.0 * seen / total.max(f64::MIN_POSITIVE))
        })
        .collect();
    let by_shape = f.file.as_ref().is_some_and(|r| !r.layout_stated);
    let stated = if by_shape { " (by its shape)" } else { "" };
    let size = match f.layout.faces() {
        1 => format!("{} x {}", f.width, f.height),
        n => format!("{n} faces of {} x {}", f.width, f.height),
    };
    let texture = f.texture.as_ref().map(texture_lines).unwrap_or_default();
    let range = |v: [f32; 3]| format!("{} {} {}", v[0], v[1], v[2]);
    let three = |v: [f64; 3]| format!("{:.5} {:.5} {:.5}", v[0], v[1], v[2]);
    let mut out: Vec<Line> = vec![
        ("name", name.into()),
        ("layout", format!("{}{stated}, {size}", Arrangement::of(f.layout).name())),
        ("smallest", range(f.min)),
        ("largest", range(f.max)),
        ("mean", format!("{} (radiance, W sr⁻¹ m⁻²)", three(f.mean))),
        ("irradiance up", format!("{} (on a floor, W m⁻²)", three(f.irradiance_up))),
        ("range", format!("{:.1} stops", f.stops)),
        ("negative", format!("{} samples", f.negative)),
        ("brightest", format!("{} at {}", f.brightest.1, place(f.brightest.0))),
    ];
    out.splice(1..1, texture);
    out.extend(f.dominant.map(|d| ("dominant", place(d))));
    let [a, b, c, d] = f.shares.map(|v| format!("{:.1} %", 100.0 * v));
    let energy = format!("brightest 0.01 % of the sphere holds {a}, 0.1 % {b}, 1 % {c}, 10 % {d}");
    out.push(("energy", energy));
    out.push(("SH energy", format!("{} (of {} bands)", cumulative.join(", "), f.bands.len())));
    out.extend(f.disks.iter().map(|d| ("disk", format!("{}, {}", elevation(d), disk_line(d)))));
    out.extend(f.advice.iter().map(|a| ("advice", a.to_string())));
    out.extend(f.suns.iter().map(|(d, share)| ("sun in the image", sun_line(d, *share))));
    out
}

fn elevation(d: &DiskLight) -> String {
    format!("elevation {:.1}°", d.direction.y.clamp(-1.0, 1.0).asin().to_degrees())
}

pub(super) fn disk_line(d: &DiskLight) -> String {
    let flux = d.radiance.map(|c| c * d.solid_angle());
    format!(
        "radius {:.3}°, irradiance across it {:.3} {:.3} {:.3} W m⁻²",
        d.angular_radius.to_degrees(),
        flux[0],
        flux[1],
        flux[2]
    )
}

fn sun_line(d: &DiskLight, share: f64) -> String {
    let [x, y, z] = d.direction.to_array();
    let radius = d.angular_radius.to_degrees();
    let percent = 100.0 * share;
    format!(
        "at ({x:.3}, {y:.3}, {z:.3}), radius {radius:.3}°, {percent:.1} % of the flux (convert with `extract-sun`)"
    )
}

pub(super) fn disk_json(d: &DiskLight) -> Value {
    json!({
        "direction": d.direction.to_array(),
        "angular_radius_degrees": d.angular_radius.to_degrees(),
        "radiance": d.radiance,
    })
}
