//! The files of the glTF extension EXT_lights_image_based: RGBD faces and irradiance coefficients.

use crate::files::Written;
use crate::{Engine, Level};
use serde_json::json;
use std::path::Path;
use steradian_formats::packed::encode_rgbd;
use steradian_formats::{Channel, FormatError, Raster, WriteOptions, WriteReport, write_atomic, write_image};
use steradian_light::load::arrangement;
use steradian_sphere::sh::ShRgb;

/// Writes them.
pub(crate) fn gltf(
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
            let (raster, report) = rgbd(&arrangement::face(&cube, face));
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
        "irradianceCoefficients": engine.coefficients.of(sh),
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
    use steradian_formats::packed::decode_rgbd;

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
