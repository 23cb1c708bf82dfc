//! Lights that are not images, one by one: by a spec, or in a file.

use crate::{DirectionalLight, DiskLight, LightError, Lights, PointLight};
use glam::{DMat3, DVec3, Vec3};
use serde_json::Value;
use std::path::Path;
use steradian_base::unknown;
use steradian_formats::read_text;

/// One light that is not an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lamp {
    /// A sun.
    Disk(DiskLight),
    /// Light from one direction.
    Directional(DirectionalLight),
    /// A point.
    Point(PointLight),
}

impl Lamp {
    fn is_finite(&self) -> bool {
        match self {
            Self::Disk(d) => d.radiance.iter().all(|v| v.is_finite()) && d.direction.is_finite(),
            Self::Directional(d) => d.irradiance.iter().all(|v| v.is_finite()) && d.direction.is_finite(),
            Self::Point(p) => p.intensity.iter().all(|v| v.is_finite()) && p.position.is_finite(),
        }
    }

    /// The light of a spec: `disk:direction=X/Y/Z,angular-radius=DEGREES,irradiance=R/G/B`,
    /// `directional:direction=X/Y/Z,irradiance=R/G/B` or `point:position=X/Y/Z,intensity=R/G/B`.
    pub fn parse(text: &str) -> Result<Self, String> {
        spec(text)
    }

    /// The lights of a file as [`crate::suns::Taken::json`] writes it.
    pub fn read(path: &Path) -> Result<Vec<Self>, LightError> {
        let text = read_text(path, MAX_BYTES, "a file of lights")?;
        lamps(&text).map_err(|why| LightError::invalid(path.display().to_string(), why))
    }

    /// A distant light turned by `rotation` and scaled by `gain`; a point has a place in the scene, which stands still.
    pub fn adjusted(self, rotation: DMat3, gain: f64) -> Self {
        match self {
            Self::Disk(d) => Self::Disk(DiskLight {
                direction: (rotation * d.direction).normalize(),
                radiance: d.radiance.map(|v| v * gain),
                ..d
            }),
            Self::Directional(d) => Self::Directional(DirectionalLight {
                direction: (rotation * d.direction).normalize(),
                irradiance: d.irradiance.map(|v| v * gain),
            }),
            point => point,
        }
    }

    /// Adds the light to `lights`.
    pub fn join(self, lights: &mut Lights) {
        match self {
            Self::Disk(d) => lights.disks.push(d),
            Self::Directional(d) => lights.directionals.push(d),
            Self::Point(p) => lights.points.push(p),
        }
    }
}

/// Bytes of a file of lights: ten thousand lights take less.
const MAX_BYTES: u64 = 4 << 20;

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
        let lamp = match kind {
            "disk" => self.disk()?,
            "directional" => Lamp::Directional(DirectionalLight {
                direction: self.direction()?,
                irradiance: self.rgb("irradiance")?,
            }),
            "point" => Lamp::Point(PointLight {
                position: Vec3::from(self.three("position")?.map(|v| v as f32)),
                intensity: self.rgb("intensity")?.map(|v| v as f32),
            }),
            other => return Err(unknown("light", other, &KINDS)),
        };
        // What is divided by a small disk, or becomes a smaller float, may have left the range.
        if lamp.is_finite() { Ok(lamp) } else { Err("its values are too large".into()) }
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
            return Err(unknown("key", &k, &KEYS));
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

/// The lights of a file's text.
pub(crate) fn lamps(text: &str) -> Result<Vec<Lamp>, String> {
    let document: Value = serde_json::from_str(text).map_err(|e| format!("not JSON: {e}"))?;
    let all = document.get("lights").and_then(Value::as_array);
    let all = all.ok_or("has no list 'lights'; --extract-sun writes such files")?;
    let one = |(i, v): (usize, &Value)| {
        let entry = v.as_object().ok_or_else(|| format!("lights[{i}] is not an object"))?;
        let kind = entry.get("kind").and_then(Value::as_str).unwrap_or("disk");
        Entry(entry).lamp(kind).map_err(|why| format!("lights[{i}]: {why}"))
    };
    all.iter().enumerate().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever is written, it is lights of finite numbers or an error of one line.
    #[test]
    fn damaged_files_end_well() {
        let good = r#"{"lights":[{"kind":"disk","direction":[0,1,0],"angular_radius_degrees":0.27,
            "irradiance":[1,2,3]},{"kind":"point","position":[1,2,3],"intensity":5}]}"#;
        let other = br#"{"kind":"directional","direction":[0,0,0],"irradiance":1e308}"#;
        let mut damage = steradian_testkit::Mutator::new(1);
        for _ in 0..if steradian_testkit::full() { 2_000_000 } else { 20_000 } {
            let text = String::from_utf8_lossy(&damage.damage(good.as_bytes(), other)).into_owned();
            match lamps(&text) {
                Ok(all) => assert!(all.iter().all(Lamp::is_finite), "{text}"),
                Err(e) => assert_eq!(e.lines().count(), 1, "{e}"),
            }
        }
    }

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
}
