//! From the text to checked values.

use super::error::{SceneError, Source};
use super::schema::{
    BackgroundText, CameraText, LightText, MaterialText, MeshText, OutputText, ScaleText, SceneText,
};
use super::{At, MeshSource, SceneBackground, SceneFile, SceneLight, SceneMaterial, SceneMesh, SceneOutput};
use crate::{NormalFiltering, ToneMapper};
use glam::{DVec3, EulerRot, Mat4, Quat, Vec3};
use std::collections::BTreeMap;
use steradian_base::{Value, unknown};
use steradian_brdf::{Files, parse_noting};
use steradian_formats::stays_below;
use steradian_light::{DirectionalLight, DiskLight, PointLight};
use steradian_scene::Camera;
use toml::Spanned;

/// Largest picture side.
const MAX_SIDE: usize = 1 << 15;
/// Largest number of samples per pixel and axis.
const MAX_SAMPLES: usize = 32;
/// Default field of view of a camera, degrees.
const DEFAULT_FOV: f32 = 35.0;

pub fn check(source: Source<'_>, t: SceneText, files: Files<'_>) -> Result<SceneFile, SceneError> {
    if t.mesh.is_empty() {
        return Err(source.error(source.text.len(), "no [[mesh]]: a picture needs at least one"));
    }
    let names: Vec<&str> = t.material.keys().map(String::as_str).collect();
    let ground = t.ground.as_ref().map(|g| slot(&source, &g.material, &names)).transpose()?;
    let meshes = t.mesh.iter().map(|m| mesh(&source, m, &names)).collect::<Result<_, _>>()?;
    Ok(SceneFile {
        file: source.file.into(),
        text: source.text.into(),
        camera: t.camera.map(|c| camera(&source, &c)).transpose()?,
        meshes,
        ground,
        materials: materials(&source, &t.material, files)?,
        light: light(&source, t.light)?,
        output: output(&source, t.output)?,
    })
}

fn start<T>(s: &Spanned<T>) -> usize {
    s.span().start
}

fn at<T: Clone>(s: &Spanned<T>) -> At<T> {
    At { value: s.get_ref().clone(), at: start(s) }
}

fn finite(source: &Source<'_>, at: usize, key: &str, v: &[f32]) -> Result<(), SceneError> {
    let bad = v.iter().any(|x| !x.is_finite());
    if bad { Err(source.error(at, format!("key '{key}': must be finite"))) } else { Ok(()) }
}

fn camera(source: &Source<'_>, c: &Spanned<CameraText>) -> Result<Camera, SceneError> {
    let here = start(c);
    let c = c.get_ref();
    for (key, v) in [("from", &c.from), ("at", &c.at), ("up", &c.up)] {
        finite(source, here, key, v)?;
    }
    let (from, at, up) = (Vec3::from(c.from), Vec3::from(c.at), Vec3::from(c.up));
    if from == at {
        return Err(source.error(here, "camera: 'from' and 'at' are the same point"));
    }
    if (at - from).cross(up).length_squared() == 0.0 {
        return Err(source.error(here, "camera: 'up' is zero or along the view"));
    }
    match (&c.fov, &c.height) {
        (Some(_), Some(h)) => {
            Err(source.error(start(h), "key 'height': parallel rays have no 'fov'; give one of them"))
        }
        (None, Some(h)) if *h.get_ref() > 0.0 && h.get_ref().is_finite() => {
            Ok(Camera::Orthographic { from, at, up, height: *h.get_ref() })
        }
        (None, Some(h)) => Err(source.error(start(h), "key 'height': must be positive metres")),
        (fov, None) => {
            let degrees = fov.as_ref().map_or(DEFAULT_FOV, |f| *f.get_ref());
            if degrees > 0.0 && degrees < 180.0 {
                return Ok(Camera::Pinhole { from, at, up, fov_y: degrees.to_radians() });
            }
            let here = fov.as_ref().map_or(here, start);
            Err(source.error(here, format!("key 'fov': {degrees} is not between 0 and 180 degrees")))
        }
    }
}

fn mesh(source: &Source<'_>, m: &Spanned<MeshText>, names: &[&str]) -> Result<SceneMesh, SceneError> {
    let here = start(m);
    let m = m.get_ref();
    let from = match (&m.file, &m.shape) {
        (Some(f), None) => At { value: MeshSource::File(below(source, f, "file")?), at: start(f) },
        (None, Some(s)) => At { value: MeshSource::Shape(s.get_ref().clone()), at: start(s) },
        (Some(f), Some(_)) => {
            return Err(source.error(start(f), "[[mesh]]: give 'file' or 'shape', not both"));
        }
        (None, None) => return Err(source.error(here, "[[mesh]]: needs 'file' or 'shape'")),
    };
    let material = slot(source, &m.material, names)?;
    finite(source, here, "translate", &m.translate)?;
    finite(source, here, "rotate", &m.rotate)?;
    let scale = scale(source, m)?;
    let [x, y, z] = m.rotate.map(f32::to_radians);
    let turn = Quat::from_euler(EulerRot::ZYX, z, y, x);
    let transform = Mat4::from_scale_rotation_translation(scale, turn, Vec3::from(m.translate));
    Ok(SceneMesh { source: from, material, transform, brushing: m.brushing.map(Vec3::from) })
}

