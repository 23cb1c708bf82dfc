//! Files that accompany an engine's maps: a glTF file with a light, suns, coefficients of diffuse light, the
//! split sum's table.

use super::{Line, Report, light};
use crate::prefiltered::{LightOfGltf, coefficients};
use crate::{Adjust, Error, Session, file_name, has_extension};
use glam::DVec3;
use serde_json::{Value, json};
use std::path::Path;
use steradian_engines::Engine;
use steradian_formats::{ReadOptions, is_image, read_image_with, read_text};
use steradian_light::Lamp;
use steradian_light::load::Profile;

/// Bytes of a file of coefficients at most.
const TEXT: u64 = 1 << 16;

impl Session {
    /// Report on a file that accompanies an engine's maps; `None` for other files.
    pub(super) fn inspect_beside(&mut self, path: &Path, adjust: &Adjust) -> Result<Option<Report>, Error> {
        if !path.is_file() {
            return Ok(None);
        }
        let name = file_name(path);
        let text = !is_image(path);
        let report = match () {
            () if text && has_extension(path, &["gltf"]) => {
                let profile = Profile::find("gltf").unwrap_or_else(Profile::own);
                match self.light_of_gltf(path, adjust.profile.unwrap_or(profile), adjust.layout)? {
                    Some(found) => Some(self.gltf_report(found, &name)?),
                    None => None,
                }
            }
            () if text && has_extension(path, &["json"]) => Some(lamps(&Lamp::read(path)?, &name)),
            () if text && has_extension(path, &["txt"]) => Some(self.coefficients_report(path, &name)?),
            () if has_extension(path, &["png"]) && name.to_lowercase().contains("lut") => {
                self.table_report(path, &name)?
            }
            () => None,
        };
        if report.is_some() {
            self.note_input(path);
        }
        Ok(report)
    }

    /// A light of `EXT_lights_image_based`: what its first level is, and every level.
    fn gltf_report(&mut self, found: LightOfGltf, name: &str) -> Result<Report, Error> {
        let last = found.levels.len() - 1;
        let curve = Engine::find("gltf").map(|e| e.curve);
        let (mut levels, mut lines): (Vec<Value>, Vec<Line>) = (Vec::new(), Vec::new());
        let n = found.levels.len();
        let of = if n == 1 { "1 level".into() } else { format!("{n} levels") };
        lines.push(("light", format!("EXT_lights_image_based of a glTF file: RGBD faces, cube, {of}")));
        for (m, image) in found.levels.iter().enumerate() {
            let r = curve.map(|c| c.roughness(m, last));
            let mean = image.integral().map(|v| v / (4.0 * std::f64::consts::PI));
            let largest: [f32; 3] =
                std::array::from_fn(|c| image.planes[c].iter().copied().fold(f32::MIN, f32::max));
            let rough = r.map(|r| format!(", perceptual roughness {r:.3}")).unwrap_or_default();
            let [a, b] = [mean, largest.map(f64::from)].map(|v| v.map(|x| format!("{x:.5}")).join(" "));
            let (w, h) = (image.width, image.height);
            lines.push(("level", format!("{m}: {w} x {h}{rough}, mean {a}, largest {b}")));
            levels.push(json!({
                "width": w, "height": h, "perceptual_roughness": r, "mean": mean, "largest": largest,
            }));
        }
        if let Some(sh) = &found.sh {
            lines.push(("coefficients", format!("irradiance, {} of spherical harmonics", sh.len())));
        }
        let first = found.levels.into_iter().next().ok_or_else(|| Error::failed("no level"))?;
        let mut report = light::report(&self.image_facts(&first)?, name);
        report.json["gltf_light"] = json!({"levels": levels, "irradiance_coefficients": found.sh});
        report.lines.splice(1..1, lines);
        Ok(report)
    }

