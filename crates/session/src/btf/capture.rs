//! Surfaces photographed by the path tracer.

use crate::destinations::light_mark;
use crate::inputs::{all_finite, names_a_file};
use crate::{Destinations, Error, PolynomialKind, Session};
use glam::{DVec2, DVec3, Vec2};
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::time::Instant;
use steradian_base::unknown;
use steradian_brdf::SharedBrdf;
use steradian_formats::{
    BtfList, BtfPicture, ExrSamples, LightPosition, Raster, WriteOptions, WriteReport, read_image, read_text,
    write_atomic, write_btf, write_image, write_lp,
};
use steradian_parallel::prelude::*;
use steradian_reference::path::{Patch, PathOptions, PathScene, Photographs, photograph};
use steradian_relight::btf::{Btf, spread};
use steradian_relight::height::{HeightField, Pattern};
use steradian_scene::surface::Texture;
use steradian_scene::{Bvh, Mesh};

/// Formats of pictures.
pub const FORMATS: [&str; 2] = ["exr", "png"];
/// Views or lights at most.
pub const MOST_DIRECTIONS: usize = 4096;
/// The file that says what a folder of pictures is, and how far it is done.
pub(super) const RECORD: &str = "capture.json";
/// Its largest size.
pub(super) const RECORD_BYTES: u64 = 64 << 20;
/// Lights that polynomials need.
const POLYNOMIAL: usize = 6;

/// Heights of a surface.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A formula, and texels a side at which it is evaluated.
    Pattern(Pattern, usize),
    /// Heights of an image: its alpha, else its luminance.
    File(PathBuf),
}

/// A surface that is photographed, and how.
#[derive(Clone)]
pub struct Surface {
    /// Heights of the surface, which repeat: 0 to 1.
    pub shape: Shape,
    /// Height of 1 over the width of the surface.
    pub relief: f64,
    /// Its reflectance.
    pub brdf: SharedBrdf,
    /// An image that multiplies it.
    pub base_colour: Option<PathBuf>,
    /// Views: 81 are those of the Bonn measurements ([`spread`]).
    pub views: usize,
    /// Lights.
    pub lights: usize,
    /// Reflections of a path at most; 1 is direct light.
    pub bounces: u32,
    /// Paths of a texel: one looks at its middle.
    pub samples: u32,
    /// Seed of the random numbers.
    pub seed: u64,
    /// One of [`FORMATS`].
    pub format: &'static str,
}

/// Facts of a capture.
#[derive(Debug, Clone, PartialEq)]
pub struct Captured {
    /// Texels a row and rows.
    pub size: (usize, usize),
    /// Views.
    pub views: usize,
    /// Views that were there already.
    pub kept: usize,
    /// Lights.
    pub lights: usize,
    /// Mean variance of the numbers, white being 1.
    pub variance: f64,
    /// Did the view along the normal become a list of lights and a polynomial texture map too?
    pub polynomials: bool,
    /// Seconds that it took.
    pub seconds: f64,
}

/// A surface made ready.
struct Stage {
    field: HeightField,
    mesh: Mesh,
    bvh: Bvh,
    tint: Option<Texture>,
    views: Vec<DVec3>,
    lights: Vec<DVec3>,
}

/// The triangles of a height field: its texels are the vertices, x to the right, y up.
fn mesh(field: &HeightField) -> Mesh {
    let (w, h) = (field.width(), field.height());
    let mut mesh = Mesh::default();
    for j in 0..=h {
        for i in 0..=w {
            let z = field.at(i as i64, j as i64);
            mesh.positions.push(DVec2::new(i as f64, -(j as f64)).as_vec2().extend(z));
            mesh.normals.push(field.normal(i % w, j % h));
            mesh.tangents.push(glam::Vec4::new(1.0, 0.0, 0.0, 1.0));
            mesh.uvs.push(Vec2::new((i as f32 + 0.5) / w as f32, (j as f32 + 0.5) / h as f32));
        }
    }
    for k in 0..w * h {
        let (i, j) = (k % w, k / w);
        let [a, b, c, d] =
            [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)].map(|(i, j)| (j * (w + 1) + i) as u32);
        mesh.triangles.extend([[a, c, d], [a, d, b]]);
    }
    mesh
}

