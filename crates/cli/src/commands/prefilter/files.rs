//! The files of `steradian prefilter`.

use super::engines::{Engine, Files};
use super::plan::{Filter, Kernel, Plan, microfacet};
use super::{BRDF, Job, Level, Options};
use crate::context::Context;
use crate::failure::Failure;
use crate::layouts::{self, Target};
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::path::Path;
use steradian_brdf::dfg::DfgTable;
use steradian_formats::packed::{decode_rgbd, encode_rgbd, round_trip_rgbe};
use steradian_formats::{
    Channel, ExrSamples, FormatError, Raster, Supercompression, TexelFormat, TextureLevels, WriteOptions,
    WriteReport, write_atomic, write_dds, write_dir_atomic, write_image, write_ktx1, write_ktx2_as,
};
use steradian_prefilter::Lobe;
use steradian_sphere::sh::ShRgb;
use steradian_sphere::{Layout, SphereImage};

/// A file, and what its format could not hold.
pub struct Written {
    pub name: String,
    report: WriteReport,
}

impl Written {
    fn new(name: impl Into<String>, report: WriteReport) -> Self {
        Self { name: name.into(), report }
    }

    /// For the report.
    pub fn json(&self) -> Value {
        let r = self.report;
        json!({"file": self.name, "clipped": r.clipped, "vanished": r.vanished, "lost": r.lost})
    }
}

/// Faces of diffuse cubes.
const DIFFUSE: usize = 32;

