//! Outputs: formats, provenance, and values that a format could not hold.

use crate::{Destinations, Error, Notice, Session};
use std::path::Path;
use steradian_formats::{
    Container, Raster, TexelFormat, TextureLevels, WriteOptions, WriteReport, write_atomic, write_image,
};
use steradian_light::adjust::share_beyond;
use steradian_render::plot::Drawing;
use steradian_render::{Develop, Display, Film, ToneMapper};
use steradian_sphere::SphereImage;

/// Extensions of image files that are written.
pub const IMAGES: [&str; 5] = ["exr", "hdr", "pic", "pfm", "png"];

/// The extension of animated PNG files.
pub const ANIMATION: &str = "apng";

/// Frames a second of turntables.
pub const FRAME_RATE: u16 = 24;

/// Is the extension of a name one of `known`, which are in lower case?
pub fn has_extension(path: &Path, known: &[&str]) -> bool {
    path.extension().is_some_and(|e| known.iter().any(|k| e.eq_ignore_ascii_case(k)))
}

/// Does a name end in [`ANIMATION`]?
pub fn is_animation(path: &Path) -> bool {
    has_extension(path, &[ANIMATION])
}

/// A number of bytes for people: "12 bytes", "12.3 kB", "12.3 MB" (powers of ten).
pub fn size_in_words(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} bytes"),
        1_000..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        _ => format!("{:.1} MB", bytes as f64 / 1e6),
    }
}

/// A name without its folders.
pub fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.to_string_lossy(), |n| n.to_string_lossy()).into_owned()
}

