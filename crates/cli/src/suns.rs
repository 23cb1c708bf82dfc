//! Lights beside an environment: suns taken out of it, files of them, and lights by a spec.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::Adjust;
use clap::{Args, ValueEnum};
use glam::{DVec3, Vec3};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use steradian_formats::read_text;
use steradian_light::suns::{SunOptions, extract};
use steradian_light::{DirectionalLight, DiskLight, Environment, Lights, PointLight};
use steradian_techniques::direct::Suns;

/// Lights beside the environment, and how they are shaded.
#[derive(Debug, Clone, Args)]
pub struct Beside {
    /// Disk, directional and point lights beside the environment, as --extract-sun writes them; the first two turn and
    /// scale with it
    #[arg(long, value_name = "FILE.json")]
    sun_lights: Option<PathBuf>,
    /// A light beside the environment: disk:direction=X/Y/Z,angular-radius=DEGREES,irradiance=R/G/B,
    /// directional:direction=X/Y/Z,irradiance=R/G/B or point:position=X/Y/Z,intensity=R/G/B; as it stands, whatever
    /// --rotate and --light-exposure do to the environment
    #[arg(long, value_name = "SPEC", value_parser = spec)]
    light: Vec<Lamp>,
    /// Disks and directional lights by the exact reflectance, or folded into the technique's data; the reference
    /// integrates them always
    #[arg(long, value_enum, default_value_t = Way::Exact)]
    suns: Way,
}

/// How disks and directional lights are shaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Way {
    /// By the exact reflectance
    Exact,
    /// As part of the technique's data
    Fold,
}

/// One light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lamp {
    Disk(DiskLight),
    Directional(DirectionalLight),
    Point(PointLight),
}

impl Lamp {
    fn join(self, lights: &mut Lights) {
        match self {
            Self::Disk(d) => lights.disks.push(d),
            Self::Directional(d) => lights.directionals.push(d),
            Self::Point(p) => lights.points.push(p),
        }
    }
}

impl Beside {
    /// Adds the lights.
    pub fn join(&self, lights: &mut Lights, adjust: &Adjust, context: &mut Context) -> Outcome {
        if let Some(path) = &self.sun_lights {
            join_file(path, lights, adjust, context)?;
        }
        self.light.iter().for_each(|l| l.join(lights));
        Ok(())
    }

    /// Is there any?
    pub fn is_some(&self) -> bool {
        self.sun_lights.is_some() || !self.light.is_empty()
    }

    /// What becomes of disks and directional lights.
    pub fn suns(&self) -> Suns {
        match self.suns {
            Way::Exact => Suns::Exact,
            Way::Fold => Suns::Fold,
        }
    }
}

/// Adds the lights of a file, distant ones turned and scaled as the environment is.
pub fn join_file(path: &Path, lights: &mut Lights, adjust: &Adjust, context: &mut Context) -> Outcome {
    let (turn, gain) = (adjust.rotation(), adjust.gain());
    for lamp in read(path, context)? {
        match lamp {
            Lamp::Disk(d) => Lamp::Disk(DiskLight {
                direction: (turn * d.direction).normalize(),
                radiance: d.radiance.map(|v| v * gain),
                ..d
            }),
            Lamp::Directional(d) => Lamp::Directional(DirectionalLight {
                direction: (turn * d.direction).normalize(),
                irradiance: d.irradiance.map(|v| v * gain),
            }),
            // A point has a place in the scene, which stands still.
            point => point,
        }
        .join(lights);
    }
    Ok(())
}

/// Numbers under a key of a light.
trait Fields {
    fn numbers(&self, key: &str) -> Result<Option<Vec<f64>>, String>;

    fn three(&self, key: &str) -> Result<[f64; 3], String> {
        let v = self.numbers(key)?.ok_or_else(|| format!("needs '{key}'"))?;
        <[f64; 3]>::try_from(v).map_err(|_| format!("'{key}' must be three numbers"))
    }

