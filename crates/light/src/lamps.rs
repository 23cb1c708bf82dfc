//! Lights that are not images, one by one: by a spec, or in a file.

use crate::{DirectionalLight, DiskLight, LightError, Lights, PointLight};
use glam::{DMat3, DVec3, Vec3};
use serde_json::Value as Json;
use std::path::Path;
use steradian_base::{ParamError, ParamInfo, ParamValues, Value, split_spec, unknown};
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

    /// A distant light turned by `rotation` and scaled by `gain`; a point light has a position in the scene
    /// and stays as it is.
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

/// Range of a parameter that has no upper bound.
const POSITIVE: [f64; 2] = [0.0, f64::INFINITY];
const DIRECTION: ParamInfo = ParamInfo::vector("direction", "to the light, any length");
const ANGULAR_RADIUS: ParamInfo =
    ParamInfo::angle("angular-radius", [1e-9, 90.0], 0.0, "from the middle to the rim").required();
const IRRADIANCE: ParamInfo =
    ParamInfo::rgb("irradiance", POSITIVE, 0.0, "on a surface that faces the light").unit("W m⁻²").required();
const RADIANCE: ParamInfo =
    ParamInfo::rgb("radiance", POSITIVE, 0.0, "of a disk, in place of its irradiance").optional();
const POSITION: ParamInfo = ParamInfo::vector("position", "of the point").unit("metres");
const INTENSITY: ParamInfo =
    ParamInfo::rgb("intensity", POSITIVE, 0.0, "of the point").unit("W sr⁻¹").required();

/// The kinds of lights that are not images, each with its parameters.
pub const LAMPS: [(&str, &[ParamInfo]); 3] = [
    ("disk", &[DIRECTION, ANGULAR_RADIUS, IRRADIANCE, RADIANCE]),
    ("directional", &[DIRECTION, IRRADIANCE]),
    ("point", &[POSITION, INTENSITY]),
];

/// The parameters of a kind of light.
fn parameters(kind: &str) -> Result<&'static [ParamInfo], String> {
    let found = LAMPS.iter().find(|(name, _)| *name == kind);
    found.map(|(_, infos)| *infos).ok_or_else(|| unknown("light", kind, &LAMPS.map(|(name, _)| name)))
}

fn direction(v: &ParamValues) -> Result<DVec3, String> {
    let d = DVec3::from(of(v.triple(&DIRECTION))?);
    d.try_normalize().ok_or_else(|| "'direction' must not be zero".into())
}

fn of<T>(value: Result<T, ParamError>) -> Result<T, String> {
    value.map_err(|e| e.to_string())
}

fn disk(v: &ParamValues) -> Result<DiskLight, String> {
    let angular_radius = of(v.number(&ANGULAR_RADIUS))?.to_radians();
    let area = std::f64::consts::PI * angular_radius.sin().powi(2);
    let radiance = if v.has(&RADIANCE) && !v.has(&IRRADIANCE) {
        of(v.triple(&RADIANCE))?
    } else {
        of(v.triple(&IRRADIANCE))?.map(|e| e / area)
    };
    Ok(DiskLight { direction: direction(v)?, angular_radius, radiance })
}

/// The light of a kind that has these values.
fn lamp(kind: &str, v: &ParamValues) -> Result<Lamp, String> {
    let lamp = match kind {
        "disk" => Lamp::Disk(disk(v)?),
        "directional" => Lamp::Directional(DirectionalLight {
            direction: direction(v)?,
            irradiance: of(v.triple(&IRRADIANCE))?,
        }),
        _ => Lamp::Point(PointLight {
            position: Vec3::from(of(v.triple(&POSITION))?.map(|v| v as f32)),
            intensity: of(v.triple(&INTENSITY))?.map(|v| v as f32),
        }),
    };
    // What is divided by a small disk, or becomes a smaller float, may have left the range.
    if lamp.is_finite() { Ok(lamp) } else { Err("its values are too large".into()) }
}

/// The light of a spec.
fn spec(text: &str) -> Result<Lamp, String> {
    let (kind, body) = split_spec(text);
    let values = parameters(kind).and_then(|infos| of(ParamValues::parse(body, infos)));
    values.and_then(|v| lamp(kind, &v)).map_err(|why| format!("'{text}': {why}"))
}

/// What an entry of a file says of the parameters of its kind of light.
fn entry(entry: &serde_json::Map<String, Json>, infos: &[ParamInfo]) -> ParamValues {
    let text = |v: &Json| match v {
        Json::Array(all) => all.iter().map(Json::to_string).collect::<Vec<_>>().join("/"),
        one => one.to_string(),
    };
    let one = |i: &ParamInfo| {
        let name = if i.name == ANGULAR_RADIUS.name { "angular_radius_degrees" } else { i.name };
        Some((i.name, Value::Word(text(entry.get(name)?))))
    };
    infos.iter().filter_map(one).collect()
}

/// The lights of a file's text.
pub(crate) fn lamps(text: &str) -> Result<Vec<Lamp>, String> {
    let document: Json = serde_json::from_str(text).map_err(|e| format!("not JSON: {e}"))?;
    let all = document.get("lights").and_then(Json::as_array);
    let all = all.ok_or("has no list 'lights'; `extract-sun` writes such files")?;
    let one = |(i, v): (usize, &Json)| {
        let entry = v.as_object().ok_or_else(|| format!("lights[{i}] is not an object"))?;
        let kind = entry.get("kind").and_then(Json::as_str).unwrap_or("disk");
        let made = parameters(kind).and_then(|infos| lamp(kind, &self::entry(entry, infos)));
        made.map_err(|why| format!("lights[{i}]: {why}"))
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
            ("point:position=1/1/1", "needs 'intensity='"),
            ("point:position=1/1,intensity=1", "position = '1/1' is not three numbers"),
            ("point:place=1/1/1", "no parameter 'place'"),
            ("directional:direction=0/0/0,irradiance=1", "must not be zero"),
            ("directional:direction=0/1/0,irradiance=-1", "is not a finite number of at least 0"),
            ("disk:direction=0/1/0,irradiance=1", "needs 'angular-radius='"),
            ("disk:direction=0/1/0,angular-radius=95,irradiance=1", "… 90"),
            ("disk:direction=0/1/0,angular-radius=5", "needs 'irradiance='"),
            ("disk:direction", "is not key=value"),
            ("directional:direction=a/b/c,irradiance=1", "is not three numbers"),
            ("directional:direction=0/1/0,direction=1/0/0,irradiance=1", "'direction' is given twice"),
            ("disk:direction=0/1/0,angular-radius=5,angular_radius=6,irradiance=1", "given twice"),
        ] {
            let e = spec(bad).unwrap_err();
            assert!(e.contains(why), "{bad}: {e}");
        }
    }
}
