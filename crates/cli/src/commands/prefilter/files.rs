//! The files of `steradian prefilter`.

use super::beside::Beside;
use super::engines::{Engine, Files};
use super::gltf::gltf;
use super::packing::Packed;
use super::plan::Plan;
use super::{Level, Options};
use crate::context::Context;
use crate::failure::Failure;
use crate::layouts::{self, Target};
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::path::Path;
use steradian_brdf::dfg::DfgTable;
use steradian_formats::{
    ExrSamples, FormatError, Raster, Supercompression, TexelFormat, TextureLevels, WriteOptions, WriteReport,
    write_atomic, write_dds, write_dir_atomic, write_image, write_ktx1, write_ktx2_as,
};
use steradian_sphere::sh::ShRgb;
use steradian_sphere::{Layout, SphereImage};

/// A file, and what its format could not hold.
pub struct Written {
    pub name: String,
    report: WriteReport,
}

impl Written {
    pub fn new(name: impl Into<String>, report: WriteReport) -> Self {
        Self { name: name.into(), report }
    }

    /// For the report.
    pub fn json(&self) -> Value {
        let r = self.report;
        json!({"file": self.name, "clipped": r.clipped, "vanished": r.vanished, "lost": r.lost})
    }
}

/// Writes everything that the options ask for.
pub fn write(
    o: &Options,
    plan: &Plan,
    packed: Packed,
    levels: &[Level],
    beside: &Beside,
    name: &str,
    context: &Context,
) -> Result<Vec<Written>, Failure> {
    let engine = plan.with_format(o);
    let written = if o.profile.is_none() {
        vec![one_file(o, &engine, &packed, levels, context)?]
    } else {
        folder(o, &engine, packed, levels, beside, name, context)?
    };
    for w in written.iter().filter(|w| w.report.clipped > 0 || w.report.vanished > 0) {
        let WriteReport { clipped, vanished, lost } = w.report;
        context.warn(format_args!(
            "{}: {clipped} samples clipped, {vanished} became 0, {lost:.4} lost in sum",
            w.name
        ));
    }
    Ok(written)
}

fn one_file(
    o: &Options,
    engine: &Engine,
    packed: &Packed,
    levels: &[Level],
    context: &Context,
) -> Result<Written, Failure> {
    let path = &o.output;
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if let [Level { filtered, .. }] = levels
        && filtered.image.layout == Layout::LatLong
    {
        let raster = layouts::arranged(filtered.image.clone(), Target::LatLong);
        let mut options =
            WriteOptions { metadata: layouts::metadata(Target::LatLong), ..WriteOptions::default() };
        options.metadata.extend(context.provenance_pairs());
        return Ok(Written::new(name, write_image(path, &raster, &options)?));
    }
    let t = &packed.specular;
    let report = match extension.as_str() {
        "ktx" => write_ktx1(path, t, engine.format)?,
        "dds" => write_dds(path, t, engine.format)?,
        _ => write_ktx2_as(path, t, engine.format, Supercompression::None)?,
    };
    Ok(Written::new(name, report))
}

/// An engine's files, whole or not at all.
fn folder(
    o: &Options,
    engine: &Engine,
    packed: Packed,
    levels: &[Level],
    beside: &Beside,
    name: &str,
    context: &Context,
) -> Result<Vec<Written>, Failure> {
    let Packed { mut specular, diffuse: cosine, sheen } = packed;
    let mut written = Vec::new();
    write_dir_atomic(&o.output, |dir| {
        written = match engine.files {
            Files::Ktx2 { specular: s, diffuse } => {
                let mut all = vec![ktx2(engine, dir, &s.replace("{}", name), &specular)?];
                if let (Some(d), Some(t)) = (diffuse, &cosine) {
                    all.push(ktx2(engine, dir, &d.replace("{}", name), t)?);
                }
                all
            }
            Files::Khronos => {
                let mut all = vec![ktx2(engine, dir, "specular.ktx2", &specular)?];
                for (file, t) in [("diffuse.ktx2", &cosine), ("sheen.ktx2", &sheen)] {
                    if let Some(t) = t {
                        all.push(ktx2(engine, dir, file, t)?);
                    }
                }
                all.push(brdf_table(dir)?);
                all
            }
            Files::LatLong { image, half, cube } => {
                let half = half && o.format != Some(TexelFormat::Rgba32f);
                let lat_long = &beside.panorama.as_ref().unwrap_or(&levels[0]).filtered.image;
                let mut all =
                    vec![panorama(engine, dir, &image.replace("{}", name), lat_long, half, context)?];
                if let Some(c) = cube {
                    let file = c.replace("{}", name);
                    all.push(Written::new(
                        file.clone(),
                        write_dds(&dir.join(file), &specular, engine.format)?,
                    ));
                }
                all
            }
            Files::Filament => filament(engine, dir, name, &mut specular, &beside.sh)?,
            Files::Gltf => gltf(engine, dir, name, levels, &beside.sh)?,
        };
        Ok(())
    })?;
    Ok(written)
}