/// The index of a material.
fn slot(source: &Source<'_>, name: &Spanned<String>, names: &[&str]) -> Result<usize, SceneError> {
    // In order, as the map that they are the keys of.
    let found = names.binary_search(&name.get_ref().as_str());
    found.map_err(|_| source.error(start(name), unknown("material", name.get_ref(), names)))
}

fn scale(source: &Source<'_>, m: &MeshText) -> Result<Vec3, SceneError> {
    let Some(s) = &m.scale else { return Ok(Vec3::ONE) };
    let v = match *s.get_ref() {
        ScaleText::One(v) => Vec3::splat(v),
        ScaleText::Three(v) => Vec3::from(v),
    };
    if v.is_finite() && v.cmpne(Vec3::ZERO).all() {
        return Ok(v);
    }
    Err(source.error(start(s), "key 'scale': must be finite and not zero"))
}

/// A file name that stays below the scene file's folder.
fn below(source: &Source<'_>, name: &Spanned<String>, key: &str) -> Result<String, SceneError> {
    let text = name.get_ref();
    if stays_below(text) {
        return Ok(text.clone());
    }
    let why = format!("key '{key}': '{text}' must be a file below the scene file's own folder");
    Err(source.error(start(name), why))
}

fn materials(
    source: &Source<'_>,
    all: &BTreeMap<String, Spanned<MaterialText>>,
    files: Files<'_>,
) -> Result<Vec<SceneMaterial>, SceneError> {
    all.iter().map(|(name, m)| material(source, name, m.get_ref(), files)).collect()
}

fn material(
    source: &Source<'_>,
    name: &str,
    m: &MaterialText,
    files: Files<'_>,
) -> Result<SceneMaterial, SceneError> {
    let mut opened = Vec::new();
    let brdf = parse_noting(m.brdf.get_ref(), files, &mut opened)
        .map_err(|e| source.error(start(&m.brdf), format!("material '{name}', key 'brdf': {e}")))?;
    let image = |t: &Option<Spanned<String>>, key: &str| {
        t.as_ref().map(|t| Ok(At { value: below(source, t, key)?, at: start(t) })).transpose()
    };
    let base_colour = image(&m.base_color_texture, "base_color_texture")?;
    let normal_scale = m.normal_scale.as_ref().map_or(1.0, |s| *s.get_ref());
    if let Some(s) = &m.normal_scale {
        finite(source, start(s), "normal_scale", &[normal_scale])?;
    }
    let textures = m
        .textures
        .iter()
        .map(|(key, file)| {
            let value = below(source, file, &format!("textures.{key}"))?;
            Ok((key.clone(), At { value, at: start(file) }))
        })
        .collect::<Result<_, SceneError>>()?;
    Ok(SceneMaterial {
        name: name.into(),
        textures,
        brdf,
        opened,
        base_colour,
        normal: image(&m.normal_texture, "normal_texture")?,
        normal_scale,
        roughness: image(&m.roughness_texture, "roughness_texture")?,
        technique: m.technique.as_ref().map(at),
        local: m.local.as_ref().map(at),
        params: m.params.iter().map(|(name, value)| (name.clone(), Value::from(value))).collect(),
    })
}

fn unit(source: &Source<'_>, here: usize, v: [f64; 3]) -> Result<DVec3, SceneError> {
    DVec3::from(v)
        .try_normalize()
        .ok_or_else(|| source.error(here, "key 'direction': must be finite and not zero"))
}

/// A number, 0 where absent, that must be `good`.
fn number(
    source: &Source<'_>,
    v: &Option<Spanned<f64>>,
    key: &str,
    good: impl Fn(f64) -> bool,
    must: &str,
) -> Result<f64, SceneError> {
    match v {
        None => Ok(0.0),
        Some(v) if good(*v.get_ref()) => Ok(*v.get_ref()),
        Some(v) => Err(source.error(start(v), format!("key '{key}': must be {must}"))),
    }
}

fn power(source: &Source<'_>, here: usize, key: &str, v: [f64; 3]) -> Result<[f64; 3], SceneError> {
    if v.iter().all(|x| x.is_finite() && *x >= 0.0) {
        return Ok(v);
    }
    Err(source.error(here, format!("key '{key}': must be finite and not negative")))
}