/// Angle from the normal and azimuth, degrees, without the rounding of their sines.
pub(super) fn angles(d: DVec3) -> [f64; 2] {
    let round = |x: f64| (x * 1e9).round() / 1e9;
    let (across, phi) = (d.truncate().length(), d.y.atan2(d.x).to_degrees());
    let phi = if across < 1e-12 { 0.0 } else { round(phi.rem_euclid(360.0)) };
    [round(across.atan2(d.z).to_degrees()), if phi >= 360.0 { 0.0 } else { phi }]
}

impl Surface {
    /// Refuses settings that cannot be photographed.
    fn check(&self) -> Result<(), Error> {
        for (what, n) in [("views", self.views), ("lights", self.lights)] {
            if !(1..=MOST_DIRECTIONS).contains(&n) {
                return Err(Error::usage(format!("--{what} {n}: give 1 to {MOST_DIRECTIONS}")));
            }
        }
        if !(self.relief.is_finite() && (0.0..=10.0).contains(&self.relief)) {
            return Err(Error::usage(format!("`relief` {}: give 0 to 10", self.relief)));
        }
        if self.bounces == 0 || self.samples == 0 {
            return Err(Error::usage("`bounces` and `samples` are 1 at least"));
        }
        if self.bounces > 1 && self.samples < 2 {
            return Err(Error::usage("reflections are random: `bounces` above 1 needs `samples` 2 or more"));
        }
        Ok(())
    }

    fn options(&self) -> PathOptions {
        PathOptions { bounces: self.bounces, samples: self.samples, seed: self.seed }
    }
}

impl Stage {
    /// The pictures of a view; white is 1.
    fn photograph(&self, s: &Surface, view: usize, session: &Session) -> Result<Photographs, Error> {
        let (w, h) = (self.field.width(), self.field.height());
        let heights = self.field.heights();
        let plane = heights.iter().map(|z| f64::from(*z)).sum::<f64>() / heights.len() as f64;
        let look = |p: &steradian_scene::Surface| {
            let white = [1.0; 3];
            self.tint.as_ref().map_or(white, |t| t.sample(p.uv.x, p.uv.y, 0.0).map(f64::from))
        };
        let patch = Patch {
            mesh: &self.mesh,
            bvh: &self.bvh,
            period: DVec2::new(w as f64, h as f64),
            corner: DVec2::new(-0.5, 0.5 - h as f64),
            plane,
            brdf: &*s.brdf,
            tint: Some(&look),
            offset: 10.0 * PathScene::OFFSET,
        };
        let seen = (self.views[view], view as u64);
        let mut out = photograph(&patch, (w, h), seen, &self.lights, s.options(), &session.task)?;
        for rgb in &mut out.rgb {
            *rgb = rgb.map(|x| (PI * f64::from(x)) as f32);
        }
        out.variance.iter_mut().for_each(|v| *v *= PI * PI);
        Ok(out)
    }
}

/// The planes of a light's picture.
fn planes(p: &Photographs, light: usize, lights: usize) -> [Vec<f32>; 3] {
    [0, 1, 2].map(|c| p.rgb.iter().skip(light).step_by(lights).map(|x| x[c]).collect())
}

fn picture_name(view: usize, light: usize, format: &str) -> String {
    format!("view_{view:03}/light_{light:03}.{format}")
}

