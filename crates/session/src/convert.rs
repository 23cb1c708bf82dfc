//! Environments from one layout, format, size or orientation to another.

use crate::{Adjust, Error, Notice, Session, has_extension, is_sky};
use std::path::{Path, PathBuf};
use steradian_formats::{Container, ExrSamples, Raster, TexelFormat, WriteOptions, WriteReport};
use steradian_light::adjust::{self, share_beyond};
use steradian_light::load::{Arrangement, arrangement};
use steradian_light::suns::{self, Taken};
use steradian_render::ToneMapper;
use steradian_sphere::SphereImage;

/// Conversion of an environment.
#[derive(Debug, Clone)]
pub struct Request {
    /// Image, several separated by commas, a pattern with {}, a texture, or a sky spec.
    pub input: String,
    /// How the environment is read, rotated and scaled.
    pub adjust: Adjust,
    /// Level of a texture.
    pub level: usize,
    /// Are suns and lamps taken out of it?
    pub extract_suns: bool,
    /// Layout of the output; `None`: that of the input, and cubes for textures and files of faces.
    pub to: Option<Arrangement>,
    /// Width and height; equal numbers are a side. `None`: the resolution of the input.
    pub size: Option<(usize, usize)>,
    /// Image, texture, or with {} in the name a file for each face ([`files`]).
    pub output: PathBuf,
    /// Texels of a texture; `None`: 32-bit floats, or with `half` 16-bit ones.
    pub format: Option<TexelFormat>,
    /// Half floats in .exr and textures?
    pub half: bool,
    /// Tone mapper of .png; `None`: linear, which clips.
    pub tone_mapper: Option<ToneMapper>,
}

/// An environment that was written.
#[derive(Debug, Clone)]
pub struct Converted {
    /// Its layout.
    pub layout: Arrangement,
    /// Width and height of a face or of the whole image.
    pub size: (usize, usize),
    /// Values that the file format could not hold.
    pub report: WriteReport,
    /// The part of the luminous flux that the files' format clipped.
    pub share: f64,
    /// What was taken out of it, where that was asked for.
    pub suns: Option<Taken>,
}

/// The largest half float.
const HALF: f32 = 65504.0;

/// The files that an output stands for: itself, or with {} in its name those of the six faces.
pub fn files(output: &Path) -> Vec<PathBuf> {
    let name = output.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    if !name.contains("{}") {
        return vec![output.into()];
    }
    let parts = ["px", "nx", "py", "ny", "pz", "nz"];
    parts.map(|part| output.with_file_name(name.replacen("{}", part, 1))).into()
}

impl Request {
    fn write_one(
        &self,
        path: &Path,
        raster: Raster,
        target: Arrangement,
        session: &Session,
    ) -> Result<WriteReport, Error> {
        let mut options = WriteOptions::default();
        if self.half {
            options.exr_samples = ExrSamples::Half;
        }
        // A picture for the eye is no light.
        if self.tone_mapper.is_some() && has_extension(path, &["png"]) {
            return session.write_toned(path, raster, self.tone_mapper, options);
        }
        options.metadata = target.metadata();
        session.write_light(path, &raster, options)
    }

    /// The largest radiance that the output holds.
    fn largest(&self) -> f64 {
        let image = |extension| has_extension(&self.output, &[extension]);
        match Container::of_name(&self.output) {
            Some(_) => self.texels().largest().map_or(f64::INFINITY, f64::from),
            None if image("png") => 1.0,
            None if image("exr") && self.half => f64::from(HALF),
            None => f64::INFINITY,
        }
    }

    /// Texels of a texture.
    fn texels(&self) -> TexelFormat {
        self.format.unwrap_or(if self.half { TexelFormat::Rgba16f } else { TexelFormat::Rgba32f })
    }
}

impl Session {
    /// Writes an environment in another form.
    pub fn convert(&mut self, r: &Request) -> Result<Converted, Error> {
        let (image, suns) = if r.extract_suns { self.sunless(r)? } else { (self.whole(r)?, None) };
        let files = files(&r.output);
        let texture = Container::of_name(&r.output).is_some();
        let cube = files.len() > 1 || texture;
        let layout = r.to.unwrap_or(if cube { Arrangement::Cube } else { Arrangement::of(image.layout) });
        if cube && layout != Arrangement::Cube {
            let why = "holds cube faces; `to` is another layout";
            return Err(Error::usage(format!("{}: {why}", r.output.display())));
        }
        self.check()?;
        let side = |s| layout.side(s).map_err(|e| Error::usage(format!("`size`: {e}")));
        let image = layout.shaped(image, r.size.map(side).transpose()?);
        let (mut size, mut report) = ((image.width, image.height), WriteReport::default());
        let share = share_beyond(&image, r.largest());
        if texture {
            report = self.write_cube(&r.output, &image, r.texels(), Vec::new())?;
        } else if let [path] = &files[..] {
            let raster = layout.arranged(image);
            size = (raster.width, raster.height);
            report = r.write_one(path, raster, layout, self)?;
        } else {
            for (face, path) in files.iter().enumerate() {
                report.merge(r.write_one(path, arrangement::face(&image, face), layout, self)?);
            }
        }
        if !texture {
            self.tell_lost(&r.output, report, Some(share));
        }
        Ok(Converted { layout, size, report, share, suns })
    }

    /// The input, turned and scaled, without its suns.
    fn sunless(&mut self, r: &Request) -> Result<(SphereImage, Option<Taken>), Error> {
        if r.level > 0 {
            return Err(Error::usage("`extract-sun` takes level 0"));
        }
        let mut lights = self.light(&r.input, &r.adjust)?;
        let taken = suns::take(&mut lights);
        self.note(taken.metadata());
        Ok((lights.into_image(), Some(taken)))
    }

    /// The input, turned and scaled; a sky's sun is drawn into it.
    fn whole(&mut self, r: &Request) -> Result<SphereImage, Error> {
        let mut image = if is_sky(&r.input) {
            let still = Adjust { light_exposure: 0.0, ..r.adjust };
            let lights = self.light(&r.input, &still)?;
            if !lights.disks.is_empty() {
                self.tell(Notice::SunDrawn);
            }
            lights.with_disks_drawn()
        } else {
            let image = self.map(&r.input, &r.adjust, r.level)?.image;
            if r.adjust.rotate == 0.0 { image } else { adjust::turned_about_y(&image, r.adjust.rotate) }
        };
        adjust::scale(&mut image, r.adjust.gain());
        Ok(image)
    }
}