fn light(source: &Source<'_>, l: LightText) -> Result<SceneLight, SceneError> {
    let file = |name: &Option<Spanned<String>>, key: &str| {
        let found = |s: &Spanned<String>| Ok(At { value: below(source, s, key)?, at: start(s) });
        name.as_ref().map(found).transpose()
    };
    let mut out = SceneLight {
        environment: l.environment.as_ref().map(at),
        sun_lights: file(&l.sun_lights, "sun_lights")?,
        probes: file(&l.probes, "probes")?,
        rotation: number(source, &l.rotation, "rotation", f64::is_finite, "finite degrees")?.to_radians(),
        exposure: number(source, &l.exposure, "exposure", |v| v.abs() <= 64.0, "-64 … 64")?,
        ..SceneLight::default()
    };
    for d in &l.disk {
        let (here, d) = (start(d), d.get_ref());
        if !(d.angular_radius > 0.0 && d.angular_radius <= 90.0) {
            return Err(source.error(here, "key 'angular_radius': must be above 0 and at most 90 degrees"));
        }
        let angular_radius = d.angular_radius.to_radians();
        let area = std::f64::consts::PI * angular_radius.sin().powi(2);
        let radiance = match (d.radiance, d.irradiance) {
            (Some(l), None) => l,
            (None, Some(e)) => e.map(|e| e / area),
            _ => return Err(source.error(here, "[[light.disk]]: give either 'radiance' or 'irradiance'")),
        };
        let direction = unit(source, here, d.direction)?;
        out.disks.push(DiskLight {
            direction,
            angular_radius,
            radiance: power(source, here, "radiance", radiance)?,
        });
    }
    for d in &l.directional {
        let direction = unit(source, start(d), d.get_ref().direction)?;
        let irradiance = power(source, start(d), "irradiance", d.get_ref().irradiance)?;
        out.directionals.push(DirectionalLight { direction, irradiance });
    }
    for p in &l.point {
        finite(source, start(p), "position", &p.get_ref().position)?;
        let lit = p.get_ref().intensity.iter().all(|v| v.is_finite() && *v >= 0.0);
        if !lit {
            return Err(source.error(start(p), "key 'intensity': must be finite and not negative"));
        }
        let position = Vec3::from(p.get_ref().position);
        out.points.push(PointLight { position, intensity: p.get_ref().intensity });
    }
    let nothing = out.environment.is_none()
        && out.sun_lights.is_none()
        && out.probes.is_none()
        && out.disks.is_empty()
        && out.directionals.is_empty()
        && out.points.is_empty();
    if nothing {
        let why =
            "[light]: no light; write environment = \"sky:elevation=35\", or a disk, directional or point";
        return Err(source.error(source.text.len(), why));
    }
    Ok(out)
}

fn within(
    source: &Source<'_>,
    v: &Option<Spanned<usize>>,
    key: &str,
    max: usize,
    default: usize,
) -> Result<usize, SceneError> {
    match v {
        None => Ok(default),
        Some(v) if (1..=max).contains(v.get_ref()) => Ok(*v.get_ref()),
        Some(v) => Err(source.error(start(v), format!("key '{key}': must be 1 … {max}"))),
    }
}

fn output(source: &Source<'_>, o: OutputText) -> Result<SceneOutput, SceneError> {
    let tone_mapper = match &o.tone_mapper {
        None => ToneMapper::default(),
        Some(name) => ToneMapper::from_name(name.get_ref()).ok_or_else(|| {
            let known = ToneMapper::ALL.map(ToneMapper::name);
            source.error(start(name), unknown("tone_mapper", name.get_ref(), &known))
        })?,
    };
    let normal_filtering = match &o.normal_filtering {
        None => NormalFiltering::default(),
        Some(name) => NormalFiltering::from_name(name.get_ref()).ok_or_else(|| {
            let known = NormalFiltering::ALL.map(|a| a.0);
            source.error(start(name), unknown("normal_filtering", name.get_ref(), &known))
        })?,
    };
    let blur = number(source, &o.blur, "blur", |v| (0.0..=90.0).contains(&v), "0 … 90 degrees")?.to_radians();
    let background = match &o.background {
        None => SceneBackground::Environment(blur),
        Some(b) => match b.get_ref() {
            BackgroundText::Colour(c) => SceneBackground::Colour(*c),
            BackgroundText::Word(w) if w == "environment" => SceneBackground::Environment(blur),
            BackgroundText::Word(w) if w == "none" => SceneBackground::Colour([0.0; 3]),
            BackgroundText::Word(w) => {
                return Err(source.error(start(b), unknown("background", w, &["environment", "none"])));
            }
        },
    };
    Ok(SceneOutput {
        width: within(source, &o.width, "width", MAX_SIDE, 512)?,
        height: within(source, &o.height, "height", MAX_SIDE, 512)?,
        exposure: o.exposure,
        tone_mapper,
        technique: o.technique.as_ref().map(at),
        local: o.local.as_ref().map(at),
        normal_filtering,
        background,
        samples: within(source, &o.samples, "samples", MAX_SAMPLES, 4)?,
    })
}