impl Session {
    fn stage(&mut self, s: &Surface) -> Result<Stage, Error> {
        s.check()?;
        let (width, height, heights, name) = match &s.shape {
            Shape::Pattern(p, side) => (*side, *side, p.heights(*side), p.name().to_string()),
            Shape::File(file) => {
                let name = file.to_string_lossy();
                if !names_a_file(&name) {
                    let why = unknown("heights", &name, &Pattern::ALL.map(Pattern::name));
                    return Err(Error::usage(format!("{name}: no such file; {why}")));
                }
                let (w, h, z) = self.heights(file)?;
                (w, h, z, file.display().to_string())
            }
        };
        if width < 2 || height < 2 {
            return Err(Error::input(format!(
                "{name}: is {width} x {height} texels: a surface has 2 x 2 at least"
            )));
        }
        // Texels of a view under all lights, twice, and the triangles with their hierarchy.
        let texels = width as u64 * height as u64;
        let bytes = texels.saturating_mul(24 * s.lights as u64 + 400);
        if bytes > self.task.max_memory() {
            let why = format!("{width} x {height} texels under {} lights take {} MiB", s.lights, bytes >> 20);
            return Err(Error::failed(format!("{name}: {why}: raise `max-memory`")));
        }
        let scale = s.relief * width as f64;
        let z = heights.into_iter().map(|v| (f64::from(v) * scale) as f32).collect();
        let field = HeightField::new(width, height, z).map_err(|e| Error::input(format!("{name}: {e}")))?;
        let tint = match &s.base_colour {
            Some(path) => {
                let raster = all_finite(path, read_image(path, &self.limits())?)?;
                self.note_input(path);
                let (w, h) = (raster.width, raster.height);
                let texture = raster.into_rgb().and_then(|p| Texture::new(w, h, &p));
                Some(texture.ok_or_else(|| Error::input(format!("{}: has no colour", path.display())))?)
            }
            None => None,
        };
        let mesh = mesh(&field);
        let bvh = Bvh::build(&mesh);
        Ok(Stage { field, mesh, bvh, tint, views: spread(s.views), lights: spread(s.lights) })
    }

    /// The function of a surface, in memory, in half precision.
    pub fn photographed(&mut self, s: &Surface) -> Result<Btf, Error> {
        let stage = self.stage(s)?;
        let size = (stage.field.width(), stage.field.height());
        let bytes = (size.0 * size.1) as u64 * (6 * s.views * s.lights) as u64;
        if bytes > self.task.max_memory() {
            return Err(Error::failed(format!("the function takes {} MiB: raise `max-memory`", bytes >> 20)));
        }
        let mut btf = Btf::new(size, &stage.views, &stage.lights, true).map_err(Error::failed)?;
        self.task.begin("photographs", s.views as u64);
        for v in 0..s.views {
            let p = stage.photograph(s, v, self)?;
            for l in 0..s.lights {
                let [r, g, b] = planes(&p, l, s.lights);
                btf.set(v, l, [&r, &g, &b]).map_err(Error::failed)?;
            }
            self.task.advance(1);
        }
        self.task.end();
        Ok(btf)
    }