    fn direction(&self) -> Result<DVec3, String> {
        let d = DVec3::from(self.three("direction")?);
        d.try_normalize().ok_or_else(|| "'direction' must not be zero".into())
    }

    fn rgb(&self, key: &str) -> Result<[f64; 3], String> {
        let v = self.numbers(key)?.ok_or_else(|| format!("needs '{key}'"))?;
        let v = match v[..] {
            [x] => [x; 3],
            [r, g, b] => [r, g, b],
            _ => return Err(format!("'{key}' must be one number or three")),
        };
        if v.iter().all(|x| *x >= 0.0) { Ok(v) } else { Err(format!("'{key}' must not be negative")) }
    }

    fn disk(&self) -> Result<Lamp, String> {
        let key = "angular-radius";
        let degrees = match self.numbers(key)?.as_deref() {
            Some(&[d]) if d > 0.0 && d <= 90.0 => d,
            Some(_) => return Err(format!("'{key}' must be above 0 and at most 90 degrees")),
            None => return Err(format!("needs '{key}' in degrees")),
        };
        let angular_radius = degrees.to_radians();
        let area = std::f64::consts::PI * angular_radius.sin().powi(2);
        let radiance = match self.numbers("irradiance")? {
            Some(_) => self.rgb("irradiance")?.map(|e| e / area),
            None => self.rgb("radiance").map_err(|e| e.replace("needs 'radiance'", "needs 'irradiance'"))?,
        };
        Ok(Lamp::Disk(DiskLight { direction: self.direction()?, angular_radius, radiance }))
    }

    fn lamp(&self, kind: &str) -> Result<Lamp, String> {
        match kind {
            "disk" => self.disk(),
            "directional" => Ok(Lamp::Directional(DirectionalLight {
                direction: self.direction()?,
                irradiance: self.rgb("irradiance")?,
            })),
            "point" => Ok(Lamp::Point(PointLight {
                position: Vec3::from(self.three("position")?.map(|v| v as f32)),
                intensity: self.rgb("intensity")?.map(|v| v as f32),
            })),
            other => Err(steradian_render::scenefile::unknown("light", other, &KINDS)),
        }
    }
}

const KINDS: [&str; 3] = ["disk", "directional", "point"];
const KEYS: [&str; 6] = ["direction", "angular-radius", "irradiance", "radiance", "position", "intensity"];

/// `key=value,…` of a spec.
struct Pairs<'a>(Vec<(&'a str, &'a str)>);

impl Fields for Pairs<'_> {
    fn numbers(&self, key: &str) -> Result<Option<Vec<f64>>, String> {
        let Some((_, text)) = self.0.iter().find(|(k, _)| *k == key) else { return Ok(None) };
        let number = |t: &str| t.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        let all: Option<Vec<f64>> = text.split('/').map(number).collect();
        all.map(Some).ok_or_else(|| format!("'{key}={text}' is not a number or X/Y/Z"))
    }
}

/// The light of a spec.
fn spec(text: &str) -> Result<Lamp, String> {
    let (kind, body) = text.split_once(':').unwrap_or((text, ""));
    let pair = |p: &'_ str| -> Result<(String, String), String> {
        let (k, v) = p.split_once('=').ok_or_else(|| format!("'{p}' is not KEY=VALUE"))?;
        let k = k.trim().replace('_', "-");
        if !KEYS.contains(&k.as_str()) {
            return Err(steradian_render::scenefile::unknown("key", &k, &KEYS));
        }
        Ok((k, v.to_string()))
    };
    let pairs = body.split(',').filter(|p| !p.is_empty()).map(pair).collect::<Result<Vec<_>, _>>()?;
    let repeated = (1..pairs.len()).find(|&i| pairs[..i].iter().any(|p| p.0 == pairs[i].0));
    if let Some(i) = repeated {
        return Err(format!("'{text}': key '{}' is given twice; give it once", pairs[i].0));
    }
    let pairs = Pairs(pairs.iter().map(|(k, v)| (k.as_str(), v.as_str())).collect());
    pairs.lamp(kind.trim()).map_err(|why| format!("'{text}': {why}"))
}