    /// Nine coefficients as Filament's `sh.txt` has them.
    fn coefficients_report(&self, path: &Path, name: &str) -> Result<Report, Error> {
        let text = read_text(path, TEXT, "nine coefficients of diffuse light")?;
        let rows = coefficients(&text).ok_or_else(|| {
            Error::input(format!(
                "{}: holds no nine coefficients of three numbers, as Filament's sh.txt does",
                path.display()
            ))
        })?;
        // E(n) = π (s0 + s1 y + s2 z + s3 x + s4 yx + s5 yz + s6 (3z² − 1) + s7 zx + s8 (x² − y²))
        let irradiance = |n: DVec3| -> [f64; 3] {
            let (x, y, z) = (n.x, n.y, n.z);
            let basis = [1.0, y, z, x, y * x, y * z, 3.0 * z * z - 1.0, z * x, x * x - y * y];
            let sum = |c: usize| basis.iter().zip(&rows).map(|(b, s)| b * s[c]).sum::<f64>();
            std::array::from_fn(|c| std::f64::consts::PI * sum(c))
        };
        let sides = [
            ("+X", DVec3::X),
            ("-X", DVec3::NEG_X),
            ("+Y", DVec3::Y),
            ("-Y", DVec3::NEG_Y),
            ("+Z", DVec3::Z),
            ("-Z", DVec3::NEG_Z),
        ];
        let mut lines = vec![
            ("name", name.into()),
            (
                "coefficients",
                "nine of irradiance over pi, a polynomial of the normal: Filament's sh.txt".into(),
            ),
        ];
        lines.extend(rows.iter().map(|row| ("coefficient", three(*row))));
        lines.extend(sides.iter().map(|(side, n)| {
            ("irradiance", format!("{} (on a surface that faces {side}, W m⁻²)", three(irradiance(*n))))
        }));
        let facing: serde_json::Map<String, Value> =
            sides.iter().map(|(side, n)| ((*side).into(), json!(irradiance(*n)))).collect();
        let json = json!({"kind": "coefficients", "name": name, "coefficients": rows, "irradiance": facing});
        Ok(Report { json, lines })
    }

    /// A table of the split sum: square, with nothing in blue. `None` for other pictures.
    fn table_report(&self, path: &Path, name: &str) -> Result<Option<Report>, Error> {
        // Values, not colours.
        let options = ReadOptions { limits: self.limits(), data: true, ..ReadOptions::default() };
        let raster = read_image_with(path, &options)?;
        let planes = [raster.channel("R"), raster.channel("G"), raster.channel("B")];
        let [Some(red), Some(green), Some(blue)] = planes else { return Ok(None) };
        if raster.width != raster.height || blue.iter().any(|b| *b != 0.0) {
            return Ok(None);
        }
        let n = raster.width;
        let range = |plane: &[f32]| {
            plane.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)))
        };
        let ((r0, r1), (g0, g1)) = (range(red), range(green));
        let lines = vec![
            ("name", name.into()),
            (
                "table",
                format!("the split sum's factors of a reflectance, {n} x {n}: red times F0 plus green"),
            ),
            ("axes", "n.v to the right, perceptual roughness in the rows (ours from 0 in the first)".into()),
            ("red", format!("{r0:.4} to {r1:.4}")),
            ("green", format!("{g0:.4} to {g1:.4}")),
        ];
        let json = json!({
            "kind": "split-sum-table", "name": name, "size": n, "red": [r0, r1], "green": [g0, g1],
        });
        Ok(Some(Report { json, lines }))
    }
}

fn three(v: [f64; 3]) -> String {
    format!("{:.5} {:.5} {:.5}", v[0], v[1], v[2])
}

/// A file of lights, such as the suns taken out of a map.
fn lamps(all: &[Lamp], name: &str) -> Report {
    let mut lines: Vec<Line> = vec![("name", name.into()), ("lights", all.len().to_string())];
    let mut entries = Vec::new();
    for lamp in all {
        let (line, entry) = match lamp {
            Lamp::Disk(d) => (
                ("disk", format!("{}, {}", light::place(d.direction), light::disk_line(d))),
                light::disk_json(d),
            ),
            Lamp::Directional(d) => (
                (
                    "directional",
                    format!("{}, irradiance {} W m⁻²", light::place(d.direction), three(d.irradiance)),
                ),
                json!({"direction": d.direction.to_array(), "irradiance": d.irradiance}),
            ),
            Lamp::Point(p) => {
                let [x, y, z] = p.position.to_array();
                let intensity = three(p.intensity.map(f64::from));
                (
                    ("point", format!("at ({x:.3}, {y:.3}, {z:.3}), intensity {intensity} W sr⁻¹")),
                    json!({"position": p.position.to_array(), "intensity": p.intensity}),
                )
            }
        };
        let mut entry = entry;
        entry["kind"] = json!(line.0);
        lines.push(line);
        entries.push(entry);
    }
    Report { json: json!({"kind": "lights", "name": name, "lights": entries}), lines }
}