    /// Writes the pictures of a surface to a folder: a list of all of them (`btf.csv`), and where there is a
    /// view along the normal and at least six lights, a list of its lights (`rti.lp`) and their polynomial
    /// texture map (`rti.ptm`). Their numbers are π times the radiance under an irradiance of 1 across the
    /// light's direction: white is 1. A folder that an interrupted capture with the same settings began is
    /// continued, view by view; a cancellation leaves complete files.
    pub fn capture_surface(&mut self, s: &Surface, folder: &Path) -> Result<Captured, Error> {
        let start = Instant::now();
        Destinations::default().folder(folder, false)?;
        let stage = self.stage(s)?;
        self.spares_in(folder, |file| {
            let named = |name: &str| file == Path::new(name);
            let picture = |v, l| file == Path::new(&picture_name(v, l, s.format));
            let lists = [RECORD, "btf.csv", "rti.lp", "rti.ptm"];
            lists.into_iter().any(named) || (0..s.views).any(|v| (0..s.lights).any(|l| picture(v, l)))
        })?;
        let record = folder.join(RECORD);
        let asked = self.asked(s);
        let mut known = known(&record, &asked)?;
        let unwritable = |path: &Path, e: std::io::Error| {
            Error::failed(format!("{}: cannot write: {}", path.display(), e.kind()))
        };
        if !folder.exists() {
            std::fs::create_dir(folder).map_err(|e| unwritable(folder, e))?;
        }
        let there = |v: usize| (0..s.lights).all(|l| folder.join(picture_name(v, l, s.format)).is_file());
        known.retain(|(v, variances)| *v < s.views && variances.len() == s.lights && there(*v));
        let kept = known.len();
        self.task.begin("photographs", s.views as u64);
        self.task.advance(kept as u64);
        let mut lost = WriteReport::default();
        for v in (0..s.views).filter(|v| known.iter().all(|k| k.0 != *v)).collect::<Vec<_>>() {
            self.check()?;
            let p = stage.photograph(s, v, self)?;
            let inner = folder.join(format!("view_{v:03}"));
            if !inner.is_dir() {
                std::fs::create_dir(&inner).map_err(|e| unwritable(&inner, e))?;
            }
            lost.merge(self.write_pictures(s, &stage, (v, &p), folder)?);
            known.push((v, p.variance));
            write_record(&record, &asked, &known)?;
            self.task.advance(1);
        }
        self.task.end();
        self.tell_lost(folder, lost, None);
        known.sort_by_key(|k| k.0);
        let list = list(s, &stage, &known);
        write_btf(&folder.join("btf.csv"), &list)?;
        let polynomials = s.lights >= POLYNOMIAL && self.write_polynomials(s, &stage, folder)?;
        let all: Vec<f64> = known.iter().flat_map(|k| k.1.iter().copied()).collect();
        Ok(Captured {
            size: (stage.field.width(), stage.field.height()),
            views: s.views,
            kept,
            lights: s.lights,
            variance: all.iter().sum::<f64>() / all.len() as f64,
            polynomials,
            seconds: start.elapsed().as_secs_f64(),
        })
    }

    /// Settings of a capture in the form of its record.
    fn asked(&self, s: &Surface) -> Value {
        let mark = |p: &PathBuf| light_mark(&p.display().to_string());
        let (heights, side) = match &s.shape {
            Shape::Pattern(p, side) => (p.name().to_string(), Some(*side)),
            Shape::File(file) => (mark(file), None),
        };
        json!({
            "source": "synthetic",
            "heights": heights,
            "texels": side,
            "relief": s.relief,
            "brdf": steradian_brdf::spec_without_folders(&s.brdf.spec()),
            "base_colour": s.base_colour.as_ref().map(mark),
            "views": s.views,
            "lights": s.lights,
            "bounces": s.bounces,
            "samples": s.samples,
            "seed": s.seed,
            "format": s.format,
        })
    }

    /// The pictures of a view, each whole or not at all.
    fn write_pictures(
        &self,
        s: &Surface,
        stage: &Stage,
        (view, p): (usize, &Photographs),
        folder: &Path,
    ) -> Result<WriteReport, Error> {
        let (w, h) = (stage.field.width(), stage.field.height());
        let pairs = self.provenance_pairs();
        let one = |l: usize| -> Result<WriteReport, Error> {
            let raster = Raster::rgb(w, h, planes(p, l, s.lights));
            let word = |name: &str, x: f64| (format!("steradian.{name}"), x.to_string());
            let ([ti, pi], [to, po]) = (angles(stage.lights[l]), angles(stage.views[view]));
            let mut metadata = vec![
                ("steradian.source".to_string(), "synthetic".to_string()),
                ("steradian.seed".to_string(), s.seed.to_string()),
                word("variance", p.variance[l]),
                word("theta_i", ti),
                word("phi_i", pi),
                word("theta_o", to),
                word("phi_o", po),
            ];
            metadata.extend(pairs.iter().cloned());
            let options = WriteOptions { metadata, exr_samples: ExrSamples::Half, ..WriteOptions::default() };
            Ok(write_image(&folder.join(picture_name(view, l, s.format)), &raster, &options)?)
        };
        let all: Vec<Result<WriteReport, Error>> =
            (0..s.lights).into_par_iter().with_max_len(1).map(one).collect();
        let mut lost = WriteReport::default();
        for report in all {
            lost.merge(report?);
        }
        Ok(lost)
    }