/// An entry of a file.
struct Entry<'a>(&'a serde_json::Map<String, Value>);

impl Fields for Entry<'_> {
    fn numbers(&self, key: &str) -> Result<Option<Vec<f64>>, String> {
        let name = if key == "angular-radius" { "angular_radius_degrees" } else { key };
        let bad = || format!("'{name}' is not a number or a list of numbers");
        let number = |v: &Value| v.as_f64().filter(|x| x.is_finite()).ok_or_else(bad);
        match self.0.get(name) {
            None => Ok(None),
            Some(Value::Array(all)) => all.iter().map(number).collect::<Result<_, _>>().map(Some),
            Some(one) => Ok(Some(vec![number(one)?])),
        }
    }
}

/// Ten thousand lights take less.
const MOST_BYTES: u64 = 4 << 20;

/// The lights of a file.
fn read(path: &Path, context: &mut Context) -> Result<Vec<Lamp>, Failure> {
    let fault = |why: String| Failure::input(format!("{}: {why}", path.display()));
    let text = read_text(path, MOST_BYTES, "a file of lights")?;
    context.note_input(path);
    let document: Value = serde_json::from_str(&text).map_err(|e| fault(format!("not JSON: {e}")))?;
    let Some(all) = document.get("lights").and_then(Value::as_array) else {
        return Err(fault("has no list 'lights'; --extract-sun writes such files".into()));
    };
    let one = |(i, v): (usize, &Value)| {
        let entry = v.as_object().ok_or_else(|| fault(format!("lights[{i}] is not an object")))?;
        let kind = entry.get("kind").and_then(Value::as_str).unwrap_or("disk");
        Entry(entry).lamp(kind).map_err(|why| fault(format!("lights[{i}]: {why}")))
    };
    all.iter().enumerate().map(one).collect()
}

/// Suns that were taken out of a light.
pub struct Taken {
    pub suns: Vec<DiskLight>,
    shares: Vec<f64>,
    change: f64,
    deviation: f64,
}

/// Takes the suns out of `lights`: those beside the image (a sky's), and those in it.
pub fn take(lights: &mut Lights) -> Taken {
    let known = std::mem::take(&mut lights.disks);
    let mut out = Taken { suns: known, shares: Vec::new(), change: 0.0, deviation: 0.0 };
    let image = lights.environment.as_ref().map(|e| e.image.clone());
    let flux = |d: &DiskLight| luminance(d.radiance) * d.solid_angle();
    let inside = image.as_ref().map_or(0.0, |i| luminance(i.integral()));
    let whole = inside + out.suns.iter().map(flux).sum::<f64>();
    if let Some(image) = image {
        let e = extract(&image, &SunOptions::default());
        lights.environment = Some(Arc::new(Environment { image: e.sunless }));
        out.suns.extend(e.suns);
        (out.change, out.deviation) = (e.change, e.deviation);
    }
    out.shares = out.suns.iter().map(|d| if whole > 0.0 { flux(d) / whole } else { 0.0 }).collect();
    out
}

fn luminance(v: [f64; 3]) -> f64 {
    0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2]
}

impl Taken {
    /// The document of a file that [`join_file`] reads.
    pub fn json(&self) -> Value {
        let light = |(d, share): (&DiskLight, &f64)| {
            let area = std::f64::consts::PI * d.angular_radius.sin().powi(2);
            json!({
                "kind": "disk",
                "direction": d.direction.to_array(),
                "angular_radius_degrees": d.angular_radius.to_degrees(),
                "solid_angle": d.solid_angle(),
                "irradiance": d.radiance.map(|l| l * area),
                "radiance": d.radiance,
                "share_of_flux": share,
            })
        };
        json!({
            "lights": self.suns.iter().zip(&self.shares).map(light).collect::<Vec<_>>(),
            "largest_change_elsewhere": self.change,
            "moment_deviation": self.deviation,
        })
    }

