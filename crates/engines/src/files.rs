//! The files, written.

use crate::gltf::gltf;
use crate::packing::Packed;
use crate::{Engine, EngineError, Files, Filtered, Remedy};
use std::path::Path;
use steradian_brdf::dfg::DfgTable;
use steradian_formats::{
    Container, ExrSamples, FormatError, Raster, StoredTexture, Supercompression, TexelFormat, WriteOptions,
    WriteReport, write_atomic, write_dir_atomic, write_image,
};
use steradian_light::DiskLight;
use steradian_light::load::Arrangement;
use steradian_sphere::SphereImage;
use steradian_sphere::sh::ShRgb;

/// A file that was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    /// Its name below the output's folder.
    pub name: String,
    /// What its format could not hold.
    pub report: WriteReport,
}

impl Written {
    pub(crate) fn new(name: impl Into<String>, report: WriteReport) -> Self {
        Self { name: name.into(), report }
    }
}

/// Writes everything that was asked for.
pub(crate) fn write(
    made: &Filtered,
    packed: Packed,
    metadata: &[(String, String)],
) -> Result<Vec<Written>, EngineError> {
    if made.request.engine.is_none() {
        return Ok(vec![one_file(made, &packed, metadata)?]);
    }
    Ok(folder(made, packed, metadata)?)
}

fn one_file(made: &Filtered, packed: &Packed, metadata: &[(String, String)]) -> Result<Written, FormatError> {
    let path = &made.request.output;
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let report = match (&packed.specular, Container::of_name(path)) {
        (Some(t), Some(Container::Ktx1)) => t.write_ktx1(path)?,
        (Some(t), Some(Container::Dds)) => t.write_dds(path)?,
        (Some(t), _) => t.write_ktx2(path, Supercompression::None)?,
        (None, _) => {
            let raster = Arrangement::LatLong.arranged(made.levels[0].filtered.image.clone());
            let mut options =
                WriteOptions { metadata: Arrangement::LatLong.metadata(), ..WriteOptions::default() };
            options.metadata.extend(metadata.iter().cloned());
            write_image(path, &raster, &options)?
        }
    };
    Ok(Written::new(name, report))
}

/// An engine's files, whole or not at all.
fn folder(
    made: &Filtered,
    packed: Packed,
    metadata: &[(String, String)],
) -> Result<Vec<Written>, FormatError> {
    let (o, levels, companions) = (&made.request, &made.levels, &made.companions);
    let (engine, name) = (&made.engine(), &*o.name);
    let Packed { specular, diffuse: cosine, sheen } = packed;
    let mut written = Vec::new();
    let output = o.folder();
    if output != o.output {
        let unwritable =
            |e: std::io::Error| FormatError::Unwritable { path: o.output.clone(), why: e.to_string() };
        std::fs::create_dir_all(&o.output).map_err(unwritable)?;
    }
    write_dir_atomic(&output, |dir| {
        written =
            match engine.files {
                Files::Ktx2 { specular: s, diffuse } => {
                    let files = [(Some(s), &specular), (diffuse, &cosine)];
                    let named = |(file, t): (Option<&str>, _)| Some((file?.replace("{}", name), t));
                    ktx2(engine, dir, files.into_iter().filter_map(named))?
                }
                Files::Khronos => {
                    let files = [("specular", &specular), ("diffuse", &cosine), ("sheen", &sheen)];
                    let mut all = ktx2(engine, dir, files.map(|(part, t)| (format!("{part}.ktx2"), t)))?;
                    all.push(brdf_table(dir)?);
                    all
                }
                Files::LatLong { image, half, cube } => {
                    let half = half && o.format != Some(TexelFormat::Rgba32f);
                    let lat_long = &companions.panorama.as_ref().unwrap_or(&levels[0]).filtered.image;
                    let mut all =
                        vec![panorama(engine, dir, &image.replace("{}", name), lat_long, half, metadata)?];
                    if let (Some(c), Some(t)) = (cube, &specular) {
                        let file = c.replace("{}", name);
                        all.push(Written::new(file.clone(), t.write_dds(&dir.join(file))?));
                    }
                    all
                }
                Files::Dds { specular: file } => {
                    let file = file.replace("{}", name);
                    let t = specular.iter();
                    t.map(|t| Ok(Written::new(file.clone(), t.write_dds(&dir.join(&file))?)))
                        .collect::<Result<_, FormatError>>()?
                }
                Files::Filament => filament(engine, dir, name, specular.clone(), &companions.sh)?,
                Files::Gltf => gltf(engine, dir, name, levels, &companions.sh)?,
            };
        if made.beyond.is_some_and(|b| b.remedy == Remedy::SunsTakenOut) {
            written.push(suns(made, dir)?);
        }
        Ok(())
    })?;
    Ok(written)
}