/// The light as a lat-long image.
fn panorama(
    engine: &Engine,
    dir: &Path,
    file: &str,
    image: &SphereImage,
    half: bool,
    context: &Context,
) -> Result<Written, FormatError> {
    let mut metadata = context.provenance_pairs();
    metadata.push(("steradian.profile".into(), engine.recorded().into()));
    metadata.push(("steradian.layout".into(), Target::LatLong.name().into()));
    let mut options = WriteOptions { metadata, ..WriteOptions::default() };
    if half {
        options.exr_samples = ExrSamples::Half;
    }
    let raster = layouts::arranged(engine.arrange(image), Target::LatLong);
    Ok(Written::new(file, write_image(&dir.join(file), &raster, &options)?))
}

/// Texels a side of the split sum's table.
const TABLE: usize = 128;

/// `outputLUT.png`: the split sum's factors, red times F0 plus green, at n·v (columns) and perceptual roughness (rows
/// from 0). Values, not colours: no sRGB curve.
fn brdf_table(dir: &Path) -> Result<Written, FormatError> {
    let table = DfgTable::ggx(TABLE);
    let plane = |c: usize| table.values.iter().map(|v| v[c].clamp(0.0, 1.0)).collect();
    let raster = Raster::rgb(TABLE, TABLE, [plane(0), plane(1), vec![0.0; TABLE * TABLE]]);
    let options = WriteOptions { already_encoded: true, ..WriteOptions::default() };
    let file = "outputLUT.png";
    Ok(Written::new(file, write_image(&dir.join(file), &raster, &options)?))
}

fn ktx2(engine: &Engine, dir: &Path, name: &str, t: &TextureLevels) -> Result<Written, FormatError> {
    let compression = if engine.zstd { Supercompression::Zstd } else { Supercompression::None };
    // Names say what is inside.
    let name = name.replace("rgb9e5", engine.format.name());
    let report = write_ktx2_as(&dir.join(&name), t, engine.format, compression)?;
    Ok(Written::new(name, report))
}

/// Factors A_l of the clamped cosine's bands 0 to 2.
const COSINE: [f64; 3] = [PI, 2.0 * PI / 3.0, PI / 4.0];

/// Coefficients times A_l: irradiance.
pub fn irradiance(sh: &ShRgb) -> Vec<[f64; 3]> {
    (0..9).map(|i: usize| std::array::from_fn(|c| sh.c[c][i] * COSINE[i.isqrt()])).collect()
}

/// Nine numbers per channel: E/π with the basis' constants folded in, so that E(n)/π = s0 + s1 y + s2 z + s3 x + s4 yx +
/// s5 yz + s6 (3z² − 1) + s7 zx + s8 (x² − y²).
pub fn filament_numbers(sh: &ShRgb) -> Vec<[f64; 3]> {
    const K: [f64; 9] =
        [0.282095, 0.488603, 0.488603, 0.488603, 1.092548, 1.092548, 0.315392, 1.092548, 0.546274];
    irradiance(sh).iter().zip(K).map(|(e, k)| e.map(|v| v / PI * k)).collect()
}

/// The same as text.
fn filament_sh(sh: &ShRgb) -> String {
    filament_numbers(sh).iter().map(|[r, g, b]| format!("{r:.9} {g:.9} {b:.9}\n")).collect()
}

fn filament(
    engine: &Engine,
    dir: &Path,
    name: &str,
    specular: &mut TextureLevels,
    sh: &ShRgb,
) -> Result<Vec<Written>, FormatError> {
    let sh = filament_sh(sh);
    let folder = dir.join(name);
    std::fs::create_dir_all(&folder)
        .map_err(|e| FormatError::Unwritable { path: folder.clone(), why: e.to_string() })?;
    let mut written = Vec::new();
    let mut write = |part: &str, t: &TextureLevels| -> Result<(), FormatError> {
        let file = format!("{name}_{part}.ktx");
        let report = write_ktx1(&folder.join(&file), t, engine.format)?;
        written.push(Written::new(format!("{name}/{file}"), report));
        Ok(())
    };
    specular.metadata.insert(0, ("sh".into(), sh.clone()));
    write("ibl", specular)?;
    specular.metadata.remove(0);
    specular.levels.truncate(1);
    write("skybox", specular)?;
    write_atomic(&folder.join("sh.txt"), |w| w.write_all(sh.as_bytes()))?;
    written.push(Written::new(format!("{name}/sh.txt"), WriteReport::default()));
    Ok(written)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The nine numbers give E/π of a function of bands 0 to 2 at any normal.
    #[test]
    fn filament_s_numbers_evaluate_to_irradiance_over_pi() {
        let mut sh = ShRgb::zero(2);
        sh.c.iter_mut().flatten().enumerate().for_each(|(i, c)| *c = (i as f64).sin() + 0.3);
        let s: Vec<f64> = filament_sh(&sh).split_whitespace().map(|v| v.parse().unwrap()).collect();
        assert_eq!(s.len(), 27);
        let mut e = sh.clone();
        e.convolve(&COSINE);
        for d in [glam::DVec3::new(0.48, 0.6, 0.64), glam::DVec3::X, glam::DVec3::NEG_Z] {
            let (x, y, z) = (d.x, d.y, d.z);
            let basis = [1.0, y, z, x, y * x, y * z, 3.0 * z * z - 1.0, z * x, x * x - y * y];
            let expected = e.value(d);
            for c in 0..3 {
                let got: f64 = basis.iter().enumerate().map(|(i, b)| b * s[3 * i + c]).sum();
                assert!((got - expected[c] / PI).abs() < 1e-5, "{got} {}", expected[c] / PI);
            }
        }
    }
}