    /// For files: the lights in one line.
    pub fn metadata(&self) -> (String, String) {
        let lights = self.json().get("lights").map(Value::to_string).unwrap_or_default();
        ("steradian.suns".into(), lights)
    }

    /// Writes the file of lights, and says what was found.
    pub fn write(&self, path: &Path, context: &Context) -> Outcome {
        context.write_text(Some(path), &context.json_text(self.json()))?;
        if self.suns.is_empty() {
            context.say("no sun found: nothing in the light is small, round and bright enough");
        }
        for (d, share) in self.suns.iter().zip(&self.shares) {
            let [x, y, z] = d.direction.to_array();
            context.say(format_args!(
                "sun at ({x:.4}, {y:.4}, {z:.4}), angular radius {:.3} degrees, {:.1} % of the flux",
                d.angular_radius.to_degrees(),
                100.0 * share
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn specs_say_what_they_are() {
        let Ok(Lamp::Point(p)) = spec("point:position=1/2/-3,intensity=5") else { panic!("a point") };
        assert_eq!((p.position, p.intensity), (Vec3::new(1.0, 2.0, -3.0), [5.0; 3]));
        let Ok(Lamp::Disk(d)) = spec("disk:direction=0/2/0,angular_radius=0.5,irradiance=1/2/3") else {
            panic!("a disk")
        };
        let e = d.radiance[2] * std::f64::consts::PI * d.angular_radius.sin().powi(2);
        assert!((e - 3.0).abs() < 1e-12 && d.direction == DVec3::Y);
        for (bad, why) in [
            ("lamp:position=1/1/1", "unknown light 'lamp'"),
            ("point:position=1/1/1", "needs 'intensity'"),
            ("point:position=1/1,intensity=1", "'position' must be three numbers"),
            ("point:place=1/1/1", "unknown key 'place'"),
            ("directional:direction=0/0/0,irradiance=1", "must not be zero"),
            ("directional:direction=0/1/0,irradiance=-1", "must not be negative"),
            ("disk:direction=0/1/0,irradiance=1", "needs 'angular-radius'"),
            ("disk:direction=0/1/0,angular-radius=95,irradiance=1", "at most 90"),
            ("disk:direction=0/1/0,angular-radius=5", "needs 'irradiance'"),
            ("disk:direction", "is not KEY=VALUE"),
            ("directional:direction=a/b/c,irradiance=1", "is not a number"),
            ("directional:direction=0/1/0,direction=1/0/0,irradiance=1", "'direction' is given twice"),
            ("disk:direction=0/1/0,angular-radius=5,angular_radius=6,irradiance=1", "given twice"),
        ] {
            let e = spec(bad).unwrap_err();
            assert!(e.contains(why), "{bad}: {e}");
        }
    }

    #[test]
    fn what_is_written_is_what_is_read() {
        let d = DiskLight {
            direction: DVec3::new(0.6, 0.64, 0.48),
            angular_radius: 0.0061,
            radiance: [3e4, 2e4, 1.7e4],
        };
        let taken = Taken { suns: vec![d], shares: vec![0.5], change: 0.0, deviation: 0.0 };
        let json = taken.json();
        let entry = json["lights"][0].as_object().expect("an object");
        let Ok(Lamp::Disk(back)) = Entry(entry).lamp("disk") else { panic!("a disk") };
        assert!((back.angular_radius / d.angular_radius - 1.0).abs() < 1e-14);
        (0..3).for_each(|c| assert!((back.radiance[c] / d.radiance[c] - 1.0).abs() < 1e-13));
    }
}