/// Refuses an output whose extension is none of `known`, or whose folder is missing. To be called before the
/// work, so that it is not done in vain.
pub fn check_output(path: &Path, known: &[&str]) -> Result<(), Error> {
    if has_extension(path, known) {
        return Destinations::default().file("`output`", path);
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let there_are: Vec<String> = known.iter().map(|k| format!(".{k}")).collect();
    let what = match extension {
        Some(e) => format!("cannot write '.{e}' files"),
        None => "the name has no extension to tell the format".into(),
    };
    Err(Error::usage(format!("{}: {what}; use one of {}", path.display(), there_are.join(" "))))
}

/// Refuses texel formats where the output is no texture.
pub fn check_format(format: Option<TexelFormat>, path: &Path) -> Result<(), Error> {
    match format {
        Some(f) if Container::of_name(path).is_none() => Err(Error::usage(format!(
            "{}: `format` {} is for .ktx2, .ktx and .dds",
            path.display(),
            f.name()
        ))),
        _ => Ok(()),
    }
}

impl Session {
    /// As [`check_output`], and announces the output: no input may be it.
    pub fn check_output(&mut self, path: &Path, known: &[&str]) -> Result<(), Error> {
        check_output(path, known)?;
        self.writes(path)
    }

    /// Writes an image to a file, with provenance; values that the format could not hold are reported and
    /// returned.
    pub fn write_image(
        &self,
        path: &Path,
        raster: &Raster,
        mut options: WriteOptions,
    ) -> Result<WriteReport, Error> {
        options.metadata.extend(self.provenance_pairs());
        let report = self.write_untold(path, raster, &options)?;
        let share = || clipped_share(raster, report);
        self.tell_lost(path, report, (report.clipped > 0).then(share));
        Ok(report)
    }

    /// An image as it is to a file; what it could not hold is returned.
    fn write_untold(
        &self,
        path: &Path,
        raster: &Raster,
        options: &WriteOptions,
    ) -> Result<WriteReport, Error> {
        self.check()?;
        check_output(path, &IMAGES)?;
        self.spares(path)?;
        Ok(write_image(path, raster, options)?)
    }

    /// An image of light from all directions, or a face of it, to a file, with provenance; what the file
    /// could not hold is returned and not told.
    pub(crate) fn write_light(
        &self,
        path: &Path,
        raster: &Raster,
        mut options: WriteOptions,
    ) -> Result<WriteReport, Error> {
        options.metadata.extend(self.provenance_pairs());
        self.write_untold(path, raster, &options)
    }

    /// A film: tone-mapped as PNG, linear otherwise.
    pub fn write_film(&self, path: &Path, film: Film, develop: Develop) -> Result<(), Error> {
        // Tone mapping would make black of it.
        let bad = |plane: &Vec<f32>| plane.iter().position(|x| !x.is_finite());
        if let Some(k) = film.rgb.iter().find_map(bad) {
            let (x, y) = (k % film.width, k / film.width);
            let why = format!("pixel ({x}, {y}) is not finite: scale the light down");
            return Err(Error::failed(format!("{}: {why}", path.display())));
        }
        if !has_extension(path, &["png"]) {
            // OpenEXR's alpha is associated; formats without alpha keep the background.
            let raster =
                if has_extension(path, &["exr"]) { film.into_associated() } else { film.into_raster() };
            return self.write_image(path, &raster, WriteOptions::default()).map(|_| ());
        }
        let metadata = vec![
            ("steradian.exposure".to_string(), develop.ev.to_string()),
            ("steradian.tone_mapper".to_string(), develop.mapper.name().to_string()),
        ];
        self.write_display(path, &develop.film(&film), metadata)
    }

    /// A display picture as PNG.
    pub fn write_display(
        &self,
        path: &Path,
        picture: &Display,
        metadata: Vec<(String, String)>,
    ) -> Result<(), Error> {
        let plane = |c: usize| picture.rgb.iter().skip(c).step_by(3).map(|v| f32::from(*v) / 255.0).collect();
        let raster = Raster::rgb(picture.width, picture.height, [plane(0), plane(1), plane(2)]);
        let options = WriteOptions { metadata, already_encoded: true, ..WriteOptions::default() };
        self.write_image(path, &raster, options).map(|_| ())
    }

    /// An image to a file; a PNG through `mapper` where one is given.
    pub fn write_toned(
        &self,
        path: &Path,
        raster: Raster,
        mapper: Option<ToneMapper>,
        mut options: WriteOptions,
    ) -> Result<WriteReport, Error> {
        let Some(mapper) = mapper.filter(|_| has_extension(path, &["png"])) else {
            return self.write_image(path, &raster, options);
        };
        let film = Film::from_raster(raster).ok_or_else(|| Error::failed("the image has no colour"))?;
        options.metadata.push(("steradian.tone_mapper".into(), mapper.name().into()));
        self.write_display(path, &Develop { ev: 0.0, mapper }.film(&film), options.metadata)?;
        Ok(WriteReport::default())
    }

    /// Pictures of one size as an animated PNG that repeats for ever, of `per_second` frames.
    pub fn write_animation(&self, path: &Path, frames: &[Display], per_second: u16) -> Result<(), Error> {
        let Some(first) = frames.first() else { return Err(Error::failed("an animation without frames")) };
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, first.width as u32, first.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let encode = |mut encoder: png::Encoder<'_, &mut Vec<u8>>| {
            encoder.set_animated(frames.len() as u32, 0)?;
            encoder.set_frame_delay(1, per_second)?;
            for (key, value) in self.provenance_pairs() {
                encoder.add_itxt_chunk(key, value)?;
            }
            let mut writer = encoder.write_header()?;
            for frame in frames {
                self.task.check().map_err(|_| std::io::Error::from(std::io::ErrorKind::Interrupted))?;
                writer.write_image_data(&frame.rgb)?;
            }
            writer.finish()
        };
        let encoded = encode(encoder);
        self.check()?;
        encoded.map_err(|e| Error::failed(format!("{}: cannot encode: {e}", path.display())))?;
        Ok(write_atomic(path, |w| w.write_all(&bytes))?)
    }

    /// A drawing: .svg or .png.
    pub fn write_drawing(&self, path: &Path, drawing: &Drawing) -> Result<(), Error> {
        match path.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
            Some("svg") => Ok(write_atomic(path, |w| w.write_all(drawing.svg().as_bytes()))?),
            Some("png") => self.write_display(path, &drawing.display(), Vec::new()),
            _ => Err(Error::usage(format!("{}: plots are .svg or .png", path.display()))),
        }
    }

    /// A cube map as a texture of one level, with provenance where the container has room.
    pub fn write_cube(
        &self,
        path: &Path,
        image: &SphereImage,
        format: TexelFormat,
        metadata: Vec<(String, String)>,
    ) -> Result<WriteReport, Error> {
        let container = Container::of_name(path).unwrap_or(Container::Ktx2);
        let [r, g, b] = &image.planes;
        let texels = (0..r.len()).flat_map(|i| [r[i], g[i], b[i], 1.0]).collect();
        let mut pairs = self.provenance_pairs();
        pairs.push(("steradian.profile".into(), "steradian".into()));
        pairs.extend(metadata);
        let (width, height) = (image.width, image.height);
        let texture = TextureLevels { width, height, faces: 6, levels: vec![texels], metadata: pairs };
        let report = container.write(path, &texture, format)?;
        let share = format.largest().map(|most| share_beyond(image, most.into()));
        self.tell_lost(path, report, share);
        Ok(report)
    }

    /// Tells what a format could not hold; `share` is the part of the light that was clipped, where the file
    /// holds light.
    pub fn tell_lost(&self, path: &Path, report: WriteReport, share: Option<f64>) {
        if report.clipped > 0 || report.vanished > 0 {
            self.tell(Notice::Lost { path: path.into(), report, share });
        }
    }
}

/// What a picture lost, as a part of the sum of its samples, coverage apart.
fn clipped_share(raster: &Raster, report: WriteReport) -> f64 {
    let colours = raster.channels.iter().filter(|c| c.name != "A").flat_map(|c| &c.data);
    let whole: f64 = colours.map(|v| f64::from(v.abs())).sum();
    if whole > 0.0 { report.lost / whole } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_in_words() {
        let words = [12, 12_345, 12_345_678].map(size_in_words);
        assert_eq!(words, ["12 bytes", "12.3 kB", "12.3 MB"]);
    }
}