    /// The view along the normal as a list of lights and a polynomial texture map; not where its lights
    /// determine no polynomial.
    fn write_polynomials(&mut self, s: &Surface, stage: &Stage, folder: &Path) -> Result<bool, Error> {
        let Some(view) = stage.views.iter().position(|v| v.z > 1.0 - 1e-9) else { return Ok(false) };
        if steradian_relight::polynomial::Fit::<6>::new(&stage.lights).is_err() {
            return Ok(false);
        }
        let light = |(l, d): (usize, &DVec3)| LightPosition {
            file: picture_name(view, l, s.format),
            position: d.to_array(),
        };
        let lights: Vec<LightPosition> = stage.lights.iter().enumerate().map(light).collect();
        let path = folder.join("rti.lp");
        write_lp(&path, &lights)?;
        self.fit_polynomials(&path, &folder.join("rti.ptm"), PolynomialKind::default())?;
        Ok(true)
    }
}

/// The views that a folder has, with the variances of their pictures.
type FinishedViews = Vec<(usize, Vec<f64>)>;

/// The finished views according to the record of a folder; refuses the record of another capture.
fn known(record: &Path, asked: &Value) -> Result<FinishedViews, Error> {
    if !record.exists() {
        return Ok(Vec::new());
    }
    let bad = |why: &str| Error::input(format!("{}: {why}", record.display()));
    let text = read_text(record, RECORD_BYTES, "the record of a capture")?;
    let found: Value = serde_json::from_str(&text).map_err(|_| bad("is no record of a capture"))?;
    let capture = found.get("capture").ok_or_else(|| bad("is no record of a capture"))?;
    if capture != asked {
        let differs = |key: &&String| capture.get(key.as_str()) != asked.get(key.as_str());
        let keys: Vec<&str> = asked
            .as_object()
            .into_iter()
            .flat_map(|o| o.keys().filter(differs).map(String::as_str))
            .collect();
        let why =
            format!("the folder holds another capture ({} differ): name another folder", keys.join(", "));
        return Err(Error::usage(format!("{}: {why}", record.display())));
    }
    let done =
        found.get("done").and_then(Value::as_object).ok_or_else(|| bad("has no list of what is done"))?;
    let one = |(view, variances): (&String, &Value)| {
        let variances: Option<Vec<f64>> = variances.as_array()?.iter().map(Value::as_f64).collect();
        Some((view.parse().ok()?, variances?))
    };
    done.iter().map(one).collect::<Option<FinishedViews>>().ok_or_else(|| bad("has no list of what is done"))
}

fn write_record(path: &Path, asked: &Value, known: &FinishedViews) -> Result<(), Error> {
    let done: serde_json::Map<String, Value> = known.iter().map(|(v, e)| (v.to_string(), json!(e))).collect();
    let mut text = serde_json::to_string_pretty(&json!({"capture": asked, "done": done})).unwrap_or_default();
    text.push('\n');
    Ok(write_atomic(path, |w| w.write_all(text.as_bytes()))?)
}

fn list(s: &Surface, stage: &Stage, known: &FinishedViews) -> BtfList {
    let picture = |v: usize, l: usize, variance: f64| BtfPicture {
        light: angles(stage.lights[l]),
        view: angles(stage.views[v]),
        file: picture_name(v, l, s.format),
        variance: Some(variance),
    };
    let pictures = known.iter().flat_map(|(v, e)| e.iter().enumerate().map(|(l, e)| picture(*v, l, *e)));
    BtfList { pictures: pictures.collect(), source: Some("synthetic".into()), seed: Some(s.seed) }
}