/// The suns that the light lost, as `render --sun-lights` reads them.
fn suns(made: &Filtered, dir: &Path) -> Result<Written, FormatError> {
    let file = made.request.suns_file();
    let text = format!("{:#}\n", DiskLight::document(&made.request.suns));
    write_atomic(&dir.join(&file), |w| w.write_all(text.as_bytes()))?;
    Ok(Written::new(file, WriteReport::default()))
}

/// The light as a lat-long image.
fn panorama(
    engine: &Engine,
    dir: &Path,
    file: &str,
    image: &SphereImage,
    half: bool,
    metadata: &[(String, String)],
) -> Result<Written, FormatError> {
    let mut metadata = metadata.to_vec();
    metadata.push(("steradian.profile".into(), engine.recorded().into()));
    metadata.push(("steradian.layout".into(), Arrangement::LatLong.name().into()));
    let mut options = WriteOptions { metadata, ..WriteOptions::default() };
    if half {
        options.exr_samples = ExrSamples::Half;
    }
    let raster = Arrangement::LatLong.arranged(engine.arrange(image));
    Ok(Written::new(file, write_image(&dir.join(file), &raster, &options)?))
}

/// Texels a side of the split sum's table.
const TABLE: usize = 128;

/// `outputLUT.png`: the split sum's factors, red times F0 plus green, at n·v (columns) and perceptual
/// roughness (rows from 0). Values, not colours: no sRGB curve.
fn brdf_table(dir: &Path) -> Result<Written, FormatError> {
    let table = DfgTable::ggx(TABLE);
    let plane = |c: usize| table.values.iter().map(|v| v[c].clamp(0.0, 1.0)).collect();
    let raster = Raster::rgb(TABLE, TABLE, [plane(0), plane(1), vec![0.0; TABLE * TABLE]]);
    let options = WriteOptions { already_encoded: true, ..WriteOptions::default() };
    let file = "outputLUT.png";
    Ok(Written::new(file, write_image(&dir.join(file), &raster, &options)?))
}

/// Those textures that there are, by name.
fn ktx2<'a>(
    engine: &Engine,
    dir: &Path,
    files: impl IntoIterator<Item = (String, &'a Option<StoredTexture>)>,
) -> Result<Vec<Written>, FormatError> {
    let compression = if engine.zstd { Supercompression::Zstd } else { Supercompression::None };
    let mut written = Vec::new();
    for (name, t) in files {
        let Some(t) = t else { continue };
        // Names say what is inside.
        let name = name.replace("rgb9e5", engine.format.name());
        let report = t.write_ktx2(&dir.join(&name), compression)?;
        written.push(Written::new(name, report));
    }
    Ok(written)
}

/// The coefficients of diffuse light as text, one a line.
fn sh_text(engine: &Engine, sh: &ShRgb) -> String {
    engine.coefficients.of(sh).iter().map(|[r, g, b]| format!("{r:.9} {g:.9} {b:.9}\n")).collect()
}

fn filament(
    engine: &Engine,
    dir: &Path,
    name: &str,
    specular: Option<StoredTexture>,
    sh: &ShRgb,
) -> Result<Vec<Written>, FormatError> {
    let sh = sh_text(engine, sh);
    let folder = dir.join(name);
    std::fs::create_dir_all(&folder)
        .map_err(|e| FormatError::Unwritable { path: folder.clone(), why: e.to_string() })?;
    let mut written = Vec::new();
    let mut write = |part: &str, t: &StoredTexture| -> Result<(), FormatError> {
        let file = format!("{name}_{part}.ktx");
        let report = t.write_ktx1(&folder.join(&file))?;
        written.push(Written::new(format!("{name}/{file}"), report));
        Ok(())
    };
    if let Some(mut t) = specular {
        t.metadata.insert(0, ("sh".into(), sh.clone()));
        write("ibl", &t)?;
        t.metadata.remove(0);
        t.truncate(1);
        write("skybox", &t)?;
    }
    write_atomic(&folder.join("sh.txt"), |w| w.write_all(sh.as_bytes()))?;
    written.push(Written::new(format!("{name}/sh.txt"), WriteReport::default()));
    Ok(written)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// The nine numbers give E/π of a function of bands 0 to 2 at any normal.
    #[test]
    fn filament_s_numbers_evaluate_to_irradiance_over_pi() {
        let mut sh = ShRgb::zero(2);
        sh.c.iter_mut().flatten().enumerate().for_each(|(i, c)| *c = (i as f64).sin() + 0.3);
        let s: Vec<f64> = sh_text(Engine::find("filament").unwrap(), &sh)
            .split_whitespace()
            .map(|v| v.parse().unwrap())
            .collect();
        assert_eq!(s.len(), 27);
        let mut e = sh.clone();
        e.convolve(&crate::irradiance::COSINE);
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