/// Writes everything that the options ask for.
pub fn write(
    o: &Options,
    plan: &Plan,
    job: &Job<'_>,
    levels: &[Level],
    name: &str,
    context: &Context,
) -> Result<Vec<Written>, Failure> {
    let engine = Engine { format: o.format.unwrap_or(plan.engine.format), ..*plan.engine };
    let written = if o.profile.is_none() {
        vec![one_file(o, &engine, levels, context)?]
    } else {
        folder(o, &engine, job, levels, name, context)?
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

/// What the texels' format changes in each level as it lies in the file: RMS of what comes back less what was given,
/// over the RMS of the level.
pub fn format_errors(o: &Options, plan: &Plan, levels: &[Level], context: &Context) -> Vec<f64> {
    let engine = Engine { format: o.format.unwrap_or(plan.engine.format), ..*plan.engine };
    let hdr = o.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("hdr"));
    let back = |(texels, side): (&[f32], usize)| match engine.files {
        Files::Gltf => colours(texels, |c| decode_rgbd(encode_rgbd(c, &mut WriteReport::default()))),
        Files::LatLong { cube: None, half, .. } if half && o.format != Some(TexelFormat::Rgba32f) => {
            TexelFormat::Rgba16f.round_trip(texels, (side, side))
        }
        Files::LatLong { cube: None, .. } => texels.to_vec(),
        _ if plan.layout == Layout::Cube => engine.format.round_trip(texels, (side, side)),
        _ if hdr => colours(texels, round_trip_rgbe),
        _ => texels.to_vec(),
    };
    let error = |l: &Level| {
        let cube = cubes(&engine, &[&l.filtered.image], context);
        cube.levels.iter().map(|texels| change(texels, &back((texels, cube.width)))).fold(0.0, f64::max)
    };
    levels.iter().map(error).collect()
}

/// Every colour of texels that lie as R G B A, by `f`.
fn colours(texels: &[f32], f: impl Fn([f32; 3]) -> [f32; 3]) -> Vec<f32> {
    let texels = texels.as_chunks::<4>().0.iter();
    texels.flat_map(|t| f([t[0], t[1], t[2]]).into_iter().chain([t[3]])).collect()
}

/// RMS(after − before)/RMS(before) of the colours of texels that lie as R G B A.
fn change(before: &[f32], after: &[f32]) -> f64 {
    let (mut error, mut whole) = (0.0, 0.0);
    for (b, a) in before.as_chunks::<4>().0.iter().zip(after.as_chunks::<4>().0) {
        for c in 0..3 {
            let v = f64::from(b[c]);
            error += (f64::from(a[c]) - v).powi(2);
            whole += v * v;
        }
    }
    if whole == 0.0 { 0.0 } else { (error / whole).sqrt() }
}

fn one_file(o: &Options, engine: &Engine, levels: &[Level], context: &Context) -> Result<Written, Failure> {
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
    let t = texture(engine, levels, &label(&o.kernel), context);
    let report = match extension.as_str() {
        "ktx" => write_ktx1(path, &t, engine.format)?,
        "dds" => write_dds(path, &t, engine.format)?,
        _ => write_ktx2_as(path, &t, engine.format, Supercompression::None)?,
    };
    Ok(Written::new(name, report))
}

/// Levels in the arrangement of `engine`.
fn texture(engine: &Engine, levels: &[Level], kernel: &str, context: &Context) -> TextureLevels {
    let images: Vec<&SphereImage> = levels.iter().map(|l| &l.filtered.image).collect();
    let mut t = cubes(engine, &images, context);
    t.metadata.push(("steradian.kernel".into(), kernel.into()));
    let roughness: Vec<String> =
        levels.iter().filter_map(|l| l.filter.roughness).map(|r| r.to_string()).collect();
    if !roughness.is_empty() {
        t.metadata.push(("steradian.perceptual_roughness".into(), roughness.join(" ")));
    }
    t
}

/// The kernel's name in files, which hold no folders' names.
fn label(kernel: &str) -> String {
    let Some(spec) = kernel.strip_prefix(BRDF) else { return kernel.into() };
    let parts = spec.split_inclusive([':', ',', '=']).map(|part| {
        let (path, end) = part.split_at(part.trim_end_matches([':', ',', '=']).len());
        let path = Path::new(path);
        let name = path.file_name().filter(|_| path.is_file());
        name.map_or_else(|| part.to_string(), |n| n.to_string_lossy().into_owned() + end)
    });
    parts.fold(String::from(BRDF), |all, part| all + &part)
}

fn cubes(engine: &Engine, images: &[&SphereImage], context: &Context) -> TextureLevels {
    let size = images.first().map_or(0, |i| i.width);
    let mut metadata = context.provenance_pairs();
    metadata.push(("steradian.profile".into(), engine.recorded().into()));
    let level = |image: &&SphereImage| -> Vec<f32> {
        let [r, g, b] = engine.arrange(image).planes;
        let mut texels = vec![1.0; 4 * r.len()];
        let colours = r.iter().zip(&g).zip(&b);
        texels.as_chunks_mut::<4>().0.iter_mut().zip(colours).for_each(|(t, ((r, g), b))| {
            [t[0], t[1], t[2]] = [*r, *g, *b];
        });
        texels
    };
    let levels = images.iter().map(level).collect();
    TextureLevels { width: size, height: size, faces: 6, levels, metadata }
}

/// An engine's files, whole or not at all.
fn folder(
    o: &Options,
    engine: &Engine,
    job: &Job<'_>,
    levels: &[Level],
    name: &str,
    context: &Context,
) -> Result<Vec<Written>, Failure> {
    let cubes = || levels.iter().all(|l| l.filtered.image.layout == Layout::Cube);
    let specular =
        if cubes() { texture(engine, levels, &label(&o.kernel), context) } else { TextureLevels::default() };
    let extra = Extra::new(engine, job, levels, context)?;
    let mut written = Vec::new();
    write_dir_atomic(&o.output, |dir| {
        written = match engine.files {
            Files::Ktx2 { specular: s, diffuse } => {
                let mut all = vec![ktx2(engine, dir, &s.replace("{}", name), &specular)?];
                if let (Some(d), Some(t)) = (diffuse, &extra.diffuse) {
                    all.push(ktx2(engine, dir, &d.replace("{}", name), t)?);
                }
                all
            }
            Files::Khronos => {
                let mut all = vec![ktx2(engine, dir, "specular.ktx2", &specular)?];
                for (file, t) in [("diffuse.ktx2", &extra.diffuse), ("sheen.ktx2", &extra.sheen)] {
                    if let Some(t) = t {
                        all.push(ktx2(engine, dir, file, t)?);
                    }
                }
                all.push(brdf_table(dir)?);
                all
            }
            Files::LatLong { image, half, cube } => {
                let half = half && o.format != Some(TexelFormat::Rgba32f);
                let lat_long = extra.panorama.as_ref().unwrap_or(&levels[0].filtered.image);
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
            Files::Filament => filament(engine, dir, name, specular.clone(), &extra.sh)?,
            Files::Gltf => gltf(engine, dir, name, levels, &extra.sh)?,
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

/// What goes beside the specular levels.
struct Extra {
    diffuse: Option<TextureLevels>,
    sheen: Option<TextureLevels>,
    /// The light as it is, beside cubes.
    panorama: Option<SphereImage>,
    /// Radiance, bands 0 to 2.
    sh: ShRgb,
}

impl Extra {
    fn new(engine: &Engine, job: &Job<'_>, levels: &[Level], context: &Context) -> Result<Self, Failure> {
        let mut extra = Self { diffuse: None, sheen: None, panorama: None, sh: job.light.coefficients(2) };
        let quick = Job { check: 0, ..*job };
        if matches!(engine.files, Files::Khronos | Files::Ktx2 { diffuse: Some(_), .. }) {
            let filter = Filter { lobe: Some(Kernel::Lobe(Lobe::lambert())), roughness: None };
            let level = quick.level(filter, (Layout::Cube, DIFFUSE, DIFFUSE), context)?;
            extra.diffuse = Some(texture(engine, &[level], "lambert", context));
        }
        if engine.files == Files::Khronos {
            let mut sheen = Vec::new();
            for l in levels {
                let n = l.filtered.image.width;
                let filter = microfacet("charlie", l.filter.roughness.unwrap_or(0.0));
                sheen.push(quick.level(filter, (Layout::Cube, n, n), context)?);
            }
            extra.sheen = Some(texture(engine, &sheen, "charlie", context));
        }
        if matches!(engine.files, Files::LatLong { cube: Some(_), .. }) {
            let (w, h) = (job.light.image.width, job.light.image.height);
            extra.panorama = Some(job.light.mirror(Layout::LatLong, w, h));
        }
        Ok(extra)
    }
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
    mut ibl: TextureLevels,
    sh: &ShRgb,
) -> Result<Vec<Written>, FormatError> {
    let sh = filament_sh(sh);
    let folder = dir.join(name);
    std::fs::create_dir_all(&folder)
        .map_err(|e| FormatError::Unwritable { path: folder.clone(), why: e.to_string() })?;
    let mut skybox = ibl.clone();
    skybox.levels.truncate(1);
    ibl.metadata.insert(0, ("sh".into(), sh.clone()));
    let mut written = Vec::new();
    for (part, t) in [("ibl", &ibl), ("skybox", &skybox)] {
        let file = format!("{name}_{part}.ktx");
        let report = write_ktx1(&folder.join(&file), t, engine.format)?;
        written.push(Written::new(format!("{name}/{file}"), report));
    }
    write_atomic(&folder.join("sh.txt"), |w| w.write_all(sh.as_bytes()))?;
    written.push(Written::new(format!("{name}/sh.txt"), WriteReport::default()));
    Ok(written)
}

fn gltf(
    engine: &Engine,
    dir: &Path,
    name: &str,
    levels: &[Level],
    sh: &ShRgb,
) -> Result<Vec<Written>, FormatError> {
    const FACES: [&str; 6] = ["px", "nx", "py", "ny", "pz", "nz"];
    let mut written = Vec::new();
    let (mut images, mut specular) = (Vec::new(), Vec::new());
    for (m, level) in levels.iter().enumerate() {
        let cube = engine.arrange(&level.filtered.image);
        let first = images.len();
        for (face, part) in FACES.into_iter().enumerate() {
            let file = format!("{name}_specular_{m}_{part}.png");
            let (raster, report) = rgbd(&layouts::face(&cube, face));
            let options = WriteOptions { already_encoded: true, ..WriteOptions::default() };
            write_image(&dir.join(&file), &raster, &options)?;
            images.push(json!({"uri": file}));
            written.push(Written::new(file, report));
        }
        specular.push((first..first + 6).collect::<Vec<_>>());
    }
    let size = levels.first().map_or(0, |l| l.filtered.image.width);
    let light = json!({
        "name": name,
        "intensity": 1.0,
        "rotation": [0.0, 0.0, 0.0, 1.0],
        "irradianceCoefficients": irradiance(sh),
        "specularImages": specular,
        "specularImageSize": size,
    });
    let document = json!({
        "asset": {"version": "2.0", "generator": concat!("Steradian ", env!("CARGO_PKG_VERSION"))},
        "extensionsUsed": ["EXT_lights_image_based"],
        "extensions": {"EXT_lights_image_based": {"lights": [light]}},
        "scene": 0,
        "scenes": [{"extensions": {"EXT_lights_image_based": {"light": 0}}}],
        "images": images,
    });
    let file = format!("{name}.gltf");
    let text = format!("{document:#}\n");
    write_atomic(&dir.join(&file), |w| w.write_all(text.as_bytes()))?;
    written.push(Written::new(file, WriteReport::default()));
    Ok(written)
}

/// The codes of RGBD texels as values 0 … 1.
fn rgbd(face: &Raster) -> (Raster, WriteReport) {
    let mut report = WriteReport::default();
    let mut planes: [Vec<f32>; 4] = Default::default();
    let plane = |name: &str| face.channel(name).unwrap_or_default();
    for ((r, g), b) in plane("R").iter().zip(plane("G")).zip(plane("B")) {
        let code = encode_rgbd([*r, *g, *b], &mut report);
        planes.iter_mut().zip(code).for_each(|(p, c)| p.push(f32::from(c) / 255.0));
    }
    let [r, g, b, a] = planes;
    let mut out = Raster::rgb(face.width, face.height, [r, g, b]);
    out.channels.push(Channel { name: "A".into(), data: a });
    (out, report)
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

    #[test]
    fn rgbd_faces_decode_to_the_colours() {
        let face = Raster::rgb(2, 1, [vec![0.5, 20.0], vec![1.0, 2.0], vec![0.0, 1.0]]);
        let (out, report) = rgbd(&face);
        assert_eq!(report, WriteReport::default());
        let code =
            |i: usize| ["R", "G", "B", "A"].map(|n| (out.channel(n).unwrap()[i] * 255.0).round() as u8);
        let got = decode_rgbd(code(1));
        assert!((got[0] - 20.0).abs() < 0.1 && (got[2] - 1.0).abs() < 0.1, "{got:?}");
    }
}
